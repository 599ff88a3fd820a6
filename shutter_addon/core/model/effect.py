"""The effect as plain data: shutters, regions, options and source time, each a value or a channel over time.

Recipes (core/recipes/recipe_file.py) and effect strips in Blender (blender/data/snapshot.py) both become an `Effect`.
In one from a recipe, frame 1 is the strip's first; in one from Blender, frames are timeline frames. fields.py explains
how the properties are declared.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from itertools import pairwise
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from ..messages import EffectError
from . import keyframes, limits, mattes, motions, outlines, scribbles, shutters
from .choices import BETWEEN, BLENDS, CHANNELS, COMBINES, CONTEXT, LENGTHS, MOTIONS, RAMPS, TIMINGS
from .fields import MISSING, Labelled
from .frame_state import EXTREMES, Combine, FrameState, Mode
from .keyframes import Bars, Channel
from .motions import Placement
from .scribbles import Drawings as Drawings

_CLOSED = 'shutter "{name}" at frame {frame}: {fault}'
OTHER_MOMENTS = (
    'shutter "{name}": bars {first} to {last} of the older file are one filmed frame now, and expose other moments'
)
_TOO_MANY_POINTS = 'region "{name}": more than {most} points together with the regions before it'


@dataclass(frozen=True)
class Moves:
    """The placement of a region or of the camera over time.

    Attributes:
        location: Channel of (x, y) in fractions of the picture, y up.
        rotation: Channel of degrees, counter-clockwise.
        scale: Channel of a factor; it acts about the centre, as rotation does.
    """

    location: Channel = field(default=keyframes.Constant((0.0, 0.0)))
    rotation: Channel = field(default=keyframes.Constant(0.0))
    scale: Channel = field(default=keyframes.Constant(1.0))

    @staticmethod
    def keyed(keys: Sequence[tuple[float, Placement, keyframes.Ease]]) -> Moves:
        """Return moves with keys, or still ones without any.

        Args:
            keys: (frame, placement, ease until the next key), by ascending frame.
        """
        if not keys:
            return Moves()
        frames, placements, eases = zip(*keys, strict=True)
        columns = zip(*((placed.location, placed.rotation, placed.scale) for placed in placements), strict=True)
        return Moves(*(keyframes.Keys(frames, values, eases) for values in columns))

    @property
    def are_keyed(self) -> bool:
        """Whether the placement can change over time."""
        return not all(isinstance(each, keyframes.Constant) for each in (self.location, self.rotation, self.scale))

    def at(self, frame: float) -> Placement:
        x, y = (float(number) for number in self.location.at(frame))
        return Placement((x, y), float(self.rotation.at(frame)), float(self.scale.at(frame)))


@dataclass(frozen=True, eq=False)
class Subject:
    """Something whose motion a shutter can follow: a region, or the camera.

    Attributes:
        moves: Its placement over time.
        drawings: Strokes, about whose centre it turns and scales. None: it does so about the picture's centre.
    """

    moves: Moves
    drawings: Drawings | None = None

    def placement(self, frame: float) -> Placement:
        """Return the location, rotation and scale that keys give the subject at a frame, whatever is drawn."""
        return self.moves.at(frame)

    def centre(self, frame: float) -> np.ndarray | None:
        """Return the point (2,) about which the subject turns and scales, in fractions of the picture.

        This is where it is drawn, before its keys move it. A subject without drawings has the picture's centre.

        Returns:
            The point, or None if there are no strokes at this frame.

        Raises:
            EffectError: The strokes are too far outside the picture.
        """
        if (shape := self._shape) is None:
            return np.array([0.5, 0.5])
        strokes = shape.at(frame)
        return motions.centre(strokes) if strokes else None

    def corners(self, frame: float) -> np.ndarray:
        """Return the corners (4, 2) of the box around the placed subject at a frame, in fractions of the picture.

        Returns:
            An array (0, 2) where nothing is drawn.

        Raises:
            EffectError: The strokes are too far outside the picture.
        """
        if (shape := self._shape) is None:
            return motions.PICTURE
        strokes = shape.moved(frame, self.placement(frame))
        return motions.corners(strokes) if strokes else np.empty((0, 2))

    @property
    def _shape(self) -> Drawings | None:
        return self.drawings


@dataclass(frozen=True, eq=False, kw_only=True)
class AnyRegion(Subject):
    """The base of all regions: a part of the picture that gets a shutter of its own.

    Attributes:
        shutter: The shutter's index.
        layer: Whether it is exposed by itself and laid over everything else (core/pixels/layering.py).
        drawings: Its strokes; None for mattes and ramps.
    """

    name: str = Labelled("Name", "Name of the region").fixed(default="Region", absent="", most=limits.MAX_NAME)
    shutter: int
    opacity: Channel = Labelled("Opacity", "Influence of the region: 0 is like no region").number(
        default=1.0, subtype="FACTOR", told=False
    )
    layer: bool = Labelled(
        "Layer", "Expose the region separately, in front of everything else, so that it leaves no ghost"
    ).switch(blender="is_layer")


@dataclass(frozen=True, eq=False, kw_only=True)
class Region(AnyRegion):
    """A region of drawn strokes. The shutter is for what they cover (kind "line") or enclose ("lasso")."""

    kind: str
    width: Channel = Labelled("Width", "Width of the lines as a fraction of the picture's height").number(
        default=0.02, most=limits.MAX_DISTANCE, soft_most=0.5, keyed_in_recipe=False
    )
    drawings: Drawings

    def at(self, frame: float) -> scribbles.Shape:
        moved = self.drawings.moved(frame, self.placement(frame))
        width, opacity = self.width.at(frame), float(self.opacity.at(frame))
        return scribbles.Shape(shutter=self.shutter, kind=self.kind, width=width, strokes=moved, opacity=opacity)


@dataclass(frozen=True, eq=False, kw_only=True)
class MatteRegion(AnyRegion):
    """A region whose matte says how much of the shutter each pixel gets.

    Keys place a ramp. Any other matte stays where it is; its keys only tell how the covered object moves, for exposures
    that follow it. Rotation and scale are about the picture's centre.

    Attributes:
        content: Channel of mattes.Content. In an effect from a recipe: FileContent or RampContent.
        blend, invert, feather, opacity: See mattes.Matte.
    """

    content: Any
    blend: mattes.Blend = Labelled("Blend", "How the matte combines with other regions").choice(
        BLENDS, default="over", context=CONTEXT
    )
    invert: bool = Labelled("Invert", "Give the shutter the pixels outside of the matte").switch()
    feather: Channel = Labelled(
        "Feather", "Width of the matte's soft edges, as a fraction of the picture's height"
    ).number(default=0.0, most=limits.MAX_DISTANCE, soft_most=0.2, precision=3, context=CONTEXT, recipe="width")

    def at(self, frame: float) -> mattes.Matte:
        """Return the region's matte at a frame."""
        opacity, feather = (float(channel.at(frame)) for channel in (self.opacity, self.feather))
        return mattes.Matte(self.shutter, self.content.at(frame), self.blend, opacity, feather, self.invert)


