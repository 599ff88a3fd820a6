"""Which source frames a picture needs, for its window and its diffusion, and which are decoded in advance.

In all functions, `beside` is the distance of the frames that guide the diffusion from the shown one (guide.reach); 0:
none do.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..core.frames.frame_source import FrameSource
from ..core.model import windows
from .request import Request

# Pictures whose frames are decoded in advance, and how many frames or bytes of them lie decoded at most, besides those
# on the device: enough for a long window, whose frames are decoded while its first picture is diffused and compiled.
_AHEAD, _DECODED, _DECODED_BYTES = 4, 8, 256 << 20


def reach(request: Request, beside: int) -> tuple[int, int]:
    """Return the first and last position that any shutter exposes, that is shown, or that guides the diffusion."""
    low, high = windows.reach(request.state, request.index, request.direction)
    return min(low, request.index - beside), max(high, request.index + beside)


def shot_of(request: Request, source: FrameSource, beside: int, *, known: bool = False) -> range:
    """Return the source frames that the window may show: those of the shot around the shown one.

    It looks only for those ends of the shot that the window reaches; the clip's ends take the place of others.

    Args:
        request: the picture
        source: the footage
        beside: see above
        known: read no frame to look for cuts; only cuts that were found before count
    """
    index, (low, high), shots = request.index, reach(request, beside), source.shots
    if shots is None or not request.state.options.stop_at_cuts:
        return range(source.count)
    shot = shots.around(index, low, high, known=known)
    moved = windows.slid(request.state, index, request.direction, shot)
    if moved is not request.state:
        first, final = reach(replace(request, state=moved), beside)
        return shots.around(index, min(low, first), max(high, final), known=known)
    last = shot.stop - 1
    if request.state.options.edges == "mirror" and (last < high) != (shot.start > low):
        # Frames mirrored at one end of the shot may lie beyond its other end.
        low, high = (min(low, 2 * last - high), high) if last < high else (low, max(high, 2 * shot.start - low))
        shot = shots.around(index, low, high, known=known)
    return shot


def slid(request: Request, shot: range) -> Request:
    """Return the request with its exposure moved into the shot (edges "slide"), and edges "hold"."""
    state = windows.slid(request.state, request.index, request.direction, shot)
    return replace(request, state=replace(state, options=replace(state.options, edges="hold")))


def looked_for_cuts(request: Request, source: FrameSource, beside: int) -> tuple[set[int], set[int]]:
    """Return the source frames in which `shot_of` will look for cuts, and those in which it did, which wait."""
    if source.shots is None or not request.state.options.stop_at_cuts:
        return set(), set()
    return source.shots.lacking(request.index, *reach(request, beside)), source.shots.handed()


def positions(request: Request, shot: range) -> np.ndarray:
    """Return the positions (core.model.windows.positions) that any shutter exposes, with or without a scribble.

    If frames of them are missing (edges "shorten"), return all positions of the window that have a frame, since the
    nearest one may take their place.
    """
    state = request.state
    within = windows.positions(state.options, request.index, request.direction)
    exposed = slice(*state.open_span)
    if state.options.edges != "shorten":
        return within[exposed]
    frames = windows.source_frames(state.options, within, shot)
    return within[exposed] if (frames[exposed] >= 0).all() else within[frames >= 0]


def exposed_frames(request: Request, shot: range) -> set[int]:
    """Return the source frames at `positions`."""
    return set(windows.source_frames(request.state.options, positions(request, shot), shot).tolist())


def guided_later(request: Request, beside: int) -> list[int]:
    """Return those of the source frames that a picture reads that guide its diffusion or that of the next pictures."""
    index, step, (low, high) = request.index, request.state.options.step, reach(request, beside)
    onwards = range(index - beside, high + 1) if request.direction > 0 else range(low, index + beside + 1)
    return [i for i in onwards if i % step == 0 or i == index]


def want(source: FrameSource, index: int, direction: int, missing: Callable[[int], set[int]]) -> list[int]:
    """Have the frames decoded that a picture lacks, then those of the next pictures.

    Args:
        source: the footage
        index: the frame that the picture shows
        direction: of the request
        missing: returns the source frames that the picture of a frame lacks, as far as cuts are known

    Returns:
        The frames to be wanted once the picture is made; the others are on the device by then
    """
    indices = (index + step * direction * source.step for step in range(_AHEAD + 1))
    lacking = [missing(min(max(shown, 0), source.count - 1)) for shown in indices]
    source.want(_in_order(source, lacking))
    return _in_order(source, [frames - lacking[0] for frames in lacking[1:]])


def _in_order(source: FrameSource, lacking: list[set[int]]) -> list[int]:
    wanted = dict.fromkeys(i for frames in lacking for i in sorted(frames))
    most = _DECODED_BYTES // (source.width * source.height * 4 * source.dtype.itemsize)
    return list(wanted)[: max(_DECODED, most)]
