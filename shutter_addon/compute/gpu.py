"""Compositing on a device: one compute pass per picture and band of rows, over the window's frames or running sums."""

from __future__ import annotations

from functools import cache

import numpy as np

from ..core.frames.frame_source import FrameSource
from ..core.model.frame_state import FrameState, Options
from ..core.pixels import compositor
from ..devices.device import Device, NoDeviceError
from ..devices.passes import LOCAL_ROW, Image, Pass
from . import cpu
from .diffusion_gpu import Diffusion
from .edge_diffusion import follows_edges
from .edge_diffusion_gpu import EdgeDiffusion
from .matting import Matting
from .mixing import Mixing
from .tables import moved_tables, padded, table
from .window import BLOCK, Frames, PackedFrames, Sums, WholeFrames, decoding, open_window

# Rows of pixels that one invocation of compose_sums composes.
PAIR = 2

_EDGES = {"hold": 0, "mirror": 1, "shorten": 2}
_READ = Image("rgba32f", reads=True, writes=False)
_COEFFICIENTS = {"coefficients": _READ}
# What a picture is stored as, by whether it is levels.
_PICTURE = {False: "rgba32f", True: "rgba8"}
_PLACE = {"size": "ivec2", "top": "int", "block_bits": "int"}
_LAYERS = dict.fromkeys(("origin", "direction", "layers", "lowest", "lowest_layer"), "int")
_OF_SUMS = {"sums": Image("rgba16ui", reads=True, writes=False)}
_UNIT = {"held": "int", "unit": "float"}
_LEVELS = Pass(
    "levels",
    images={"picture": _READ, "levels": Image("rgba8")},
    constants={"size": "ivec2"},
    local_size=LOCAL_ROW,
)
# Constants that only some passes use: Blender's `gpu` has no others.
_OF_WAY = {"pieces": ("rows",), "value": ("first", "last")} | dict.fromkeys(
    ("frames", "search"), ("rows", "first", "last")
)
# Rows of pixels that one invocation composes, by the pass; BLOCK for all others.
_LINES = {"sums": PAIR, "search": 4}
# Loop iterations of an invocation. Mesa's software renderer ends its loops after 65,535 in all, without an error.
_MOST_ITERATIONS = 60_000
# The numbers of pieces for which compose_sums is compiled. A table with another number is filled up with empty pieces.
_ROWS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32)


def _stored_as(levels: bool) -> tuple[dict, dict]:
    """The images and constants of a pass that stores a finished picture: of levels, or scene-linear
    (shaders/include/finish.glsl)."""
    return {"picture": Image(_PICTURE[levels])}, {} if levels else {"height": "int"}


@cache
def composition(
    way: str, groups: int, stored: str, decode: int, edges: int, premultiplied: bool, encoded: bool, levels: bool
) -> Pass:
    """The pass compose_<way> for a way of `way_of` other than "sums".

    groups: of four shutters
    stored: what the window holds: "frames", "sums", or sums in "tiles"
    decode: a number of window.decoding
    edges: a number of _EDGES
    premultiplied: whether the frames' colours are
    encoded: whether the sums are of encoded light (Options.light)
    levels: whether the picture is of levels
    """
    summed = stored != "frames"
    images, constants = _stored_as(levels)
    return Pass(
        f"compose_{way}",
        samplers={} if summed else {"frames": "sampler2DArray"},
        images=images | _COEFFICIENTS | {"table": _READ} | (_OF_SUMS if summed else {}),
        constants=_PLACE
        | constants
        | _LAYERS
        | dict.fromkeys(_OF_WAY[way], "int")
        | ({"count": "int"} if edges == 2 or not summed else {})
        | (_UNIT if summed else {}),
        defines={
            "MOVED": 0,
            "PACKED": 0,
            "GROUPS": groups,
            "SUMS": int(summed),
            "TILED": int(stored == "tiles"),
            "EDGES": edges,
            "DECODE": decode,
            "PREMULTIPLIED": int(premultiplied),
            "ENCODED": int(encoded),
            "LEVELS": int(levels),
        },
        local_size=LOCAL_ROW,
    )


