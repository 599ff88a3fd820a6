"""Reading, checking and writing recipes as JSON files."""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import MISSING, Field, fields, is_dataclass
from functools import cache, partial
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from .. import atomic_write
from ..model import effect as model
from ..model import limits, shutters
from ..model.frame_state import EXTREMES
from . import records
from .recipe import CAMERA, RecipeError
from .records import drawn_in


def load(path: str | Path) -> model.Effect:
    """Read the recipe in a JSON file. RecipeError: it cannot be read, or breaks the format."""
    try:
        return parse(_read(Path(path)))
    except OSError as error:
        raise RecipeError(f"{path}: {error.strerror or error}") from None
    except UnicodeDecodeError:
        raise RecipeError(f"{path}: not a text file in UTF-8") from None
    except ValueError as error:  # RecipeError, or a name that no file can have
        raise RecipeError(f"{path}: {error}") from None


def _read(path: Path) -> str:
    """Return a file's text.

    Raises:
        RecipeError, OSError, ValueError: It cannot be read, or is too large.
    """
    if path.exists() and not (path.is_file() or path.is_dir()):
        # Opening a pipe would wait forever, and a device has no end.
        raise RecipeError("a pipe or a device, not a file")
    with path.open("rb") as file:
        data = file.read(limits.MAX_BYTES + 1)
    _check_size(data)
    return data.decode("utf-8")


def _check_size(text: str | bytes) -> None:
    if len(text) > limits.MAX_BYTES:
        raise RecipeError(f"more than {limits.MAX_BYTES // 1_000_000} MB, which no recipe has")


def parse(text: str) -> model.Effect:
    """Read the recipe in a JSON text. RecipeError: one sentence that begins with the place, like `shutters[1].bars`."""
    _check_size(text)
    try:
        data = json.loads(text.removeprefix("\ufeff"), object_pairs_hook=_object, parse_int=_whole)
    except json.JSONDecodeError as error:
        raise RecipeError(f"line {error.lineno}, column {error.colno}: not JSON ({error.msg})") from None
    except RecursionError:
        raise RecipeError("recipe: too many lists or objects within each other") from None
    if isinstance(data, dict) and type(version := data.get("version")) is int and version > records.VERSION:
        newer = f"version: {shown(version)} is of a newer version of Virtual Shutter, this one reads {records.VERSION}"
        raise RecipeError(newer)
    if isinstance(data, dict) and data.get("version") == 1:
        data.pop("inbetween_method", None)  # only one method is left
        if data.get("inbetween", 1) != 1:
            data.setdefault("skip_repeats", False)  # the behaviour of version 1
    try:
        recipe = _reader(records.RecipeRecord)(data)
    except _FaultError as fault:
        raise RecipeError(f"{fault.place.lstrip('.') or 'recipe'}: {fault}") from None
    check(recipe)
    return records.effect_of(recipe)


def dump(effect: model.Effect) -> str:
    """Return a recipe as JSON text that `parse` reads. Fields without meaning are left out."""
    text = json.dumps(records.recipe_of(effect), indent=1, ensure_ascii=False)
    # People edit these files: keep a list of numbers on one line. The pattern also matches strings, to skip them.
    return re.sub(r'"(?:[^"\\]|\\.)*"|\[[-+.\de,\s]+\]', _on_one_line, text) + "\n"


def _on_one_line(match: re.Match) -> str:
    text = match[0]
    return text if text[0] == '"' else " ".join(text.split()).replace("[ ", "[").replace(" ]", "]")


def save(effect: model.Effect, path: str | Path) -> None:
    """Write a recipe, whole or not at all. OSError: it cannot be written."""
    with atomic_write.writing(Path(path)) as part:
        part.write_text(dump(effect), encoding="utf-8")


def _object(pairs: list) -> dict:
    made = dict(pairs)
    if len(made) < len(pairs):
        twice = Counter(name for name, _ in pairs).most_common(1)[0][0]
        raise RecipeError(f"recipe: field {shown(twice)} is given twice")
    return made


def _whole(digits: str) -> int | float:
    # Longer numbers are read as floats, since parsing huge integers takes long. No count needs as many digits.
    return int(digits) if len(digits) <= 300 else float(digits)


class _FaultError(Exception):
    """A value breaks the format. `place` says where, like `.shutters[1].bars`."""

    def __init__(self, message: str, place: str = "") -> None:
        super().__init__(message)
        self.place = place


