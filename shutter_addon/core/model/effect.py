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
    """How keys shift, turn and scale a region or the camera over time; the default leaves it as it was drawn.

    Attributes:
        location: Channel of the shift (x, y): x in fractions of the picture's width, y of its height, y up.
        rotation: Channel of degrees, counter-clockwise, about the center (Subject.centre).
        scale: Channel of a factor, about the same center.
    """

    location: Channel = field(default=keyframes.Constant((0.0, 0.0)))
    rotation: Channel = field(default=keyframes.Constant(0.0))
    scale: Channel = field(default=keyframes.Constant(1.0))

    @staticmethod
    def keyed(keys: Sequence[tuple[float, Placement, keyframes.Ease]]) -> Moves:
        """Return moves made from keys; without keys, the default Moves, which do nothing.

        Args:
            keys: (frame, placement, ease from this key to the next), by ascending frame.
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
        moves: The subject's placement over time.
        drawings: Strokes; the subject turns and scales about the center of their bounding box. None: it turns and
            scales about the picture's center.
    """

    moves: Moves
    drawings: Drawings | None = None

    def placement(self, frame: float) -> Placement:
        """Return the location, rotation and scale that keys give the subject at a frame, whatever is drawn."""
        return self.moves.at(frame)

    def centre(self, frame: float) -> np.ndarray | None:
        """Return the point about which the subject turns and scales at a frame.

        Returns:
            The point (x, y) in fractions of the picture, y up: the center of the bounding box of the strokes, before
            keys move them. The picture's center, if the subject has no drawings. None, if it has drawings, but no
            strokes at this frame.

        Raises:
            EffectError: The strokes are too far outside the picture.
        """
        if (shape := self._shape) is None:
            return np.array([0.5, 0.5])
        strokes = shape.at(frame)
        return motions.centre(strokes) if strokes else None

    def corners(self, frame: float) -> np.ndarray:
        """Return the corners of the bounding box of the strokes at a frame, after keys have moved them.

        Returns:
            (4, 2), x and y in fractions of the picture, y up, counter-clockwise from the lower left. The corners of the
            picture, if the subject has no drawings. (0, 2), if it has drawings, but no strokes at this frame.

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
        name: The region's name.
        shutter: The index of its shutter in Effect.shutters.
        opacity: Channel of 0 to 1, how strongly the region acts.
        layer: Whether the region is exposed by itself and laid over everything else (core/pixels/layering.py).
        drawings: The region's strokes or curves; None for matte files, masks and ramps.
    """

    name: str = Labelled("Name", "Name of the region").fixed(default="Region", absent="", most=limits.MAX_NAME)
    shutter: int
    opacity: Channel = Labelled("Opacity", "Influence of the region: 0 is like no region").number(
        default=1.0, subtype="FACTOR", always_written=False
    )
    layer: bool = Labelled(
        "Layer", "Expose the region separately, in front of everything else, so that it leaves no ghost"
    ).switch(blender="is_layer")


@dataclass(frozen=True, eq=False, kw_only=True)
class Region(AnyRegion):
    """A region of drawn strokes, which keys can move.

    Attributes:
        kind: Which pixels get the shutter: "line": those that the strokes cover; "lasso": those that they enclose.
        width: Channel of the width of lines, as a fraction of the picture's height; not used for a lasso.
        drawings: The strokes, at the frames where they are drawn.
    """

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
    """A region whose matte says how much of the shutter each pixel gets, 0 to 1.

    `moves` shifts, turns and scales a mattes.Ramp. Any other matte stays where it is (also a ramp of luminance): there,
    `moves` only describes how the object under it moves, for shutters that follow the region. Without drawings, the
    center is the picture's.

    Attributes:
        content: What gives the matte's values: a channel of mattes.Content. In an effect that was just read from a
            recipe, it is no channel but a FileContent or RampContent.
        blend, invert, feather, opacity: As in mattes.Matte; feather and opacity are channels.
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

    `moves` does not move the curves. It describes how the enclosed object moves, for shutters that follow the region.

    Attributes:
        drawings: The curves, at the frames where they are drawn.
        between: How the matte changes from one drawing to the next: "carried": it follows the motion in the footage;
            "straight": the curves' points move in straight lines.
        content: Channel of mattes.FileFrame (stored mattes) if "carried", of mattes.Outline if "straight". In an effect
            that was just read from a recipe, the channel gives None.
    """

    drawings: Drawings
    between: mattes.Between = Labelled("In Between", "How the outline changes between two drawings").choice(
        BETWEEN, default="carried"
    )

    def drawn_at(self, frame: float) -> scribbles.Shape:
        """Return the curves at a frame as a shape of the kind "lasso".

        The shape has no strokes if the matte follows the footage ("carried") and no curves were drawn at exactly this
        frame. With "straight", curves between two drawings are interpolated.

        Raises:
            EffectError: The curves are too far outside the picture.
        """
        has_curves = self.between == "straight" or frame in self.drawings.frames
        strokes = tuple(self.drawings.at(frame)) if has_curves else ()
        return scribbles.Shape(shutter=self.shutter, kind="lasso", width=0.0, strokes=strokes)