@cache
def composition_of_sums(rows: int, groups: int, back: bool, tiled: bool, encoded: bool, levels: bool) -> Pass:
    """The pass compose_sums for `rows` pieces. back: the source plays in reverse; the others as for `composition`."""
    images, constants = _stored_as(levels)
    return Pass(
        "compose_sums",
        images=images | _COEFFICIENTS | _OF_SUMS,
        constants=_PLACE | constants | _UNIT | {"origin": "int", "layers": "int", "first_layer": "int"},
        defines={
            "ROWS": rows,
            "GROUPS": groups,
            "BACK": int(back),
            "TILED": int(tiled),
            "ENCODED": int(encoded),
            "LEVELS": int(levels),
        },
        blocks={"table": (1 + rows) * (2 * groups + 1)},
        local_size=(64, 2, 1),
    )


@cache
def composition_of_moved(
    way: str,
    quads: int,
    shutters: int,
    mixed: int,
    packed: bool,
    decode: int,
    shortened: bool,
    premultiplied: bool,
    encoded: bool,
    sharp: bool,
    at: tuple[bool, bool],
    levels: bool,
) -> Pass:
    """The pass of a way, "frames", "search" or "value", where shutters follow something.

    quads: of pixels that an invocation composes; mixed: motions that are mixed for a pixel; packed: as PackedFrames are
    shortened: frames are left out
    sharp: how frames are resampled (core.pixels.compositor.seen)
    at: whether passes over other frames come before and after; the others as for `composition`"""
    continued, unfinished = at
    levels = levels and not unfinished
    images, constants = ({"picture": Image("rgba32f")}, {}) if unfinished else _stored_as(levels)
    images |= {"table": _READ, "moves": _READ}
    images |= {"packed_frames": Image("rgba16ui", reads=True, writes=False)} if packed else {}
    sampled = ("coefficients", *(("summed",) if continued else ()), *(() if packed else ("frames",)))
    numbers = ("motions", *_OF_WAY[way], *(("seen_first", "seen_last", "parts") if shortened else ()))
    return Pass(
        f"compose_{way}",
        samplers=dict.fromkeys(sampled, "sampler2DArray"),
        images=images,
        constants=_PLACE | constants | dict.fromkeys(numbers, "int"),
        defines={
            "MOVED": 1,
            "PACKED": int(packed),
            "SQUARED": int(not encoded),
            "SEVERAL": int(continued or unfinished),
            "QUADS": quads,
            "GROUPS": -(-shutters // 4),
            "SHUTTERS": shutters,
            "MIXED": mixed,
            "SUMS": 0,
            "TILED": 0,
            "EDGES": 2 if shortened else 0,
            "DECODE": decode,
            "PREMULTIPLIED": int(premultiplied),
            "ENCODED": int(encoded),
            "SHARP": int(sharp),
            "CONTINUED": int(continued),
            "UNFINISHED": int(unfinished),
            "LEVELS": int(levels),
        },
        local_size=LOCAL_ROW,
    )


def way_of(window, options: Options, values: np.ndarray, span: tuple[int, int], shortened: bool) -> str:
    """The fastest way to compose: the name of a pass, without compose_.

    values: the table of tables.table, a row of gains and a row per piece
    span: the first frame of the window that any shutter exposes, and the one after the last
    shortened: whether frames of that span are left out (edges "shorten")

    The bounds come from times at 1080p, for 2 to 8 shutters and windows of 16 to 64 frames. From running sums, in
    multiples of the time of a plain average of 16 frames: "sums" 0.3 + 0.23 · pieces, "frames" 1 + 0.1 · frames. From
    frames, in multiples of the time of the window's own plain average: "pieces" 1.5 + 1.4 · pieces / frames, "frames"
    2.1 to 2.8.
    """
    if options.interpolation == "value":
        return "value"
    rows, frames = len(values) - 1, span[1] - span[0]
    if isinstance(window, Sums) and not shortened and _filled_rows(rows) <= 2 + 0.45 * frames:
        return "sums"
    if not isinstance(window, Sums) and 3 * rows < 2 * frames:
        return "pieces"
    return "frames" if frames_iterations(values, span) <= _MOST_ITERATIONS else "search"


def frames_iterations(values: np.ndarray, span: tuple[int, int]) -> int:
    """An upper bound of the loop iterations of an invocation of compose_frames, for any coefficients.

    For each frame it goes through the pieces that may have begun and have not all ended. So each piece counts once for
    every frame from that in which it may begin to that in which it and all before it have ended."""
    groups = values.shape[1] // 2
    start, end, apart = values[1:, :groups], values[1:, groups:-1], values[1:, -1, 1]
    until = np.maximum.accumulate(end.max(axis=(1, 2)) + apart)
    from_ = start.max(axis=(1, 2)) - 2 * apart  # the earliest start of a shutter, and once more the difference
    frames = np.clip(np.ceil(until), *span) - np.clip(np.floor(from_), *span) + 1
    return int(frames.sum()) + len(start) + span[1] - span[0]


def _moved_way(
    options: Options, values: np.ndarray, span: tuple[int, int], motions: int, mixed: int, quads: int
) -> tuple[str, int]:
    """The way to compose where shutters follow something, and how many quads of pixels, `quads` at most, an invocation
    can compose by it; arguments as for way_of and composition_of_moved.

    motions: those that a frame is seen by"""
    frames = span[1] - span[0]
    mixing = frames * motions * (mixed if mixed > 1 else 0)
    if options.interpolation == "value":
        return "value", quads if frames * (1 + motions) + quads * mixing <= _MOST_ITERATIONS else 1
    loops = frames_iterations(values, span) + frames
    if loops + mixing > _MOST_ITERATIONS:
        return "search", 1
    return "frames", quads if loops + quads * mixing <= _MOST_ITERATIONS else 1


def _filled_rows(rows: int) -> float:
    """The number of pieces that compose_sums is compiled for, if there are `rows`; infinite: there are too many."""
    return next((filled for filled in _ROWS if filled >= rows), np.inf)


def _extent(window: Sums) -> dict:
    """Constants about running sums that all passes over them have."""
    return {"layers": window.layers, "held": window.stop - window.start, "unit": 1 / window.whole}


def _from_sums(window: Sums, state: FrameState, values: np.ndarray, origin: int, direction: int, levels: bool):
    """compose_sums for a table of pieces, and its arguments for Device.run but for the band's.

    origin: the position of the window's first frame; direction: 1, or −1 in reverse; levels: as for `composition`"""
    rows = _filled_rows(len(values) - 1)
    filled = np.zeros((1 + rows, *values.shape[1:]), np.float32)
    filled[: len(values)] = values
    back, encoded = direction < 0, state.options.light == "encoded"
    return composition_of_sums(rows, -(-len(state.bars) // 4), back, window.tiled, encoded, levels), {
        "images": {},
        "blocks": {"table": filled.reshape(-1, 4)},
        **_extent(window),
        "first_layer": window.start % window.layers,
        "origin": origin + back - window.start,
    }


def _from_frames(
    way: str, window, state: FrameState, rows: int, origin: int, direction: int, shortened: bool, levels: bool
):
    """The pass of another way, and its arguments: as _from_sums.

    rows: pieces in the table; shortened: as for way_of"""
    options, source, summed = state.options, window.source, isinstance(window, Sums)
    given = {"images": {}, "textures": {}, "rows": rows, "direction": direction}
    given["first"], given["last"] = state.open_span
    if summed:
        lowest, decode, edges = window.start, 0, 2 if shortened else 0
        given |= _extent(window)
    else:
        indices = compositor.source_frames(options, origin + direction * np.arange(options.window), window.shot)
        lowest, decode, edges = (
            int(indices[indices >= 0].min()),
            decoding(window.transfer, options.light),
            _EDGES[options.edges],
        )
    given |= {"layers": window.layers, "lowest_layer": lowest % window.layers}
    # In these shaders, frame 0 is the shot's first.
    given |= {"count": len(window.shot), "origin": origin - window.shot.start, "lowest": lowest - window.shot.start}
    groups, premultiplied = -(-len(state.bars) // 4), source.alpha == "premultiplied"
    stored = "frames" if not summed else "tiles" if window.tiled else "sums"
    encoded = options.light == "encoded"
    return composition(way, groups, stored, decode, edges, premultiplied, encoded, levels), given


class Solver:
    """Diffusion on a Device, plain or along edges. What the other kind has on the device is freed.

    gave_up: whether the device had no room for the last one, which NumPy did
    """

    def __init__(self, device: Device):
        self.gave_up = False
        self._device, self._sent = device, None
        self._plain, self._edged = Diffusion(device), EdgeDiffusion(device)
        self._refused: set = set()  # what the device had no room for

    def solve(self, labels: np.ndarray, count: int, guide=None, strength: float = 0.0, *, warm: bool = False):
        """As Diffusion.solve; along the edges of a guide (EdgeDiffusion.solve) where there are some to follow."""
        edges = follows_edges(labels, guide, strength)
        kind = labels.shape, count, edges
        if kind not in self._refused:
            try:
                return self._solved(labels, count, guide, strength, edges, warm)
            except NoDeviceError:
                self._refused.add(kind)
        self._free()
        self.gave_up = True
        return self._send(cpu.Solver().solve(labels, count, guide, strength))

    def _solved(self, labels: np.ndarray, count: int, guide, strength: float, edges: bool, warm: bool):
        self.gave_up = False
        self._free_sent()
        if edges:
            self._plain.release()
            return self._edged.solve(labels, count, guide, strength)
        self._edged.release()
        return self._plain.solve(labels, count, warm=warm)

    def _send(self, coefficients: np.ndarray):
        """Coefficients (N, h, w) as a texture."""
        count, height, width = coefficients.shape
        self._sent = self._device.texture(width, height, -(-count // 4), "rgba32f")
        for layer in range(self._sent.size[2]):
            four = coefficients[4 * layer : 4 * layer + 4]
            values = np.zeros((height, width, 4), np.float32)
            values[..., : len(four)] = np.moveaxis(four, 0, -1)
            self._device.write(self._sent, values, layer)
        return self._sent

    def _free_sent(self) -> None:
        if self._sent is not None:
            self._sent.release()
            self._sent = None

    def _free(self) -> None:
        self._plain.release()
        self._edged.release()
        self._free_sent()

    def release(self) -> None:
        self._free()
        self._refused.clear()  # others may have freed what was in the way


class GPUCompositor:
    """Composes on a Device; the same methods as CPUCompositor."""

    def __init__(self, device: Device):
        self.name = device.name
        self.device = device
        self._textures: dict[str, object] = {}

    @property
    def takes_planes(self) -> bool:
        """Whether frames that are planes are quickest to send."""
        return self.device.takes_planes

    def current(self):
        """A context manager: all other methods are called inside it, on any one thread (Device.current)."""
        return self.device.current()

    def freeing(self):
        """A context manager: what windows, solvers and matting hold is released inside it (Device.freeing)."""
        return self.device.freeing()

    def window(self, source: FrameSource, capacity: int, moved: bool = False, shutters: int = 4) -> Frames | Sums:
        """A window of `capacity` frames on the device; moved: pictures of it have FrameState.following; shutters: of
        these pictures."""
        return open_window(self.device, source, capacity, moved, shutters)

    def solver(self) -> Solver:
        """A new solver. Its solution is valid until its next solve."""
        return Solver(self.device)

    def matting(self) -> Matting:
        """What lays mattes over coefficients. What it gives is valid until its next."""
        return Matting(self.device)

    def mixing(self) -> Mixing:
        """What adds up shares of coefficients. What it gives is valid until its next sum."""
        return Mixing(self.device)

    def constant(self, values: np.ndarray):
        """Coefficients (N,) of the whole picture, as a texture of one texel. Valid until the next call."""
        return self._filled("constant", padded(values).astype(np.float32)[:, None, None, :], "rgba32f")

    def labels(self, values: np.ndarray):
        """Labels (H, W) uint16 as a texture r32ui. Valid until the next call."""
        return self._filled("labels", values.astype(np.uint32)[None, ..., None], "r32ui")

    def coefficients(self, handle, count: int) -> np.ndarray:
        """Coefficients (N, h, w) float32 of `count` shutters, read from a texture of a solver or of `constant`."""
        values = self.device.read(handle)
        return np.moveaxis(values, -1, 1).reshape(-1, *values.shape[1:3])[:count]

    def read(self, drawn) -> np.ndarray:
        """A picture of `draw` as an array (H, W, 4), top row first: float32, or levels in uint8."""
        picture = self.device.read(drawn)[0]
        return picture if drawn.kind == _PICTURE[True] else picture[::-1]

    def over_black(self, drawn) -> np.ndarray:
        """A scene-linear picture of `draw` as Renderer.levels has it."""
        size = drawn.size[:2]
        texture = self._texture("levels", *size, 1, "rgba8")
        self.device.run(_LEVELS, size, images={"picture": drawn, "levels": texture}, size=size)
        return self.device.read(texture)[0]

    def draw(self, window, index: int, direction: int, state: FrameState, handle, block: int, *, levels: bool = False):
        """The picture on the device, premultiplied: a texture array rgba32f of one layer, scene-linear, bottom row
        first; or with `levels` rgba8, display code values, top row first. It is one of the window's, valid until its
        next picture of the kind.

        window: must have loaded all frames that some shutter exposes
        index, direction: as for core.pixels.compositor.window_positions
        handle: coefficients, a texture of a solver or of `constant`; block: the pixels along a side of each texel
        """
        if state.following is not None:
            return self._draw_moved(window, index, direction, state, handle, block, levels)
        options, values = state.options, table(state)
        first, last = state.open_span
        origin, (low, high) = compositor.origin(options, index, direction), compositor.reach(state, index, direction)
        shortened = options.edges == "shorten" and (low < window.shot.start or high >= window.shot.stop)
        way = way_of(window, options, values, (first, last), shortened)
        if way == "sums":
            program, given = _from_sums(window, state, values, origin, direction, levels)
        else:
            rows = len(values) - 1
            program, given = _from_frames(way, window, state, rows, origin, direction, shortened, levels)
            given["images"]["table"] = self._filled("table", values[None], "rgba32f")
        picture = window.levels() if levels else window.picture
        given["images"] |= {"picture": picture, "coefficients": handle}
        lines = _LINES.get(way, BLOCK)
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
                block_bits=(block - 1).bit_length(),
                **given,
            )
        return picture

    def _draw_moved(
        self, window: WholeFrames, index: int, direction: int, state: FrameState, handle, block: int, levels: bool
    ):
        """As `draw`, where shutters follow something: a pass for each texture array of frames, which adds what is seen
        of these to what those before have."""
        options, (width, height) = state.options, (window.source.width, window.source.height)
        frames = compositor.window_indices(options, index, window.shot, direction)
        first, last = state.open_span
        values, moves = moved_tables(state, frames)
        motions, there = len(moves) // len(frames), np.flatnonzero(frames >= 0)
        shortened, packed = bool((frames[first:last] < 0).any()), isinstance(window, PackedFrames)
        mixed = moves.shape[1] - 1
        most = BLOCK // 4 if packed and not shortened else 1
        way, quads = _moved_way(options, values[: len(values) - motions], (first, last), motions, mixed, most)
        given = {"size": (width, height), "top": 0, "height": height, "block_bits": (block - 1).bit_length()}
        given |= {"first": first, "last": last, "rows": len(values) - 1 - motions, "motions": motions}
        given |= {"seen_first": int(there[0]), "seen_last": int(there[-1]), "parts": len(values) - motions}
        images = {"coefficients": handle, "table": self._filled("table", values[None], "rgba32f")}
        # What is left out is read in another's place: what lies in its own may be no number.
        slots = np.where(frames < 0, frames[there[0]], frames) % window.capacity
        sums = "sum", "other sum"
        picture = window.levels() if levels else window.picture
        for held, stack in window.stacks():
            at = held.start > 0, held.stop < window.capacity
            inside = (slots >= held.start) & (slots < held.stop)
            moves[:, 0, 0] = np.where(inside, slots - held.start, -1).repeat(motions)
            images["moves"] = self._filled("moves", moves[None], "rgba32f")
            images["summed"] = images.get("picture")
            sums = sums[::-1]
            images["picture"] = self._texture(sums[0], width, height, 1, "rgba32f") if at[1] else picture
            # What has more to do for a pixel takes long to compile for many.
            program = composition_of_moved(
                way,
                1 if any(at) else quads,
                len(state.bars),
                mixed,
                packed,
                0 if packed else decoding(window.transfer, options.light),
                shortened,
                window.source.alpha == "premultiplied",
                options.light == "encoded",
                window.source.alpha == "opaque",
                at,
                levels,
            )
            images["packed_frames"] = stack
            extent = width, -(-height // (4 * program.defines["QUADS"]))
            self.device.run(program, extent, textures={**images, "frames": stack}, images=images, **given)
        return picture

    def _texture(self, name: str, width: int, height: int, layers: int, kind: str):
        texture = self._textures.get(name)
        if texture is None or texture.size != (width, height, layers):
            if texture is not None:
                texture.release()
            texture = self._textures[name] = self.device.texture(width, height, layers, kind)
        return texture

    def _filled(self, name: str, values: np.ndarray, kind: str):
        layers, height, width, _ = values.shape
        texture = self._texture(name, width, height, layers, kind)
        for layer in range(layers):
            self.device.write(texture, np.ascontiguousarray(values[layer]), layer)
        return texture

    def release(self) -> None:
        with self.device.freeing():
            for texture in self._textures.values():
                texture.release()
            self._textures.clear()
        self.device.release()
