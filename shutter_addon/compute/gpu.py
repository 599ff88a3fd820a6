"""Compositing on a device: one compute pass per picture and band of rows, over the window's frames or running sums."""

from __future__ import annotations

from contextlib import AbstractContextManager
from dataclasses import replace

import numpy as np

from ..core.frames.frame_source import FrameSource
from ..core.model import windows
from ..core.model.combining import AVERAGE, Combine
from ..core.model.frame_state import Following, FrameState
from ..core.pixels.shown_levels import Display
from ..devices.device import Device, Given, NoDeviceError, Texture
from ..devices.llvmpipe import MOST_ITERATIONS
from ..devices.named_textures import NamedTextures
from ..devices.passes import Pass
from . import cpu, window_frames
from .composition_passes import (
    EDGES,
    LEVELS,
    PICTURE,
    LightFormat,
    composition,
    composition_of_moved,
    composition_of_sums,
    filled_rows,
    lines_of,
    median_iterations,
    moved_way,
    selection,
    way_of,
    way_sum,
)
from .diffusion import diffuse, follows_edges
from .diffusion_gpu import Diffusion
from .displaying import Displaying
from .edge_diffusion_gpu import EdgeDiffusion
from .laying import Laying
from .matting import Matting
from .mixing import Mixing
from .request import Coefficients, Handle, Request
from .running_sums import Sums, open_window
from .tables import moved_tables, padded, table
from .window import BLOCK, PackedFrames, WholeFrames, Window, decoding


def _extent(window: Sums) -> Given:
    """Constants about running sums that all passes over them have."""
    return {"layers": window.layers, "held": window.stop - window.start, "unit": 1 / window.whole}


