"""Recipes: the whole effect but the footage, as a JSON file, version 1.

Frames are timeline frames, 1 = the strip's first. Points are fractions of the picture, y up.
"""

from __future__ import annotations

import json
import math
import os
import re
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, is_dataclass, replace
from functools import cache, partial
from itertools import pairwise
from pathlib import Path
from typing import Literal, get_args, get_origin

import numpy as np

from .. import atomic_write
from ..messages import UserError, sentence
from ..model import effect, keyframes, limits, mattes, motions, shutters
from ..model.frame_state import Edges, Exposure, FrameState, Interpolation, Light, Options, Position

Point = tuple[float, float]
Stroke = list[Point]
Ease = Literal["linear", "bezier", "constant"]
Factor = Literal[1, 2, 4, 8, 16]


# Longer numbers are read as floats, which need no time for it; a whole number that counts anything is far shorter.
_MAX_DIGITS = 300


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
    follow_motion, follow_smooth: as motion and smooth of effect.Shutter"""

    name: str
    color: tuple[float, float, float] = (0.8, 0.8, 0.8)
    bars: list[float] | None = None
    keys: list[ShutterKey] = field(default_factory=list)
    follow: str | None = None
    trail: Keyable | None = None
    follow_motion: motions.Motion = "scale"
    follow_smooth: int = 0

    def over_time(self, follow: effect.Region | effect.Camera | None = None) -> effect.Shutter:
        """As plain data; follow: what is followed, in the same form."""
        trail = None if self.trail is None else _numbers(self.trail)
        how = self.follow_motion, self.follow_smooth
        return effect.Shutter(self.name, self.color, self._bars_over_time(), follow, trail, *how)

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
    """Where what the camera sees lies in the picture, as of a region whose centre is the picture's."""

    frame: float
    location: Point = (0.0, 0.0)
    rotation: float = 0.0
    scale: float = 1.0
    ease: Ease = "linear"


def _moves(keys: list[RegionKey] | list[CameraKey]) -> list[keyframes.Channel]:
    """Channels of location, rotation and scale."""
    if not keys:
        return [keyframes.Constant(value) for value in ((0.0, 0.0), 0.0, 1.0)]
    frames, eases, *moves = _columns(keys, "frame", "ease", "location", "rotation", "scale")
    return [keyframes.Keys(frames, values, eases) for values in moves]


@dataclass(frozen=True)
class Region:
    """A scribble of a shutter. Redrawn shapes follow one another between the keys that carry strokes; a first key
    without any carries the region's own."""

    shutter: str
    name: str = ""
    kind: Literal["line", "lasso"] = "line"
    width: float = 0.02
    strokes: list[Stroke] = field(default_factory=list)
    keys: list[RegionKey] = field(default_factory=list)
    opacity: Keyable = 1.0

    def drawings(self) -> list[tuple[RegionKey | None, list[Stroke]]]:
        """The key that starts each drawing, and its strokes, in time."""
        drawn = [(key, key.strokes) for key in self.keys if key.strokes is not None]
        if not drawn or self.keys[0].strokes is None:
            drawn.insert(0, (self.keys[0] if self.keys else None, self.strokes))
        return drawn

    def over_time(self, shutter: int, aspect: float) -> effect.Region:
        """As plain data, for a picture of width / height = aspect; shutter: the index of its shutter."""
        drawn = self.drawings()
        drawings = effect.Drawings(
            tuple(key.frame if key else 0.0 for key, _ in drawn),
            tuple([np.asarray(stroke, float) for stroke in strokes] for _, strokes in drawn),
            tuple(key.ease if key else "linear" for key, _ in drawn),
            aspect,
        )
        fixed = self.name, shutter, keyframes.Constant(self.kind), keyframes.Constant(self.width), drawings
        return effect.Region(*fixed, *_moves(self.keys), _numbers(self.opacity))


