"""Make moments, which are new frames between two filmed frames, by optical flow (appendix B).

OpenCV finds the flow in both directions. Each vector carries a pixel to its place at the time of the new frame. Where
several vectors arrive at one place, the one whose two ends look most alike wins (Baker et al. 2011, "A database and
evaluation methodology for optical flow"). The vectors that arrive say where to look up both frames, which are mixed.

This takes longest. So it happens only for key moments. Other moments are mixes of the key moments before and after
them. The less a tile of the picture moves, and the smoother it is, the fewer key moments it needs.
"""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from functools import cache, cached_property, lru_cache

import numpy as np

from ..core import stopping
from ..core.caches import RecentValues
from ..core.frames import light
from ..core.frames.frame_source import STEP, TILE, UNIT, ZERO, FrameSource, Moment
from .opencv import cv2

SMALLEST = 16  # pixels; OpenCV's flows need about as many, smaller pictures are cross-faded
HALF_MAX = 65504  # the largest value of a half float, which infinite samples count as
# The most levels of 255 by which the ends of a good vector differ, in pictures with a mean of GREY or more. In darker
# pictures it is less in proportion, but at least NOISE.
UNLIKE, GREY, NOISE = 24.0, 90.0, 4.0
AROUND = 15  # the side of the square over which costs are averaged, in pixels of the halved pictures
SHARED = 0.5  # the share of vectors, in each direction, that have to be good
# The farthest that a tile may always move between two key moments, in 1 / UNIT of a pixel. Mixes of pictures no farther
# apart look as good as pictures made by flow. Where pictures are smooth, a tile may move farther: until a mix differs
# from the true picture by about VISIBLE levels of 255.
FARTHEST, VISIBLE = UNIT, 12.0
_KEPT = 4  # cached key moments, and cached sets of vectors
VERSION = 4  # raise it when `found` gives something else of the same pictures


