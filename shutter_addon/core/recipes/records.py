"""The records (dataclasses) that cattrs makes of a recipe's JSON, and their conversion to and from effects.

A record has the fields that the model declares, and special ones: bars, strokes and keys. Frames are timeline frames; 1
is the strip's first. Points are fractions of the picture, y up.
"""

import math
from collections.abc import Iterable
from copy import copy
from dataclasses import asdict, dataclass, field, make_dataclass, replace
from functools import cache, partial
from typing import Annotated, Any, Literal, NamedTuple, get_args

import numpy as np

from ..model import effect as model
from ..model import keyframes, limits
from ..model.fields import MISSING, Field, fields_of
from ..model.frame_state import EXTREMES, Options
from ..model.keyframes import Channel, Constant, Ease, Keys
from ..model.motions import Placement
from .recipe import CAMERA

VERSION = 2  # the newest that is read; in version 1, bars counted moments between filmed frames


class Within(NamedTuple):
    """The range of a number, or of the length of a text or a list, for Annotated[type, Within(…)].

    Attributes:
        least, most: The smallest and the largest allowed value.
        empty: The error message for an empty text or list, if `least` forbids that.
    """

    least: float
    most: float
    empty: str = "empty"


def around(most: float) -> Within:
    """Return the range from −most to most."""
    return Within(-most, most)


_NO_KEY = "empty: there is no key"
_KEYS = Within(0, limits.MAX_KEYS)
Frame = Annotated[float, around(limits.MAX_FRAME)]
_SHARE = Annotated[float, Within(0, 1)]
Coordinate = Annotated[float, around(limits.MAX_DISTANCE)]
Point = tuple[Coordinate, Coordinate]
Stroke = Annotated[list[Point], Within(1, math.inf, "empty: a stroke has at least one point")]


@dataclass(frozen=True)
class ValueKey:
    """A key of a number over time, in a recipe.

    Attributes:
        frame: The timeline frame of the key; 1 is the strip's first.
        value: The number at this frame.
        ease: How the number changes from this key to the next one.
    """

    frame: Frame
    value: float
    ease: Ease = "linear"


@cache
def _keys(least: float, most: float, fewest: int = 0) -> Any:
    """Make the type of a list of ValueKeys with a range for their values, for cattrs.

    Args:
        least, most: The smallest and the largest allowed value of a key.
        fewest: How many keys there must be at least.

    Returns:
        A type Annotated[list[…], Within(…)].
    """
    value, count = ("value", Annotated[float, Within(least, most)]), Within(fewest, limits.MAX_KEYS, _NO_KEY)
    return Annotated[list[make_dataclass("ValueKey", [value], bases=(ValueKey,), frozen=True)], count]  # type: ignore[misc]


@dataclass(frozen=True)
class BarsKey:
    """A key of a shutter's bars over time, in a recipe.

    Attributes:
        frame: The timeline frame of the key; 1 is the strip's first.
        bars: The weights of the frames that the shutter exposes, one for each of the recipe's `window` frames.
        ease: How the bars change from this key to the next one.
    """

    frame: Frame
    bars: list[float]
    ease: Ease = "linear"


@dataclass(frozen=True)
class MoveKey:
    """A key of the placement of a region or the camera over time, in a recipe.

    Attributes:
        frame: The timeline frame of the key; 1 is the strip's first.
        location: How far it is shifted: x as a fraction of the picture's width, y of its height, y up.
        rotation: How far it is turned about its center, in degrees counter-clockwise.
        scale: The factor by which it is enlarged about its center.
        ease: How the placement changes from this key to the next one.
    """

    frame: Frame
    location: Point = (0.0, 0.0)
    rotation: Annotated[float, around(limits.MAX_DEGREES)] = 0.0
    scale: Annotated[float, around(limits.MAX_SCALE)] = 1.0
    ease: Ease = "linear"


@dataclass(frozen=True)
class StrokesKey:
    """Strokes drawn on a subject at one frame, in a recipe. They show what belongs to the subject or does not.

    Attributes:
        frame: The timeline frame at which they are drawn; 1 is the strip's first.
        strokes: The strokes, each a list of points in fractions of the picture, y up.
    """

    frame: Frame
    strokes: list[Stroke]


