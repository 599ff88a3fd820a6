"""The reference compositor: every pixel is exposed by its own shutter, exactly, in float64, frame by frame.

Frames are averaged, or combined otherwise (frame_state.Combine). With wₖ the weight of a frame, 0 to 1 (`counts`), and
Vₖ its light with alpha aₖ, both premultiplied:

    lightest    max wₖ Vₖ                   a frame fades into black
    darkest     A − max uₖ, where uₖ = wₖ (aₖ − Vₖ), or aₖ − Vₖ where that is below 0    a frame fades into white
    median      M · Σ qₖ aₖ / Σ qₖ, where M is the weighted median of Vₖ / aₖ, each counted qₖ aₖ times

and A = max wₖ aₖ / max wₖ, the alpha of the first two. Their brightness does not depend on the number of frames. A
threshold lowers wₖ, but not A's divisor: a pixel without light above it is transparent.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..frames import light
from ..model import shutters
from ..model.frame_state import Combine, FrameState

# If a median's weights are this close to the middle, both neighbors count, as with an even number of frames. Rounding
# must not choose between them, since devices round differently.
MIDDLE = 1 / 8192


class Sample(NamedTuple):
    """A frame of the window, from which a lightest, darkest or median picture is made.

    Attributes:
        light: The frame as each pixel sees it, (H, W, 4), premultiplied. It has moved if a shutter follows a motion.
        weight: (H, W), 0 to 1, how much the frame counts at each pixel.
        shown: The shown frame's light, (H, W, 4). If there is a threshold, it counts in full, whatever the weights are.
            None: this is not the shown frame.
    """

    light: np.ndarray
    weight: np.ndarray
    shown: np.ndarray | None = None


def counts(combine: Combine, bars: ArrayLike, coefficients: ArrayLike, interpolation: str) -> np.ndarray:
    """Return how much each frame of the window counts at each pixel for lightest, darkest or median: weights (…, L).

    For a median the weights are the interpolated bars, with the sum 1. For lightest and darkest they are 0 to 1; where
    a pixel gets one shutter alone, the frame at its highest bar has the weight 1. By value interpolation, each
    shutter's bars are divided by their maximum and averaged by the coefficients. By displacement, each shutter's bars
    are divided by their sum and interpolated, then multiplied by the mean of sum / maximum over the shutters, weighted
    by the coefficients.

    Args:
        combine: How frames are combined.
        bars: (N, L), of N shutters.
        coefficients: (…, N), how much of each shutter a pixel gets.
        interpolation: Options.interpolation.
    """
    bars, coefficients = np.atleast_2d(np.asarray(bars, dtype=np.float64)), np.asarray(coefficients, dtype=np.float64)
    normalised = bars / bars.sum(axis=1, keepdims=True)
    between = shutters.INTERPOLATIONS[interpolation]
    if combine.mode == "median":
        return between(normalised, coefficients)
    if interpolation == "value":
        return coefficients @ (bars / bars.max(axis=1, keepdims=True))
    highest = coefficients @ (1 / normalised.max(axis=1))
    return between(normalised, coefficients) * highest[..., None]


def of_samples(combine: Combine, samples: Sequence[Sample], *, encoded: bool = False) -> np.ndarray:
    """Return the lightest, darkest or median of frames: a premultiplied picture (H, W, 4).

    The picture is transparent (all zeros) where all weights are 0.

    Args:
        combine: How frames are combined.
        samples: The frames, at least one.
        encoded: Whether the samples' light is encoded like sRGB (Options.light "encoded"); otherwise it is linear.
    """
    if combine.mode == "median":
        return median(samples)
    best = np.full((*samples[0].weight.shape, 3), -np.inf)
    alpha, most = np.zeros(best.shape[:2]), np.zeros(best.shape[:2])
    for sample in samples:
        most = np.maximum(most, sample.weight)
        for light_, weight in _counted(combine, sample, encoded):
            value = light_[..., :3]
            if combine.mode == "darkest":
                value = light_[..., 3:] - value
            faded = np.where((value > 0) | (combine.mode == "lightest"), weight[..., None] * value, value)
            value = np.where(weight[..., None] > 0, faded, -np.inf)
            if combine.by_luminance:
                best = np.where((_luminance(value) > _luminance(best))[..., None], value, best)
            else:
                best = np.maximum(best, value)
            alpha = np.maximum(alpha, weight * light_[..., 3])
        if combine.threshold is not None and sample.shown is not None:
            most = np.maximum(most, 1.0)
    alpha = (alpha / np.maximum(most, 1e-30))[..., None]
    best = np.where(np.isinf(best), 0.0, best)
    return np.concatenate([alpha - best if combine.mode == "darkest" else best, alpha], axis=-1)


def _counted(combine: Combine, sample: Sample, encoded: bool) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return what counts of a frame as a list of pairs: light (H, W, 4) and weight (H, W).

    Without a threshold the only pair is the frame. With one, the frame's weight is lowered where its light does not
    leave a trail (see `passes`). The shown frame then has a second pair: its light with weight 1, which is not lowered.

    Args:
        combine: How frames are combined; it may have a threshold.
        sample: The frame.
        encoded: Whether its light is encoded, as for `of_samples`.
    """
    if combine.threshold is None:
        return [(sample.light, sample.weight)]
    color = light.straight(sample.light)[..., :3]
    luminance = (light.to_linear(color) if encoded else color) @ light.REC709.astype(np.float64)
    counted = [(sample.light, sample.weight * passes(combine, luminance))]
    if sample.shown is not None:
        counted.append((sample.shown, np.ones(sample.weight.shape)))
    return counted


