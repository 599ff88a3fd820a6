"""The effect as plain data: shutters, regions, options and source time, each a value or a channel over time.

A recipe gives one (Recipe.effect), and so does an effect strip in Blender (blender/data/snapshot.py). Frames are those
of whoever made it: a recipe's count from 1, Blender's are the edit's timeline frames.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ..messages import EffectError
from . import combining, keyframes, limits, mattes, motions, outlines, scribbles, shutters
from .frame_state import FrameState
from .keyframes import Bars, Channel
from .motions import Placement

_CLOSED = 'shutter "{name}" at frame {frame}: {fault}'
_TOO_MANY_POINTS = 'region "{name}": more than {most} points with those before it'
_FAR = 'region "{name}": a point of its strokes is nowhere near the picture'


@dataclass(frozen=True)
class Drawings:
    """A region's strokes over time, before it is moved: drawings at ascending frames, each a list of strokes (n, 2); in
    between every stroke goes from one drawing to the next with the ease of the span.

    name: the region's; aspect: the picture's width over its height
    placement: channel of the matrix (3, 3) from the strokes' space to fractions of the picture, or of None where they
    are not on it; without one, strokes are fractions of the picture
    origins: where the region was as each was drawn, which is seen there; none: where it has not moved"""

    name: str
    frames: tuple[float, ...]
    strokes: tuple
    eases: tuple[keyframes.Ease, ...]
    aspect: float
    placement: Channel | None = None
    origins: tuple[Placement, ...] = ()

    @property
    def is_still(self) -> bool:
        """Whether they are known to be the same at every frame."""
        return len(self.frames) < 2 and (self.placement is None or keyframes.are_still(self.placement))

    def at(self, frame: float) -> list[np.ndarray]:
        """Strokes (n, 2) in fractions of the picture. EffectError: a point is nowhere near it (limits.MAX_DISTANCE)."""
        placement = self.placement.at(frame) if self.placement else None
        if not self.frames or (self.placement and placement is None):
            return []
        before, after, share = keyframes.eased_span(self.frames, self.eases, frame)
        first, second = (self._on_picture(index, placement) for index in (before, after))
        return scribbles.between_strokes(first, second, share, self.aspect)

    def moved(self, frame: float, placed: Placement) -> tuple[np.ndarray, ...]:
        """As `at`, moved about the centre of what is drawn."""
        return scribbles.transform(self.at(frame), placed.location, placed.rotation, placed.scale, self.aspect)

    def centre(self, frame: float) -> np.ndarray | None:
        """See Subject."""
        strokes = self.at(frame)
        return motions.centre(strokes) if strokes else None

    def corners(self, frame: float, placed: Placement) -> np.ndarray:
        """See Subject; placed: where it lies at the frame."""
        strokes = self.moved(frame, placed)
        return motions.corners(strokes) if strokes else np.empty((0, 2))

    def drawing(self, index: int, frame: float) -> list[np.ndarray]:
        """The strokes of a drawing as they lie on the picture at a frame; raises as `at`."""
        placement = self.placement.at(frame) if self.placement else None
        return [] if self.placement and placement is None else self._on_picture(index, placement)

    def _on_picture(self, index: int, placement: np.ndarray | None) -> list[np.ndarray]:
        if placement is None:
            return self.strokes[index]
        placed = [scribbles.mapped(placement, points) for points in self.strokes[index]]
        if not all((np.abs(points) <= limits.MAX_DISTANCE).all() for points in placed):
            raise EffectError(_FAR, name=self.name)
        origin = self.origins[index] if self.origins and placed else Placement()
        if origin == Placement():
            return placed
        return list(scribbles.taken_back(placed, origin.location, origin.rotation, origin.scale, self.aspect))


@dataclass(frozen=True)
class Moves:
    """Channel of where something lies in the picture.

    location: (2,) fractions of the picture; rotation: degrees counter-clockwise; scale: about its centre"""

    location: Channel = field(default=keyframes.Constant((0.0, 0.0)))
    rotation: Channel = field(default=keyframes.Constant(0.0))
    scale: Channel = field(default=keyframes.Constant(1.0))

    @property
    def is_still(self) -> bool:
        """Whether it is known to lie there at every frame."""
        return keyframes.are_still(self.location, self.rotation, self.scale)

    def at(self, frame: float) -> Placement:
        x, y = (float(number) for number in self.location.at(frame))
        return Placement((x, y), float(self.rotation.at(frame)), float(self.scale.at(frame)))


@dataclass(frozen=True, eq=False)
class Subject:
    """What the exposure of a shutter may follow: a part of the picture that moves, or all of it."""

    moves: Moves

    def placement(self, frame: float) -> Placement:
        """Its keyed numbers at a frame."""
        return self.moves.at(frame)

    def centre(self, frame: float) -> np.ndarray | None:
        """The point (2,) about which it is turned and scaled, in fractions of the picture; None: nothing is drawn.
        EffectError: its strokes are nowhere near the picture."""
        return np.array([0.5, 0.5])

    def corners(self, frame: float) -> np.ndarray:
        """Those (4, 2) of the box around it as it lies at a frame, in fractions of the picture; (0, 2): nothing is
        drawn. EffectError: its strokes are nowhere near the picture."""
        return motions.PICTURE


@dataclass(frozen=True, eq=False)
class Region(Subject):
    """A scribble of a shutter that moves.

    shutter: index of the shutter; kind: "line" or "lasso", and
    width: of its lines, fraction of the picture's height
    opacity: 0 to 1 (scribbles.layers)
    layer: whether it is exposed by itself (core.pixels.layering)"""

    name: str
    shutter: int
    kind: Channel
    width: Channel
    drawings: Drawings
    opacity: Channel = field(default=keyframes.Constant(1.0))
    layer: bool = False

    @property
    def is_still(self) -> bool:
        """Whether it is known to be the same at every frame."""
        return keyframes.are_still(self.drawings, self.kind, self.width, self.moves, self.opacity)

    def at(self, frame: float) -> scribbles.Shape:
        moved = self.drawings.moved(frame, self.placement(frame))
        kind, width, opacity = (channel.at(frame) for channel in (self.kind, self.width, self.opacity))
        return scribbles.Shape(shutter=self.shutter, kind=kind, width=width, strokes=moved, opacity=float(opacity))

    def centre(self, frame: float) -> np.ndarray | None:
        return self.drawings.centre(frame)

    def corners(self, frame: float) -> np.ndarray:
        return self.drawings.corners(frame, self.placement(frame))


@dataclass(frozen=True, eq=False)
class MatteRegion(Subject):
    """A region whose shutter gets coefficients by a matte. It moves about the picture's centre: that places a ramp, and
    says of any other matte how what it covers moves.

    content: channel of mattes.Content; feather: of mattes.Matte, as blend, invert and opacity
    layer: as a Region's"""

    name: str
    shutter: int
    content: Channel
    blend: mattes.Blend
    invert: bool
    opacity: Channel
    feather: Channel
    layer: bool = False

    @property
    def is_still(self) -> bool:
        """Whether its matte is known to be the same at every frame."""
        return keyframes.are_still(self.content, self.opacity, self.feather)

    def at(self, frame: float) -> mattes.Matte:
        """The matte at a frame."""
        opacity, feather = (float(channel.at(frame)) for channel in (self.opacity, self.feather))
        return mattes.Matte(
            shutter=self.shutter,
            content=self.content.at(frame),
            blend=self.blend,
            opacity=opacity,
            feather=feather,
            invert=self.invert,
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class OutlineRegion(MatteRegion):
    """A region whose matte is what closed curves enclose. It moves about their centre, which says how what they enclose
    moves, and does not move them.

    between: what gives the matte between two drawings: "carried", the footage's own motion, or "straight", curves that
    go from one to the next; content: a channel of mattes.FileFrame or of mattes.Outline"""

    drawings: Drawings
    between: mattes.Between = "carried"

    def drawn_at(self, frame: float) -> scribbles.Shape:
        """The curves at a frame, as a lasso; between drawings, what is carried has none. EffectError: they are nowhere
        near the picture."""
        has_curves = self.between == "straight" or frame in self.drawings.frames
        strokes = tuple(self.drawings.at(frame)) if has_curves else ()
        return scribbles.Shape(shutter=self.shutter, kind="lasso", width=0.0, strokes=strokes)

    def centre(self, frame: float) -> np.ndarray | None:
        return self.drawings.centre(frame)

    def corners(self, frame: float) -> np.ndarray:
        return self.drawings.corners(frame, self.placement(frame))


@dataclass(frozen=True)
class DrawnOutlines:
    """Channel of outlines (mattes.Outline) that go straight from one drawing to the next."""

    drawings: Drawings

    @property
    def is_still(self) -> bool:
        """Whether it is known to be the same at every frame."""
        return self.drawings.is_still

    def at(self, frame: float) -> mattes.Outline:
        return mattes.Outline(outlines.curves(self.drawings.at(frame)))


@dataclass(frozen=True)
class PlacedRamp:
    """Channel of a ramp (mattes.Ramp) that is moved by keys."""

    kind: mattes.RampKind
    moves: Moves

    @property
    def is_still(self) -> bool:
        """Whether it is known to be the same at every frame."""
        return self.moves.is_still

    def at(self, frame: float) -> mattes.Ramp:
        placed = self.moves.at(frame)
        return mattes.Ramp(kind=self.kind, location=placed.location, rotation=placed.rotation, scale=placed.scale)


@dataclass(frozen=True)
class Camera(Subject):
    """How what the camera sees moves in the picture, about the picture's centre.

    influence: 0 to 1, what is left of the exposure that follows it: at 0 the shown frame alone"""

    influence: Channel = field(default=keyframes.Constant(1.0))


STILL_CAMERA = Camera(Moves())


@dataclass(frozen=True)
class Shutter:
    """name, color: RGB display values, 0 to 1; follow: what its exposure moves with, None: nothing
    trail: channel of how far that moves while the shutter is open, in fractions of the picture's height; None: the bars
    say for how many frames it is open
    motion: what of its motion is followed: the location, its rotation too, or its scale as well
    smooth: frames before and after each over which that motion is averaged
    timeline: whether the bars are the shape of the exposure over one frame of the timeline
    combine, by_luminance: as mode and by_luminance of combining.Combine
    threshold, softness: channels of its numbers; None: it has no threshold"""

    name: str
    color: tuple[float, float, float]
    bars: Bars
    follow: Subject | None = None
    trail: Channel | None = None
    motion: motions.Motion = "scale"
    smooth: int = 0
    timeline: bool = False
    combine: combining.Mode = "average"
    by_luminance: bool = False
    threshold: Channel | None = None
    softness: Channel = field(default=keyframes.Constant(0.0))

    def combine_at(self, frame: float) -> combining.Combine:
        threshold = None if self.threshold is None else float(self.threshold.at(frame))
        return combining.Combine.of(self.combine, self.by_luminance, threshold, float(self.softness.at(frame)))


@dataclass(frozen=True)
class Effect:
    """The whole effect but its source.

    shutters: the first is the default
    regions: later ones lie over earlier ones, and all mattes over all scribbles
    options: channel of frame_state.Options, but for
    edge_aware: channel of its own, as its keys are numbers
    camera: which shutters may follow
    time: channel of (source frame, whether it runs backward), the source's first frame is 1; None: the strip's own
    timing tells what is shown"""

    shutters: tuple[Shutter, ...]
    regions: tuple[Region | MatteRegion, ...]
    options: Channel
    time: Channel | None = None
    edge_aware: Channel = field(default=keyframes.Constant(0.0))
    camera: Camera = STILL_CAMERA

    @cached_property
    def is_still(self) -> bool:
        """Whether its state is known to be the same at every frame."""
        bars = (shutter.bars for shutter in self.shutters)
        thresholds = [each for shutter in self.shutters for each in (shutter.threshold, shutter.softness) if each]
        return keyframes.are_still(self.options, self.edge_aware, *bars, *thresholds, *self.regions)

    def at(self, frame: float) -> FrameState:
        """The effect at a frame. EffectError: no picture can be made of it."""
        if self.is_still:
            with suppress(EffectError):  # it is raised below, and names this frame
                return self._still
        return self._state(frame)

    @cached_property
    def _still(self) -> FrameState:
        return self._state(0.0)

    def _state(self, frame: float) -> FrameState:
        if (name := self._one_too_many) is not None:
            raise EffectError(_TOO_MANY_POINTS, name=name, most=limits.MAX_POINTS)
        options = replace(self.options.at(frame), edge_aware=float(self.edge_aware.at(frame)))
        bars = [self.bars_at(index, frame) for index in range(len(self.shutters))]
        drawn = [each for each in self.regions if isinstance(each, Region) and not each.layer]
        mattes_ = [each for each in self.regions if isinstance(each, MatteRegion) and not each.layer]
        laid = [region.at(frame) for region in mattes_]
        seen = tuple(matte for matte in laid if matte.opacity > 0)
        return FrameState(
            options=options,
            bars=np.stack(bars),
            shapes=tuple(region.at(frame) for region in drawn),
            mattes=seen,
            combines=tuple(shutter.combine_at(frame) for shutter in self.shutters),
        )

    def layers_at(self, frame: float) -> list[Region | MatteRegion]:
        """The layers that there are at a frame, the first farthest."""
        return [region for region in self.regions if region.layer and region.opacity.at(frame) > 0]

    def drawn_at(self, frame: float) -> list[scribbles.Shape]:
        """All that is drawn, layers as well, where it is at a frame, in the order of its regions. EffectError: it lies
        nowhere."""
        drawn = [region for region in self.regions if isinstance(region, Region | OutlineRegion)]
        return [region.at(frame) if isinstance(region, Region) else region.drawn_at(frame) for region in drawn]

    @cached_property
    def _one_too_many(self) -> str | None:
        """The name of the region whose points are more than there may be with those before it, layers and outlines as
        well; each counts with the drawing that has the most."""
        room = limits.MAX_POINTS
        for region in self.regions:
            if isinstance(region, Region | OutlineRegion):
                room -= max((sum(map(len, drawing)) for drawing in region.drawings.strokes if drawing), default=0)
            if room < 0:
                return region.name
        return None

    def bars_at(self, index: int, frame: float) -> np.ndarray:
        """Bars (L,) of a shutter at a frame. EffectError: no picture can be made of them."""
        bars = self.shutters[index].bars.at(frame, self.options.at(frame).interpolation)
        return self.checked(index, frame, bars)

    def checked(self, index: int, frame: float, bars: np.ndarray) -> np.ndarray:
        """The bars (L,) of a shutter at a frame. EffectError: no picture can be made of them."""
        try:
            return shutters.check_bars(bars)
        except shutters.ShutterError as error:
            name = self.shutters[index].name
            raise EffectError(_CLOSED, name=name, frame=f"{frame:g}", fault=str(error)) from None
