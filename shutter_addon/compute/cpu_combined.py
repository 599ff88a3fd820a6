"""What shutters make of frames where they do not average them, with NumPy (core.pixels.combined)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from itertools import chain
from typing import Any, NamedTuple

import numpy as np

from ..core.frames import light
from ..core.model import shutters
from ..core.model.combining import Combine
from ..core.model.frame_state import FrameState
from ..core.pixels import combined
from .cpu_weights import Exposed, Mix, displaced, mixed, valued

Moves = tuple[np.ndarray, np.ndarray]
Weights = dict[int, np.ndarray | float]


class _Sample(NamedTuple):
    """As combined.Sample, of a tile: light (3 or 4, h, w), of which three have an alpha of 1."""

    light: np.ndarray
    weight: Any
    shown: np.ndarray | None


def exposure(
    window: Any, exposed: Exposed, state: FrameState, moves: Moves | None, averaged: Callable[[Mix], np.ndarray]
) -> Callable[[Mix], np.ndarray]:
    """What gives the light of a tile, as cpu.CPUCompositor.draw composes it; averaged: gives what it is where no frame
    is there that counts. moves: the turns and shifts (L, N) of all frames of the window."""
    (combine,) = state.groups
    return partial(_combined, window, exposed, combine, moves, averaged)


def _combined(
    window: Any,
    exposed: Exposed,
    combine: Combine,
    moves: Moves | None,
    averaged: Callable[[Mix], np.ndarray],
    mix: Mix,
) -> np.ndarray:
    encoded = exposed.options.light == "encoded"
    samples = _samples(window, exposed, combine, moves, mix)
    if (first := next(samples, None)) is None:
        return averaged(mix)
    samples = chain([first], samples)
    found, counted = _median(samples, mix) if combine.mode == "median" else _extreme(combine, samples, mix, encoded)
    unit = np.float32(window.unit)
    found /= unit
    return found if exposed.present.all() else np.where(counted > 1e-6, found, averaged(mix))


def _samples(window: Any, exposed: Exposed, combine: Combine, moves: Moves | None, mix: Mix) -> Iterator[_Sample]:
    options = exposed.options
    parts = list(_parts(exposed, combine, moves, mix))
    before = options.before if exposed.direction > 0 else options.window - 1 - options.before
    used = {frame for weights, _shares in parts for frame in weights}
    if combine.threshold is not None:
        used.add(before)

    def look(frame: int, shares: np.ndarray) -> np.ndarray:
        position = exposed.origin + frame
        if moves is None:
            return window.light(mix.tile, position) * np.float32(window.unit)
        turn, shift = (mix.pixels(np.tensordot(part[frame], shares, axes=1)) for part in moves)
        return window.seen(mix.tile, position, turn, shift) * np.float32(window.unit)

    for frame in sorted(used & set(np.flatnonzero(exposed.present).tolist())):
        yield _sample(parts, frame, look, mix, is_shown=frame == before and combine.threshold is not None)


def _sample(parts: list, frame: int, look: Callable, mix: Mix, *, is_shown: bool) -> _Sample:
    """A frame as all parts see it, mixed by how much it counts in each."""
    looks = [look(frame, shares) for _weights, shares in parts]
    weights = [mix.pixels(weights.get(frame, 0.0)) for weights, _shares in parts]
    if len(parts) == 1:
        return _Sample(looks[0], weights[0], looks[0] if is_shown else None)
    weight = sum(weights)
    light_ = sum(own * sight for own, sight in zip(weights, looks, strict=True)) / np.maximum(weight, np.float32(1e-30))
    own = (mix.pixels(np.tensordot(shares[:, 0, 0], mix.c, axes=1)) for _weights, shares in parts)
    shown = sum(share * sight for share, sight in zip(own, looks, strict=True)) if is_shown else None
    return _Sample(light_, weight, shown)


def _parts(exposed: Exposed, combine: Combine, moves: Moves | None, mix: Mix) -> Iterator[tuple[Weights, np.ndarray]]:
    """How much frames count (h, w), and the shares by which shutters look at them: by value interpolation, of what
    follows several motions, for each shutter."""
    bars, options, count = exposed.bars, exposed.options, exposed.options.window
    normalised = bars / bars.sum(axis=1, keepdims=True)
    if options.interpolation == "value":
        counts = normalised if combine.mode == "median" else bars / bars.max(axis=1, keepdims=True)
        if moves is None:
            yield dict(valued(counts, mix.c)), mix.c
            return
        for n, own in enumerate(counts):
            yield dict(valued(own[None], mix.c[[n]])), np.eye(len(bars))[n][:, None, None]
        return
    weights = displaced(shutters.knots(bars), count, mix.c)
    if combine.mode == "median":
        yield dict(weights), mix.c
        return
    highest = mixed(1 / normalised.max(axis=1)[None], mix.c)[0]
    yield {frame: weight * highest for frame, weight in weights}, mix.c


def _extreme(combine: Combine, samples: Iterator[_Sample], mix: Mix, encoded: bool) -> tuple[np.ndarray, np.ndarray]:
    """The lightest or the darkest (3 or 4, h, w), and how much (h, w) of all frames counts."""
    best: Any = -np.inf
    alpha: Any = np.float32(0)
    most: Any = np.float32(0)
    is_opaque = True
    for light_, weight, shown in samples:
        passed = weight if combine.threshold is None else weight * _passes(combine, light_, encoded)
        for seen, counted in [(light_, passed)] + ([] if shown is None else [(shown, np.float32(1))]):
            is_opaque = len(seen) == 3
            cover = np.float32(1) if is_opaque else seen[3]
            value = seen[:3] if combine.mode == "lightest" else cover - seen[:3]
            faded = value * counted
            if combine.mode == "darkest":
                faded = np.where(value > 0, faded, value)
            faded = np.where(np.asarray(counted) > 0, faded, -np.inf)
            if combine.by_luminance:
                best = np.where(_luminance(faded) > _luminance(np.broadcast_to(best, faded.shape)), faded, best)
            else:
                best = np.maximum(best, faded)
            alpha, most = np.maximum(alpha, counted * cover), np.maximum(most, counted)
    most = np.broadcast_to(most, mix.tile.shape)
    alpha = alpha / np.maximum(most, 1e-30)
    best = np.broadcast_to(np.where(np.isinf(best), 0, best), (3, *mix.tile.shape)).astype(np.float32)
    found = alpha - best if combine.mode == "darkest" else best
    return (found if is_opaque else np.concatenate([found, np.broadcast_to(alpha, (1, *most.shape))])), most


def _luminance(planes: np.ndarray) -> np.ndarray:
    found = np.tensordot(light.REC709, np.nan_to_num(planes, neginf=-1e30), axes=1)
    return np.where(np.isinf(planes[0]), -np.inf, found)


def _passes(combine: Combine, planes: np.ndarray, encoded: bool) -> np.ndarray:
    """As combined.passes."""
    cover = planes[3] if len(planes) == 4 else np.float32(1)
    color = planes[:3] / np.where(cover > 0, cover, 1)
    if encoded:
        color = light.to_linear(color)
    return combined.passes(combine, np.tensordot(light.REC709, color, axes=1))


def _median(samples: Iterator[_Sample], mix: Mix) -> tuple[np.ndarray, np.ndarray]:
    """The median (3 or 4, h, w), and how much (h, w) of all frames counts."""
    seen, counts = zip(*((light_, weight) for light_, weight, _shown in samples), strict=True)
    lights = np.stack(seen)
    weights = np.stack([np.broadcast_to(np.float32(weight), mix.tile.shape) for weight in counts])
    counted = weights.sum(axis=0)
    if lights.shape[1] == 3:
        return np.stack([combined.weighted_median(lights[:, k], weights) for k in range(3)]), counted
    alphas = weights * lights[:, 3]
    straight = lights[:, :3] / np.maximum(lights[:, 3:], 1e-30)
    cover = alphas.sum(axis=0) / np.maximum(counted, 1e-30)
    middle = [combined.weighted_median(straight[:, k], alphas) * cover for k in range(3)]
    return np.stack([*middle, cover]), counted
