"""Measure how long each pass takes, beside the paper's method and a plain average, in turns in one run.

    python scripts/benchmark.py --json FILE [--sizes 1920x1080,3840x2160] [--shutters 2,3,4] …

Needs Python 3.11, NumPy and moderngl; mattes need PyAV and OpenImageIO, or are left out.
Passes:
compose: a picture from a window on the device; accumulate: the next frame into the window (average: its upload alone);
diffuse: coefficients from new labels; diffuse_moved: the same, from the solution for scribbles a few pixels away;
readback: the picture to the host; frame: accumulate, compose and readback;
matte, matte_images: the next frame of a matte, an H.264 movie or PNG files, from the file to the coefficients;
matte_read, matte_images_read: the part that makes the values; matte_blend: the part that lays them.
Methods: ours; paper: its Appendix A with search bounds (scripts/benchmark/appendix_a.glsl); average: the plain mean of
the frames in the same light; edges: coefficients that follow edges; follow: the last shutter follows a subject that
moves, turns and grows; layer: with a layer, a soft disc that moves; lightest, darkest, median: of all shutters.
Times are medians in milliseconds. Frames are noise. Errors are the largest over random pixels in 8-bit levels against
the float64 reference; those of diffusion are times 255, against more cycles; those of mattes against their formula.
"""

from __future__ import annotations

import argparse
import importlib.util
import itertools
import json
import statistics
import sys
import tempfile
import time
from dataclasses import dataclass, replace
from functools import cache, cached_property, partialmethod
from pathlib import Path
from unittest import mock

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

import exact_layers

from shutter_addon.compute import diffusion_gpu, edge_diffusion_gpu, guide
from shutter_addon.compute.devices.gl import GLDevice
from shutter_addon.compute.devices.passes import Pass, read_pass
from shutter_addon.compute.gpu import GPUCompositor
from shutter_addon.compute.layer_frames import WeightedFrames
from shutter_addon.compute.request import Behind, Coefficients, Exposure, Request
from shutter_addon.compute.window import Frames
from shutter_addon.core.frames import light
from shutter_addon.core.frames.frame_source import FrameSource, SourceFile
from shutter_addon.core.model import mattes, scribbles, shutters
from shutter_addon.core.model.frame_state import Combine, Following, FrameState, Layers, Options
from shutter_addon.core.pixels import compositor

HERE = Path(__file__).resolve().with_suffix("")
COMBINED = ("lightest", "darkest", "median")
METHODS = ("ours", "layer", "paper", "average", "edges", "follow", *COMBINED)
MATTES = ("matte", "matte_images", "matte_read", "matte_images_read", "matte_blend")
PASSES = ("compose", "accumulate", "diffuse", "diffuse_moved", "readback", "frame", *MATTES)
MATTE_FRAMES = 24
# Bars that are constant over spans, and bars that change from frame to frame.
BARS = {
    "preset": ("ANGLE_360", "STILL", "TWO_CUTS", "ANGLE_180", "LAST", "CUTS", "ANGLE_90", "ANGLE_45"),
    "smooth": ("RAMP_UP", "GAUSSIAN", "TRAIL", "TRIANGLE", "RAMP_DOWN", "STILL", "ANGLE_360", "ANGLE_180"),
}


class Noise(FrameSource):
    """A clip of random frames, every one another cut of the same noise."""

    path, fps, options = Path("noise"), None, {}
    transfer, alpha, dtype, count = "srgb", "opaque", np.dtype(np.uint8), 100_000

    def __init__(self, width: int, height: int):
        self.width, self.height = width, height
        self._size = width * height
        self._pixels = np.random.default_rng(0).integers(0, 256, (self._size + 1_000_003, 4), dtype=np.uint8)
        self._pixels[:, 3] = 255

    def close(self) -> None:
        """There is no file."""

    def read(self, index: int) -> np.ndarray:
        start = index * 7919 % 1_000_003
        return self._pixels[start : start + self._size].reshape(self.height, self.width, 4)


