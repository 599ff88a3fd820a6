"""The effect as plain data: shutters, regions, options and source time, each a value or a channel over time.

A recipe gives one (core/recipes/recipe_file.py), and so does an effect strip in Blender (blender/data/snapshot.py).
Frames are those of whoever made it: a recipe's count from 1, Blender's are the edit's timeline frames. What each
property is, its field says (fields.py).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ..messages import EffectError
from . import keyframes, limits, mattes, motions, outlines, scribbles, shutters
from .choices import BETWEEN, BLENDS, CHANNELS, COMBINES, CONTEXT, LENGTHS, MOTIONS, RAMPS, TIMINGS
from .fields import MISSING, choice, color, fixed, number, switch
from .frame_state import Combine, FrameState, Mode
from .keyframes import Bars, Channel
from .motions import Placement
from .scribbles import Drawings as Drawings

Length = Literal["frames", "timeline", "motion"]
_CLOSED = 'shutter "{name}" at frame {frame}: {fault}'
OTHER_MOMENTS = (
    'shutter "{name}": bars {first} to {last} of the older file are one filmed frame now, and expose other moments'
)
_TOO_MANY_POINTS = 'region "{name}": more than {most} points with those before it'


@dataclass(frozen=True)
class Moves:
    """Channel of where something lies in the picture.

    location: (2,) fractions of the picture; rotation: degrees counter-clockwise; scale: about its centre"""

    location: Channel = field(default=keyframes.Constant((0.0, 0.0)))
    rotation: Channel = field(default=keyframes.Constant(0.0))
    scale: Channel = field(default=keyframes.Constant(1.0))

    @staticmethod
    def keyed(keys: Sequence[tuple[float, Placement, keyframes.Ease]]) -> Moves:
        """Those of keys: of each its frame, where something lies there, and the ease of the span that it begins."""
        if not keys:
            return Moves()
        frames, placements, eases = zip(*keys, strict=True)
        columns = zip(*((placed.location, placed.rotation, placed.scale) for placed in placements), strict=True)
        return Moves(*(keyframes.Keys(frames, values, eases) for values in columns))

    @property
    def are_keyed(self) -> bool:
        """Whether it may lie elsewhere at another frame."""
        return not all(isinstance(each, keyframes.Constant) for each in (self.location, self.rotation, self.scale))

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


@dataclass(frozen=True, eq=False, kw_only=True)
class AnyRegion(Subject):
    """Where a shutter holds. shutter: its index; layer: core.pixels.layering; drawings: of what is drawn, about whose
    centre it moves; None: it is no drawing, and moves about the picture's"""

    name: str = fixed("Name", "Name of the region", default="Region", absent="", most=limits.MAX_NAME)
    shutter: int
    opacity: Channel = number(
        "Opacity",
        "How much of the region counts: at 0 the picture is as without it",
        default=1.0,
        subtype="FACTOR",
        told=False,
    )
    layer: bool = switch(
        "Layer",
        "Expose the region by itself, before all else, which is exposed without it: it leaves no ghost",
        blender="is_layer",
    )
    drawings: Drawings | None = None

    def centre(self, frame: float) -> np.ndarray | None:
        return self.drawings.centre(frame) if self.drawings else super().centre(frame)

    def corners(self, frame: float) -> np.ndarray:
        return self.drawings.corners(frame, self.placement(frame)) if self.drawings else super().corners(frame)


@dataclass(frozen=True, eq=False, kw_only=True)
class Region(AnyRegion):
    """A scribble of a shutter that moves.

    kind: "line" or "lasso", and width: of its lines, fraction of the picture's height"""

    kind: Channel
    width: Channel = number(
        "Width",
        "Width of the lines as a fraction of the picture's height",
        default=0.02,
        most=limits.MAX_DISTANCE,
        soft_most=0.5,
        keyed_in_recipe=False,
    )
    drawings: Drawings

    def at(self, frame: float) -> scribbles.Shape:
        moved = self.drawings.moved(frame, self.placement(frame))
        kind, width, opacity = (channel.at(frame) for channel in (self.kind, self.width, self.opacity))
        return scribbles.Shape(shutter=self.shutter, kind=kind, width=width, strokes=moved, opacity=float(opacity))


