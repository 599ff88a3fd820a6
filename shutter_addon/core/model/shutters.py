"""Shutters: bars, exposure, accumulation, quantile, and their interpolation (paper §3.1, §3.2, §3.4.1).

A shutter is an array of L bars ≥ 0, one per source frame of the window: how much that frame contributes. Its exposure
is e = Σ bars. Its normalised accumulation S is piecewise linear on [0, L] and rises from 0 to 1. Its quantile S⁻¹ maps
z in [0, 1] to a time in [0, L]. Everything here is exact, in float64, and the reference of every device.

Smooth makes frames between filmed ones. All of these are called moments; bars of filmed frames are spread over them.

Presets make L bars in [0, 1] from a window length and a few parameters.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .limits import MAX_BAR, MIN_EXPOSURE

MAX_WINDOW = 256

# As a fraction of the exposure: interpolation of bars may leave this much in a closed bar by rounding.
_CLOSED = 1e-9
_SEEN = 1 / 255  # of the largest bar: less light in other moments is invisible


class ShutterError(ValueError):
    """Numbers are not valid bars of a shutter. The message is one sentence for the user."""


def check_bars(bars: ArrayLike) -> np.ndarray:
    """Return bars as a float64 array (L,), if they are valid: 1 to 256 finite numbers, each 0 to a million.

    Their sum must be at least a millionth in float32, in which Blender stores numbers.

    Raises:
        ShutterError: The bars are invalid.
    """
    bars = np.asarray(bars, dtype=np.float64)
    if bars.ndim != 1 or not 1 <= len(bars) <= MAX_WINDOW:
        raise ShutterError(f"a shutter has 1 to {MAX_WINDOW} bars, not {bars.size}")
    if not np.isfinite(bars).all():
        raise ShutterError("a bar is not a finite number")
    if (bars < 0).any():
        raise ShutterError("a bar is negative")
    if (bars > MAX_BAR).any():
        raise ShutterError("a bar is above a million")
    if not bars.any():
        raise ShutterError("all bars are zero: the shutter never opens")
    if bars.astype(np.float32).sum() < np.float32(MIN_EXPOSURE):
        raise ShutterError("the bars are less than a millionth together: the shutter never opens")
    return bars


def accumulation(bars: ArrayLike) -> np.ndarray:
    """Return the normalised accumulation S of bars (L,): (L + 1,) float64, from 0 to exactly 1.

    S at boundary k is the share of the light that falls on the frames before frame k. Bars as in `check_bars`.
    """
    sums = np.concatenate([[0.0], np.cumsum(np.asarray(bars, dtype=np.float64))])
    return sums / sums[-1]


@dataclass(frozen=True)
class Quantile:
    """The quantile S⁻¹ of one or more shutters as linear pieces: at which time the share z of the light has come in.

    Piece k runs from time start[k] at z[k] to end[k] at z[k + 1]. Where end[k] < start[k + 1], the shutter is closed in
    between and S⁻¹ jumps.

    Attributes:
        z: (K + 1,), the bounds of the pieces, from 0 to 1.
        start, end: Times in frames of the window, (K,), or (K, N) for N shutters with common z.
    """

    z: np.ndarray
    start: np.ndarray
    end: np.ndarray


def quantile(bars: ArrayLike) -> Quantile:
    """Return the quantile of one shutter's bars (L,): a piece for each open bar."""
    total = accumulation(bars)
    is_open = np.diff(total) > 0
    frames = np.flatnonzero(is_open).astype(np.float64)
    z = np.concatenate([[0.0], total[1:][is_open]])
    return Quantile(z, frames, frames + 1.0)


