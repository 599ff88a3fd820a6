"""How fast a machine composes: pictures from random frames in memory, for a table that a bug report can carry.

Nothing is decoded, and scribbles stand still, so that they are diffused once, before the time is taken. What
scripts/benchmark.py measures pass by pass has its footage and its shutters from here as well.
"""

from __future__ import annotations

import itertools
import platform
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from ..core.frames import light
from ..core.frames.frame_source import FrameSource
from ..core.model import presets, scribbles
from ..core.model.frame_state import FrameState, Options
from ..core.pixels import compositor
from ..devices.budget import MEGABYTE
from ..devices.device import NoDeviceError
from .renderer import Renderer
from .request import Request

SIZES = (1280, 720), (1920, 1080), (3840, 2160)
WINDOWS = 8, 16, 64
SHUTTERS = 3
# Window lengths of which the largest is looked for that plays, and pictures a second that playing takes.
LENGTHS = 2, 4, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256
RATE = 24
# Pictures that are timed, after a first one that fills the window; and seconds after which there are no more, but one.
PICTURES, PATIENCE = 7, 2.0
# Pixels that are compared with the reference.
COMPARED = 256
# Bars that are constant over spans, and bars that change from frame to frame.
BARS = {
    "preset": ("ANGLE_360", "STILL", "TWO_CUTS", "ANGLE_180", "LAST", "CUTS", "ANGLE_90", "ANGLE_45"),
    "smooth": ("RAMP_UP", "GAUSSIAN", "TRAIL", "TRIANGLE", "RAMP_DOWN", "STILL", "ANGLE_360", "ANGLE_180"),
}
MEASURED = (
    f"{SHUTTERS} shutters that are open over spans; scribbles stand still. Frames are random and in memory: nothing is"
    " decoded. A picture's time is from the next frame to the composed picture on the device."
)


class Noise(FrameSource):
    """A clip of random frames, every one another cut of the same noise."""

    path, fps, options = Path("noise"), None, {}
    transfer, alpha, dtype, count = "srgb", "opaque", np.dtype(np.uint8), 100_000

    def __init__(self, width: int, height: int):
        self.width, self.height = width, height
        self._size = width * height
        rng = np.random.default_rng(0)
        pixels = rng.integers(0, 256, (self._size + 1_000_003, 4), dtype=np.uint8)
        pixels[:, 3] = 255
        self._pixels = pixels

    def close(self) -> None:
        """There is no file."""

    def read(self, index: int) -> np.ndarray:
        start = index * 7919 % 1_000_003
        return self._pixels[start : start + self._size].reshape(self.height, self.width, 4)


