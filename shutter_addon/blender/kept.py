"""What was removed, kept in memory: a strip that is cut and pasted gets its effect back."""

from . import animation, strips

_effects: dict = {}


def keep(edit, effect) -> None:
    """Keeps all that belongs to an effect, by its scene's identity."""
    scene, path = effect.scene, effect.path_from_id()
    if scene is None or not scene.virtual_shutter.identity:
        return
    curves = [_plain(curve) for curve in animation.curves_under(edit, path + ".")]
    for curve in curves:
        curve["data_path"] = curve["data_path"].removeprefix(path)
    _effects[scene.virtual_shutter.identity] = {
        "scene": (scene.name, (scene.render.resolution_x, scene.render.resolution_y)),
        "effect": _plain(effect),
        "curves": curves,
        "layers": [_plain(layer) for layer in scene.annotation.layers] if scene.annotation else [],
    }


def restore(edit, identity: str):
    """Makes a kept effect again in an edit; its scene, or None when nothing was kept."""
    if (data := _effects.get(identity)) is None:
        return None
    scene = strips.new_scene(edit, *data["scene"])
    scene.virtual_shutter.identity = identity
    effect = edit.virtual_shutter.effects.add()
    _fill(effect, data["effect"])
    effect.scene = scene
    for values in data["curves"]:
        path = effect.path_from_id() + values["data_path"]
        curve = animation.new_curve(edit, path, values["array_index"])
        _fill(curve, values | {"data_path": path})
        curve.update()
    for values in data["layers"]:
        _fill(scene.annotation.layers.new(values["info"], set_active=False), values)
    return scene


def _plain(struct) -> dict:
    """A struct of Blender's with all that is in it as plain data; what it points to is left out."""
    values = {}
    for prop in struct.bl_rna.properties:
        name = prop.identifier
        if prop.type == "COLLECTION":
            values[name] = [_plain(item) for item in getattr(struct, name)]
        elif prop.type != "POINTER" and name != "co_ui":  # setting that one moves a key's handles
            value = getattr(struct, name)
            values[name] = tuple(value) if getattr(prop, "is_array", False) else value
    return values


def _fill(struct, values: dict) -> None:
    for name, value in values.items():
        if isinstance(value, list):
            for item in value:
                _fill(_add(getattr(struct, name), name, item), item)
        elif not struct.is_property_readonly(name):
            setattr(struct, name, value)


def _add(collection, name: str, item: dict):
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