class Between:
    """Makes moments, new frames at times between two frames, by the optical flow between these two (frame_source.Pair).

    They depend on nothing but the two frames, so they are the same whichever other frames are read.

    Attributes:
        ends: The first and the second frame, (H, W, 4).
    """

    def __init__(
        self,
        first: np.ndarray,
        second: np.ndarray,
        transfer: str = "srgb",
        alpha: str = "opaque",
        find: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None,
    ) -> None:
        """Find the optical flow between two frames.

        Args:
            first: The earlier frame, (H, W, 4) RGBA, of a FrameSource's dtype.
            second: The later frame, of the same shape and dtype.
            transfer: The encoding of samples, as in FrameSource. New frames have the same.
            alpha: The alpha mode, as in FrameSource. New frames have the same.
            find: Called in place of `found`, with the same arguments and result, to reuse stored flow. None: `found`
                itself.
        """
        self.ends, self._transfer, self._alpha = (first, second), transfer, alpha
        self._sides: list[_Carriers] | None = None
        self._paths: RecentValues[int, tuple[np.ndarray, np.ndarray]] = RecentValues()
        self._samples: RecentValues[tuple[int, int], np.ndarray] = RecentValues()
        if not np.array_equal(first, second):
            pictures = [luma(end, transfer, alpha) for end in self.ends]
            sides = [_carriers(each) for each in np.split((find or found)(*pictures), 2, axis=2)]
            if _meet(pictures, sides):
                self._sides, self._farthest = sides, _farthest(self.ends)

    def with_ends(self, first: np.ndarray, second: np.ndarray) -> Between:
        """Return a copy that makes moments between two other frames (H, W, 4) by the flow found here."""
        other = copy(self)
        other.ends, other._samples = (first, second), RecentValues()
        other.__dict__.pop("_encoded", None)
        return other

    @cached_property
    def _encoded(self) -> list[np.ndarray]:
        return [_encoded(end, self._transfer, self._alpha) for end in self.ends]

    def moment(self, pair: tuple[int, int], number: int, steps: int) -> np.ndarray | Moment:
        """Return one of the moments, which lie at equal distances in time between the two frames.

        Its picture is not computed yet; Moment.rgba does that. The picture is a mix of both frames; what only one of
        them shows comes mostly from that one (`_late`).

        Args:
            pair: The numbers of the two frames, stored in Moment.pair.
            number: Which moment, 1 to steps − 1, in order of time.
            steps: The number of moments, plus 1.

        Returns:
            The moment. If the frames are equal or have nothing in common: the nearer frame (H, W, 4), in the middle the
            first.
        """
        if (sides := self._sides) is None:
            return self.ends[2 * number > steps]
        keys = 1 << (steps - 1).bit_length()
        vectors, levels = self._paths.ask(
            keys, lambda: _of_keys(sides, self._farthest, self.ends[0].shape[:2], keys), _KEPT
        )
        return Moment(pair, self.ends, number, steps, vectors, levels, self)

    def rgba(self, moment: Moment) -> np.ndarray:
        """Make the picture (H, W, 4) of a Moment that `moment` returned, in the dtype of the two frames."""
        vectors, levels, steps = moment.vectors, moment.levels, moment.steps
        height, width = self.ends[0].shape[:2]
        keys = len(vectors) + 1
        level_of = levels.repeat(TILE[1], axis=0).repeat(TILE[0], axis=1)[:height, :width, None]
        frame = np.zeros((), np.float32)
        for level in np.unique(levels).tolist():
            before, rest = divmod(moment.number << level, steps)
            shown = self._light(vectors, before * keys >> level)
            if rest:
                shown = shown + np.float32(rest / steps) * (self._light(vectors, (before + 1) * keys >> level) - shown)
            frame = np.where(level_of == level, shown, frame)
        return _decoded(frame, self.ends[0].dtype, self._transfer, self._alpha)

    def values(self, moment: Moment, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """Move both frames' values (H, W) float32, such as mattes, by the flow to the key moment nearest a moment."""
        stopping.check()
        (height, width), keys = first.shape, len(moment.vectors) + 1
        key = min(max(round(moment.number * keys / moment.steps), 1), keys - 1)
        vectors, scale = moment.vectors[key - 1].astype(np.float32), np.array([[STEP, 0, 0], [0, STEP, 0]], np.float32)
        spread = cv2.warpAffine(vectors, scale, (width, height), borderMode=cv2.BORDER_REPLICATE)
        paths = (spread[..., :2] - ZERO) / np.float32(UNIT)
        places = grid(height, width) - np.float32(key / keys) * paths
        before, after = look(first, places), look(second, places + paths)
        return before + _late(spread[..., 2:] / np.float32(255), key, keys) * (after - before)

    def _light(self, vectors: np.ndarray, key: int) -> np.ndarray:
        """Return the picture of a key moment in linear light, (H, W, 3 or 4) float32, premultiplied.

        Key moments between the frames are made from both; other moments are mixes of two key moments.

        Args:
            vectors: Moment.vectors, whose length is keys − 1.
            key: The number of the key moment, 0 to keys. 0 is the first frame, and `keys` the second.
        """
        keys = len(vectors) + 1
        if key % keys == 0:
            return _light(self._encoded[key // keys])
        return _light(self._samples.ask((keys, key), lambda: _mixed(self._encoded, vectors[key - 1], key, keys), _KEPT))


def luma(frame: np.ndarray, transfer: str, alpha: str) -> np.ndarray:
    """Convert a source's frame to grey display values (H, W) uint8. Transparent pixels count as black.

    Args:
        frame: The frame, (H, W, 4).
        transfer: The encoding of its samples, as in FrameSource.
        alpha: Its alpha mode, as in FrameSource.
    """
    if frame.dtype == np.uint8 and (transfer, alpha) == ("srgb", "opaque"):
        return cv2.cvtColor(frame, cv2.COLOR_RGBA2GRAY)
    return cv2.cvtColor(displayed(frame, transfer, alpha), cv2.COLOR_RGB2GRAY)


def displayed(frame: np.ndarray, transfer: str, alpha: str) -> np.ndarray:
    """Convert a source's frame to 8-bit display values (H, W, 3). Arguments as for `luma`."""
    return np.ascontiguousarray(levels(_encoded(frame, transfer, alpha))[..., :3])


def resized(picture: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """Return a picture reduced to a size (width, height), or the picture itself if it has that size already."""
    return picture if picture.shape[1::-1] == size else cv2.resize(picture, size, interpolation=cv2.INTER_AREA)


def of_rows(frame: np.ndarray, source: FrameSource, most: int, *, turned: bool = False) -> np.ndarray:
    """Return a source's frame as a small grey picture (h, w) uint8, for measuring motion.

    Args:
        frame: The frame, (H, W, 4).
        source: Its source, which tells how samples are encoded.
        most: The most rows of the result. A picture with more is reduced, and keeps its aspect.
        turned: Whether to swap rows and columns first, so that `most` limits the frame's columns.
    """
    picture = luma(frame, source.transfer, source.alpha)
    picture = np.ascontiguousarray(picture.T) if turned else picture
    height, width = picture.shape
    rows = min(most, height)
    return resized(picture, (max(1, round(width * rows / height)), rows))


def vectors(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Find the optical flow from a small grey picture (H, W) uint8 to another, quickly.

    Returns:
        For each pixel of the first picture, the vector to its place in the second: (H, W, 2), x and y in pixels.
    """
    return _dis(first, second, stride=4)


def fine_vectors(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Find optical flow like `vectors`, but more exactly at the edges of moving things. It takes a third longer."""
    return _dis(first, second, stride=3, smoothness=10)


def found(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Find the optical flow between two grey pictures (H, W) uint8 in both directions, for every STEPth pixel.

    Returns:
        float16 (⌈H / STEP⌉, ⌈W / STEP⌉, 6). Channels 0 and 1: the vector from a pixel of the first picture to its place
        in the second, x and y in pixels. 2: the vector's cost, which is the difference between the grey values at its
        two ends, on average around it; 0 is best, 255 worst. Channels 3 to 5: the same from the second picture to the
        first. If a side of the pictures is shorter than SMALLEST, all vectors are 0.
    """
    height, width = first.shape
    shape = -(-height // STEP), -(-width // STEP)
    if min(height, width) < SMALLEST:
        way = np.zeros((-(-height // 2), -(-width // 2), 2), np.float32)
    halves = [_half(picture) for picture in (first, second)]
    sides = []
    for a, b in (halves, halves[::-1]):
        stopping.check()
        if min(height, width) >= SMALLEST:
            way = cv2.medianBlur(_dis(a, b, stride=4, smoothness=None), 5)  # which removes outliers
        cost = cv2.blur(cv2.absdiff(a, look(b, grid(*a.shape) + way)).astype(np.float32), (AROUND, AROUND))
        sides += [each[:: STEP // 2, :: STEP // 2] for each in (2 * way, cost)]
    values = np.dstack(sides)[: shape[0], : shape[1]]
    return values.clip(-HALF_MAX, HALF_MAX).astype(np.float16)


def _half(picture: np.ndarray) -> np.ndarray:
    """Return a picture of half the size, in which each pixel is the mean of four."""
    height, width = picture.shape
    even = cv2.copyMakeBorder(picture, 0, height % 2, 0, width % 2, cv2.BORDER_REPLICATE)
    return resized(even, (even.shape[1] // 2, even.shape[0] // 2))


def _dis(first: np.ndarray, second: np.ndarray, stride: int, smoothness: float | None = 20) -> np.ndarray:
    """Find optical flow with OpenCV's DIS method.

    Args:
        first: The picture where the vectors start, (H, W) uint8.
        second: The picture where they end, of the same shape.
        stride: The distance between the patches that are compared, in pixels. A smaller one is slower and more exact.
        smoothness: The weight of smooth vectors when they are refined (OpenCV's alpha). None: patches are matched in
            fewer steps and vectors are not refined, which takes two thirds of the time.

    Returns:
        (H, W, 2): for each pixel of the first picture, the vector to its place in the second, x and y in pixels.
    """
    # A new one each time: it keeps buffers, which threads must not share.
    dis = cv2.DISOpticalFlow_create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
    dis.setFinestScale(0)
    dis.setPatchStride(stride)
    if smoothness is None:
        dis.setGradientDescentIterations(16)
        dis.setVariationalRefinementIterations(0)
    else:
        dis.setVariationalRefinementAlpha(smoothness)
    height, width = first.shape
    beyond = max(SMALLEST - height, 0), max(SMALLEST - width, 0)
    wide = (cv2.copyMakeBorder(each, 0, beyond[0], 0, beyond[1], cv2.BORDER_REPLICATE) for each in (first, second))
    # Vectors of pictures without any structure may be infinite.
    return np.nan_to_num(dis.calc(*wide, None)[:height, :width], posinf=0, neginf=0)


# Vectors by cost, the highest first, in cells of STEP pixels: places (2, n), vectors x + iy (n,), and costs (n,).
_Carriers = tuple[np.ndarray, np.ndarray, np.ndarray]


def _meet(pictures: list[np.ndarray], sides: list[_Carriers]) -> bool:
    """Return whether two pictures have enough in common for moments between them. Those around a cut do not.

    In both directions, a share of at least SHARED of all vectors must have a low cost (see UNLIKE).

    Args:
        pictures: The two pictures, grey (H, W) uint8. Their brightness limits the cost.
        sides: The vectors from the first picture to the second, and those from the second to the first.
    """
    brightness = max(float(each.mean()) for each in pictures)
    unlike = max(UNLIKE * min(brightness / GREY, 1.0), NOISE)
    return min(float((costs[1:] <= unlike).mean()) for _places, _vectors, costs in sides) >= SHARED


def _farthest(ends: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Return how far each tile (rows, columns) may move between two key moments, in 1 / UNIT of a pixel.

    A mix of two pictures that are d pixels apart differs from the picture between them by about d² / 8 times its second
    derivative. The highest one in a tile and the tiles around it counts, in both frames.

    Args:
        ends: Both frames, (H, W, 4). If they are not 8-bit, the result is FARTHEST for all tiles, without dimensions.
    """
    if ends[0].dtype != np.uint8:
        return np.array(FARTHEST, np.float32)
    bends = [_tiles(cv2.convertScaleAbs(cv2.Laplacian(each, cv2.CV_16S))) for each in ends]
    bend = cv2.dilate(np.maximum(*bends), np.ones((3, 3), np.uint8)).astype(np.float32)
    return np.maximum(np.float32(FARTHEST), UNIT * np.sqrt(8 * VISIBLE / np.maximum(bend, 1)))


def _tiles(values: np.ndarray, apart: int = 1) -> np.ndarray:
    """Return the highest value in each tile of a picture, (rows, columns).

    Args:
        values: Values of every `apart`th pixel, (h, w) or (h, w, C), not negative.
        apart: A divisor of both sides of a tile.
    """
    across, down = (length // apart for length in TILE)
    height, width = values.shape[:2]
    whole = np.pad(values, ((0, -height % down), (0, -width % across), *[(0, 0)] * (values.ndim - 2)))
    rows = whole.reshape(-1, down, whole[0].size).max(axis=1)
    return rows.reshape(len(rows), -(-width // across), -1).max(axis=2)


def _of_keys(
    sides: list[_Carriers], farthest: np.ndarray, shape: tuple[int, ...], keys: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return Moment.vectors and Moment.levels for the moments between two frames.

    `levels` tells for each tile of the picture how many of the key moments it needs: the less it moves and the smoother
    it is, the fewer.

    Args:
        sides: The vectors from the first frame to the second, and those from the second to the first.
        farthest: How far each tile may move between two key moments, from `_farthest`.
        shape: The frames' (H, W).
        keys: Into how many equal parts the key moments divide the time between the frames, a power of two.
    """
    paths = np.stack([_paths(sides, shape, key / keys) for key in range(1, keys)])
    most, least = (each[..., :2].astype(np.float32) - ZERO for each in (paths.max(axis=0), paths.min(axis=0)))
    # A pixel's path is interpolated between its cell and the next ones to the right and below.
    moved = _tiles(cv2.dilate(np.maximum(most, -least).max(axis=2), np.ones((2, 2), np.uint8), anchor=(0, 0)), STEP)
    # `_farthest` looks only at a tile and those around it. What moves farther comes from outside them.
    farthest = np.where(moved > min(TILE) * UNIT, np.float32(FARTHEST), farthest)
    steps = 1 << np.arange(keys.bit_length() - 1)
    return paths, np.searchsorted(steps, moved / farthest).astype(np.uint8)


def _paths(sides: list[_Carriers], shape: tuple[int, ...], t: float) -> np.ndarray:
    """Return the vectors (h, w, 4) of Moment.vectors at a time from 0 (the first frame) to 1 (the second)."""
    (forth, cost), (back, other) = (_carry(*side, shape, s) for side, s in zip(sides, (t, 1 - t), strict=True))
    vectors = np.where(cost <= other, forth, -back).view(np.float32).reshape(*cost.shape, 2)
    arrived = [each < np.inf for each in (cost, other)]
    vectors = _filled(vectors, arrived[0] | arrived[1])
    stored = np.empty((*cost.shape, 4), np.uint16)
    stored[..., :2] = np.rint(STEP * UNIT * vectors).clip(-ZERO, ZERO - 1) + ZERO
    for end, shows in enumerate(arrived, 2):
        stored[..., end] = np.uint16(255) * shows
    return stored


def _carry(
    places: np.ndarray, vectors: np.ndarray, costs: np.ndarray, shape: tuple[int, ...], t: float
) -> tuple[np.ndarray, np.ndarray]:
    """Move flow vectors along themselves to a time between two frames, and return which vector passes each place then.

    Where several pass, the one with the lowest cost is chosen. Lengths are in cells of STEP × STEP pixels.

    Args:
        places: Where the vectors start, x and y (2, n), as in _Carriers.
        vectors: The vectors to the other frame (n,), x + iy.
        costs: The vectors' costs (n,), the highest first. The first is infinite, for "no vector" (`_carriers`).
        shape: The frames' (H, W) in pixels.
        t: The time, from 0 at the frame where the vectors start to 1 at the other.

    Returns:
        For every STEPth pixel, the vector that passes there, x + iy, and its cost, (h, w) each. Where none passes, the
        cost is infinite. h = ⌈H / STEP⌉, w = ⌈W / STEP⌉.
    """
    h, w = (-(-n // STEP) for n in shape)
    stopping.check()
    # What leaves the picture goes into a margin of two cells. For numbers that are not negative, conversion is `floor`.
    x, y = (
        (place + np.float32(t) * vector).clip(0, end).astype(np.int32)
        for place, vector, end in zip(places, (vectors.real, vectors.imag), (w + 2, h + 2), strict=True)
    )
    # Costs descend, so where several arrive, the last assignment is the cheapest. Where none arrives, the first vector
    # stays, whose cost is infinite.
    last = np.zeros((h + 4) * (w + 4), np.int32)
    last[y * (w + 4) + x] = np.arange(len(costs), dtype=np.int32)
    last = last.reshape(h + 4, w + 4)[1:-2, 1:-2]
    # Each arrives at the four corners of its cell.
    last = np.maximum(last[1:], last[:-1])
    chosen = np.maximum(last[:, 1:], last[:, :-1])
    return vectors.take(chosen), costs.take(chosen)


def _carriers(side: np.ndarray) -> _Carriers:
    """Convert one direction of the result of `found` to _Carriers: a list of vectors by cost, the highest first.

    An additional first vector has an infinite cost. It stands for "no vector", so that index 0 can mark places where
    none arrives.

    Args:
        side: x, y and cost of the vectors, (h, w, 3) float16.

    Returns:
        The vectors' starting places (2, n), the vectors (n,), x + iy, and their costs (n,), n = h · w + 1. Lengths are
        in cells of STEP pixels. Places include the margin of two cells that `_carry` puts around the picture.
    """
    cost = np.ascontiguousarray(side[..., 2]).ravel()
    # As whole numbers, which NumPy sorts ten times as fast; costs are not negative.
    order = np.argsort(~cost.view(np.uint16), kind="stable")
    row, column = np.divmod(order, side.shape[1])
    # The flow was found at half the size, where the middle of a pixel is half a pixel further.
    places = np.stack([column, row]).astype(np.float32) + np.float32(2 + 0.5 / STEP)
    x, y, cost = (each.ravel()[order].astype(np.float32) for each in np.moveaxis(side, 2, 0))
    vectors = (x + 1j * y) / np.float32(STEP)
    return np.insert(places, 0, 0, axis=1), np.insert(vectors, 0, 0), np.insert(cost, 0, np.inf)


def _filled(vectors: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Replace unknown vectors by averages of known vectors around them, from coarser and coarser copies of the field.

    Args:
        vectors: The vectors (h, w, 2).
        known: Which of them are known, (h, w) bool. If all or none are, `vectors` is returned itself.
    """
    if known.all() or not known.any():
        return vectors
    weight = known.astype(np.float32)
    size = tuple(-(-n // 2) for n in known.shape[::-1])
    half = cv2.resize(weight, size, interpolation=cv2.INTER_AREA)
    coarse = cv2.resize(vectors * weight[..., None], size, interpolation=cv2.INTER_AREA)
    coarse = _filled(coarse / np.maximum(half, np.float32(1e-6))[..., None], half > 0)
    return np.where(known[..., None], vectors, cv2.resize(coarse, known.shape[::-1], interpolation=cv2.INTER_LINEAR))


def _mixed(ends: list[np.ndarray], vectors: np.ndarray, key: int, keys: int) -> np.ndarray:
    """Return the display values (H, W, C) of a key moment, mixed from both frames along its flow vectors.

    Each vector tells where a pixel comes from in the first frame and goes to in the second; both places are looked up.
    The places are rounded to 1 / UNIT of a pixel, so that shaders look up the same ones (shaders/include/moment.glsl).

    Args:
        ends: Display values of the first and the second frame, (H, W, C), from `_encoded`.
        vectors: The key moment's part of Moment.vectors, (h, w, 4).
        key: The key moment's number, 1 to keys − 1.
        keys: Into how many equal parts the key moments divide the time between the frames, a power of two.

    Returns:
        uint16 over the full range if the frames are whole numbers, else float32.
    """
    stopping.check()
    height, width = ends[0].shape[:2]
    spread = _spread(vectors, height, width)
    paths = spread[..., :2] - (ZERO * STEP**2)
    here = UNIT * np.dstack(np.meshgrid(np.arange(width, dtype=np.int32), np.arange(height, dtype=np.int32)))
    shift = (STEP**2 * keys).bit_length() - 1
    half = 1 << (shift - 1)
    first = _cubic(ends[0], here - ((key * paths + half) >> shift))
    second = _cubic(ends[1], here + (((keys - key) * paths + half) >> shift))
    late = _late(spread[..., 2:] * np.float32(1 / (255 * STEP**2)), key, keys)[..., None]
    mixed = first + late * (second.astype(np.float32) - first)
    if first.dtype == np.uint8:
        mixed *= np.float32(257)  # white of 16 bits over white of 8
    return np.rint(mixed).astype(np.uint16) if first.dtype.kind == "u" else mixed


def _late(sure: np.ndarray, key: int, keys: int) -> np.ndarray:
    """Return the weight (H, W) of the second frame in the mix at a key moment, 0 to 1; the first frame has the rest.

    If both show the pixel equally surely, it is key / keys. If only one shows it, that one counts 21 times.

    Args:
        sure: (H, W, 2), 0 to 1: how surely the first frame (0) and the second (1) show what is at a pixel.
        key: The key moment's number, 1 to keys − 1.
        keys: Into how many equal parts the key moments divide the time between the frames.
    """
    shown = sure + np.float32(0.05)
    late: np.ndarray = np.float32(key) * shown[..., 1]
    return late / (late + np.float32(keys - key) * shown[..., 0])


def _spread(values: np.ndarray, height: int, width: int) -> np.ndarray:
    """Interpolate values given at every STEPth pixel for all pixels of a picture.

    Args:
        values: Whole numbers (⌈height / STEP⌉, ⌈width / STEP⌉, C).
        height, width: The picture's size in pixels.

    Returns:
        int32 (height, width, C): the interpolated values times STEP², so that no fraction is lost.
    """
    spread = values.astype(np.int32)
    for axis, length in ((0, height), (1, width)):
        before, share = np.divmod(np.arange(length, dtype=np.int32), STEP)
        after = np.minimum(before + 1, spread.shape[axis] - 1)
        share = share.reshape(-1, *[1] * (2 - axis))
        spread = (STEP - share) * spread.take(before, axis) + share * spread.take(after, axis)
    return spread


def _cubic(picture: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Look up a picture at fractional positions, by cubic interpolation. Outside the picture, the edge pixels repeat.

    Args:
        picture: The values (H, W, C).
        places: The positions int32 (H, W, 2), x and y, in 1 / UNIT of a pixel.

    Returns:
        The values at the positions, (H, W, C), of the picture's dtype.
    """
    whole, part = (places >> 5).astype(np.int16), (places & (UNIT - 1)).astype(np.uint16)
    fraction = part[..., 1] << 5 | part[..., 0]  # of OpenCV's table of weights
    return cv2.remap(picture, whole, fraction, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)


def look(picture: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Look up a picture at fractional positions, by linear interpolation. Outside the picture, the edge pixels repeat.

    Args:
        picture: The values (H, W) or (H, W, C).
        places: The positions float32 (h, w, 2), x and y in pixels.

    Returns:
        The values at the positions, (h, w) or (h, w, C).
    """
    return cv2.remap(picture, places, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)


@lru_cache(maxsize=2)  # 16 MB at 4K, and a fourth of that
def grid(height: int, width: int) -> np.ndarray:
    """Return the coordinates (H, W, 2) of all pixels of a picture, x and y in pixels, float32."""
    return np.dstack(np.meshgrid(*(np.arange(n, dtype=np.float32) for n in (width, height))))


# Frames are looked up as display values, premultiplied: in those, cubic interpolation hardly rings around lights.


def _encoded(frame: np.ndarray, transfer: str, alpha: str) -> np.ndarray:
    """Convert a source's frame to display values with colors premultiplied by alpha, to be looked up between pixels.

    Args:
        frame: The frame, (H, W, 4).
        transfer: The encoding of its samples, as in FrameSource.
        alpha: Its alpha mode, as in FrameSource.

    Returns:
        (H, W, 3) if the frame is opaque, else (H, W, 4). Opaque sRGB values of whole numbers stay as they are; all
        others become float32, with 1 for white.
    """
    if alpha == "opaque" and transfer == "srgb" and frame.dtype.kind == "u":
        return cv2.cvtColor(frame, cv2.COLOR_RGBA2RGB)
    white = np.iinfo(frame.dtype).max if frame.dtype.kind == "u" else 1
    rgba = frame.astype(np.float32) / np.float32(white)
    # Interpolation would turn everything around an infinite sample into NaN.
    rgba = np.nan_to_num(rgba, copy=False, nan=0, posinf=HALF_MAX, neginf=-HALF_MAX)
    convert = light.to_encoded if transfer == "linear" else None
    if alpha == "opaque":
        return np.ascontiguousarray(rgba[..., :3] if convert is None else convert(rgba[..., :3]))
    return light.premultiplied(light.straight(rgba) if alpha == "premultiplied" else rgba, convert)


def levels(samples: np.ndarray) -> np.ndarray:
    """Convert samples of display values (uint8, uint16, or floats from 0 to 1) to levels uint8."""
    if samples.dtype == np.uint16:
        return (samples >> 8).astype(np.uint8)
    if samples.dtype != np.uint8:
        return np.rint(255 * np.clip(samples, 0, 1)).astype(np.uint8)
    return samples


def _light(samples: np.ndarray) -> np.ndarray:
    """Convert display values of `_encoded` to linear light, float32, premultiplied."""
    if samples.dtype.kind == "u":
        return _table(samples.dtype)[samples]
    if samples.shape[2] == 3:
        return light.to_linear(samples)
    samples = np.dstack([samples[..., :3], np.clip(samples[..., 3], 0, 1)])
    return light.premultiplied(light.straight(samples), light.to_linear)


@cache
def _table(dtype: np.dtype) -> np.ndarray:
    """Return the linear light of every display value of a whole-number dtype, so that it need not be computed."""
    white = np.iinfo(dtype).max
    return light.to_linear(np.arange(white + 1) / white).astype(np.float32)


def _decoded(frame: np.ndarray, dtype: np.dtype, transfer: str, alpha: str) -> np.ndarray:
    """Convert linear light to a frame (H, W, 4), encoded as FrameSource.read gives it.

    Args:
        frame: Linear light, premultiplied: (H, W, 3) if opaque, else (H, W, 4).
        dtype: The dtype of the result.
        transfer: The encoding of its samples, as in FrameSource.
        alpha: Its alpha mode, as in FrameSource.
    """
    convert = light.to_encoded if transfer == "srgb" else np.asarray
    if alpha == "opaque":
        frame = np.dstack([convert(frame), np.ones(frame.shape[:2], np.float32)])
    else:
        frame = light.straight(frame)
        frame[..., :3] = convert(frame[..., :3])
        frame = light.premultiplied(frame) if alpha == "premultiplied" else frame
    if dtype.kind == "u":
        white = np.iinfo(dtype).max
        return np.rint(np.clip(frame, 0, 1) * np.float32(white)).astype(dtype)
    limits = np.finfo(dtype)  # interpolation can exceed them
    return np.clip(frame, limits.min, limits.max).astype(dtype)
