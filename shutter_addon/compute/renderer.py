"""Renders pictures of a source: rasterise the scribbles, diffuse them, lay mattes over, load the window's frames,
compose."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..core.frames.frame_source import FrameSource
from ..core.model import scribbles
from ..core.model.frame_state import FrameState
from ..core.model.mattes import MatteReader
from ..core.pixels import compositor
from ..devices.device import NoDeviceError
from . import guide
from .cpu import CPUCompositor


def open_compositor(device: str = "gpu", *memory):
    """The compositor "gpu", on OpenGL 4.3, or "cpu", on NumPy; memory: the arguments of GLDevice. NoDeviceError: there
    is no OpenGL 4.3."""
    if device == "cpu":
        return CPUCompositor()
    from .gpu import GPUCompositor

    return GPUCompositor(open_gl(*memory))


def open_gl(*memory):
    """A device on an OpenGL 4.3 context of its own; memory: the arguments of GLDevice. NoDeviceError: there is none, or
    no moderngl."""
    try:
        from ..devices.gl import GLDevice
    except ImportError as error:  # a package without wheels, or one for another Python
        raise NoDeviceError(f"the Python package moderngl cannot be loaded ({error})") from None
    return GLDevice(*memory)


class Renderer:
    """Pictures of one source. It keeps the window's frames, the last coefficients and the last picture.

    mattes: what reads the mattes of its pictures; None: they have none

    Windows end at cuts if Options.stop_at_cuts is set and the source knows its shots (FrameSource.shots).
    Frames are counted as the source counts them, from 0. direction, in all methods: 1, or −1 where the source plays in
    reverse, so that the window's next frames are those before `index`.
    """

    def __init__(self, compositor, source: FrameSource, mattes: MatteReader | None = None):
        self.compositor, self.source, self._mattes = compositor, source, mattes
        self._solver, self._matting, self._mixing = compositor.solver(), compositor.matting(), compositor.mixing()
        self._guides = guide.Guides(source)
        self._window = self._kind = None
        self._labelled = self._solved = self._laid = self._drawn = None
        self._solution = 0  # counts the solver's

    def picture(self, index: int, state: FrameState, direction: int = 1) -> np.ndarray:
        """The picture (H, W, 4) float32 at source frame `index`: scene-linear, premultiplied, top row first."""
        with self.compositor.current():
            return self.compositor.read(self.draw(index, state, direction))

    def levels(self, index: int, state: FrameState, direction: int = 1) -> np.ndarray:
        """The picture over black in 8-bit sRGB (H, W, 4), top row first, its alpha full: as a movie has it where
        Blender's view transform is Standard."""
        with self.compositor.current():
            if self.source.alpha == "opaque":
                return self.compositor.read(self.draw(index, state, direction, levels=True))
            return self.compositor.over_black(self.draw(index, state, direction))

    def draw(self, index: int, state: FrameState, direction: int = 1, *, quick: bool = False, levels: bool = False):
        """The picture on the device (GPUCompositor.draw); with NumPy, an array as of `picture` or `levels`. It is valid
        until the next picture of this renderer, and composed only if it is not the last one.

        quick: the diffusion may start from the last coefficients, so the picture depends slightly on them.
        levels: the picture is of 8-bit display code values, not scene-linear
        """
        key = index, direction, state.key, levels
        lost = self._drawn is None or not self._window.is_open
        if lost or self._drawn[0] != key or not (quick or self._drawn[1]):
            self._drawn = None  # nothing that is broken off is taken for whole, here and below
            with self.compositor.current():
                picture = self.compositor.draw(*self._parts(index, state, direction, quick), levels=levels)
            self._drawn = key, not quick, picture
        return self._drawn[2]

    def coefficients(self, index: int, state: FrameState, direction: int = 1) -> np.ndarray:
        """Coefficients (N, h, w) float32 of `picture`, for each pixel, or for each block of Options.aggregate pixels a
        side."""
        count, (width, height) = len(state.bars), self._grid(state)
        with self.compositor.current():
            if (sole := self._sole(state)) is not None:
                values = np.eye(count, dtype=np.float32)[sole]
                return np.broadcast_to(values[:, None, None], (count, height, width))
            return self.compositor.coefficients(self._mixture(index, state, direction), count)

    def drawn_coefficients(self, index: int, state: FrameState, direction: int = 1):
        """Coefficients of a quick `draw` on the device, a GPU: (texture array, block, number of shutters).

        The texture array is rgba32f, four shutters per layer, top row first, each texel for block × block pixels; it
        has a single texel where coefficients are the same everywhere. It is valid until the next call of any method.
        """
        count = len(state.bars)
        with self.compositor.current():
            if (sole := self._sole(state)) is not None:
                return self.compositor.constant(np.eye(count)[sole]), self._everywhere, count
            return self._mixture(index, state, direction, quick=True), state.options.aggregate, count

    def drawn_labels(self, state: FrameState):
        """Labels on the device, a GPU: (texture array r32ui, block), top row first, each texel for block × block
        pixels. It is valid until the next call of any method."""
        with self.compositor.current():
            return self.compositor.labels(self.labels(state)), state.options.aggregate

    def labels(self, state: FrameState) -> np.ndarray:
        """Labels (h, w) uint16 of pixels, or of blocks as for `coefficients`: 0 free, 1 + shutter scribbled."""
        return self._labelling(state)[0].labels

    def _sole(self, state: FrameState) -> int | None:
        """The shutter that holds for the whole picture, if one does."""
        return None if state.mattes else self._scribbled(state)

    def _scribbled(self, state: FrameState) -> int | None:
        """The shutter that the scribbles give to the whole picture, if it is one."""
        first, *others = self._labelling(state)
        return first.sole if all(layer.sole == first.sole for layer in others) else None

    def _labelling(self, state: FrameState) -> list[_Layer]:
        """Of each of scribbles.layers."""
        key = self._grid(state), state.options.border, state.key[-1]
        if self._labelled is None or self._labelled[0] != key:
            parts = scribbles.layers(state.shapes)
            drawn = [(share, scribbles.rasterise(shapes, *key[0], border=key[1])) for share, shapes in parts]
            self._labelled = key, [_Layer(share, labels, _sole(labels)) for share, labels in drawn]
        return self._labelled[1]

    def shot(self, index: int, direction: int, state: FrameState, *, known: bool = False) -> range:
        """The source frames that the window may show: those of the shot around `index`. Ends of the shot that the
        window does not reach are not looked for: the clip's ends take their place.

        It reads frames in which cuts are looked for. known: it reads none, and knows only the cuts found before."""
        if not self._stops(state):
            return range(self.source.count)
        low, high = self._reach(index, direction, state)
        shot = self.source.shots.around(index, low, high, known=known)
        last = shot.stop - 1
        if state.options.edges == "mirror" and (last < high) != (shot.start > low):
            # Frames mirrored at one end of the shot may lie beyond its other end.
            low, high = (min(low, 2 * last - high), high) if last < high else (low, max(high, 2 * shot.start - low))
            shot = self.source.shots.around(index, low, high, known=known)
        return shot

    def positions(self, index: int, direction: int, state: FrameState, shot: range) -> np.ndarray:
        """The positions (core.pixels.compositor.window_positions) that any shutter exposes, whether it has a scribble
        or not. Where frames of them are left out (edges "shorten"), all positions of the window that have a frame: the
        nearest may be needed in place of those."""
        positions = compositor.window_positions(state.options, index, direction)
        exposed = slice(*state.open_span)
        if state.options.edges != "shorten":
            return positions[exposed]
        frames = compositor.source_frames(state.options, positions, shot)
        return positions[exposed] if (frames[exposed] >= 0).all() else positions[frames >= 0]

    def needed(self, index: int, direction: int, state: FrameState, *, known: bool = True) -> set[int]:
        """The source frames at `positions`, and those that guide the diffusion. known: as for `shot`."""
        shown, beside = self._needed(index, direction, state, known=known)
        return shown.union(beside)

    def missing(self, index: int, direction: int, state: FrameState) -> set[int]:
        """The source frames that `draw` would read: needed ones that are not loaded, and those in which it looks for
        cuts."""
        held = self._window.held if self._window and self._kind == self._kind_for(state) else ()
        shown, beside = self._needed(index, direction, state, known=True)
        missing = shown.difference(held) | self._guides.lacking(beside)
        if self._stops(state):
            missing |= self.source.shots.lacking(index, *self._reach(index, direction, state))
            missing -= self.source.shots.handed()
        return missing

    def _needed(self, index: int, direction: int, state: FrameState, *, known: bool) -> tuple[set[int], tuple]:
        """The source frames at `positions`, and those of `_guiding`."""
        shot = self.shot(index, direction, state, known=known)
        positions = self.positions(index, direction, state, shot)
        shown = set(compositor.source_frames(state.options, positions, shot).tolist())
        return shown, self._guiding(index, state, shot)

    def _guiding(self, index: int, state: FrameState, shot: range) -> tuple[int, ...]:
        """The source frames that guide the diffusion (guide.guiding), the shown one first; none where nothing does."""
        return guide.guiding(index, state.options.step, shot) if self._is_guided(state) else ()

    def _is_guided(self, state: FrameState) -> bool:
        """Whether coefficients depend on the shown frame."""
        return state.options.edge_aware > 0 and self._scribbled(state) is None

    def _stops(self, state: FrameState) -> bool:
        """Whether windows end at cuts."""
        return state.options.stop_at_cuts and self.source.shots is not None

    def _reach(self, index: int, direction: int, state: FrameState) -> tuple[int, int]:
        """The first and the last of all positions that any shutter exposes, and of `index` itself with the frames that
        guide the diffusion."""
        beside = guide.reach(state.options.step) if self._is_guided(state) else 0
        low, high = compositor.reach(state, index, direction)
        return min(low, index - beside), max(high, index + beside)

    @property
    def _everywhere(self) -> int:
        """The side of a block as large as the picture, in pixels."""
        return max(self.source.width, self.source.height)

    def _grid(self, state: FrameState) -> tuple[int, int]:
        """The size (w, h) of labels and coefficients."""
        block = state.options.aggregate
        return -(-self.source.width // block), -(-self.source.height // block)

    def _parts(self, index: int, state: FrameState, direction: int, quick: bool):
        """The arguments of the compositor's `draw`, with the window loaded."""
        window = self._window_for(state)
        self._keep_guides(index, direction, state)
        if (sole := self._sole(state)) is None:
            self._load(window, index, direction, state)
            handle, block = self._mixture(index, state, direction, quick), state.options.aggregate
        else:
            state = state.alone(sole)
            self._load(window, index, direction, state)
            handle, block = self.compositor.constant(np.ones(1)), self._everywhere
        return window, index, direction, state, handle, block

    def _load(self, window, index: int, direction: int, state: FrameState) -> None:
        shot = self.shot(index, direction, state)
        window.load(self.positions(index, direction, state, shot), state.options, shot)

    def _keep_guides(self, index: int, direction: int, state: FrameState) -> None:
        """Keeps what guides the diffusion of this picture and will guide that of the next ones, as it is read."""
        if not state.options.edge_aware:
            self._guides.keep(())
        if not self._is_guided(state):  # perhaps a still frame between two pictures that are
            return
        step, (low, high) = state.options.step, self._reach(index, direction, state)
        beside = guide.reach(step)
        onwards = range(index - beside, high + 1) if direction > 0 else range(low, index + beside + 1)
        self._guides.keep(i for i in onwards if i % step == 0 or i == index)

    def _mixture(self, index: int, state: FrameState, direction: int, quick: bool = False):
        """Coefficients on the device, with the mattes laid over what the scribbles give. They are laid again only if
        either has changed since the last call."""
        if not state.mattes:
            return self._diffused(index, state, direction, quick)
        layers = self._mattes.values(state.mattes, index, state.options.aggregate)
        count, sole = len(state.bars), self._scribbled(state)
        if sole is None:
            beneath = self._diffused(index, state, direction, quick)
        else:
            beneath = self.compositor.constant(np.eye(count)[sole])
        key = state.mattes, [key for key, _ in layers], count, sole, self._solution if sole is None else None
        if self._laid is None or self._laid[0] != key:
            self._laid = None
            self._laid = key, self._matting.lay(beneath, state.mattes, layers)
        return self._laid[1]

    def _diffused(self, index: int, state: FrameState, direction: int, quick: bool = False):
        """Coefficients on the device. They are solved for only if labels or what guides them changed since the last
        call, or if the last solution was a quick one and this must not be."""
        layers, options, count = self._labelling(state), state.options, len(state.bars)
        frames = self._guiding(index, state, self.shot(index, direction, state)) if options.edge_aware else ()
        key = count, frames and (frames, options.edge_aware)
        same = self._solved and self._solved[0] == key
        same = same and (self._solved[1] is layers or _equal(self._solved[1], layers))
        if not same or not (quick or self._solved[2]):
            self._keep_guides(index, direction, state)
            guided = (self._guides.guide(frames, options.aggregate), options.edge_aware) if frames else ()
            self._solution += 1
            self._solved = None
            self._solved = key, layers, not quick, self._mixed(layers, count, guided, quick)
        return self._solved[3]

    def _mixed(self, layers: list[_Layer], count: int, guided: tuple, quick: bool):
        """The coefficients of all layers, solved for one after the other and added up. A solution that another layer
        has begun from would depend on that one."""
        if len(layers) == 1:
            return self._solver.solve(layers[0].labels, count, *guided, warm=quick)
        mixed = None
        for share, labels, sole in layers:
            solid = self.compositor.constant(np.eye(count)[sole]) if sole is not None else None
            found = self._solver.solve(labels, count, *guided) if solid is None else solid
            mixed = self._mixing.add(mixed, found, share, labels.shape)
        return mixed

    def _kind_for(self, state: FrameState) -> tuple[int, bool, int]:
        """The length of the window, whether its frames are seen elsewhere than where they are, and the number of all
        shutters."""
        sole = self._sole(state)
        moved = (state if sole is None else state.alone(sole)).following is not None
        return state.options.window, moved, len(state.bars)

    def _window_for(self, state: FrameState):
        kind = self._kind_for(state)
        if self._window is None or self._kind != kind or not self._window.is_open:
            self.release_window()
            self._kind = kind
            self._window = self.compositor.window(guide.NotedSource(self.source, self._guides), *kind)
        return self._window

    def release_window(self) -> None:
        """Frees the window's frames, and those that the search for cuts has read. The next picture reads them again."""
        with self.compositor.freeing():
            if self._window is not None:
                self._window.release()
                self._window = self._drawn = None
            self._guides.keep(())
        if self.source.shots is not None:
            self.source.shots.release()

    def shortages(self) -> set[str]:
        """What was slow in the last picture, as the device has no room: "window", every picture sends the frames;
        "diffusion", NumPy diffuses."""
        found = {"window"} if self._window is not None and self._window.sends else set()
        return found | ({"diffusion"} if self._solver.gave_up else set())

    def release(self) -> None:
        """Frees what the renderer has on the device. The next picture makes it again."""
        with self.compositor.freeing():
            self.release_window()
            self._solver.release()
            self._matting.release()
            self._mixing.release()
        self._solved = self._laid = None

    def close(self) -> None:
        """Frees what the renderer has on the device, and closes the source."""
        self.release()
        if self._mattes is not None:
            self._mattes.close()
        self.source.close()


class _Layer(NamedTuple):
    """Labels that count for a share of the coefficients; sole: the shutter that they give to the whole picture, if it
    is one."""

    share: float
    labels: np.ndarray
    sole: int | None


def _equal(layers: list[_Layer], others: list[_Layer]) -> bool:
    return len(layers) == len(others) and all(
        one.share == other.share and np.array_equal(one.labels, other.labels)
        for one, other in zip(layers, others, strict=True)
    )


def _sole(labels: np.ndarray) -> int | None:
    """The shutter of all scribbles, if it is one; the first where there is no scribble. It holds everywhere."""
    highest = int(labels.max())
    if highest == scribbles.FREE:
        return 0
    lowest = int((labels - np.uint16(1)).min())  # the lowest shutter: a free pixel's 0 wraps around to 65,535
    return lowest if lowest == highest - 1 else None
