"""A part of a picture, looked for in one picture after another, and how sure that is."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..core.model.motions import Motion, Similarity
from . import registration
from .footage import Footage
from .registration import Match, Part

COVERED = "the subject is covered, or looks too different"
LEFT = "the subject has left the picture"
SURE = 0.5  # from here on a frame is within about a pixel of 640
_LOST = 0.12  # below it nothing was found
_AGAIN = 0.3  # below it nothing was found where it might be anywhere
DOUBTFUL = 0.2  # below it, it may as well be anywhere
_DRIFT, _LEAST = 0.95, 0.1  # what a later look is worth beside the one before it, and at least
_SHIFTED = 0.6  # what a location is worth where rotation and scale could not be found
_FADING = 0.6  # below it another frame is taken to compare with beside the first
_AROUND = 0.05  # widths of the picture around its place within which it is sought at least
# Frames through which the corners of what is found are traced back; the share of them that has to be traced, and what
# a frame keeps of the trust where they are not; how far they may be off, in lengths of the part, and the share of them
# that may not be.
_BACK, _TRACED, _UNTRACED, _ASTRAY, _AGREEING = 8, 0.1, 0.85, 0.15, 0.5
_KEPT = 0.999  # so much of the trust a step keeps at most
_BRIEF, _LEFT = 8, 3  # so many unsure frames between sure ones are more than a moment, and at the end of a track
_REPEATED = 0.3  # what a part is worth that looks like what is beside it
_NONE = np.zeros(0, complex)


class Sighting(NamedTuple):
    """Where something is in a picture: its motion from the first one, and how sure that is, 0 to 1.

    held: (n,) complex, the corners in the picture that tell it"""

    motion: Similarity
    confidence: float
    held: np.ndarray = _NONE


class PartPursuit:
    """A part of a picture, looked for in one picture after another.

    reason: why it was not found in the last one"""

    def __init__(self, part: Part, footage: Footage, frame: int, motion: Motion) -> None:
        """frame: the part's"""
        self._first, self._footage, self._motion, self.reason = part, footage, motion, COVERED
        # the motion up to the last picture in which it was found, and its last step
        self._known = self._speed = Similarity()
        self._missed = 0  # for how many pictures it was not found
        self._look = _Look(part, Similarity(), 1.0)  # how it looked later, if it is no longer like the first
        # the last pictures in which it was found, the motion, its confidence
        self._seen = deque([(footage.picture(frame), Similarity(), 1.0)], _BACK)
        self._trust = 1.0  # how sure it is that what is followed is still the part

    def next(self, frame: int) -> Sighting | None:
        """Where it is in a frame's picture; None: it is not there."""
        picture, missed = self._footage.picture(frame), self._missed
        sighting = None if missed else self._near(picture, self._speed.after(self._known))
        if sighting is None:
            self._look_anew()
            sighting = self._elsewhere(picture, missed, self._look)
        elif sighting.confidence < DOUBTFUL:
            sighting = self._elsewhere(picture, missed) or sighting
        if sighting is None:
            if not missed:
                self.reason = LEFT if self._leaves(picture) else COVERED
            self._missed += 1
            return None
        self._speed = sighting.motion.after(self._known.inverse()) if not missed else Similarity()
        self._trust = self._trusted(picture, sighting, goes_on=not missed)
        self._known, self._missed = sighting.motion, 0
        if missed:
            self._seen.clear()
        self._seen.append((picture, sighting.motion, sighting.confidence))
        return Sighting(sighting.motion, self._trust)

    def _trusted(self, picture: np.ndarray, sighting: Sighting, goes_on: bool) -> float:
        """How sure it is that it is the part. What goes on is as sure as before, as far as its corners come from there.
        It is as sure as it is like the first look where they do, unless that was lost and is seen elsewhere, too.
        goes_on: it was found in the picture before."""
        held = self._held(picture, sighting) if goes_on else None
        kept = _KEPT * self._trust * (_UNTRACED if held is None else held) if goes_on else 0.0
        if sighting.confidence <= kept or (held is not None and held < 1):
            return kept
        was_lost = sighting.confidence >= SURE and (self._trust < SURE or not goes_on)
        return kept if was_lost and self._first.lookalike(picture, sighting.motion) else sighting.confidence

    def _held(self, picture: np.ndarray, sighting: Sighting) -> float | None:
        """The share, up to 1, of the corners by which it was found that have come from where it was some pictures
        before: what has slipped onto something else comes from elsewhere. None: hardly any can be traced."""
        pictures, back = [picture, *(each[0] for each in reversed(self._seen))], sighting.motion.inverse()
        step = self._known.after(back)(sighting.held) - sighting.held
        traced = registration.traced(pictures, sighting.held, step)
        off = np.abs(traced - self._seen[0][1].after(back)(sighting.held))[np.isfinite(traced)]
        if len(off) < _TRACED * len(traced):
            return None
        return min(float((off < _ASTRAY * max(self._first.box[2:])).mean()) / _AGREEING, 1.0)

    def _near(self, picture: np.ndarray, guess: Similarity) -> Sighting | None:
        """As `next`, near to a guess: as it looked first or, if that is not sure, as it looked later."""
        match = self._first.find(picture, guess, self._motion)
        sure = confidence(match, picture)
        if match and sure >= SURE:
            self._first.learn(match)
        if match and sure >= _FADING:
            return Sighting(match.motion, sure, match.held)
        later = self._by_later_look(picture, guess)
        if later is None:
            return Sighting(match.motion, sure, match.held) if match and sure >= _LOST else None
        points = self._first.points
        if sure < SURE and np.abs(later.motion(points) - guess(points)).max() > 1:
            # from there the first look may be near enough
            again = self._first.find(picture, later.motion, self._motion)
            if confidence(again, picture) > sure:
                match, sure = again, confidence(again, picture)
        if match is None or sure < min(SURE, later.confidence):
            return later
        return Sighting(match.motion, sure, match.held)

    def _by_later_look(self, picture: np.ndarray, guess: Similarity) -> Sighting | None:
        if self._look.part is self._first:
            self._look_anew()
        sighting = self._look.find(picture, guess, self._motion)
        if sighting is None or sighting.confidence < SURE * self._look.worth:
            self._look_anew()
            sighting = self._look.find(picture, guess, self._motion) or sighting
        return sighting

    def _look_anew(self) -> None:
        """Takes the look that it had when it was found last."""
        picture, motion, worth = self._seen[-1]
        if later := self._first.again(picture, motion):
            self._look = _Look(later, motion, max(_DRIFT * worth, _LEAST))

    def _elsewhere(self, picture: np.ndarray, missed: int, *looks: _Look) -> Sighting | None:
        """As `_near`, of all places where it may be by now; only if it looks as it did first, or as in other looks."""
        radius = _AROUND * picture.shape[1] * (1 + missed / 4)
        sightings = []
        for look in (_Look(self._first, Similarity(), 1.0), *looks):
            from_there = self._known.after(look.motion.inverse())
            for guess in (from_there, look.part.seek(picture, from_there, radius)):
                match = look.part.find(picture, guess, self._motion) if guess else None
                if match and (sure := confidence(match, picture)) >= _AGAIN:
                    sightings.append(Sighting(match.motion.after(look.motion), look.worth * sure, match.held))
        return max(sightings, key=lambda each: each.confidence, default=None)

    def _leaves(self, picture: np.ndarray) -> bool:
        """Whether most of the part would lie outside of the picture if it went on."""
        places = self._speed.after(self._speed).after(self._known)(self._first.points)
        return bool(registration.inside(picture, places).mean() < 0.5)


