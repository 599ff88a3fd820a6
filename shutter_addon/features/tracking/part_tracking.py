"""Follows a part of a picture from frame to frame, with a confidence."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...core.model.motions import Motion, Similarity
from ...media.footage import Footage
from . import registration
from .registration import Match, Part

COVERED = "the subject is covered, or looks too different"
LEFT = "the subject has left the picture"
# Confidences:
SURE = 0.5  # from here on, errors are within about a pixel of 640
_LOST = 0.12  # below, nothing was found
_AGAIN = 0.3  # below, nothing was found in a search of a larger area
DOUBTFUL = 0.2  # below, a larger area is searched
_DRIFT, _LEAST = 0.95, 0.1  # the factor for a later look, and its least confidence
_SHIFTED = 0.6  # the factor if only the location was found, without rotation and scale
_FADING = 0.6  # below, a later look is compared as well
_REPEATED = 0.3  # the factor for a part that looks like its surroundings

_AROUND = 0.05  # the least search radius in widths of the picture
# Corners are traced back through _BACK frames. At least _TRACED of them must be traced, or the trust becomes _UNTRACED
# of it. They may be off by _ASTRAY lengths of the part; _AGREEING of them must not be.
_BACK, _TRACED, _UNTRACED, _ASTRAY, _AGREEING = 8, 0.1, 0.85, 0.15, 0.5
_KEPT = 0.999  # the most of the trust that a step keeps
_BRIEF, _LEFT = 8, 3  # unsure frames after which a subject is lost: between sure ones, and at the end of a track
_NONE = np.zeros(0, complex)


class FoundMotion(NamedTuple):
    """A motion from the first picture to another one.

    Attributes:
        motion: The motion.
        confidence: 0 to 1.
        held: The corners in the other picture that agree with it, (n,) complex.
    """

    motion: Similarity
    confidence: float
    held: np.ndarray = _NONE


class PartTracker:
    """Follows a part of a picture.

    Attributes:
        reason: why it was not found in the last picture
    """

    def __init__(self, part: Part, footage: Footage, frame: int, motion: Motion) -> None:
        """Follow the part from its frame."""
        self._first, self._footage, self._motion, self.reason = part, footage, motion, COVERED
        # the motion to the last picture in which it was found, and its last step
        self._known = self._speed = Similarity()
        self._missed = 0  # pictures since then
        self._look = _Look(part, Similarity(), 1.0)  # how it looked later, if it has changed
        # the last pictures in which it was found, with motion and confidence
        self._seen = deque([(footage.picture(frame), Similarity(), 1.0)], _BACK)
        self._trust = 1.0  # the confidence that this is still the part

    def next(self, frame: int) -> FoundMotion | None:
        """Return its motion to a frame, or None if it is not found."""
        picture, missed = self._footage.picture(frame), self._missed
        sighting = None if missed else self._near(picture, self._speed.after(self._known))
        if sighting is None:
            self._look_anew()
            sighting = self._elsewhere(picture, missed, self._look)
        elif sighting.confidence < DOUBTFUL:
            sighting = self._elsewhere(picture, missed) or sighting
        if sighting is None:
            if not missed:
                going_on = self._speed.after(self._speed).after(self._known)(self._first.points)
                self.reason = LEFT if registration.inside(picture, going_on).mean() < 0.5 else COVERED
            self._missed += 1
            return None
        self._speed = sighting.motion.after(self._known.inverse()) if not missed else Similarity()
        self._trust = self._trusted(picture, sighting, goes_on=not missed)
        self._known, self._missed = sighting.motion, 0
        if missed:
            self._seen.clear()
        self._seen.append((picture, sighting.motion, sighting.confidence))
        return FoundMotion(sighting.motion, self._trust)

    def _trusted(self, picture: np.ndarray, sighting: FoundMotion, goes_on: bool) -> float:
        """Return the confidence that this is still the part.

        It stays as before as far as the corners come from the part's last place. If they all do, it is at least the
        likeness to the first look, unless the part was lost and something else looks like it, too.

        Args:
            picture: the picture
            sighting: what was found in it
            goes_on: whether the part was found in the picture before
        """
        held = self._held(picture, sighting) if goes_on else None
        kept = _KEPT * self._trust * (_UNTRACED if held is None else held) if goes_on else 0.0
        if sighting.confidence <= kept or (held is not None and held < 1):
            return kept
        was_lost = sighting.confidence >= SURE and (self._trust < SURE or not goes_on)
        return kept if was_lost and self._first.lookalike(picture, sighting.motion) else sighting.confidence

    def _held(self, picture: np.ndarray, sighting: FoundMotion) -> float | None:
        """Return the share of its corners that come from its place some pictures before, up to 1.

        They come from elsewhere if tracking slipped onto something else. None: too few can be traced.
        """
        pictures, back = [picture, *(each[0] for each in reversed(self._seen))], sighting.motion.inverse()
        step = self._known.after(back)(sighting.held) - sighting.held
        traced = registration.traced(pictures, sighting.held, step)
        off = np.abs(traced - self._seen[0][1].after(back)(sighting.held))[np.isfinite(traced)]
        if len(off) < _TRACED * len(traced):
            return None
        return min(float((off < _ASTRAY * max(self._first.box[2:])).mean()) / _AGREEING, 1.0)

    def _near(self, picture: np.ndarray, guess: Similarity) -> FoundMotion | None:
        """Find the part near a guess by its first look or, if that is not sure, by a later one."""
        match = self._first.find(picture, guess, self._motion)
        sure = confidence(match, picture)
        if match and sure >= SURE:
            self._first.learn(match)
        if match and sure >= _FADING:
            return FoundMotion(match.motion, sure, match.held)
        later = self._by_later_look(picture, guess)
        if later is None:
            return FoundMotion(match.motion, sure, match.held) if match and sure >= _LOST else None
        points = self._first.points
        if sure < SURE and np.abs(later.motion(points) - guess(points)).max() > 1:
            # starting from there, the first look may be found
            again = self._first.find(picture, later.motion, self._motion)
            if confidence(again, picture) > sure:
                match, sure = again, confidence(again, picture)
        if match is None or sure < min(SURE, later.confidence):
            return later
        return FoundMotion(match.motion, sure, match.held)

    def _by_later_look(self, picture: np.ndarray, guess: Similarity) -> FoundMotion | None:
        if self._look.part is self._first:
            self._look_anew()
        sighting = self._look.find(picture, guess, self._motion)
        if sighting is None or sighting.confidence < SURE * self._look.worth:
            self._look_anew()
            sighting = self._look.find(picture, guess, self._motion) or sighting
        return sighting

    def _look_anew(self) -> None:
        """Take its look in the last picture in which it was found."""
        picture, motion, worth = self._seen[-1]
        if later := self._first.again(picture, motion):
            self._look = _Look(later, motion, max(_DRIFT * worth, _LEAST))

    def _elsewhere(self, picture: np.ndarray, missed: int, *looks: _Look) -> FoundMotion | None:
        """Find the part by its first look or by others, in the area where it may be by now."""
        radius = _AROUND * picture.shape[1] * (1 + missed / 4)
        sightings = []
        for look in (_Look(self._first, Similarity(), 1.0), *looks):
            from_there = self._known.after(look.motion.inverse())
            for guess in (from_there, look.part.seek(picture, from_there, radius)):
                match = look.part.find(picture, guess, self._motion) if guess else None
                if match and (sure := confidence(match, picture)) >= _AGAIN:
                    sightings.append(FoundMotion(match.motion.after(look.motion), look.worth * sure, match.held))
        return max(sightings, key=lambda each: each.confidence, default=None)


@dataclass(frozen=True)
class _Look:
    """How a part looked in a picture, with the motion from the first picture to that one and its confidence."""

    part: Part
    motion: Similarity
    worth: float

    def find(self, picture: np.ndarray, guess: Similarity, motion: Motion) -> FoundMotion | None:
        """Find the part by its motion or, if corners do not agree on that, by its location."""
        guess = guess.after(self.motion.inverse())
        ways: list[tuple[Motion, float]] = [(motion, 1.0), ("location", _SHIFTED)]
        for way, share in ways:
            match = self.part.find(picture, guess, way)
            if match and (sure := confidence(match, picture)) >= _LOST:
                return FoundMotion(match.motion.after(self.motion), share * self.worth * sure, match.held)
        return None


def confidence(match: Match | None, picture: np.ndarray) -> float:
    """Return the confidence of a match, 0 … 1, from its expected error, the agreeing corners and the likeness of
    pixels.

    The more alike the pixels, the fewer corners have to agree.
    """
    if match is None:
        return 0.0
    error = match.error * 640 / max(picture.shape)
    likeness = max(match.likeness, 0.0)
    factors = likeness / 0.6, match.share / (0.9 - 0.6 * likeness), match.visible / 0.6
    return float(np.prod([min(factor, 1.0) for factor in factors])) / (1 + (error / 0.7) ** 2)


def lost(frames: np.ndarray, sure: np.ndarray) -> int | None:
    """Return the frame at which a subject was lost: at the first long stretch of unsure frames. None: nowhere.

    Args:
        frames: (n,) ascending
        sure: (n,) confidences
    """
    ends = np.flatnonzero(np.diff(np.concatenate([[False], sure < SURE, [False]])))
    for first, end in ends.reshape(-1, 2):
        if end - first >= (_BRIEF if first > 0 and end < len(frames) else _LEFT):
            return int(frames[first if first else end - 1])
    return None


def distinctness(part: Part, width: int) -> float:
    """Return the confidence that a part is not confused with its surroundings, up to 1. width: of the picture."""
    return float(np.clip((1 - part.rival(_AROUND * width)) / (1 - registration.ALIKE), _REPEATED, 1))
