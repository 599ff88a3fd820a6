"""What source frames show of each layer, and of what lies behind all: the frames that windows of layers weigh. And
plates: what lies behind layers where a frame does not show it, from other frames, or from what is around."""

from collections.abc import Callable, Iterable
from typing import Any, TypeVar

import numpy as np

from ..core.frames.frame_source import FrameSource, SourceWrapper
from ..core.frames.planes import as_rgba
from ..core.memo import Kept
from ..core.model.frame_state import Layers, Options
from ..core.pixels import compositor, layering
from .layer_frames import LayerMattes, RecentFrames, linear, with_colors

T = TypeVar("T")
Motion = tuple[complex, complex]

# Frames of which both are kept, as several windows load them one after another.
TOGETHER = 4
# How much of what lies behind has to be seen of a pixel that a plate is taken from.
SEEN = 0.9
# How much of an exposed frame counts that is taken from others: a little less than all of it, which would say that no
# layer was in the way (layering.UNCOVERED).
TAKEN_SHARE = 1 - 1 / 64
# The most that it counts: less than whole in half floats, too.
TAKEN_MOST = 1 - 1 / 1024
# Kinds of pixels: seen, taken from another frame, filled from what is around.
OPEN, TAKEN, FILLED = 0, 1, 2


class LayerColors:
    """Frames with the colours of a layer, in the source's samples, and how much (H, W) float32 each pixel counts.

    source: what is read; recent: the same, with the frames that were read last; layers: of the last `begin`
    asked: by source frame whose covered places are taken from others, which these are, and how the camera moves there
    """

    layers: Layers
    _options: Options
    _shot: range

    def __init__(self, source: FrameSource, recent: RecentFrames, mattes: LayerMattes) -> None:
        self._source, self._recent, self._mattes = source, recent, mattes
        self._kept: Kept[tuple, Any] = Kept()
        self.asked: dict[int, dict[int, Motion]] = {}

    def begin(self, layers: Layers, options: Options, shot: range) -> None:
        """What the frames are asked for, until this is called again. shot: the frames that may show what lies behind"""
        self.layers, self._options, self._shot = layers, options, shot
        self._kept.clear()

    def changes(self, layer: int) -> tuple:
        """Hashable: what `frames` of a layer, or with −1 of what lies behind all, changes in the source's."""
        return self._separates, self._options.plate_reach if layer < 0 and self._uncovers else None

    def frames(self, layer: int) -> FrameSource:
        """A source of frames with the colours of a layer, or with −1 of what lies behind all layers."""
        if layer < 0 and self._uncovers:
            return SourceWrapper(self._source, lambda frame: self._uncovered(frame)[0])
        if self._separates:
            return SourceWrapper(self._source, lambda frame: self._separated(frame, layer)[int(layer < 0)])
        return self._source

    def weights(self, layer: int) -> Callable[[int], np.ndarray]:
        """What gives how much of a layer, or of what lies behind all, a frame shows."""
        if layer >= 0:
            return lambda frame: self._mattes.one(self.layers, frame, layer)
        if self._uncovers:
            return lambda frame: self._uncovered(frame)[1]
        return lambda frame: self._mattes.behind(self.layers, frame)

    @property
    def _separates(self) -> bool:
        return self._options.decontaminate and self._source.alpha == "opaque"

    @property
    def _uncovers(self) -> bool:
        return self.layers.camera is not None and self._source.alpha == "opaque"

    def _memo(self, frame: int, name: int | str, make: Callable[[], T]) -> T:
        return self._kept.ask((frame, name), make, TOGETHER * (1 + len(self.layers.shutters)))

    def _separated(self, frame: int, layer: int) -> tuple[np.ndarray, np.ndarray]:
        """A frame with a layer's own colours, and with those behind it; −1: behind all layers."""
        number = 0 if len(self.layers.shutters) == 1 else layer  # behind it is behind all
        return self._memo(frame, number, lambda: self._separate(frame, number))

    def _separate(self, frame: int, number: int) -> tuple[np.ndarray, np.ndarray]:
        mattes = self._mattes.edges(self.layers, frame)
        matte = 1 - layering.behind(mattes) if number < 0 else mattes[number]
        picture, mixed = self._decoded(frame), (matte > 0) & (matte < 1)
        colors = linear(picture, self._source)[..., :3]
        own, behind = (with_colors(picture, c, mixed, self._source) for c in layering.separated(colors, matte))
        return own, behind

    def _decoded(self, frame: int) -> np.ndarray:
        return as_rgba(self._source.decoded(frame))

    def _uncovered(self, frame: int) -> tuple[np.ndarray, np.ndarray]:
        return self._memo(frame, "behind", lambda: self._uncover(frame))

    def _uncover(self, frame: int) -> tuple[np.ndarray, np.ndarray]:
        """What lies behind layers, and how much of it counts. What they cover is taken from other frames where the
        camera's motion is known: of what it pans over, the frames that show it are no mean of all."""
        picture = self._separated(frame, -1)[1] if self._separates else self._decoded(frame)
        seen = self._mattes.behind(self.layers, frame)
        plate, kinds = self._plate(frame, seen < layering.UNCOVERED)
        colors, share = uncovered(linear(picture, self._source)[..., :3], seen, plate, kinds)
        return with_colors(picture, colors, kinds == TAKEN, self._source), share

    def _plate(self, frame: int, covered: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        layers = self.layers
        asked = self.asked[frame] = {}
        for old in [old for old in self.asked if abs(old - frame) > 4096]:
            del self.asked[old]

        def motion(other: int) -> Motion:
            asked[other] = self.motion(frame, other)
            return asked[other]

        return plate(
            covered,
            (other for other in nearest_frames(frame, self._options, self._shot) if other != frame),
            self.linear_part,
            lambda other: self._mattes.behind(layers, other),
            motion,
        )

    def motion(self, frame: int, other: int) -> Motion:
        """How what the camera sees moves from one frame to another."""
        return self.layers.camera.between(frame, other) if self.layers.camera else (1, 0)

    def linear_part(self, frame: int, part: tuple[slice, slice]) -> np.ndarray:
        """Rows and columns of a frame as it was read, in linear light, premultiplied."""
        return linear(self._recent.read(frame)[part], self._source)

    def clear(self) -> None:
        """Forgets all frames."""
        self._kept.clear()
        self.asked.clear()


def nearest_frames(index: int, options: Options, shot: range) -> Iterable[int]:
    """The filmed ones of a shot's frames in reach, in the order in which a plate is taken from them: those nearest to
    frame `index`, of two the earlier. Moments between them are made of these."""
    reach = options.plate_reach * options.step
    near = range(max(index - reach, shot.start), min(index + reach + 1, shot.stop))
    filmed = (frame for frame in near if frame % options.step == 0)
    return sorted(filmed, key=lambda frame: (abs(frame - index), frame))


def plate(
    holes: np.ndarray,
    frames: Iterable[int],
    read: Callable[[int, tuple[slice, slice]], np.ndarray],
    clear: Callable[[int], np.ndarray],
    motion: Callable[[int], tuple[complex, complex]],
) -> tuple[np.ndarray, np.ndarray]:
    """What lies behind layers in the pixels `holes` (H, W) bool: a picture (H, W, 4) float32, scene-linear and
    premultiplied, and the kinds (H, W) uint8 of its pixels.

    frames: source frames, the first is asked first
    read: gives rows and columns of a frame's picture; clear: how much (H, W) of what lies behind is seen in it
    motion: where a point z of this picture lies in a frame: turn · z + shift"""
    height, width = holes.shape
    picture, kinds = np.zeros((height, width, 4), np.float32), np.where(holes, FILLED, OPEN).astype(np.uint8)
    rows, columns = np.nonzero(holes)
    for frame in frames:
        if not rows.size:
            break
        seen, (turn, shift) = clear(frame), motion(frame)
        places = turn * (columns + 1j * rows) + shift
        x, y = np.rint(places.real).astype(int), np.rint(places.imag).astype(int)
        inside = (x >= 0) & (x < width) & (y >= 0) & (y < height)
        found = inside & (seen[y.clip(0, height - 1), x.clip(0, width - 1)] >= SEEN)
        if found.any():
            at = rows[found], columns[found]
            top, left = max(y[found].min() - 2, 0), max(x[found].min() - 2, 0)
            part = read(frame, (slice(top, y[found].max() + 3), slice(left, x[found].max() + 3)))
            picture[at] = compositor.seen(part, places[found] - (left + 1j * top), sharp=False)
            kinds[at] = TAKEN
            rows, columns = rows[~found], columns[~found]
    return picture, kinds


def uncovered(colors: np.ndarray, seen: np.ndarray, plate: np.ndarray, kinds: np.ndarray) -> tuple[np.ndarray, ...]:
    """What lies behind layers in a frame, of which it shows `seen` (H, W), with the rest from a plate: colours
    (H, W, 3), scene-linear, and how much (H, W) float32 they count.

    colors: (H, W, 3) what it shows; plate, kinds: as from `plate`, with holes where it does not show all"""
    taken = kinds == TAKEN
    mixed = seen[..., None] * colors + (1 - seen)[..., None] * plate[..., :3]
    share = np.where(taken, np.minimum(seen + (1 - seen) * np.float32(TAKEN_SHARE), np.float32(TAKEN_MOST)), seen)
    return np.where(taken[..., None], mixed, colors), share.astype(np.float32)


def filled(picture: np.ndarray, known: np.ndarray) -> np.ndarray:
    """A picture (H, W, C) float32 whose pixels that are not known (H, W) bool go on smoothly from those around.

    By a pyramid: each level is the mean of what is known of the finer one, and the finer one takes from it what it
    lacks. It is what diffusion tends to, in one pass over each level."""
    if known.all() or min(known.shape) < 2:
        return picture if known.any() else np.zeros_like(picture)
    height, width = known.shape
    pad = [(0, height % 2), (0, width % 2)]
    weights = np.pad(known.astype(np.float32), pad)
    colors = np.pad(np.where(known[..., None], picture, 0), [*pad, (0, 0)]).astype(np.float32)
    halves = weights.shape[0] // 2, 2, weights.shape[1] // 2, 2
    count = weights.reshape(halves).sum(axis=(1, 3))
    mean = colors.reshape(*halves, -1).sum(axis=(1, 3)) / np.maximum(count, 1)[..., None]
    coarse = filled(mean, count > 0)
    return np.where(known[..., None], picture, _doubled(coarse)[:height, :width])


def _doubled(picture: np.ndarray) -> np.ndarray:
    """Twice as large, linearly between the pixels' centres."""
    for axis in (0, 1):
        before = np.concatenate([picture.take([0], axis), picture.take(range(picture.shape[axis] - 1), axis)], axis)
        after = np.concatenate([picture.take(range(1, picture.shape[axis]), axis), picture.take([-1], axis)], axis)
        pairs = np.stack([0.75 * picture + 0.25 * before, 0.75 * picture + 0.25 * after], axis + 1)
        shape = list(picture.shape)
        shape[axis] *= 2
        picture = pairs.reshape(shape)
    return picture.astype(np.float32)
