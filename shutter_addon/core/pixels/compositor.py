"""The reference compositor: every pixel's own shutter, exact, in float64, frame by frame."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike

from ..frames import light
from ..model import shutters
from ..model.frame_state import Combine, FrameState
from . import combined

# In frames: where the nearest frame is shown, the window's earlier one is preferred by this much. Of two equally near
# frames, rounding must not choose, since devices round differently.
CLOSE = 1e-3
# Light up to this stays finite when it is encoded in float32.
_MOST = 1e37

# Turns and shifts per frame (motions.Similarity).
Moves = tuple[np.ndarray, np.ndarray]


def mixed_shutter(state: FrameState, coefficients: ArrayLike) -> np.ndarray:
    """Return the bars (…, L) of the shutter that exposes pixels with coefficients (…, N), Σ = 1."""
    mixed, c = shutters.INTERPOLATIONS[state.options.interpolation], np.asarray(coefficients, dtype=np.float64)
    total = np.zeros((*c.shape[:-1], state.bars.shape[1]))
    for chosen, share, own in ways(state, np.moveaxis(c, -1, 0)):
        total = total + share[..., None] * mixed(state.bars[chosen], np.moveaxis(own, 0, -1))
    return total


def ways(state: FrameState, coefficients: np.ndarray) -> Iterator[tuple[list[int], np.ndarray, np.ndarray]]:
    """Yield the shutters of each way to combine frames (*Combine*).

    Args:
        state: The effect at a frame.
        coefficients: Of all shutters, (N, …) ≥ 0.

    Yields:
        The indices of n shutters, the sum of their coefficients, and these scaled to a sum of 1, (n, …).
    """
    for chosen in map(list, state.groups.values()):
        share = coefficients[chosen].sum(axis=0)
        equal = coefficients.dtype.type(1 / len(chosen))
        yield chosen, share, np.where(share > 0, coefficients[chosen] / np.where(share > 0, share, 1), equal)


def compose(
    state: FrameState,
    frames: Sequence[np.ndarray],
    present: ArrayLike,
    coefficients: ArrayLike,
    moves: Moves | None = None,
    sharp: bool | None = None,
) -> np.ndarray:
    """Return the picture (H, W, 4) float64, scene-linear and premultiplied.

    F = e(q) · ∫ V(t + ⌊Q⁻¹(z)⌋) dz (§3.1, §3.4.1), or the combination of core/pixels/combined.py. Shutters that combine
    frames in different ways make a picture for each way, mixed by the coefficients.

    Args:
        frames: L pictures (H, W, 4), scene-linear, premultiplied.
        present: (L,) bool, False for left out frames, whose share goes to the others. If none has a share, it goes to
            the nearest present frame, preferring the earlier one.
        coefficients: (N, H, W), Σ = 1.
        moves: Turns and shifts (L, N) of frames for shutters (FrameState.following). A frame is sampled at Σ cᵢ Wᵢ(x)
            instead of x, or by value interpolation at each Wᵢ(x) and mixed. None: nothing is followed.
        sharp: How `seen` samples frames; None: sharp if all of them are opaque.
    """
    if sharp is None:
        sharp = all((frame[..., 3] == 1).all() for frame in frames)
    coefficients, present = np.asarray(coefficients, dtype=np.float64), np.asarray(present)
    if len(state.groups) > 1:
        mixed = np.zeros((*coefficients.shape[1:], 4))
        for chosen, share, own in ways(state, coefficients):
            moved = None if moves is None else (moves[0][:, chosen], moves[1][:, chosen])
            mixed += share[..., None] * compose(state.of(chosen), frames, present, own, moved, sharp)
        return mixed
    (combine,) = state.groups
    encoded = state.options.light == "encoded"
    if encoded:
        frames = [light.premultiplied(light.straight(each).clip(-_MOST, _MOST), light.to_encoded) for each in frames]
    y, x = np.indices(coefficients.shape[1:])
    pixels = x + 1j * y

    def look(k: int, motion: Moves | None) -> np.ndarray:
        return frames[k] if motion is None else seen(frames[k], motion[0][k] * pixels + motion[1][k], sharp=sharp)

    motions = _motions(state, coefficients, moves)
    total = np.zeros((*x.shape, 4))
    for weights, motion in zip(_exposed(state, coefficients, present, moves), motions, strict=True):
        for k in np.flatnonzero(weights.any(axis=(0, 1))).tolist():
            total = total + weights[..., k, None] * look(k, motion)
    if combine.mode == "average":
        gain = np.einsum("n,nhw->hw", state.gains, coefficients)[..., None]
        return (_decode(total) if encoded else total) * np.concatenate([gain, gain, gain, np.ones_like(gain)], axis=-1)
    samples = _samples(combine, state, coefficients, present, moves, lambda k: [look(k, each) for each in motions])
    if not samples:
        return _decode(total) if encoded else total
    found = combined.of_samples(combine, samples, encoded=encoded)
    # Where all weights are 0, show the nearest frame, as an average does.
    found = np.where((_counted(combine, samples) > 1e-6)[..., None], found, total)
    return _decode(found) if encoded else found


def _counted(combine: Combine, samples: list[combined.Sample]) -> np.ndarray:
    """Return the sum of all frames' weights (H, W)."""
    if combine.threshold is not None and any(sample.shown is not None for sample in samples):
        return np.ones(samples[0].weight.shape)
    return sum((sample.weight for sample in samples), np.zeros(samples[0].weight.shape))


