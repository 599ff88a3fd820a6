"""Recipes as files: JSON text that is read into a recipe, checked, and written."""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from collections.abc import Callable
from dataclasses import is_dataclass
from functools import cache, partial
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args, get_origin

from .. import atomic_write
from ..model import limits, shutters
from .recipe import (
    CAMERA,
    KINDS,
    AnyRegion,
    CameraKey,
    Drawn,
    Keyable,
    MatteRegion,
    OutlineRegion,
    RampRegion,
    Recipe,
    RecipeError,
    Region,
    RegionKey,
    Shutter,
    Stroke,
    ValueKey,
)

if TYPE_CHECKING:
    from cattrs import Converter

VERSION = 1  # the newest one that is read; that of Recipe
# Longer numbers are read as floats, which need no time for it; a whole number that counts anything is far shorter.
_MAX_DIGITS = 300


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
    if isinstance(data, dict) and type(version := data.get("version")) is int and version > VERSION:
        newer = f"version: {_shown(version)} is of a newer version of Virtual Shutter, this one reads {VERSION}"
        raise RecipeError(newer)
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


def _on_one_line(match: re.Match) -> str:
    text = match[0]
    return text if text[0] == '"' else " ".join(text.split()).replace("[ ", "[").replace(" ]", "]")


def save(recipe: Recipe, path: str | Path) -> None:
    """Writes a recipe whole or not at all. OSError: it cannot be written."""
    with atomic_write.writing(Path(path)) as part:
        part.write_text(dump(recipe), encoding="utf-8")


# Values that say nothing, of fields that few recipes need.
_UNTOLD = {"opacity": 1.0, "follow_motion": "scale", "follow_smooth": 0, "camera_influence": 1.0}
_UNTOLD |= {"length": "bars", "combine": "average", "by_luminance": False, "softness": 0.0}


def _compact(value: Any) -> Any:
    if isinstance(value, dict):
        keys = "keys", "time", "camera"
        told = {k: v for k, v in value.items() if v is not None and (k not in _UNTOLD or v != _UNTOLD[k])}
        return {k: _compact(v) for k, v in told.items() if v or k not in keys}
    return [_compact(v) for v in value] if isinstance(value, (list, tuple)) else value


class _Doubled(dict):
    """An object of JSON that has a field twice, its name in `field`: which one is meant, nobody knows."""

    field: str


def _object(pairs: list) -> dict:
    fields = dict(pairs)
    if len(fields) == len(pairs):
        return fields
    doubled = _Doubled(fields)
    doubled.field = Counter(name for name, _ in pairs).most_common(1)[0][0]
    return doubled


def _whole(digits: str) -> int | float:
    return int(digits) if len(digits) <= _MAX_DIGITS else float(digits)


def _number(value: Any, _kind: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f"{_shown(value)} is not a number")
    if not math.isfinite(value):
        raise ValueError(f"{value} is not a finite number")
    return float(value)


def _keyable(converter: Converter, value: Any, kind: Any) -> float | list[ValueKey] | None:
    if value is None and kind != Keyable:
        return None
    if isinstance(value, list):
        return converter.structure(value, list[ValueKey])
    try:
        return _number(value, kind)
    except ValueError as error:
        raise ValueError(f"{error}, nor a list of keys") from None


def _exactly(wanted: type, name: str) -> Callable[[Any, Any], Any]:
    def structure(value: Any, _kind: Any) -> Any:
        if type(value) is not wanted:
            raise ValueError(f"{_shown(value)} is not {name}")
        return value

    return structure


def _choice(value: Any, kind: Any) -> Any:
    allowed = get_args(kind)
    if not any(type(value) is type(option) and value == option for option in allowed):
        raise ValueError(f"{_shown(value)} is none of {', '.join(map(str, allowed))}")
    return value


def _tuple(kind: Any, converter: Converter) -> Callable[[Any, Any], Any]:
    inner = get_args(kind)

    def structure(value: Any, _kind: Any) -> Any:
        if not isinstance(value, list):
            raise ValueError(f"{_shown(value)} is not a list")
        if len(value) != len(inner):
            raise ValueError(f"{len(value)} values, not {len(inner)}")
        return tuple(converter.structure(v, t) for v, t in zip(value, inner, strict=True))

    return structure


def _list(kind: Any, converter: Converter) -> Callable[[Any, Any], Any]:
    (inner,) = get_args(kind)
    structure_item = converter.get_structure_hook(inner)

    def structure(value: Any, _kind: Any) -> Any:
        if not isinstance(value, list):
            raise ValueError(f"{_shown(value)} is not a list")
        return [item(value, index) for index in range(len(value))]

    def item(value: list, index: int) -> Any:
        try:
            return structure_item(value[index], inner)
        except Exception as error:  # the first one is enough; cattrs' own lists gather millions
            from cattrs.errors import IterableValidationError, IterableValidationNote

            error.add_note(IterableValidationNote(f"index {index}", index, inner))
            raise IterableValidationError("in a list", [error], kind) from None

    return structure