def _luminance(value: np.ndarray) -> np.ndarray:
    """Return the luminance (H, W) of light (H, W, 3); −∞ where no frame has counted yet."""
    return np.where(np.isinf(value[..., 0]), -np.inf, np.nan_to_num(value, neginf=0.0) @ light.REC709)


def passes(combine: Combine, luminance: np.ndarray) -> np.ndarray:
    """Return how much light of a luminance (…) leaves a trail, 0 to 1: above the threshold, or below for darkest."""
    half = max(combine.softness, 1e-6) / 2
    t = np.clip((luminance - ((combine.threshold or 0.0) - half)) / (2 * half), 0, 1)
    t = t * t * (3 - 2 * t)
    return 1 - t if combine.mode == "darkest" else t


def median(samples: Sequence[Sample]) -> np.ndarray:
    """Return the weighted median of frames for each channel: a premultiplied picture (H, W, 4)."""
    straight, weights = light.straight(np.stack([s.light for s in samples])), np.stack([s.weight for s in samples])
    alphas = weights * straight[..., 3]
    cover = (alphas.sum(axis=0) / np.maximum(weights.sum(axis=0), 1e-30))[..., None]
    middle = np.stack([weighted_median(straight[..., k], alphas) for k in range(3)], axis=-1)
    return np.concatenate([middle * cover, cover], axis=-1)


