"""Compositing with NumPy: the last resort, where there is no GL.

By tiles, one after the other: threads gain nothing, for in the few microseconds that NumPy needs for a tile no other
thread gets hold of Python's lock.
"""

from __future__ import annotations

from contextlib import nullcontext
from functools import partial

import numpy as np

from ..core import stopping
from ..core.frames import light
from ..core.frames.frame_source import FrameSource
from ..core.model import mattes, shutters
from ..core.model.frame_state import Options
from ..core.pixels import compositor
from .diffusion import diffuse
from .edge_diffusion import diffuse_along_edges, follows_edges
from .request import Coefficients, Request
from .resampling import around, resampled
from .running_sums import RunningSums, summable

# A tile's rows and columns, multiples of every block. So small that its arrays stay in the processor's cache, and that
# coefficients differ little across it.
TILE = 128, 128
# Pieces of a quantile that are computed in one step.
TOGETHER = 3
# Bytes of running sums, at most: enough for windows of 64 frames of 1080p, or 20 of 4K. Larger windows are composed
# from the frames, which take a third as much.
SUMS_BYTES = 2 << 30
# White in the running sums: the largest of which the sum over 256 frames is exact in a float32. In encoded light every
# 8-bit value is exact as well.
WHITE = (1 << 16) - 1


