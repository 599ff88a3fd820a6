"""What a shutter makes of the frames that it exposes where it does not average them (frame_state.Combine): the
reference, in float64.

With wₖ how much a frame counts, from 0 to 1 (`counts`), and Vₖ its light with alpha aₖ, both premultiplied:

    lightest    max wₖ Vₖ                   a frame fades into black
    darkest     A − max uₖ, where uₖ = wₖ (aₖ − Vₖ), or aₖ − Vₖ where that is below 0    a frame fades into white
    median      M · Σ qₖ aₖ / Σ qₖ, where M is the weighted median of Vₖ / aₖ, each counted qₖ aₖ times

and A = max wₖ aₖ / max wₖ, the alpha of the first two. Their brightness does not depend on how many frames there are.
A threshold lowers wₖ, but not what A divides by: a pixel without light that passes is transparent.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..frames import light
from ..model import shutters
from ..model.frame_state import Combine

# Around the middle of a median's weights: within so much of it, both neighbours count, as of an even number of frames.
# Rounding must not choose between them, for devices round differently.
MIDDLE = 1 / 8192


class Sample(NamedTuple):
    """A frame as it is seen: its light (H, W, 4), premultiplied, and how much it counts (H, W).

    shown: of the shown frame, its light whatever counts; None: it is another one"""

    light: np.ndarray
    weight: np.ndarray
    shown: np.ndarray | None = None


def counts(combine: Combine, bars: ArrayLike, coefficients: ArrayLike, interpolation: str) -> np.ndarray:
    """How much each frame counts (…, L): of medians, the normalised bars that a pixel with coefficients (…, N) gets. Of
    the lightest and the darkest, 0 to 1: by displacement the same times Σ cᵢ / (the highest of shutter i's), by which
    equal bars count 1; by value Σ cᵢ (shutter i's bars / its highest)."""
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
    """The picture (H, W, 4), premultiplied, of frames that are there, one at least; where none counts, black. encoded:
    whether their light is (Options.light)"""
    return median(samples) if combine.mode == "median" else extreme(combine, samples, encoded=encoded)


def extreme(combine: Combine, samples: Sequence[Sample], *, encoded: bool = False) -> np.ndarray:
    """The lightest or the darkest (H, W, 4). Frames with a weight of 0 do not count."""
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
    """What of a frame counts, and how much: with a threshold the shown one does whatever its weight is."""
    if combine.threshold is None:
        return [(sample.light, sample.weight)]
    color = light.straight(sample.light)[..., :3]
    luminance = (light.to_linear(color) if encoded else color) @ light.REC709.astype(np.float64)
    counted = [(sample.light, sample.weight * passes(combine, luminance))]
    if sample.shown is not None:
        counted.append((sample.shown, np.ones(sample.weight.shape)))
    return counted


def _luminance(value: np.ndarray) -> np.ndarray:
    return np.where(np.isinf(value[..., 0]), -np.inf, np.nan_to_num(value, neginf=0.0) @ light.REC709)


def passes(combine: Combine, luminance: np.ndarray) -> np.ndarray:
    """How much of light of a linear luminance (…) leaves a trail, 0 to 1."""
    half = max(combine.softness, 1e-6) / 2
    t = np.clip((luminance - ((combine.threshold or 0.0) - half)) / (2 * half), 0, 1)
    t = t * t * (3 - 2 * t)
    return 1 - t if combine.mode == "darkest" else t


def median(samples: Sequence[Sample]) -> np.ndarray:
    """The median (H, W, 4) of each channel."""
    straight, weights = light.straight(np.stack([s.light for s in samples])), np.stack([s.weight for s in samples])
    alphas = weights * straight[..., 3]
    cover = (alphas.sum(axis=0) / np.maximum(weights.sum(axis=0), 1e-30))[..., None]
    middle = np.stack([weighted_median(straight[..., k], alphas) for k in range(3)], axis=-1)
    return np.concatenate([middle * cover, cover], axis=-1)


def weighted_median(values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """The weighted median of values (L, …): the least whose weight with that of all below is half of all, less MIDDLE;
    where it is within MIDDLE of half, it is mixed with the next one, half and half at half."""
    order = np.argsort(np.where(weights > 0, values, np.inf), axis=0, kind="stable")
    values, weights = (np.take_along_axis(a, order, axis=0) for a in (values, weights))
    below = np.cumsum(weights, axis=0)
    below = below / np.maximum(below[-1:], 1e-30)
    # Equal values count together.
    for k in range(len(values) - 2, -1, -1):
        below[k] = np.where((values[k] == values[k + 1]) & (weights[k + 1] > 0), below[k + 1], below[k])
    first = (below >= 0.5 - MIDDLE).argmax(axis=0)[None]
    lower, until = (np.take_along_axis(a, first, axis=0)[0] for a in (values, below))
    above = np.where((values > lower) & (weights > 0), values, np.inf).min(axis=0)
    share = np.clip((until - (0.5 - MIDDLE)) / (2 * MIDDLE), 0, 1)
    return np.where(np.isinf(above) | (share == 1), lower, share * lower + (1 - share) * np.nan_to_num(above, posinf=0))