@cache
def _reader(kind: Any) -> Callable[[Any], Any]:
    """Return a function that checks a value of JSON and converts it to a type of records.py, or raises _FaultError."""
    origin, inner = get_origin(kind), get_args(kind)
    if is_dataclass(kind):
        parts: list[Any] = [*fields(kind)]
        return partial(_record, kind, {each.name: (_reader(each.type), each) for each in parts})
    if origin is Annotated:
        return partial(_within, _reader(inner[0]), *inner[1])
    if origin is Literal:
        return partial(_choice, inner)
    if origin in (Union, UnionType):
        return partial(_union, kind)
    if origin is not None:
        return partial(_items, kind, _reader(inner[0]))
    return _number if kind is float else partial(_exactly, kind)


def _record(kind: Any, readers: Mapping[str, tuple[Callable, Field]], value: Any) -> Any:
    if not isinstance(value, dict):
        raise _FaultError(f"{shown(value)} is not an object")
    made, name = {}, ""
    try:
        for name, (read, each) in readers.items():
            if name in value:
                made[name] = read(value[name])
            elif each.default is MISSING and each.default_factory is MISSING:
                raise _FaultError("missing")
    except _FaultError as fault:
        fault.place = f".{name}{fault.place}"
        raise
    if unknown := sorted(value.keys() - readers.keys()):
        more = f" and {len(unknown) - 3} more" if len(unknown) > 3 else ""
        raise _FaultError(f"unknown field {', '.join(map(cut, unknown[:3]))}{more}")
    return kind(**made)


def _items(kind: Any, read: Callable, value: Any) -> list | tuple:
    """Read a list, or a tuple whose items have one type."""
    origin, inner = get_origin(kind), get_args(kind)
    if not isinstance(value, list):
        raise _FaultError(f"{shown(value)} is not a list")
    if origin is tuple and len(value) != len(inner):
        raise _FaultError(f"{len(value)} values, not {len(inner)}")
    made: list[Any] = []
    try:
        for each in value:
            item = read(each)
            if made and hasattr(item, "frame") and item.frame <= made[-1].frame:
                raise _FaultError(f"{plain(item.frame)} does not follow {plain(made[-1].frame)}", ".frame")
            made.append(item)
    except _FaultError as fault:
        fault.place = f"[{len(made)}]{fault.place}"
        raise
    return made if origin is list else tuple(made)


def _union(kind: Any, value: Any) -> Any:
    """Read a region, a number or its keys, strokes of the first frame or of several, or what may be null."""
    first, *others = get_args(kind)
    if kind == records.AnyRegionRecord:
        word = value.get("kind", "line") if isinstance(value, dict) else "line"
        if not isinstance(word, str) or word not in records.KINDS:
            raise _FaultError(f"{shown(word)} is none of {', '.join(records.KINDS)}", ".kind")
        return _reader(records.KINDS[word])(value)
    if value is None and others[-1] is NoneType:
        return None
    is_keyed = isinstance(value, list) and (kind != records.Strokes or (value and isinstance(value[0], dict)))
    return _reader(first if others[0] is NoneType or not is_keyed else others[0])(value)


def _within(read: Callable, least: float, most: float, empty: str, value: Any) -> Any:
    """Read a number, a text or a list of a limited range or length."""
    made = read(value)
    if isinstance(made, str | list):
        if len(made) > most or len(made) < least:
            many = f"{len(made)}{' characters' * isinstance(made, str)}, the most are {most}"
            raise _FaultError(many if made else empty)
        wrong = next((c for c in made if c == "\0" or "\ud800" <= c <= "\udfff"), "") if isinstance(made, str) else ""
        if wrong:
            raise _FaultError(f"U+{ord(wrong):04X} is not allowed in a name")
    elif not least <= made <= most:
        raise _FaultError(f"{plain(made)} is not {plain(least)} to {plain(most)}")
    return made


def _choice(allowed: tuple, value: Any) -> Any:
    if not any(type(value) is type(option) and value == option for option in allowed):
        raise _FaultError(f"{shown(value)} is none of {', '.join(map(str, allowed))}")
    return value


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise _FaultError(f"{shown(value)} is not a number")
    if not math.isfinite(value):
        raise _FaultError(f"{value} is not a finite number")
    return float(value)


_NAMES = {int: "a whole number", str: "a text", bool: "true or false"}


def _exactly(kind: type, value: Any) -> Any:
    if type(value) is not kind:
        raise _FaultError(f"{shown(value)} is not {_NAMES[kind]}")
    return value


