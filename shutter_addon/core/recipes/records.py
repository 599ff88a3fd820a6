"""Records of a recipe's JSON for cattrs, and their conversion to and from effects.

A record has the fields that the model declares, and special ones: bars, strokes and keys. Frames are timeline frames; 1
is the strip's first. Points are fractions of the picture, y up.
"""

from __future__ import annotations

from dataclasses import dataclass, field, make_dataclass, replace
from functools import partial
from typing import Any, Literal

import numpy as np

from ..model import effect as model
from ..model import keyframes, mattes
from ..model.fields import MISSING, Field, fields_of
from ..model.frame_state import Options
from ..model.keyframes import Channel, Constant, Ease, Keys
from ..model.motions import Placement
from .recipe import CAMERA

VERSION = 2  # the newest that is read; in version 1, bars counted moments between filmed frames
Point = tuple[float, float]
Stroke = list[Point]


@dataclass(frozen=True)
class ValueKey:
    """A number at a frame."""

    frame: float
    value: float
    ease: Ease = "linear"


Keyable = float | list[ValueKey]


@dataclass(frozen=True)
class BarsKey:
    frame: float
    bars: list[float]
    ease: Ease = "linear"


@dataclass(frozen=True)
class MoveKey:
    """A placement: location in fractions of the picture, rotation in degrees counter-clockwise."""

    frame: float
    location: Point = (0.0, 0.0)
    rotation: float = 0.0
    scale: float = 1.0
    ease: Ease = "linear"


@dataclass(frozen=True)
class RegionKey(MoveKey):
    """A placement, and optionally new strokes."""

    strokes: list[Stroke] | None = None


def _type_of(each: Field) -> Any:
    """Return the type of a field's value in a recipe."""
    if each.choices:
        return Literal[each.words]
    if isinstance(each.default, tuple):
        return tuple[float, float, float]
    return Keyable if each.keyed_in_recipe else type(each.default)


def _record(name: str, kinds: tuple[type, ...], **special: tuple[Any, Any]) -> type:
    """Build a record class.

    Args:
        kinds: Classes of the model whose fields the record has; the first becomes its `model`.
        special: More fields, each with its type and default.
    """
    said: dict[str, Any] = {name: special[name] for name in ("version", "kind") if name in special}
    said |= {each.recipe: (_type_of(each), each.absent) for each in fields_of(*kinds).values() if each.recipe} | special
    columns: list[Any] = []
    for word, (kind, default) in said.items():
        if default is MISSING:
            columns.append((word, kind))
        else:
            columns.append((word, kind, field(default_factory=partial(_new, default))))
    return make_dataclass(name, columns, namespace={"model": kinds[0]}, frozen=True, kw_only=True)


def _new(default: Any) -> Any:
    return list(default) if isinstance(default, list) else default


ShutterRecord: Any = _record(
    "ShutterRecord",
    (model.Shutter,),
    bars=(list[float] | None, None),
    keys=(list[BarsKey], []),
    follow=(str | None, None),
    trail=(Keyable | None, None),
    length=(Literal["bars", "timeline"], "bars"),
    threshold=(Keyable | None, None),
)
_OF_REGION: dict[str, Any] = {"shutter": (str, MISSING)}
_DRAWN: dict[str, Any] = _OF_REGION | {"strokes": (list[Stroke], []), "keys": (list[RegionKey], [])}
_LAID: dict[str, Any] = _OF_REGION | {"keys": (list[MoveKey], [])}
RegionRecord: Any = _record("RegionRecord", (model.Region,), kind=(Literal["line", "lasso"], "line"), **_DRAWN)
OutlineRecord: Any = _record("OutlineRecord", (model.OutlineRegion,), kind=(Literal["outline"], MISSING), **_DRAWN)
MatteRecord: Any = _record(
    "MatteRecord",
    (model.MatteRegion, model.FileContent),
    kind=(Literal["matte"], MISSING),
    path=(str, MISSING),
    channel=(str, "luminance"),
    **_LAID,
)
RampRecord: Any = _record(
    "RampRecord", (model.MatteRegion, model.RampContent), kind=(Literal["ramp"], MISSING), **_LAID
)
KINDS = {
    "line": RegionRecord,
    "lasso": RegionRecord,
    "outline": OutlineRecord,
    "matte": MatteRecord,
    "ramp": RampRecord,
}
# cattrs chooses one of KINDS by the field `kind`.
AnyRegionRecord: Any = RegionRecord | OutlineRecord | MatteRecord | RampRecord
RecipeRecord: Any = _record(
    "RecipeRecord",
    (Options, model.Effect, model.Camera),
    version=(Literal[1, 2], MISSING),
    shutters=(list[ShutterRecord], MISSING),
    regions=(list[AnyRegionRecord], []),
    time=(list[ValueKey], []),
    camera=(list[MoveKey], []),
)


