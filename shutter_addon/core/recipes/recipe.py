"""Recipes: the whole effect but the footage, as a JSON file, version 1.

Frames are timeline frames, 1 = the strip's first. Points are fractions of the picture, y up.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, TypeVar

import numpy as np

from ..messages import UserError, sentence
from ..model import combining, effect, keyframes, mattes, motions, shutters
from ..model.frame_state import Edges, Exposure, FrameState, Interpolation, Light, Options, Position
from ..model.keyframes import Ease

Point = tuple[float, float]
Stroke = list[Point]
Factor = Literal[1, 2, 4, 8, 16]
Method = Literal["quick", "good"]


class RecipeError(UserError, ValueError):
    """A recipe that breaks the format; the message is one sentence (core.messages) that begins with the place."""

    def __init__(self, text: str):
        super().__init__(sentence(text))


# What a shutter follows that moves with the camera.
CAMERA = "camera"


@dataclass(frozen=True)
class ValueKey:
    """A number at a frame."""

    frame: float
    value: float
    ease: Ease = "linear"


Keyable = float | list[ValueKey]


@dataclass(frozen=True)
class ShutterKey:
    frame: float
    bars: list[float]
    ease: Ease = "linear"


@dataclass(frozen=True)
class Shutter:
    """Bars, or keys of bars.

    follow: a region's name, or CAMERA
    trail: how far that moves while the shutter is open, in fractions of the picture's height; None: the bars say for
    how many frames it is open
    follow_motion, follow_smooth: as motion and smooth of effect.Shutter
    length: what bars count, source frames or, all of them together, a frame of the timeline
    combine, by_luminance, threshold, softness: as effect.Shutter has them"""

    name: str
    color: tuple[float, float, float] = (0.8, 0.8, 0.8)
    bars: list[float] | None = None
    keys: list[ShutterKey] = field(default_factory=list)
    follow: str | None = None
    trail: Keyable | None = None
    follow_motion: motions.Motion = "scale"
    follow_smooth: int = 0
    length: Literal["bars", "timeline"] = "bars"
    combine: combining.Mode = "average"
    by_luminance: bool = False
    threshold: Keyable | None = None
    softness: Keyable = 0.0

    def over_time(self, follow: effect.Subject | None = None) -> effect.Shutter:
        """As plain data; follow: what is followed, in the same form."""
        return effect.Shutter(
            name=self.name,
            color=self.color,
            bars=self._bars_over_time(),
            follow=follow,
            trail=None if self.trail is None else _numbers(self.trail),
            motion=self.follow_motion,
            smooth=self.follow_smooth,
            timeline=self.length == "timeline",
            combine=self.combine,
            by_luminance=self.by_luminance,
            threshold=None if self.threshold is None else _numbers(self.threshold),
            softness=_numbers(self.softness),
        )

    def _bars_over_time(self) -> keyframes.Bars:
        if not self.keys:
            return keyframes.Bars(keyframes.Constant(np.asarray(self.bars, float)))
        frames, bars, eases = _columns(self.keys, "frame", "bars", "ease")
        keys = tuple(zip(frames, eases, strict=True))
        return keyframes.Bars(keyframes.Keys(frames, bars, eases), keys)


@dataclass(frozen=True)
class RegionKey:
    """Location in fractions of the picture, rotation in degrees counter-clockwise, perhaps a redrawn shape."""

    frame: float
    location: Point = (0.0, 0.0)
    rotation: float = 0.0
    scale: float = 1.0
    strokes: list[Stroke] | None = None
    ease: Ease = "linear"


@dataclass(frozen=True)
class CameraKey:
    """Where what the camera sees lies in the picture, like a region whose centre is the picture's."""

    frame: float
    location: Point = (0.0, 0.0)
    rotation: float = 0.0
    scale: float = 1.0
    ease: Ease = "linear"


def _moves(keys: list[RegionKey] | list[CameraKey]) -> effect.Moves:
    if not keys:
        return effect.Moves()
    frames, eases, *numbers = _columns(keys, "frame", "ease", "location", "rotation", "scale")
    return effect.Moves(*(keyframes.Keys(frames, values, eases) for values in numbers))