def shown(value: Any) -> str:
    """Return a value as JSON, cut to 40 characters without formatting the rest."""
    text = ""
    for part in json.JSONEncoder(ensure_ascii=False).iterencode(value):
        text += part
        if len(text) > 40:
            break
    return cut(text)


def cut(text: str) -> str:
    return text if len(text) <= 40 else text[:37] + "…"


def plain(number: float) -> str:
    return shown(number) if isinstance(number, int) else f"{number:.10g}"


def _require(condition: object, place: str, message: str) -> None:
    if not condition:
        raise RecipeError(f"{place}: {message}")


def check(recipe: Any) -> None:
    """Check the record of a recipe.

    Raises:
        RecipeError: It does not describe a valid effect.
    """
    _require(recipe.version > 1 or recipe.inbetween != "auto", "inbetween", 'recipes have "auto" from version 2 on')
    places: dict[str, int] = {}
    for i, shutter in enumerate(recipe.shutters):
        place = f"shutters[{i}]"
        taken = places.setdefault(shutter.name, i)
        _require(taken == i, f"{place}.name", f"{shown(shutter.name)} is taken by shutters[{taken}]")
        _check_bars(shutter, recipe.window, place)
        _check_follow(shutter.follow, recipe.regions, f"{place}.follow")
        _check_exposure(shutter, place)
    points = 0
    for i, region in enumerate(recipe.regions):
        _require(region.shutter in places, f"regions[{i}].shutter", f"there is no shutter {shown(region.shutter)}")
        points += _check_drawn(region, f"regions[{i}]")
    _require(points <= limits.MAX_POINTS, "regions", f"{points} points at once, the most are {limits.MAX_POINTS}")


def _check_bars(shutter: Any, window: int, place: str) -> None:
    _require((shutter.bars is None) != (not shutter.keys), place, "either bars or keys, one of the two")
    said = {f"{place}.keys[{k}].bars": key.bars for k, key in enumerate(shutter.keys)}
    for where, bars in (said or {f"{place}.bars": shutter.bars}).items():
        _require(len(bars) == window, where, f"{len(bars)} values, window is {window}")
        try:
            shutters.check_bars(bars)
        except shutters.ShutterError as error:
            raise RecipeError(f"{where}: {error}") from None


def _check_exposure(shutter: Any, place: str) -> None:
    """Check settings of a shutter that depend on each other."""
    if shutter.trail is not None:
        _require(shutter.follow, f"{place}.trail", "the shutter follows nothing that moves")
        _require(shutter.length == "bars", f"{place}.trail", "a shutter has one length")
    chooses = shutter.combine in EXTREMES
    has_threshold = shutter.threshold is not None
    _require(chooses or not has_threshold, f"{place}.threshold", "only lightest and darkest have a threshold")
    is_soft = isinstance(shutter.softness, list) or shutter.softness != 0
    _require(has_threshold or not is_soft, f"{place}.softness", "it has no threshold")
    _require(chooses or not shutter.by_luminance, f"{place}.by_luminance", "only lightest and darkest use it")


def _check_follow(follow: str | None, regions: list, place: str) -> None:
    """Check that a shutter follows one region, or the camera."""
    if follow is None:
        return
    called = [f"regions[{i}]" for i, region in enumerate(regions) if region.name == follow]
    if follow == CAMERA:
        _require(not called, place, f"{shown(follow)} is the camera, and {', '.join(called[:1])} as well")
        return
    _require(follow, place, "empty: it names a region, or is " + shown(CAMERA))
    _require(called, place, f"there is no region {shown(follow)}")
    _require(len(called) == 1, place, f"{shown(follow)} is the name of {' and '.join(called[:2])}")


def _check_drawn(region: Any, place: str) -> int:
    """Check a region's drawings, and return the points of the largest."""
    drawn = drawn_in(region)
    if not drawn:
        return 0
    shapes = [strokes for name in ("drawings", "outlines") for _, strokes, _ in drawn.get(name, ())]
    _require(any(shapes) if len(drawn) > 1 else shapes and shapes[0], f"{place}.strokes", "empty: nothing is drawn")
    every = [each for drawings in drawn.values() for each in drawings]
    if len(drawn) > 1 or any(key.strokes is not None for key in region.keys):
        for frame, *_ in every:
            _require(frame == int(frame), place, f"{plain(frame)} is not a whole frame, but has strokes")
    return max(sum(map(len, strokes)) for _, strokes, _ in every)
