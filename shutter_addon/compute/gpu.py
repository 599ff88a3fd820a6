"""Compose pictures on a device: run a compute pass over the window's frames or running sums, for each band of rows.

A picture can also be converted to the 8-bit levels of a display (core.pixels.shown_levels). Powers on devices differ in
their last bits. So the device evaluates parabolas, which only add and multiply, and marks pixels that are too near to
the end of a level. For those, about one in a hundred, the display itself is used.
"""

from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from ..core.caches import LastValue
from ..core.frames.frame_source import FrameSource
from ..core.model import windows
from ..core.model.frame_state import AVERAGE, Combine, Following, FrameState
from ..core.pixels.shown_levels import Display
from . import cpu
from .composition_passes import (
    EDGES,
    LEVELS,
    MODES,
    composition,
    filled_rows,
    knots,
    lines_of,
    moved_tables,
    moved_way,
    table,
    way_of,
)
from .devices.device import Device, Given, NamedTextures, NoDeviceError, Texture
from .devices.llvmpipe import MOST_ITERATIONS, median_iterations
from .devices.passes import Pass, read_pass
from .layer_frames import WeightedFrames
from .request import Coefficients, Handle, Request
from .running_sums import STORED_SUMS, Sums, WeightedSums
from .stages import GPUStages
from .window import BLOCK, Frames, PackedFrames, WholeFrames, Window, summable

# LEVELS_OF of shaders/include/combine.glsl for a format of frames.
_LEVELS_OF = {"rgba8": 0, "rgba16": 1}

# A display's curve.
_OCTAVES, _LOWEST = 10, -9  # from 2^-9 to 2; below, the display is linear
_SHIFT = 18  # shifts a float's bits to the number of its piece, 1/32 of an octave
_FIRST = (127 + _LOWEST) << (23 - _SHIFT)
_PIECES = _OCTAVES << (23 - _SHIFT)
_PROBED = 128  # values of each piece that a parabola is fitted to
# The error of a device's arithmetic in levels, and a factor for errors between the probed values.
_ROUNDING, _DOUBT = 1.2e-4, 2.0
_COLUMNS = 4096  # of the texture of picked pixels

_LIMITS = {"FIRST": f"{_FIRST}u", "LOWEST": repr(2.0**_LOWEST), "HIGHEST": repr(2.0 - 2**-23)}
SHOW = read_pass("display", "SHOW", **_LIMITS)
PICK = read_pass("display", "PICK")


def _light(window: Any, request: Request) -> dict[str, int | str]:
    """Return macros for the passes over a window: how they read, sum, combine and store light."""
    (combine,), alpha = request.state.groups, window.source.alpha
    return {
        "DECODE": window.decode(request.state.options.light),
        "PREMULTIPLIED": int(alpha == "premultiplied"),
        "ENCODED": int(request.state.options.light == "encoded"),
        "LEVELS": int(request.levels),
        "COVER": window.cover,
        "STORED": STORED_SUMS[window.cover],
        "COMBINE": MODES[combine.mode],
        "BY_LUMINANCE": int(combine.by_luminance),
        "OPAQUE": int(alpha == "opaque"),
        "THRESHOLD": int(combine.threshold is not None),
        "LEVELS_OF": 2 if alpha == "premultiplied" else _LEVELS_OF.get(window.kind, 2),
    }