Drawing = tuple[float, list[Stroke], Ease]  # strokes from a frame on, and the ease to the next drawing
Strokes = list[Stroke] | Annotated[list[StrokesKey], _KEYS]  # of frame 1, or of several frames


@dataclass(frozen=True)
class RegionKey(MoveKey):
    """A key of a region's placement over time, in a recipe, that can also have a new drawing of the region.

    Attributes:
        strokes: What is drawn at the key's frame, lists of points in fractions of the picture, y up: the strokes or
            curves of the region until the next drawing, to which `ease` leads; or outlines around a subject. None: the
            key only places the region.
    """

    strokes: list[Stroke] | None = None


def _type_of(each: Field) -> Any:
    """Return the type that the value of a property has in a recipe, for cattrs."""
    if each.choices:
        return Literal[tuple(each.words.values())]
    if isinstance(each.default, tuple):
        return tuple[_SHARE, _SHARE, _SHARE]
    if each.keyed_in_recipe:
        return Annotated[float, Within(each.least, each.most)] | _keys(each.least, each.most, 1)
    kind = type(each.default)
    return kind if kind is bool else Annotated[kind, Within(each.least, each.most)]


def _record(name: str, kinds: tuple[type, ...], **special: tuple[Any, Any]) -> type:
    """Make the record class (a dataclass) for a part of a recipe, such as a shutter.

    Args:
        name: The class's name.
        kinds: Classes of the model. The record gets a field for each property they declare that has a name in recipes
            (Field.recipe); its class attribute `model` is the first of them.
        special: Fields that the classes do not declare, or that replace declared ones: (type, default) by name. The
            default MISSING makes a field required.
    """
    said: dict[str, Any] = {name: special[name] for name in ("version", "kind") if name in special}
    said |= {each.recipe: (_type_of(each), each.absent) for each in fields_of(*kinds).values() if each.recipe} | special
    columns: list[Any] = [
        (word, kind) if default is MISSING else (word, kind, field(default_factory=partial(copy, default)))
        for word, (kind, default) in said.items()
    ]
    return make_dataclass(name, columns, namespace={"model": kinds[0]}, frozen=True, kw_only=True)


_numbers = fields_of(model.Shutter)
ShutterRecord: Any = _record(
    "ShutterRecord",
    (model.Shutter,),
    bars=(list[float] | None, None),
    keys=(Annotated[list[BarsKey], _KEYS], []),
    follow=(str | None, None),
    trail=(_type_of(_numbers["trail"]) | None, None),
    length=(Literal["bars", "timeline"], "bars"),
    threshold=(_type_of(_numbers["threshold"]) | None, None),
)
_MOVES: Any = Annotated[list[MoveKey], _KEYS]
_OF_REGION: dict[str, Any] = {"shutter": (str, MISSING)}
_REDRAWN: dict[str, Any] = {"keys": (Annotated[list[RegionKey], _KEYS], [])}
_DRAWN: dict[str, Any] = _OF_REGION | {"strokes": (list[Stroke], [])} | _REDRAWN
_LAID: dict[str, Any] = _OF_REGION | {"keys": (_MOVES, [])}
RegionRecord: Any = _record("RegionRecord", (model.Region,), kind=(Literal["line", "lasso"], "line"), **_DRAWN)
OutlineRecord: Any = _record("OutlineRecord", (model.OutlineRegion,), kind=(Literal["outline"], "outline"), **_DRAWN)
SubjectRecord: Any = _record(
    "SubjectRecord",
    (model.SubjectRegion,),
    kind=(Literal["subject"], "subject"),
    **_OF_REGION,
    strokes=(Strokes, []),
    not_strokes=(Strokes, []),
    **_REDRAWN,
)
MatteRecord: Any = _record(
    "MatteRecord",
    (model.MatteRegion, model.FileContent),
    kind=(Literal["matte"], "matte"),
    path=(Annotated[str, Within(1, limits.MAX_PATH)], MISSING),
    channel=(Annotated[str, Within(1, limits.MAX_CHANNEL)], "luminance"),
    **_LAID,
)
RampRecord: Any = _record("RampRecord", (model.MatteRegion, model.RampContent), kind=(Literal["ramp"], "ramp"), **_LAID)
AnyRegionRecord: Any = RegionRecord | OutlineRecord | MatteRecord | RampRecord | SubjectRecord
# cattrs chooses by `kind`: the record of each word that a region's field `kind` may have.
KINDS = {word: record for record in get_args(AnyRegionRecord) for word in get_args(record.__annotations__["kind"])}
RecipeRecord: Any = _record(
    "RecipeRecord",
    (Options, model.Effect, model.Camera),
    version=(Literal[1, 2], MISSING),
    shutters=(
        Annotated[list[ShutterRecord], Within(1, limits.MAX_SHUTTERS, "empty: the first shutter is the default")],
        MISSING,
    ),
    regions=(Annotated[list[AnyRegionRecord], Within(0, limits.MAX_REGIONS)], []),
    time=(_keys(-limits.MAX_FRAME, limits.MAX_FRAME), []),
    camera=(_MOVES, []),
)