def knots(shutters: ArrayLike) -> Quantile:
    """Return the quantiles of N shutters, divided into the same pieces, so that they can be mixed piece by piece.

    A pixel that mixes the shutters by coefficients c (N,) has the quantile whose piece k runs from c·start[k] to
    c·end[k], with the same z. Two pieces are one if no shutter closes or changes its height between them: shutters that
    each have one block of equal bars need one piece, however long they are.

    Args:
        shutters: Bars (N, L).

    Returns:
        A Quantile with K pieces; start and end have the shape (K, N).
    """
    parts = [quantile(bars) for bars in np.atleast_2d(shutters)]
    levels = np.unique(np.concatenate([part.z for part in parts]))
    # Closer levels are equal: the difference is far below any visible weight, but above float rounding.
    levels = levels[np.concatenate([[True], np.diff(levels) > 1e-12])]
    levels[-1] = 1.0
    start, end = (np.stack(side, axis=1) for side in zip(*(_on_levels(p, levels) for p in parts), strict=True))
    slope = (end - start) / np.diff(levels)[:, None]
    jumps = np.abs(start[1:] - end[:-1]) > 1e-9
    turns = np.abs(np.diff(slope, axis=0)) > 1e-9 * (slope[1:] + slope[:-1])
    keep = (jumps | turns).any(axis=1)  # the inner levels
    return Quantile(
        np.concatenate([[0.0], levels[1:-1][keep], [1.0]]),
        start[np.concatenate([[True], keep])],
        end[np.concatenate([keep, [True]])],
    )


