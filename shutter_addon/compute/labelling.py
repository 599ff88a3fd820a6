"""Labels: which shutter is scribbled where, as the diffusion begins from them."""

from __future__ import annotations

import hashlib
from typing import NamedTuple

import numpy as np

from ..core.frames.frame_source import FrameSource
from ..core.model import scribbles
from ..core.model.frame_state import FrameState


class LabelLayer(NamedTuple):
    """Labels that count for a share of the coefficients.

    labels: (h, w) uint16, of pixels or of blocks of Options.aggregate a side: 0 free, 1 + shutter scribbled
    sole: the shutter that they give to the whole picture; None: it is not one
    key: equal for equal layers, whatever shapes they were drawn from"""

    share: float
    labels: np.ndarray
    sole: int | None
    key: tuple


def labelled(state: FrameState, size: tuple[int, int]) -> list[LabelLayer]:
    """The layers of a state's scribbles (scribbles.layers); size: (w, h) of the labels."""
    return [
        _layer(share, scribbles.rasterise(shapes, *size, border=state.options.border))
        for share, shapes in scribbles.layers(state.shapes)
    ]


def grid(source: FrameSource, state: FrameState) -> tuple[int, int]:
    """The size (w, h) of the labels and the coefficients of a source's pictures."""
    block = state.options.aggregate
    return -(-source.width // block), -(-source.height // block)


def sole_of(layers: list[LabelLayer]) -> int | None:
    """The shutter that all layers give to the whole picture, if it is one."""
    first, *others = layers
    return first.sole if all(layer.sole == first.sole for layer in others) else None


def _layer(share: float, labels: np.ndarray) -> LabelLayer:
    digest = hashlib.blake2b(np.ascontiguousarray(labels), digest_size=16).digest()
    return LabelLayer(share=share, labels=labels, sole=_sole(labels), key=(share, labels.shape, digest))


def _sole(labels: np.ndarray) -> int | None:
    """The shutter of all scribbles, if it is one; the first where there is no scribble. It holds everywhere."""
    highest = int(labels.max())
    if highest == scribbles.FREE:
        return 0
    lowest = int((labels - np.uint16(1)).min())  # the lowest shutter: a free pixel's 0 wraps around to 65,535
    return lowest if lowest == highest - 1 else None