@dataclass(frozen=True, eq=False, kw_only=True)
class OutlineRegion(MatteRegion):
    """A region whose matte is the inside of closed curves.

    Keys tell how the enclosed object moves, for exposures that follow it. They do not move the curves.

    Attributes:
        drawings: The curves, at the frames where they are drawn.
        between: How the matte changes from one drawing to the next: "carried" follows the footage, "straight" moves the
            curves' points in straight lines.
        content: Channel of mattes.FileFrame or mattes.Outline.
    """

    drawings: Drawings
    between: mattes.Between = Labelled("In Between", "How the outline changes between two drawings").choice(
        BETWEEN, default="carried"
    )

    def drawn_at(self, frame: float) -> scribbles.Shape:
        """Return the curves at a frame as a lasso. A matte that follows the footage has them only where they are drawn.

        Raises:
            EffectError: They are too far outside the picture.
        """
        has_curves = self.between == "straight" or frame in self.drawings.frames
        strokes = tuple(self.drawings.at(frame)) if has_curves else ()
        return scribbles.Shape(shutter=self.shutter, kind="lasso", width=0.0, strokes=strokes)


@dataclass(frozen=True, eq=False, kw_only=True)
class SubjectRegion(MatteRegion):
    """A region whose matte is a subject (a person, an animal, a thing) that a model finds under strokes.

    Its rotation and scale are about the centre of its strokes or, without strokes, of its outlines.

    Attributes:
        drawings: Strokes on the subject.
        nots: Strokes on what is not the subject (*Not This*).
        outlines: Closed curves around the subject. They overrule the model.
        content: Channel of mattes.FileFrame: the mattes that were found.
    """

    drawings: Drawings
    nots: Drawings
    outlines: Drawings

    @property
    def _shape(self) -> Drawings:
        return self.drawings if self.drawings.frames else self.outlines

    def drawn_at(self, frame: float) -> scribbles.Shape:
        """Return the strokes that were drawn at exactly this frame, as a shape of lines.

        Raises:
            EffectError: They are too far outside the picture.
        """
        strokes = tuple(self.drawings.at(frame)) if frame in self.drawings.frames else ()
        return scribbles.Shape(shutter=self.shutter, kind="line", width=0.0, strokes=strokes)


