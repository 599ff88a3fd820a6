"""Compositing with NumPy: the last resort, where there is no GL.

By tiles, one after the other: threads gain nothing, for in the few microseconds that NumPy needs for a tile no other
thread gets hold of Python's lock. (The reference, core.pixels.compositor, called tile by tile, takes 12 times as long
for presets over 16 frames, and 260 times for random bars over 64.)
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ..core import stopping
from ..core.frames import light
from ..core.frames.frame_source import FrameSource
from ..core.model import mattes, shutters
from ..core.pixels import compositor, layering
from ..core.pixels.shown_levels import Display
from . import cpu_combined
from .cpu_weights import Exposed, Mix, Weight, displaced, mixed, pace, valued
from .cpu_window import Tile, TiledFrames, TiledSums
from .diffusion import diffuse
from .edge_diffusion import diffuse_along_edges, follows_edges
from .laying import Behind, Exposure
from .request import Coefficients, Request

Window = TiledFrames | TiledSums
Weighted = tuple[int, np.ndarray | float, np.ndarray | None]  # the same, and the shares by which shutters look at it
Look = Callable[[int, Any], np.ndarray]


class Solver:
    """compute.diffusion and compute.edge_diffusion, with the methods of compute.gpu.Solver. It ignores `warm`."""

    gave_up = False

    def solve(
        self,
        labels: np.ndarray,
        count: int,
        guide: np.ndarray | None = None,
        strength: float = 0.0,
        *,
        warm: bool = False,
    ) -> np.ndarray:
        if guide is not None and follows_edges(labels, guide, strength):
            return diffuse_along_edges(labels, count, guide, strength)
        return diffuse(labels, count)

    def release(self) -> None:
        pass


class Matting:
    """core.model.mattes, with the methods of compute.matting.Matting."""

    def lay(
        self, beneath: np.ndarray, shown: tuple[mattes.Matte, ...], layers: Sequence[tuple[Hashable, np.ndarray]]
    ) -> np.ndarray:
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


class Laying:
    """core.pixels.layering, with the methods of compute.laying.Laying."""

    def least(self, exposed: Exposure) -> np.ndarray:
        return exposed.share[..., 3]

    def shares(self, exposed: Exposure) -> np.ndarray:
        return exposed.share[..., 3]

    def around(self, exposed: Exposure) -> np.ndarray:
        return layering.with_plate(exposed.color, exposed.share[..., 3], None)

    def plate(self, picture: np.ndarray) -> np.ndarray:
        return picture

    def lay(self, behind: Behind, layers: Sequence[Exposure], levels: bool) -> np.ndarray:
        color, share = behind.exposed
        picture = layering.with_plate(color, share[..., 3], behind.plate)
        if behind.plain is not None:
            picture = np.where((share[..., 3] > layering.UNCOVERED)[..., None], behind.plain, picture)
        for layer in layers:
            picture = layering.laid_over(picture, layer.color, layer.share[..., 3])
        return CPUCompositor().over_black(picture) if levels else picture

    def release(self) -> None:
        pass


class CPUCompositor:
    """Composes with NumPy; the same methods as GPUCompositor."""

    name = "NumPy"
    takes_planes = False

    def current(self) -> AbstractContextManager[CPUCompositor]:
        return nullcontext(self)

    freeing = current

    def window(
        self, source: FrameSource, capacity: int, moved: bool = False, shutters: int = 4, summed: bool = True
    ) -> TiledFrames | TiledSums:
        """A window of `capacity` frames; moved: pictures of it have FrameState.following; summed: they average."""
        has_sums = summed and not moved and TiledSums.fit(source, capacity)
        return (TiledSums if has_sums else TiledFrames)(source, capacity)

    def solver(self) -> Solver:
        return Solver()

    def matting(self) -> Matting:
        return Matting()

    def mixing(self) -> Mixing:
        return Mixing()

    def laying(self) -> Laying:
        return Laying()

    def constant(self, values: np.ndarray) -> np.ndarray:
        return np.asarray(values, dtype=np.float32)[:, None, None]

    def uploaded(self, values: np.ndarray) -> np.ndarray:
        return values

    def coefficients(self, handle: np.ndarray, count: int) -> np.ndarray:
        return handle[:count]

    def read(self, drawn: np.ndarray) -> np.ndarray:
        return drawn

    def over_black(self, drawn: np.ndarray) -> np.ndarray:
        """A scene-linear picture of `draw` as Renderer.picture has it of levels."""
        levels = np.full(drawn.shape, 255, np.uint8)
        levels[..., :3] = 255 * light.to_encoded(np.nan_to_num(drawn[..., :3]).clip(0, 1)) + np.float32(0.5)
        return levels

    def shown(self, drawn: np.ndarray, display: Display) -> np.ndarray:
        """As GPUCompositor.shown."""
        levels = np.full(drawn.shape, 255, np.uint8)
        noise = display.noise(drawn.shape[1], drawn.shape[0])[::-1]
        levels[..., :3] = display.levels(drawn[..., :3], noise)
        return levels

    def draw(self, window: Window, request: Request, coefficients: Coefficients) -> np.ndarray:
        """The picture (H, W, 4), top row first: float32, or levels in uint8; arguments as for GPUCompositor.draw."""
        state, index, direction = request.state, request.index, request.direction
        source, options, (handle, block) = window.source, state.options, coefficients
        if len(state.groups) > 1:
            return self._draw_mixed(window, request, coefficients)
        picture = np.empty((source.height, source.width, 4), dtype=np.float32)
        # Backwards in time is forwards with the shutters reversed.
        bars = state.bars[:, ::direction]
        origin = int(compositor.window_positions(options, index, direction).min())
        frames = compositor.source_frames(options, origin + np.arange(options.window), window.shot)
        exposed = Exposed(options=options, bars=bars, origin=origin, present=frames >= 0, direction=direction)
        moves = None if state.following is None else state.following.at(frames)
        expose = _exposure(window, exposed, moves)
        if not state.averages:
            expose = cpu_combined.exposure(window, exposed, state, moves, expose)
        for tile in window.tiles:
            stopping.check()
            mix = Mix(tile, tile.coefficients(handle, block), block)
            planes = expose(mix)
            planes *= np.float32(window.unit)
            if options.light == "encoded":
                planes = _linear(planes)
            planes[:3] *= mix.pixels(mixed(state.gains[None], mix.c)[0])
            pixels = tile.of(picture)
            pixels[..., 3] = 1
            for k, plane in enumerate(planes):
                pixels[..., k] = plane
        return self.over_black(picture) if request.levels else picture

    def _draw_mixed(self, window: Window, request: Request, coefficients: Coefficients) -> np.ndarray:
        """As `draw`, of shutters that combine in several ways: a picture for each of these, mixed."""
        state, (handle, block) = request.state, coefficients
        height, width = window.source.height, window.source.width
        whole = np.maximum(handle[: len(state.bars)], 0)
        picture = np.zeros((height, width, 4), np.float32)
        for chosen, sums, own in compositor.ways(state, whole):
            share = sums / whole.sum(axis=0)
            if share.size > 1:
                share = share.repeat(block, 0).repeat(block, 1)[:height, :width]
            part = replace(request, state=state.of(chosen), levels=False)
            picture += share[..., None] * self.draw(window, part, Coefficients(own, block))
        return self.over_black(picture) if request.levels else picture

    def release(self) -> None:
        pass


def _exposure(
    window: Window, exposed: Exposed, moves: tuple[np.ndarray, np.ndarray] | None
) -> Callable[[Mix], np.ndarray]:
    """What gives the light of a tile; moves: the turns and shifts (L, N) of all frames of the window."""
    if moves is not None and isinstance(window, TiledFrames):
        return partial(_followed, window, exposed, moves)
    return _way(window, exposed)


def _few(pieces: int, frames: int) -> bool:
    """Whether to go through the pieces of a quantile, because that is faster than through the frames that are exposed.

    Measured at 720p for 4 shutters over 8 to 64 frames, in milliseconds: 30 + 12 · pieces, 20 + 4.4 · frames.
    """
    return 3 * pieces <= frames


def _way(window: Window, exposed: Exposed) -> Callable[[Mix], np.ndarray]:
    """The fastest function Mix → light of its tile. In it, time 0 is the first frame that any shutter exposes."""
    options, bars, origin, present, direction = exposed
    first, last = shutters.open_span(bars)
    bars, origin, whole = bars[:, first:last], origin + first, present[first:last].all()
    if options.interpolation == "displacement":
        knots = shutters.knots(bars)
        if isinstance(window, TiledSums) and whole and _few(len(knots.start), last - first):
            return partial(_by_pieces, window, knots, origin, last - first)
        weigh = partial(displaced, knots, last - first)
    else:
        weigh = partial(valued, bars / bars.sum(axis=1, keepdims=True))
    return partial(_by_frames, window, weigh, origin, None if whole else np.flatnonzero(present) - first, direction)


def _by_pieces(window: TiledSums, knots: shutters.Quantile, origin: int, count: int, mix: Mix) -> np.ndarray:
    """The light (3, h, w) of a tile from the sums at the ends of the quantile's pieces."""

    def until(times: np.ndarray) -> np.ndarray:
        x = np.full((1, 1), times[0], np.float32) if np.ptp(times) == 0 else mixed(times[None], mix.c)[0]
        # Rounding must not lead beyond what is held.
        x = np.clip(x, np.float32(0), np.float32(count))
        return window.light_between(mix.tile, origin, mix.pixels(x))

    total: np.ndarray | float = 0.0
    late = np.zeros(())
    for k, own_pace in enumerate(pace(knots)):
        goes_on = k and np.array_equal(knots.start[k], knots.end[k - 1])
        early = late if goes_on else until(knots.start[k])
        late = until(knots.end[k])
        total += (late - early) / mix.pixels(mixed(own_pace[None], mix.c)[0])
    return np.asarray(total)