def effect_of(recipe: Any) -> model.Effect:
    """Convert a recipe's record to an effect.

    A recipe does not know the aspect of pictures. Call Effect.for_picture on the result to set it.

    Args:
        recipe: A RecipeRecord that recipe_file.check has checked.
    """
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
    """Convert an effect from a recipe of version 1, whose bars counted moments, to bars that count filmed frames.

    Moments are filmed frames, and those that are made between them. Each filmed frame has Options.step moments.

    Args:
        effect: The effect as read from the recipe.
        options: Its options, with `window` in moments.

    Returns:
        The converted effect. Its attribute `lost` is a warning if the new bars cannot look like the old ones, else
        None.
    """
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
    """Read the properties of a class of the model from a record: {attribute's name: value}."""
    said = {name: (each, getattr(record, each.recipe)) for name, each in fields_of(kind).items() if each.recipe}
    return {name: _channel(value) if each.is_channel else value for name, (each, value) in said.items()}


def _channel(value: float | list[ValueKey]) -> Channel:
    """Return the channel of a number or of its keys in a record."""
    return Keys(*_columns(value, "frame", "value", "ease")) if isinstance(value, list) else Constant(value)


def _columns(keys: list, *names: str) -> list[tuple]:
    """Return a tuple for each name: the values that all keys have in the field of this name."""
    return [tuple(getattr(key, name) for key in keys) for name in names]


def _shutter(record: Any, follow: model.Subject | None) -> model.Shutter:
    """Return the shutter of a record, which follows the region or camera `follow`."""
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


def _moves(keys: list, *, drawn: bool = False) -> model.Moves:
    """Convert the keys of a placement in a record to a placement over time.

    Args:
        keys: MoveKeys or RegionKeys, by ascending frame.
        drawn: Whether the keys may be there only for their drawings, as for subjects. If none of them moves anything,
            the placement is then keyless, which means that nothing moves.
    """
    placed = [(key.frame, Placement(key.location, key.rotation, key.scale), key.ease) for key in keys]
    if drawn and all(placement == Placement() for _frame, placement, _ease in placed):
        return model.Moves()
    return model.Moves.keyed(placed)


def _region(record: Any, shutter: int) -> model.Region | model.MatteRegion:
    """Convert a region's record to a region of the model. `shutter` is the index of its shutter."""
    values: dict[str, Any] = _values(record.model, record) | {"shutter": shutter}
    values["moves"] = _moves(record.keys, drawn=isinstance(record, SubjectRecord))
    values |= {name: _drawings(record.name, drawn) for name, drawn in drawn_in(record).items()}
    if isinstance(record, RegionRecord):
        values["kind"] = record.kind
    elif isinstance(record, OutlineRecord | SubjectRecord):
        values["content"] = Constant(None)  # made in Blender
    elif isinstance(record, MatteRecord):
        file = {"path": record.path, "channel": record.channel}
        values["content"] = model.FileContent(**file, **_values(model.FileContent, record))
    else:
        values["content"] = model.RampContent(ramp=record.ramp)
    return record.model(**values)