def drawn_outlines(drawings: Drawings) -> Channel:
    """Return a channel of mattes.Outline whose points go straight from drawing to drawing, with the drawings' eases."""
    return keyframes.Computed(lambda frame: mattes.Outline(outlines.curves(drawings.at(frame))))


@dataclass(frozen=True)
class FileContent:
    """A matte file as a recipe names it, before it becomes a channel of mattes.FileFrame.

    Attributes:
        path: A movie, or the first file of an image sequence, relative to the recipe's folder.
        channel: The channel of the file that is the matte.
        offset: The matte's frame, from 0, that belongs to the first frame of the footage or of the timeline.
        timing: Which of these two the matte follows.
    """

    path: str
    channel: str = Labelled("Channel", "Channel of the matte that sets the amount of the shutter").choice(
        CHANNELS, default="luminance", recipe=""
    )
    offset: int = Labelled("Offset", "Number of frames by which the matte plays ahead").fixed(
        default=0, least=-limits.MAX_FRAME, most=limits.MAX_FRAME
    )
    timing: Literal["source", "timeline"] = Labelled(
        "Frames Of", "What the matte's frames are synchronized with"
    ).choice(TIMINGS, default="source")


@dataclass(frozen=True)
class RampContent:
    """A ramp (a gradient) as a recipe names it, before it becomes a channel of mattes.Content."""

    ramp: Literal["linear", "radial", "angle", "luminance"] = Labelled("Ramp", "Shape of the ramp").choice(
        RAMPS, default="linear", absent=MISSING
    )


def placed_ramp(kind: mattes.RampKind, moves: Moves) -> Channel:
    """Return a channel of mattes.Ramp that keys move.

    Args:
        kind: The ramp's shape.
        moves: Where it lies at each frame.
    """

    return keyframes.Computed(lambda frame: mattes.Ramp(kind, moves.at(frame)))


@dataclass(frozen=True)
class Camera(Subject):
    """How the camera's view moves in the picture, about the picture's centre, so that shutters can follow it.

    Attributes:
        influence: Channel of 0 to 1. Exposures that follow the camera are open for this share of their time, at 0 for
            the shown frame only. How closely they follow stays the same.
    """

    influence: Channel = Labelled(
        "Influence", "Length of exposures that follow the camera: 0 exposes only the shown frame"
    ).number(default=1.0, subtype="FACTOR", recipe="camera_influence", told=False)


STILL_CAMERA = Camera(Moves())