M = TypeVar("M", bound=effect.MatteRegion)


class Drawn:
    """What regions have that are drawn. Redrawn shapes follow one another between the keys that carry strokes; a first
    key without any carries the region's own."""

    name: str
    strokes: list[Stroke]
    keys: list[RegionKey]

    def drawings(self) -> list[tuple[RegionKey | None, list[Stroke]]]:
        """The key that starts each drawing, and its strokes, in time."""
        drawn: list[tuple[RegionKey | None, list[Stroke]]]
        drawn = [(key, key.strokes) for key in self.keys if key.strokes is not None]
        if not drawn or self.keys[0].strokes is None:
            drawn.insert(0, (self.keys[0] if self.keys else None, self.strokes))
        return drawn

    def drawings_over_time(self, aspect: float) -> effect.Drawings:
        """As plain data, for a picture of width / height = aspect."""
        drawn = self.drawings()
        return effect.Drawings(
            name=self.name,
            frames=tuple(key.frame if key else 0.0 for key, _ in drawn),
            strokes=tuple([np.asarray(stroke, float) for stroke in strokes] for _, strokes in drawn),
            eases=tuple(key.ease if key else "linear" for key, _ in drawn),
            aspect=aspect,
        )


@dataclass(frozen=True)
class Region(Drawn):
    """A scribble of a shutter.

    layer: whether it is exposed by itself, before what the others make (core.pixels.layering)"""

    shutter: str
    name: str = ""
    kind: Literal["line", "lasso"] = "line"
    width: float = 0.02
    strokes: list[Stroke] = field(default_factory=list)
    keys: list[RegionKey] = field(default_factory=list)
    opacity: Keyable = 1.0
    layer: bool = False

    def over_time(self, shutter: int, aspect: float) -> effect.Region:
        """As plain data, for a picture of width / height = aspect; shutter: the index of its shutter."""
        return effect.Region(
            name=self.name,
            shutter=shutter,
            kind=keyframes.Constant(self.kind),
            width=keyframes.Constant(self.width),
            drawings=self.drawings_over_time(aspect),
            moves=_moves(self.keys),
            opacity=_numbers(self.opacity),
            layer=self.layer,
        )


@dataclass(frozen=True)
class OutlineRegion(Drawn):
    """A region by outlines: its shutter's coefficients are 1 in what closed curves enclose, and 0 elsewhere.

    between: what gives the matte between two drawings, as effect.OutlineRegion has it
    width, invert, blend, opacity, layer: as a MatteRegion's; keys: likewise, and drawings"""

    shutter: str
    kind: Literal["outline"]
    name: str = ""
    strokes: list[Stroke] = field(default_factory=list)
    between: mattes.Between = "carried"
    invert: bool = False
    blend: mattes.Blend = "over"
    opacity: Keyable = 1.0
    width: Keyable = 0.0
    keys: list[RegionKey] = field(default_factory=list)
    layer: bool = False

    def over_time(self, shutter: int, aspect: float, file: mattes.MatteFile) -> effect.OutlineRegion:
        """As Region.over_time; file: what carried mattes are read from."""
        drawings, straight = self.drawings_over_time(aspect), self.between == "straight"
        content = effect.DrawnOutlines(drawings) if straight else mattes.FileFrames(file=file)
        return _matte(effect.OutlineRegion, self, shutter, content, drawings=drawings, between=self.between)