@dataclass(frozen=True)
class MatteRegion:
    """A region by a matte: its values are its shutter's coefficients.

    path: a movie, or the first file of an image sequence; relative to the recipe's folder
    channel: one of CHANNELS, or the name of a channel of an EXR
    timing: whose frames show the matte's, frame by frame: those of the source, or of the timeline
    offset: the matte's frame, from 0, that belongs to the first of these
    blend, opacity: as of core.model.mattes.Matte; width: its feather
    keys: how what it covers moves; the matte itself is not moved"""

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

    def over_time(self, shutter: int, file: mattes.MatteFile | None) -> effect.MatteRegion:
        """As plain data; shutter: the index of its shutter, file: what is at its path."""
        first = None if self.timing == "source" else 1
        return _matte(self, shutter, mattes.FileFrames(file, self.offset, first))


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

    def over_time(self, shutter: int, file: mattes.MatteFile | None) -> effect.MatteRegion:
        """As plain data; shutter: the index of its shutter, file: the source's luminance."""
        if self.ramp == "luminance":
            return _matte(self, shutter, mattes.FileFrames(file))
        return _matte(self, shutter, effect.PlacedRamp(self.ramp, *_moves(self.keys)))


def _matte(region: MatteRegion | RampRegion, shutter: int, content: keyframes.Channel) -> effect.MatteRegion:
    numbers = _numbers(region.opacity), _numbers(region.width), *_moves(region.keys)
    return effect.MatteRegion(region.name, shutter, content, region.blend, region.invert, *numbers)


CHANNELS = ("luminance", "red", "green", "blue", "alpha")
AnyRegion = Region | MatteRegion | RampRegion
_KINDS = {"line": Region, "lasso": Region, "matte": MatteRegion, "ramp": RampRegion}


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
    inbetween: Factor = 1
    inbetween_method: Literal["quick", "good"] = "quick"
    time: list[ValueKey] = field(default_factory=list)
    camera: list[CameraKey] = field(default_factory=list)
    camera_influence: Keyable = 1.0

    @property
    def options(self) -> Options:
        """The options that have no keys."""
        names = Options.__dataclass_fields__.keys() - {"step", "edge_aware"}
        return Options(**{name: getattr(self, name) for name in names}, step=self.inbetween)

    def effect(
        self, aspect: float, files: Callable[[MatteRegion | RampRegion], mattes.MatteFile] | None = None
    ) -> effect.Effect:
        """As plain data, for a picture of width / height = aspect. Frame 1 is the strip's first.

        files: what gives the file of a matte, or for a ramp the source's luminance; without it, mattes are empty"""
        order = {shutter.name: i for i, shutter in enumerate(self.shutters)}
        regions = tuple(
            region.over_time(order[region.shutter], aspect)
            if isinstance(region, Region)
            else region.over_time(order[region.shutter], files and files(region))
            for region in self.regions
        )
        camera = effect.Camera(*_moves(self.camera), _numbers(self.camera_influence))
        followed = {region.name: region for region in regions} | {CAMERA: camera, None: None}
        return effect.Effect(
            tuple(shutter.over_time(followed[shutter.follow]) for shutter in self.shutters),
            regions,
            keyframes.Constant(self.options),
            self._source_time(),
            _numbers(self.edge_aware),
            camera,
        )

    def _source_time(self) -> keyframes.SourceTime | None:
        if not self.time:
            return None
        keys = tuple((key.frame, key.ease) for key in self.time)
        return keyframes.SourceTime(_numbers(self.time), keys)

    def at(self, frame: float, aspect: float, files=None) -> FrameState:
        """The effect at a timeline frame (1 = the strip's first); aspect, files: as of `effect`."""
        return self.effect(aspect, files).at(frame)

    def time_at(self, frame: float) -> float | None:
        """The source frame that is shown at a timeline frame, 1 is the first; None: the strip's timing says that."""
        time = self._source_time()
        return None if time is None else time.at(frame)[0]