def drawn_in(record: Any) -> dict[str, list[Drawing]]:
    """Return what is drawn in a region's record, sorted by the attributes of the model's region.

    The field `strokes` of a scribble or an outline is its first drawing, unless its first key has strokes.

    Args:
        record: The region's record.

    Returns:
        Lists of (frame, strokes, ease until the next drawing) by attribute. "drawings" of a scribble or outline are its
        drawings. A subject has three lists: "drawings", the strokes on it; "nots", those on what does not belong to it;
        "outlines", the outlines drawn around it at keys. A matte or ramp has none: {}.
    """
    drawn = [(key.frame, key.strokes, key.ease) for key in record.keys if getattr(key, "strokes", None) is not None]
    if isinstance(record, SubjectRecord):
        return {"drawings": _marks(record.strokes), "nots": _marks(record.not_strokes), "outlines": drawn}
    if not isinstance(record, RegionRecord | OutlineRecord):
        return {}
    if not drawn or record.keys[0].strokes is None:
        first = record.keys[0] if record.keys else RegionKey(0.0)
        drawn.insert(0, (first.frame, record.strokes, first.ease))
    return {"drawings": drawn}


def _marks(strokes: Any) -> list[Drawing]:
    """Return the drawings of the strokes on a subject, which a recipe gives as strokes of frame 1 or as StrokesKeys."""
    is_keyed = strokes and isinstance(strokes[0], StrokesKey)
    keys = strokes if is_keyed else [StrokesKey(1.0, strokes)] if strokes else []
    return [(key.frame, key.strokes, "linear") for key in keys]


def _drawings(name: str, drawn: list[Drawing]) -> model.Drawings:
    """Return the drawings of a record as those of the model. `name` is the region's."""
    strokes = tuple([np.asarray(stroke, float) for stroke in strokes] for _frame, strokes, _ease in drawn)
    frames, eases = tuple(frame for frame, *_ in drawn), tuple(ease for *_, ease in drawn)
    return model.Drawings(name=name, frames=frames, strokes=strokes, eases=eases, aspect=1.0)


def recipe_of(effect: model.Effect) -> dict[str, Any]:
    """Convert an effect to the JSON object of a recipe, which RecipeRecord and `effect_of` turn into the effect again.

    Args:
        effect: An effect whose channels are keyed or constant, and whose shutters have unique names.
    """
    options, names = effect.options.at(1), [shutter.name for shutter in effect.shutters]
    said = {"version": VERSION} | _words(Options, options) | _words(model.Effect, effect)
    said |= _words(model.Camera, effect.camera)
    said["shutters"] = [_shutter_words(shutter) for shutter in effect.shutters]
    said["regions"] = [_region_words(region, names[region.shutter]) for region in effect.regions]
    if isinstance(effect.time, keyframes.SourceTime):
        said["time"] = _keyable(effect.time.numbers)
    if keys := _move_keys(effect.camera.moves):
        said["camera"] = keys
    return said


def _words(kind: type, part: Any) -> dict[str, Any]:
    """Return the declared properties of a part of an effect as fields of a recipe: {name in the recipe: JSON value}.

    Unless Field.always_written is true, a property is left out if it has the value that a recipe without it means
    (Field.absent).

    Args:
        kind: The class of the model that declares the properties.
        part: An object that has them as attributes: the effect, its options, a shutter, a region, its content or the
            camera.
    """
    said = {}
    for name, each in fields_of(kind).items():
        if each.recipe:
            value = _keyable(getattr(part, name)) if each.is_channel else getattr(part, name)
            if each.always_written or value != each.absent:
                said[each.recipe] = value
    return said


def _keyable(channel: Channel) -> Any:
    """Return a channel's number, or its keys, as a recipe has them."""
    return _keys_of(channel, value=channel.values) if isinstance(channel, Keys) else float(channel.at(1))


