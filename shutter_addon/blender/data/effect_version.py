"""The version of an effect: a key that is the same as long as its pictures are, wherever its strips lie on the timeline
and its files in the file system. What is baked has the key of what it was made of."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from numbers import Number
from pathlib import Path
from typing import Any

import numpy as np
from bpy.types import FCurve, PropertyGroup, Scene, Strip, bpy_struct

from ...core.messages import UserError
from ...media import MediaError
from ...media.sequence import sequence_files
from . import colour_configuration, fcurves, geometry, snapshot, strips, versions

# Fields that hold timeline frames: they count from the effect strip's origin. In mappings the keys are frames, in
# sequences of pairs the first of each.
_FRAMES = {
    "Samples": {"values", "keys"},
    "Keys": {"frames"},
    "Bars": {"keys"},
    "Drawings": {"frames"},
    "FileFrames": {"first"},
    "StripTiming": {"content_start", "content_end"},
}
# Fields that say nothing of the pictures: names, where a strip was cut, when a file was written.
_LEFT_OUT = {
    "StripTiming": {"name", "left_handle", "is_known"},
    "SourceSpec": {"key"},
    "MatteFile": {"stamp"},
    "CarriedFile": {"folder"},
    "Options": {"slid"},
    "Shutter": {"name", "color"},
    "Region": {"name"},
    "MatteRegion": {"name"},
    "OutlineRegion": {"name"},
    "Drawings": {"name"},
}
_POINTS = ("co", "handle_left", "handle_right")


def frames_of(strip: Strip) -> range:
    """The frames that an effect strip shows, counted from its origin: the same for all parts of a cut strip."""
    start = round(strips.origin(strip))
    return range(strip.left_handle - start, strip.right_handle - start)


def key(scene: Scene, effect: PropertyGroup, strip: Strip, frames: range) -> str:
    """16 hexadecimal digits; frames: as frames_of. EffectError, MediaError: the effect cannot be shown."""
    start = round(strips.origin(strip))
    taken = snapshot.take(scene, effect, strip, [start + frame for frame in frames])
    rate = None if taken.timing else scene.render.fps / scene.render.fps_base  # a timing has it
    parts: list[object] = [versions.extension(), colour_configuration.name(), taken.effect, taken.timing, taken.source]
    parts += [rate, frames.start, frames.stop, _curves(scene, f"{effect.path_from_id()}.", start)]
    if placed := _curves(scene, f"{strip.path_from_id()}.transform.", start):
        keyed = {path for path, *_ in placed}
        parts += [placed, [getattr(strip.transform, name) for name in geometry.TRANSFORM if name not in keyed]]
    return hashlib.sha256(repr(_told(parts, start)).encode()).hexdigest()[:16]


def is_changed(scene: Scene, effect: PropertyGroup, strip: Strip) -> bool:
    """Whether an effect is another than when its strip was baked, or cannot be shown any more."""
    bake, frames = strip.virtual_shutter_bake, frames_of(strip)
    if frames.start < bake.first or frames.stop > bake.first + bake.count:
        return True  # it has become longer
    try:
        return key(scene, effect, strip, range(bake.first, bake.first + bake.count)) != bake.version
    except (UserError, MemoryError):
        return True


def _curves(scene: Scene, path: str, start: int) -> list[tuple]:
    """The F-curves below a path, as plain data."""
    found = fcurves.curves_under(scene, path)
    return sorted(((curve.data_path.removeprefix(path), *_curve(curve, start)) for curve in found), key=lambda c: c[:2])


def _curve(curve: FCurve, start: int) -> tuple:
    """An F-curve, its frames from `start` on; these are rounded, as floats of other frames are others."""
    points = np.empty((len(_POINTS), len(curve.keyframe_points), 2), np.float32)
    for name, values in zip(_POINTS, points, strict=True):
        flat = np.empty(values.size, np.float32)
        curve.keyframe_points.foreach_get(name, flat)
        values[:] = flat.reshape(values.shape)
    points[..., 0] = np.round(points[..., 0] - start, 2) + 0.0
    kinds = tuple((p.interpolation, p.easing, p.amplitude, p.back, p.period) for p in curve.keyframe_points)
    changes = tuple((each.type, each.mute, repr(_plain(each))) for each in curve.modifiers)
    return curve.array_index, curve.mute, curve.extrapolation, points, kinds, changes


def _plain(modifier: bpy_struct) -> list:
    """All that it is, in plain data."""
    plain: list = []
    for prop in modifier.bl_rna.properties:
        value = getattr(modifier, prop.identifier)
        if prop.type == "COLLECTION":
            plain += [_plain(item) for item in value]
        elif prop.type in ("INT", "FLOAT", "BOOLEAN", "ENUM"):
            plain.append((prop.identifier, tuple(value) if getattr(prop, "is_array", False) else value))
    return plain


def _told(value: Any, start: float) -> object:
    """Plain data, nested, whose `repr` is equal for equal values; start: the timeline frame that frames count from."""
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, value.tobytes()
    if isinstance(value, Path):
        return _told([value], start)
    if is_dataclass(value):
        return type(value).__name__, _fields(value, start)
    if isinstance(value, UserError):
        return "error", str(value)
    if isinstance(value, Mapping):
        return sorted((_told(pair, start) for pair in value.items()), key=repr)
    if not isinstance(value, list | tuple | frozenset | set | range):
        return value
    paths = [each for each in value if isinstance(each, Path)]
    if paths and len(paths) == len(value):
        digests = zip(paths, versions.digests(paths), strict=True)
        return [digest or f"missing: {path.name}" for path, digest in digests]
    told = [_told(each, start) for each in value]
    return sorted(told, key=repr) if isinstance(value, frozenset | set) else told


def _fields(value: Any, start: float) -> object:
    """What the fields of a dataclass say of the pictures."""
    name = type(value).__name__
    if name == "Samples" and all(map(_is_number, value.values.values())):
        # Where they come from is known by their curve; of it Blender gives other floats at other frames.
        first = next(iter(value.values.values()))
        return _told(np.round(np.asarray(first, np.float64), 5) + 0.0, start)
    told = []
    for field in fields(value):
        if field.name in _LEFT_OUT.get(name, ()):
            continue
        content = getattr(value, field.name)
        if name == "SourceSpec" and field.name == "options":
            content = {option: each for option, each in content.items() if option != "config"}
        if name == "MatteFile" and field.name == "files":
            content = _files(value.path, content)
        if field.name in _FRAMES.get(name, ()):
            content = _shifted(content, -start)
        told.append((field.name, _told(content, start)))
    return told


def _is_number(value: object) -> bool:
    """Whether it is a number, or several."""
    if isinstance(value, tuple | list):
        return all(map(_is_number, value))
    return isinstance(value, Number | np.ndarray)


def _shifted(value: Any, by: float) -> Any:
    """Frames, moved: a number, numbers, pairs that begin with one, or a mapping from numbers."""
    if isinstance(value, Mapping):
        return {_shifted(frame, by): each for frame, each in value.items()}
    if isinstance(value, list | tuple):
        return tuple((each[0] + by, *each[1:]) if isinstance(each, tuple) else each + by for each in value)
    return value if value is None else float(value + by)


def _files(path: Path, files: Sequence | None) -> list[Path]:
    """The files of a matte; files: as it names them."""
    if files is not None:
        return [path.parent / file for file in files]
    try:
        return sequence_files(path)
    except MediaError:  # it is a movie, or whoever reads it is told
        return [path]