def _numbers(value: Keyable) -> keyframes.Channel:
    if not isinstance(value, list):
        return keyframes.Constant(value)
    return keyframes.Keys(*_columns(value, "frame", "value", "ease"))


def _columns(keys: list, *names: str) -> list[tuple]:
    """Of keys, each of these fields as a tuple."""
    return [tuple(getattr(key, name) for key in keys) for name in names]


def with_inbetween(source: Recipe, factor: int) -> Recipe:
    """The same effect over another number of in-between frames: its bars stand for the same times.

    RecipeError: they would be too many."""

    def changed(bars):
        return bars and shutters.multiplied(bars, source.inbetween, factor, source.position).tolist()

    try:
        found = [
            replace(shutter, bars=changed(shutter.bars), keys=[replace(k, bars=changed(k.bars)) for k in shutter.keys])
            for shutter in source.shutters
        ]
    except shutters.ShutterError:
        window = source.window * factor // source.inbetween
        raise RecipeError(
            f"window: {window} bars for {factor}× in-between frames, the most are {shutters.MAX_WINDOW}"
        ) from None
    window = -(-source.window * factor // source.inbetween)
    return replace(source, window=window, shutters=found, inbetween=factor)


def moved(source: Recipe, old: Path, new: Path) -> Recipe:
    """The same effect for a recipe in another folder: relative paths of mattes lead to the same files."""

    def rebased(region):
        if not isinstance(region, MatteRegion) or Path(region.path).is_absolute():
            return region
        return replace(region, path=relative(old / region.path, new))

    return replace(source, regions=[rebased(region) for region in source.regions])


def relative(path: Path, folder: Path) -> str:
    """The path of a matte, as a recipe in a folder has it: relative, if there is such a one."""
    with suppress(ValueError):  # on another drive
        found = os.path.relpath(path, folder)
        # ".." leads out of where a linked folder really lies
        if os.path.realpath(os.path.join(folder, found)) == os.path.realpath(path):
            return Path(found).as_posix()
    return Path(os.path.abspath(path)).as_posix()


def load(path: str | Path) -> Recipe:
    """The recipe in a JSON file. RecipeError: it cannot be read, or breaks the format."""
    try:
        return parse(_read(Path(path)))
    except OSError as error:
        raise RecipeError(f"{path}: {error.strerror or error}") from None
    except UnicodeDecodeError:
        raise RecipeError(f"{path}: not a text file in UTF-8") from None
    except ValueError as error:  # RecipeError, or a name that no file can have
        raise RecipeError(f"{path}: {error}") from None


def _read(path: Path) -> str:
    """The text of a file, a little more at most than a recipe may have. RecipeError, OSError, ValueError: there is
    none."""
    if path.exists() and not (path.is_file() or path.is_dir()):
        # opening a pipe would wait for ever, and a device has no end
        raise RecipeError("a pipe or a device, not a file")
    with path.open("rb") as file:
        data = file.read(limits.MAX_BYTES + 1)
    _check_size(data)
    return data.decode("utf-8")


def _check_size(text: str | bytes) -> None:
    if len(text) > limits.MAX_BYTES:
        raise RecipeError(f"more than {limits.MAX_BYTES // 1_000_000} MB, which no recipe has")


def parse(text: str) -> Recipe:
    """The recipe in a JSON text. RecipeError: one sentence that names the place, as `shutters[1].bars: …`."""
    _check_size(text)
    try:
        data = json.loads(text.removeprefix("\ufeff"), object_pairs_hook=_object, parse_int=_whole)
    except json.JSONDecodeError as error:
        raise RecipeError(f"line {error.lineno}, column {error.colno}: not JSON ({error.msg})") from None
    except RecursionError:
        raise RecipeError("recipe: lists or objects within one another, too many") from None
    converter = _converter()
    try:
        recipe = converter.structure(data, Recipe)
    except Exception as error:
        raise RecipeError(_first_fault(error)) from None
    _check(recipe)
    return recipe


def dump(recipe: Recipe) -> str:
    """The recipe as JSON text; `parse(dump(r)) == r`. Fields that carry nothing are left out."""
    text = json.dumps(_compact(_converter().unstructure(recipe)), indent=1, ensure_ascii=False)
    # People read and edit these files: a list of numbers stays on one line. Texts are found as well, to be passed over.
    return re.sub(r'"(?:[^"\\]|\\.)*"|\[[-+.\de,\s]+\]', _on_one_line, text) + "\n"


def _on_one_line(found: re.Match) -> str:
    text = found[0]
    return text if text[0] == '"' else " ".join(text.split()).replace("[ ", "[").replace(" ]", "]")


def save(recipe: Recipe, path: str | Path) -> None:
    """Writes a recipe whole or not at all. OSError: it cannot be written."""
    with atomic_write.writing(Path(path)) as part:
        part.write_text(dump(recipe), encoding="utf-8")


# Values that say nothing, of fields that few recipes need.
_UNTOLD = {"opacity": 1.0, "follow_motion": "scale", "follow_smooth": 0, "camera_influence": 1.0}


def _compact(value):
    if isinstance(value, dict):
        keys = "keys", "time", "camera"
        told = {k: v for k, v in value.items() if v is not None and (k not in _UNTOLD or v != _UNTOLD[k])}
        return {k: _compact(v) for k, v in told.items() if v or k not in keys}
    return [_compact(v) for v in value] if isinstance(value, (list, tuple)) else value


# Reading: the converter checks the structure, _check what no type can say.


class _Doubled(dict):
    """An object of JSON that has a field twice, its name in `field`: which one is meant, nobody knows."""


def _object(pairs: list) -> dict:
    found = dict(pairs)
    if len(found) < len(pairs):
        found = _Doubled(found)
        found.field = Counter(name for name, _ in pairs).most_common(1)[0][0]
    return found


def _whole(digits: str) -> int | float:
    return int(digits) if len(digits) <= _MAX_DIGITS else float(digits)


def _number(value, _kind) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f"{_shown(value)} is not a number")
    if not math.isfinite(value):
        raise ValueError(f"{value} is not a finite number")
    return float(value)


