"""Recipes as files: JSON text that is read into an effect, checked, and written."""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from collections.abc import Callable
from dataclasses import MISSING, fields, is_dataclass
from functools import cache, partial
from pathlib import Path
from types import NoneType
from typing import Any, get_args, get_origin, get_type_hints

from .. import atomic_write
from ..model import effect as model
from ..model import limits
from ..model.fields import fields_of
from ..model.frame_state import Options
from . import recipe_check, records
from .recipe import RecipeError
from .recipe_check import cut, shown

# Longer numbers are read as floats, which need no time for it; a whole number that counts anything is far shorter.
_MAX_DIGITS = 300


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


def parse(text: str) -> model.Effect:
    """Read the recipe in a JSON text. RecipeError: one sentence that names the place, as `shutters[1].bars: …`."""
    _check_size(text)
    try:
        data = json.loads(text.removeprefix("\ufeff"), object_pairs_hook=_object, parse_int=_whole)
    except json.JSONDecodeError as error:
        raise RecipeError(f"line {error.lineno}, column {error.colno}: not JSON ({error.msg})") from None
    except RecursionError:
        raise RecipeError("recipe: lists or objects within one another, too many") from None
    if isinstance(data, dict) and type(version := data.get("version")) is int and version > records.VERSION:
        newer = f"version: {shown(version)} is of a newer version of Virtual Shutter, this one reads {records.VERSION}"
        raise RecipeError(newer)
    if isinstance(data, dict) and data.get("version") == 1:
        data.pop("inbetween_method", None)  # there is one way by now
        if data.get("inbetween", 1) != 1:
            data.setdefault("skip_repeats", False)  # as it was
    try:
        recipe: Any = _reader(records.RecipeRecord)(data)
    except _FaultError as fault:
        raise RecipeError(f"{fault.place.lstrip('.') or 'recipe'}: {fault}") from None
    recipe_check.check(recipe)
    return records.effect_of(recipe)


def dump(effect: model.Effect) -> str:
    """Write a recipe as JSON text, which `parse` reads. Fields that carry nothing are left out."""
    text = json.dumps(_said(records.recipe_of(effect)), indent=1, ensure_ascii=False)
    # People read and edit these files: a list of numbers stays on one line. Texts are found as well, to be passed over.
    return re.sub(r'"(?:[^"\\]|\\.)*"|\[[-+.\de,\s]+\]', _on_one_line, text) + "\n"


def _on_one_line(match: re.Match) -> str:
    text = match[0]
    return text if text[0] == '"' else " ".join(text.split()).replace("[ ", "[").replace(" ]", "]")


def save(effect: model.Effect, path: str | Path) -> None:
    """Write a recipe whole or not at all. OSError: it cannot be written."""
    with atomic_write.writing(Path(path)) as part:
        part.write_text(dump(effect), encoding="utf-8")


# What few recipes need is said where it says something.
_UNTOLD = {
    each.recipe: each.absent
    for each in fields_of(
        Options, model.Effect, model.Camera, model.Shutter, model.Region, model.OutlineRegion
    ).values()
    if each.recipe and not each.told
} | {"length": "bars", "keys": [], "time": [], "camera": []}


def _said(value: Any) -> Any:
    """Records as JSON has them."""
    if is_dataclass(value):
        columns = {each.name: getattr(value, each.name) for each in fields(value)}
        told = {k: v for k, v in columns.items() if v is not None and (k not in _UNTOLD or v != _UNTOLD[k])}
        return {k: _said(v) for k, v in told.items()}
    return [_said(each) for each in value] if isinstance(value, list | tuple) else value


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


class _FaultError(ValueError):
    """What is wrong with a value of JSON; place: where in it, as `.bars[3]`."""

    def __init__(self, message: str, place: str = "") -> None:
        super().__init__(message)
        self.place = place


@cache
def _reader(kind: Any) -> Callable[[Any], Any]:
    """What makes of a value of JSON one of the records' types. It raises _FaultError."""
    inner = get_args(kind)
    if kind in _SPECIAL:
        return _SPECIAL[kind]
    if is_dataclass(kind):
        return partial(_record, kind, {name: _reader(each) for name, each in get_type_hints(kind).items()})
    if NoneType in inner:
        read = _reader(inner[0] if len(inner) == 2 else records.Keyable)
        return lambda value: None if value is None else read(value)
    if get_origin(kind) is list:
        return partial(_list, _reader(*inner))
    if get_origin(kind) is tuple:
        return partial(_tuple, [_reader(each) for each in inner])
    return partial(_choice, inner)


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise _FaultError(f"{shown(value)} is not a number")
    if not math.isfinite(value):
        raise _FaultError(f"{value} is not a finite number")
    return float(value)


def _number_or_keys(value: Any) -> Any:
    if isinstance(value, list):
        return _reader(list[records.ValueKey])(value)
    try:
        return _number(value)
    except _FaultError as fault:
        raise _FaultError(f"{fault}, nor a list of keys") from None


def _exactly(kind: type, name: str, value: Any) -> Any:
    if type(value) is not kind:
        raise _FaultError(f"{shown(value)} is not {name}")
    return value


def _choice(allowed: tuple, value: Any) -> Any:
    if not any(type(value) is type(option) and value == option for option in allowed):
        raise _FaultError(f"{shown(value)} is none of {', '.join(map(str, allowed))}")
    return value


def _list(read: Callable[[Any], Any], value: Any) -> list:
    items, found = _exactly(list, "a list", value), []
    try:
        for each in items:
            found.append(read(each))
    except _FaultError as fault:
        raise _FaultError(str(fault), f"[{len(found)}]{fault.place}") from None
    return found


def _tuple(reads: list[Callable[[Any], Any]], value: Any) -> tuple:
    if len(_exactly(list, "a list", value)) != len(reads):
        raise _FaultError(f"{len(value)} values, not {len(reads)}")
    return tuple(read(each) for read, each in zip(reads, value, strict=True))


def _record(kind: Any, reads: dict[str, Callable[[Any], Any]], value: Any) -> Any:
    if not isinstance(value, dict):
        raise _FaultError(f"{shown(value)} is not an object")
    if isinstance(value, _Doubled):
        raise _FaultError(f"field {shown(value.field)} stands there twice")
    found = {}
    for each in fields(kind):
        try:
            if each.name in value:
                found[each.name] = reads[each.name](value[each.name])
            elif each.default is each.default_factory is MISSING:
                raise _FaultError("missing")
        except _FaultError as fault:
            raise _FaultError(str(fault), f".{each.name}{fault.place}") from None
    if names := sorted(value.keys() - reads.keys()):
        more = f" and {len(names) - 3} more" if len(names) > 3 else ""
        raise _FaultError(f"unknown field {', '.join(map(cut, names[:3]))}{more}")
    return kind(**found)


def _one_region(value: Any) -> Any:
    """Which of the kinds of regions it is, its field `kind` says."""
    word = value.get("kind", "line") if isinstance(value, dict) else "line"
    if not isinstance(word, str) or word not in records.KINDS:
        raise _FaultError(f"{shown(word)} is none of {', '.join(records.KINDS)}", ".kind")
    return _reader(records.KINDS[word])(value)


_SPECIAL: dict[Any, Callable[[Any], Any]] = {
    float: _number,
    records.Keyable: _number_or_keys,
    records.AnyRegionRecord: _one_region,
    int: partial(_exactly, int, "a whole number"),
    str: partial(_exactly, str, "a text"),
    bool: partial(_exactly, bool, "true or false"),
}