@dataclass(frozen=True)
class MatteRegion:
    """A region by a matte: its values are its shutter's coefficients.

    path: a movie, or the first file of an image sequence; relative to the recipe's folder
    channel: one of CHANNELS, or the name of a channel of an EXR
    timing: whose frames show the matte's, frame by frame: those of the source, or of the timeline
    offset: the matte's frame, from 0, that belongs to the first of these
    blend, opacity: as core.model.mattes.Matte has them; width: its feather
    keys: how what it covers moves; the matte itself is not moved
    layer: as a Region's; then blend counts nothing"""

    shutter: str
    kind: Literal["matte"]
    path: str
    name: str = ""
    channel: str = "luminance"
    invert: bool = False
    offset: int = 0
    timing: Literal["source", "timeline"] = "source"
    blend: mattes.Blend = "over"
    opacity: Keyable = 1.0
    width: Keyable = 0.0
    keys: list[CameraKey] = field(default_factory=list)
    layer: bool = False

    def over_time(self, shutter: int, file: mattes.MatteFile) -> effect.MatteRegion:
        """As plain data; shutter: the index of its shutter, file: what is at its path."""
        first = None if self.timing == "source" else 1
        return _matte(effect.MatteRegion, self, shutter, mattes.FileFrames(file=file, offset=self.offset, first=first))


@dataclass(frozen=True)
class RampRegion:
    """A region by a ramp (core.model.mattes.Ramp), or by the luminance of the shown frame; its other fields are as a
    MatteRegion's, but its keys place the ramp."""

    shutter: str
    kind: Literal["ramp"]
    ramp: Literal["linear", "radial", "angle", "luminance"]
    name: str = ""
    invert: bool = False
    blend: mattes.Blend = "over"
    opacity: Keyable = 1.0
    width: Keyable = 0.0
    keys: list[CameraKey] = field(default_factory=list)
    layer: bool = False

    def over_time(self, shutter: int, file: mattes.MatteFile) -> effect.MatteRegion:
        """As plain data; shutter: the index of its shutter, file: the source's luminance."""
        if self.ramp == "luminance":
            return _matte(effect.MatteRegion, self, shutter, mattes.FileFrames(file=file))
        return _matte(effect.MatteRegion, self, shutter, effect.PlacedRamp(self.ramp, _moves(self.keys)))


def _matte(
    kind: type[M],
    region: OutlineRegion | MatteRegion | RampRegion,
    shutter: int,
    content: keyframes.Channel,
    **drawn: Any,
) -> M:
    return kind(
        name=region.name,
        shutter=shutter,
        content=content,
        blend=region.blend,
        invert=region.invert,
        opacity=_numbers(region.opacity),
        feather=_numbers(region.width),
        moves=_moves(region.keys),
        layer=region.layer,
        **drawn,
    )


CHANNELS = ("luminance", "red", "green", "blue", "alpha")
AnyRegion = Region | OutlineRegion | MatteRegion | RampRegion
# What gives the file of a matte, for a ramp the source's luminance, and for an outline its carried mattes.
MatteFiles = Callable[[OutlineRegion | MatteRegion | RampRegion], mattes.MatteFile]


def _no_file(_region: OutlineRegion | MatteRegion | RampRegion) -> mattes.MatteFile:
    return mattes.NoFile()


KINDS = {"line": Region, "lasso": Region, "outline": OutlineRegion, "matte": MatteRegion, "ramp": RampRegion}


