"""From a source and an state to a picture: rasterise, diffuse, load the window, compose."""

from __future__ import annotations

import numpy as np

from ..core import compositor, scribbles, shutters
from ..core.frame_source import FrameSource
from ..core.frame_state import FrameState
from .cpu import CPUCompositor
from .device import NoDeviceError

DEVICES = ("auto", "gpu", "cpu")


def open_compositor(device: str = "auto"):
    """The compositor for a device of DEVICES, and a sentence for the user where "auto" had to do without GL."""
    if device == "cpu":
        return CPUCompositor(), None
    try:
        from .gl import GLDevice
        from .gpu import GPUCompositor

        return GPUCompositor(GLDevice()), None
    except ImportError as error:  # a package without wheels, or one for another Python
        reason = f"the Python package moderngl cannot be loaded ({error})"
    except NoDeviceError as error:
        reason = str(error)
    if device == "gpu":
        raise NoDeviceError(reason)
    return CPUCompositor(), f"{reason}; composing with NumPy, which is slow"


class Renderer:
    """Pictures of one source; keeps the window's frames and the last coefficients.

    Windows end at cuts (Options.stop_at_cuts) of a source that knows them (FrameSource.shots).
    """

    def __init__(self, compositor, source: FrameSource):
        self.compositor, self.source = compositor, source
        self._solver = compositor.solver()
        self._window = None
        self._labelled = self._solved = self._drawn = None

    def picture(self, index: int, state: FrameState, direction: int = 1) -> np.ndarray:
        """The picture (H, W, 4) float32 at source frame `index`: scene-linear, premultiplied, top row first.

        direction: −1 where the source plays in reverse, and the window's next frames are those before `index`.
        """
        with self.compositor.current():
            return self.compositor.read(self.draw(index, state, direction))

    def draw(self, index: int, state: FrameState, direction: int = 1, *, quick: bool = False):
        """The same on the device: a texture array rgba32f of one layer, bottom row first (with NumPy: as `picture`).

        It stays until the next one of this renderer; the same picture is not composed twice. quick: coefficients may
        start from the last ones, where scribbles moved; the picture then depends a little on what was drawn before.
        """
        key = index, direction, state.key
        if self._drawn is None or self._drawn[0] != key or not (quick or self._drawn[1]):
            with self.compositor.current():
                picture = self.compositor.draw(*self._parts(index, state, direction, quick))
            self._drawn = key, not quick, picture
        return self._drawn[2]

    def coefficients(self, state: FrameState) -> np.ndarray:
        """Coefficients (N, h, w) float32 at an state, one per pixel or per block that shares a shutter."""
        count, (width, height) = len(state.bars), self._grid(state)
        with self.compositor.current():
            labels = self.labels(state)
            if (values := _uniform(labels, count)) is not None:
                return np.broadcast_to(values.astype(np.float32)[:, None, None], (count, height, width))
            return self.compositor.coefficients(self._diffused(labels, count), count)

    def drawn_coefficients(self, state: FrameState):
        """Coefficients on the device, which must be a GPU: (texture array rgba32f of four shutters a layer, top row
        first; the pixels along each side of a texel; the number of shutters). They are those of a quick `draw`.

        The texture is one texel where they are the same everywhere. It stays until the next call of any method.
        """
        labels, count = self.labels(state), len(state.bars)
        with self.compositor.current():
            if (values := _uniform(labels, count)) is not None:
                return self.compositor.constant(values), self._everywhere, count
            return self._diffused(labels, count, quick=True), state.options.aggregate, count

    def drawn_labels(self, state: FrameState):
        """Labels on the device, which must be a GPU: (texture array r16ui, top row first; the pixels along each side of
        a texel). The texture stays until the next call."""
        with self.compositor.current():
            return self.compositor.labels(self.labels(state)), state.options.aggregate

    def labels(self, state: FrameState) -> np.ndarray:
        """Labels (h, w) uint16 of the pixels, or of the blocks that share a shutter: 0 free, 1 + shutter scribbled."""
        key = self._grid(state), state.options.border, state.key[-1]
        if self._labelled is None or self._labelled[0] != key:
            self._labelled = key, scribbles.rasterise(state.shapes, *key[0], border=key[1])
        return self._labelled[1]

    def shot(self, index: int, direction: int, state: FrameState, *, known: bool = False) -> range:
        """The source frames that the window may show: those of the shot around `index`, as far as the window tells.

        It reads what it must to find cuts; known: nothing, and where it does not know there is no cut."""
        if not self._stops(state):
            return range(self.source.count)
        low, high = self._reach(index, direction, state)
        shot = self.source.shots.around(index, low, high, known=known)
        last = shot.stop - 1
        if state.options.edges == "mirror" and (last < high) != (shot.start > low):
            # What is mirrored at one end may reach beyond the other.
            low, high = (min(low, 2 * last - high), high) if last < high else (low, max(high, 2 * shot.start - low))
            shot = self.source.shots.around(index, low, high, known=known)
        return shot

    def positions(self, index: int, direction: int, state: FrameState, shot: range) -> np.ndarray:
        """Where the frames lie that some shutter exposes, on the picture or not (core.compositor.window_positions);
        all of the window's that are there, where a shutter may lose all of its own."""
        positions = compositor.window_positions(state.options, index, direction)
        frames = compositor.source_frames(state.options, positions, shot)
        low, high = shutters.open_span(state.bars)
        return positions[low:high] if (frames[low:high] >= 0).all() else positions[frames >= 0]

    def needed(self, index: int, direction: int, state: FrameState, *, known: bool = True) -> set[int]:
        """The source frames at those positions, as far as cuts are known; known as for `shot`."""
        shot = self.shot(index, direction, state, known=known)
        positions = self.positions(index, direction, state, shot)
        return set(compositor.source_frames(state.options, positions, shot).tolist())

    def missing(self, index: int, direction: int, state: FrameState) -> set[int]:
        """Those of the needed source frames that still must be read, and those that cuts are looked for in."""
        held = self._window.held if self._window and self._window.capacity == state.options.window else ()
        missing = self.needed(index, direction, state).difference(held)
        if self._stops(state):
            missing |= self.source.shots.lacking(index, *self._reach(index, direction, state))
            missing -= self.source.shots.handed()
        return missing

    def _stops(self, state: FrameState) -> bool:
        return state.options.stop_at_cuts and self.source.shots is not None

    @staticmethod
    def _reach(index: int, direction: int, state: FrameState) -> tuple[int, int]:
        """The first and the last position from the frame that is shown to all that some shutter exposes."""
        positions = compositor.window_positions(state.options, index, direction)
        reach = [index, *positions[slice(*shutters.open_span(state.bars))].tolist()]
        return min(reach), max(reach)

    @property
    def _everywhere(self) -> int:
        """The block that holds the whole picture."""
        return max(self.source.width, self.source.height)

    def _grid(self, state: FrameState) -> tuple[int, int]:
        block = state.options.aggregate
        return -(-self.source.width // block), -(-self.source.height // block)

    def _parts(self, index: int, state: FrameState, direction: int, quick: bool):
        """What the compositor needs, its window loaded."""
        handle, state, block = self._coefficients(state, quick)
        window = self._window_for(state.options.window)
        shot = self.shot(index, direction, state)
        window.load(self.positions(index, direction, state, shot), state.options, shot)
        return window, index, direction, state, handle, block

    def _coefficients(self, state: FrameState, quick: bool):
        """The coefficients on the device, the state to compose with them, and the block that shares one.

        Where one mix of shutters holds for the whole picture, that mix is the only shutter.
        """
        labels = self.labels(state)
        values = _uniform(labels, len(state.bars))
        if values is None:
            return self._diffused(labels, len(state.bars), quick), state, state.options.aggregate
        chosen = int(values.argmax())
        return self.compositor.constant(np.ones(1)), state.alone(chosen), self._everywhere

    def _diffused(self, labels: np.ndarray, count: int, quick: bool = False):
        """Solves anew only when a scribble moved, or where a quick solution stands and is not enough."""
        same = self._solved and self._solved[0] == count and np.array_equal(self._solved[1], labels)
        if not same or not (quick or self._solved[2]):
            self._solved = count, labels, not quick, self._solver.solve(labels, count, warm=quick)
        return self._solved[3]

    def _window_for(self, length: int):
        if self._window is None or self._window.capacity != length:
            self.release_window()
            self._window = self.compositor.window(self.source, length)
        return self._window

    def release_window(self) -> None:
        """Frees the frames; the next picture reads them again."""
        if self._window is not None:
            self._window.release()
            self._window = self._drawn = None
        if self.source.shots is not None:
            self.source.shots.release()

    def close(self) -> None:
        """Frees everything on the device and closes the source."""
        with self.compositor.current():
            self.release_window()
            self._solver.release()
        self.source.close()


def _uniform(labels: np.ndarray, count: int) -> np.ndarray | None:
    """Coefficients (N,) where they are the same everywhere: no scribble, or those of one shutter alone."""
    highest = int(labels.max())
    if highest == scribbles.FREE:
        return np.eye(count)[0]
    lowest = int((labels - np.uint16(1)).min())  # what is free wraps around to the top
    return np.eye(count)[lowest] if lowest == highest - 1 else None
