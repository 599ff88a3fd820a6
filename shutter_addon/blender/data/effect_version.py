"""The version of an effect: a key that is the same as long as its pictures are, wherever its strips lie on the timeline
and its files in the file system. What is baked has the key of what it was made of."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...core.messages import UserError
from ...media import MediaError, inbetween_cache
from . import colour_configuration, snapshot, strips, versions

_BLOCKS = 1 << 16  # bytes of a file above which blocks of it are read, and not all
# Fields that hold timeline frames: they count from the effect strip's origin. In mappings the keys are frames, in
# sequences of pairs the first of each.
_FRAMES = {
    "Samples": {"values", "keys"},
    "Keys": {"frames"},
    "Bars": {"keys"},
    "Drawings": {"frames"},
    "StripTiming": {"content_start", "content_end"},
}
# Fields that say nothing of the pictures: names, where a strip was cut, when a file was written.
_LEFT_OUT = {
    "StripTiming": {"name", "left_handle"},
    "SourceSpec": {"key"},
    "MatteFile": {"stamp"},
    "CarriedFile": {"folder"},
}


def frames_of(strip) -> range:
    """The frames that an effect strip shows, counted from its origin: the same for all parts of a cut strip."""
    start = round(strips.origin(strip))
    return range(strip.left_handle - start, strip.right_handle - start)


def key(scene, effect, strip, frames: range) -> str:
    """16 hexadecimal digits; frames: as frames_of. EffectError, MediaError: the effect cannot be shown."""
    start = round(strips.origin(strip))
    taken = snapshot.take(scene, effect, strip, [start + frame for frame in frames])
    return of_snapshot(taken, start, frames)


def of_snapshot(taken: snapshot.Snapshot, start: int, frames: range) -> str:
    """As `key`, of the effect at `frames` after the timeline frame `start`."""
    digest = _Digest(start)
    size = None if taken.inbetween is None else (taken.inbetween.factor, taken.inbetween.method)
    parts = taken.effect, taken.timing, taken.source, size, (frames.start, frames.stop)
    digest.add((versions.extension(), colour_configuration.name(), *parts))
    return digest.hexadecimal[:16]


class _Digest:
    """A hash of plain data; start: the timeline frame that frames count from."""

    def __init__(self, start: int):
        self._hash, self._start = hashlib.sha256(), start

    @property
    def hexadecimal(self) -> str:
        return self._hash.hexdigest()

    def _feed(self, *texts: Any) -> None:
        for text in texts:
            self._hash.update(repr(text).encode() + b"\0")

    def add(self, value: Any) -> None:
        if isinstance(value, np.ndarray):
            self._feed(value.dtype.str, value.shape)
            self._hash.update(np.ascontiguousarray(value).tobytes())
        elif isinstance(value, Path):
            self._feed(_content(value))
        elif is_dataclass(value):
            self._add_fields(value)
        elif isinstance(value, Mapping):
            self._add_all(sorted(value.items(), key=repr))
        elif isinstance(value, list | tuple | frozenset | set | range):
            self._add_all(sorted(value, key=repr) if isinstance(value, frozenset | set) else value)
        elif isinstance(value, UserError):
            self._feed("error", str(value))
        else:
            self._feed(value)

    def _add_all(self, values: Iterable) -> None:
        values = list(values)
        self._feed(len(values))
        for value in values:
            self.add(value)

    def _add_fields(self, value: Any) -> None:
        name = type(value).__name__
        self._feed(name)
        for field in fields(value):
            if field.name in _LEFT_OUT.get(name, ()):
                continue
            content = getattr(value, field.name)
            if name == "SourceSpec" and field.name == "options":
                content = {option: each for option, each in content.items() if option != "config"}
            if field.name in _FRAMES.get(name, ()):
                content = _shifted(content, -self._start)
            self._feed(field.name)
            self.add(content)


def _shifted(value: Any, by: float) -> Any:
    """Frames, moved: a number, numbers, pairs that begin with one, or a mapping from numbers."""
    if isinstance(value, Mapping):
        return {_shifted(frame, by): each for frame, each in value.items()}
    if isinstance(value, list | tuple):
        return tuple((each[0] + by, *each[1:]) if isinstance(each, tuple) else each + by for each in value)
    return value if value is None else float(value + by)


def _content(path: Path) -> str:
    try:
        return inbetween_cache.content_digest(path, _BLOCKS).hex()
    except MediaError as error:
        return f"missing: {error}"
