"""The reference compositor: every pixel's own shutter, exact, in float64, one frame after the other."""

from __future__ import annotations

import numpy as np

from . import light, shutters
from .frame_state import FrameState, Options

# By how much of a frame the window's earlier ones are preferred, where the nearest frame is shown: of two that are as
# near, rounding must not choose, for devices round differently.
CLOSE = 1e-3


def window_positions(options: Options, index: int, direction: int = 1) -> np.ndarray:
    """Where the window's frames (L,) lie around source frame `index`, beyond the clip's ends as well.

    direction: 1, or −1 where the source plays in reverse, and the window's next frames are those before `index`. A
    filmed frame lasts until the next one, so that in reverse its in-between frames come first, from the last one on.
    """
    first = index if direction > 0 else index + options.step - 1
    return first + direction * (np.arange(options.window) - options.before)


def source_frames(options: Options, positions: np.ndarray, shot: range) -> np.ndarray:
    """The frames that are seen at `positions` by a window that shows those of `shot` alone; −1: none.

    shot: range(count) for a whole clip, or the frames between two of its cuts.
    Past its ends "hold" repeats the last frame, "mirror" plays back from it without showing it twice.
    "shorten" leaves frames out, but keeps the nearest when all lie outside.
    """
    first, count = shot.start, len(shot)
    held = np.clip(positions, first, shot.stop - 1)
    if options.edges == "mirror" and count > 1:
        folded = np.mod(positions - first, 2 * (count - 1))
        return first + np.where(folded < count, folded, 2 * (count - 1) - folded)
    if options.edges == "shorten" and (positions == held).any():
        return np.where(positions == held, held, -1)
    return held


def window_indices(options: Options, index: int, shot: range, direction: int = 1) -> np.ndarray:
    """Source frames (L,) of the window around source frame `index`; −1: left out. Arguments as above."""
    return source_frames(options, window_positions(options, index, direction), shot)


def mixed_shutter(state: FrameState, coefficients) -> np.ndarray:
    """The bars (…, L) of the shutter that pixels with coefficients (…, N) are exposed with, Σ coefficients = 1."""
    return shutters.INTERPOLATIONS[state.options.interpolation](state.bars, coefficients)


def compose(state: FrameState, frames, present, coefficients) -> np.ndarray:
    """The picture (H, W, 4) float64, scene-linear and premultiplied: F = e(q) · ∫ V(t + ⌊Q⁻¹(z)⌋) dz (§3.1, §3.4.1).

    frames: L pictures (H, W, 4), scene-linear, premultiplied; present: (L,) bool, False for frames left out, whose
    share goes to the others (if none has a share: to the nearest present frame, of two the window's earlier one).
    coefficients: (N, H, W), Σ = 1.
    """
    between = shutters.INTERPOLATIONS[state.options.interpolation]
    normalised = state.bars / state.bars.sum(axis=1, keepdims=True)
    q = between(normalised, np.moveaxis(np.asarray(coefficients, dtype=np.float64), 0, -1))
    q = _without_absent(q, np.asarray(present))
    encoded = state.options.light == "encoded"
    total = sum(q[..., k, None] * (_encode(frame) if encoded else frame) for k, frame in enumerate(frames))
    gain = np.einsum("n,nhw->hw", state.gains, coefficients)
    return (_decode(total) if encoded else total) * np.concatenate(
        [np.repeat(gain[..., None], 3, axis=-1), np.ones_like(gain)[..., None]], axis=-1
    )


def _without_absent(q: np.ndarray, present: np.ndarray) -> np.ndarray:
    if present.all():
        return q
    kept = q * present
    share = kept.sum(axis=-1, keepdims=True)
    centre = (q * (np.arange(len(present)) + 0.5)).sum(axis=-1)
    places = np.flatnonzero(present)
    nearest = places[np.abs(centre[..., None] - CLOSE - (places + 0.5)).argmin(axis=-1)]
    alone = np.arange(len(present)) == nearest[..., None]
    return np.where(share > 1e-6, kept / np.maximum(share, 1e-6), alone)


def _encode(frame: np.ndarray) -> np.ndarray:
    return light.premultiplied(light.straight(frame), light.to_encoded)


def _decode(total: np.ndarray) -> np.ndarray:
    return light.premultiplied(light.straight(total), light.to_linear)
