"""Frames for the windows of layers, and the mattes by which they are weighted pixel by pixel.

A layer's window has frames times the layer's matte. One more window has the background: frames times what all mattes
leave. At edges, both get colors of their own (*Clean Edges*). Where no exposed frame shows the background, a plate is
made: from other frames, or filled from around. Mattes are made once for each source frame, and cached.
"""

from collections.abc import Callable, Hashable, Iterable
from functools import partial
from typing import Any, TypeVar

import numpy as np

from ..core.caches import RecentValues
from ..core.frames import light
from ..core.frames.frame_source import Decoded, FrameSource, Moment, Pair, SourceWrapper, as_rgba
from ..core.model.frame_state import FrameState, Layers, Options
from ..core.model.mattes import FileFrame, Matte, MatteReader, Ramp
from ..core.pixels import compositor, layering
from ..core.stopping import kept

# Bytes of cached frames, shared by all windows and mattes.
RECENT_BYTES = 256 << 20
# Bytes of cached mattes.
KEPT_BYTES = 512 << 20
_WHOLE = 65535
LARGEST = np.finfo(np.float32).max  # the most light


class RecentFrames(SourceWrapper):
    """A wrapper of a source that caches the frames that were read last: as many as fit into RECENT_BYTES, at least 8.

    Each layer has a window of its own, and all windows read the same frames one after another.
    """

    windows = 1

    def __init__(self, source: FrameSource) -> None:
        super().__init__(source)
        self.most = max(8, RECENT_BYTES // (4 * source.width * source.height * np.dtype(source.dtype).itemsize))
        self._kept: RecentValues[tuple[str, int], Any] = RecentValues()

    def read(self, index: int) -> np.ndarray:
        return self._kept.ask(("read", index), lambda: self._source.read(index), self.most)

    def decoded(self, index: int) -> Decoded:
        return self._kept.ask(("decoded", index), lambda: self._source.decoded(index), self.most)

    def want(self, indices: Iterable[int]) -> None:
        """Ignore the announcement: the renderer tells the other source which frames come next."""

    def clear(self) -> None:
        """Forget all frames."""
        self._kept.clear()


class WeightedFrames(SourceWrapper):
    """A source whose frames are those of another one times weights, in linear light: what a layer's window reads.

    For a layer, the weights are its matte times its opacity. For the background, they are the share of it that all
    layers leave visible; where it was taken from other frames, nearly 1 (LayerColors.weights).
    Opaque 8-bit frames become half floats, all others float32.

    Attributes:
        base: The other source.
        weight: Takes a source frame's index, and returns its weights (H, W) float32, 0 … 1.
        rest: Whether this is the background. Its running sums then hold 1 − weight, not the weight.
        alone: Whether a frame's alpha is to be the weight alone, without the alpha of `base`. Colors are then 0, unless
            `colored`.
        colored: Whether colors are needed even with `alone`: a threshold chooses pixels by them.
        is_summable: Whether running sums of the frames can be made (running_sums.WeightedSums): `base` is opaque and
            8-bit, and `alone` is False.
    """

    alpha, transfer = "premultiplied", "linear"

    def __init__(
        self, source: FrameSource, weight: Callable[[int], np.ndarray], *, rest: bool, alone: bool, colored: bool
    ) -> None:
        super().__init__(source)
        self.base, self.weight, self.rest, self.alone, self.colored = source, weight, rest, alone, colored
        is_short = np.dtype(source.dtype) == np.uint8 and source.alpha == "opaque"
        self.is_summable, self.dtype = is_short and not alone, np.dtype(np.float16 if is_short else np.float32)

    def read(self, index: int) -> np.ndarray:
        weight = self.weight(index)
        if self.alone and not self.colored:
            seen = np.zeros((*weight.shape, 4), self.dtype)
        else:
            seen = linear(self.base.read(index), self.base) * weight[..., None]
        if self.alone:
            seen[..., :3] = light.straight(seen)[..., :3] * weight[..., None]
            seen[..., 3] = weight
        return seen.astype(self.dtype)


def linear(frame: np.ndarray, source: FrameSource) -> np.ndarray:
    """Convert a source's frame (H, W, 4) to linear light, float32, premultiplied."""
    if frame.dtype.kind == "u":
        most = np.iinfo(frame.dtype).max
        if source.alpha != "premultiplied":
            curve = np.arange(most + 1, dtype=np.float32) / np.float32(most)
            curve = light.to_linear(curve) if source.transfer == "srgb" else curve
            alpha = frame[..., 3:].astype(np.float32) / np.float32(most)
            colors = curve.take(frame[..., :3])
            return np.concatenate([colors if source.alpha == "opaque" else colors * alpha, alpha], axis=-1)
        frame = frame / np.float32(most)
    frame = frame.astype(np.float32)
    if source.alpha == "premultiplied":
        return light.linearised(frame) if source.transfer == "srgb" else frame
    made = light.premultiplied(frame, light.to_linear if source.transfer == "srgb" else None)
    return made.clip(-LARGEST, LARGEST)  # an alpha may exceed 1


def with_colors(frame: np.ndarray, colors: np.ndarray, where: np.ndarray, source: FrameSource) -> np.ndarray:
    """Return a copy of an opaque source's frame (H, W, 4) in which some pixels have other colors.

    Args:
        frame: The frame (H, W, 4), in the sample type and transfer of `source`.
        colors: The new colors (H, W, 3), in linear light. They are converted to the frame's transfer and type.
        where: Which pixels get the new colors, (H, W) bool.
        source: The source of the frame.
    """
    result, own = frame.copy(), colors[where]
    own = light.to_encoded(own) if source.transfer == "srgb" else own
    if frame.dtype.kind == "u":
        most = np.iinfo(frame.dtype).max
        own = np.rint(own.clip(0, 1) * most)
    result[where, :3] = own.astype(frame.dtype)
    return result


class LayerMattes:
    """Makes the mattes of layers in source frames, and caches those used last, about KEPT_BYTES.

    A layer is a region that is exposed by itself, in front of the rest (frame_state.Layers).

    Args:
        source: The footage.
        solve: Takes an item of Layers.scribbles (the strokes of all drawn layers in a source frame) and that frame's
            number. Spreads the strokes over the picture and returns coefficients (N, h, w) float32: number 1 + i for
            layer i, and number 0 for what belongs to no layer.
        reader: Reads the mattes of layers that are not drawn with strokes. None: there are no such layers.
    """

    def __init__(
        self, source: FrameSource, solve: Callable[[FrameState, int], np.ndarray], reader: MatteReader | None
    ) -> None:
        self._source, self._solve, self._reader = source, solve, reader
        self._size = source.width, source.height
        self._kept: RecentValues[Hashable, np.ndarray] = RecentValues()
        self._most = max(KEPT_BYTES // (2 * source.width * source.height), 16)

    def of(self, layers: Layers, frame: int) -> list[np.ndarray]:
        """Return the mattes (H, W) float32, 0 … 1, of all layers in a source frame, times their opacities."""
        return [self.one(layers, frame, i) for i in range(len(layers.opacities))]

    def one(self, layers: Layers, frame: int, layer: int) -> np.ndarray:
        """Return the matte (H, W) float32, 0 … 1, of the layer with an index in a source frame, times its opacity."""
        return self._whole(layers, frame, layer) * np.float32(layers.opacities[layer])

    def edges(self, layers: Layers, frame: int) -> list[np.ndarray]:
        """Return a matte (H, W) float32, 0 … 1, for each layer: at its soft edges, colors have to be separated.

        There, a pixel of the picture mixes a subject with its background. Opacities are not applied. The soft edges of
        ramps and of drawn layers are not in the picture itself, so these layers get a matte of zeros.

        Args:
            frame: The source frame.
        """
        shown = layers.mattes[self._place(layers, frame)]
        tell = [matte is not None and not isinstance(matte.content, Ramp) for matte in shown]
        nothing = np.zeros(self._size[::-1], np.float32)
        return [self._whole(layers, frame, i) if tells else nothing for i, tells in enumerate(tell)]

    @staticmethod
    def _place(layers: Layers, frame: int) -> int:
        """Return the index of a source frame in the lists of `layers`, clamped to the known frames."""
        return min(max(frame - layers.first, 0), len(layers.mattes) - 1)

    def _whole(self, layers: Layers, frame: int, layer: int) -> np.ndarray:
        """Return the matte (H, W) float32, 0 … 1, of the layer with an index in a source frame, as at opacity 1."""
        place = self._place(layers, frame)
        drawn, matte = layers.scribbles[place], layers.mattes[place][layer]
        if matte is not None:
            return self._of_content(matte, frame)
        assert drawn is not None
        return _fraction(self._drawn(drawn, frame, layer))

    def _of_content(self, matte: Matte, frame: int) -> np.ndarray:
        """Return a matte's values (H, W) float32. A file's frames move with the picture at moments between them."""
        reader, content, source = self._reader, matte.content, self._source
        assert reader is not None
        key = content, matte.feather, matte.invert, frame if isinstance(content, FileFrame) else None
        moves = isinstance(content, FileFrame) and content.time is None and (frame % source.step or source.repeats)

        def values() -> np.ndarray:
            moment = source.decoded(frame) if moves else None
            if not isinstance(moment, Moment):
                return reader.values((matte,), frame, 1)[0][1]
            first, second = (self._of_content(matte, number * source.step) for number in moment.pair)
            return first if np.array_equal(first, second) else moment.between.values(moment, first, second)

        return _fraction(self._get(key, values))

    def behind(self, layers: Layers, frame: int) -> np.ndarray:
        """Return how much of the background a source frame shows behind all layers, (H, W) float32, 0 … 1."""
        return layering.behind(self.of(layers, frame))

    def _drawn(self, state: FrameState, frame: int, layer: int) -> np.ndarray:
        """Return the matte of a layer that is drawn with strokes, (H, W) uint16: 65,535 for 1. It is cached.

        The cached matte serves every source frame with the same strokes, unless these stop at edges of the frame's
        picture (Options.edge_aware).

        Args:
            state: The item of Layers.scribbles for the source frame. Its diffusion gives the mattes of all drawn
                layers.
            frame: The source frame.
            layer: The layer's index.
        """
        key = state.key, frame if state.options.edge_aware else None
        if (key, layer) not in self._kept:
            for i, values in enumerate(self._solve(state, frame)[1:]):
                self._get((key, i), partial(self._in_pixels, values, state.options.aggregate))
        return self._get((key, layer), lambda: np.zeros(self._size[::-1]))

    def _in_pixels(self, coefficients: np.ndarray, block: int) -> np.ndarray:
        """Return the matte (H, W) for the coefficients (h, w) of a drawn layer in blocks of pixels."""
        values = layering.matte_of(coefficients)
        if block > 1:
            values = values.repeat(block, 0).repeat(block, 1)
        return values[: self._size[1], : self._size[0]]

    def _get(self, key: Hashable, make: Callable[[], np.ndarray]) -> np.ndarray:
        """Return the cached matte of a key as uint16, or make and cache it."""

        def made() -> np.ndarray:
            values = np.rint(make() * np.float32(_WHOLE)).astype(np.uint16)
            kept()
            return values

        return self._kept.ask(key, made, self._most)

    def close(self) -> None:
        """Forget all mattes, and close their files."""
        self._kept.clear()
        if self._reader is not None:
            self._reader.close()


def _fraction(values: np.ndarray) -> np.ndarray:
    """Return cached values as float32, 0 … 1."""
    return values.astype(np.float32) / np.float32(_WHOLE)


T = TypeVar("T")

# Frames that are cached for windows, which load them one after another.
TOGETHER = 4
# The least of what lies behind that a pixel must show to be used in a plate.
SEEN = 0.9
# The weight of exposed pixels that are taken from other frames. It is a little less than 1, which would mean that no
# layer was in the way (layering.UNCOVERED).
TAKEN_SHARE = 1 - 1 / 64
# Their largest weight, which is less than 1 in half floats, too.
TAKEN_MOST = 1 - 1 / 1024
# Kinds of pixels: seen, taken from another frame, filled from around.
OPEN, TAKEN, FILLED = 0, 1, 2


class LayerColors:
    """Makes the frames and weights from which the windows of layers and of the background are loaded.

    Colors can differ from the footage: at soft edges they are separated (*Clean Edges*), and behind layers the
    background can come from other frames. Frames keep the sample type and transfer of the source. In all methods, a
    layer is given by its index, and the background behind all layers by −1. Call `begin` for each picture before any
    other method but `clear`.

    Attributes:
        layers: The layers from the last call of `begin`.
    """

    layers: Layers
    _options: Options
    _shot: range

    def __init__(self, source: FrameSource, recent: RecentFrames, mattes: LayerMattes) -> None:
        self._source, self._recent, self._mattes = source, recent, mattes
        self._kept: RecentValues[tuple, Any] = RecentValues()

    def begin(self, layers: Layers, options: Options, shot: range) -> None:
        """Set the layers, options and shot that all other methods use from now on, and drop cached frames.

        Args:
            options: FrameState.options of the picture.
            shot: The source frames of the picture's shot. Only these are searched for the background.
        """
        self.layers, self._options, self._shot = layers, options, shot
        self._kept.clear()

    def changes(self, layer: int) -> tuple:
        """Return a key of how `frames` changes the source's frames: it is equal if windows can be used again."""
        return self._separates, self._options.plate_reach if layer < 0 and self._uncovers else None

    def frames(self, layer: int) -> FrameSource:
        """Return a source of the footage's frames with the colors of a layer, or of the background (−1)."""
        if layer < 0 and self._uncovers:
            return SourceWrapper(self._source, lambda frame: self._uncovered(frame)[0])
        return SourceWrapper(self._source, partial(self._colors, layer)) if self._separates else self._source

    @property
    def has_moments(self) -> bool:
        """Whether moments lie between frames with separated colors, so that they differ from the footage's moments."""
        return self._separates and self._source.step > 1

    def weights(self, layer: int) -> Callable[[int], np.ndarray]:
        """Return a function of a source frame: it gives how much (H, W) of a layer, or the background (−1), is seen."""
        if layer >= 0:
            return lambda frame: self._mattes.one(self.layers, frame, layer)
        if self._uncovers:
            return lambda frame: self._uncovered(frame)[1]
        return lambda frame: self._mattes.behind(self.layers, frame)

    @property
    def _separates(self) -> bool:
        """Whether the colors of layers and background are separated at edges (*Clean Edges*)."""
        return self._options.decontaminate and self._source.alpha == "opaque"

    @property
    def _uncovers(self) -> bool:
        """Whether what layers cover is taken from other frames: the camera moves."""
        return self.layers.camera is not None and self._source.alpha == "opaque"

    def _memo(self, frame: int, name: Hashable, make: Callable[[], T]) -> T:
        """Return the cached value of a frame and a name, or make it."""
        return self._kept.ask((frame, name), make, TOGETHER * (1 + len(self.layers.shutters)))

    def _colors(self, layer: int, frame: int) -> Decoded:
        """Return a frame with the colors of a layer, or of the background (−1). Moments lie between two such frames."""
        moment = self._source.decoded(frame)
        if not isinstance(moment, Moment):
            return self._separated(frame, layer)[int(layer < 0)]
        ends = [number * self._source.step for number in moment.pair]

        def between() -> Pair:
            return moment.between.with_ends(*(self._separated(end, layer)[int(layer < 0)] for end in ends))

        pair = self._memo(ends[0], (layer, ends[1]), between)
        return pair.moment(moment.pair, moment.number, moment.steps)

    def _separated(self, frame: int, layer: int) -> tuple[np.ndarray, np.ndarray]:
        """Separate the colors of a subject and of what lies behind it at soft edges in a source frame. Cached.

        Args:
            frame: The source frame.
            layer: The index of the layer that is the subject. −1: all layers together are.

        Returns:
            The frame (H, W, 4) with the subject's colors in mixed pixels, and the frame with the colors of what lies
            behind.
        """
        number = 0 if len(self.layers.shutters) == 1 else layer  # a single layer has all behind it
        return self._memo(frame, number, lambda: self._separate(frame, number))

    def _separate(self, frame: int, number: int) -> tuple[np.ndarray, np.ndarray]:
        """Make what `_separated` caches. Arguments and result as there; `number` is the layer."""
        mattes = self._mattes.edges(self.layers, frame)
        matte = 1 - layering.behind(mattes) if number < 0 else mattes[number]
        picture, mixed = as_rgba(self._source.decoded(frame)), (matte > 0) & (matte < 1)
        colors = linear(picture, self._source)[..., :3]
        own, behind = (with_colors(picture, c, mixed, self._source) for c in layering.separated(colors, matte))
        return own, behind

    def _uncovered(self, frame: int) -> tuple[np.ndarray, np.ndarray]:
        """Return what `_uncover` returns, cached."""
        return self._memo(frame, "behind", lambda: self._uncover(frame))

    def _uncover(self, frame: int) -> tuple[np.ndarray, np.ndarray]:
        """Make the background of a source frame, completed from other frames where layers cover it.

        The other frames are moved by the camera's motion. This matters if the camera pans: a place is then seen only in
        some of the exposed frames, and these alone would not give the right mean over the exposure.

        Args:
            frame: The source frame.

        Returns:
            The frame (H, W, 4) in the source's samples, and the weight (H, W) float32, 0 … 1, with which each pixel
            counts in the background's exposure (`uncovered`).
        """
        picture = self._separated(frame, -1)[1] if self._separates else as_rgba(self._source.decoded(frame))
        seen = self._mattes.behind(self.layers, frame)
        lacking, kinds = plate(
            seen < layering.UNCOVERED,
            (other for other in nearest_frames(frame, self._options, self._shot) if other != frame),
            self.linear_part,
            partial(self._mattes.behind, self.layers),
            partial(self.motion, frame),
        )
        colors, share = uncovered(linear(picture, self._source)[..., :3], seen, lacking, kinds)
        return with_colors(picture, colors, kinds == TAKEN, self._source), share

    def motion(self, frame: int, other: int) -> tuple[complex, complex]:
        """Return the camera's motion from one source frame to another: turn and shift (Following.between)."""
        return self.layers.camera.between(frame, other) if self.layers.camera else (1, 0)

    def linear_part(self, frame: int, part: tuple[slice, slice]) -> np.ndarray:
        """Return some rows and columns of a source frame in linear light, premultiplied, (h, w, 4) float32."""
        return linear(self._recent.read(frame)[part], self._source)

    def clear(self) -> None:
        """Forget all frames."""
        self._kept.clear()


def nearest_frames(index: int, options: Options, shot: range) -> Iterable[int]:
    """Return the filmed frames that `plate` searches for the background, in the order in which it tries them.

    The nearest frame comes first, which can be `index` itself. Of two equally near ones, the earlier comes first.
    Computed frames are left out, since they are made from the filmed frames beside them.

    Args:
        index: The source frame whose background is sought.
        options: FrameState.options. Filmed frames at most plate_reach · step source frames from `index` are searched.
        shot: The source frames of the shot; no frame outside it is returned.
    """
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
    """Find what lies behind layers in the holes of a picture, by looking at the same places in other frames.

    A hole is filled from the first of the frames that shows at least SEEN of the background at its place.

    Args:
        holes: Which pixels to fill, (H, W) bool.
        frames: Source frames, in the order in which they are tried.
        read: Takes a source frame, and a slice of rows and one of columns. Returns that part of the frame (h, w, 4), in
            linear light and premultiplied.
        clear: Takes a source frame. Returns which share of the background it shows at each pixel, (H, W), 0 … 1.
        motion: Takes a source frame. Returns (turn, shift): a point z = x + iy of the picture, in pixels, lies in that
            frame at turn · z + shift.

    Returns:
        The picture (H, W, 4) float32, in linear light and premultiplied, which is 0 in all pixels that are not TAKEN;
        and the kind of each pixel, (H, W) uint8: OPEN, no hole; TAKEN, found in another frame; FILLED, a hole that no
        frame shows, which the caller has to fill from its surroundings.
    """
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
    """Complete the background of a frame with a plate.

    Where `kinds` is TAKEN, the color is the frame's by the share `seen`, and the plate's by the rest. Elsewhere it is
    the frame's.

    Args:
        colors: The frame's colors (H, W, 3), in linear light.
        seen: Which share of the background the frame shows at each pixel, (H, W), 0 … 1.
        plate: The picture (H, W, 4) from the function `plate`, whose holes are pixels where layers cover the
            background.
        kinds: The kinds of pixels (H, W) from the same call.

    Returns:
        The colors (H, W, 3), in linear light; and the weights (H, W) float32 with which they count in the exposure: a
        little less than 1 where `kinds` is TAKEN, elsewhere `seen`.
    """
    taken = kinds == TAKEN
    mixed = seen[..., None] * colors + (1 - seen)[..., None] * plate[..., :3]
    share = np.where(taken, np.minimum(seen + (1 - seen) * np.float32(TAKEN_SHARE), np.float32(TAKEN_MOST)), seen)
    return np.where(taken[..., None], mixed, colors), share.astype(np.float32)


def filled(picture: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Return a picture (H, W, C) whose unknown pixels are filled smoothly from the known ones around them.

    The picture is halved again and again: a coarse pixel is the mean of the known ones among its four. Then, from
    coarse to fine, unknown pixels are interpolated from the next coarser picture. The result resembles diffusion, but
    is quicker.

    If no pixel is known, all become 0.

    Args:
        picture: (H, W, C) float32. Values of unknown pixels do not matter.
        known: Which pixels are known, (H, W) bool.
    """
    if not known.any():
        return np.zeros_like(picture)
    if known.all():
        return picture
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
    """Return a picture (h, w, C) at twice its size, interpolated linearly between the middles of pixels."""
    for axis in (0, 1):
        count = picture.shape[axis]
        own = np.arange(count).repeat(2)
        beside = (own + np.tile((-1, 1), count)).clip(0, count - 1)
        picture = 0.75 * picture.take(own, axis) + 0.25 * picture.take(beside, axis)
    return picture.astype(np.float32)
