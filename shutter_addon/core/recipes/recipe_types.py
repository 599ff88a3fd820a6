"""The JSON of a recipe as records: each value is of its type, or the first fault is told."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import MISSING, fields, is_dataclass
from functools import cache, partial
from itertools import repeat
from types import NoneType
from typing import Any, Literal, get_args, get_origin, get_type_hints

Reader = Callable[[Any], Any]
_NAMES = {int: "a whole number", str: "a text", bool: "true or false"}


class FaultError(ValueError):
    """What is wrong with a value. place: where that is in what is read, as `.shutters[1].bars`"""

    def __init__(self, text: str, place: str = "") -> None:
        super().__init__(text)
        self.place = place

    def within(self, place: str) -> FaultError:
        self.place = place + self.place
        return self


class Object(dict[str, Any]):
    """An object of JSON. twice: a field that stands there twice, as nobody knows which one is meant; "": none"""

    def __init__(self, pairs: list[tuple[str, Any]]) -> None:
        super().__init__(pairs)
        self.twice = "" if len(self) == len(pairs) else Counter(name for name, _ in pairs).most_common(1)[0][0]


def shown(value: Any) -> str:
    """A value as JSON, or its first 40 characters; of large ones the rest is not looked at."""
    text = ""
    for part in json.JSONEncoder(ensure_ascii=False).iterencode(value):
        text += part
        if len(text) > 40:
            break
    return _cut(text)


def _cut(text: str) -> str:
    return text if len(text) <= 40 else text[:37] + "…"


@cache
def reader(kind: Any) -> Reader:
    """What makes a value of a type, of a dataclass as well, of what JSON holds. It raises Faults."""
    origin, inner = get_origin(kind), get_args(kind)
    if is_dataclass(kind):
        hints = get_type_hints(kind)
        return partial(_record, kind, {each.name: reader(hints[each.name]) for each in fields(kind)})
    if hasattr(kind, "KINDS"):
        return partial(_one_of, {word: reader(each) for word, each in kind.KINDS.items()})
    if origin is Literal:
        return partial(_choice, inner)
    if origin is list:
        return partial(_list, reader(inner[0]))
    if origin is tuple:
        return partial(_tuple, [reader(each) for each in inner])
    if inner:
        return partial(_either, NoneType in inner, [reader(each) for each in inner if each is not NoneType])
    return _number if kind is float else partial(_exactly, kind)


def _record(kind: Any, readers: Mapping[str, Reader], value: Any) -> Any:
    if not isinstance(value, Object):
        raise FaultError(f"{shown(value)} is not an object")
    if value.twice:
        raise FaultError(f"field {shown(value.twice)} stands there twice")
    said: dict[str, Any] = {}
    for name, read in readers.items():
        if name in value:
            try:
                said[name] = read(value[name])
            except FaultError as fault:
                raise fault.within(f".{name}") from None
        elif name in _required(kind):
            raise FaultError("missing", f".{name}")
    if unknown := sorted(value.keys() - readers.keys()):
        more = f" and {len(unknown) - 3} more" if len(unknown) > 3 else ""
        raise FaultError(f"unknown field {', '.join(map(_cut, unknown[:3]))}{more}")
    return kind(**said)


@cache
def _required(kind: Any) -> set[str]:
    return {each.name for each in fields(kind) if each.default is MISSING and each.default_factory is MISSING}


def _one_of(kinds: Mapping[str, Reader], value: Any) -> Any:
    """Which of several records it is, its field `kind` says; without one, the first."""
    first = next(iter(kinds))
    word = value.get("kind", first) if isinstance(value, dict) else first
    if not (isinstance(word, str) and word in kinds):
        raise FaultError(f"{shown(word)} is none of {', '.join(kinds)}", ".kind")
    return kinds[word](value)


def _list(read: Reader, value: Any) -> list[Any]:
    return _each(repeat(read), value)


def _tuple(readers: Sequence[Reader], value: Any) -> tuple[Any, ...]:
    if isinstance(value, list) and len(value) != len(readers):
        raise FaultError(f"{len(value)} values, not {len(readers)}")
    return tuple(_each(readers, value))


def _each(readers: Iterable[Reader], value: Any) -> list[Any]:
    if not isinstance(value, list):
        raise FaultError(f"{shown(value)} is not a list")
    made: list[Any] = []
    try:
        for each, read in zip(value, readers, strict=False):
            made.append(read(each))
    except FaultError as fault:
        raise fault.within(f"[{len(made)}]") from None
    return made


def _either(is_optional: bool, readers: Sequence[Reader], value: Any) -> Any:
    """Nothing, perhaps, or a value; of a number, or keys of it in its place."""
    if value is None and is_optional:
        return None
    if len(readers) == 1 or isinstance(value, list):
        return readers[-1](value)
    try:
        return readers[0](value)
    except FaultError as fault:
        raise FaultError(f"{fault}, nor a list of keys") from None


def _choice(allowed: Sequence[Any], value: Any) -> Any:
    if not any(type(value) is type(option) and value == option for option in allowed):
        raise FaultError(f"{shown(value)} is none of {', '.join(map(str, allowed))}")
    return value


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise FaultError(f"{shown(value)} is not a number")
    if not math.isfinite(value):
        raise FaultError(f"{value} is not a finite number")
    return float(value)


def _exactly(kind: type, value: Any) -> Any:
    if type(value) is not kind:
        raise FaultError(f"{shown(value)} is not {_NAMES[kind]}")
    return value
