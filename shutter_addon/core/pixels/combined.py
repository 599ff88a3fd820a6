"""Combining exposed frames other than by averaging (frame_state.Combine): the reference, in float64.

With wₖ the weight of a frame, 0 to 1 (`counts`), and Vₖ its light with alpha aₖ, both premultiplied:

    lightest    max wₖ Vₖ                   a frame fades into black
    darkest     A − max uₖ, where uₖ = wₖ (aₖ − Vₖ), or aₖ − Vₖ where that is below 0    a frame fades into white
    median      M · Σ qₖ aₖ / Σ qₖ, where M is the weighted median of Vₖ / aₖ, each counted qₖ aₖ times

and A = max wₖ aₖ / max wₖ, the alpha of the first two. Their brightness does not depend on the number of frames. A
threshold lowers wₖ, but not A's divisor: a pixel without light above it is transparent.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..frames import light
from ..model import shutters
from ..model.frame_state import Combine

# If a median's weights are this close to the middle, both neighbours count, as with an even number of frames. Rounding
# must not choose between them, since devices round differently.
MIDDLE = 1 / 8192


class Sample(NamedTuple):
    """A visible frame: its premultiplied light (H, W, 4), and its weight (H, W).

    Attributes:
        shown: The light of the shown frame regardless of weights; None for other frames.
    """

    light: np.ndarray
    weight: np.ndarray
    shown: np.ndarray | None = None


def counts(combine: Combine, bars: ArrayLike, coefficients: ArrayLike, interpolation: str) -> np.ndarray:
    """Return the weights of frames (…, L) for pixels with coefficients (…, N).

    For a median these are the normalised interpolated bars. For lightest and darkest they are from 0 to 1: by
    displacement the same times Σ cᵢ / (the highest of shutter i's), so that equal bars have weight 1; by value
    Σ cᵢ (shutter i's bars / its highest).
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
    """Return the premultiplied picture (H, W, 4) of at least one frame; black where all weights are 0.

    Args:
        encoded: Whether light is encoded (Options.light).
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
    """Return the lights of a frame with their weights; with a threshold, the shown frame always counts."""
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
    """Return how much of light with a linear luminance (…) leaves a trail, 0 to 1."""
    half = max(combine.softness, 1e-6) / 2
    t = np.clip((luminance - ((combine.threshold or 0.0) - half)) / (2 * half), 0, 1)
    t = t * t * (3 - 2 * t)
    return 1 - t if combine.mode == "darkest" else t


def median(samples: Sequence[Sample]) -> np.ndarray:
    """Return the median (H, W, 4) of each channel."""
    straight, weights = light.straight(np.stack([s.light for s in samples])), np.stack([s.weight for s in samples])
    alphas = weights * straight[..., 3]
    cover = (alphas.sum(axis=0) / np.maximum(weights.sum(axis=0), 1e-30))[..., None]
    middle = np.stack([weighted_median(straight[..., k], alphas) for k in range(3)], axis=-1)
    return np.concatenate([middle * cover, cover], axis=-1)


def weighted_median(values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the weighted median of values (L, …): the first where the cumulated weight reaches half, less MIDDLE.

    Within MIDDLE of half it is mixed with the next value, equally at exactly half.
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