@dataclass(frozen=True)
class _Look:
    """How a part looked in some picture; motion: from the first picture to that one; worth: the confidence of that."""

    part: Part
    motion: Similarity
    worth: float

    def find(self, picture: np.ndarray, guess: Similarity, motion: Motion) -> Sighting | None:
        """Where it is by corners or, where these do not agree on the motion, by the location alone."""
        guess = guess.after(self.motion.inverse())
        ways: list[tuple[Motion, float]] = [(motion, 1.0), ("location", _SHIFTED)]
        for way, share in ways:
            match = self.part.find(picture, guess, way)
            if match and (sure := confidence(match, picture)) >= _LOST:
                return Sighting(match.motion.after(self.motion), share * self.worth * sure, match.held)
        return None


def confidence(match: Match | None, picture: np.ndarray) -> float:
    """How sure a match is, 0 to 1: by its expected error, how many corners agree, and how like the pixels are: the more
    alike, the fewer corners have to agree."""
    if match is None:
        return 0.0
    error = match.error * 640 / max(picture.shape)
    likeness = max(match.likeness, 0.0)
    factors = likeness / 0.6, match.share / (0.9 - 0.6 * likeness), match.visible / 0.6
    return float(np.prod([min(factor, 1.0) for factor in factors])) / (1 + (error / 0.7) ** 2)


def lost(frames: np.ndarray, sure: np.ndarray) -> int | None:
    """The frame of a track at which its subject was lost: at the first of its unsure stretches that lasts, the end from
    which it was tracked; None: nowhere.

    frames: (n,) ascending; sure: (n,) confidence"""
    ends = np.flatnonzero(np.diff(np.concatenate([[False], sure < SURE, [False]])))
    for first, end in ends.reshape(-1, 2):
        if end - first >= (_BRIEF if first > 0 and end < len(frames) else _LEFT):
            return int(frames[first if first else end - 1])
    return None


def distinctness(part: Part, width: int) -> float:
    """How sure it is that a part is not taken for what is beside it in a picture of that width, up to 1."""
    return float(np.clip((1 - part.rival(_AROUND * width)) / (1 - registration.ALIKE), _REPEATED, 1))