@dataclass(frozen=True)
class Recipe:
    """time: keys of the source frame that is shown, 1 is the source's first; none: the strip's own timing says it."""

    version: Literal[1]
    window: int
    shutters: list[Shutter]
    regions: list[AnyRegion] = field(default_factory=list)
    position: Position = "start"
    interpolation: Interpolation = "displacement"
    light: Light = "linear"
    exposure: Exposure = "normalized"
    edges: Edges = "hold"
    aggregate: Literal[1, 2, 4] = 1
    border: bool = False
    stop_at_cuts: bool = True
    edge_aware: Keyable = 0.0
    plate_reach: int = 48
    decontaminate: bool = True
    inbetween: Factor = 1
    inbetween_method: Method = "quick"
    time: list[ValueKey] = field(default_factory=list)
    camera: list[CameraKey] = field(default_factory=list)
    camera_influence: Keyable = 1.0

    @property
    def options(self) -> Options:
        """The options that have no keys."""
        names = Options.__dataclass_fields__.keys() - {"step", "slid", "edge_aware"}
        return Options(**{name: getattr(self, name) for name in names}, step=self.inbetween)

    def effect(self, aspect: float, files: MatteFiles = _no_file) -> effect.Effect:
        """As plain data, for a picture of width / height = aspect. Frame 1 is the strip's first.

        files: without it, nobody may ask for values of mattes"""
        order = {shutter.name: i for i, shutter in enumerate(self.shutters)}
        regions = tuple(_over_time(region, order[region.shutter], aspect, files) for region in self.regions)
        camera = effect.Camera(_moves(self.camera), _numbers(self.camera_influence))
        followed: dict[str | None, effect.Subject | None] = {region.name: region for region in regions}
        followed |= {CAMERA: camera, None: None}
        return effect.Effect(
            shutters=tuple(shutter.over_time(followed[shutter.follow]) for shutter in self.shutters),
            regions=regions,
            options=keyframes.Constant(self.options),
            time=self._source_time(),
            edge_aware=_numbers(self.edge_aware),
            camera=camera,
        )

    def _source_time(self) -> keyframes.SourceTime | None:
        if not self.time:
            return None
        keys = tuple((key.frame, key.ease) for key in self.time)
        return keyframes.SourceTime(_numbers(self.time), keys)

    def at(self, frame: float, aspect: float, files: MatteFiles = _no_file) -> FrameState:
        """The effect at a timeline frame (1 = the strip's first); aspect, files: as `effect` has them."""
        return self.effect(aspect, files).at(frame)

    def time_at(self, frame: float) -> float | None:
        """The source frame that is shown at a timeline frame, 1 is the first; None: the strip's timing says that."""
        time = self._source_time()
        return None if time is None else time.at(frame)[0]


def _over_time(region: AnyRegion, shutter: int, aspect: float, files: MatteFiles) -> effect.Region | effect.MatteRegion:
    if isinstance(region, Region):
        return region.over_time(shutter, aspect)
    if isinstance(region, OutlineRegion):
        file = files(region) if region.between == "carried" else mattes.NoFile()
        return region.over_time(shutter, aspect, file)
    return region.over_time(shutter, files(region))


def _numbers(value: Keyable) -> keyframes.Channel:
    if not isinstance(value, list):
        return keyframes.Constant(value)
    return keyframes.Keys(*_columns(value, "frame", "value", "ease"))


def _columns(keys: list, *names: str) -> list[tuple]:
    """Of keys, each of these fields as a tuple."""
    return [tuple(getattr(key, name) for key in keys) for name in names]


def with_inbetween(source: Recipe, factor: Factor) -> Recipe:
    """The same effect over another number of in-between frames: its bars stand for the same times.

    RecipeError: they would be too many."""

    def changed(bars: list[float]) -> list[float]:
        return shutters.multiplied(bars, source.inbetween, factor, source.position).tolist()

    try:
        multiplied = [
            replace(
                each, bars=each.bars and changed(each.bars), keys=[replace(k, bars=changed(k.bars)) for k in each.keys]
            )
            for each in source.shutters
        ]
    except shutters.ShutterError:
        window = source.window * factor // source.inbetween
        raise RecipeError(
            f"window: {window} bars for {factor}× in-between frames, the most are {shutters.MAX_WINDOW}"
        ) from None
    window = -(-source.window * factor // source.inbetween)
    return replace(source, window=window, shutters=multiplied, inbetween=factor)


def moved(source: Recipe, old: Path, new: Path) -> Recipe:
    """The same effect for a recipe in another folder: relative paths of mattes lead to the same files."""

    def rebased(region: AnyRegion) -> AnyRegion:
        if not isinstance(region, MatteRegion) or Path(region.path).is_absolute():
            return region
        return replace(region, path=relative(old / region.path, new))

    return replace(source, regions=[rebased(region) for region in source.regions])


def relative(path: Path, folder: Path) -> str:
    """The path of a matte, as a recipe in a folder has it: relative, if there is such a one."""
    with suppress(ValueError):  # on another drive
        way = os.path.relpath(path, folder)
        # ".." leads out of where a linked folder really lies
        if os.path.realpath(os.path.join(folder, way)) == os.path.realpath(path):
            return Path(way).as_posix()
    return Path(os.path.abspath(path)).as_posix()