def _from_sums(window: Sums, request: Request, values: np.ndarray, origin: int) -> tuple[Pass, Given]:
    """compose_sums for a table of pieces, and its arguments for Device.run but for the band's.

    origin: the position of the window's first frame"""
    state = request.state
    rows = filled_rows(len(values) - 1)
    filled = np.zeros((1 + rows, *values.shape[1:]), np.float32)
    filled[: len(values)] = values
    back = request.direction < 0
    light = LightFormat(
        decode=0,
        premultiplied=False,
        encoded=state.options.light == "encoded",
        levels=request.levels,
        cover=window.cover,
    )
    return composition_of_sums(rows, -(-len(state.bars) // 4), back, window.tiled, light), {
        "images": {},
        "blocks": {"table": filled.reshape(-1, 4)},
        **_extent(window),
        "first_layer": window.start % window.layers,
        "origin": origin + back - window.start,
    }


def _from_frames(
    way: str, window: Handle, request: Request, rows: int, origin: int, shortened: bool
) -> tuple[Pass, Given]:
    """The pass of another way, and its arguments: as _from_sums.

    rows: pieces in the table; shortened: as for way_of"""
    state, direction = request.state, request.direction
    options, source, summed = state.options, window.source, isinstance(window, Sums)
    (combine,) = state.groups
    given: Given = {"images": {}, "textures": {}, "rows": rows, "direction": direction}
    given["first"], given["last"] = state.open_span
    if summed:
        lowest, decode, edges = window.start, 0, 2 if shortened else 0
        given |= _extent(window)
    else:
        indices = windows.source_frames(options, origin + direction * np.arange(options.window), window.shot)
        lowest, decode, edges = (
            int(indices[indices >= 0].min()),
            decoding(window.transfer, options.light),
            EDGES[options.edges],
        )
    given |= {"layers": window.layers, "lowest_layer": lowest % window.layers}
    # In these shaders, frame 0 is the shot's first.
    given |= {"count": len(window.shot), "origin": origin - window.shot.start, "lowest": lowest - window.shot.start}
    stored = "frames" if not summed else "tiles" if window.tiled else "sums"
    light = LightFormat(
        decode=decode,
        premultiplied=source.alpha == "premultiplied",
        encoded=options.light == "encoded",
        levels=request.levels,
        cover=window.cover if summed else 0,
        combine=combine,
        kind=window.kind if not summed else "",
        opaque=source.alpha == "opaque",
    )
    given |= _threshold(combine, request, window.shot)
    return composition(way, -(-len(state.bars) // 4), stored, edges, light), given


def _threshold(combine: Combine, request: Request, shot: range) -> Given:
    """The arguments of passes with a threshold."""
    if combine.threshold is None:
        return {}
    options = request.state.options
    is_there = windows.indices(options, request.index, shot, request.direction)[options.before] >= 0
    half = max(combine.softness, 1e-6) / 2
    return {"threshold": (combine.threshold, half), "shown": options.before if is_there else -1}


def _in_window(state: FrameState, chosen: tuple[int, ...]) -> FrameState:
    """Return the state of some shutters alone, which still follow if any does: the window holds whole frames then."""
    part, following = state.of(chosen), state.following
    if following is None or part.following is not None:
        return part
    still = np.ones((1, len(chosen)), complex)
    return replace(part, following=Following(following.first, still, 0 * still))


class Solver:
    """Diffusion on a Device, plain or along edges. What the other kind has on the device is freed.

    gave_up: whether the device had no room for the last one, which NumPy did
    """

    def __init__(self, device: Device) -> None:
        self.gave_up = False
        self._device = device
        self._sent = NamedTextures(device)
        self._plain, self._edged = Diffusion(device), EdgeDiffusion(device)
        self._refused: set[tuple] = set()  # what the device had no room for

    def solve(
        self,
        labels: np.ndarray,
        count: int,
        guide: np.ndarray | None = None,
        strength: float = 0.0,
        *,
        warm: bool = False,
    ) -> Texture:
        """As Diffusion.solve; along the edges of a guide (EdgeDiffusion.solve) where there are some to follow."""
        edges = follows_edges(labels, guide, strength)
        kind = labels.shape, count, edges
        self.gave_up = kind in self._refused
        if not self.gave_up:
            self._sent.release()
            (self._plain if edges else self._edged).release()
            try:
                if guide is not None and edges:
                    return self._edged.solve(labels, count, guide, strength)
                return self._plain.solve(labels, count, warm=warm)
            except NoDeviceError:
                self._refused.add(kind)
                self.gave_up = True
        self._free()
        return filled(self._sent, "coefficients", in_fours(diffuse(labels, count, guide, strength)), "rgba32f")

    def _free(self) -> None:
        self._plain.release()
        self._edged.release()
        self._sent.release()

    def release(self) -> None:
        self._free()
        self._refused.clear()  # others may have freed what was in the way


def in_fours(values: np.ndarray) -> np.ndarray:
    """Coefficients (N, h, w) as layers (⌈N/4⌉, h, w, 4) float32 of a texture."""
    return np.moveaxis(padded(np.moveaxis(values, 0, -1)), 2, 0).astype(np.float32)


def filled(textures: NamedTextures, name: str, values: np.ndarray, kind: str) -> Texture:
    """The texture of a name, with values (layers, h, w, components)."""
    layers, height, width, _ = values.shape
    texture = textures.of(name, (width, height, layers), kind)
    for layer in range(layers):
        textures.device.write(texture, np.ascontiguousarray(values[layer]), layer)
    return texture


class GPUCompositor:
    """Composes on a Device; the same methods as CPUCompositor."""

    def __init__(self, device: Device) -> None:
        self.name = device.name
        self.device = device
        self._textures = NamedTextures(device)
        self._displaying = Displaying(device)

    @property
    def takes_planes(self) -> bool:
        """Whether frames that are planes are quickest to send."""
        return self.device.takes_planes

    def current(self) -> AbstractContextManager:
        """A context manager: all other methods are called inside it, on any one thread (Device.current)."""
        return self.device.current()

    def freeing(self) -> AbstractContextManager:
        """A context manager: what windows, solvers and matting hold is released inside it (Device.freeing)."""
        return self.device.freeing()

    def window(
        self, source: FrameSource, capacity: int, moved: bool = False, shutters: int = 4, summed: bool = True
    ) -> Window:
        """A window of `capacity` frames on the device; moved: pictures of it have FrameState.following; shutters: of
        these pictures; summed: all of them average."""
        return open_window(self.device, source, capacity, moved, shutters, summed)

    def solver(self) -> Solver:
        """A new solver. Its solution is valid until its next solve."""
        return Solver(self.device)

    def matting(self) -> Matting:
        """What lays mattes over coefficients. What it gives is valid until its next."""
        return Matting(self.device)

    def mixing(self) -> Mixing:
        """What adds up shares of coefficients. What it gives is valid until its next sum."""
        return Mixing(self.device)

    def laying(self) -> Laying:
        """What lays layers over one another. What it gives is valid until its next."""
        return Laying(self.device)

    def constant(self, values: np.ndarray) -> Texture:
        """Coefficients (N,) of the whole picture, as a texture of one texel. Valid until the next call."""
        return self._filled("constant", in_fours(values[:, None, None]))

    def uploaded(self, values: np.ndarray) -> Texture:
        """Coefficients (N, h, w) as a texture, as a solver has them. Valid until the next call."""
        return self._filled("uploaded", in_fours(values))

    def labels(self, values: np.ndarray) -> Texture:
        """Labels (H, W) uint16 as a texture r32ui. Valid until the next call."""
        return self._filled("labels", values.astype(np.uint32)[None, ..., None], "r32ui")

    def coefficients(self, handle: Texture, count: int) -> np.ndarray:
        """Coefficients (N, h, w) float32 of `count` shutters, read from a texture of a solver or of `constant`."""
        values = self.device.read(handle)
        return np.moveaxis(values, -1, 1).reshape(-1, *values.shape[1:3])[:count]

    def read(self, drawn: Texture) -> np.ndarray:
        """A picture of `draw` as an array (H, W, 4), top row first: float32, or levels in uint8."""
        picture = self.device.read(drawn)[0]
        return picture if drawn.kind == PICTURE[True] else picture[::-1]

    def over_black(self, drawn: Texture) -> np.ndarray:
        """A scene-linear picture of `draw` as Renderer.picture has it of levels."""
        size = drawn.size[:2]
        texture = self._textures.of("levels", (*size, 1), "rgba8")
        self.device.run(LEVELS, size, images={"picture": drawn, "levels": texture}, size=size)
        return self.device.read(texture)[0]

    def shown(self, drawn: Texture, display: Display) -> np.ndarray:
        """The levels (H, W, 4) uint8 of an opaque scene-linear picture of `draw`, top row first."""
        return self._displaying.levels(drawn, display)

    def draw(self, window: Handle, request: Request, coefficients: Coefficients) -> Texture:
        """The picture on the device, premultiplied: a texture array rgba32f of one layer, scene-linear, bottom row
        first; or of levels rgba8, display code values, top row first. It is one of the window's, valid until its next
        picture of the kind.

        window: must have loaded all frames that some shutter exposes
        """
        if len(request.state.groups) > 1:
            return self._draw_ways(window, request, coefficients)
        (combine,) = request.state.groups
        if len(request.state.bars) == 1 and combine != AVERAGE:  # it is not displaced: how much frames count is known
            options = replace(request.state.options, interpolation="value")
            request = replace(request, state=replace(request.state, options=options))
        state, index, direction, levels = request.state, request.index, request.direction, request.levels
        if state.following is not None:
            if combine.mode == "median":
                return self._draw_on_host(window, request, coefficients)
            return self._draw_moved(window, request, coefficients)
        options, values = state.options, table(state)
        first, last = state.open_span
        origin, (low, high) = windows.origin(options, index, direction), windows.reach(state, index, direction)
        shortened = options.edges == "shorten" and (low < window.shot.start or high >= window.shot.stop)
        way = way_of(window, options, values, (first, last), shortened, combine)
        is_search = combine.mode == "median" and way == "search"
        if is_search and median_iterations(len(values) - 1, last - first, window.kind) > MOST_ITERATIONS:
            return self._draw_on_host(window, request, coefficients)
        if way == "sums":
            program, given = _from_sums(window, request, values, origin)
        else:
            rows = len(values) - 1
            program, given = _from_frames(way, window, request, rows, origin, shortened)
            given["images"]["table"] = self._filled("table", values[None])
        picture = window.levels() if levels else window.picture
        given["images"] |= {"picture": picture, "coefficients": coefficients.handle}
        lines = lines_of(way, combine)
        for top, height, stored in window.bands():
            name = "sums" if isinstance(window, Sums) else "frames"
            given["images" if name == "sums" else "textures"][name] = stored
            size = window.source.width, height
            self.device.run(
                program,
                (size[0], -(-height // lines)),
                size=size,
                top=top,
                height=window.source.height,
                block_bits=(coefficients.block - 1).bit_length(),
                **given,
            )
        return picture

    def _draw_ways(self, window: Handle, request: Request, coefficients: Coefficients) -> Texture:
        """As `draw`, of shutters that combine in several ways: a picture for each of these, mixed."""
        state, (width, height) = request.state, (window.source.width, window.source.height)
        groups = list(state.groups.values())
        for number, chosen in enumerate(groups):
            selected, share = self._selected(coefficients.handle, chosen, len(state.bars))
            part = replace(request, state=_in_window(state, chosen), levels=False)
            drawn = self.draw(window, part, Coefficients(selected, coefficients.block))
            levels = request.levels and number == len(groups) - 1
            images = {"part": drawn, "share": share, "mixed": window.mixed()}
            if levels:
                images["picture"] = window.levels()
            bits = (coefficients.block - 1).bit_length()
            size = width, height
            self.device.run(way_sum(not number, levels), size, images=images, size=size, block_bits=bits)
        return window.levels() if request.levels else window.mixed()

    def _selected(self, handle: Texture, chosen: tuple[int, ...], count: int) -> tuple[Texture, Texture]:
        """The coefficients of some shutters alone, and how much all of them have: valid until the next call."""
        groups, (width, height, _) = -(-len(chosen) // 4), handle.size
        numbers = np.full((groups, 4), -1, np.float32)
        numbers.flat[: len(chosen)] = chosen
        selected = self._textures.of("selected", (width, height, groups), "rgba32f")
        share = self._textures.of("share", (width, height, 1), "r32f")
        images = {"coefficients": handle, "selected": selected, "share": share}
        given: Given = {"size": (width, height), "count": len(chosen), "blocks": {"chosen": numbers}}
        self.device.run(selection(groups, count), (width, height), images=images, **given)
        return selected, share

    def _draw_on_host(self, window: Handle, request: Request, coefficients: Coefficients) -> Texture:
        """As `draw`, by NumPy: of medians whose frames are seen elsewhere, which passes over some of them at a time
        cannot find; and of those that take more iterations than a device has."""
        host, source, options = cpu.CPUCompositor(), window.source, request.state.options
        frames = host.window(source)
        frames.load(window_frames.positions(request, window.shot), options, window.shot)
        values = self.coefficients(coefficients.handle, len(request.state.bars))
        made = host.draw(frames, request, Coefficients(values, coefficients.block))
        frames.release()
        picture = window.levels() if request.levels else window.picture
        self.device.write(picture, np.ascontiguousarray(made if request.levels else made[::-1]))
        return picture

    def _draw_moved(self, window: WholeFrames, request: Request, coefficients: Coefficients) -> Texture:
        """As `draw`, where shutters follow something: a pass for each texture array of frames, which adds what is seen
        of these to what those before have."""
        state, options, (width, height) = (
            request.state,
            request.state.options,
            (window.source.width, window.source.height),
        )
        frames = windows.indices(options, request.index, window.shot, request.direction)
        first, last = state.open_span
        values, moves = moved_tables(state, frames)
        motions, there = len(moves) // len(frames), np.flatnonzero(frames >= 0)
        shortened, packed = bool((frames[first:last] < 0).any()), isinstance(window, PackedFrames)
        mixed = moves.shape[1] - 1
        most = BLOCK // 4 if packed and not shortened else 1
        way, quads = moved_way(options, values[: len(values) - motions], (first, last), motions, mixed, most)
        given: Given = {"size": (width, height), "top": 0, "height": height}
        given["block_bits"] = (coefficients.block - 1).bit_length()
        given |= {"first": first, "last": last, "rows": len(values) - 1 - motions, "motions": motions}
        given |= {"seen_first": int(there[0]), "seen_last": int(there[-1]), "parts": len(values) - motions}
        images = {"coefficients": coefficients.handle, "table": self._filled("table", values[None])}
        # What is left out is read in another's place: what lies in its own may be no number.
        slots = np.where(frames < 0, frames[there[0]], frames) % window.capacity
        sums = "sum", "other sum"
        picture: Handle = window.levels() if request.levels else window.picture
        alpha, decode = window.source.alpha, 0 if packed else decoding(window.transfer, options.light)
        (combine,) = state.groups
        light = LightFormat(
            decode, alpha == "premultiplied", options.light == "encoded", request.levels, combine=combine
        )
        given |= _threshold(combine, request, window.shot)
        for held, stack in window.stacks():
            before, after = held.start > 0, held.stop < window.capacity
            inside = (slots >= held.start) & (slots < held.stop)
            moves[:, 0, 0] = np.where(inside, slots - held.start, -1).repeat(motions)
            images["moves"] = self._filled("moves", moves[None])
            images["summed"] = images.get("picture")
            sums = sums[::-1]
            images["picture"] = self._textures.of(sums[0], (width, height, 1), "rgba32f") if after else picture
            # What has more to do for a pixel takes long to compile for many.
            program = composition_of_moved(
                way,
                light,
                quads=1 if before or after else quads,
                shutters=len(state.bars),
                mixed=mixed,
                packed=packed,
                shortened=shortened,
                sharp=alpha == "opaque",
                continued=before,
                unfinished=after,
            )
            images["packed_frames"] = stack
            extent = width, -(-height // (4 * int(program.defines["QUADS"])))
            self.device.run(program, extent, textures={**images, "frames": stack}, images=images, **given)
        return picture

    def _filled(self, name: str, values: np.ndarray, kind: str = "rgba32f") -> Texture:
        return filled(self._textures, name, values, kind)

    def release(self) -> None:
        with self.device.freeing():
            self._textures.release()
            self._displaying.release()
        self.device.release()
