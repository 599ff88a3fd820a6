"""Pictures with layers that every device is compared with, in float64 (core.pixels.layering)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from shutter_addon.core.frames import light
from shutter_addon.core.model.frame_state import FrameState
from shutter_addon.core.pixels import compositor, layering


def compose(
    state: FrameState,
    frames: Sequence[np.ndarray],
    present: ArrayLike,
    coefficients: ArrayLike,
    mattes: np.ndarray,
    moves: compositor.Moves | None = None,
    plate: np.ndarray | None = None,
) -> np.ndarray:
    """The picture (H, W, 4) float64 of a state with layers; arguments as for compositor.compose.

    moves: for all shutters
    mattes: (n, L, H, W) of the layers in the window's frames; plate: (H, W, 4), None: nothing lacks"""
    if state.layers is None:
        raise ValueError("there are no layers")
    opaque = all((frame[..., 3] == 1).all() for frame in frames)
    clear = np.stack([layering.behind(list(of_frame)) for of_frame in np.swapaxes(mattes, 0, 1)])

    def exposed(
        part: FrameState, weights: np.ndarray, c: ArrayLike, moved: compositor.Moves | None
    ) -> tuple[np.ndarray, np.ndarray]:
        colors = [frame * weight[..., None] for frame, weight in zip(frames, weights, strict=True)]
        color = compositor.compose(part, colors, present, c, moved)
        if opaque:  # what it covers is as much as its weights are
            return color, color[..., 3]
        seen = [light.straight(each) for each in colors]  # a threshold asks for it
        shares = [
            np.concatenate([each[..., :3] * w[..., None], w[..., None]], axis=-1)
            for each, w in zip(seen, weights, strict=True)
        ]
        plain = replace(part, options=replace(part.options, light="linear", exposure="normalized"))
        return color, compositor.compose(plain, shares, present, c, moved)[..., 3]

    behind_them = replace(state, layers=None)
    sums, share = exposed(behind_them, clear, coefficients, moves)
    plain = compositor.compose(behind_them, frames, present, coefficients, moves)
    picture = np.where((share > layering.UNCOVERED)[..., None], plain, layering.with_plate(sums, share, plate))
    whole = np.ones((1, *np.shape(coefficients)[1:]))
    for i, shutter in enumerate(state.layers.shutters):
        moved = moves and (moves[0][:, [shutter]], moves[1][:, [shutter]])
        color, cover = exposed(state.of([shutter]), mattes[i], whole, moved)
        picture = color + (1 - cover[..., None]) * picture
    return picture