def _by_frames(
    window: Window,
    weigh: Callable[[np.ndarray], Iterator[Weight]],
    origin: int,
    present: np.ndarray | None,
    direction: int,
    mix: Mix,
) -> np.ndarray:
    """The light (3 or 4, h, w) of a tile, frame after frame; present: the frames that are, None for all of them."""
    weighted = ((frame, mix.pixels(weight), None) for frame, weight in weigh(mix.c))

    def look(frame: int, _: object) -> np.ndarray:
        return window.light(mix.tile, origin + frame)

    if present is None:
        return _sum(look, weighted)
    return _without_absent(look, mix.tile, present, direction, list(weighted), [(1.0, None)])


def _followed(window: TiledFrames, exposed: Exposed, moves: tuple[np.ndarray, np.ndarray], mix: Mix) -> np.ndarray:
    """The light (3 or 4, h, w) of a tile where shutters follow something; moves: the turns and shifts (L, N) of all
    frames of the window."""
    (options, bars, origin, there, direction), c = exposed, mix.c
    first, last = shutters.open_span(bars)

    def look(frame: int, shares: np.ndarray) -> np.ndarray:
        turn, shift = (mix.pixels(np.tensordot(part[first + frame], shares, axes=1)) for part in moves)
        return window.seen(mix.tile, origin + first + frame, turn, shift)

    def weighed(weights: Iterable[Weight], shares: np.ndarray) -> list[Weighted]:
        return [(frame, mix.pixels(weight), shares) for frame, weight in weights]

    if options.interpolation == "displacement":
        parts, knots = [(1.0, c)], shutters.knots(bars[:, first:last])
        weighted = weighed(displaced(knots, last - first, c), c)
    else:
        # What moves alike is looked at once.
        alike = np.unique(np.concatenate(moves).T, axis=0, return_inverse=True)[1]
        own = [alike == number for number in range(alike.max() + 1)]
        shares = [(np.arange(len(alike)) == one.argmax()).astype(float)[:, None, None] for one in own]
        parts = [(mix.pixels(c[one].sum(axis=0)), share) for one, share in zip(own, shares, strict=True)]
        normalised = bars[:, first:last] / bars.sum(axis=1, keepdims=True)
        some = [weighed(valued(normalised[one], c[one]), share) for one, share in zip(own, shares, strict=True)]
        weighted = [entry for entries in some for entry in entries]
    if there[first:last].all():
        return _sum(look, weighted)
    return _without_absent(look, mix.tile, np.flatnonzero(there) - first, direction, weighted, parts)


