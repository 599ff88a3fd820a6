"""Render pictures of an effect in four stages: labels, window, coefficients, composition (Renderer.draw).

Labels say which shutter is drawn on which pixel, the window holds the frames that can be exposed, and coefficients say
how much of each shutter a pixel gets. Composition sums the frames of each pixel.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Collection
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..core.caches import LastValue
from ..core.frames.frame_source import FrameSource
from ..core.model import scribbles, windows
from ..core.model.frame_state import FrameState
from ..core.model.mattes import MatteReader
from . import guide
from .cpu import CPUCompositor
from .devices.device import Budget, NoDeviceError
from .gpu import GPUCompositor
from .layered_renderer import LayeredRenderer
from .request import Coefficients, Compositor, Handle, Request

if TYPE_CHECKING:
    from .devices.gl import GLDevice

# Pictures whose frames are decoded in advance, and how many frames or bytes of them lie decoded at most, besides those
# on the device: enough for a long window, whose frames are decoded while its first picture is diffused and compiled.
_AHEAD, _DECODED, _DECODED_BYTES = 4, 8, 256 << 20


def open_compositor(device: str = "gpu") -> Compositor:
    """Open a device, and return the compositor that makes pictures on it.

    Args:
        device: "gpu" for a GPU with OpenGL 4.3, or "cpu" for NumPy.

    Raises:
        NoDeviceError: `device` is "gpu", but OpenGL 4.3 or the package moderngl is missing.
    """
    return CPUCompositor() if device == "cpu" else GPUCompositor(open_gl())


def open_gl(budget: Budget | None = None, ask_others: Callable[[], None] | None = None) -> GLDevice:
    """Create an OpenGL 4.3 context, and return a device that computes on it.

    Args:
        budget: The memory that this device shares with others on the same GPU. None: it gets a budget of its own.
        ask_others: A function that makes other devices free memory, called when the budget is used up. None: none is
            called.

    Raises:
        NoDeviceError: OpenGL 4.3 or the package moderngl is missing.
    """
    try:
        from .devices.gl import GLDevice
    except ImportError as error:  # a package without wheels, or one for another Python
        raise NoDeviceError(f"the Python package moderngl cannot be loaded ({error})") from None
    return GLDevice(budget, ask_others)


class LabelLayer(NamedTuple):
    """One set of labels (which shutter is drawn where). A weighted mean over several sets gives the coefficients.

    Each set is diffused by itself. If no scribble has an opacity between 0 and 1, one set suffices (scribbles.layers).

    Attributes:
        share: The weight of this set, more than 0 and at most 1. The weights of a picture's sets sum to 1.
        labels: (h, w) uint16, one for each block of Options.aggregate pixels a side: 0 where nothing is drawn, 1 +
            index of the shutter that is drawn.
        sole: The index of the shutter that all pixels get from this set, since no other is drawn in it: 0 if nothing is
            drawn. None: several are drawn.
        key: A hashable value that is equal for equal labels and weights.
    """

    share: float
    labels: np.ndarray
    sole: int | None
    key: tuple


class Renderer:
    """Renders pictures of one source.

    For the next picture, it keeps the frames in its window, and the last result of each stage: labels, coefficients,
    picture.

    Attributes:
        compositor: Composes the pictures, on a GPU or with NumPy.
        source: The footage.
        is_short: Whether the device lacks memory for the window, so that every picture sends all its frames again,
            which is slow.
    """

    def __init__(self, compositor: Compositor, source: FrameSource, mattes: MatteReader | None = None) -> None:
        self.compositor, self.source, self._mattes = compositor, source, mattes
        self._stages = compositor.stages()
        self._guides = guide.Guides(source)
        self._layered: LayeredRenderer | None = None
        self._scribbles: Renderer | None = None  # of layers
        self._window: Handle = None
        self._kind: tuple[int, bool, int, bool] | None = None
        self.is_short = False
        self._kept_labels: LastValue[list[LabelLayer]] = LastValue()
        self._kept_diffusion: LastValue[Handle] = LastValue()
        self._kept_mattes: LastValue[Handle] = LastValue()
        self._kept_picture: LastValue[Handle] = LastValue()

    def picture(self, request: Request) -> np.ndarray:
        """Return the picture of a request as an array (H, W, 4), top row first.

        By default it is scene-linear float32, premultiplied. With request.levels it is uint8: sRGB values over black
        with full alpha, as in a movie with Blender's view transform Standard. With request.display it is uint8, too:
        the values that this display shows.
        """
        with self.compositor.current():
            if request.display is not None:
                return self.compositor.shown(self.draw(request), request.display)
            if request.levels and self.source.alpha != "opaque":
                return self.compositor.over_black(self.draw(replace(request, levels=False)))
            return self.compositor.read(self.draw(request))

    def draw(self, request: Request) -> Handle:
        """Return the picture of a request on the device: a texture as from GPUCompositor.draw, or an array with NumPy.

        It is valid until the renderer makes another picture. If the last picture was for an equal request, that one is
        returned.
        """
        if request.state.layers is None and (self._window is None or not self._window.is_open):
            self._kept_picture.clear()
        return self._kept_picture.get(request.key, lambda: self._composed(request), quick=request.quick)

    def _composed(self, request: Request) -> Handle:
        """Return the picture of a request from all stages, and announce to the source which frames come next."""
        wanted_later = self._want(request)
        request = self.slid(request)
        with self.compositor.current():
            drawn = self._with_layers(request) if request.state.layers else self._plain(request)
        self.source.want(wanted_later)
        return drawn

    def _plain(self, request: Request) -> Handle:
        """Return the picture of a request without layers."""
        labels = self.labels(request)
        # The window comes before the coefficients, because it reads the frames that guide the diffusion.
        window = self._loaded_window(request, labels)
        coefficients = self._coefficients(request, labels)
        return self.compositor.draw(window, self._exposing(request, labels), coefficients)

    def _with_layers(self, request: Request) -> Handle:
        """Return the picture of a request whose layers, and the background behind them, are exposed separately."""
        behind = replace(request, state=replace(request.state, layers=None), levels=False)
        labels, shot = self.labels(behind), self.shot(request)
        self._keep_guides(request)
        exposing, coefficients = self._exposing(behind, labels), self._coefficients(behind, labels)
        return self._layering().draw(request, exposing, coefficients, shot, lambda: self._plain(behind))

    def _layering(self) -> LayeredRenderer:
        """Return the LayeredRenderer, which composes pictures with layers. It is made when it is first needed."""
        if self._layered is None:
            mattes = self._mattes and self._mattes.another()
            self._layered = LayeredRenderer(
                self.compositor, self._stages, self.source, self._guides, mattes, self._solved_apart
            )
        return self._layered

    def _solved_apart(self, source: FrameSource, state: FrameState, index: int) -> np.ndarray:
        """Return the coefficients (N, h, w) float32 from which LayerMattes makes the mattes of drawn layers.

        A second renderer computes them, so that this one keeps its own labels and coefficients.

        Args:
            source: The footage. Only the first call's counts.
            state: The item of Layers.scribbles for the source frame.
            index: The source frame.
        """
        if self._scribbles is None:
            self._scribbles = Renderer(self.compositor, source)
        return self._scribbles.coefficients(Request(index, state))

    def coefficients(self, request: Request) -> np.ndarray:
        """Return how much of each shutter a pixel gets, by strokes and mattes but not by layers: (N, h, w) float32.

        There is one value for each block of Options.aggregate pixels a side; h and w are from `grid`.
        """
        self._want(request)  # the picture will read these frames as well
        count, (width, height) = len(request.state.bars), grid(self.source, request.state)
        drawn = self.drawn_coefficients(request)
        with self.compositor.current():
            return np.broadcast_to(self.compositor.coefficients(drawn.handle, count), (count, height, width))

    def drawn_coefficients(self, request: Request) -> Coefficients:
        """Return how much of each shutter a pixel gets (coefficients), without layers, on the device.

        They are valid until the next call of any method.
        """
        labels = self.labels(request)
        with self.compositor.current():
            return self._coefficients(request, labels, len(request.state.bars))

    def coefficients_with_layers(self, request: Request) -> np.ndarray:
        """Return how much of each of the N shutters a pixel gets, including layers: (N, H, W) float32, at each pixel.

        Where a layer's matte is m, the layer's shutter gets m, and what lies beneath keeps 1 − m. A pixel's values sum
        to 1.
        """
        block = request.state.options.aggregate
        whole = self.coefficients(request).repeat(block, 1).repeat(block, 2)
        values = np.maximum(whole[:, : self.source.height, : self.source.width], 0)
        values = values / values.sum(axis=0)
        layers = request.state.layers
        for shutter, matte in zip(layers.shutters if layers else (), self.layer_mattes(request), strict=True):
            values = (1 - matte) * values
            values[shutter] += matte
        return values.astype(np.float32)

    def drawn_with_layers(self, request: Request) -> Coefficients:
        """Return how much of each shutter a pixel gets, with the mattes of layers laid over, on the device.

        They are valid until the next call of any method.
        """
        if request.state.layers is None:
            return self.drawn_coefficients(request)
        values = self.coefficients_with_layers(request)
        with self.compositor.current():
            return Coefficients(self._stages.upload(values), 1)

    def drawn_labels(self, request: Request) -> tuple[Handle, int]:
        """Return which shutter is drawn where, for the preview of scribbles.

        Scribbles of all opacities above 0 count alike.

        Returns:
            The labels on the device (on a GPU a texture array r32ui, top row first): 0 where nothing is drawn, 1 +
            index of the shutter that is drawn. They are valid until the next call of any method. Then the side in
            pixels of the block that shares a label.
        """
        with self.compositor.current():
            return self.compositor.labels(self.labels(request)[0].labels), request.state.options.aggregate

    def labels(self, request: Request) -> list[LabelLayer]:
        """Return which shutter is drawn on which pixel of a picture: the LabelLayers of its scribbles."""
        state, size = request.state, grid(self.source, request.state)
        return self._kept_labels.get((size, state.options.border, state.shapes_key), lambda: labelled(state, size))

    def shot(self, request: Request, *, known: bool = False) -> range:
        """Return the source frames that the window may show: those between the cuts before and after the shown frame.

        Cuts are searched only as far as the picture needs frames. If none is found on one side, the range goes to the
        clip's start or end there. Without Options.stop_at_cuts, or if the source has no cuts, it is the whole clip.

        Args:
            request: The picture.
            known: Use only cuts that were found before, and read no frame to find others.
        """
        index, (low, high), shots = request.index, self._reach(request), self.source.shots
        if shots is None or not request.state.options.stop_at_cuts:
            return range(self.source.count)
        shot = shots.around(index, low, high, known=known)
        moved = windows.slid(request.state, index, request.direction, shot)
        if moved is not request.state:
            first, final = self._reach(replace(request, state=moved))
            return shots.around(index, min(low, first), max(high, final), known=known)
        last = shot.stop - 1
        if request.state.options.edges == "mirror" and (last < high) != (shot.start > low):
            # Frames mirrored at one end of the shot may lie beyond its other end.
            low, high = (min(low, 2 * last - high), high) if last < high else (low, max(high, 2 * shot.start - low))
            shot = shots.around(index, low, high, known=known)
        return shot

    def slid(self, request: Request, *, known: bool = False) -> Request:
        """Return the request with exposures moved into the shot if Options.edges is "slide", else the request itself.

        In the returned request, "slide" is replaced by "hold", for exposures that are longer than the shot.

        Args:
            request: The picture.
            known: As for `shot`.
        """
        if request.state.options.edges != "slide":
            return request
        state = windows.slid(request.state, request.index, request.direction, self.shot(request, known=known))
        return replace(request, state=replace(state, options=replace(state.options, edges="hold")))

    def missing(self, request: Request) -> set[int]:
        """Return the source frames that `draw` would read: to expose them, to guide the diffusion, or to find cuts."""
        held: Collection[int] = ()
        if request.state.layers is not None:
            held = self._layered.held if self._layered else ()
        elif self._window and self._kind == self._kind_for(request):
            held = self._window.held
        request = self.slid(request, known=True)
        if request.state.layers is None:
            request = self._exposing(request, self.labels(request))
        unread, handed, reach, shots = set[int](), set[int](), self._reach(request), self.source.shots
        if shots is not None and request.state.options.stop_at_cuts:
            unread, handed = shots.lacking(request.index, *reach), shots.handed()
        shot = self.shot(request, known=True)
        missing = request.exposed_frames(shot).difference(held)
        missing |= self._guides.lacking(self._guiding(request, shot))
        return (missing | unread) - handed

    def layer_mattes(self, request: Request, frame: int | None = None) -> list[np.ndarray]:
        """Return the matte of each layer of a request, (H, W) float32, 0 … 1, times the layer's opacity.

        The list is empty if the request has no layers.

        Args:
            request: The picture.
            frame: The source frame in which the mattes are made. None: the shown frame of the request.
        """
        if request.state.layers is None:
            return []
        with self.compositor.current():
            return self._layering().mattes.of(request.state.layers, request.index if frame is None else frame)

    def _want(self, request: Request) -> list[int]:
        """Announce to the source which frames this picture and the next few will read: it decodes them early.

        Returns:
            The frames that only the next pictures will read, in order. Announce only these once this picture is made:
            its own frames are on the device by then.
        """
        indices = (request.index + step * request.direction * self.source.step for step in range(_AHEAD + 1))
        shown = (min(max(index, 0), self.source.count - 1) for index in indices)
        lacking = [self.missing(replace(request, index=index)) for index in shown]
        self.source.want(_in_order(self.source, lacking))
        return _in_order(self.source, [frames - lacking[0] for frames in lacking[1:]])

    def _is_guided(self, request: Request) -> bool:
        """Return whether edges in the shown frame affect how much of each shutter a pixel gets.

        They do if scribbles stop at edges, and if they give different shutters to different pixels.
        """
        return request.state.options.edge_aware > 0 and sole_of(self.labels(request)) is None

    def _reach(self, request: Request) -> tuple[int, int]:
        """Return the lowest and the highest frame number that the picture needs, both included.

        The range covers the frames that are exposed, the shown frame, and the frames that guide the diffusion. It may
        go beyond the footage's ends, as windows.positions do.
        """
        low, high = windows.reach(request.state, request.index, request.direction)
        beside = guide.reach(request.state.options.step) if self._is_guided(request) else 0
        return min(low, request.index - beside), max(high, request.index + beside)

    def _guiding(self, request: Request, shot: range) -> tuple[int, ...]:
        """Return the source frames that guide the diffusion (guide.guiding); none if nothing guides it."""
        if not self._is_guided(request):
            return ()
        return guide.guiding(request.index, request.state.options.step, shot)

    def _exposing(self, request: Request, labels: list[LabelLayer]) -> Request:
        """Return a request for the only shutter of the picture if all pixels get the same one, else the request itself.

        Frames that only the other shutters expose are then not read. In the new request this shutter has index 0, and
        there are no scribbles. With any mattes, the request itself is returned.

        Args:
            request: The picture.
            labels: The LabelLayers of the picture's scribbles.
        """
        sole = _sole(request, labels)
        return request if sole is None else replace(request, state=request.state.of([sole]))

    def _loaded_window(self, request: Request, labels: list[LabelLayer]) -> Handle:
        """Return the window with all frames that a picture exposes. A new one is made if the last does not suit."""
        kind = self._kind_for(request)
        if self._window is None or self._kind != kind or not self._window.is_open:
            self._drop_window()
            self._kind = kind
            source = self._layered.recent if self._layered else self.source  # the layers' windows read these frames too
            self._window = self.compositor.window(guide.NotedSource(source, self._guides), *kind)
        self._keep_guides(request)
        exposing = self._exposing(request, labels)
        shot = self.shot(exposing)
        self._window.load(exposing.positions(shot), exposing.state.options, shot)
        self.is_short = self._window.sends
        return self._window

    def _kind_for(self, request: Request) -> tuple[int, bool, int, bool]:
        """Return what kind of window a picture needs: the arguments of Compositor.window after the source.

        Returns:
            The window's length in source frames; whether an exposure follows a motion; the number of shutters; and
            whether all shutters that pixels get average their frames, so that running sums suffice.
        """
        exposing = self._exposing(request, self.labels(request)).state
        return request.state.options.window, exposing.following is not None, len(request.state.bars), exposing.averages

    def _keep_guides(self, request: Request) -> None:
        """Keep the frames that guide the diffusion of this picture and of the next ones."""
        if not request.state.options.edge_aware:
            self._guides.keep(())
        elif self._is_guided(request):  # else this may be a single frame between guided ones
            index, step, (low, high) = request.index, request.state.options.step, self._reach(request)
            beside = guide.reach(step)
            onwards = range(index - beside, high + 1) if request.direction > 0 else range(low, index + beside + 1)
            self._guides.keep(i for i in onwards if i % step == 0 or i == index)

    def _coefficients(self, request: Request, labels: list[LabelLayer], count: int = 1) -> Coefficients:
        """Return how much of each shutter a pixel gets, from strokes and mattes, on the device.

        Args:
            request: The picture.
            labels: The LabelLayers of the picture's scribbles.
            count: The number of shutters in the result if all pixels get the same one. With 1, the result has only that
                shutter, as the request from `_exposing` does. If pixels get different shutters, the result always has
                all of them.
        """
        if (sole := _sole(request, labels)) is not None:
            return self._constant(np.eye(count)[sole if count > 1 else 0])
        return Coefficients(self._with_mattes(request, labels), request.state.options.aggregate)

    def _constant(self, values: np.ndarray) -> Coefficients:
        """Return one set of coefficients (N,) for all pixels, on the device: a block that covers the picture."""
        return Coefficients(self._stages.upload(values[:, None, None]), max(self.source.width, self.source.height))

    def _with_mattes(self, request: Request, labels: list[LabelLayer]) -> Handle:
        """Return how much of each shutter a pixel gets, from strokes with mattes laid over, on the device.

        The result is cached until the mattes or the strokes' coefficients change.

        Args:
            request: The picture.
            labels: The LabelLayers of the picture's scribbles.
        """
        state = request.state
        if not state.mattes or self._mattes is None:
            return self._diffused(request, labels)
        values = self._mattes.values(state.mattes, request.index, state.options.aggregate)
        count, sole = len(state.bars), sole_of(labels)
        if sole is None:
            beneath, below = self._diffused(request, labels), self._kept_diffusion.made
        else:
            beneath, below = self._constant(np.eye(count)[sole]).handle, None
        key = state.mattes, [key for key, _ in values], count, sole, below
        return self._kept_mattes.get(key, lambda: self._stages.blend(beneath, state.mattes, values))

    def _diffused(self, request: Request, labels: list[LabelLayer]) -> Handle:
        """Return how much of each shutter a pixel gets as it spreads from strokes, without mattes, on the device.

        The result is cached until the labels, the guide's frames, its strength or the number of shutters change. A
        result for a quick request may be approximate; it is replaced when a request that is not quick comes.

        Args:
            request: The picture.
            labels: The LabelLayers of the picture's scribbles.
        """
        options, count = request.state.options, len(request.state.bars)
        frames = self._guiding(request, self.shot(request)) if options.edge_aware else ()

        def solve() -> Handle:
            self._keep_guides(request)
            guided = (self._guides.guide(frames, options.aggregate), options.edge_aware) if frames else ()
            return self._solved_layers(labels, count, guided, request.quick)

        key = count, frames and (frames, options.edge_aware), [layer.key for layer in labels]
        return self._kept_diffusion.get(key, solve, quick=request.quick)

    def _solved_layers(self, layers: list[LabelLayer], count: int, guided: tuple, quick: bool) -> Handle:
        """Return how much of each shutter a pixel gets, on the device: the mean over LabelLayers by their shares.

        Args:
            layers: The LabelLayers, whose labels are diffused one by one.
            count: The number of shutters.
            guided: (guide, strength), if edges in the guide stop the diffusion. Else empty.
            quick: Whether the diffusion may start from its last result, which is quicker and slightly inexact. With
                more than one LabelLayer it never does, since the last result would be that of another one.
        """
        if len(layers) == 1:
            return self._stages.solve(layers[0].labels, count, *guided, warm=quick)
        mixed: Handle = None
        solved: Handle
        for layer in layers:
            if layer.sole is None:
                solved = self._stages.solve(layer.labels, count, *guided)
            else:
                solved = self._constant(np.eye(count)[layer.sole]).handle
            mixed = self._stages.add(mixed, solved, layer.share, layer.labels.shape)
        return mixed

    def _drop_window(self) -> None:
        """Free the window."""
        if self._window is not None:
            self._window.release()
            self._window = None
            self.is_short = False
            self._kept_picture.clear()

    def release(self) -> None:
        """Free all memory on the device, and frames kept from the search for cuts. They are read again when needed."""
        with self.compositor.freeing():
            self._drop_window()
            self._stages.release()
            for part in (self._layered, self._scribbles):
                if part is not None:
                    part.release()
        self._guides.keep(())
        for kept in (self._kept_picture, self._kept_diffusion, self._kept_mattes):
            kept.clear()
        if self.source.shots is not None:
            self.source.shots.release()

    def close(self) -> None:
        """Free all memory on the device, and close the source and the files of mattes."""
        self.release()
        for reader in (self._mattes, self._layered):
            if reader is not None:
                reader.close()
        self.source.close()


def _in_order(source: FrameSource, lacking: list[set[int]]) -> list[int]:
    """Return the frames that pictures lack, picture by picture, as many as may be decoded in advance."""
    wanted = dict.fromkeys(i for frames in lacking for i in sorted(frames))
    most = _DECODED_BYTES // (source.width * source.height * 4 * source.dtype.itemsize)
    return list(wanted)[: max(_DECODED, most)]


def _sole(request: Request, labels: list[LabelLayer]) -> int | None:
    """Return the index of the shutter that all pixels get, or None if there are several shutters or any mattes."""
    return None if request.state.mattes else sole_of(labels)


def labelled(state: FrameState, size: tuple[int, int]) -> list[LabelLayer]:
    """Return the LabelLayers of a state's scribbles, one for each of scribbles.layers. `size`: (w, h) of the labels."""
    return [
        _layer(share, scribbles.rasterise(shapes, *size, border=state.options.border))
        for share, shapes in scribbles.layers(state.shapes)
    ]