@dataclass(frozen=True, eq=False, kw_only=True)
class MatteRegion(AnyRegion):
    """A region whose shutter gets coefficients by a matte. It moves about the picture's centre: that places a ramp, and
    says of any other matte how what it covers moves.

    content: channel of mattes.Content; feather: of mattes.Matte, as blend, invert and opacity"""

    content: Channel
    blend: mattes.Blend = choice(
        "Blend", "How the matte lies over other regions", BLENDS, default="over", context=CONTEXT
    )
    invert: bool = switch("Invert", "The shutter gets what the matte leaves")
    feather: Channel = number(
        "Feather",
        "How wide a hard edge of the matte becomes, as a fraction of the picture's height",
        default=0.0,
        most=limits.MAX_DISTANCE,
        soft_most=0.2,
        precision=3,
        context=CONTEXT,
        recipe="width",
    )

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
    between: mattes.Between = choice(
        "In Between", "What gives the matte between two drawings", BETWEEN, default="carried"
    )

    def drawn_at(self, frame: float) -> scribbles.Shape:
        """The curves at a frame, as a lasso; between drawings, what is carried has none. EffectError: they are nowhere
        near the picture."""
        has_curves = self.between == "straight" or frame in self.drawings.frames
        strokes = tuple(self.drawings.at(frame)) if has_curves else ()
        return scribbles.Shape(shutter=self.shutter, kind="lasso", width=0.0, strokes=strokes)


@dataclass(frozen=True, eq=False, kw_only=True)
class SubjectRegion(MatteRegion):
    """A region whose matte is a subject that a model finds under strokes. It moves about the strokes' centre.

    drawings: strokes on the subject; nots: strokes on what it is not; outlines: closed curves, which overrule the model
    content: a channel of mattes.FileFrame"""

    drawings: Drawings
    nots: Drawings
    outlines: Drawings

    def drawn_at(self, frame: float) -> scribbles.Shape:
        """The strokes that are drawn at a frame, as lines. EffectError: they are nowhere near the picture."""
        strokes = tuple(self.drawings.at(frame)) if frame in self.drawings.frames else ()
        return scribbles.Shape(shutter=self.shutter, kind="line", width=0.0, strokes=strokes)


def drawn_outlines(drawings: Drawings) -> Channel:
    """Channel of outlines (mattes.Outline) that go straight from one drawing to the next."""
    return keyframes.Computed(lambda frame: mattes.Outline(outlines.curves(drawings.at(frame))))


@dataclass(frozen=True)
class FileContent:
    """Channel of a matte that a recipe names: a path has to be found before anybody reads it (for_picture).

    path: a movie, or the first file of an image sequence, relative to the recipe's folder
    offset: the matte's frame, from 0, that belongs to the source's or the timeline's first"""

    path: str
    channel: str = choice(
        "Channel",
        "What of the matte says how much of the shutter a pixel gets",
        CHANNELS,
        default="luminance",
        recipe="",
    )
    offset: int = fixed(
        "Offset",
        "Frames by which the matte is ahead",
        default=0,
        least=-limits.MAX_FRAME,
        most=limits.MAX_FRAME,
    )
    timing: Literal["source", "timeline"] = choice(
        "Frames Of", "What the matte's frames belong to", TIMINGS, default="source"
    )

    def at(self, _frame: float) -> mattes.FileFrame:
        raise NotImplementedError


@dataclass(frozen=True)
class RampContent:
    """Channel of a ramp that a recipe names, or of the luminance of the shown frame (for_picture)."""

    ramp: Literal["linear", "radial", "angle", "luminance"] = choice(
        "Ramp", "How the ramp runs", RAMPS, default="linear", absent=MISSING
    )

    def at(self, _frame: float) -> mattes.Ramp:
        raise NotImplementedError


def placed_ramp(kind: mattes.RampKind, moves: Moves) -> Channel:
    """Channel of a ramp (mattes.Ramp) that is moved by keys."""

    def at(frame: float) -> mattes.Ramp:
        placed = moves.at(frame)
        return mattes.Ramp(kind=kind, location=placed.location, rotation=placed.rotation, scale=placed.scale)

    return keyframes.Computed(at)


