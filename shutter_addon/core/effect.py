"""The effect as plain data: shutters, regions, options and source time, each a value or a channel over time.

A recipe gives one (Recipe.effect), and so does an effect strip in Blender (blender/data/snapshot.py). Frames are those
of whoever made it: a recipe's count from 1, Blender's are the edit's timeline frames.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from . import keyframes, limits, scribbles, shutters
from .frame_state import FrameState
from .messages import UserError

_CLOSED = 'shutter "{name}" at frame {frame}: {fault}'
_TOO_MANY = 'region "{name}": more than {most} points with those before it'
_FAR = 'region "{name}": a point of its strokes is nowhere near the picture'


class EffectError(UserError, RuntimeError):
    """The effect cannot be rendered as it stands; the message is one sentence for the user.

    words: what the sentence's braces stand for, so that an interface can translate the sentence (`template`)."""

    def __init__(self, template: str, **words):
        super().__init__(template.format(**words) if words else template)
        self.template, self.words = template, words


class FarStrokeError(ValueError):
    """A point of a stroke is farther from the picture than any effect has it (limits.MAX_DISTANCE)."""


class Channel(Protocol):
    """A value over time."""

    def at(self, frame: float) -> Any:
        """The value at a frame. EffectError: there is none that an effect can have."""


@dataclass(frozen=True)
class Constant:
    """The same value at every frame; an EffectError is raised where the value is asked for."""

    value: Any

    def at(self, _frame: float) -> Any:
        return _given(self.value)


@dataclass(frozen=True)
class Keys:
    """Numbers or arrays at ascending frames, linear in between after the ease of the span (keyframes.eased)."""

    frames: tuple[float, ...]
    values: tuple
    eases: tuple[str, ...]

    def at(self, frame: float) -> np.ndarray:
        before, after, share = eased_span(self.frames, self.eases, frame)
        return (1 - share) * np.asarray(self.values[before]) + share * np.asarray(self.values[after])


@dataclass(frozen=True)
class Samples:
    """Values at frames where they were sampled, and nowhere else. An EffectError among them is raised where the value
    is asked for.

    keys: frames and eases of the keys of the curve that was sampled, ascending; none where it is no curve of keys."""

    values: dict[float, Any]
    keys: tuple[tuple[float, str], ...] = ()

    def at(self, frame: float) -> Any:
        """KeyError: the frame was not sampled."""
        return _given(self.values[frame])


@dataclass(frozen=True)
class SourceTime:
    """Channel of (source frame, whether it runs backward from there), made of a channel of numbers.

    Where time stands still it runs as it came to the last of its `keys`, unless it stood still before. A jump is no
    way.
    """

    numbers: Channel
    keys: tuple[tuple[float, str], ...]

    def at(self, frame: float) -> tuple[float, bool]:
        time, later = float(self.numbers.at(frame)), float(self.numbers.at(frame + 0.5))
        return time, self._came_backward(frame) if later == time else later < time

    def _came_backward(self, frame: float) -> bool:
        for key, _ in reversed(self.keys):
            if key <= frame:
                earlier, later = self.numbers.at(key - 0.5), self.numbers.at(key - 0.25)
                if earlier != later:
                    return bool(later < earlier)
        return False


@dataclass(frozen=True)
class Bars:
    """A shutter's bars (L,) float64 over time.

    channel: the bars where they are not displaced: on keys, outside of them, and between keys by value
    keys: frames and eases of the keys, ascending; without any, `channel` alone counts
    share: channel of the share 0 to 1 of the way from the key before a frame to the key after it; None: by the eases"""

    channel: Channel
    keys: tuple[tuple[float, str], ...] = ()
    share: Channel | None = None

    def at(self, frame: float, interpolation: str) -> np.ndarray:
        """Between keys by displacement (paper §3.4.1, over time), or by `channel`: where interpolation is "value", and
        on the way to and from a closed shutter, which is no displacement."""
        if not self.keys:
            return self.channel.at(frame)
        frames = [key for key, _ in self.keys]
        before, after, _ = keyframes.span(frames, frame)
        if before == after:
            return self.channel.at(frames[before])
        if interpolation == "value":
            return self.channel.at(frame)
        first, second = self.channel.at(frames[before]), self.channel.at(frames[after])
        if not (first.any() and second.any()):
            return self.channel.at(frame)
        return keyframes.between_bars(first, second, self._share_at(frame, frames))

    def _share_at(self, frame: float, frames: list[float]) -> float:
        if self.share is not None:
            return self.share.at(frame)
        return eased_span(frames, [ease for _, ease in self.keys], frame)[2]


@dataclass(frozen=True)
class Shutter:
    """name, color: RGB display values, 0 to 1"""

    name: str
    color: tuple[float, float, float]
    bars: Bars