def grid(source: FrameSource, state: FrameState) -> tuple[int, int]:
    """Return the size (w, h) of the labels and coefficients of a picture.

    They have one value for each block of Options.aggregate × Options.aggregate pixels, also for a part of a block at
    the right and bottom edge.

    Args:
        source: The footage.
        state: The state of the picture.
    """
    block = state.options.aggregate
    return -(-source.width // block), -(-source.height // block)


def sole_of(layers: list[LabelLayer]) -> int | None:
    """Return the index of the shutter that all pixels get from all LabelLayers, or None if there are several."""
    first, *others = layers
    return first.sole if all(layer.sole == first.sole for layer in others) else None


def _layer(share: float, labels: np.ndarray) -> LabelLayer:
    """Return the LabelLayer of labels (h, w) uint16 that count with a share. Find its only shutter and its key."""
    digest = hashlib.blake2b(np.ascontiguousarray(labels), digest_size=16).digest()
    highest = int(labels.max())
    sole: int | None = 0  # without scribbles, the first shutter holds everywhere
    if highest != scribbles.FREE:
        lowest = int((labels - np.uint16(1)).min())  # the lowest shutter: 0 of a free pixel wraps around to 65,535
        sole = lowest if lowest == highest - 1 else None
    return LabelLayer(share=share, labels=labels, sole=sole, key=(share, labels.shape, digest))
