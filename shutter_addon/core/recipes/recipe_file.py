"""Reading, checking and writing recipes as JSON files."""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from collections.abc import Callable
from dataclasses import MISSING, fields, is_dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any, Literal, NoReturn, get_args, get_origin, get_type_hints

from .. import atomic_write
from ..model import effect as model
from ..model import limits
from ..model.fields import fields_of
from ..model.frame_state import Options
from . import recipe_check, records
from .recipe import RecipeError
from .recipe_check import cut, shown

# Longer numbers are read as floats, since parsing huge integers takes long. No count needs as many digits.
_MAX_DIGITS = 300
_PLAIN = {int: "a whole number", str: "a text", bool: "true or false"}


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
    recipe = _reader(records.RecipeRecord)(data, "")
    recipe_check.check(recipe)
    return records.effect_of(recipe)


def dump(effect: model.Effect) -> str:
    """Return a recipe as JSON text that `parse` reads. Fields without meaning are left out."""
    text = json.dumps(_said(records.recipe_of(effect)), indent=1, ensure_ascii=False)
    # People edit these files: keep a list of numbers on one line. The pattern also matches strings, to skip them.
    return re.sub(r'"(?:[^"\\]|\\.)*"|\[[-+.\de,\s]+\]', _on_one_line, text) + "\n"


def _on_one_line(match: re.Match) -> str:
    text = match[0]
    return text if text[0] == '"' else " ".join(text.split()).replace("[ ", "[").replace(" ]", "]")


def save(effect: model.Effect, path: str | Path) -> None:
    """Write a recipe, whole or not at all. OSError: it cannot be written."""
    with atomic_write.writing(Path(path)) as part:
        part.write_text(dump(effect), encoding="utf-8")


# Defaults of fields that few recipes need; they are written only with another value.
_UNTOLD = {
    each.recipe: each.absent
    for each in fields_of(
        Options, model.Effect, model.Camera, model.Shutter, model.Region, model.OutlineRegion
    ).values()
    if each.recipe and not each.told
} | {"length": "bars", "keys": [], "not_strokes": [], "time": [], "camera": []}


def _said(value: Any) -> Any:
    """Return records as JSON data."""
    if is_dataclass(value):
        columns = {each.name: getattr(value, each.name) for each in fields(value)}
        told = {k: v for k, v in columns.items() if v is not None and (k not in _UNTOLD or v != _UNTOLD[k])}
        return {k: _said(v) for k, v in told.items()}
    return [_said(each) for each in value] if isinstance(value, list | tuple) else value


class _Doubled(dict):
    """A JSON object with a duplicate field, whose name is in `field`."""

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


# Checks a JSON value at a place in the recipe, and converts it to the type of a record's field.
Reader = Callable[[Any, str], Any]


@cache
def _reader(kind: Any) -> Reader:
    """Return the reader of a field's type."""
    if isinstance(kind, type) and is_dataclass(kind):
        return partial(_record, kind, _columns(kind))
    if kind in (float, int, str, bool):
        return _number if kind is float else partial(_exactly, kind)
    inner = get_args(kind)
    if get_origin(kind) is Literal:
        return partial(_choice, inner)
    if get_origin(kind) is list:
        return partial(_list, _reader(inner[0]))
    if get_origin(kind) is tuple:
        return partial(_tuple, [_reader(each) for each in inner])
    if kind == records.AnyRegionRecord:
        return _region
    if kind == records.Strokes:
        return _strokes
    read = _number_or_keys if float in inner else _reader(inner[0])
    return read if type(None) not in inner else lambda value, place: None if value is None else read(value, place)


def _refuse(place: str, fault: str) -> NoReturn:
    raise RecipeError(f"{place or 'recipe'}: {fault}")


def _exactly(kind: type, value: Any, place: str) -> Any:
    if type(value) is not kind:
        _refuse(place, f"{shown(value)} is not {_PLAIN[kind]}")
    return value


def _number(value: Any, place: str, otherwise: str = "") -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        _refuse(place, f"{shown(value)} is not a number{otherwise}")
    if not math.isfinite(value):
        _refuse(place, f"{value} is not a finite number{otherwise}")
    return float(value)


def _number_or_keys(value: Any, place: str) -> float | list[records.ValueKey]:
    if isinstance(value, list):
        return _reader(list[records.ValueKey])(value, place)
    return _number(value, place, ", nor a list of keys")


def _choice(allowed: tuple, value: Any, place: str) -> Any:
    if not any(type(value) is type(option) and value == option for option in allowed):
        _refuse(place, f"{shown(value)} is none of {', '.join(map(str, allowed))}")
    return value


def _list(read: Reader, value: Any, place: str) -> list:
    if not isinstance(value, list):
        _refuse(place, f"{shown(value)} is not a list")
    return [read(each, f"{place}[{index}]") for index, each in enumerate(value)]


def _tuple(readers: list[Reader], value: Any, place: str) -> tuple:
    if not isinstance(value, list):
        _refuse(place, f"{shown(value)} is not a list")
    if len(value) != len(readers):
        _refuse(place, f"{len(value)} values, not {len(readers)}")
    return tuple(read(each, place) for read, each in zip(readers, value, strict=True))


def _region(value: Any, place: str) -> Any:
    """Read a region by its field `kind`."""
    kind = value.get("kind", "line") if isinstance(value, dict) else "line"
    if not isinstance(kind, str) or kind not in records.KINDS:
        _refuse(f"{place}.kind", f"{shown(kind)} is none of {', '.join(records.KINDS)}")
    return _reader(records.KINDS[kind])(value, place)


def _strokes(value: Any, place: str) -> list:
    """Read strokes of the first frame, or of several frames."""
    is_keyed = isinstance(value, list) and value and isinstance(value[0], dict)
    return _reader(list[records.StrokesKey] if is_keyed else list[records.Stroke])(value, place)


def _columns(kind: type) -> dict[str, tuple[Reader, bool]]:
    """Return the readers of a record's fields, and whether a field is required."""
    types = get_type_hints(kind)
    return {
        each.name: (_reader(types[each.name]), each.default is MISSING and each.default_factory is MISSING)
        for each in fields(kind)
    }


def _record(kind: type, columns: dict[str, tuple[Reader, bool]], value: Any, place: str) -> Any:
    if not isinstance(value, dict):
        _refuse(place, f"{shown(value)} is not an object")
    if isinstance(value, _Doubled):
        _refuse(place, f"field {shown(value.field)} is given twice")
    said = {}
    for name, (read, is_required) in columns.items():
        where = f"{place}.{name}" if place else name
        if name in value:
            said[name] = read(value[name], where)
        elif is_required:
            _refuse(where, "missing")
    if unknown := sorted(value.keys() - columns.keys()):
        more = f" and {len(unknown) - 3} more" if len(unknown) > 3 else ""
        _refuse(place, f"unknown field {', '.join(map(cut, unknown[:3]))}{more}")
    return kind(**said)