@dataclass(frozen=True, eq=False, kw_only=True)
class SubjectRegion(MatteRegion):
    """A region whose matte is a subject (a person, an animal, a thing) that a segmentation model finds under strokes.

    The region's rotation and scale are about the center of `drawings` or, if there are none, of `outlines`.

    Attributes:
        drawings: Strokes on the subject.
        nots: Strokes on what is not the subject (*Not This*).
        outlines: Closed curves around the subject. They overrule the model.
        content: Channel of mattes.FileFrame: the stored mattes that were found. In an effect that was just read from a
            recipe, the channel gives None.
    """

    drawings: Drawings
    nots: Drawings
    outlines: Drawings

    @property
    def _shape(self) -> Drawings:
        return self.drawings if self.drawings.frames else self.outlines

    def drawn_at(self, frame: float) -> scribbles.Shape:
        """Return the strokes on the subject that were drawn at exactly this frame, if any, as a shape of kind "line".

        Raises:
            EffectError: The strokes are too far outside the picture.
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
        path: A movie, a picture, or the first file of an image sequence: absolute, or relative to the recipe's folder.
        channel: What of the file is the matte: "luminance", "red", "green", "blue", "alpha", or the name of a channel
            of an EXR file.
        offset: The matte's frame, from 0, that is shown with the footage's first frame, or for "timeline", at the
            recipe's frame 1, the strip's first.
        timing: "source": the matte plays with the frames of the footage, however these are retimed; "timeline": it
            plays one frame per timeline frame.
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
    """Return a channel of mattes.Ramp: a ramp that keys shift, turn and scale.

    Args:
        kind: The ramp's shape: "linear", "radial" or "angle".
        moves: The ramp's placement over time.
    """

    return keyframes.Computed(lambda frame: mattes.Ramp(kind, moves.at(frame)))


@dataclass(frozen=True)
class Camera(Subject):
    """How the filmed scene moves in the picture because the camera moved, so that shutters can follow that motion.

    `drawings` is None: rotation and scale are about the picture's center.

    Attributes:
        influence: Channel of 0 to 1 by which exposures that follow the camera are shortened: 1 leaves their length, 0
            leaves one frame: the shown one, or the exposed one nearest to it. How closely they follow stays the same.
    """

    influence: Channel = Labelled(
        "Influence", "Length of exposures that follow the camera: 0 exposes only the shown frame"
    ).number(default=1.0, subtype="FACTOR", recipe="camera_influence", always_written=False)


STILL_CAMERA = Camera(Moves())


@dataclass(frozen=True, kw_only=True)
class Shutter:
    """A shutter over time: how much each frame of the window contributes to a pixel, and how they are combined.

    Attributes:
        bars: The contributions, which can change over time: a bar for each filmed frame of the window.
        follow: The region or camera whose motion the exposure follows, so that this looks sharp. None: the exposure
            looks at the same place in all frames.
        follow_motion: Which parts of that motion are followed: "location"; "rotation", which includes location; or
            "scale", which includes both.
        follow_smooth: Frames before and after each frame over which the followed motion is averaged; 0: it is not.
        length: What sets how long the exposure lasts. "frames": the bars. "timeline": one timeline frame. "motion", if
            `follow` is not None: the time in which what is followed moves by `trail`. With the last two, the bars only
            give the shape.
        trail: Channel of a distance, as a fraction of the picture's height; used with the length "motion".
        combine: "average", "lightest", "darkest" or "median" of the exposed frames.
        by_luminance, use_threshold, threshold, softness: Only for "lightest" and "darkest", as in frame_state.Combine;
            the last two are channels, used if `use_threshold` is true.
    """

    name: str = Labelled("Name", "Name of the shutter").fixed(default="Shutter", absent=MISSING, most=limits.MAX_NAME)
    color: tuple[float, float, float] = Labelled("Color", "Color of the shutter's bars, scribbles and matte").fixed(
        default=(0.8, 0.8, 0.8), subtype="COLOR_GAMMA"
    )
    bars: Bars
    follow: Subject | None = None
    follow_motion: motions.Motion = Labelled("Motion", "Part of the motion that the exposure follows").choice(
        MOTIONS, default="scale", context=CONTEXT, always_written=False
    )
    follow_smooth: int = Labelled(
        "Smoothness", "Frames on each side over which the motion is averaged, like that of a heavy camera"
    ).fixed(default=0, most=limits.MAX_SMOOTH, soft_most=24, always_written=False)
    length: Literal["frames", "timeline", "motion"] = Labelled(
        "Exposure Length", "What sets the length of the exposure"
    ).choice(LENGTHS, default="frames", context=CONTEXT, recipe="")
    trail: Channel = Labelled(
        "Distance", "Distance of the motion while the shutter is open, as a fraction of the picture's height"
    ).number(default=0.1, most=limits.MAX_DISTANCE, soft_most=1.0, precision=3, recipe="")
    combine: Mode = Labelled("Combine", "How exposed frames are combined").choice(
        COMBINES, default="average", always_written=False
    )
    by_luminance: bool = Labelled(
        "By Luminance", "Choose one frame per pixel by its luminance, not one per color channel"
    ).switch(always_written=False)
    use_threshold: bool = Labelled(
        "Use Threshold", "Let only light above the threshold leave trails, or with Darkest, below it"
    ).switch(recipe="")
    threshold: Channel = Labelled(
        "Threshold", "Luminance in linear light from which light leaves a trail; white is 1"
    ).number(default=0.5, most=limits.MAX_THRESHOLD, soft_most=1.0, precision=3, recipe="")
    softness: Channel = Labelled("Softness", "Range of luminance around the threshold in which trails fade in").number(
        default=0.1, absent=0.0, most=limits.MAX_THRESHOLD, soft_most=1.0, precision=3, always_written=False
    )

    @property
    def has_trail(self) -> bool:
        """Whether the shutter is open while what it follows moves by `trail`. Its bars then only set the shape."""
        return self.follow is not None and self.length == "motion"

    def spread(self, steps: int, backward: bool = False) -> Callable[[np.ndarray], np.ndarray]:
        """Return a function that spreads bars of filmed frames (L,) over bars of moments (L · steps,).

        Moments are filmed frames, and those that are computed between them. The function keeps the sum of the bars. It
        is shutters.smoothed or, if bars only give the exposure's shape (`length`), shutters.held.

        Args:
            steps: Moments per filmed frame, 1 or an even number.
            backward: Whether the footage plays backward. A filmed frame then is the last of its moments, not the first.
        """
        if self.length == "timeline" or self.has_trail:
            return partial(shutters.held, steps=steps)
        level = self.combine in EXTREMES
        return partial(shutters.smoothed, steps=steps, backward=backward, level=level)

    def filmed(self, moments: ArrayLike, steps: int, position: str) -> shutters.Filmed:
        """Convert bars of moments, which recipes of version 1 have, into bars of filmed frames.

        Moments are filmed frames, and those that are computed between them.

        Args:
            moments: The old bars, (n,).
            steps: Moments per filmed frame.
            position: Options.position, which tells at which end an incomplete window is filled up with zeros.

        Returns:
            The new bars, and which old bars they cannot reproduce, if any (shutters.Filmed).
        """
        return shutters.filmed(moments, steps, position, self.spread(steps))

    def lost(self, keys: Sequence[ArrayLike], steps: int, position: str, interpolation: str) -> EffectError | None:
        """Return a warning if a recipe of version 1 cannot be reproduced: its bars counted moments, not filmed frames.

        Moments are filmed frames, and those that are computed between them. `filmed` converts the bars.

        Args:
            keys: The old bars of moments, (n,) at each key, in order of time.
            steps: Moments per filmed frame.
            position: Options.position.
            interpolation: Options.interpolation. With "value", bars halfway between two keys are checked, too.

        Returns:
            An error to show as a warning, about the first of these bars that would expose other moments than before.
            None: all can be converted without a visible difference.
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
        shutters: The first one is the default, which pixels get where no region gives them another.
        regions: Later regions lie over earlier ones, but all mattes over all scribbles (regions of strokes), and all
            layers (AnyRegion.layer) over both.
        options: Channel of frame_state.Options. Their `edge_aware` is ignored in favor of the channel below.
        time: Channel of (source frame, whether the footage runs backward), where the footage's first frame is 1. None:
            Clip.timing tells which frame is shown.
        edge_aware: Channel of 0 to 1, the value for Options.edge_aware.
        camera: The camera's motion, which shutters can follow.
        lost: A warning that a recipe of an older version cannot be reproduced exactly (Shutter.lost), or None.
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
        """Return the effect of a recipe with the aspect of the pictures, set in Subject.drawings of all regions.

        A recipe does not contain the aspect. It is needed to rotate strokes, as their points are fractions of width and
        height. SubjectRegion.nots and SubjectRegion.outlines keep the aspect that they have.

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
        """Return the bars of a shutter at a frame: (L,) float64, one for each filmed frame of the window.

        Args:
            index: The shutter's index in `shutters`.
            frame: The frame, possibly between two whole ones.

        Raises:
            EffectError: No picture can be made of them (shutters.check_bars).
        """
        bars = self.shutters[index].bars.at(frame, self.options.at(frame).interpolation)
        return self.checked(index, frame, bars)

    def checked(self, index: int, frame: float, bars: np.ndarray) -> np.ndarray:
        """Check bars (L,) and return them as float64.

        Args:
            index: The index of the shutter, whose name the error's message contains.
            frame: The frame at which the shutter has these bars, also for the message.
            bars: The bars to check.

        Raises:
            EffectError: No picture can be made of them (shutters.check_bars).
        """
        try:
            return shutters.check_bars(bars)
        except shutters.ShutterError as error:
            name = self.shutters[index].name
            raise EffectError(_CLOSED, name=name, frame=f"{frame:g}", fault=str(error)) from None