@dataclass(frozen=True, kw_only=True)
class Shutter:
    """A shutter over time: how much each frame contributes to a pixel, and how these frames are combined.

    Attributes:
        bars: The frames' contributions over time: a bar for each filmed frame of the window.
        follow: The region or camera with which the exposure moves. None: it stays in its place.
    """

    name: str = Labelled("Name", "Name of the shutter").fixed(default="Shutter", absent=MISSING, most=limits.MAX_NAME)
    color: tuple[float, float, float] = Labelled("Color", "Color of the shutter's bars, scribbles and matte").fixed(
        default=(0.8, 0.8, 0.8), subtype="COLOR_GAMMA"
    )
    bars: Bars
    follow: Subject | None = None
    follow_motion: motions.Motion = Labelled("Motion", "Part of the motion that the exposure follows").choice(
        MOTIONS, default="scale", context=CONTEXT, told=False
    )
    follow_smooth: int = Labelled(
        "Smoothness", "Frames on each side over which the motion is averaged, like that of a heavy camera"
    ).fixed(default=0, most=limits.MAX_SMOOTH, soft_most=24, told=False)
    length: Literal["frames", "timeline", "motion"] = Labelled(
        "Exposure Length", "What sets the length of the exposure"
    ).choice(LENGTHS, default="frames", context=CONTEXT, recipe="")
    trail: Channel = Labelled(
        "Distance", "Distance of the motion while the shutter is open, as a fraction of the picture's height"
    ).number(default=0.1, most=limits.MAX_DISTANCE, soft_most=1.0, precision=3, recipe="")
    combine: Mode = Labelled("Combine", "How exposed frames are combined").choice(
        COMBINES, default="average", told=False
    )
    by_luminance: bool = Labelled(
        "By Luminance", "Choose one frame per pixel by its luminance, not one per color channel"
    ).switch(told=False)
    use_threshold: bool = Labelled(
        "Use Threshold", "Let only light above the threshold leave trails, or with Darkest, below it"
    ).switch(recipe="")
    threshold: Channel = Labelled(
        "Threshold", "Luminance in linear light from which light leaves a trail; white is 1"
    ).number(default=0.5, most=limits.MAX_THRESHOLD, soft_most=1.0, precision=3, recipe="")
    softness: Channel = Labelled("Softness", "Range of luminance around the threshold in which trails fade in").number(
        default=0.1, absent=0.0, most=limits.MAX_THRESHOLD, soft_most=1.0, precision=3, told=False
    )

    @property
    def has_trail(self) -> bool:
        """Whether the shutter is open while what it follows moves by `trail`. Its bars then only set the shape."""
        return self.follow is not None and self.length == "motion"

    def spread(self, steps: int, backward: bool = False) -> Callable[[np.ndarray], np.ndarray]:
        """Return a function that turns bars of filmed frames (L,) into bars of moments (L · steps,).

        Moments are filmed frames, and those made between them.

        Args:
            steps: Moments per filmed frame.
            backward: Whether the footage plays backward.
        """
        if self.length == "timeline" or self.has_trail:
            return partial(shutters.held, steps=steps)
        level = self.combine in EXTREMES
        return partial(shutters.smoothed, steps=steps, backward=backward, level=level)

    def filmed(self, moments: ArrayLike, steps: int, position: str) -> shutters.Filmed:
        """Convert bars of moments, which recipes of version 1 have, into bars of filmed frames.

        Moments are filmed frames, and those made between them.

        Args:
            moments: (n,) bars.
            steps: Moments per filmed frame.
            position: Options.position.
        """
        return shutters.filmed(moments, steps, position, self.spread(steps))

    def lost(self, keys: Sequence[ArrayLike], steps: int, position: str, interpolation: str) -> EffectError | None:
        """Return a warning if bars of filmed frames cannot expose what a recipe of version 1 did with bars of moments.

        Moments are filmed frames, and those made between them.

        Args:
            keys: The bars of moments at each key.
            steps: Moments per filmed frame.
            position: Options.position.
            interpolation: Options.interpolation. With "value", bars halfway between two keys are compared, too.

        Returns:
            A warning about the first difference, or None.
        """
        fading = [np.add(*pair) / 2 for pair in pairwise(keys)] if interpolation == "value" else []
        for moments in (*keys, *fading):
            if (numbers := self.filmed(moments, steps, position).lost) is not None:
                return EffectError(OTHER_MOMENTS, name=self.name, first=numbers[0], last=numbers[1])
        return None

    def combine_at(self, frame: float) -> Combine:
        """Return how the exposed frames are combined at a frame.

        Settings without effect have their defaults, so that two shutters that combine alike compare equal.
        """
        if self.combine not in EXTREMES:
            return Combine(self.combine)
        if not self.use_threshold:
            return Combine(self.combine, self.by_luminance)
        return Combine(self.combine, self.by_luminance, float(self.threshold.at(frame)), float(self.softness.at(frame)))