def _keyable(converter, value, kind):
    if value is None and kind != Keyable:
        return None
    if isinstance(value, list):
        return converter.structure(value, list[ValueKey])
    try:
        return _number(value, kind)
    except ValueError as error:
        raise ValueError(f"{error}, nor a list of keys") from None


def _exactly(wanted: type, name: str):
    def structure(value, _kind):
        if type(value) is not wanted:
            raise ValueError(f"{_shown(value)} is not {name}")
        return value

    return structure


def _choice(value, kind):
    allowed = get_args(kind)
    if not any(type(value) is type(option) and value == option for option in allowed):
        raise ValueError(f"{_shown(value)} is none of {', '.join(map(str, allowed))}")
    return value


def _tuple(kind, converter):
    inner = get_args(kind)

    def structure(value, _kind):
        if not isinstance(value, list):
            raise ValueError(f"{_shown(value)} is not a list")
        if len(value) != len(inner):
            raise ValueError(f"{len(value)} values, not {len(inner)}")
        return tuple(converter.structure(v, t) for v, t in zip(value, inner, strict=True))

    return structure


def _list(kind, converter):
    (inner,) = get_args(kind)
    structure_item = converter.get_structure_hook(inner)

    def structure(value, _kind):
        if not isinstance(value, list):
            raise ValueError(f"{_shown(value)} is not a list")
        return [item(value, index) for index in range(len(value))]

    def item(value, index):
        try:
            return structure_item(value[index], inner)
        except Exception as error:  # the first one is enough; cattrs' own lists gather millions
            from cattrs.errors import IterableValidationError, IterableValidationNote

            error.add_note(IterableValidationNote(f"index {index}", index, inner))
            raise IterableValidationError("in a list", [error], kind) from None

    return structure