def weighted_median(values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the weighted median (…) of values along the first axis.

    It is the lowest value at which the share of all values up to it in the total weight reaches 0.5 − MIDDLE. If this
    share is below 0.5 + MIDDLE, it is a mix of that value and the next higher one, in equal parts at exactly 0.5.

    Args:
        values: (L, …), in any order.
        weights: (L, …), at least 0. A value with weight 0 does not count.
    """
    order = np.argsort(np.where(weights > 0, values, np.inf), axis=0, kind="stable")
    values, weights = (np.take_along_axis(a, order, axis=0) for a in (values, weights))
    below = np.cumsum(weights, axis=0)
    below = below / np.maximum(below[-1:], 1e-30)
    # Equal values count as one.
    for k in range(len(values) - 2, -1, -1):
        below[k] = np.where((values[k] == values[k + 1]) & (weights[k + 1] > 0), below[k + 1], below[k])
    first = (below >= 0.5 - MIDDLE).argmax(axis=0)[None]
    lower, until = (np.take_along_axis(a, first, axis=0)[0] for a in (values, below))
    above = np.where((values > lower) & (weights > 0), values, np.inf).min(axis=0)
    share = np.clip((until - (0.5 - MIDDLE)) / (2 * MIDDLE), 0, 1)
    return np.where(np.isinf(above) | (share == 1), lower, share * lower + (1 - share) * np.nan_to_num(above, posinf=0))


# In frames: where the nearest frame is shown, the window's earlier one is preferred by this much. Of two equally near
# frames, rounding must not choose, since devices round differently.
CLOSE = 1e-3
# Light up to this stays finite when it is encoded in float32.
_MOST = 1e37

# Turns and shifts per frame (motions.Similarity).
Moves = tuple[np.ndarray, np.ndarray]


def mixed_shutter(state: FrameState, coefficients: ArrayLike) -> np.ndarray:
    """Return the bars (…, L) that a pixel's mix of shutters has, by Options.interpolation.

    Only shutters that combine frames in the same way (a group of FrameState.groups) are interpolated with each other.
    The groups' bars are averaged with the groups' shares of the coefficients.

    Args:
        state: The effect at a frame, with N shutters.
        coefficients: How much of each shutter pixels get, (…, N), with the sum 1.
    """
    mixed, c = shutters.INTERPOLATIONS[state.options.interpolation], np.asarray(coefficients, dtype=np.float64)
    total = np.zeros((*c.shape[:-1], state.bars.shape[1]))
    for chosen, share, own in ways(state, np.moveaxis(c, -1, 0)):
        total = total + share[..., None] * mixed(state.bars[chosen], np.moveaxis(own, 0, -1))
    return total


def ways(state: FrameState, coefficients: np.ndarray) -> Iterator[tuple[list[int], np.ndarray, np.ndarray]]:
    """Group shutters by how they combine frames (FrameState.groups). Yield one group after another.

    Args:
        state: The effect at a frame, with N shutters.
        coefficients: How much of each shutter pixels get, (N, …) ≥ 0.

    Yields:
        For each group of n shutters a tuple of three: their indices; the share (…) of the group, which is the sum of
        their coefficients; and their coefficients (n, …) divided by this sum (1/n each where it is 0).
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
    """Return the picture (H, W, 4) float64 that the effect makes of a window of frames, scene-linear and premultiplied.

    F = e(q) · ∫ V(t + ⌊Q⁻¹(z)⌋) dz (§3.1, §3.4.1): a mean of the frames V with the weights of a pixel's mixed shutter,
    times its gain; or the lightest, darkest or median of the frames (`of_samples`). If shutters combine frames in
    different ways, a picture is made for each way, and the pictures are mixed by the coefficients.

    Args:
        state: The effect at this frame, with N shutters of L bars.
        frames: The L pictures (H, W, 4) of the window, scene-linear, premultiplied.
        present: (L,) bool, False for frames that are left out. The others share their weight in proportion. If these
            have none at a pixel, the present frame nearest to the middle of the exposure gets all, the earlier one of
            two.
        coefficients: (N, H, W), how much of each shutter a pixel gets, with the sum 1.
        moves: The turns and the shifts of frames for shutters, (L, N) each (FrameState.following). With Wᵢ(x) the place
            in the frame that shutter i sees at pixel x, the frame is sampled at Σ cᵢ Wᵢ(x); by value interpolation at
            each Wᵢ(x), and the samples are mixed. None: nothing is followed.
        sharp: Whether `seen` samples frames sharply. None: if all frames are opaque.
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
    found = of_samples(combine, samples, encoded=encoded)
    # Where all weights are 0, show the nearest frame, as an average does.
    found = np.where((_counted_weight(combine, samples) > 1e-6)[..., None], found, total)
    return _decode(found) if encoded else found


def _counted_weight(combine: Combine, samples: list[Sample]) -> np.ndarray:
    """Return the sum (H, W) of the weights of all frames; 1 where a threshold lets the shown frame count in full."""
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
) -> list[Sample]:
    """Return a Sample for each frame that is present and has a weight at some pixel.

    The shown frame is included in any case if there is a threshold and it is present. With value interpolation, a pixel
    sees a frame at the place of each shutter's motion; what it sees is averaged with the shutters' weights.

    Args:
        combine: How frames are combined.
        state, coefficients, present, moves: As for `compose`.
        looks_at: Returns, for the index of a frame, the frame as seen with each of the motions of `_motions`.
    """
    options, bars = state.options, state.bars
    if moves is not None and options.interpolation == "value":
        alone = np.stack([counts(combine, row, np.ones(1), options.interpolation) for row in bars])
        weights, shares = coefficients[..., None] * alone[:, None, None], coefficients
    else:
        weights = counts(combine, bars, np.moveaxis(coefficients, 0, -1), options.interpolation)[None]
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
        samples.append(Sample(there, weight, shown if k == options.shown else None))
    return samples


def _motions(state: FrameState, coefficients: np.ndarray, moves: Moves | None) -> list[Moves | None]:
    """Return the motions with which pixels see the L frames: (turns, shifts) each, or [None] without motions.

    With value interpolation there is one motion for each shutter, the same for all pixels: both arrays (L, 1, 1).
    Otherwise there is a single motion, both arrays (L, H, W), which mixes the motions of the shutters in each pixel.

    Args:
        state, coefficients, moves: As for `compose`.
    """
    if moves is None:
        return [None]
    turns, shifts = moves
    if state.options.interpolation == "value":
        return list(zip(turns.T[:, :, None, None], shifts.T[:, :, None, None], strict=True))
    return [(np.einsum("ln,nhw->lhw", turns, coefficients), np.einsum("ln,nhw->lhw", shifts, coefficients))]


def _exposed(state: FrameState, coefficients: np.ndarray, present: np.ndarray, moves: Moves | None) -> np.ndarray:
    """Return the weights (M, H, W, L) with which the average of frames is made, for each of M motions.

    M is the number of motions from `_motions`, in the same order. The weights of a pixel add up to 1 over M and L.

    Args:
        state, coefficients, present, moves: As for `compose`.
    """
    normalised = state.bars / state.bars.sum(axis=1, keepdims=True)
    if moves is not None and state.options.interpolation == "value":
        return _without_absent(coefficients[..., None] * normalised[:, None, None], coefficients, present)
    between = shutters.INTERPOLATIONS[state.options.interpolation]
    q = between(normalised, np.moveaxis(coefficients, 0, -1))[None]
    return _without_absent(q, np.ones(coefficients[:1].shape), present)


def seen(frame: np.ndarray, places: np.ndarray, *, sharp: bool) -> np.ndarray:
    """Sample a frame at places between pixels. Return the samples (…, C).

    Args:
        frame: The frame (H, W, C). Beyond its edges the last pixels are repeated.
        places: The places (…), complex numbers x + iy in pixels, y down, as in motions.Similarity.
        sharp: Whether to use a Catmull-Rom cubic, limited to the range of the four nearest pixels, so that it does not
            ring. Otherwise linear interpolation is used, as colors with alpha need.
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
    """Return the weights with which pixels along one axis contribute to a sample between them.

    Args:
        t: The sample's distance from pixel 0 towards pixel 1, 0 to 1; an array of any shape.
        sharp: As for `seen`.

    Returns:
        {pixel: weights, like `t`} for the pixels −1, 0, 1 and 2 if sharp, else 0 and 1.
    """
    if not sharp:
        return {0: 1 - t, 1: t}
    return {
        -1: -0.5 * t + t**2 - 0.5 * t**3,
        0: 1 - 2.5 * t**2 + 1.5 * t**3,
        1: 0.5 * t + 2 * t**2 - 1.5 * t**3,
        2: -0.5 * t**2 + 0.5 * t**3,
    }


def _without_absent(q: np.ndarray, parts: np.ndarray, present: np.ndarray) -> np.ndarray:
    """Return weights (M, H, W, L) that are 0 for absent frames. Their share goes to the present ones, in proportion.

    Args:
        q: The weights of all frames, (M, H, W, L), for M motions. They add up to 1 over M and L.
        parts: How M motions share the light, (M, H, W), with the sum 1. It is used where no present frame has a weight:
            then the present frame nearest to the exposure's middle gets these weights.
        present: (L,) bool, False for absent frames.
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
    """Convert premultiplied RGBA (…, 4) from sRGB code values to linear light. Alpha stays."""
    return light.premultiplied(light.straight(total), light.to_linear)
