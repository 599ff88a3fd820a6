"""The reference compositor: every pixel's own shutter, exact, in float64, one frame after the other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from ..frames import light
from ..model import shutters
from ..model.frame_state import FrameState, Options

# By how much of a frame the window's earlier ones are preferred, where the nearest frame is shown: of two that are as
# near, rounding must not choose, for devices round differently.
CLOSE = 1e-3


def window_positions(options: Options, index: int, direction: int = 1) -> np.ndarray:
    """Where the window's frames (L,) lie around source frame `index`, beyond the clip's ends as well.

    direction: 1, or −1 where the source plays in reverse, and the window's next frames are those before `index`. A
    filmed frame lasts until the next one, so that in reverse its in-between frames come first, from the last one on.
    """
    return origin(options, index, direction) + direction * np.arange(options.window)


def reach(state: FrameState, index: int, direction: int = 1) -> tuple[int, int]:
    """The first and the last of the positions that any shutter exposes."""
    first = origin(state.options, index, direction)
    ends = [first + direction * place for place in (state.open_span[0], state.open_span[1] - 1)]
    return min(ends), max(ends)


def origin(options: Options, index: int, direction: int = 1) -> int:
    """The position of the window's first frame; arguments like those of `window_positions`."""
    return (index if direction > 0 else index + options.step - 1) - direction * options.before


def source_frames(options: Options, positions: np.ndarray, shot: range) -> np.ndarray:
    """The frames that are seen at `positions` by a window that shows those of `shot` alone; −1: none.

    shot: range(count) for a whole clip, or the frames between two of its cuts.
    Past its ends "hold" repeats the last frame, "mirror" plays back from it without showing it twice.
    "shorten" leaves frames out, but keeps the nearest when all lie outside.
    """
    first, count = shot.start, len(shot)
    held = np.minimum(np.maximum(positions, first), shot.stop - 1)  # quicker than np.clip for so few
    if options.edges == "mirror" and count > 1:
        folded = np.mod(positions - first, 2 * (count - 1))
        return first + np.where(folded < count, folded, 2 * (count - 1) - folded)
    if options.edges == "shorten" and (positions == held).any():
        return np.where(positions == held, held, -1)
    return held


def window_indices(options: Options, index: int, shot: range, direction: int = 1) -> np.ndarray:
    """Source frames (L,) of the window around source frame `index`; −1: left out. Arguments as above."""
    return source_frames(options, window_positions(options, index, direction), shot)


def mixed_shutter(state: FrameState, coefficients: ArrayLike) -> np.ndarray:
    """The bars (…, L) of the shutter that pixels with coefficients (…, N) are exposed with, Σ coefficients = 1."""
    return shutters.INTERPOLATIONS[state.options.interpolation](state.bars, coefficients)


def compose(
    state: FrameState,
    frames: Sequence[np.ndarray],
    present: ArrayLike,
    coefficients: ArrayLike,
    moves: tuple[np.ndarray, np.ndarray] | None = None,
) -> np.ndarray:
    """The picture (H, W, 4) float64, scene-linear and premultiplied: F = e(q) · ∫ V(t + ⌊Q⁻¹(z)⌋) dz (§3.1, §3.4.1).

    frames: L pictures (H, W, 4), scene-linear, premultiplied; present: (L,) bool, False for frames left out, whose
    share goes to the others (if none has a share: to the nearest present frame, of two the window's earlier one).
    coefficients: (N, H, W), Σ = 1.
    moves: turns and shifts (L, N) of each frame for each shutter (FrameState.following): a frame is not taken at x, but
    at Σ cᵢ Wᵢ(x), or by value interpolation mixed of those at each Wᵢ(x). None: nothing is followed.
    """
    coefficients = np.asarray(coefficients, dtype=np.float64)
    encoded = state.options.light == "encoded"
    frames = [_encode(frame) if encoded else frame for frame in frames]
    opaque = all((frame[..., 3] == 1).all() for frame in frames)
    y, x = np.indices(coefficients.shape[1:])
    total, own = np.zeros((*x.shape, 4)), x + 1j * y
    for weights, turns, shifts in _exposed(state, coefficients, np.asarray(present), moves):
        for k, frame in enumerate(frames):
            shown = frame if moves is None else seen(frame, turns[k] * own + shifts[k], sharp=opaque)
            total = total + weights[..., k, None] * shown
    gain = np.einsum("n,nhw->hw", state.gains, coefficients)
    return (_decode(total) if encoded else total) * np.concatenate(
        [np.repeat(gain[..., None], 3, axis=-1), np.ones_like(gain)[..., None]], axis=-1
    )


