"""What a composition needs to know of its shutters, once per frame: gains, knots or bars, as float32 tables."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..core.model import shutters
from ..core.model.frame_state import FrameState


def padded(values: np.ndarray) -> np.ndarray:
    """(…, N) as (…, G, 4): four shutters to a texel, zeros behind the last."""
    groups = -(-values.shape[-1] // 4)
    result = np.zeros((*values.shape[:-1], groups * 4))
    result[..., : values.shape[-1]] = values
    return result.reshape(*values.shape[:-1], groups, 4)


def table(state: FrameState) -> np.ndarray:
    """The table (1 + rows, columns, 4) float32 that shaders/include/compose.glsl describes.

    Row 0: the gains; of the lightest and the darkest what makes the highest weight 1 (core.pixels.combined), by value
    the middle of the shutters' times.
    Displacement: a row per piece of the quantiles: starts, ends, then dz, the time by which the shutters differ at most
    at either, and z at its start. Value: a row per frame of the shutters' open span, how much it counts.
    """
    rows = _pieces(state.bars) if state.options.interpolation == "displacement" else _bars(state)
    result = np.zeros((1 + len(rows), rows.shape[1], 4), dtype=np.float32)
    gains = padded(_gains(state))
    result[0, : len(gains)] = gains
    result[1:] = rows
    return result


def _pieces(bars: np.ndarray) -> np.ndarray:
    return _pieces_of(bars.tobytes(), bars.dtype, bars.shape)


@lru_cache(16)
def _pieces_of(content: bytes, dtype: np.dtype, shape: tuple[int, ...]) -> np.ndarray:
    """Bars seldom change from frame to frame."""
    knots = shutters.knots(np.frombuffer(content, dtype).reshape(shape))
    start, end = padded(knots.start), padded(knots.end)
    last = np.zeros((len(start), 1, 4))
    last[:, 0, 0] = np.diff(knots.z)
    last[:, 0, 1] = np.maximum(np.ptp(knots.start, axis=1), np.ptp(knots.end, axis=1))
    last[:, 0, 2] = knots.z[:-1]
    return np.concatenate([start, end, last], axis=1)


def _gains(state: FrameState) -> np.ndarray:
    (combine,) = state.groups
    if combine.mode not in ("lightest", "darkest"):
        return state.gains
    exposures = state.bars.sum(axis=1)
    if state.options.interpolation == "value":
        return state.bars @ (np.arange(state.bars.shape[1]) + 0.5) / exposures
    return exposures / state.bars.max(axis=1)


def _bars(state: FrameState) -> np.ndarray:
    """How much each frame of the open span counts."""
    (combine,) = state.groups
    whole = state.bars.max(axis=1) if combine.mode in ("lightest", "darkest") else state.bars.sum(axis=1)
    return padded((state.bars / whole[:, None]).T[slice(*state.open_span)])


def moved_tables(state: FrameState, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The table of `table` and that of the moves (L · motions, 1 + N, 4) float32, by value (L · motions, 2, 4), which
    shaders/include/moved.glsl describes, its first number of each row 0.

    By displacement there is one motion, in which the shutters' own are mixed; by value one for all shutters that move
    alike: the table has a row for each frame and motion. Behind these it has one for each motion, 1 for its shutters.
    frames: the source frames (L,) of the window; −1: none. ValueError: nothing is followed"""
    if state.following is None:
        raise ValueError("nothing is followed")
    turns, shifts = state.following.at(frames)
    numbers = np.stack([turns.real - 1, turns.imag, shifts.real, shifts.imag], axis=1)  # (L, 4, N)
    values = table(state)
    own = np.ones((1, len(state.bars)))
    if state.options.interpolation == "value":
        kinds, kind = np.unique(numbers.reshape(-1, len(state.bars)), axis=1, return_inverse=True)
        own = np.eye(kinds.shape[1])[:, kind]
        numbers = kinds.reshape(*numbers.shape[:2], -1).swapaxes(1, 2).reshape(-1, 4, 1)
        bars = _bars(state)
        values = np.concatenate([values[:1], (bars[:, None] * padded(own)).reshape(-1, *bars.shape[1:])])
    parts = np.zeros((len(own), *values.shape[1:]), np.float32)
    grouped = padded(own)
    parts[:, : grouped.shape[1]] = grouped
    moves = np.zeros((len(numbers), 1 + numbers.shape[2], 4), np.float32)
    moves[:, 1:] = numbers.swapaxes(1, 2)
    moves[:, 0, 1] = (frames >= 0).repeat(len(own))
    return np.concatenate([values, parts]).astype(np.float32), moves