@dataclass(frozen=True)
class Effect:
    """The whole effect, except for its footage.

    Attributes:
        shutters: The first one is the default, which all pixels get if nothing is drawn.
        regions: Later regions lie over earlier ones, and all mattes lie over all scribbles.
        options: Channel of frame_state.Options. Its `edge_aware` does not count: that has a channel here.
        time: Channel of (source frame, whether the footage runs backward); its first frame is 1. None: the strip's own
            timing counts.
        edge_aware: Channel of Options.edge_aware.
        camera: A subject that shutters can follow.
        lost: A warning that this recipe of an older version cannot look as it did, or None.
    """

    shutters: tuple[Shutter, ...]
    regions: tuple[Region | MatteRegion, ...]
    options: Channel
    time: Channel | None = None
    edge_aware: Channel = Labelled(
        "Follow Edges",
        "How strictly scribbles stop at edges of the shown frame: at 1 they fill the object that they are on",
    ).number(default=0.0, subtype="FACTOR")
    camera: Camera = STILL_CAMERA
    lost: EffectError | None = None

    def at(self, frame: float) -> FrameState:
        """Return the effect's state at a frame, without layers and motion, which state_at.py adds.

        Raises:
            EffectError: No picture can be made of the effect.
        """
        if (name := self._one_too_many) is not None:
            raise EffectError(_TOO_MANY_POINTS, name=name, most=limits.MAX_POINTS)
        options = replace(self.options.at(frame), edge_aware=float(self.edge_aware.at(frame)))
        bars = [self.bars_at(index, frame) for index in range(len(self.shutters))]
        flat = [region for region in self.regions if not region.layer]
        laid = [region.at(frame) for region in flat if isinstance(region, MatteRegion)]
        return FrameState(
            options=options,
            bars=np.stack(bars),
            shapes=tuple(region.at(frame) for region in flat if isinstance(region, Region)),
            mattes=tuple(matte for matte in laid if matte.opacity > 0),
            combines=tuple(shutter.combine_at(frame) for shutter in self.shutters),
        )

    def with_regions(self, regions: Sequence[Region | MatteRegion]) -> Effect:
        """Return the effect with its regions replaced. Shutters that follow a region follow its replacement.

        Args:
            regions: The replacements, one for each region in the same order.
        """
        new: dict[int, Subject] = {id(old): each for old, each in zip(self.regions, regions, strict=True)}
        followed = [each.follow and new.get(id(each.follow), each.follow) for each in self.shutters]
        shutters_ = tuple(replace(each, follow=follow) for each, follow in zip(self.shutters, followed, strict=True))
        return replace(self, shutters=shutters_, regions=tuple(regions))

    def for_picture(self, aspect: float) -> Effect:
        """Return a recipe's effect for pictures of one aspect, which recipes do not know and rotated strokes need.

        Args:
            aspect: The picture's width / height.
        """
        regions = [
            replace(region, drawings=replace(region.drawings, aspect=aspect)) if region.drawings else region
            for region in self.regions
        ]
        return self.with_regions(regions)

    def layers_at(self, frame: float) -> list[Region | MatteRegion]:
        """Return the regions that are visible layers at a frame, the farthest first."""
        return [region for region in self.regions if region.layer and region.opacity.at(frame) > 0]

    def drawn_at(self, frame: float) -> list[scribbles.Shape]:
        """Return the shapes of all drawn regions at a frame, including layers, in the order of the regions.

        Raises:
            EffectError: Strokes are too far outside the picture.
        """
        drawn = [region for region in self.regions if isinstance(region, Region | OutlineRegion | SubjectRegion)]
        return [region.at(frame) if isinstance(region, Region) else region.drawn_at(frame) for region in drawn]

    @cached_property
    def _one_too_many(self) -> str | None:
        """The name of the region with which the sum of drawn points first exceeds limits.MAX_POINTS, or None.

        Each region counts with its largest drawing. Layers and outlines count, too.
        """
        room = limits.MAX_POINTS
        for region in self.regions:
            if region.drawings:
                room -= max((sum(map(len, drawing)) for drawing in region.drawings.strokes if drawing), default=0)
            if room < 0:
                return region.name
        return None

    def bars_at(self, index: int, frame: float) -> np.ndarray:
        """Return the bars (L,) of the shutter with an index, at a frame.

        Raises:
            EffectError: No picture can be made of them (shutters.check_bars).
        """
        bars = self.shutters[index].bars.at(frame, self.options.at(frame).interpolation)
        return self.checked(index, frame, bars)

    def checked(self, index: int, frame: float, bars: np.ndarray) -> np.ndarray:
        """Check bars (L,) and return them as float64.

        Args:
            index: The shutter's index, for the error's message.
            frame: The frame of the bars, for the error's message.
            bars: The bars.

        Raises:
            EffectError: No picture can be made of them (shutters.check_bars).
        """
        try:
            return shutters.check_bars(bars)
        except shutters.ShutterError as error:
            name = self.shutters[index].name
            raise EffectError(_CLOSED, name=name, frame=f"{frame:g}", fault=str(error)) from None