def _dataclass(kind: Any, converter: Converter) -> Callable[[Any, Any], Any]:
    from cattrs.gen import make_dict_structure_fn

    structure_fields = make_dict_structure_fn(kind, converter, _cattrs_forbid_extra_keys=True)

    def structure(value: Any, kind: Any) -> Any:
        if not isinstance(value, dict):
            raise ValueError(f"{_shown(value)} is not an object")
        if isinstance(value, _Doubled):
            raise ValueError(f"field {_shown(value.field)} stands there twice")
        return structure_fields(value, kind)

    return structure


def _region(converter: Converter, value: Any, _kind: Any) -> AnyRegion:
    """Which of the kinds of regions it is, its field `kind` says."""
    word = value.get("kind", "line") if isinstance(value, dict) else "line"
    if isinstance(word, str) and word in KINDS:
        return converter.structure(value, KINDS[word])
    from cattrs.errors import AttributeValidationNote, ClassValidationError

    error = ValueError(f"{_shown(word)} is none of {', '.join(KINDS)}")
    error.add_note(AttributeValidationNote("in a region", "kind", str))
    raise ClassValidationError("in a region", [error], Region)


def _made_of(origin: Any) -> Callable[[Any], bool]:
    return lambda kind: get_origin(kind) is origin


@cache
def _converter() -> Converter:
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
    converter.register_structure_hook_func(_made_of(Literal), _choice)
    converter.register_structure_hook_func(lambda kind: kind in (Keyable, Keyable | None), partial(_keyable, converter))
    converter.register_structure_hook_func(lambda kind: kind == AnyRegion, partial(_region, converter))
    converter.register_structure_hook_factory(_made_of(tuple), _tuple)
    converter.register_structure_hook_factory(_made_of(list), _list)
    converter.register_structure_hook_factory(is_dataclass, _dataclass)
    return converter


def _shown(value: Any) -> str:
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

    def described(error: BaseException, kind: Any) -> str:
        if isinstance(error, KeyError):
            return "missing"
        if isinstance(error, ForbiddenExtraKeysError):
            names = sorted(error.extra_fields)
            more = f" and {len(names) - 3} more" if len(names) > 3 else ""
            return f"unknown field {', '.join(map(_cut, names[:3]))}{more}"
        return str(error)

    message, _, place = cattrs.transform_error(error, "$", described)[0].rpartition(" @ $")
    return f"{place.lstrip('.') or 'recipe'}: {message}"


def _require(condition: object, place: str, message: str) -> None:
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
            _require(shutter.length == "bars", f"shutters[{i}].trail", "a shutter has one length")
            _check_number(shutter.trail, f"shutters[{i}].trail", limits.MAX_DISTANCE)
        _require_within(shutter.follow_smooth, limits.MAX_SMOOTH, f"shutters[{i}].follow_smooth", 0)
        if shutter.threshold is not None:
            has_one = shutter.combine in ("lightest", "darkest")
            _require(has_one, f"shutters[{i}].threshold", "the lightest and the darkest alone have a threshold")
            _check_number(shutter.threshold, f"shutters[{i}].threshold", limits.MAX_THRESHOLD)
        _check_number(shutter.softness, f"shutters[{i}].softness", limits.MAX_THRESHOLD)
        is_soft = isinstance(shutter.softness, list) or shutter.softness != 0
        _require(shutter.threshold is not None or not is_soft, f"shutters[{i}].softness", "it has no threshold")
        chooses = shutter.combine in ("lightest", "darkest") or not shutter.by_luminance
        _require(chooses, f"shutters[{i}].by_luminance", "the lightest and the darkest alone go by it")
    _check_values(recipe.time, "time", limits.MAX_FRAME)
    _check_frames(recipe.camera, "camera")
    for k, key in enumerate(recipe.camera):
        _check_placement(key, f"camera[{k}]")
    _check_number(recipe.edge_aware, "edge_aware", 1)
    _require_within(recipe.plate_reach, limits.MAX_PLATE_REACH, "plate_reach", 0)
    _check_number(recipe.camera_influence, "camera_influence", 1)
    for i, region in enumerate(recipe.regions):
        there_is_none = f"there is no shutter {_shown(region.shutter)}"
        _require(region.shutter in places, f"regions[{i}].shutter", there_is_none)
        if isinstance(region, MatteRegion | RampRegion):
            _check_matte(region, f"regions[{i}]")
        else:
            _check_region(region, f"regions[{i}]")
    drawn = [region for region in recipe.regions if isinstance(region, Drawn)]
    points = sum(map(_most_points, drawn))
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


def _check_region(region: Region | OutlineRegion, place: str) -> None:
    _check_name(region.name, f"{place}.name")
    if isinstance(region, OutlineRegion):
        _check_number(region.width, f"{place}.width", limits.MAX_DISTANCE)
    else:
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


def _most_points(region: Drawn) -> int:
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
