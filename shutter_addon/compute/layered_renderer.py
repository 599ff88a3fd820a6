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
    """Composes pictures with layers, and holds the windows and mattes of the layers.

    Args:
        compositor: Composes each layer and the background.
        stages: Lays them over one another.
        source: The footage.
        guides: The guides of the diffusion, which get the frames that are read here.
        mattes: Reads the values of mattes. None: all layers are drawn with strokes.
        solve: Returns the coefficients (N, h, w) float32 of a state (Layers.scribbles) at a frame of a source.
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
        """Return a picture with layers on the device, as Compositor.draw does.

        Args:
            request: The picture.
            behind: The request of the background, without layers.
            coefficients: Those of `behind`.
            shot: The source frames that windows may show.
            plain: Returns the picture without layers, which counts where no layer is in any exposed frame.
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
        """Return the picture of `draw`, which calls this again with smaller windows if it fails.

        Args:
            request, coefficients, shot, plain: As for `draw`.
            parts: The requests of the picture's parts.

        Raises:
            ValueError: A window was freed to make room for others.
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
        """Return the requests of the parts of a picture: the background (−1) and each layer.

        If frames have alpha, each has a second part, whose alpha is its share of the exposure.
        """
        states = [behind.state, *(request.state.of([shutter]) for shutter in layers.shutters)]
        parts = {(i, False): replace(behind, state=state) for i, state in enumerate(states, -1)}
        if self._source.alpha != "opaque":
            for i, state in enumerate(states, -1):
                options = replace(state.options, light="linear", exposure="normalized")
                parts[i, True] = replace(behind, state=replace(state, options=options))
        return parts

    def _window(self, name: tuple[int, bool], part: Request, shutters: int) -> Handle:
        """Return the window of a part, which is made or replaced if it does not fit.

        Args:
            name: The part, a key of Parts.
            part: Its request.
            shutters: The number of shutters of the picture.
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
        """Return a picture (H, W, 4) of the background for where too little of it is exposed, if it is visible there.

        Args:
            request: The picture.
            exposed: The background, and the layers.
            shot: The source frames that windows may show.
            gain: Returns the brightness (H, W) of the background's pixels.

        Returns:
            Behind.plate; None if it is needed nowhere.
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
