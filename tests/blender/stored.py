"""What the extension has stored in the .blend file that is open, as plain data; and by which names it can."""

from collections.abc import Iterator
from typing import get_args, get_type_hints

import bpy

from shutter_addon.blender.data import data_format, fcurves, properties
from shutter_addon.core.recipes import records

PREFIX = "virtual_shutter"
OWNERS = {"Strip": bpy.types.Strip, "Annotation": bpy.types.Annotation}  # beside scenes; IDs' own are in both
NEVER_EQUAL = {"format", "version"}  # of a scene: who has saved it last
_BLENDERS_NAME = "Unique name used in the code"  # begins what Blender says of each group's own, which nothing uses


# The parts of a recipe, as saved versions name them.
RECORDS = {
    "CameraKey": records.MoveKey,
    "MatteRegion": records.MatteRecord,
    "OutlineRegion": records.OutlineRecord,
    "RampRegion": records.RampRecord,
    "Recipe": records.RecipeRecord,
    "Region": records.RegionRecord,
    "RegionKey": records.RegionKey,
    "Shutter": records.ShutterRecord,
    "ShutterKey": records.BarsKey,
    "StrokesKey": records.StrokesKey,
    "SubjectRegion": records.SubjectRecord,
    "ValueKey": records.ValueKey,
}


def values() -> dict:
    """All values, by names that are JSON's; numbers have seven digits, as float32 keeps them."""
    data = bpy.data
    return {
        "scenes": {scene.name: _group(scene.virtual_shutter, NEVER_EQUAL) for scene in data.scenes},
        "strips": {f"{scene.name}/{strip.name}": _own(strip) for scene in data.scenes for strip in _strips(scene)},
        "annotations": {each.name: _own(each) | {"drawn": _drawn(each)} for each in data.annotations},
        "cameras": {camera.name: _own(camera) for camera in data.cameras},
        "curves": {scene.name: _curves(scene) for scene in data.scenes if scene.animation_data},
    }


def missing(wanted, found, place: str = "") -> Iterator[str]:
    """Where what is found lacks a value that is wanted, or has another one. More may be there: it is newer."""
    if isinstance(wanted, dict) and isinstance(found, dict):
        for name, value in wanted.items():
            if name in found:
                yield from missing(value, found[name], f"{place}.{name}")
            else:
                yield f"{place}.{name}: gone"
    elif isinstance(wanted, list) and isinstance(found, list) and len(wanted) == len(found):
        for i, (one, other) in enumerate(zip(wanted, found, strict=True)):
            yield from missing(one, other, f"{place}[{i}]")
    elif wanted != found:
        yield f"{place}: {found!r}, not {wanted!r}"


def names() -> dict:
    """The properties by class, with the items of each that is an enum; and of recipes the fields, with their words."""
    classes = {cls.__name__: _properties(cls.bl_rna.properties) for cls in properties.classes}
    owned = {name: _properties(cls.bl_rna.properties, PREFIX) for name, cls in OWNERS.items()}
    hints = {name: get_type_hints(cls) for name, cls in RECORDS.items()}
    return {
        "format": data_format.FORMAT,
        "recipe": records.VERSION,
        "properties": classes | owned,
        "fields": {
            name: {field: sorted(set(map(str, _words(kind)))) for field, kind in fields.items()}
            for name, fields in hints.items()
        },
    }


def unused() -> set[str]:
    """The properties that are nowhere set in the file that is open: nothing would tell that they were lost."""
    found: dict[str, set[str]] = {name: set() for name in names()["properties"]}
    strips = [strip for scene in bpy.data.scenes for strip in _strips(scene)]
    for group in [scene.virtual_shutter for scene in bpy.data.scenes] + [
        strip.virtual_shutter_bake for strip in strips
    ]:
        _note_set(group, found)
    for name, owners in (("Strip", strips), ("Annotation", bpy.data.annotations)):
        found[name] = {p.identifier for each in owners for p in _own_props(each) if _is_set(each, p)}
    return {f"{name}.{prop}" for name, is_set in found.items() for prop in names()["properties"][name].keys() - is_set}


def _note_set(group, found: dict[str, set[str]]) -> None:
    for prop in _stored(group.bl_rna.properties):
        value = getattr(group, prop.identifier)
        if prop.type == "COLLECTION":
            for item in value:
                _note_set(item, found)
        elif isinstance(value, bpy.types.PropertyGroup):
            _note_set(value, found)
        if _is_set(group, prop):
            found[type(group).__name__].add(prop.identifier)


def _is_set(owner, prop) -> bool:
    value = getattr(owner, prop.identifier)
    return bool(value) if prop.type in ("COLLECTION", "POINTER") else _plain(value) != _default(prop)


def _default(prop):
    return _plain(prop.default_array if getattr(prop, "array_length", 0) else getattr(prop, "default", None))


def _stored(props, prefix: str = "") -> list:
    own = [prop for prop in props if prop.identifier != "rna_type" and prop.identifier.startswith(prefix)]
    return [prop for prop in own if not (prop.is_skip_save or prop.description.startswith(_BLENDERS_NAME))]


def _properties(props, prefix: str = "") -> dict[str, list[str]]:
    enums = {prop.identifier: prop for prop in _stored(props, prefix)}
    return {
        name: sorted(item.identifier for item in prop.enum_items) if prop.type == "ENUM" else []
        for name, prop in sorted(enums.items())
    }


def _words(kind) -> list:
    """The words that a field may be, however deep in its type."""
    arguments = get_args(kind)
    return [word for each in arguments for word in _words(each)] if arguments else [kind] * isinstance(kind, str | int)


def _own(owner) -> dict:
    return {p.identifier: _value(owner, p) for p in _own_props(owner)}


def _own_props(owner) -> list:
    return _stored(owner.bl_rna.properties, PREFIX)


def _group(group, left_out=frozenset()) -> dict:
    return {p.identifier: _value(group, p) for p in _stored(group.bl_rna.properties) if p.identifier not in left_out}


def _value(owner, prop):
    value = getattr(owner, prop.identifier)
    if prop.type == "COLLECTION":
        return [_group(item) for item in value]
    return _group(value) if isinstance(value, bpy.types.PropertyGroup) else _plain(value)


def _plain(value):
    if isinstance(value, bpy.types.ID):
        return value.name
    if isinstance(value, float):
        return float(f"{value:.7g}")
    return value if isinstance(value, str | int | None) else [_plain(each) for each in value]


def _strips(scene) -> list:
    return list(scene.sequence_editor.strips_all) if scene.sequence_editor else []


def _drawn(annotation) -> dict:
    """By layer and frame, the points of its strokes."""
    return {
        layer.info: {
            str(frame.frame_number): [[_plain(point.co) for point in stroke.points] for stroke in frame.strokes]
            for frame in layer.frames
        }
        for layer in annotation.layers
    }


def _curves(scene) -> dict:
    """The keys of each F-curve of an effect; one that leads nowhere is as good as gone."""
    found = {}
    for curve in fcurves.curves_under(scene, PREFIX):
        scene.path_resolve(curve.data_path)
        keys = [[*_plain(key.co), key.interpolation] for key in curve.keyframe_points]
        found[f"{curve.data_path}[{curve.array_index}]"] = keys
    return found