@dataclass(frozen=True)
class Camera(Subject):
    """How what the camera sees moves in the picture, about the picture's centre.

    influence: 0 to 1, what is left of the exposure that follows it: at 0 the shown frame alone"""

    influence: Channel = number(
        "Influence",
        "How much is left of exposures that follow the camera: at 0 the shown frame alone",
        default=1.0,
        subtype="FACTOR",
        recipe="camera_influence",
        told=False,
    )


STILL_CAMERA = Camera(Moves())


@dataclass(frozen=True, kw_only=True)
class Shutter:
    """Bars over time, and what becomes of the frames that they expose.

    follow: what its exposure moves with, None: nothing"""

    name: str = fixed("Name", "Name of the shutter", default="Shutter", absent=MISSING, most=limits.MAX_NAME)
    color: tuple[float, float, float] = color(
        "Color", "Color of the shutter's bars, scribbles and matte", default=(0.8, 0.8, 0.8)
    )
    bars: Bars
    follow: Subject | None = None
    follow_motion: motions.Motion = choice(
        "Motion", "What of its motion is followed", MOTIONS, default="scale", context=CONTEXT, told=False
    )
    follow_smooth: int = fixed(
        "Smoothness",
        "Frames before and after each over which the motion is averaged, as the mass of a camera does: "
        "at 0 it is followed as it is",
        default=0,
        most=limits.MAX_SMOOTH,
        soft_most=24,
        told=False,
    )
    length: Length = choice(
        "Exposure Length", "What says how long the exposure is", LENGTHS, default="frames", context=CONTEXT, recipe=""
    )
    trail: Channel = number(
        "Distance",
        "How far what is followed moves while the shutter is open, as a fraction of the picture's height",
        default=0.1,
        most=limits.MAX_DISTANCE,
        soft_most=1.0,
        precision=3,
        recipe="",
    )
    combine: Mode = choice(
        "Combine", "What the frames that are exposed become", COMBINES, default="average", told=False
    )
    by_luminance: bool = switch(
        "By Luminance",
        "Choose a frame for each pixel, by how light it is there, and not one for each color channel",
        told=False,
    )
    use_threshold: bool = switch(
        "Use Threshold",
        "Let only what is lighter, or of the darkest darker, leave a trail beside what is shown",
        recipe="",
    )
    threshold: Channel = number(
        "Threshold",
        "Luminance of linear light from which on it leaves a trail; white is 1",
        default=0.5,
        most=limits.MAX_THRESHOLD,
        soft_most=1.0,
        precision=3,
        recipe="",
    )
    softness: Channel = number(
        "Softness",
        "Range of luminance, around the threshold, over which a trail fades in",
        default=0.1,
        absent=0.0,
        most=limits.MAX_THRESHOLD,
        soft_most=1.0,
        precision=3,
        told=False,
    )

    @property
    def has_trail(self) -> bool:
        """Whether it is open while what it follows moves by a distance."""
        return self.follow is not None and self.length == "motion"

    def spread(self, steps: int, backward: bool = False) -> Callable[[np.ndarray], np.ndarray]:
        """What makes its bars of moments, so many for each filmed frame, of those of filmed frames."""
        if self.length == "timeline" or self.has_trail:
            return partial(shutters.held, steps=steps)
        level = self.combine in ("lightest", "darkest")
        return partial(shutters.smoothed, steps=steps, backward=backward, level=level)

    def filmed(self, moments: ArrayLike, steps: int, position: str) -> shutters.Filmed:
        """Bars of filmed frames for its bars of moments, which older versions had."""
        return shutters.filmed(moments, steps, position, self.spread(steps))

    def lost(self, keys: Sequence[ArrayLike], steps: int, position: str, interpolation: str) -> EffectError | None:
        """What says that bars of filmed frames do not expose what its bars of moments did, at the first key where they
        do not, or between two where bars fade by themselves; None: they do."""
        fading = [np.add(*pair) / 2 for pair in pairwise(keys)] if interpolation == "value" else []
        for moments in (*keys, *fading):
            if (numbers := self.filmed(moments, steps, position).lost) is not None:
                return EffectError(OTHER_MOMENTS, name=self.name, first=numbers[0], last=numbers[1])
        return None

    def combine_at(self, frame: float) -> Combine:
        threshold = float(self.threshold.at(frame)) if self.use_threshold else None
        return Combine.of(self.combine, self.by_luminance, threshold, float(self.softness.at(frame)))


