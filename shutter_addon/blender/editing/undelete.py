"""Effects kept in memory: removed ones, so that a strip which is cut and pasted gets its effect back, and the one that
Copy Effect took.

Blender's clipboard holds a Scene strip without its scene, and outlives the file that the strip was cut from.
"""

from __future__ import annotations

import bpy
from bpy.types import PropertyGroup, Scene, Strip, bpy_prop_collection, bpy_struct

from ...core.memo import Kept
from ..data import data_format, fcurves, property_copy, recipe_import, strips
from ..data.annotations import annotation
from . import add_effect, match_source

_MOST = 64
_COPIED = "copied"  # in place of an identity
_OWN = {"name", "identity", "source", "start"}  # of an effect, what stays where another one is pasted over it
_effects: Kept[str, dict] = Kept()


def keep(effect: PropertyGroup) -> None:
    """Keeps an effect that is about to be removed, under its scene's identity: properties, F-curves, annotations."""
    if effect.scene is not None and effect.scene.virtual_shutter.identity:
        _keep(effect.scene.virtual_shutter.identity, effect)


def copy(effect: PropertyGroup, strip: Strip) -> None:
    """Keeps an effect, as its strip shows it, for `paste`."""
    first, skipped, places = strip.left_handle, strips.skipped(strip), match_source.places(effect, strip)
    _keep(_COPIED, effect, first=first, skipped=skipped, places=places)


def has_copy() -> bool:
    return _COPIED in _effects


def forget_copy() -> None:
    """Keeps no copied effect any more: before another file is loaded, which has not the images that it points to."""
    _effects.pop(_COPIED, None)


def paste(effect: PropertyGroup, strip: Strip) -> None:
    """Replaces an effect's shutters, regions, keys and options by those of the copied one. Frames count from the first
    that a strip shows; drawings lie on the picture as they did."""
    data, scene = _effects[_COPIED], effect.id_data
    recipe_import.clear(scene, effect)
    _restore(scene, effect, data, {name: value for name, value in data["effect"].items() if name not in _OWN})
    fcurves.move_curves(scene, effect.path_from_id() + ".", strip.left_handle - data["first"])
    for drawing in [drawing for layer in annotation(effect).layers for drawing in layer.frames]:
        drawing.frame_number += strip.left_handle - data["first"]
    match_source.put_back(effect, strip, data["places"])
    later = strips.skipped(strip) - data["skipped"]
    drawn = [place for region in effect.regions for place in region.drawn]
    for noted in [*drawn, *(stop for moving in (effect.camera, *effect.regions) for stop in moving.stops)]:
        noted.frame += later
    for region in effect.regions:
        region.follow_frame += later
        region.offset -= later if region.timing == "TIMELINE" else 0


def _keep(identity: str, effect: PropertyGroup, **more: object) -> None:
    scene, effect_scene, path = effect.id_data, effect.scene, effect.path_from_id()
    layers = effect_scene.annotation.layers if effect_scene.annotation else ()
    curves = [property_copy.plain(curve) for curve in fcurves.curves_under(scene, path + ".")]
    for curve in curves:
        curve["data_path"] = curve["data_path"].removeprefix(path)
    kept = more | {
        "scene": (effect_scene.name, (effect_scene.render.resolution_x, effect_scene.render.resolution_y)),
        "format": scene.virtual_shutter.format,
        "effect": property_copy.plain(effect),
        "curves": curves,
        "layers": [property_copy.plain(layer) for layer in layers],
    }
    _effects.keep(identity, kept, _MOST)


def forget() -> None:
    """Keeps nothing any more: when the extension goes."""
    _effects.clear()


def restore(scene: Scene, identity: str) -> Scene | None:
    """Makes a kept effect again in a scene. Returns the effect scene; None: none was kept under this identity."""
    if (data := _effects.get(identity)) is None:
        return None
    effect_scene = add_effect.new_effect_scene(scene, identity, *data["scene"])
    effect = data_format.new_effect(scene, data["format"])
    effect.scene = effect_scene
    _restore(scene, effect, data, data["effect"])
    return effect_scene


def _restore(scene: Scene, effect: PropertyGroup, data: dict, content: dict) -> None:
    """Gives an effect the content, keys and drawings of a kept one."""
    _fill(effect, content)
    for plain in data["curves"]:
        path = effect.path_from_id() + plain["data_path"]
        curve = fcurves.new_curve(scene, path, plain["array_index"])
        _fill(curve, plain | {"data_path": path})
        curve.update()
    for plain in data["layers"]:
        _fill(annotation(effect).layers.new(plain["info"], set_active=False), plain)


def _fill(struct: bpy_struct, plain: dict) -> None:
    for name, value in plain.items():
        if isinstance(value, list):
            for item in value:
                _fill(_add(getattr(struct, name), name, item), item)
        elif isinstance(value, dict):
            _fill(getattr(struct, name), value)
        elif (prop := struct.bl_rna.properties[name]).type == "POINTER":
            items = getattr(bpy.data, property_copy.POINTED[prop.fixed_type.identifier])
            setattr(struct, name, next((each for each in items if each.session_uid == value), None))
        elif not struct.is_property_readonly(name):
            property_copy.store(struct, name, value)


def _add(collection: bpy_prop_collection, name: str, item: dict) -> bpy_struct:
    if name == "frames":
        return collection.new(item["frame_number"])
    if name == "modifiers":
        return collection.new(item["type"])
    if name == "strokes":
        return collection.new()
    if name in ("points", "keyframe_points"):
        collection.add(1)
        return collection[-1]
    return collection.add()