def _from_sums(window: Sums, request: Request, values: np.ndarray, origin: int) -> tuple[Pass, Given]:
    """Return the pass compose_sums for a picture, and a part of its arguments for Device.run.

    The caller adds the arguments that are common to all passes and those of each band of rows, such as the textures.

    Args:
        window: The running sums.
        request: The picture. Its shutters average their frames and are interpolated by displacement.
        values: The table of shutters, from composition_passes.table.
        origin: The position (frame number, also beyond the footage) of the window's first frame (core.model.windows).
    """
    back, rows = request.direction < 0, knots(values)
    groups, count = rows.shape[1] - 1, 2 * int(filled_rows(len(rows) // 2))
    filled = np.pad(rows, [(0, 1 + count - len(rows)), (0, 0), (0, 0)])
    macros = {"ROWS": count, "TABLE": filled.size // 4, "BACK": int(back), "TILED": window.tiled}
    return composition("sums", groups, **_light(window, request), **macros), {
        "images": {},
        "blocks": {"table": filled.reshape(-1, 4)},
        "first_layer": window.start % window.layers,
        "origin": origin + back - window.start,
    }


def _from_frames(
    way: str, window: Any, request: Request, rows: int, origin: int, shortened: bool
) -> tuple[Pass, Given]:
    """Return a pass other than compose_sums for a picture, and a part of its arguments for Device.run.

    The window may still have running sums. The caller adds the table and the arguments that are common to all passes.

    Args:
        way: The pass, from composition_passes.way_of.
        window: The frames or running sums.
        request: The picture.
        rows: The number of rows in the table of shutters, without row 0.
        origin: The position (frame number, also beyond the footage) of the window's first frame (core.model.windows).
        shortened: As for way_of.
    """
    state, direction, shot = request.state, request.direction, window.shot
    options, (combine,) = state.options, state.groups
    if isinstance(window, Sums):
        lowest, edges = window.start, EDGES["shorten"] if shortened else 0
        macros = {"SUMS": 1, "TILED": window.tiled}
    else:
        indices = windows.source_frames(options, origin + direction * np.arange(options.window), shot)
        lowest, edges, macros = int(indices[indices >= 0].min()), EDGES[options.edges], {}
    first, last = state.open_span
    given: Given = {"images": {}, "textures": {}, "rows": rows, "direction": direction, "first": first, "last": last}
    given["lowest_layer"] = lowest % window.layers
    # In these shaders, frame 0 is the shot's first frame.
    given |= {"count": len(shot), "origin": origin - shot.start, "lowest": lowest - shot.start}
    given |= _threshold(combine, request, shot)
    return composition(way, -(-len(state.bars) // 4), **_light(window, request), EDGES=edges, **macros), given


def _threshold(combine: Combine, request: Request, shot: range) -> Given:
    """Return the arguments for Device.run that a threshold of trails (Combine.threshold) adds.

    Args:
        combine: How the shutters combine their frames.
        request: The picture.
        shot: The source frames that may be exposed.

    Returns:
        {"threshold": (the luminance, half of the softness), "shown": the index of the shown frame in the window, −1 if
        that frame is left out}. Empty if `combine` has no threshold.
    """
    if combine.threshold is None:
        return {}
    options = request.state.options
    is_there = windows.indices(options, request.index, shot, request.direction)[options.shown] >= 0
    half = max(combine.softness, 1e-6) / 2
    return {"threshold": (combine.threshold, half), "shown": options.shown if is_there else -1}


def _in_window(state: FrameState, chosen: tuple[int, ...]) -> FrameState:
    """Return the state of some shutters alone (FrameState.of), for a window that was loaded for all shutters.

    If any of all shutters follows a motion, the window stores frames in another form. Then the result has motions in
    any case, which stand still if none of these shutters moves.

    Args:
        state: The state of all shutters.
        chosen: The indices of the shutters.
    """
    part, following = state.of(chosen), state.following
    if following is None or part.following is not None:
        return part
    still = np.ones((1, len(chosen)), complex)
    return replace(part, following=Following(following.first, still, 0 * still))


def _bits(coefficients: Coefficients) -> int:
    """Return the bits by which a pixel's place is shifted to that of its block's coefficients."""
    return (coefficients.block - 1).bit_length()


def _curve(display: Display) -> np.ndarray:
    """Return the parabolas that approximate a display's curve from light to 8-bit levels, for shaders/display.glsl.

    Returns:
        (1, n, 4) float32: a texel for each interval of light, 1/32 of an octave wide, from 2^-9 to 2. It has the
        coefficients of t², t and 1, where t runs from −0.5 to 0.5 along the interval, and the largest error, all in
        levels (0 to 255).
    """
    starts = np.arange(_FIRST, _FIRST + _PIECES, dtype=np.uint32) << np.uint32(_SHIFT)
    steps = np.linspace(0, (1 << _SHIFT) - 1, _PROBED).astype(np.uint32)
    values = display.transfer((starts[:, None] + steps).view(np.float32)).astype(np.float64) * 255
    powers = np.vander(steps / (1 << _SHIFT) - 0.5, 3)
    found = np.linalg.lstsq(powers, values.T, rcond=None)[0]
    off = np.abs(powers @ found - values.T).max(axis=0)
    pieces = np.concatenate([found, _DOUBT * off[None] + _ROUNDING]).T
    return np.ascontiguousarray(pieces[None], np.float32)


class GPUCompositor:
    """Composes pictures on a GPU (request.Compositor). Pictures and coefficients are textures."""

    def __init__(self, device: Device) -> None:
        self.device, self.name, self.takes_planes = device, device.name, device.takes_planes
        self.current, self.freeing = device.current, device.freeing
        self._textures = NamedTextures(device)
        self._displayed: LastValue[tuple[dict[str, Texture], float]] = LastValue()

    def window(
        self, source: FrameSource, capacity: int, moved: bool = False, shutters: int = 4, summed: bool = True
    ) -> Window:
        """Make an empty window: storage on the device for the source frames that a picture exposes.

        Args:
            source, capacity, moved, shutters, summed: As for request.Compositor.window.

        Returns:
            With `moved`: PackedFrames for opaque 8-bit footage, else WholeFrames. Otherwise a window of running sums
            (Sums or WeightedSums), if `summed` is True, the source allows sums and the device has room; else Frames.
        """
        size = self.device, source, capacity, shutters
        if moved:
            return PackedFrames(*size) if summable(source) else WholeFrames(*size)
        with suppress(NoDeviceError):
            if summed and isinstance(source, WeightedFrames) and source.is_summable:
                return WeightedSums(self.device, source, capacity, shutters)
            if summed and summable(source):
                return Sums(*size)
        return Frames(*size)

    def stages(self) -> GPUStages:
        """Return what makes coefficients, and lays layers over one another, on this device."""
        return GPUStages(self.device)

    def labels(self, values: np.ndarray) -> Texture:
        """Send labels (H, W) uint16 to the device, and return them as a texture r32ui, valid until the next call."""
        return self._textures.filled("labels", [values.astype(np.uint32)], "r32ui")

    def coefficients(self, handle: Texture, count: int) -> np.ndarray:
        """Read back how much of each shutter a pixel gets, as an array (count, h, w) float32.

        Args:
            handle: The texture array, with four shutters per layer (Coefficients.handle).
            count: The number of shutters.
        """
        values = self.device.read(handle)
        return np.moveaxis(values, -1, 1).reshape(-1, *values.shape[1:3])[:count]

    def read(self, drawn: Texture) -> np.ndarray:
        """Return a drawn picture as an array (H, W, 4), top row first: float32, or levels in uint8."""
        picture = self.device.read(drawn)[0]
        return picture if drawn.kind == "rgba8" else picture[::-1]

    def over_black(self, drawn: Texture) -> np.ndarray:
        """Return 8-bit sRGB levels (H, W, 4) of a drawn scene-linear picture over black, top row first."""
        size = drawn.size[:2]
        texture = self._textures.of("levels", (*size, 1), "rgba8")
        self.device.run(LEVELS, size, images={"picture": drawn, "levels": texture}, size=size)
        return self.device.read(texture)[0]

    def shown(self, drawn: Texture, display: Display) -> np.ndarray:
        """Return the display's levels (H, W, 4) uint8 of a drawn, opaque, scene-linear picture, top row first."""
        width, height, _ = drawn.size
        noise, levels = display.noise(width, height), self._textures.of("levels", (width, height, 1), "rgba8")
        images = {"picture": drawn, "levels": levels}
        own, slope = self._displayed.get((display, width, height), lambda: self._send(display, noise))
        images |= own
        self.device.run(SHOW, (width, height), images=images, size=(width, height), slope=slope)
        made = self.device.read(levels)[0]
        whole = made.view("<u4")  # alpha is in the highest bits
        unsure = np.flatnonzero(whole < 1 << 24)
        rows, columns = np.divmod(unsure, width)
        rows = height - 1 - rows  # pictures have the bottom row first
        if unsure.size:
            light = self._picked(drawn, rows * width + columns)
            found = np.full((unsure.size, 4), 255, np.uint8)
            found[:, :3] = display.levels(light, noise[rows, columns])
            whole.reshape(-1)[unsure] = found.view("<u4")[:, 0]
        return made

    def _picked(self, picture: Texture, places: np.ndarray) -> np.ndarray:
        """Read the light of some pixels of a picture from the device, float32 (n, 3).

        Args:
            picture: The picture, with the bottom row first.
            places: (n,) pixels, as numbers row · width + column, where row 0 is the bottom row.
        """
        size = _COLUMNS, -(-len(places) // _COLUMNS)
        numbers = np.zeros((size[1], _COLUMNS), np.uint32)
        numbers.ravel()[: len(places)] = places
        sent = self._textures.filled("places", [numbers], "r32ui")
        picked = self._textures.of("picked", (*size, 1))
        images = {"picture": picture, "places": sent, "picked": picked}
        self.device.run(PICK, size, images=images, size=size, width=picture.size[0])
        return self.device.read(picked)[0].reshape(-1, 4)[: len(places), :3]

    def _send(self, display: Display, noise: np.ndarray) -> tuple[dict[str, Texture], float]:
        """Send to the device what the shader needs to convert pictures of one size to a display's levels.

        Args:
            noise: The display's noise for the picture's pixels, (H, W).

        Returns:
            {"grain": texture of the noise, "curve": texture of the parabolas (_curve)}.
            The slope in levels per unit of light below 2^-9, where the display is linear. sRGB's is 255 · 12.92, but
                OpenColorIO uses another one.
        """
        slope = 255 * float(display.transfer(np.array([2.0**_LOWEST], np.float32))[0]) / 2.0**_LOWEST
        grain = self._textures.filled("grain", [noise], "r32f")
        return {"grain": grain, "curve": self._textures.filled("curve", [_curve(display)])}, slope

    def draw(self, window: Handle, request: Request, coefficients: Coefficients) -> Texture:
        """Expose a window's frames on the device. Return the picture, premultiplied: a texture array with one layer.

        If request.levels is False, it is rgba32f, scene-linear, bottom row first. Otherwise it is rgba8, top row first:
        the sRGB values of straight colors times alpha, and alpha. The texture belongs to the window, whose next picture
        may overwrite it.

        Args:
            window: The window. All frames that the picture exposes must be loaded in it.
            request: The picture. Its layers, strokes and mattes are not looked at.
            coefficients: How much of each shutter a pixel gets.
        """
        if len(request.state.groups) > 1:
            return self._draw_ways(window, request, coefficients)
        (combine,) = request.state.groups
        if len(request.state.bars) == 1 and combine != AVERAGE:  # with one shutter, nothing is displaced
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
        way = way_of(window, state, values, shortened)
        is_search = combine.mode == "median" and way == "search"
        if is_search and median_iterations(len(values) - 1, last - first, window.kind) > MOST_ITERATIONS:
            return self._draw_on_host(window, request, coefficients)
        if way == "sums":
            program, given = _from_sums(window, request, values, origin)
        else:
            program, given = _from_frames(way, window, request, len(values) - 1, origin, shortened)
            given["images"]["table"] = self._textures.filled("table", [values])
        picture = window.picture(levels)
        given |= {"layers": window.layers, "height": window.source.height, "block_bits": _bits(coefficients)}
        given["images"] |= {"picture": picture, "coefficients": coefficients.handle}
        if isinstance(window, Sums):
            given |= {"held": window.stop - window.start, "unit": 1 / window.whole}
        lines = lines_of(way, is_median=combine.mode == "median")
        bound, name = ("images", "sums") if isinstance(window, Sums) else ("textures", "frames")
        for part, stored in window.stored():
            given[bound][name] = stored
            size = window.source.width, part.height
            self.device.run(program, (size[0], -(-part.height // lines)), size=size, top=part.top, **given)
        return picture

    def _draw_ways(self, window: Handle, request: Request, coefficients: Coefficients) -> Texture:
        """Draw a picture whose shutters combine frames in several ways, such as average and lightest.

        Draw a picture for each way, of the shutters that use it (FrameState.groups). Add up these pictures, weighted by
        how much of those shutters each pixel gets. Arguments and result as for `draw`.
        """
        state, size = request.state, (window.source.width, window.source.height)
        groups = list(state.groups.values())
        for number, chosen in enumerate(groups):
            selected, share = self._selected(coefficients.handle, chosen, len(state.bars))
            part = replace(request, state=_in_window(state, chosen), levels=False)
            drawn = self.draw(window, part, Coefficients(selected, coefficients.block))
            levels = request.levels and number == len(groups) - 1
            images = {"part": drawn, "share": share, "mixed": window.mixed()}
            if levels:
                images["picture"] = window.picture(levels=True)
            program = read_pass("ways", BEGINS=int(not number), LEVELS=int(levels))
            self.device.run(program, size, images=images, size=size, given=size, block_bits=_bits(coefficients))
        return window.picture(levels=True) if request.levels else window.mixed()

    def _selected(self, handle: Texture, chosen: tuple[int, ...], count: int) -> tuple[Texture, Texture]:
        """Return the coefficients of some shutters by themselves, and how much of these together each pixel gets.

        Both textures are valid until the next call.

        Args:
            handle: The coefficients of all shutters, four per layer.
            chosen: The indices of the shutters.
            count: The number of all shutters.

        Returns:
            A texture array rgba32f with the coefficients of the chosen shutters, scaled to a sum of 1 in every pixel
                (equal parts where they are all 0), in the order of `chosen`.
            A texture r32f with the share of all coefficients that the chosen shutters have, 0 to 1.
        """
        groups, (width, height, _) = -(-len(chosen) // 4), handle.size
        numbers = np.full((groups, 4), -1, np.float32)
        numbers.flat[: len(chosen)] = chosen
        selected = self._textures.of("selected", (width, height, groups), "rgba32f")
        share = self._textures.of("share", (width, height, 1), "r32f")
        images = {"coefficients": handle, "selected": selected, "share": share}
        given: Given = {"size": (width, height), "count": len(chosen), "blocks": {"chosen": numbers}}
        program = read_pass("ways", "SELECT", GROUPS=groups, ALL=count)
        self.device.run(program, (width, height), images=images, **given)
        return selected, share

    def _draw_on_host(self, window: Handle, request: Request, coefficients: Coefficients) -> Texture:
        """With NumPy, draw a picture whose shutters take the median of frames, and send it to the device.

        Used if exposures follow a motion, as their median needs all frames in one pass, or if the pass would take too
        many loop iterations for llvmpipe. All exposed frames are read from the footage again. Arguments and result as
        for `draw`.
        """
        host, source, options = cpu.CPUCompositor(), window.source, request.state.options
        frames = host.window(source)
        frames.load(request.positions(window.shot), options, window.shot)
        values = self.coefficients(coefficients.handle, len(request.state.bars))
        made = host.draw(frames, request, Coefficients(values, coefficients.block))
        frames.release()
        picture = window.picture(request.levels)
        self.device.write(picture, np.ascontiguousarray(made if request.levels else made[::-1]))
        return picture

    def _draw_moved(self, window: WholeFrames, request: Request, coefficients: Coefficients) -> Texture:
        """Draw a picture whose exposures follow a motion (FrameState.following).

        A window may have several texture arrays of frames, with a shader pass for each. A pass combines its frames with
        the result of the passes before; the last one finishes the picture. Arguments and result as for `draw`.
        """
        state, options, size = request.state, request.state.options, (window.source.width, window.source.height)
        (combine,), (first, last) = state.groups, state.open_span
        frames = windows.indices(options, request.index, window.shot, request.direction)
        values, moves = moved_tables(state, frames)
        motions, there = len(moves) // len(frames), np.flatnonzero(frames >= 0)
        shortened, packed = bool((frames[first:last] < 0).any()), isinstance(window, PackedFrames)
        mixed, parts = moves.shape[1] - 1, len(values) - motions
        most = BLOCK // 4 if packed and not shortened else 1
        way, quads = moved_way(state, values[:parts], motions, mixed, most)
        given: Given = {"size": size, "top": 0, "height": size[1], "block_bits": _bits(coefficients)}
        given |= {"first": first, "last": last, "rows": parts - 1, "motions": motions, "parts": parts}
        given |= {"seen_first": int(there[0]), "seen_last": int(there[-1])}
        given |= _threshold(combine, request, window.shot)
        macros = {"MOVED": 1, "PACKED": int(packed), "EDGES": EDGES["shorten"] if shortened else 0}
        macros |= {"SHUTTERS": len(state.bars), "MIXED": mixed, "SQUARED": int(options.light != "encoded")}
        macros["SHARP"] = int(window.source.alpha == "opaque")
        # A missing frame is read as the first one that exists: its own texels may be NaN.
        slots = np.where(frames < 0, frames[there[0]], frames) % window.capacity
        picture, summed = window.picture(request.levels), None
        images = {"coefficients": coefficients.handle, "table": self._textures.filled("table", [values])}
        for number, ((_, _, held), stack) in enumerate(window.stored()):
            before, after = held.start > 0, held.stop < window.capacity
            inside = (slots >= held.start) & (slots < held.stop)
            moves[:, 0, 0] = np.where(inside, slots - held.start, -1).repeat(motions)
            images |= {"moves": self._textures.filled("moves", [moves]), "summed": summed, "packed_frames": stack}
            summed = self._textures.of(f"sum {number % 2}", (*size, 1), "rgba32f") if after else picture
            images["picture"] = summed
            # Passes that do more for each pixel take long to compile for several quads.
            several = {"QUADS": 1 if before or after else quads, "SEVERAL": int(before or after)}
            several |= {"CONTINUED": int(before), "UNFINISHED": int(after)}
            groups = -(-len(state.bars) // 4)
            program = composition(way, groups, **_light(window, request), **macros, **several)
            extent = size[0], -(-size[1] // (4 * several["QUADS"]))
            self.device.run(program, extent, textures={**images, "frames": stack}, images=images, **given)
        return picture

    def release(self) -> None:
        """Free all textures and the device."""
        with self.device.freeing():
            self._textures.release()
        self._displayed.clear()
        self.device.release()