MatteFiles = Callable[[MatteRegion], mattes.MatteFile]


def _placed(region: Region | MatteRegion, aspect: float, files: MatteFiles) -> Region | MatteRegion:
    """A region of a recipe with what its content is."""
    if region.drawings:
        region = replace(region, drawings=replace(region.drawings, aspect=aspect))
    if isinstance(region, OutlineRegion):
        if region.between == "straight":
            return replace(region, content=drawn_outlines(region.drawings))
        return replace(region, content=mattes.FileFrames(file=files(region)))
    if isinstance(region, SubjectRegion):
        return replace(region, content=mattes.FileFrames(file=files(region)))
    if isinstance(region, MatteRegion) and isinstance(said := region.content, FileContent):
        first = None if said.timing == "source" else 1
        return replace(region, content=mattes.FileFrames(file=files(region), offset=said.offset, first=first))
    if isinstance(region, MatteRegion) and isinstance(said := region.content, RampContent):
        if said.ramp == "luminance":
            return replace(region, content=mattes.FileFrames(file=files(region)))
        return replace(region, content=placed_ramp(said.ramp, region.moves))
    return region


@dataclass(frozen=True)
class Effect:
    """The whole effect but its source.

    shutters: the first is the default
    regions: later ones lie over earlier ones, and all mattes over all scribbles
    options: channel of frame_state.Options, but for
    edge_aware: channel of its own, as its keys are numbers
    camera: which shutters may follow
    lost: what says that a recipe of an older version showed another picture; None: it did not
    time: channel of (source frame, whether it runs backward), the source's first frame is 1; None: the strip's own
    timing tells what is shown"""

    shutters: tuple[Shutter, ...]
    regions: tuple[Region | MatteRegion, ...]
    options: Channel
    time: Channel | None = None
    edge_aware: Channel = number(
        "Follow Edges",
        "How much shutters keep to the edges of the shown frame: at 1 a scribble fills what it lies in",
        default=0.0,
        subtype="FACTOR",
    )
    camera: Camera = STILL_CAMERA
    lost: EffectError | None = None

    def at(self, frame: float) -> FrameState:
        """The effect at a frame. EffectError: no picture can be made of it."""
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

    def with_parts(self, regions: Sequence[Region | MatteRegion], camera: Camera | None = None) -> Effect:
        """The effect with other regions in place of its own, and another camera; what shutters follow goes with it."""
        camera = camera or self.camera
        new: dict[int, Subject] = {id(old): each for old, each in zip(self.regions, regions, strict=True)}
        new[id(self.camera)] = camera
        followed = tuple(shutter.follow and new[id(shutter.follow)] for shutter in self.shutters)
        shutters_ = tuple(replace(s, follow=follow) for s, follow in zip(self.shutters, followed, strict=True))
        return replace(self, shutters=shutters_, regions=tuple(regions), camera=camera)

    def for_picture(self, aspect: float, files: MatteFiles = lambda _region: mattes.NoFile()) -> Effect:
        """The effect of a recipe for a picture of width / height = aspect. files: gives the file of a matte, for a ramp
        the source's luminance, for an outline or a subject its mattes; without it, nobody may ask for their values"""
        return self.with_parts([_placed(region, aspect, files) for region in self.regions])

    def layers_at(self, frame: float) -> list[Region | MatteRegion]:
        """The layers that there are at a frame, the first farthest."""
        return [region for region in self.regions if region.layer and region.opacity.at(frame) > 0]

    def drawn_at(self, frame: float) -> list[scribbles.Shape]:
        """All that is drawn, layers as well, where it is at a frame, in the order of its regions. EffectError: it lies
        nowhere."""
        drawn = [region for region in self.regions if isinstance(region, Region | OutlineRegion | SubjectRegion)]
        return [region.at(frame) if isinstance(region, Region) else region.drawn_at(frame) for region in drawn]

    @cached_property
    def _one_too_many(self) -> str | None:
        """The name of the region whose points are more than there may be with those before it, layers and outlines as
        well; each counts with the drawing that has the most."""
        room = limits.MAX_POINTS
        for region in self.regions:
            if region.drawings:
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