def _exposed(
    state: FrameState, coefficients: np.ndarray, present: np.ndarray, moves: tuple[np.ndarray, np.ndarray] | None
) -> list[tuple]:
    """What is summed: weights (H, W, L) of the frames, and the turns and shifts (L, H, W), or None, by which each is
    seen there."""
    normalised = state.bars / state.bars.sum(axis=1, keepdims=True)
    if moves is not None and state.options.interpolation == "value":
        q = coefficients[..., None] * normalised[:, None, None]
        apart = (part.T[:, :, None, None] for part in moves)
        return list(zip(_without_absent(q, coefficients, present), *apart, strict=True))
    between = shutters.INTERPOLATIONS[state.options.interpolation]
    q = between(normalised, np.moveaxis(coefficients, 0, -1))
    (weights,) = _without_absent(q[None], np.ones(coefficients[:1].shape), present)
    mixed = [None, None] if moves is None else [np.einsum("ln,nhw->lhw", part, coefficients) for part in moves]
    return [(weights, *mixed)]


def seen(frame: np.ndarray, places: np.ndarray, *, sharp: bool) -> np.ndarray:
    """What a frame (H, W, C) shows at places (…), x + iy as motions.Similarity counts: (…, C).

    sharp: by Catmull and Rom's cubic, kept between the four pixels around, for it would ring about highlights; else
    linearly, as colours with an alpha have to be. Beyond its edges the frame goes on as its last pixels."""
    height, width = frame.shape[:2]
    # Far outside all is the same, and large numbers have no fractions.
    x, y = np.clip(places.real, -2, width + 1), np.clip(places.imag, -2, height + 1)
    column, row = np.floor(x).astype(int), np.floor(y).astype(int)

    def pixel(i: int, j: int) -> np.ndarray:
        return frame[np.clip(row + j, 0, height - 1), np.clip(column + i, 0, width - 1)]

    across, down = _weights(x - column, sharp), _weights(y - row, sharp)
    taps = range(-1, 3)
    total = sum((across[i] * down[j])[..., None] * pixel(i, j) for i in taps for j in taps if sharp or {i, j} <= {0, 1})
    around = [pixel(i, j) for i in (0, 1) for j in (0, 1)]
    return np.clip(total, np.minimum.reduce(around), np.maximum.reduce(around))


def _weights(t: np.ndarray, sharp: bool) -> dict[int, np.ndarray]:
    """The weights of the pixels at −1, 0, 1 and 2 for a place between 0 and 1."""
    if not sharp:
        return {-1: 0 * t, 0: 1 - t, 1: t, 2: 0 * t}
    return {
        -1: -0.5 * t + t**2 - 0.5 * t**3,
        0: 1 - 2.5 * t**2 + 1.5 * t**3,
        1: 0.5 * t + 2 * t**2 - 1.5 * t**3,
        2: -0.5 * t**2 + 0.5 * t**3,
    }


def _without_absent(q: np.ndarray, parts: np.ndarray, present: np.ndarray) -> np.ndarray:
    """The weights q (M, H, W, L), those of frames that are not present given to the others; where these have none, the
    nearest frame's are the parts (M, H, W)."""
    if present.all():
        return q
    kept = q * present
    share = kept.sum(axis=(0, -1))[..., None]
    centre = (q * (np.arange(len(present)) + 0.5)).sum(axis=(0, -1))
    places = np.flatnonzero(present)
    nearest = places[np.abs(centre[..., None] - CLOSE - (places + 0.5)).argmin(axis=-1)]
    alone = np.arange(len(present)) == nearest[..., None]
    return np.where(share > 1e-6, kept / np.maximum(share, 1e-6), parts[..., None] * alone)


def _encode(frame: np.ndarray) -> np.ndarray:
    return light.premultiplied(light.straight(frame), light.to_encoded)


def _decode(total: np.ndarray) -> np.ndarray:
    return light.premultiplied(light.straight(total), light.to_linear)