def _dataclass(kind, converter):
    from cattrs.gen import make_dict_structure_fn

    structure_fields = make_dict_structure_fn(kind, converter, _cattrs_forbid_extra_keys=True)

    def structure(value, kind):
        if not isinstance(value, dict):
            raise ValueError(f"{_shown(value)} is not an object")
        if isinstance(value, _Doubled):
            raise ValueError(f"field {_shown(value.field)} stands there twice")
        return structure_fields(value, kind)

    return structure


def _region(converter, value, _kind):
    """Which of the kinds of regions it is, its field `kind` says."""
    word = value.get("kind", "line") if isinstance(value, dict) else "line"
    if isinstance(word, str) and word in _KINDS:
        return converter.structure(value, _KINDS[word])
    from cattrs.errors import AttributeValidationNote, ClassValidationError

    error = ValueError(f"{_shown(word)} is none of {', '.join(_KINDS)}")
    error.add_note(AttributeValidationNote("in a region", "kind", str))
    raise ClassValidationError("in a region", [error], Region)


@cache
def _converter():
    """RecipeError: cattrs is missing. Blender brings it; a Linux distribution's Blender may not, and effects render
    without it."""
    try:
        import cattrs
    except ImportError as error:
        raise RecipeError(
            f"recipes need the Python package cattrs ({error}); install it for Blender's Python"
        ) from None
    converter = cattrs.Converter()
    converter.register_structure_hook(float, _number)
    converter.register_structure_hook(int, _exactly(int, "a whole number"))
    converter.register_structure_hook(str, _exactly(str, "a text"))
    converter.register_structure_hook(bool, _exactly(bool, "true or false"))
    converter.register_structure_hook_func(lambda kind: get_origin(kind) is Literal, _choice)
    converter.register_structure_hook_func(lambda kind: kind in (Keyable, Keyable | None), partial(_keyable, converter))
    converter.register_structure_hook_func(lambda kind: kind == AnyRegion, partial(_region, converter))
    converter.register_structure_hook_factory(lambda kind: get_origin(kind) is tuple, _tuple)
    converter.register_structure_hook_factory(lambda kind: get_origin(kind) is list, _list)
    converter.register_structure_hook_factory(is_dataclass, _dataclass)
    return converter


def _shown(value) -> str:
    """A value as JSON, or its first 40 characters; of large ones the rest is not looked at."""
    text = ""
    for part in json.JSONEncoder(ensure_ascii=False).iterencode(value):
        text += part
        if len(text) > 40:
            break
    return _cut(text)


def _cut(text: str) -> str:
    return text if len(text) <= 40 else text[:37] + "…"


def _plain(number: float) -> str:
    return f"{number:.10g}"


def _first_fault(error: Exception) -> str:
    """`place: what is wrong`, of the first fault."""
    import cattrs
    from cattrs.errors import ForbiddenExtraKeysError

    def described(error, kind):
        if isinstance(error, KeyError):
            return "missing"
        if isinstance(error, ForbiddenExtraKeysError):
            names = sorted(error.extra_fields)
            more = f" and {len(names) - 3} more" if len(names) > 3 else ""
            return f"unknown field {', '.join(map(_cut, names[:3]))}{more}"
        return str(error)

    message, _, place = cattrs.transform_error(error, "$", described)[0].rpartition(" @ $")
    return f"{place.lstrip('.') or 'recipe'}: {message}"


def _require(condition, place: str, message: str) -> None:
    if not condition:
        raise RecipeError(f"{place}: {message}")


def _require_within(value: float, most: float, place: str, least: float | None = None) -> None:
    """least: −most, where it is not given."""
    least = -most if least is None else least
    _require(least <= value <= most, place, f"{_plain(value)} is not {_plain(least)} to {_plain(most)}")


