"""What source frames show of each layer, and of what lies behind all: the frames that windows of layers weigh."""

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from ..core.frames.frame_source import FrameSource
from ..core.frames.planes import as_rgba
from ..core.memo import Kept
from ..core.model.frame_state import Layers, Options
from ..core.pixels import layering
from ..core.pixels.decontamination import separated
from . import plates
from .layer_frames import LayerFrames, LayerMattes, RecentFrames, linear, with_colors

T = TypeVar("T")
# Frames of which both are kept, as several windows load them one after another.
TOGETHER = 4

Motion = tuple[complex, complex]


class LayerColors:
    """Frames with the colours of a layer, in the source's samples, and how much (H, W) float32 each pixel counts.

    source: what is read; recent: the same, with the frames that were read last
    asked: by source frame whose covered places are taken from others, which these are, and how the camera moves there
    """

    def __init__(self, source: FrameSource, recent: RecentFrames, mattes: LayerMattes) -> None:
        self._source, self._recent, self._mattes = source, recent, mattes
        self._kept: Kept[tuple, Any] = Kept()
        self.asked: dict[int, dict[int, Motion]] = {}
        self.begin(None, Options(1), range(0))

    def begin(self, layers: Layers | None, options: Options, shot: range) -> None:
        """What the frames are asked for, until this is called again. shot: the frames that may show what lies behind"""
        self._layers, self._options, self._shot = layers, options, shot
        self._kept.clear()

    @property
    def layers(self) -> Layers:
        if self._layers is None:
            raise ValueError("there are no layers")
        return self._layers

    def changes(self, layer: int) -> tuple:
        """Hashable: what `frames` of a layer, or with −1 of what lies behind all, changes in the source's."""
        return self._separates, self._options.plate_reach if layer < 0 and self._uncovers else None

    def frames(self, layer: int) -> FrameSource:
        """A source of frames with the colours of a layer, or with −1 of what lies behind all layers."""
        if layer < 0 and self._uncovers:
            return LayerFrames(self._source, lambda frame: self._uncovered(frame)[0])
        if self._separates:
            return LayerFrames(self._source, lambda frame: self._separated(frame, layer)[int(layer < 0)])
        return self._source

    def weights(self, layer: int) -> Callable[[int], np.ndarray]:
        """What gives how much of a layer, or of what lies behind all, a frame shows."""
        if layer >= 0:
            return lambda frame: self._mattes.one(self.layers, frame, layer)
        if self._uncovers:
            return lambda frame: self._uncovered(frame)[1]
        return lambda frame: self._mattes.behind(self.layers, frame)

    @property
    def _separates(self) -> bool:
        return self._options.decontaminate and self._source.alpha == "opaque"

    @property
    def _uncovers(self) -> bool:
        return self.layers.camera is not None and self._source.alpha == "opaque"

    def _memo(self, frame: int, name: int | str, make: Callable[[], T]) -> T:
        return self._kept.ask((frame, name), make, TOGETHER * (1 + len(self.layers.shutters)))

    def _separated(self, frame: int, layer: int) -> tuple[np.ndarray, np.ndarray]:
        """A frame with a layer's own colours, and with those behind it; −1: behind all layers."""
        number = 0 if len(self.layers.shutters) == 1 else layer  # behind it is behind all
        return self._memo(frame, number, lambda: self._separate(frame, number))

    def _separate(self, frame: int, number: int) -> tuple[np.ndarray, np.ndarray]:
        mattes = self._mattes.edges(self.layers, frame)
        matte = 1 - layering.behind(mattes) if number < 0 else mattes[number]
        picture, mixed = self._decoded(frame), (matte > 0) & (matte < 1)
        colors = linear(picture, self._source)[..., :3]
        own, behind = (with_colors(picture, c, mixed, self._source) for c in separated(colors, matte))
        return own, behind

    def _decoded(self, frame: int) -> np.ndarray:
        return as_rgba(self._source.decoded(frame))

    def _uncovered(self, frame: int) -> tuple[np.ndarray, np.ndarray]:
        return self._memo(frame, "behind", lambda: self._uncover(frame))

    def _uncover(self, frame: int) -> tuple[np.ndarray, np.ndarray]:
        """What lies behind layers, and how much of it counts. What they cover is taken from other frames where the
        camera's motion is known: of what it pans over, the frames that show it are no mean of all."""
        picture = self._separated(frame, -1)[1] if self._separates else self._decoded(frame)
        seen = self._mattes.behind(self.layers, frame)
        plate, kinds = self._plate(frame, seen < layering.UNCOVERED)
        colors, share = plates.uncovered(linear(picture, self._source)[..., :3], seen, plate, kinds)
        return with_colors(picture, colors, kinds == plates.TAKEN, self._source), share

    def _plate(self, frame: int, covered: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        layers, reach = self.layers, self._options.plate_reach
        near = range(max(frame - reach, self._shot.start), min(frame + reach + 1, self._shot.stop))
        asked = self.asked[frame] = {}
        for old in [old for old in self.asked if abs(old - frame) > 4096]:
            del self.asked[old]

        def motion(other: int) -> Motion:
            asked[other] = self.motion(frame, other)
            return asked[other]

        return plates.plate(
            covered,
            (other for other in plates.nearest_frames(frame, near, self._options.step) if other != frame),
            self.linear_part,
            lambda other: self._mattes.behind(layers, other),
            motion,
        )

    def motion(self, frame: int, other: int) -> Motion:
        """How what the camera sees moves from one frame to another."""
        return self.layers.camera.between(frame, other) if self.layers.camera else (1, 0)

    def linear_part(self, frame: int, part: tuple[slice, slice]) -> np.ndarray:
        """Rows and columns of a frame as it was read, in linear light, premultiplied."""
        return linear(self._recent.read(frame)[part], self._source)

    def clear(self) -> None:
        """Forgets all frames."""
        self._kept.clear()
        self.asked.clear()