def _sum(look: Look, weighted: Iterable[Weighted]) -> np.ndarray:
    """The light of `look(frame, shares)`, weighted; of one frame at least."""
    total = None
    for frame, weight, shares in weighted:
        light_ = look(frame, shares)
        light_ *= weight
        total = light_ if total is None else np.add(total, light_, out=total)
    if total is None:
        raise ValueError("no frame is exposed")
    return total


def _without_absent(
    look: Look,
    tile: Tile,
    present: np.ndarray,
    direction: int,
    weighted: list[Weighted],
    parts: Sequence[tuple[np.ndarray | float, np.ndarray | None]],
) -> np.ndarray:
    """The light (3 or 4, h, w) where the weight of absent frames is given to the others; where there are none, to the
    nearest, in parts (part, shares)."""
    centre = sum(weight * (frame + 0.5) for frame, weight, _ in weighted) - direction * compositor.CLOSE
    kept = [entry for entry in weighted if entry[0] in present]
    share = sum(weight for _, weight, _ in kept)
    picture: np.ndarray | float = _sum(look, kept) / np.maximum(share, np.float32(1e-6)) if kept else 0.0
    alone = np.broadcast_to(share <= 1e-6, tile.shape)
    if alone.any():
        nearest = present[np.abs(np.expand_dims(centre, -1) - (present + 0.5)).argmin(axis=-1)]
        for frame in np.unique(np.broadcast_to(nearest, tile.shape)[alone]).tolist():
            alone_there = sum(part * look(frame, shares) for part, shares in parts)
            picture = np.where(alone & (nearest == frame), alone_there, picture)
    return np.asarray(picture)


def _linear(planes: np.ndarray) -> np.ndarray:
    """Encoded, premultiplied light (3 or 4, h, w) made linear."""
    if len(planes) == 3:
        return light.to_linear(planes)
    return np.moveaxis(light.premultiplied(light.straight(np.moveaxis(planes, 0, -1)), light.to_linear), -1, 0)