def _check(recipe: Recipe) -> None:
    window = f"{_shown(recipe.window)} is not 1 to {shutters.MAX_WINDOW}"
    _require(1 <= recipe.window <= shutters.MAX_WINDOW, "window", window)
    _require(recipe.shutters, "shutters", "there is none; the first is the default")
    _check_count(recipe.shutters, limits.MAX_SHUTTERS, "shutters")
    _check_count(recipe.regions, limits.MAX_REGIONS, "regions")
    places: dict[str, int] = {}
    for i, shutter in enumerate(recipe.shutters):
        _check_name(shutter.name, f"shutters[{i}].name")
        taken = places.setdefault(shutter.name, i)
        _require(taken == i, f"shutters[{i}].name", f"{_shown(shutter.name)} is taken by shutters[{taken}]")
        _check_shutter(shutter, recipe.window, f"shutters[{i}]")
        _check_follow(shutter.follow, recipe.regions, f"shutters[{i}].follow")
        if shutter.trail is not None:
            _require(shutter.follow, f"shutters[{i}].trail", "the shutter follows nothing that could move so far")
            _check_number(shutter.trail, f"shutters[{i}].trail", limits.MAX_DISTANCE)
        _require_within(shutter.follow_smooth, limits.MAX_SMOOTH, f"shutters[{i}].follow_smooth", 0)
    _check_values(recipe.time, "time", limits.MAX_FRAME)
    _check_frames(recipe.camera, "camera")
    for k, key in enumerate(recipe.camera):
        _check_placement(key, f"camera[{k}]")
    _check_number(recipe.edge_aware, "edge_aware", 1)
    _check_number(recipe.camera_influence, "camera_influence", 1)
    for i, region in enumerate(recipe.regions):
        there_is_none = f"there is no shutter {_shown(region.shutter)}"
        _require(region.shutter in places, f"regions[{i}].shutter", there_is_none)
        check = _check_region if isinstance(region, Region) else _check_matte
        check(region, f"regions[{i}]")
    points = sum(_most_points(region) for region in recipe.regions if isinstance(region, Region))
    _require(points <= limits.MAX_POINTS, "regions", f"{points} points at once, the most are {limits.MAX_POINTS}")


def _check_shutter(shutter: Shutter, window: int, place: str) -> None:
    _require((shutter.bars is None) != (not shutter.keys), place, "either bars or keys, one of the two")
    _require(all(0 <= c <= 1 for c in shutter.color), f"{place}.color", "not three numbers from 0 to 1")
    _check_frames(shutter.keys, f"{place}.keys")
    for where, bars in (
        [(f"{place}.bars", shutter.bars)]
        if shutter.bars is not None
        else [(f"{place}.keys[{k}].bars", key.bars) for k, key in enumerate(shutter.keys)]
    ):
        _require(len(bars) == window, where, f"{len(bars)} values, window is {window}")
        try:
            shutters.check_bars(bars)
        except shutters.ShutterError as error:
            raise RecipeError(f"{where}: {error}") from None


def _check_follow(follow: str | None, regions: list[AnyRegion], place: str) -> None:
    """A name that two of them have says nothing."""
    if follow is None:
        return
    called = [f"regions[{i}]" for i, region in enumerate(regions) if region.name == follow]
    if follow == CAMERA:
        _require(not called, place, f"{_shown(follow)} is the camera, and {', '.join(called[:1])} as well")
        return
    _require(follow, place, "empty: it names a region, or is " + _shown(CAMERA))
    _require(called, place, f"there is no region {_shown(follow)}")
    _require(len(called) == 1, place, f"{_shown(follow)} is the name of {' and '.join(called[:2])}")


def _check_placement(key: RegionKey | CameraKey, place: str) -> None:
    for axis, value in enumerate(key.location):
        _require_within(value, limits.MAX_DISTANCE, f"{place}.location[{axis}]")
    _require_within(key.rotation, limits.MAX_DEGREES, f"{place}.rotation")
    _require_within(key.scale, limits.MAX_SCALE, f"{place}.scale")