@dataclass(frozen=True)
class Drawings:
    """A region's strokes over time, before it is moved: drawings at ascending frames, each a list of strokes (n, 2); in
    between every stroke goes from one drawing to the next with the ease of the span.

    aspect: the picture's width over its height
    placement: channel of the matrix (3, 3) from the strokes' space to fractions of the picture, or of None where they
    are not on it; without one, strokes are fractions of the picture"""

    frames: tuple[float, ...]
    strokes: tuple
    eases: tuple[str, ...]
    aspect: float
    placement: Channel | None = None

    def at(self, frame: float) -> list[np.ndarray]:
        """Strokes (n, 2) in fractions of the picture. FarStrokeError: a point is nowhere near it."""
        placement = self.placement and self.placement.at(frame)
        if not self.frames or (self.placement and placement is None):
            return []
        before, after, share = eased_span(self.frames, self.eases, frame)
        first, second = (self._on_picture(index, placement) for index in (before, after))
        return scribbles.between_strokes(first, second, share, self.aspect)

    def drawing(self, index: int, frame: float) -> list[np.ndarray]:
        """The strokes of a drawing as they lie on the picture at a frame; raises as `at`."""
        placement = self.placement and self.placement.at(frame)
        return [] if self.placement and placement is None else self._on_picture(index, placement)

    def _on_picture(self, index: int, placement: np.ndarray | None) -> list[np.ndarray]:
        if placement is None:
            return self.strokes[index]
        placed = [points @ placement[:2, :2].T + placement[:2, 2] for points in self.strokes[index]]
        if not all((np.abs(points) <= limits.MAX_DISTANCE).all() for points in placed):
            raise FarStrokeError
        return placed


@dataclass(frozen=True)
class Region:
    """A scribble of a shutter that moves.

    shutter: index of the shutter; kind: "line" or "lasso", and
    width: of its lines, fraction of the picture's height
    location: (2,) fractions of the picture; rotation: degrees counter-clockwise; scale: about the shape's centre"""

    name: str
    shutter: int
    kind: Channel
    width: Channel
    drawings: Drawings
    location: Channel = Constant((0.0, 0.0))
    rotation: Channel = Constant(0.0)
    scale: Channel = Constant(1.0)

    def at(self, frame: float) -> scribbles.Shape:
        location, rotation, scale = (channel.at(frame) for channel in (self.location, self.rotation, self.scale))
        moved = scribbles.transform(self.unmoved(frame), location, rotation, scale, self.drawings.aspect)
        return scribbles.Shape(self.shutter, self.kind.at(frame), self.width.at(frame), moved)

    def unmoved(self, frame: float) -> list[np.ndarray]:
        """The strokes (n, 2) on the picture at a frame, as they are drawn. EffectError: they are nowhere near it."""
        return self._near(lambda: self.drawings.at(frame))

    def drawing(self, index: int, frame: float) -> list[np.ndarray]:
        """The strokes (n, 2) of one of the drawings as they lie on the picture at a frame, not moved yet. EffectError:
        they are nowhere near it."""
        return self._near(lambda: self.drawings.drawing(index, frame))

    def _near(self, strokes: Callable) -> list[np.ndarray]:
        try:
            return strokes()
        except FarStrokeError:
            raise EffectError(_FAR, name=self.name) from None


@dataclass(frozen=True)
class Effect:
    """The whole effect but its source.

    shutters: the first is the default
    regions: later ones lie over earlier ones
    options: channel of frame_state.Options
    time: channel of (source frame, whether it runs backward), the source's first frame is 1; None: the strip's own
    timing tells what is shown"""

    shutters: tuple[Shutter, ...]
    regions: tuple[Region, ...]
    options: Channel
    time: Channel | None = None

    def at(self, frame: float) -> FrameState:
        """The effect at a frame. EffectError: no picture can be made of it."""
        options = self.options.at(frame)
        bars = [self.bars_at(index, frame) for index in range(len(self.shutters))]
        return FrameState(options, np.stack(bars), tuple(self._shapes_at(frame)))

    def _shapes_at(self, frame: float):
        room = limits.MAX_POINTS
        for region in self.regions:
            shape = region.at(frame)
            room -= sum(map(len, shape.strokes))
            if room < 0:
                raise EffectError(_TOO_MANY, name=region.name, most=limits.MAX_POINTS)
            yield shape

    def bars_at(self, index: int, frame: float) -> np.ndarray:
        """Bars (L,) of a shutter at a frame. EffectError: no picture can be made of them."""
        bars = self.shutters[index].bars.at(frame, self.options.at(frame).interpolation)
        return self.checked(index, frame, bars)

    def checked(self, index: int, frame: float, bars: np.ndarray) -> np.ndarray:
        """The bars (L,) of a shutter at a frame. EffectError: no picture can be made of them."""
        try:
            return shutters.check_bars(bars)
        except shutters.ShutterError as error:
            name = self.shutters[index].name
            raise EffectError(_CLOSED, name=name, frame=f"{frame:g}", fault=str(error)) from None


def eased_span(frames, eases, frame: float) -> tuple[int, int, float]:
    """As keyframes.span, the share with the ease of the span: eases are of the keys that begin them."""
    before, after, share = keyframes.span(frames, frame)
    return before, after, keyframes.eased(share, eases[before])


def _given(value):
    if isinstance(value, EffectError):
        raise value
    return value