def bars(kind: str, count: int, window: int) -> np.ndarray:
    """Bars (count, window) of some shutters, of a kind of BARS or "random" ones."""
    if kind == "random":
        return np.random.default_rng(window).random((count, window))
    return np.stack([presets.bars(name, window) for name in BARS[kind][:count]])


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
    """The linear colours (P, 3) float64 of pixels: core.pixels.compositor's, a few at a time, for their weights are
    large.

    codes: (L, P, 4) uint8 of the window's frames; coefficients: (N, P)"""
    frames: Any = light.premultiplied(codes / 255.0, light.to_linear)[:, None]
    c, present = coefficients[:, None].astype(np.float64), np.ones(len(frames), dtype=bool)
    step = max(1, (1 << 21) // state.bars.size // len(frames))
    parts = (slice(start, start + step) for start in range(0, codes.shape[1], step))
    return np.concatenate([compositor.compose(state, frames[:, :, p], present, c[..., p])[0, :, :3] for p in parts])


def levels_apart(picture: np.ndarray, expected: np.ndarray) -> float:
    """The largest difference of linear colours, in 8-bit levels."""
    return float(np.abs(light.to_encoded(picture) - light.to_encoded(expected)).max() * 255)


def measure(compositor: Any, size: tuple[int, int], window: int) -> dict:
    """A row of the table: pictures of a size (width, height) with a window of so many frames.

    ms: a picture's time, from the next frame to the composed picture on the device; readback_ms: to have it on the host
    fps: pictures a second without reading them back; memory: bytes of the device's textures, None for NumPy
    error: the largest of random pixels, in 8-bit levels, against the reference. NoDeviceError: there is no room."""
    state = FrameState(options=Options(window=window), bars=bars("preset", SHUTTERS, window), shapes=shapes(SHUTTERS))
    renderer = Renderer(compositor, source := Noise(*size))
    try:
        with compositor.current():
            times = []
            for index in range(PICTURES + 1):
                start = time.perf_counter()
                picture = compositor.read(drawn := renderer.draw(Request(index=index, state=state)))
                middle = time.perf_counter()
                compositor.read(drawn)
                readback = time.perf_counter() - middle
                times.append((max(middle - start - readback, 0.0), readback))
                if index and sum(map(sum, times[1:])) > PATIENCE:
                    break
            memory = compositor.device.budget.used if hasattr(compositor, "device") else None
            rng = np.random.default_rng(window)
            y, x = rng.integers(0, source.height, COMPARED), rng.integers(0, source.width, COMPARED)
            colours = picture[y, x, :3].copy()
            coefficients = renderer.coefficients(Request(index=index, state=state))[:, y, x]
        codes = np.stack([source.read(k)[y, x] for k in range(index, index + window)])
    finally:
        renderer.close()
    seconds, readback = (median(part) for part in zip(*times[1:], strict=True))
    return {
        "width": size[0],
        "height": size[1],
        "window": window,
        "ms": seconds * 1000,
        "readback_ms": readback * 1000,
        "fps": 1 / max(seconds, 1e-6),
        "memory": memory,
        "error": levels_apart(colours, reference(state, codes, coefficients)),
    }


class Timetable:
    """Rows, measured once each, as long as there is time: a row is taken to need as long for each pixel of its frames
    as the slowest one before.

    seconds: there are in all"""

    def __init__(self, compositor: Any, seconds: float):
        self._compositor = compositor
        self._end = time.monotonic() + seconds
        self._pace = 0.0
        self._rows: dict[tuple, dict] = {}

    def row(self, size: tuple[int, int], window: int) -> dict:
        """As `measure`; what was not measured has "left_out", why, in place of numbers."""
        if (size, window) not in self._rows:
            self._rows[size, window] = self._measured(size, window)
        return self._rows[size, window]

    def _measured(self, size: tuple[int, int], window: int) -> dict:
        work, start = size[0] * size[1] * (window + PICTURES), time.monotonic()
        place = {"width": size[0], "height": size[1], "window": window}
        if start + self._pace * work > self._end:
            return {**place, "left_out": "too slow"}
        try:
            return measure(self._compositor, size, window)
        except (NoDeviceError, MemoryError):
            return {**place, "left_out": "no room"}
        finally:
            self._pace = max(self._pace, (time.monotonic() - start) / work)


def largest_that_plays(rows: Timetable, size: tuple[int, int]) -> dict:
    """The largest of LENGTHS with which pictures of a size come RATE times a second: {width, height, window}, window
    None where there is none; "left_out" where that could not be measured."""
    low, high, why = 0, len(LENGTHS), None  # those below `low` play, and those from `high` on do not
    while low < high:
        # The shortest first: where it does not play, none does.
        middle = (low + high) // 2 if low else 0
        row = rows.row(size, LENGTHS[middle])
        why = row.get("left_out")
        if row.get("fps", 0) >= RATE:
            low = middle + 1
        else:
            high = middle
            if why == "too slow":
                break
    largest = {"width": size[0], "height": size[1], "window": LENGTHS[low - 1] if low else None}
    return largest | ({"left_out": why} if why == "too slow" else {})


def run(
    compositor: Any,
    sizes: Sequence[tuple[int, int]] = SIZES,
    windows: Sequence[int] = WINDOWS,
    seconds: float = 60.0,
    update: Callable[[], Any] = lambda: None,
) -> tuple[list, list]:
    """The rows of `measure`, and for each size that of `largest_that_plays`. update: called after each of them."""
    timetable, rows, plays = Timetable(compositor, seconds), [], []
    for size in sizes:
        plays.append(largest_that_plays(timetable, size))
        update()
    for size, window in itertools.product(sizes, windows):
        rows.append(timetable.row(size, window))
        update()
    return rows, plays


def table(rows: list[dict], plays: list[dict]) -> str:
    """Both as Markdown."""
    heads = "size", "frames", "picture, ms", "frames/s", "read back, ms", "device memory, MB", "error, levels"
    lines = [f"| {' | '.join(heads)} |", "|---" + "|--:" * (len(heads) - 1) + "|"]
    for row in rows:
        place = f"| {row['width']}×{row['height']} | {row['window']} |"
        if "left_out" in row:
            lines.append(f"{place} {row['left_out']} |{' |' * (len(heads) - 3)}")
            continue
        memory = "–" if row["memory"] is None else f"{row['memory'] / MEGABYTE:.0f}"
        numbers = f"{row['ms']:.1f}", f"{row['fps']:.1f}", f"{row['readback_ms']:.1f}", memory, f"{row['error']:.2f}"
        lines.append(f"{place} {' | '.join(numbers)} |")
    lines += ["", f"| size | most frames that play at {RATE} frames/s |", "|---|--:|"]
    for row in plays:
        known = "none" if row["window"] is None else str(row["window"])
        if row.get("left_out"):
            known = "not measured" if row["window"] is None else f"{known} or more"
        lines.append(f"| {row['width']}×{row['height']} | {known} |")
    return "\n".join(lines)


def processor() -> str:
    """The processor's name, as far as the system tells."""
    with suppress(OSError, subprocess.SubprocessError, StopIteration):
        if sys.platform == "linux":
            lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
            return next(line for line in lines if line.startswith("model name")).partition(":")[2].strip()
        if sys.platform == "darwin":
            asked = ["sysctl", "-n", "machdep.cpu.brand_string"]
            return subprocess.run(asked, capture_output=True, text=True, check=True, timeout=5).stdout.strip()
    return platform.processor() or platform.machine()
