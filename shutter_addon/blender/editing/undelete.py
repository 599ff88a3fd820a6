"""Effects kept in memory: removed ones, for strips that are cut and pasted, and the one that *Copy Effect* copied.

Blender's clipboard has Scene strips without their scenes, and outlives the file. So plain data is kept.
"""

from __future__ import annotations

import bpy
from bpy.types import PropertyGroup, Scene, Strip, bpy_prop_collection, bpy_struct

from ...core.caches import RecentValues
from ..data import data_format, fcurves, property_copy, recipe_import, strips
from ..data.annotations import annotation
from . import add_effect, match_source

_MOST = 64
_COPIED = "copied"  # key of the copied effect
_OWN = {"name", "identity", "source", "start"}  # properties of an effect that pasting keeps
# What `new` of a collection needs of an item.
_NEW: dict[str, tuple[str, ...]] = {"frames": ("frame_number",), "modifiers": ("type",), "strokes": ()}
_effects: RecentValues[str, dict] = RecentValues()


def keep(effect: PropertyGroup) -> None:
    """Keep in memory an effect that is about to be removed: properties, F-curves and annotation.

    `restore` makes it again by the identity (unique text) of its effect scene. Without that, keep nothing.
    """
    if effect.scene is not None and effect.scene.virtual_shutter.identity:
        _keep(effect.scene.virtual_shutter.identity, effect)


def copy(effect: PropertyGroup, strip: Strip) -> None:
    """Keep a copy of an effect in memory, for `paste`; it replaces the last copy.

    Args:
        strip: The effect strip of `effect`.
    """
    places = match_source.places(effect, strip)
    _keep(_COPIED, effect, first=strip.left_handle, skipped=strips.skipped(strip), places=places)


def has_copy() -> bool:
    return _COPIED in _effects


def forget_copy() -> None:
    """Forget the copied effect, because it points to images of a file that is about to be closed."""
    _effects.pop(_COPIED, None)


def paste(effect: PropertyGroup, strip: Strip) -> None:
    """Replace an effect's shutters, regions, keyframes and options by those of the copied effect.

    Keyframes and drawings keep their distance in time from the strip's first frame, and drawings their place on the
    picture.

    Args:
        strip: The effect strip of `effect`.
    """
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
    """Forget all kept effects, when the extension is disabled."""
    _effects.clear()


def restore(scene: Scene, identity: str) -> Scene | None:
    """Make a kept effect again in a scene, with a new effect scene.

    Args:
        identity: Identity (unique text) of the effect scene that the effect had.

    Returns:
        The new effect scene; None: no effect was kept under this identity.
    """
    if (data := _effects.get(identity)) is None:
        return None
    effect_scene = add_effect.new_effect_scene(scene, identity, *data["scene"])
    effect = data_format.new_effect(scene, data["format"])
    effect.scene = effect_scene
    _restore(scene, effect, data, data["effect"])
    return effect_scene


def _restore(scene: Scene, effect: PropertyGroup, data: dict, content: dict) -> None:
    """Fill an effect with properties, keyframes and strokes that _keep has kept.

    Args:
        scene: The scene that has the effect.
        data: What _keep has kept. Only its F-curves and annotation layers are used here.
        content: Values of the effect's properties, by name: those in `data`, or some of them.
    """
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
            setattr(struct, name, value)


def _add(collection: bpy_prop_collection, name: str, item: dict) -> bpy_struct:
    if name in _NEW:
        return collection.new(*(item[key] for key in _NEW[name]))
    if name in ("points", "keyframe_points"):
        collection.add(1)
        return collection[-1]
    return collection.add()