def bars(kind: str, count: int, window: int) -> np.ndarray:
    """Bars (count, window) of some shutters, of a kind of BARS or "random" ones."""
    if kind == "random":
        return np.random.default_rng(window).random((count, window))
    return np.stack([shutters.preset_bars(name, window) for name in BARS[kind][:count]])


def shapes(count: int) -> tuple[scribbles.Shape, ...]:
    """The paper's two lines and two lassos, and more lines where there are more shutters."""
    drawn = [
        ("line", [[0.1, 0.1], [0.2, 0.8]]),
        ("line", [[0.4, 0.9], [0.6, 0.7]]),
        ("lasso", [[0.4, 0.2], [0.6, 0.2], [0.6, 0.4], [0.4, 0.4]]),
        ("lasso", [[0.75, 0.5], [0.9, 0.5], [0.8, 0.7]]),
        *(("line", [[0.1 * k, 0.02], [0.1 * k, 0.08]]) for k in range(1, 10)),
    ]
    shutter = itertools.cycle(range(count))
    return tuple(
        scribbles.Shape(shutter=next(shutter), kind=kind, width=0.02, strokes=(np.array(points),))
        for kind, points in drawn[: max(count, 4)]
    )


def reference(state: FrameState, codes: np.ndarray, coefficients: np.ndarray) -> np.ndarray:
    """The linear colors (P, 3) float64 of pixels: core.pixels.compositor's, a few at a time, for their weights are
    large.

    codes: (L, P, 4) uint8 of the window's frames; coefficients: (N, P)"""
    frames = light.premultiplied(codes / 255.0, light.to_linear)[:, None]
    c, present = coefficients[:, None].astype(np.float64), np.ones(len(frames), dtype=bool)
    step = max(1, (1 << 21) // state.bars.size // len(frames))
    parts = (slice(start, start + step) for start in range(0, codes.shape[1], step))
    return np.concatenate([compositor.compose(state, frames[:, :, p], present, c[..., p])[0, :, :3] for p in parts])


def levels_apart(picture: np.ndarray, expected: np.ndarray) -> float:
    """The largest difference of linear colors, in 8-bit levels."""
    return float(np.abs(light.to_encoded(picture) - light.to_encoded(expected)).max() * 255)


@cache
def edged(height: int, width: int) -> np.ndarray:
    """A guide (h, w, 3) float32 of so many pixels, on cells as large as compute.guide would make them: random colors
    16 rows of a 240th apart, and what is linear between them."""
    cell = guide.cell_of(min(height, width))
    height, width = -(-height // cell), -(-width // cell)
    rng = np.random.default_rng(1)
    pitch = 16 * min(height, width) / guide.ROWS
    found = rng.random((int(height / pitch) + 2, int(width / pitch) + 2, 3)).astype(np.float32)
    for axis, length in enumerate((height, width)):
        before, share = np.divmod(np.arange(length) / pitch, 1)
        share = np.expand_dims(share, [a for a in range(3) if a != axis]).astype(np.float32)
        before = before.astype(int)
        found = (1 - share) * found.take(before, axis) + share * found.take(before + 1, axis)
    return found * np.float32(min(height, width) / guide.ROWS)


def following(count: int, window: int, size) -> Following:
    """What the last of some shutters follows: from frame to frame 4 pixels on, turned by 0.06° and 0.05 % larger."""
    turns, shifts = np.ones((window, count), complex), np.zeros((window, count), complex)
    centre, frames = complex(*size) / 2, np.arange(window)
    turns[:, -1] = (1 + 0.0005 * frames) * np.exp(0.001j * frames)
    shifts[:, -1] = (1 - turns[:, -1]) * centre + (3.3 + 1.7j) * frames
    return Following(0, turns, shifts)


def combining(state: FrameState, mode: str) -> FrameState:
    """The state whose shutters all make that of the frames."""
    return replace(state, combines=(Combine(mode),) * len(state.bars))


def combined_reference(state: FrameState, mode: str, codes: np.ndarray, c: np.ndarray) -> np.ndarray:
    """float64 colors (P, 3) of pixels with coefficients c (N, P), whose samples in the frames are codes (L, P, 4)."""
    encoded = state.options.light == "encoded"
    lights = codes / 255.0 if encoded else light.premultiplied(codes / 255.0, light.to_linear)
    c = np.maximum(c, 0).astype(np.float64)
    weights = compositor.counts(Combine(mode), state.bars, (c / c.sum(axis=0)).T, state.options.interpolation)
    samples = [compositor.Sample(own[:, None], weights[:, None, k]) for k, own in enumerate(lights)]
    found = compositor.of_samples(Combine(mode), samples, encoded=encoded)[:, 0, :3]
    return light.to_linear(found) if encoded else found


def has_mattes() -> bool:
    return all(importlib.util.find_spec(name) for name in ("av", "OpenImageIO"))


def matte_frames(width: int, height: int):
    """Values (h, w) uint8 of an outline's frames: two discs, smooth at their edges, that pass one another."""
    y, x = np.mgrid[:height, :width].astype(np.float32) + 0.5
    for k in range(MATTE_FRAMES):
        along = width * (0.3 + 0.4 * k / MATTE_FRAMES)
        discs = (along, 0.4 * height, 0.3 * height), (width - along, 0.6 * height, 0.2 * height)
        inside = [np.clip(r - np.hypot(x - a, y - b) + 0.5, 0, 1) for a, b, r in discs]
        yield np.rint(255 * np.maximum(*inside)).astype(np.uint8)


def write_mattes(folder: Path, width: int, height: int) -> dict[str, SourceFile]:
    """The same frames as a movie and as an image sequence, written into a folder."""
    import av
    from OpenImageIO import ImageBuf

    from shutter_addon.media.opening import MatteFile

    width, height = width - width % 2, height - height % 2  # as H.264 has it
    with av.open(str(folder / "matte.mp4"), "w") as movie:
        stream = movie.add_stream("libx264", rate=25, options={"crf": "18"})
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        for k, values in enumerate(matte_frames(width, height)):
            ImageBuf(values[..., None]).write(str(folder / f"{k:04}.png"))
            movie.mux(stream.encode(av.VideoFrame.from_ndarray(values, format="gray")))
        movie.mux(stream.encode())
    return {"matte": MatteFile(folder / "matte.mp4"), "matte_images": MatteFile(folder / "0000.png")}


class LayerCase:
    """A soft disc that is exposed by itself, by a shutter alone, before what the others make."""

    def __init__(self, compositor, source, state: FrameState, shutter: int):
        self._compositor, self._source, self._state = compositor, source, state
        self._own, self._laying = state.of([shutter]), compositor.stages()
        window, shutters = state.options.window, len(state.bars)
        kind = {"alone": False, "colored": False}
        behind = WeightedFrames(source, lambda index: 1 - self.matte(index), rest=True, **kind)
        own = WeightedFrames(source, self.matte, rest=False, **kind)
        self.windows = [compositor.window(frames, window, False, shutters) for frames in (behind, own)]

    @cache  # noqa: B019 – of a case, which goes with it
    def matte(self, index: int) -> np.ndarray:
        height, width = self._source.height, self._source.width
        y, x = np.ogrid[:height, :width]
        away = np.hypot(x - (width / 4 + 4 * index % (width / 2)), y - height / 2)
        return np.clip((height / 5 - away) / 8 + 0.5, 0, 1).astype(np.float32)

    def draw(self, index: int, coefficients: Coefficients):
        """The picture of frame `index`, of loaded windows."""
        whole = Coefficients(self._laying.upload(np.ones((1, 1, 1))), max(self._source.width, self._source.height))
        behind = self._compositor.draw(self.windows[0], Request(index, self._state), coefficients)
        own = self._compositor.draw(self.windows[1], Request(index, self._own), whole)
        exposures = Exposure(behind, behind), Exposure(own, own)
        self._laying.least_share(exposures[0])
        return self._laying.lay(Behind(exposures[0]), exposures[1:], False)

    def expected(self, frames, y, x, coefficients: np.ndarray) -> np.ndarray:
        """float64 colors (P, 3) of pixels; frames: the source's in the window; coefficients: (N, P)."""
        colors = [light.premultiplied(self._source.read(int(k))[y, x] / 255.0, light.to_linear)[None] for k in frames]
        mattes_ = np.stack([self.matte(int(k))[y, x].astype(np.float64)[None] for k in frames])[None]
        layers = Layers(shutters=(1,), opacities=(1.0,), first=0, scribbles=(), mattes=())
        state, present = replace(self._state, layers=layers), np.ones(len(colors), bool)
        return exact_layers.compose(state, colors, present, coefficients[:, None].astype(np.float64), mattes_)[0, :, :3]

    def release(self) -> None:
        for window in self.windows:
            window.release()
        self._laying.release()


class MatteCase:
    """Mattes of both kinds for one case, a frame further with each."""

    def __init__(self, files, size):
        from shutter_addon.media.matte_values import MatteValues

        self._files, self._readers = files, {kind: MatteValues(*size) for kind in files}
        self._index = dict.fromkeys(files, -1)

    def read(self, kind: str, block: int):
        """The mattes, and the layers of the next frame."""
        self._index[kind] = (self._index[kind] + 1) % MATTE_FRAMES
        shown = (mattes.Matte(1, mattes.FileFrame(self._files[kind])),)
        return shown, self._readers[kind].values(shown, self._index[kind], block)

    def close(self) -> None:
        for reader in self._readers.values():
            reader.close()


@dataclass
class Case:
    """One configuration on the device. `index`: the source frame that is composed; what slides the window moves it."""

    device: GLDevice
    source: Noise
    state: FrameState
    kind: str
    index: int = 0
    follows: bool = True
    mattes: MatteCase | None = None

    def __post_init__(self):
        size = self.source.width, self.source.height
        self.followed = replace(self.state, following=following(len(self.state.bars), self.state.options.window, size))
        count, block = len(self.state.bars), self.state.options.aggregate
        self._open(self.state.options.window)
        width, height = -(-self.source.width // block), -(-self.source.height // block)
        self.labels = scribbles.rasterise(self.state.shapes, width, height)
        self.moved = np.roll(self.labels, max(1, width // 640), axis=(0, 1))  # three pixels of 1920
        self.solver = self.compositor.stages()
        self.handle = self.solver.solve(self.labels, count)
        self.edge_solver = self.compositor.stages()
        self.matting, self.layers = self.compositor.stages(), None

    @cached_property
    def layer(self) -> LayerCase:
        opened = LayerCase(self.compositor, self.source, self.state, 1)
        self.load(*opened.windows)
        return opened

    def _open(self, window: int) -> None:
        self.compositor = GPUCompositor(self.device)
        self.window = self.compositor.window(self.source, window)
        self.whole = self.compositor.window(self.source, window, True) if self.follows else None
        # What the other methods read.
        plain = isinstance(self.window, Frames)
        self.frames = self.window if plain else Frames(self.device, self.source, window)
        accumulations = np.stack([shutters.accumulation(b) for b in self.state.bars])
        self.sums = self.device.texture(accumulations.shape[1], len(accumulations), 1, "r32f")
        self.device.write(self.sums, np.ascontiguousarray(accumulations[..., None], dtype=np.float32))

    @property
    def _wanted(self) -> np.ndarray:
        return np.arange(self.index, self.index + self.state.options.window)

    def load(self, *windows) -> None:
        for window in windows or filter(None, (self.window, self.frames, self.whole)):
            window.load(self._wanted, self.state.options, range(self.source.count))

    def compose(self, method: str) -> None:
        if method in ("ours", "follow", "layer", *COMBINED):
            self.drawn = self._drawn(method)
            return
        self.drawn, block = self.window.picture(), self.state.options.aggregate if method == "paper" else 1
        program = _program("appendix_a" if method == "paper" else "average", self.state)
        for part, frames in self.frames.stored():
            extent = (-(-self.source.width // block), -(-part.height // block))
            textures = {"frames": frames, "coefficients": self.handle, "sums": self.sums}
            self.device.run(
                program,
                extent,
                textures=textures,
                images={"picture": self.drawn},
                size=(self.source.width, part.height),
                top=part.top,
                height=self.source.height,
                first_layer=self.index % self.frames.layers,
            )

    def _drawn(self, method: str):
        block = self.state.options.aggregate
        if method == "layer":
            self.load(*self.layer.windows)
            return self.layer.draw(self.index, Coefficients(self.handle, block))
        if method == "ours":
            return self.compositor.draw(self.window, Request(self.index, self.state), Coefficients(self.handle, block))
        if method in COMBINED:
            request = Request(self.index, combining(self.state, method))
            return self.compositor.draw(self.frames, request, Coefficients(self.handle, block))
        moved = replace(self.followed.following, first=self.index)
        state = replace(self.followed, following=moved)
        return self.compositor.draw(self.whole, Request(self.index, state), Coefficients(self.handle, block))

    def accumulate(self, method: str) -> None:
        self.index += 1
        windows = {"ours": [self.window], "layer": self.layer.windows if method == "layer" else ()}
        self.load(*windows.get(method, [self.frames]))

    def diffuse(self, method: str) -> None:
        if method == "edges":
            self.edges = self.edge_solver.solve(self.labels, len(self.state.bars), edged(*self.labels.shape), 1.0)
        else:
            self.handle = self.solver.solve(self.labels, len(self.state.bars))

    def diffuse_moved(self, method: str) -> None:
        self.labels, self.moved = self.moved, self.labels
        self.solver.solve(self.labels, len(self.state.bars), warm=True)

    def readback(self, method: str) -> np.ndarray:
        return self.compositor.read(self.drawn)

    def frame(self, method: str) -> None:
        self.accumulate(method)
        self.compose(method)
        self.readback(method)

    def _read(self, kind: str, method: str) -> None:
        self.mattes.read(kind, self.state.options.aggregate)

    def _lay(self, kind: str, method: str) -> None:
        self.layers = self.mattes.read(kind, self.state.options.aggregate)
        self.matte_blend()

    matte, matte_images = partialmethod(_lay, "matte"), partialmethod(_lay, "matte_images")
    matte_read, matte_images_read = partialmethod(_read, "matte"), partialmethod(_read, "matte_images")

    def matte_blend(self, method: str = "ours") -> None:
        """Lays what was read last, whose values are on the device then."""
        self.layers = self.layers or self.mattes.read("matte", self.state.options.aggregate)
        self.laid = self.matting.blend(self.handle, *self.layers)

    def error(self, name: str, method: str, pixels: int) -> float | None:
        """The largest error of what a pass just made."""
        if method == "edges":
            return self._edges_error()
        if name in ("diffuse", "diffuse_moved"):
            return self._diffusion_error()
        if name in MATTES:
            return None if name.endswith("read") else self._matte_error()
        if name == "readback":
            return None
        if name == "accumulate":
            self.compose(method)
        rng = np.random.default_rng(self.index)
        y, x = rng.integers(0, self.source.height, pixels), rng.integers(0, self.source.width, pixels)
        picture = self.readback(method)[y, x, :3].astype(np.float64)
        if method == "layer":
            return levels_apart(picture, self.layer.expected(self._wanted, y, x, self._coefficients(y, x)))
        expected = self._followed(y, x) if method == "follow" else self._reference(y, x, method)
        return levels_apart(picture, expected)

    def _reference(self, y, x, method: str) -> np.ndarray:
        """float64 colors (P, 3) of pixels."""
        codes = np.stack([self.source.read(k)[y, x] for k in self._wanted])
        if method == "average":
            encoded = self.state.options.light == "encoded"
            mean = (codes / 255.0 if encoded else light.to_linear(codes / 255.0))[..., :3].mean(axis=0)
            return light.to_linear(mean) if encoded else mean
        if method in COMBINED:
            return combined_reference(self.state, method, codes, self._coefficients(y, x))
        return reference(self.state, codes, self._coefficients(y, x))

    def _coefficients(self, y, x) -> np.ndarray:
        block = self.state.options.aggregate
        return self.compositor.coefficients(self.handle, len(self.state.bars))[:, y // block, x // block]

    def _followed(self, y, x) -> np.ndarray:
        """float64 colors (P, 3) of pixels of what follows."""
        c = self._coefficients(y, x).astype(np.float64)
        weights = compositor.mixed_shutter(self.state, np.moveaxis(c, 0, -1))
        weights /= weights.sum(axis=-1, keepdims=True)
        turns, shifts = self.followed.following.at(np.arange(len(self._wanted)))
        total = 0.0
        for k, index in enumerate(self._wanted):
            frame = light.premultiplied(self.source.read(int(index)) / 255.0, light.to_linear)[..., :3]
            places = np.einsum("n,np->p", turns[k], c) * (x + 1j * y) + np.einsum("n,np->p", shifts[k], c)
            total = total + weights[:, k, None] * compositor.seen(frame, places, sharp=True)
        return total

    def _diffusion_error(self) -> float:
        """Of what was solved last."""
        count, exact = len(self.state.bars), self.compositor.stages()
        with mock.patch.multiple(diffusion_gpu, CYCLES=12, WHOLE=max(self.labels.shape)):
            expected = self.compositor.coefficients(exact.solve(self.labels, count), count)
        exact.release()
        return float(np.abs(self.compositor.coefficients(self.handle, count) - expected).max() * 255)

    def _matte_error(self) -> float:
        """Of what was laid last."""
        count, (shown, layers) = len(self.state.bars), self.layers
        beneath = self.compositor.coefficients(self.handle, count).astype(np.float64)
        expected = mattes.blended(beneath, shown, [values for _, values in layers])
        return float(np.abs(self.compositor.coefficients(self.laid, count) - expected).max() * 255)

    def _edges_error(self) -> float:
        """Of what was solved last, along edges."""
        count = len(self.state.bars)
        got = self.compositor.coefficients(self.edges, count).copy()
        with mock.patch.multiple(edge_diffusion_gpu, LAST_CYCLES=(4,) * 8, CYCLES=(4,) * 16, ENOUGH=0):
            self.diffuse("edges")
        return float(np.abs(self.compositor.coefficients(self.edges, count) - got).max() * 255)

    def release(self) -> None:
        for window in filter(None, (self.window, self.frames, self.whole, self.__dict__.get("layer"))):
            window.release()
        self.solver.release()
        self.edge_solver.release()
        self.matting.release()
        self.sums.release()
        with mock.patch.object(self.compositor.device, "release"):  # which goes on with the next case
            self.compositor.release()


def _program(name: str, state: FrameState) -> Pass:
    common = {"LAST": state.options.window, "DECODE": int(state.options.light == "linear")}
    own = {"SHUTTERS": len(state.bars), "AGGREGATE": state.options.aggregate, "SHARED": 1}
    return read_pass(str(HERE / name), **common | (own if name == "appendix_a" else {}))


def jobs(case: Case, passes, methods):
    """(pass, method) of what is measured in a case."""
    for name, method in itertools.product(passes, methods):
        has = {
            "ours": PASSES,
            "layer": ("compose", "accumulate", "frame") if len(case.state.bars) > 1 else (),
            "paper": ("compose",),
            "average": ("compose", "accumulate", "frame"),
            "edges": ("diffuse",),
            **dict.fromkeys(COMBINED, ("compose",)),
            "follow": ("compose",) if case.state.options.light == "linear" else (),
        }
        if case.mattes is None and name in MATTES:
            continue
        if name in has[method] and (method != "average" or case.state.options.aggregate == 1):
            yield name, method


def measure(case: Case, args) -> list[dict]:
    """Return the rows of a case. What took `patience` seconds is not repeated."""
    todo, errors, times = list(jobs(case, args.passes, args.methods)), {}, {}
    for name, method in todo:
        first = timed(case, name, method)
        times[name, method] = [first] if first > args.patience else []  # else it has compiled and warmed up
        errors[name, method] = case.error(name, method, args.pixels)
    for _ in range(args.repeats):
        for name, method in todo:
            if sum(times[name, method]) < args.patience:
                times[name, method].append(timed(case, name, method))
    options = case.state.options
    common = {
        "bars": case.kind,
        "width": case.source.width,
        "height": case.source.height,
        "shutters": len(case.state.bars),
        "window": options.window,
        "aggregate": options.aggregate,
        "device": case.device.name,
    }
    return [
        {"pass": name, "method": method, **common, "ms": statistics.median(times[name, method]) * 1000, "error": error}
        for (name, method), error in errors.items()
    ]


def timed(case: Case, name: str, method: str) -> float:
    case.load()
    case.device.finish()
    start = time.perf_counter()
    getattr(case, name)(method)
    case.device.finish()
    return time.perf_counter() - start


def run(args) -> list[dict]:
    device = GLDevice()
    has_matte = has_mattes() and "ours" in args.methods and not set(MATTES).isdisjoint(args.passes)
    with device.current(), tempfile.TemporaryDirectory() as folder:
        rows = []
        for width, height in args.sizes:
            source = Noise(width, height)
            files = write_mattes(Path(folder), width, height) if has_matte else None
            kinds = itertools.product(args.windows, args.shutters, args.bars, args.aggregates)
            for window, count, kind, block in kinds:
                options = Options(window, light=args.light, aggregate=block)
                state = FrameState(options, bars(kind, count, window), shapes(count))
                follows = "follow" in args.methods and "compose" in args.passes
                matte = files and MatteCase(files, (width, height))
                case = Case(device, source, state, kind, follows=follows, mattes=matte)
                for row in measure(case, args):
                    error = "" if row["error"] is None else f"{row['error']:.3f}"
                    place = f"{width}×{height} N={count} L={window} {kind} {block}×"
                    print(f"{place:34s} {row['pass']:17s} {row['method']:8s} {row['ms']:10.2f} ms {error}", flush=True)
                    rows.append(row)
                case.release()
                if matte:
                    matte.close()
    return rows


def parse():
    def listed(of, allowed=None):
        def split(text):
            values = [of(part) for part in text.split(",")]
            if allowed and not set(values) <= set(allowed):
                raise argparse.ArgumentTypeError(f"of {', '.join(map(str, allowed))}")
            return values

        return split

    def size(text):
        width, height = text.split("x")
        return int(width), int(height)

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("--json", type=Path, help="where the rows are written")
    add("--sizes", type=listed(size), default="1920x1080,3840x2160")
    add("--shutters", type=listed(int, range(1, 9)), default="2,3,4,8")
    add("--windows", type=listed(int, range(1, 257)), default="8,16,32,64,128")
    add("--bars", type=listed(str, (*BARS, "random")), default="preset,random")
    add("--methods", type=listed(str, METHODS), default=",".join(METHODS))
    add("--passes", type=listed(str, PASSES), default=",".join(PASSES))
    add("--aggregates", type=listed(int, (1, 2, 4)), default="1,2")
    add("--light", choices=("linear", "encoded"), default="linear")
    add("--repeats", type=int, default=5)
    add("--patience", type=float, default=20.0, help="seconds after which a pass is not repeated")
    add("--pixels", type=int, default=2048, help="how many are compared with the reference")
    return parser.parse_args()


def main() -> None:
    args = parse()
    rows = run(args)
    if args.json:
        args.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