def _check_region(region: Region, place: str) -> None:
    _check_name(region.name, f"{place}.name")
    _require(region.width >= 0, f"{place}.width", f"{region.width} is negative")
    _require_within(region.width, limits.MAX_DISTANCE, f"{place}.width", 0)
    _check_number(region.opacity, f"{place}.opacity", 1)
    _require(region.drawings()[0][1], f"{place}.strokes", "empty: nothing is drawn")
    _check_frames(region.keys, f"{place}.keys")
    redrawn = any(key.strokes is not None for key in region.keys)
    for k, key in enumerate(region.keys):
        where = f"{place}.keys[{k}]"
        whole = not (redrawn if k == 0 else key.strokes is not None) or key.frame == int(key.frame)
        _require(whole, f"{where}.frame", f"{_plain(key.frame)} is no whole frame, but redrawn")
        _check_placement(key, where)
        if key.strokes is not None:
            _check_strokes(key.strokes, f"{where}.strokes")
    _check_strokes(region.strokes, f"{place}.strokes")


def _check_matte(region: MatteRegion | RampRegion, place: str) -> None:
    _check_name(region.name, f"{place}.name")
    _check_number(region.opacity, f"{place}.opacity", 1)
    _check_number(region.width, f"{place}.width", limits.MAX_DISTANCE)
    _check_frames(region.keys, f"{place}.keys")
    for k, key in enumerate(region.keys):
        _check_placement(key, f"{place}.keys[{k}]")
    if isinstance(region, MatteRegion):
        for name, most in (("path", limits.MAX_PATH), ("channel", limits.MAX_CHANNEL)):
            _require(getattr(region, name), f"{place}.{name}", "empty")
            _check_name(getattr(region, name), f"{place}.{name}", most)
        _require_within(region.offset, limits.MAX_FRAME, f"{place}.offset")


def _check_strokes(strokes: list[Stroke], place: str) -> None:
    for j, stroke in enumerate(strokes):
        _require(stroke, f"{place}[{j}]", "empty: a stroke has at least one point")
        for n, point in enumerate(stroke):
            for axis, value in enumerate(point):
                if not -limits.MAX_DISTANCE <= value <= limits.MAX_DISTANCE:
                    _require_within(value, limits.MAX_DISTANCE, f"{place}[{j}][{n}][{axis}]")


def _most_points(region: Region) -> int:
    """The points of the region's drawing that has the most."""
    return max(sum(map(len, strokes)) for _, strokes in region.drawings())


def _check_count(items: list, most: int, place: str) -> None:
    _require(len(items) <= most, place, f"{len(items)}, the most are {most}")


def _check_name(name: str, place: str, most: int = limits.MAX_NAME) -> None:
    _require(len(name) <= most, place, f"{len(name)} characters, the most are {most}")
    wrong = next((c for c in name if c == "\0" or "\ud800" <= c <= "\udfff"), "")
    _require(not wrong, place, f"U+{ord(wrong or ' '):04X} is no character of a name")


def _check_number(value: Keyable, place: str, most: float) -> None:
    """A number from 0 on, or keys of it."""
    if isinstance(value, list):
        _require(value, place, "empty: there is no key")
        _check_values(value, place, most, 0)
    else:
        _require_within(value, most, place, 0)


def _check_values(keys: list[ValueKey], place: str, most: float, least: float | None = None) -> None:
    _check_frames(keys, place)
    for k, key in enumerate(keys):
        _require_within(key.value, most, f"{place}[{k}].value", least)


def _check_frames(keys: list, place: str) -> None:
    _check_count(keys, limits.MAX_KEYS, place)
    for k, key in enumerate(keys):
        _require_within(key.frame, limits.MAX_FRAME, f"{place}[{k}].frame")
    for k, (first, second) in enumerate(pairwise(keys)):
        follows = f"{_plain(second.frame)} does not follow {_plain(first.frame)}"
        _require(first.frame < second.frame, f"{place}[{k + 1}].frame", follows)