def _keys_of(channel: Keys, **columns: Iterable) -> list[dict[str, Any]]:
    """Return the keys of a channel as JSON objects, with the fields `frame`, `ease` and those in `columns`.

    Args:
        channel: The channel, which gives the frames and eases.
        columns: For each other field's name, the values at all keys, in order.
    """
    rows = zip(channel.frames, channel.eases, *columns.values(), strict=True)
    return [dict(zip(("frame", "ease", *columns), row, strict=True)) for row in rows]


def _shutter_words(shutter: model.Shutter) -> dict[str, Any]:
    """Return a shutter as a JSON object."""
    said, chooses = _words(model.Shutter, shutter), shutter.combine in EXTREMES
    unused = set() if shutter.follow else {"follow_motion", "follow_smooth"}
    if shutter.follow:
        said["follow"] = shutter.follow.name if isinstance(shutter.follow, model.AnyRegion) else CAMERA
    if shutter.length == "timeline":
        said["length"] = "timeline"
    if shutter.has_trail:
        said["trail"] = _keyable(shutter.trail)
    if chooses and shutter.use_threshold:
        said["threshold"] = _keyable(shutter.threshold)
    else:
        unused |= {"softness"} if chooses else {"softness", "by_luminance"}
    bars = shutter.bars.channel
    if isinstance(bars, Keys):
        said["keys"] = _keys_of(bars, bars=[each.tolist() for each in bars.values])
    else:
        said["bars"] = bars.at(1).tolist()
    return {name: value for name, value in said.items() if name not in unused}


def _move_keys(moves: model.Moves) -> list[dict[str, Any]]:
    """Return the keys of a placement over time as JSON objects; none if it has no keys."""
    numbers = {"location": moves.location, "rotation": moves.rotation, "scale": moves.scale}
    if not isinstance(moves.location, Keys):
        return []
    return _keys_of(moves.location, **{name: channel.values for name, channel in numbers.items()})  # type: ignore[attr-defined]


def _strokes_of(drawings: model.Drawings) -> dict[float, list[Stroke]]:
    """Return drawings as {frame: strokes}, in the form that recipes have."""
    drawn = ([[(x, y) for x, y in stroke.tolist()] for stroke in strokes] for strokes in drawings.strokes)
    return dict(zip(drawings.frames, drawn, strict=True))


def _region_words(region: Any, shutter: str) -> dict[str, Any]:
    """Return a region as a JSON object. `shutter` is the name of its shutter."""
    said = _words(type(region), region) | {"shutter": shutter}
    keys, drawn = {key["frame"]: key for key in _move_keys(region.moves)}, {}
    if isinstance(region, model.SubjectRegion):
        said |= {"kind": "subject", "strokes": _keyed(region.drawings)}
        if region.nots.frames:
            said["not_strokes"] = _keyed(region.nots)
        drawn = _strokes_of(region.outlines)
    elif isinstance(region, model.Region | model.OutlineRegion):
        # The region carries the first drawing; keys carry the others.
        drawn, first = _strokes_of(region.drawings), region.drawings.frames[0]
        said |= {"kind": region.kind if isinstance(region, model.Region) else "outline", "strokes": drawn[first]}
        if len(drawn) == 1 or first == min(keys):
            del drawn[first]
    else:
        said |= _words(type(region.content), region.content)
        is_file = isinstance(region.content, model.FileContent)
        said["kind"] = "matte" if is_file else "ramp"
        if is_file:
            said |= {"path": region.content.path, "channel": region.content.channel}
    placed = {frame: asdict(MoveKey(frame)) for frame in drawn} | keys
    with_strokes = {frame: {"strokes": strokes} for frame, strokes in drawn.items()}
    if placed:
        said["keys"] = [placed[frame] | with_strokes.get(frame, {}) for frame in sorted(placed)]
    return said


def _keyed(drawings: model.Drawings) -> list:
    """Return the strokes on a subject as a recipe has them: with frames, unless they are those of frame 1 only."""
    drawn = _strokes_of(drawings)
    return drawn[1] if list(drawn) == [1] else [{"frame": f, "strokes": strokes} for f, strokes in drawn.items()]