def _on_levels(part: Quantile, levels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Divide the pieces of one shutter's quantile at more bounds z.

    Args:
        part: The quantile.
        levels: The new bounds (n + 1,) from 0 to 1, ascending. They include all bounds of `part`, within rounding.

    Returns:
        The times (n,) at which each new piece starts, and the times (n,) at which it ends, in frames of the window.
    """
    middle = (levels[:-1] + levels[1:]) / 2
    piece = np.clip(np.searchsorted(part.z, middle) - 1, 0, len(part.start) - 1)
    z0, z1 = part.z[piece], part.z[piece + 1]
    slope = (part.end[piece] - part.start[piece]) / (z1 - z0)
    start = part.start[piece] + (levels[:-1] - z0) * slope
    end = part.end[piece] - (z1 - levels[1:]) * slope
    return np.clip(start, part.start[piece], part.end[piece]), np.clip(end, part.start[piece], part.end[piece])


def weights(start: np.ndarray, end: np.ndarray, dz: np.ndarray, window: int) -> np.ndarray:
    """Return which share of the light each of the L frames of a window gets, for many pixels: (…, L) with the sum 1.

    Each piece of a pixel's quantile spreads its share of the light evenly from its start time to its end time: q(τ) =
    Q(τ + 1) − Q(τ), with Q the inverse of the quantile.

    Args:
        start, end: When each pixel's K pieces start and end, in frames of the window, (…, K).
        dz: The share of the light of each piece, (K,), the same for all pixels.
        window: The number of frames L.
    """
    pixels = tuple(range(start.ndim - 1))
    begun, over = start.min(axis=pixels), end.max(axis=pixels)
    levels = np.zeros((*start.shape[:-1], window + 1))
    for time in range(1, window + 1):
        # Skip pieces that have ended for all pixels, or not begun for any.
        first, last = np.searchsorted(over, time, "right"), np.searchsorted(begun, time, "left")
        some = slice(first, last)
        # Slopes are ≥ 1, so end − start ≥ dz > 0.
        passed = (time - start[..., some]) / (end[..., some] - start[..., some])
        levels[..., time] = dz[:first].sum() + np.clip(passed, 0, 1) @ dz[some]
    return np.diff(levels, axis=-1)


def displace(shutters: ArrayLike, coefficients: ArrayLike) -> np.ndarray:
    """Interpolate N shutters by displacement: their light moves in time instead of fading (paper §3.2, §3.4.1).

    The quantile S⁻¹ of the result is the weighted mean of the shutters' quantiles (see the module).

    Args:
        shutters: Bars (N, L).
        coefficients: How much of each shutter to take, (…, N), ≥ 0, with the sum 1.

    Returns:
        Bars (…, L) of the interpolated shutter. Their sum is its exposure: the weighted mean Σ cᵢ eᵢ of the shutters'
        exposures.
    """
    shutters = np.atleast_2d(np.asarray(shutters, dtype=np.float64))
    coefficients = np.asarray(coefficients, dtype=np.float64)
    table = knots(shutters)
    q = weights(coefficients @ table.start.T, coefficients @ table.end.T, np.diff(table.z), shutters.shape[1])
    return q * (coefficients @ shutters.sum(axis=1))[..., None]


def mix(shutters: ArrayLike, coefficients: ArrayLike) -> np.ndarray:
    """Interpolate N shutters by value: bar by bar. The pictures that they make fade into each other.

    Args:
        shutters: Bars (N, L). No shutter has only zeros.
        coefficients: How much of each shutter to take, (…, N), ≥ 0, with the sum 1.

    Returns:
        Bars (…, L). Each shutter is scaled to the sum 1, and the weighted mean of these is taken. It is then scaled to
        the weighted mean of the shutters' exposures (the sums of their bars), as in `displace`.
    """
    shutters = np.atleast_2d(np.asarray(shutters, dtype=np.float64))
    coefficients = np.asarray(coefficients, dtype=np.float64)
    q = coefficients @ (shutters / shutters.sum(axis=1, keepdims=True))
    return q * (coefficients @ shutters.sum(axis=1))[..., None]


INTERPOLATIONS = {"displacement": displace, "value": mix}


def open_span(shutters: ArrayLike) -> tuple[int, int]:
    """Return the index of the first frame, and one past the last, that any of N shutters (N, L) exposes."""
    used = np.flatnonzero(np.any(np.atleast_2d(shutters) > 0, axis=0))
    return int(used[0]), int(used[-1]) + 1


def are_open(bars: np.ndarray) -> np.ndarray:
    """Return which bars (L,) are open: bool (L,). Bars that are only rounding errors count as closed."""
    return bars > _CLOSED * bars.sum()


def resample(bars: ArrayLike, window: int) -> np.ndarray:
    """Return bars of the same shape for a window of another length: stretched, or averaged where it is shorter.

    The mean of the bars stays. So does the angle of a rotary shutter (`open_angle`), if the highest bar does.

    Args:
        bars: (L,).
        window: The new number of bars.
    """
    bars = np.asarray(bars, dtype=np.float64)
    total = np.concatenate([[0.0], np.cumsum(bars)])
    at = np.linspace(0, len(bars), window + 1)
    return np.diff(np.interp(at, np.arange(len(bars) + 1), total)) * window / len(bars)


def spanning(bars: ArrayLike, start: float, end: float) -> np.ndarray:
    """Stretch or shrink bars (L,) in time so that the shutter opens and closes at given times. Shape and sum stay.

    What is stretched is the span from the first open bar to the last, with closed ones in between.

    Args:
        bars: (L,).
        start, end: When the new bars open and close, in frames of the window: 0 ≤ start < end ≤ L.
    """
    bars = np.asarray(bars, dtype=np.float64)
    first, last = open_span(bars)
    boundaries = np.arange(len(bars) + 1, dtype=np.float64)
    times = first + (boundaries - start) * ((last - first) / (end - start))
    total = np.interp(times, boundaries, np.concatenate([[0.0], np.cumsum(bars)]))
    return np.diff(np.maximum.accumulate(total))  # avoids negative bars from rounding


def smoothed(bars: ArrayLike, steps: int, *, backward: bool = False, level: bool = False) -> np.ndarray:
    """Spread the bars (L,) of filmed frames over moments, which are filmed frames and those made between them.

    The time between two filmed frames is exposed only if both bars are open. Then each bar spreads its weight evenly
    over its half of the interval towards each open neighbor. A bar without open neighbors exposes its filmed frame
    only.

    Args:
        bars: (L,).
        steps: Moments per filmed frame, 1 or an even number.
        backward: Whether the footage plays backward. A filmed frame then is the last of its moments, not the first.
        level: Whether bars are heights instead of amounts of light: up to a common factor, moments next to a filmed
            frame are as high as its bar, and one in the middle of two frames as the mean of both. This is for the
            lightest or darkest of all moments. Otherwise, each bar's moments add up to the bar.

    Returns:
        The moments' bars (L · steps,), with the sum of `bars` in either case. Filmed frame k is moment k · steps;
        backward, it is moment k · steps + steps − 1.
    """
    bars = np.asarray(bars, dtype=np.float64)
    if steps == 1:
        return bars
    if backward:
        return smoothed(bars[::-1], steps, level=level)[::-1]
    before, after = _open_beside(bars)
    sides = before.astype(int) + after
    share = bars if level else bars / np.maximum(sides, 1)
    half = np.ones(steps // 2 + 1)
    half[[0, -1]] = 0.5  # the frame and the middle of the interval belong half to this half interval
    half /= 1 if level else half.sum()
    frames = np.arange(len(bars)) * steps
    moments = np.zeros(len(bars) * steps)
    moments[frames] = bars if level else np.where(sides == 0, bars, share * sides * half[0])
    for step, part in enumerate(half[1:], 1):
        moments[frames[after] + step] += share[after] * part
        moments[frames[before] - step] += share[before] * part
    return moments * (bars.sum() / moments.sum()) if level else moments


def _open_beside(bars: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return which bars (L,) are open with an open bar before them, and which with one after them: bool (L,) each."""
    open_ones = are_open(bars)
    after = open_ones & np.append(open_ones[1:], False)
    return np.append(False, after[:-1]), after


def held(bars: ArrayLike, steps: int) -> np.ndarray:
    """Spread the bar of each filmed frame evenly over its `steps` moments: the frame itself, and those made after it.

    Args:
        bars: (L,).
        steps: Moments per filmed frame.

    Returns:
        The moments' bars (L · steps,), with the same sum.
    """
    return np.repeat(np.asarray(bars, dtype=np.float64) / steps, steps)


class Filmed(NamedTuple):
    """The result of `filmed`: bars of filmed frames that replace the bars of moments in an older recipe.

    Attributes:
        bars: The new bars, (L,).
        lost: None: the new bars expose the same moments as the old ones, except for an invisible difference. Otherwise,
            the numbers, from 1, of the first and last old bar of the filmed frame at which they differ most, for a
            warning.
    """

    bars: np.ndarray
    lost: tuple[int, int] | None = None


def filmed(moments: ArrayLike, steps: int, position: str, spread: Callable[[np.ndarray], np.ndarray]) -> Filmed:
    """Convert bars of moments, which recipes of version 1 have, into bars of filmed frames.

    Moments are filmed frames, and those made between them. If the old window does not end at a whole filmed frame, it
    is padded with zeros: after its last moment, or before its first one if `position` is "end".

    Args:
        moments: (n,), the old bars.
        steps: Moments per filmed frame.
        position: Options.position.
        spread: Turns bars of filmed frames (L,) into the bars of moments (L · steps,) that they now expose.

    Returns:
        New bars that `spread` turns into the old moments / `steps`, if any are found. Otherwise each new bar is the
        mean of its frame's moments, and `lost` says where that differs.
    """
    moments = np.asarray(moments, dtype=np.float64)
    lacking = -len(moments) % steps
    before = lacking if position == "end" else 0
    rows = np.pad(moments, (before, lacking - before)).reshape(-1, steps)
    means, first = rows.mean(axis=1), rows[:, 0]
    if not moments.any():
        return Filmed(means)
    alone = ~np.logical_or(*_open_beside(first))
    apart = []
    for bars in (means, first, np.where(alone, first / steps, first)):
        bars = bars * (means.sum() / bars.sum()) if bars.any() else means
        apart.append(np.abs(spread(bars).reshape(rows.shape) * steps - rows).sum(axis=1))
        if apart[-1].sum() <= _SEEN * moments.max():
            return Filmed(bars)
    start = int(apart[0].argmax()) * steps - before
    return Filmed(means, (max(start, 0) + 1, min(start + steps, len(moments))))


def open_angle(bars: ArrayLike) -> float:
    """Return the angle of a rotary shutter with the light of these bars, in degrees: 360 for a window of equal bars."""
    bars = np.asarray(bars, dtype=np.float64)
    return 360.0 * float(bars.sum()) / (len(bars) * max(bars.max(), 1e-30))


# Presets


def still(window: int, frame: int = 0) -> np.ndarray:
    """Return bars (window,) of one sharp frame, `frame`, clamped to the window."""
    bars = np.zeros(window)
    bars[min(max(frame, 0), window - 1)] = 1
    return bars


def angle(window: int, degrees: float = 180.0) -> np.ndarray:
    """Return bars (window,) of a rotary shutter that is open for `degrees` of 360. The last open bar may be below 1."""
    return np.clip(window * degrees / 360.0 - np.arange(window), 0, 1)


def cuts(window: int, count: int = 2, width: int = 1) -> np.ndarray:
    """Return bars (window,) of `count` exposures at even distances, each `width` frames long: a multiple exposure."""
    bars = np.zeros(window)
    for start in np.floor(np.arange(count) * window / count).astype(int):
        bars[start : start + width] = 1
    return bars


def ramp_up(window: int) -> np.ndarray:
    """Return bars (window,) that rise from almost closed to open: a trail that ends sharp."""
    return np.arange(1, window + 1) / window


def ramp_down(window: int) -> np.ndarray:
    """Return bars (window,) that fall from open to almost closed: a trail that starts sharp."""
    return ramp_up(window)[::-1].copy()


def triangle(window: int) -> np.ndarray:
    """Return bars (window,) that rise to the middle of the window and fall again."""
    bars = 1 - np.abs(2 * (np.arange(window) + 0.5) / window - 1)
    return bars / bars.max()


def gaussian(window: int, sigma: float = 0.2) -> np.ndarray:
    """Return bars (window,) of a bell curve around the middle. `sigma` is its standard deviation in windows."""
    return np.exp(-0.5 * (((np.arange(window) + 0.5) / window - 0.5) / sigma) ** 2)


def trail(window: int, decay: float = 0.25) -> np.ndarray:
    """Return bars (window,) that fall exponentially, to 1/e of the first after the share `decay` of the window."""
    return np.exp(-np.arange(window) / (decay * window))


def stutter(window: int, every: int = 4) -> np.ndarray:
    """Return bars (window,) that are open at every n-th frame (`every`), as if a strobe lit them."""
    return (np.arange(window) % every == 0).astype(float)


# name: (label, description, bars of a window). "Custom" is not a preset: it stands for any other bars.
PRESETS: dict[str, tuple[str, str, Callable[[int], np.ndarray]]] = {
    "STILL": ("Still Frame", "Only the shown frame", still),
    "ANGLE_45": ("45°", "Open for an eighth of the frames", partial(angle, degrees=45.0)),
    "ANGLE_90": ("90°", "Open for a quarter of the frames", partial(angle, degrees=90.0)),
    "ANGLE_180": ("180°", "Open for half of the frames, as film cameras are", angle),
    "ANGLE_270": ("270°", "Open for three quarters of the frames", partial(angle, degrees=270.0)),
    "ANGLE_360": ("360°", "Open for all frames", partial(angle, degrees=360.0)),
    "TWO_CUTS": ("Two Cuts", "Two frames on top of each other", cuts),
    "CUTS": ("Four Cuts", "Four frames on top of each other", partial(cuts, count=4)),
    "RAMP_UP": ("Ramp Up", "Opens from frame to frame: a trail with a sharp end", ramp_up),
    "RAMP_DOWN": ("Ramp Down", "Closes from frame to frame: a trail with a sharp start", ramp_down),
    "TRIANGLE": ("Triangle", "Opens to the middle frame and closes again", triangle),
    "GAUSSIAN": ("Gaussian", "A bell curve around the middle frame", gaussian),
    "TRAIL": ("Exponential Trail", "Fades quickly at first and slowly later on", trail),
    "STUTTER": ("Stutter", "Every fourth frame, as a strobe lights them", stutter),
    # Along two edges, these two make a rolling shutter (paper Figure 11).
    "FIRST": ("First Frame", "Only the first of the frames", still),
    "LAST": ("Last Frame", "Only the last of the frames", lambda window: still(window, window - 1)),
}


def preset_bars(name: str, window: int, position: str = "start") -> np.ndarray:
    """Return the bars (window,) of a preset.

    Args:
        name: A key of PRESETS.
        window: The number of bars L.
        position: Options.position. It matters only for "STILL": bar 0 is open for "start", a middle one for "center",
            the last one for "end".

    Raises:
        KeyError: There is no such preset.
    """
    if name == "STILL":
        return still(window, {"center": (window - 1) // 2, "end": window - 1}.get(position, 0))
    return PRESETS[name][2](window)