class Tile:
    """A part of the picture: its number, and `rows` and `columns` as slices."""

    def __init__(self, number: int, top: int, left: int, source):
        self.number = number
        self.rows = slice(top, min(top + TILE[0], source.height))
        self.columns = slice(left, min(left + TILE[1], source.width))
        self.shape = self.rows.stop - top, self.columns.stop - left

    def of(self, picture: np.ndarray) -> np.ndarray:
        return picture[self.rows, self.columns]

    def coefficients(self, handle: np.ndarray, block: int) -> np.ndarray:
        """(N, h, w) float32 of the tile's blocks, Σ = 1."""
        rows, columns = (slice(s.start // block, -(-s.stop // block)) for s in (self.rows, self.columns))
        c = np.maximum(handle[:, rows, columns], 0, dtype=np.float32)
        return c / c.sum(axis=0)

    def pixels(self, values, block: int):
        """Values (h, w) of the tile's blocks for each of its pixels; a single one stays what it is."""
        if block == 1 or np.size(values) == 1:
            return values
        return values.repeat(block, 0).repeat(block, 1)[: self.shape[0], : self.shape[1]]


def _tiles(source) -> list[Tile]:
    corners = [(top, left) for top in range(0, source.height, TILE[0]) for left in range(0, source.width, TILE[1])]
    return [Tile(number, *corner, source) for number, corner in enumerate(corners)]


class Frames:
    """A window of the frames as they are, on the host. is_open, sends: see window.Window."""

    is_open, sends = True, False
    unit = 1.0

    def __init__(self, source: FrameSource, capacity: int):
        self.source, self.capacity = source, capacity
        self.shot = range(source.count)
        self.tiles = _tiles(source)
        self.frames: dict[int, np.ndarray] = {}
        self._at: dict[int, int] = {}  # position: source frame
        self._decode = None

    @property
    def held(self):
        return self.frames.keys()

    def load(self, positions: np.ndarray, options: Options, shot: range) -> None:
        """See RunningSums.load."""
        self.shot = shot
        frames = compositor.source_frames(options, positions, shot).tolist()
        self._at, wanted = dict(zip(positions.tolist(), frames, strict=True)), set(frames)
        for index in self.frames.keys() - wanted:
            del self.frames[index]
        for index in sorted(wanted - self.frames.keys()):
            self.frames[index] = self.source.read(index)
        self._decode = _decoder(self.source, options.light)

    def light(self, tile: Tile, position: int) -> np.ndarray:
        """The light (3 or 4, h, w) float32 of the frame at a position: premultiplied, `1 / unit` for white."""
        return self._decode(tile.of(self.frames[self._at[position]]))

    def seen(self, tile: Tile, position: int, turn, shift) -> np.ndarray:
        """As `light`, of what the frame shows at turn · z + shift for each pixel z; turn, shift: (h, w), or alike."""
        if not (np.any(turn != 1) or np.any(shift)):
            return self.light(tile, position)
        y, x = np.ogrid[tile.rows, tile.columns]
        frame = self.frames[self._at[position]]
        rows, columns, x, y = around(turn * (x + 1j * y) + shift, frame.shape)
        return resampled(self._decode(frame[rows, columns]), x, y, sharp=self.source.alpha == "opaque")

    def release(self) -> None:
        self.frames = {}


class Sums(RunningSums):
    """A window of running sums of opaque 8-bit frames, on the host: three uint32 for each pixel and layer."""

    is_open, sends = True, False
    unit = 1 / WHITE

    def __init__(self, source: FrameSource, capacity: int):
        super().__init__(source, capacity)
        self.tiles = _tiles(source)
        # What a sum begins with is arbitrary.
        self._sums = [np.zeros((3, self.layers, *tile.shape), np.uint32) for tile in self.tiles]

    @staticmethod
    def fit(source: FrameSource, capacity: int) -> bool:
        """Whether running sums can be made of a source, in at most SUMS_BYTES."""
        return summable(source) and 12 * source.width * source.height * (capacity + 1) <= SUMS_BYTES

    def _add(self, frame: int, same: int | None, known: int, next_: int) -> None:
        picture = self.source.read(frame) if same is None else None
        levels = np.rint(_curve(self.source, self._options.light) * WHITE).astype(np.uint32)
        combine = np.add if next_ > known else np.subtract

        for tile, sums in zip(self.tiles, self._sums, strict=True):
            stopping.check()
            for k, colour in enumerate(sums):
                if same is None:
                    light_ = levels.take(tile.of(picture)[..., k])
                else:
                    light_ = colour[(same + 1) % self.layers] - colour[same % self.layers]
                combine(colour[known % self.layers], light_, out=colour[next_ % self.layers])

    def light(self, tile: Tile, position: int) -> np.ndarray:
        """As Frames.light."""
        sums = self._sums[tile.number]
        return _difference(sums[:, (position + 1) % self.layers], sums[:, position % self.layers])

    def light_between(self, tile: Tile, origin: int, x: np.ndarray) -> np.ndarray:
        """The light (3, h, w) float32 from the position `origin` to x (h, w), or (1, 1), positions after it."""
        sums = self._sums[tile.number]
        base, whole = sums[:, origin % self.layers], np.floor(x)
        if x.size == 1:
            early, late = (sums[:, (origin + int(whole.item()) + k) % self.layers] for k in (0, 1))
        else:
            place = whole.astype(np.intp)
            place += origin % self.layers
            place *= base[0].size
            place += np.arange(base[0].size).reshape(tile.shape)
            sums = sums.reshape(3, -1)
            # The layers lie in a ring.
            early = sums.take(place, axis=1, mode="wrap")
            place += base[0].size
            late = sums.take(place, axis=1, mode="wrap")
        result = _difference(late, early)
        result *= x - whole
        result += _difference(early, base)
        return result

    def release(self) -> None:
        super().release()
        self._sums = []


def _difference(late: np.ndarray, early: np.ndarray) -> np.ndarray:
    return (late - early).view(np.int32).astype(np.float32)


class Solver:
    """compute.diffusion and compute.edge_diffusion, with the methods of compute.gpu.Solver. It ignores `warm`."""

    gave_up = False

    def solve(self, labels: np.ndarray, count: int, guide=None, strength: float = 0.0, *, warm=False) -> np.ndarray:
        if follows_edges(labels, guide, strength):
            return diffuse_along_edges(labels, count, guide, strength)
        return diffuse(labels, count)

    def release(self) -> None:
        pass


class Matting:
    """core.model.mattes, with the methods of compute.matting.Matting."""

    def lay(self, beneath: np.ndarray, shown: tuple[mattes.Matte, ...], layers) -> np.ndarray:
        return mattes.blended(beneath, shown, [values for _, values in layers])

    def release(self) -> None:
        pass


class Mixing:
    """Shares of coefficients, with the methods of compute.mixing.Mixing."""

    def add(self, mixed: np.ndarray | None, added: np.ndarray, share: float, size: tuple[int, int]) -> np.ndarray:
        part = np.broadcast_to(added * np.float32(share), (len(added), *size))
        return part if mixed is None else mixed + part

    def release(self) -> None:
        pass


class CPUCompositor:
    """Composes with NumPy; the same methods as GPUCompositor."""

    name = "NumPy"
    takes_planes = False

    def current(self):
        return nullcontext(self)

    freeing = current

    def window(self, source: FrameSource, capacity: int, moved: bool = False, shutters: int = 4) -> Frames | Sums:
        """A window of `capacity` frames; moved: pictures of it have FrameState.following."""
        return (Sums if Sums.fit(source, capacity) and not moved else Frames)(source, capacity)

    def solver(self) -> Solver:
        return Solver()

    def matting(self) -> Matting:
        return Matting()

    def mixing(self) -> Mixing:
        return Mixing()

    def constant(self, values: np.ndarray) -> np.ndarray:
        return np.asarray(values, dtype=np.float32)[:, None, None]

    def coefficients(self, handle: np.ndarray, count: int) -> np.ndarray:
        return handle[:count]

    def read(self, drawn: np.ndarray) -> np.ndarray:
        return drawn

    def over_black(self, drawn: np.ndarray) -> np.ndarray:
        """A scene-linear picture of `draw` as Renderer.levels has it."""
        found = np.full(drawn.shape, 255, np.uint8)
        found[..., :3] = 255 * light.to_encoded(np.nan_to_num(drawn[..., :3]).clip(0, 1)) + np.float32(0.5)
        return found

    def draw(self, window, request: Request, coefficients: Coefficients) -> np.ndarray:
        """The picture (H, W, 4), top row first: float32, or levels in uint8; arguments as for GPUCompositor.draw."""
        state, index, direction = request.state, request.index, request.direction
        source, options, (handle, block) = window.source, state.options, coefficients
        picture = np.empty((source.height, source.width, 4), dtype=np.float32)
        # Backwards in time is forwards with the shutters reversed.
        bars = state.bars[:, ::direction]
        origin = int(compositor.window_positions(options, index, direction).min())
        frames = compositor.source_frames(options, origin + np.arange(options.window), window.shot)
        if state.following is None:
            expose = _way(window, options, bars, origin, frames >= 0, direction)
        else:
            moves = state.following.at(frames)
            expose = partial(_followed, window, options, bars, origin, frames >= 0, moves, direction)
        for tile in window.tiles:
            stopping.check()
            c = tile.coefficients(handle, block)
            planes = expose(tile, c, block)
            planes *= np.float32(window.unit)
            if options.light == "encoded":
                planes = _linear(planes)
            planes[:3] *= tile.pixels(_mixed(state.gains[None], c)[0], block)
            pixels = tile.of(picture)
            pixels[..., 3] = 1
            for k, plane in enumerate(planes):
                pixels[..., k] = plane
        return self.over_black(picture) if request.levels else picture

    def release(self) -> None:
        pass


def _few(pieces: int, frames: int) -> bool:
    """Whether to go through the pieces of a quantile, because that is faster than through the frames that are exposed.

    Measured at 720p for 4 shutters over 8 to 64 frames, in milliseconds: 30 + 12 · pieces, 20 + 4.4 · frames.
    """
    return 3 * pieces <= frames


def _way(window, options: Options, bars: np.ndarray, origin: int, present: np.ndarray, direction: int):
    """The fastest function (tile, coefficients, block) → light of that tile. In it, time 0 is the first frame that any
    shutter exposes."""
    first, last = shutters.open_span(bars)
    bars, origin, whole = bars[:, first:last], origin + first, present[first:last].all()
    if options.interpolation == "displacement":
        knots = shutters.knots(bars)
        if isinstance(window, Sums) and whole and _few(len(knots.start), last - first):
            return partial(_by_pieces, window, knots, origin, last - first)
        weigh = partial(_displaced, knots, last - first)
    else:
        weigh = partial(_valued, bars / bars.sum(axis=1, keepdims=True))
    return partial(_by_frames, window, weigh, origin, None if whole else np.flatnonzero(present) - first, direction)


def _mixed(times, c: np.ndarray) -> np.ndarray:
    """Σ cᵢ · timesᵢ (K, h, w) float32 for coefficients c (N, h, w) and times, or other numbers, (K, N)."""
    times = np.asarray(times, dtype=np.float32)
    return (times @ c.reshape(len(c), -1)).reshape(-1, *c.shape[1:])


def _by_pieces(window: Sums, knots: shutters.Quantile, origin: int, count: int, tile: Tile, c, block: int):
    """The light (3, h, w) of a tile from the sums at the ends of the quantile's pieces."""

    def until(times):
        x = np.full((1, 1), times[0], np.float32) if np.ptp(times) == 0 else _mixed(times[None], c)[0]
        # Rounding must not lead beyond what is held.
        x = np.clip(x, np.float32(0), np.float32(count))
        return window.light_between(tile, origin, tile.pixels(x, block))

    total, late = 0.0, None
    for k, pace in enumerate(_pace(knots)):
        goes_on = k and np.array_equal(knots.start[k], knots.end[k - 1])
        early = late if goes_on else until(knots.start[k])
        late = until(knots.end[k])
        total += (late - early) / tile.pixels(_mixed(pace[None], c)[0], block)
    return total


def _pace(knots: shutters.Quantile) -> np.ndarray:
    """The time (K, N) by which a level takes each piece of the shutters' quantiles: 1 or more."""
    return (knots.end - knots.start) / np.diff(knots.z)[:, None]


def _displaced(knots: shutters.Quantile, count: int, c: np.ndarray):
    """Yields (frame, weight (h, w) or a number) of the interpolated shutter, of frames that may have any."""
    ends, pace, dz = np.arange(count) + 1, _pace(knots), np.diff(knots.z).astype(np.float32)[:, None, None]
    # The quantile's pieces that are over everywhere at each frame's end, and those that have begun somewhere.
    over = np.searchsorted(-_least(-knots.end, c), ends, "right").tolist()
    begun = np.searchsorted(_least(knots.start, c), ends, "left").tolist()
    before = 0.0
    for end, low, high in zip(ends.tolist(), over, begun, strict=True):
        after = float(knots.z[low])
        for k in range(low, high, TOGETHER):
            some = slice(k, min(k + TOGETHER, high))
            passed = _mixed(end - knots.start[some], c)
            passed /= _mixed(pace[some], c)
            after = after + np.clip(passed, 0, dz[some], out=passed).sum(axis=0)
        if np.ndim(before) or np.ndim(after) or after > before:
            yield end - 1, after - before
        before = after


def _least(times: np.ndarray, c: np.ndarray) -> np.ndarray:
    """The least (K,) of mixed times (K, N) on a tile, as far as the range of each coefficient tells."""
    low, high = (np.float64(extreme(c, axis=(1, 2))) for extreme in (np.min, np.max))
    # What the coefficients' least leave of 1 goes to the earliest times first, as far as their most allow.
    order = np.argsort(times, axis=1)
    given = np.minimum(np.cumsum((high - low)[order], axis=1), max(0.0, 1 - low.sum()))
    shares = np.diff(given, axis=1, prepend=0)
    return (times * low).sum(axis=1) + (shares * np.take_along_axis(times, order, axis=1)).sum(axis=1)


def _valued(normalised: np.ndarray, c: np.ndarray):
    """As _displaced, by value interpolation."""
    for frame in np.flatnonzero(normalised.any(axis=0)).tolist():
        yield frame, _mixed(normalised[None, :, frame], c)[0]


def _by_frames(window, weigh, origin: int, present, direction: int, tile: Tile, c: np.ndarray, block: int):
    """The light (3 or 4, h, w) of a tile, frame after frame; present: the frames that are, None for all of them."""
    weighted = ((frame, tile.pixels(weight, block), None) for frame, weight in weigh(c))

    def look(frame, _):
        return window.light(tile, origin + frame)

    if present is None:
        return _sum(look, weighted)
    return _without_absent(look, tile, present, direction, list(weighted), [(1.0, None)])


def _followed(window: Frames, options: Options, bars, origin: int, there, moves, direction: int, tile: Tile, c, block):
    """The light (3 or 4, h, w) of a tile where shutters follow something; there: whether each frame of the window is;
    moves: the turns and shifts (L, N) of all."""
    first, last = shutters.open_span(bars)

    def look(frame, shares):
        mixed = (np.tensordot(part[first + frame], shares, axes=1) for part in moves)
        return window.seen(tile, origin + first + frame, *(tile.pixels(part, block) for part in mixed))

    def weighed(weights, shares):
        return [(frame, tile.pixels(weight, block), shares) for frame, weight in weights]

    if options.interpolation == "displacement":
        parts, knots = [(1.0, c)], shutters.knots(bars[:, first:last])
        weighted = weighed(_displaced(knots, last - first, c), c)
    else:
        # What moves alike is looked at once.
        alike = np.unique(np.concatenate(moves).T, axis=0, return_inverse=True)[1]
        own = [alike == number for number in range(alike.max() + 1)]
        shares = [(np.arange(len(alike)) == one.argmax()).astype(float)[:, None, None] for one in own]
        parts = [(tile.pixels(c[one].sum(axis=0), block), share) for one, share in zip(own, shares, strict=True)]
        normalised = bars[:, first:last] / bars.sum(axis=1, keepdims=True)
        some = [weighed(_valued(normalised[one], c[one]), share) for one, share in zip(own, shares, strict=True)]
        weighted = [entry for entries in some for entry in entries]
    if there[first:last].all():
        return _sum(look, weighted)
    return _without_absent(look, tile, np.flatnonzero(there) - first, direction, weighted, parts)


def _sum(look, weighted) -> np.ndarray | None:
    """Of entries (frame, weight, shares): the light of `look(frame, shares)`, weighted; None: there are none."""
    total = None
    for frame, weight, shares in weighted:
        light_ = look(frame, shares)
        light_ *= weight
        total = light_ if total is None else np.add(total, light_, out=total)
    return total


def _without_absent(look, tile: Tile, present: np.ndarray, direction: int, weighted: list, parts: list):
    """The light (3 or 4, h, w) where the weight of absent frames is given to the others; where there are none, to the
    nearest, in parts (part, shares)."""
    centre = sum(weight * (frame + 0.5) for frame, weight, _ in weighted) - direction * compositor.CLOSE
    kept = [entry for entry in weighted if entry[0] in present]
    share = sum(weight for _, weight, _ in kept)
    picture = _sum(look, kept)
    picture = 0.0 if picture is None else picture / np.maximum(share, np.float32(1e-6))
    alone = np.broadcast_to(share <= 1e-6, tile.shape)
    if alone.any():
        nearest = present[np.abs(np.expand_dims(centre, -1) - (present + 0.5)).argmin(axis=-1)]
        for frame in np.unique(np.broadcast_to(nearest, tile.shape)[alone]).tolist():
            found = sum(part * look(frame, shares) for part, shares in parts)
            picture = np.where(alone & (nearest == frame), found, picture)
    return picture


def _linear(planes: np.ndarray) -> np.ndarray:
    """Encoded, premultiplied light (3 or 4, h, w) made linear."""
    if len(planes) == 3:
        return light.to_linear(planes)
    return np.moveaxis(light.premultiplied(light.straight(np.moveaxis(planes, 0, -1)), light.to_linear), -1, 0)


def _conversion(source, summed: str):
    """From a source's colours to those in the light that is summed (Options.light); None: they are."""
    wanted = {"encoded": "srgb", "linear": "linear"}[summed]
    return None if source.transfer == wanted else light.to_linear if wanted == "linear" else light.to_encoded


def _curve(source, summed: str) -> np.ndarray:
    """The light float32 that is summed for every value of a whole type."""
    most = np.iinfo(source.dtype).max
    values = np.arange(most + 1, dtype=np.float32) / np.float32(most)
    convert = _conversion(source, summed)
    return convert(values) if convert else values


def _decoder(source, summed: str):
    """A function from samples (h, w, 4) to the light (3 or 4, h, w) float32 that is summed, premultiplied."""
    convert = _conversion(source, summed)
    whole, opaque = np.dtype(source.dtype).kind == "u", source.alpha == "opaque"
    white = np.float32(np.iinfo(source.dtype).max if whole else 1)
    curve = _curve(source, summed) if whole else None

    def decode(samples: np.ndarray) -> np.ndarray:
        if source.alpha == "premultiplied" or not whole:
            rgba = samples.astype(np.float32) / white
            if source.alpha != "premultiplied":
                rgba = light.premultiplied(rgba, convert)
            elif convert is light.to_linear:
                rgba = light.linearised(rgba)
            elif convert:
                rgba = light.premultiplied(light.straight(rgba), convert)
            planes = np.ascontiguousarray(np.moveaxis(rgba, -1, 0))
            return planes[:3] if opaque else planes
        planes = np.moveaxis(samples, -1, 0)
        colours = curve.take(planes[:3])
        if opaque:
            return colours
        alpha = planes[3:] / white
        return np.concatenate([colours * alpha, alpha])

    return decode