def effect_of(recipe: Any) -> model.Effect:
    """Return the effect of a checked recipe. `Effect.for_picture` completes it."""
    options = Options(**_values(Options, recipe))
    order = {shutter.name: index for index, shutter in enumerate(recipe.shutters)}
    regions = tuple(_region(region, order[region.shutter]) for region in recipe.regions)
    camera = model.Camera(moves=_moves(recipe.camera), **_values(model.Camera, recipe))
    followed: dict[str | None, model.Subject | None] = {region.name: region for region in regions}
    followed |= {CAMERA: camera, None: None}
    time = None
    if recipe.time:
        time = keyframes.SourceTime(_channel(recipe.time), tuple((key.frame, key.ease) for key in recipe.time))
    effect = model.Effect(
        shutters=tuple(_shutter(shutter, followed[shutter.follow]) for shutter in recipe.shutters),
        regions=regions,
        options=Constant(options),
        time=time,
        camera=camera,
        **_values(model.Effect, recipe),
    )
    return _filmed(effect, options) if recipe.version == 1 and options.step > 1 else effect


def _filmed(effect: model.Effect, options: Options) -> model.Effect:
    """Convert an effect of version 1, whose bars counted moments between filmed frames."""
    steps, position, lost = int(options.step), options.position, []
    shutters = []
    for shutter in effect.shutters:
        channel = shutter.bars.channel
        values = channel.values if isinstance(channel, Keys) else (channel.at(1),)
        lost.append(shutter.lost(values, steps, position, options.interpolation))
        made = tuple(shutter.filmed(moments, steps, position).bars for moments in values)
        counted = replace(channel, values=made) if isinstance(channel, Keys) else Constant(made[0])
        shutters.append(replace(shutter, bars=replace(shutter.bars, channel=counted)))
    options = replace(options, window=-(-options.window // steps))
    return replace(effect, shutters=tuple(shutters), options=Constant(options), lost=next(filter(None, lost), None))


def _values(kind: type, record: Any) -> dict[str, Any]:
    """Return a record's values for the fields of a class, by the model's names."""
    said = {name: (each, getattr(record, each.recipe)) for name, each in fields_of(kind).items() if each.recipe}
    return {name: _channel(value) if each.is_channel else value for name, (each, value) in said.items()}


def _channel(value: Keyable) -> Channel:
    return Keys(*_columns(value, "frame", "value", "ease")) if isinstance(value, list) else Constant(value)


def _columns(keys: list, *names: str) -> list[tuple]:
    """Return the named fields of keys, each as a tuple."""
    return [tuple(getattr(key, name) for key in keys) for name in names]


def _shutter(record: Any, follow: model.Subject | None) -> model.Shutter:
    values = _values(model.Shutter, record) | {"length": "frames" if record.length == "bars" else record.length}
    if record.trail is not None:
        values |= {"length": "motion", "trail": _channel(record.trail)}
    if record.threshold is not None:
        values |= {"use_threshold": True, "threshold": _channel(record.threshold)}
    else:
        del values["softness"]  # has no meaning without a threshold
    if record.keys:
        frames, bars, eases = _columns(record.keys, "frame", "bars", "ease")
        made = tuple(map(np.array, bars))
        exposed = keyframes.Bars(Keys(frames, made, eases), tuple(zip(frames, eases, strict=True)))
    else:
        exposed = keyframes.Bars(Constant(np.array(record.bars)))
    return model.Shutter(bars=exposed, follow=follow, **values)


def _moves(keys: list) -> model.Moves:
    return model.Moves.keyed([(key.frame, Placement(key.location, key.rotation, key.scale), key.ease) for key in keys])


def _region(record: Any, shutter: int) -> model.Region | model.MatteRegion:
    values: dict[str, Any] = _values(record.model, record) | {"shutter": shutter, "moves": _moves(record.keys)}
    if isinstance(record, RegionRecord | OutlineRecord):
        values["drawings"] = _drawings(record)
    if isinstance(record, RegionRecord):
        values["kind"] = Constant(record.kind)
    elif isinstance(record, OutlineRecord):
        values["content"] = mattes.FileFrames(file=mattes.NoFile())  # Effect.for_picture sets the file
    elif isinstance(record, MatteRecord):
        file = {"path": record.path, "channel": record.channel}
        values["content"] = model.FileContent(**file, **_values(model.FileContent, record))
    else:
        values["content"] = model.RampContent(ramp=record.ramp)
    return record.model(**values)


def drawings_of(record: Any) -> list[tuple[RegionKey | None, list[Stroke]]]:
    """Return a region's drawings in time, each as the key that starts it and its strokes.

    The region's own strokes are the first drawing, unless its first key has strokes.
    """
    drawn: list = [(key, key.strokes) for key in record.keys if key.strokes is not None]
    if not drawn or record.keys[0].strokes is None:
        drawn.insert(0, (record.keys[0] if record.keys else None, record.strokes))
    return drawn


def _drawings(record: Any) -> model.Drawings:
    drawn = drawings_of(record)
    return model.Drawings(
        name=record.name,
        frames=tuple(key.frame if key else 0.0 for key, _ in drawn),
        strokes=tuple([np.asarray(stroke, float) for stroke in strokes] for _, strokes in drawn),
        eases=tuple(key.ease if key else "linear" for key, _ in drawn),
        aspect=1.0,
    )


def recipe_of(effect: model.Effect) -> Any:
    """Return the record of an effect with constant or keyed channels and unique names of shutters."""
    options, names = effect.options.at(1), [shutter.name for shutter in effect.shutters]
    return RecipeRecord(
        version=VERSION,
        shutters=[_shutter_record(shutter) for shutter in effect.shutters],
        regions=[_region_record(region, names[region.shutter]) for region in effect.regions],
        time=_keyable(effect.time.numbers) if isinstance(effect.time, keyframes.SourceTime) else [],
        camera=[MoveKey(**key) for key in _move_keys(effect.camera.moves)],
        **_words(Options, options),
        **_words(model.Effect, effect),
        **_words(model.Camera, effect.camera),
    )


def _words(kind: type, part: Any) -> dict[str, Any]:
    """Return the recipe's fields for an object of a class; the inverse of `_values`."""
    said = {each.recipe: (each, getattr(part, name)) for name, each in fields_of(kind).items() if each.recipe}
    return {word: _keyable(value) if each.is_channel else value for word, (each, value) in said.items()}


def _keyable(channel: Channel) -> Keyable:
    if isinstance(channel, Keys):
        return [ValueKey(*key) for key in zip(channel.frames, channel.values, channel.eases, strict=True)]
    return float(channel.at(1))


def _shutter_record(shutter: model.Shutter) -> Any:
    said = _words(model.Shutter, shutter)
    if isinstance(shutter.follow, model.AnyRegion):
        said["follow"] = shutter.follow.name
    elif shutter.follow:
        said["follow"] = CAMERA
    if shutter.length == "timeline":
        said["length"] = "timeline"
    if shutter.has_trail:
        said["trail"] = _keyable(shutter.trail)
    if shutter.use_threshold:
        said["threshold"] = _keyable(shutter.threshold)
    else:
        del said["softness"]
    bars = shutter.bars.channel
    if isinstance(bars, Keys):
        keys = zip(bars.frames, bars.values, bars.eases, strict=True)
        said["keys"] = [BarsKey(frame, each.tolist(), ease) for frame, each, ease in keys]
    else:
        said["bars"] = bars.at(1).tolist()
    return ShutterRecord(**said)


def _move_keys(moves: model.Moves) -> list[dict[str, Any]]:
    """Return the fields of the keys of `moves`."""
    names, channels = ("location", "rotation", "scale"), (moves.location, moves.rotation, moves.scale)
    if not isinstance(moves.location, Keys):
        return []
    columns = zip(moves.location.frames, moves.location.eases, *(each.values for each in channels), strict=True)  # type: ignore[attr-defined]
    return [{"frame": frame, "ease": ease} | dict(zip(names, key, strict=True)) for frame, ease, *key in columns]


def _points(stroke: np.ndarray) -> Stroke:
    return [(x, y) for x, y in stroke.tolist()]


def _region_record(region: Any, shutter: str) -> Any:
    said = _words(type(region), region) | {"shutter": shutter}
    keys = _move_keys(region.moves)
    if isinstance(region, model.Region | model.OutlineRegion):
        frames = region.drawings.frames
        drawings = [[_points(stroke) for stroke in drawing] for drawing in region.drawings.strokes]
        # The region carries the first drawing; keys carry the others.
        drawn = dict(zip(frames, drawings, strict=True)) if len(frames) > 1 else {}
        if keys and keys[0]["frame"] == frames[0]:
            drawn.pop(frames[0], None)
        said["strokes"] = drawings[0]
        said["keys"] = [RegionKey(strokes=drawn.get(key["frame"]), **key) for key in keys]
        if isinstance(region, model.Region):
            return RegionRecord(kind=region.kind.at(1), **said)
        return OutlineRecord(kind="outline", **said)
    said |= {"keys": [MoveKey(**key) for key in keys]} | _words(type(region.content), region.content)
    if isinstance(region.content, model.RampContent):
        return RampRecord(kind="ramp", **said)
    return MatteRecord(kind="matte", path=region.content.path, channel=region.content.channel, **said)
