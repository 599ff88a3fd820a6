"""Which frames are decoded in advance: those that a picture lacks, then those of the next ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...compute.memory_needs import frame_bytes
from ...compute.renderer import Renderer
from ...compute.request import Request

# Pictures whose frames are decoded in advance, and how many frames or bytes of them lie decoded at most, besides those
# on the device: enough for a long window, whose frames are decoded while its first picture is diffused and compiled.
_AHEAD, _DECODED, _DECODED_BYTES = 4, 8, 256 << 20


def picture(renderer: Renderer, request: Request) -> np.ndarray:
    """The picture, made on the renderer's device; and the frames of the next ones are decoded."""
    lacking = _lacking(renderer, request)
    _want(renderer.source, lacking)
    made = renderer.picture(request)
    _want(renderer.source, [missing - lacking[0] for missing in lacking[1:]])  # the rest is on the device by now
    return made


def coefficients(renderer: Renderer, request: Request) -> np.ndarray:
    """As Renderer.coefficients; frames are decoded as for `picture`, which will read them as well."""
    prefetch(renderer, request)
    return renderer.coefficients(request)


def prefetch(renderer: Renderer, request: Request) -> None:
    """Has the frames decoded that the picture lacks, then those of the next pictures."""
    _want(renderer.source, _lacking(renderer, request))


def check(renderer: Renderer, request: Request) -> None:
    """MediaError: an in-between frame that the picture needs is missing. No frame is read."""
    if renderer.source.step > 1:
        for index in sorted(renderer.needed(request)):
            renderer.source.check(index)


def _lacking(renderer: Renderer, request: Request) -> list[set[int]]:
    """The frames that this picture and each of the next ones lack."""
    source = renderer.source
    indices = (request.index + step * request.direction * source.step for step in range(_AHEAD + 1))
    shown = (min(max(index, 0), source.count - 1) for index in indices)
    return [renderer.missing(replace(request, index=index)) for index in shown]


def _want(source, lacking: list[set[int]]) -> None:
    wanted = {}
    for missing in lacking:
        # One that is not built yet would be remembered as a fault, and may come before it is needed.
        wanted |= dict.fromkeys(i for i in sorted(missing) if source.step == 1 or source.has(i))
    source.want(list(wanted)[: decoded_ahead(source)])


def decoded_ahead(source) -> int:
    """How many frames of a source may lie decoded on the host, besides a window that is kept there."""
    return max(_DECODED, _DECODED_BYTES // frame_bytes(source))


def decoded_bytes(source, window: int) -> int:
    """Bytes that decoded frames take on the host at most: those of a window of so many frames, and of the next
    pictures, as far as there is room."""
    return min(decoded_ahead(source), window + _AHEAD * source.step) * frame_bytes(source)