def _samples(
    combine: Combine,
    state: FrameState,
    coefficients: np.ndarray,
    present: np.ndarray,
    moves: Moves | None,
    looks_at: Callable[[int], list[np.ndarray]],
) -> list[combined.Sample]:
    """Return the present frames. A frame seen by several motions is mixed by its weight for each."""
    options, bars = state.options, state.bars
    if moves is not None and options.interpolation == "value":
        alone = np.stack([combined.counts(combine, row, np.ones(1), options.interpolation) for row in bars])
        weights, shares = coefficients[..., None] * alone[:, None, None], coefficients
    else:
        weights = combined.counts(combine, bars, np.moveaxis(coefficients, 0, -1), options.interpolation)[None]
        shares = np.ones(weights.shape[:-1])
    samples = []
    counted = weights.any(axis=(0, 1, 2))
    if combine.threshold is not None:
        counted[options.shown] = True
    for k in np.flatnonzero(counted & present).tolist():
        looks = looks_at(k)
        weight = weights[..., k].sum(axis=0)
        light_ = sum(own[..., k, None] * sight for own, sight in zip(weights, looks, strict=True))
        shown = sum(share[..., None] * sight for share, sight in zip(shares, looks, strict=True))
        there = np.where(weight[..., None] > 0, light_ / np.where(weight > 0, weight, 1)[..., None], shown)
        samples.append(combined.Sample(there, weight, shown if k == options.shown else None))
    return samples


def _motions(state: FrameState, coefficients: np.ndarray, moves: Moves | None) -> list[Moves | None]:
    """Return the motions by which frames are seen: each shutter's for value interpolation, else the pixels' mix."""
    if moves is None:
        return [None]
    turns, shifts = moves
    if state.options.interpolation == "value":
        return list(zip(turns.T[:, :, None, None], shifts.T[:, :, None, None], strict=True))
    return [(np.einsum("ln,nhw->lhw", turns, coefficients), np.einsum("ln,nhw->lhw", shifts, coefficients))]


def _exposed(state: FrameState, coefficients: np.ndarray, present: np.ndarray, moves: Moves | None) -> np.ndarray:
    """Return the weights (M, H, W, L) of frames in the sum, as seen by each of `_motions`."""
    normalised = state.bars / state.bars.sum(axis=1, keepdims=True)
    if moves is not None and state.options.interpolation == "value":
        return _without_absent(coefficients[..., None] * normalised[:, None, None], coefficients, present)
    between = shutters.INTERPOLATIONS[state.options.interpolation]
    q = between(normalised, np.moveaxis(coefficients, 0, -1))[None]
    return _without_absent(q, np.ones(coefficients[:1].shape), present)


def seen(frame: np.ndarray, places: np.ndarray, *, sharp: bool) -> np.ndarray:
    """Sample a frame (H, W, C) at places (…), x + iy as in motions.Similarity; return (…, C).

    Beyond its edges the frame repeats its last pixels.

    Args:
        sharp: By Catmull-Rom's cubic, clamped to the four pixels around to avoid ringing. Otherwise linearly, as
            colours with alpha need.
    """
    height, width = frame.shape[:2]
    # Far outside everything is the same, and large numbers have no fractions.
    x, y = np.clip(places.real, -2, width + 1), np.clip(places.imag, -2, height + 1)
    column, row = np.floor(x).astype(int), np.floor(y).astype(int)

    def pixel(i: int, j: int) -> np.ndarray:
        return frame[np.clip(row + j, 0, height - 1), np.clip(column + i, 0, width - 1)]

    across, down = _weights(x - column, sharp), _weights(y - row, sharp)
    total = sum((across[i] * down[j])[..., None] * pixel(i, j) for i in across for j in down)
    around = [pixel(i, j) for i in (0, 1) for j in (0, 1)]
    return np.clip(total, np.minimum.reduce(around), np.maximum.reduce(around))


def _weights(t: np.ndarray, sharp: bool) -> dict[int, np.ndarray]:
    """Return the weights of the pixels at −1, 0, 1 and 2, or of those at 0 and 1, for a place between 0 and 1."""
    if not sharp:
        return {0: 1 - t, 1: t}
    return {
        -1: -0.5 * t + t**2 - 0.5 * t**3,
        0: 1 - 2.5 * t**2 + 1.5 * t**3,
        1: 0.5 * t + 2 * t**2 - 1.5 * t**3,
        2: -0.5 * t**2 + 0.5 * t**3,
    }


def _without_absent(q: np.ndarray, parts: np.ndarray, present: np.ndarray) -> np.ndarray:
    """Return weights q (M, H, W, L) with the share of absent frames given to the others.

    If the others have no share, the nearest frame gets the parts (M, H, W).
    """
    if present.all():
        return q
    kept = q * present
    share = kept.sum(axis=(0, -1))[..., None]
    centre = (q * (np.arange(len(present)) + 0.5)).sum(axis=(0, -1))
    places = np.flatnonzero(present)
    nearest = places[np.abs(centre[..., None] - CLOSE - (places + 0.5)).argmin(axis=-1)]
    alone = np.arange(len(present)) == nearest[..., None]
    return np.where(share > 1e-6, kept / np.maximum(share, 1e-6), parts[..., None] * alone)


def _decode(total: np.ndarray) -> np.ndarray:
    return light.premultiplied(light.straight(total), light.to_linear)
