"""Compose pictures with layers: each layer and the background by themselves, which are then laid over one another.

core/pixels/layering.py has the method. Each of them has a window of its own.
"""

from collections.abc import Callable, Collection
from dataclasses import replace
from itertools import pairwise

import numpy as np

from ..core.frames.frame_source import FrameSource
from ..core.model.frame_state import FrameState, Layers
from ..core.model.mattes import MatteReader
from ..core.pixels import layering
from . import layer_frames
from .guide import Guides, NotedSource
from .request import Behind, Coefficients, Compositor, Exposure, Handle, Request, Stages
from .window import summable

# The parts of a picture: {(layer, −1 for what lies behind; whether only weights are composed): request}.
Parts = dict[tuple[int, bool], Request]
# The least of what lies behind layers that must be visible for a plate to be made.
_SEEN = 1 / 1024


class LayeredRenderer:
    """Composes pictures with layers: exposes each layer and the background separately, and lays them over one another.

    It keeps their windows (the frames that can be exposed) and mattes for the next picture.

    Args:
        compositor: Exposes each layer and the background.
        stages: Lays the exposed layers over the background.
        source: The footage.
        guides: Makes the guides of the diffusion. Frames that are read for layers are passed to it.
        mattes: Reads the values of layers' mattes. None: all layers are drawn with strokes.
        solve: Takes a source, a state from Layers.scribbles and a source frame. Returns the coefficients (N, h, w)
            float32 from which the mattes of drawn layers are made.
    """

    def __init__(
        self,
        compositor: Compositor,
        stages: Stages,
        source: FrameSource,
        guides: Guides,
        mattes: MatteReader | None,
        solve: Callable[[FrameSource, FrameState, int], np.ndarray],
    ) -> None:
        self._compositor, self._stages, self._source = compositor, stages, source
        self.recent = layer_frames.RecentFrames(source)
        noted = NotedSource(self.recent, guides)
        self.mattes = layer_frames.LayerMattes(self.recent, lambda *asked: solve(self.recent, *asked), mattes)
        self._colors = layer_frames.LayerColors(noted, self.recent, self.mattes)
        self._layers: Layers | None = None
        self._windows: dict[tuple, Handle] = {}
        self._loaded: dict[tuple[int, int], tuple] = {}  # keys of frames (f, f), and camera motions (f, g)
        self._crowd = 1  # a factor of the memory that each window reserves, to leave room for others

    @property
    def held(self) -> Collection[int]:
        """The source frames that all windows hold."""
        held = [set(window.held) for window in self._windows.values()]
        return set.intersection(*held) if held else ()

    def draw(
        self, request: Request, behind: Request, coefficients: Coefficients, shot: range, plain: Callable[[], Handle]
    ) -> Handle:
        """Return a picture with layers on the device, in the form of Compositor.draw.

        Args:
            request: The picture, whose state has layers.
            behind: The request for the background: the same picture without layers.
            coefficients: How much of each shutter a pixel of the background gets.
            shot: The source frames of the shot, which windows may show.
            plain: Composes the picture without layers. It is called only if the background is not composed from running
                sums: then pixels where no layer is in any exposed frame are taken from that picture, since the
                background's could differ slightly.
        """
        layers = request.state.layers
        assert layers is not None
        parts = self._parts(request, behind, layers)
        self._colors.begin(layers, behind.state.options, shot)
        self._forget_changed(layers)
        self._layers = layers

        for crowd in (2, 8, 1 << 16):
            try:
                return self._composed(request, parts, coefficients, shot, plain)
            except ValueError:
                if all(window.is_open for window in self._windows.values()):
                    raise
            # Windows were freed to make room for others. Try smaller ones, or frames that are sent for each picture.
            self.release_windows()
            self._crowd = max(self._crowd, crowd)
        return self._composed(request, parts, coefficients, shot, plain)

    def _composed(
        self, request: Request, parts: Parts, coefficients: Coefficients, shot: range, plain: Callable[[], Handle]
    ) -> Handle:
        """Compose the picture of `draw` once. `draw` calls this again, with smaller windows, if it fails.

        Args:
            request, coefficients, shot, plain: As for `draw`.
            parts: The requests of the picture's parts, from `_parts`.

        Raises:
            ValueError: The device freed one of the windows to make room for another.
        """
        count = max(layer for layer, _ in parts) + 1
        moves = any(part.state.following is not None for part in parts.values())
        # Without running sums, the picture without layers is composed as well.
        self.recent.windows = self._crowd * (len(parts) + int(moves or not summable(self._source)))
        windows = {name: self._window(name, part, len(request.state.bars)) for name, part in parts.items()}
        self._load(windows, request, shot)
        whole = Coefficients(self._stages.upload(np.ones((1, 1, 1))), max(self._source.width, self._source.height))
        drawn = {}
        for name, part in parts.items():
            own = whole if name[0] >= 0 else coefficients
            drawn[name] = self._compositor.draw(windows[name], replace(part, levels=False), own)
        exposed = [Exposure(drawn[i, False], drawn.get((i, True), drawn[i, False])) for i in range(-1, count)]
        # Where there is no layer, running sums give the bits of the picture without layers. Moments between separated
        # frames differ from it on all devices.
        same = getattr(windows[-1, False], "cover", 0) or self._colors.has_moments
        plate = self._plate(request, exposed, shot, lambda: self._gain(parts[-1, False].state, coefficients))
        bottom = Behind(exposed[0], None if same else plain(), plate)
        return self._stages.lay(bottom, exposed[1:], request.levels)

    def _parts(self, request: Request, behind: Request, layers: Layers) -> Parts:
        """Return a request for each part of a picture: for the background and for each layer.

        Keys are (layer's index or −1 for the background, False). If the source's frames have alpha, each part also has
        a request with True: in its picture, alpha is the share of the exposure time in which the layer or the
        background is visible, whatever the alpha of the frames.

        Args:
            request: The picture.
            behind: The request for the background, as for `draw`.
        """
        states = [behind.state, *(request.state.of([shutter]) for shutter in layers.shutters)]
        parts = {(i, False): replace(behind, state=state) for i, state in enumerate(states, -1)}
        if self._source.alpha != "opaque":
            for i, state in enumerate(states, -1):
                options = replace(state.options, light="linear", exposure="normalized")
                parts[i, True] = replace(behind, state=replace(state, options=options))
        return parts

    def _window(self, name: tuple[int, bool], part: Request, shutters: int) -> Handle:
        """Return the window from which a part of a picture is composed.

        The last window of the part is used again. If it was released, or if the part needs another kind of window
        (other length, motion, mode, threshold or colors), a new one is made, and the part's old ones are released.

        Args:
            name: The part's key in Parts.
            part: The part's request.
            shutters: The number of shutters of the whole picture, which tells how much memory other textures need.
        """
        (layer, alone), moved, options = name, part.state.following is not None, part.state.options
        summed = part.state.averages
        has_threshold = any(combine.threshold is not None for combine in part.state.combines)
        key = layer, alone, moved, options.window, summed, has_threshold, self._colors.changes(layer)
        window = self._windows.get(key)
        if window is None or not window.is_open:
            for other in [other for other in self._windows if other[:2] == name]:
                self._windows.pop(other).release()
            frames, weights = self._colors.frames(layer), self._colors.weights(layer)
            weighted = layer_frames.WeightedFrames(frames, weights, rest=layer < 0, alone=alone, colored=has_threshold)
            window = self._windows[key] = self._compositor.window(weighted, options.window, moved, shutters, summed)
        return window

    def _load(self, windows: dict, request: Request, shot: range) -> None:
        """Load all windows, a few frames at a time, so that each frame is read once for all windows."""
        options, ordered = request.state.options, np.sort(request.positions(shot))
        lacking = request.exposed_frames(shot).difference(self.held)
        step = layer_frames.TOGETHER if len(lacking) > 1 else len(ordered)
        for end in range(step, len(ordered) + step, step):
            for window in windows.values():
                window.load(ordered[:end], options, shot)

    def _forget_changed(self, layers: Layers) -> None:
        """Release the windows if the layers, their mattes in a known frame, or the camera's motion have changed."""
        # Drawn layers lack their scribbles in moments that this picture does not show.
        known = [
            frame
            for frame, drawn, mattes in zip(layers.frames, layers.scribbles, layers.mattes, strict=True)
            if drawn is not None or None not in mattes
        ]
        keys = {(frame, frame): layers.key_at(frame) for frame in known}
        if layers.camera is not None:
            keys |= {pair: layers.camera.between(*pair) for pair in pairwise(layers.frames)}
        has_changed = any(self._loaded.get(name, key) != key for name, key in keys.items())
        if has_changed or (self._layers is not None and len(self._layers.shutters) != len(layers.shutters)):
            self.release_windows()
        self._loaded |= keys
        for name in [name for name in self._loaded if abs(name[0] - layers.first) > 4096]:
            del self._loaded[name]

    def _plate(
        self, request: Request, exposed: list[Exposure], shot: range, gain: Callable[[], np.ndarray]
    ) -> np.ndarray | None:
        """Make a picture of the background for pixels where it shows through the layers, but too little was exposed.

        Holes are taken from the nearest filmed frame of the shot that shows the background there, which may be an
        exposed one. Holes that none shows are filled from their surroundings.

        Args:
            request: The picture.
            exposed: The exposed background, then the exposed layers.
            shot: The source frames of the shot, which are searched.
            gain: Returns the factor for the brightness of the background's pixels, (H, W), or (1, 1) for all.

        Returns:
            The plate (H, W, 4) for Behind.plate, in linear light. None: no pixel needs it.
        """
        layers, (bottom, *own) = request.state.layers, exposed
        if layers is None or self._stages.least_share(bottom) >= layering.CLEAR:
            return None
        holes = self._shares(bottom) < layering.CLEAR
        holes &= layering.behind([self._shares(layer) for layer in own]) > _SEEN
        if not holes.any():
            return None
        picture, kinds = layer_frames.plate(
            holes,
            layer_frames.nearest_frames(request.index, request.state.options, shot),
            self._colors.linear_part,
            lambda frame: self.mattes.behind(layers, frame),
            lambda frame: self._colors.motion(request.index, frame),
        )
        picture[..., :3] *= gain()[..., None]
        if (kinds == layer_frames.FILLED).any():
            shares, is_open = self._shares(bottom), kinds == layer_frames.OPEN
            around = layering.with_plate(self._compositor.read(bottom.color), shares, None)
            # Nothing is known where a layer hides everything.
            known = np.where(is_open, shares >= layering.CLEAR, kinds == layer_frames.TAKEN)
            picture = layer_frames.filled(np.where(is_open[..., None], around, picture), known)
        if self._source.alpha == "opaque":
            picture[..., 3] = 1  # even if nothing is known
        return picture

    def _shares(self, exposed: Exposure) -> np.ndarray:
        """Return the share (H, W) of the exposure that shows a layer, or the background."""
        return self._compositor.read(exposed.share)[..., 3]

    def _gain(self, state: FrameState, coefficients: Coefficients) -> np.ndarray:
        """Return the brightness (H, W) or (1, 1) of the background's pixels, which differs with weighted exposure."""
        if (state.gains == 1).all():
            return np.ones((1, 1))
        values = np.maximum(self._compositor.coefficients(coefficients.handle, len(state.bars)), 0)
        gains = np.einsum("n,nhw->hw", state.gains, values) / values.sum(axis=0)
        whole = gains.repeat(coefficients.block, 0).repeat(coefficients.block, 1) if gains.size > 1 else gains
        return whole[: self._source.height, : self._source.width]

    def release_windows(self) -> None:
        """Free the windows and the frames in them. The next picture reads them again."""
        for window in self._windows.values():
            window.release()
        self._windows.clear()
        self._loaded.clear()
        self._colors.clear()

    def release(self) -> None:
        """Free all memory on the device, and all cached frames."""
        self.release_windows()
        self.recent.clear()

    def close(self) -> None:
        """Close the files of mattes."""
        self.mattes.close()
