"""The moments between the frames of footage, found by optical flow as they are read: smooth exposures of any footage.

Whatever a pair of frames needs is found when its first moment is read, which the thread that decodes ahead does
(prefetch). No moment is kept on disk, but vectors may be (stored_vectors).
"""

from __future__ import annotations

import numpy as np

from ..core.frames.frame_source import FrameSource
from ..core.frames.planes import Decoded, as_rgba
from ..core.frames.source_wrapper import SourceWrapper
from ..core.memo import Kept
from ..core.model.motions import Similarity
from ..core.model.shutters import MAX_WINDOW
from . import flow, opencv, steps
from .errors import MediaError
from .files import check_index
from .stored_vectors import StoredVectors

SMOOTH = 1, 2, 4, 8, 16  # moments from a filmed frame to the next
_PAIRS = 8  # of neighbouring frames, spread over the footage, that "auto" looks at
_FRAMES = 3  # frames that are kept: those of a pair, and the one before, which running sums take back


class SmoothSource(SourceWrapper):
    """A source with the moments between its frames, `step` from a frame to the next.

    Moment i · step is the source's frame i. Where two frames have nothing in common, as at a cut, those between them
    are the nearer one."""

    def __init__(self, source: FrameSource, step: int, vectors: StoredVectors | None = None) -> None:
        super().__init__(source)
        flow.check()
        self._find = flow.found if vectors is None else vectors.found
        self.step = step
        self.count = (source.count - 1) * step + 1
        self.fps = None if source.fps is None else source.fps * step
        self.options = {**source.options, "inbetween": step}
        self._frames: Kept[int, np.ndarray] = Kept()
        self._pairs: Kept[int, flow.Between] = Kept()

    def read(self, index: int) -> np.ndarray:
        """The frame or the moment (height, width, 4). MediaError: as the source's `read`."""
        return as_rgba(self.decoded(index))

    def decoded(self, index: int) -> Decoded:
        """The frame, or the moment with the two frames around it. MediaError: as the source's `read`."""
        check_index(self, index)
        pair, number = divmod(index, self.step)
        if number == 0:
            return self._frame(pair)
        return self._pairs.ask(pair, lambda: self._between(pair), 2).moment(pair, number, self.step)

    def _frame(self, index: int) -> np.ndarray:
        return self._frames.ask(index, lambda: self._source.read(index), _FRAMES)

    def _between(self, pair: int) -> flow.Between:
        return flow.Between(self._frame(pair), self._frame(pair + 1), self.transfer, self.alpha, self._find)

    def close(self) -> None:
        """Closes the file, and lets go of all frames."""
        self._frames.clear()
        self._pairs.clear()
        self._source.close()


def steps_for(source: FrameSource, smooth: int | str, window: int) -> int:
    """How many moments an effect has from a filmed frame to the next.

    Args:
        smooth: as frame_state.Options.step; "auto": as many as the fastest motion of a few pairs of frames needs
        window: filmed frames of its shutters, all of whose moments have to fit into shutters.MAX_WINDOW

    Returns:
        One of SMOOTH.
    """
    most = max(count for count in SMOOTH if count * window <= max(MAX_WINDOW, window))
    if smooth != "auto":
        return min(int(smooth), most)
    if opencv.cv2 is None or source.count < 2:
        return 1
    needed = _fastest(source) / steps.smooth(source.height)
    return next((count for count in SMOOTH if needed <= count <= most), most)


def _fastest(source: FrameSource) -> float:
    """Pixels from a frame to the next, of what moves fastest in a few pairs of neighbouring frames."""
    pairs = sorted({(source.count - 2) * k // (_PAIRS - 1) for k in range(_PAIRS)})
    moved = []
    for pair in pairs:
        try:
            found = steps.moved(source, pair)
        except MediaError:  # who needs these frames is told
            continue
        if found is not None:
            moved.append(steps.step(found, Similarity(), Similarity()) * source.height)
    return max(moved, default=0.0)
