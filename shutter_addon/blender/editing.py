"""Changes to an effect: its shutters, their bars and keys, and its regions. Operators and gizmos call these.

Shutters and regions are items of collections: where one goes or moves, its F-curves go and move with it.
"""

import numpy as np
from bpy.app.translations import pgettext_data as data_
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_

from ..core import limits, presets, shutters
from . import animation, copies, effects, inbetweens, values
from .effects import layer_of

# Told apart on footage and by colour-blind eyes (Okabe and Ito).
COLORS = (
    (0.337, 0.706, 0.914),
    (0.902, 0.624, 0.0),
    (0.0, 0.62, 0.451),
    (0.8, 0.475, 0.655),
    (0.941, 0.894, 0.259),
    (0.835, 0.369, 0.0),
    (0.0, 0.447, 0.698),
)
CHANNELS = ("location", "rotation", "scale")


def effect_of(item):
    """The effect that a shutter or a region belongs to."""
    path = item.path_from_id()
    return item.id_data.path_resolve(path[: path.index("]") + 1])


def active_shutter(effect):
    """The shutter that is chosen in the list, or None."""
    return effect.shutters[effect.active_shutter] if 0 <= effect.active_shutter < len(effect.shutters) else None


def active_region(effect):
    """The region that is chosen in the list, if it is one of the active shutter's; or None."""
    region = effect.regions[effect.active_region] if 0 <= effect.active_region < len(effect.regions) else None
    shutter = active_shutter(effect)
    return region if region and shutter and region.shutter == shutter.name else None


def choose_region(effect) -> None:
    """Makes a region of the active shutter the active one, the nearest in the list, unless it is one or there is none:
    the list shows that shutter's alone."""
    shutter = active_shutter(effect)
    own = [i for i, region in enumerate(effect.regions) if shutter and region.shutter == shutter.name]
    if own and effect.active_region not in own:
        effect.active_region = min(own, key=lambda i: abs(i - effect.active_region))


def aim_pen(effect) -> None:
    """Strokes are drawn on the active region's layer from now on."""
    region = active_region(effect)
    layer = layer_of(effect, region) if region else None
    if layer is not None:
        layers = effect.scene.annotation.layers
        layers.active_index = next(i for i, other in enumerate(layers) if other == layer)


def unique(name: str, taken) -> str:
    """The name, as long as a recipe has it, with a number behind it where it is taken, as Blender names things."""
    number, wanted = 0, name[: limits.MAX_NAME]
    while wanted in taken:
        number += 1
        end = f".{number:03d}"
        wanted = name[: limits.MAX_NAME - len(end)] + end
    return wanted


def why_full(effect, collection: str) -> str | None:
    """Why an effect cannot have another one of its "shutters" or "regions", in a sentence; None if it can."""
    most, sentence = {
        "shutters": (limits.MAX_SHUTTERS, rpt_("An effect has {most} shutters at most")),
        "regions": (limits.MAX_REGIONS, rpt_("An effect has {most} regions at most")),
    }[collection]
    return sentence.format(most=most) if len(getattr(effect, collection)) >= most else None


# Shutters


def start(effect) -> None:
    """What a new effect begins with: a long shutter everywhere, and a sharp one to scribble with.

    With the border, the first scribble is sharp around itself; without, it would be the only one, and hold everywhere.
    """
    effect.border = True
    add_shutter(effect, data_("Long"), presets.bars("ANGLE_360", effect.window))
    add_shutter(effect, data_("Sharp"), presets.bars("STILL", effect.window))


def add_shutter(effect, name: str = "", bars=None):
    """Appends a shutter, fully open unless bars (window,) are given, and makes it the active one."""
    color = COLORS[len(effect.shutters) % len(COLORS)]
    weights = np.ones(values.number(effect, "window")) if bars is None else bars
    shutter = effect.shutters.add()
    shutter.name, shutter.color = name or data_("Shutter"), color
    for weight in weights:
        shutter.bars.add().weight = weight
    effect.active_shutter = len(effect.shutters) - 1
    return shutter


def duplicate_shutter(effect, index: int):
    """A copy of a shutter, with its keys, behind it; regions stay with the original."""
    edit, path = effect.id_data, f"{effect.path_from_id()}.shutters"
    effect.shutters.add()
    last = len(effect.shutters) - 1
    old, new = effect.shutters[index], effect.shutters[last]
    copies.copy_properties(old, new)
    new.color = COLORS[last % len(COLORS)]
    animation.copy_curves(edit, f"{path}[{index}].", edit, f"{path}[{last}].")
    move_shutter(effect, last, index + 1)
    effect.active_shutter = index + 1
    return effect.shutters[index + 1]


def remove_shutter(effect, index: int) -> None:
    """Removes a shutter, its keys and its regions. The first of those that remain is the default."""
    name = effect.shutters[index].name
    for i in reversed([i for i, region in enumerate(effect.regions) if region.shutter == name]):
        remove_region(effect, i)
    _remove(effect, "shutters", index)
    effect.active_shutter = min(effect.active_shutter, max(len(effect.shutters) - 1, 0))


def move_shutter(effect, index: int, to: int) -> None:
    """Moves a shutter in the list; whichever comes first is the default."""
    _move(effect, "shutters", index, to)
    effect.active_shutter = to


def rename(effect, old: str, new: str) -> str:
    """The name that a shutter gets for a wish: a unique one. Its regions follow it."""
    others = [shutter.name for shutter in effect.shutters]
    others.remove(old)
    new = unique(new, others)
    # A name that is taken twice is that of a copy: the regions belong to the original.
    if old not in others:
        for region in effect.regions:
            if region.shutter == old:
                region.shutter = new
    return new


# Bars


def bars(shutter) -> np.ndarray:
    """A shutter's bars as they stand, float64 (L,)."""
    weights = np.empty(len(shutter.bars), dtype=np.float32)
    shutter.bars.foreach_get("weight", weights)
    return weights.astype(np.float64)


def summary(weights) -> str:
    """A shutter's bars (L,) in words: its angle, and how many frames' light it gathers."""
    light = shutters.exposure(weights)
    if not light:
        return iface_("All bars are zero: the shutter never opens")
    angle, frames = f"{shutters.open_angle(weights):.0f}", f"{light:.3g}"
    if frames == "1":
        return iface_("{angle}°, 1 frame of light").format(angle=angle)
    return iface_("{angle}°, {frames} frames of light").format(angle=angle, frames=frames)


def set_bars(shutter, weights) -> None:
    """Gives a shutter these bars (L,); those that stay are not touched."""
    for bar, weight in zip(shutter.bars, weights, strict=True):
        if bar.weight != np.float32(weight):
            bar.weight = weight


def auto_key(context) -> bool:
    """Whether Blender's auto keying is on."""
    return context.scene.tool_settings.use_keyframe_insert_auto


def paint(effect, index: int, weights, key: bool = False) -> None:
    """Gives a shutter bars (L,) as an editor does at the current frame, and as many as it may lack or have too many;
    key: and keys them there."""
    shutter = effect.shutters[index]
    while len(shutter.bars) > len(weights):
        shutter.bars.remove(len(shutter.bars) - 1)
    while len(shutter.bars) < len(weights):
        shutter.bars.add()
    set_bars(shutter, weights)
    if key:
        key_bars(effect, index)


def fit_bars(effect) -> None:
    """After a change of the window's length: all shutters, their keys as well, keep their shape and share of light."""
    for index, shutter in enumerate(effect.shutters):
        if len(shutter.bars) not in (0, effect.window):
            _change_bars(effect, index, lambda old: shutters.resample(old, effect.window))


def fit_factor(effect) -> None:
    """After a change of the factor of in-between frames: the bars, keyed ones as well, stand for the same times.

    EffectError: it would take too many bars; the factor is put back, and nothing has changed. Or a value that no effect
    can have is in the way."""
    factor, position = inbetweens.factor(effect), values.word(effect, "position").lower()
    if str(effect.bars_per_frame) not in effect.bl_rna.properties["inbetween"].enum_items:
        effect.bars_per_frame = factor  # what the bars stood for is not known
    if factor == effect.bars_per_frame:
        return

    def multiplied(old):
        return shutters.multiplied(old, effect.bars_per_frame, factor, position)

    try:
        window = len(multiplied(np.ones(effect.window)))
    except shutters.ShutterError:
        effect.inbetween = str(effect.bars_per_frame)
        count = effect.window * factor // effect.bars_per_frame
        sentence = rpt_("{factor}× in-between frames take {count} bars; a shutter has {most} at most")
        raise effects.EffectError(sentence.format(factor=factor, count=count, most=shutters.MAX_WINDOW)) from None
    for index in range(len(effect.shutters)):
        _change_bars(effect, index, multiplied)
    effect.bars_per_frame, effect.window = factor, window


def _change_bars(effect, index: int, change) -> None:
    """Gives a shutter other bars, and as many, at all its keys: those that `change` makes of the old ones."""
    shutter = effect.shutters[index]
    edit, path = effect.id_data, f"{effect.path_from_id()}.shutters[{index}].bars"
    curves = animation.Curves(edit)
    old = bars(shutter)
    keyed = {k: curve for k in range(len(old)) if (curve := curves.find(f"{path}[{k}].weight"))}
    words = sorted(animation.eases(keyed.values()).items())
    keys = [(frame, change(_bars_keyed(old, keyed, frame)), ease) for frame, ease in words]
    animation.remove_curves(edit, f"{path}[")
    shutter.bars.clear()
    for k, weight in enumerate(change(old)):
        shutter.bars.add().weight = weight
        if keys:
            animation.set_keys(edit, f"{path}[{k}].weight", 0, [(frame, bar[k], ease) for frame, bar, ease in keys])


def _bars_keyed(old, keyed, frame: float) -> np.ndarray:
    """The bars at a frame, where some have F-curves."""
    weights = old.copy()
    weights[list(keyed)] = [max(curve.evaluate(frame), 0.0) for curve in keyed.values()]
    return weights


def key_bars(effect, index: int) -> None:
    """Keys all bars of a shutter at the current frame, as Blender's own key buttons do."""
    path, group = f"{effect.path_from_id()}.shutters[{index}].bars", effect.shutters[index].name
    # Between keys the bars stand where their F-curves are, a cross-fade: the picture is made with others.
    set_bars(effect.shutters[index], bars_now(effect, index))
    for k in range(len(effect.shutters[index].bars)):
        effect.id_data.keyframe_insert(f"{path}[{k}].weight", group=group)


def unkey_bars(effect, index: int) -> bool:
    """Deletes the keys of a shutter's bars at the current frame; whether there were any."""
    edit, path = effect.id_data, f"{effect.path_from_id()}.shutters[{index}].bars"
    curves = animation.Curves(edit)
    keyed = [k for k in range(len(effect.shutters[index].bars)) if curves.find(f"{path}[{k}].weight")]
    deleted = [_deleted(edit, f"{path}[{k}].weight") for k in keyed]
    return any(deleted)


def _deleted(edit, path: str) -> bool:
    try:
        return edit.keyframe_delete(path)
    except RuntimeError:  # no key at this frame
        return False


def key_state(effect, index: int) -> list[str]:
    """For each bar of a shutter, as Blender colours its fields: "", "animated", "keyed" here, or "changed" since."""
    edit, path = effect.id_data, f"{effect.path_from_id()}.shutters[{index}].bars"
    curves = animation.Curves(edit)
    return [
        _state(curves.find(f"{path}[{k}].weight"), bar.weight, edit)
        for k, bar in enumerate(effect.shutters[index].bars)
    ]


def _state(curve, value: float, edit) -> str:
    if curve is None:
        return ""
    frame = edit.frame_current_final
    if abs(max(curve.evaluate(frame), 0.0) - value) > 1e-4:  # no bar is below 0, a curve may be
        return "changed"
    return "keyed" if any(abs(key.co[0] - frame) < 1e-3 for key in curve.keyframe_points) else "animated"


def bars_now(effect, index: int) -> np.ndarray:
    """Bars (L,) that the picture at the current frame is made with, interpolated between keys.

    Bars that were changed since, and not keyed yet, count as they stand. EffectError: the picture cannot be made.
    """
    stored = bars(effect.shutters[index])
    if "changed" in key_state(effect, index):
        return stored
    edit, path = effect.id_data, f"{effect.path_from_id()}.shutters[{index}]"
    curves, frame = animation.Curves(edit), edit.frame_current_final
    chosen = effects.options(effect, curves, frame)
    return effects.bars_at(curves, path, effect.shutters[index], chosen, frame)


# Regions


def add_region(effect, shutter, kind: str = "LINE", name: str = ""):
    """Appends a region of a shutter, on an empty annotation layer of its own, and makes it the active one."""
    region = effect.regions.add()
    region.name = unique(name or shutter.name, {r.name for r in effect.regions})
    region.shutter, region.kind = shutter.name, kind
    new_layer(effect, region)
    effect.active_region = len(effect.regions) - 1
    return region


def new_layer(effect, region):
    """Gives a region an empty annotation layer, named after it and in its shutter's colour."""
    layer = effects.annotation(effect).layers.new(region.name, set_active=True)
    layer.color = effect.shutters[region.shutter].color
    region.layer = layer.info
    return layer


def remove_region(effect, index: int) -> None:
    """Removes a region, its keys and its annotation layer."""
    layer = layer_of(effect, effect.regions[index])
    if layer is not None:
        effect.scene.annotation.layers.remove(layer)
    _remove(effect, "regions", index)
    effect.active_region = min(effect.active_region, max(len(effect.regions) - 1, 0))
    choose_region(effect)


def move_region(effect, index: int, to: int) -> None:
    """Moves a region in the list; later ones lie over earlier ones."""
    _move(effect, "regions", index, to)
    effect.active_region = to


def assign_region(effect, index: int, shutter) -> None:
    """Gives a region to another shutter, which becomes the active one."""
    effect.regions[index].shutter = shutter.name
    color_layers(effect, shutter)
    effect.active_region = index
    effect.active_shutter = list(effect.shutters).index(shutter)


def color_layers(effect, shutter) -> None:
    """Scribbles have the colour of their shutter."""
    for region in effect.regions:
        if region.shutter == shutter.name and (layer := layer_of(effect, region)) is not None:
            layer.color = shutter.color


def take_layer(effect, shutter, layer):
    """A region of a shutter from any annotation layer, whose drawings are copied unless it is one of the effect's."""
    own = effect.scene.annotation and layer.id_data == effect.scene.annotation
    region = add_region(effect, shutter, name=layer.info)
    copy = layer_of(effect, region)
    for drawing in layer.frames:
        _copy_strokes(drawing, copy.frames.new(drawing.frame_number))
    if own:
        effect.scene.annotation.layers.remove(layer)
    return region


def _copy_strokes(old, new) -> None:
    for stroke in old.strokes:
        copy = new.strokes.new()
        copy.display_mode = "2DSPACE"
        copy.points.add(len(stroke.points))
        flat = np.empty(len(stroke.points) * 3, dtype=np.float32)
        stroke.points.foreach_get("co", flat)
        copy.points.foreach_set("co", flat)


def free_layers(effect, annotation) -> list:
    """Layers of an annotation that are no region yet."""
    taken = {region.layer for region in effect.regions} if annotation == effect.scene.annotation else set()
    return [layer for layer in annotation.layers if layer.info not in taken] if annotation else []


def key_region(effect, index: int) -> None:
    """Keys a region's location, rotation and scale at the current frame."""
    path = f"{effect.path_from_id()}.regions[{index}]"
    for name in CHANNELS:
        effect.id_data.keyframe_insert(f"{path}.{name}", group=effect.regions[index].name)


# Collections


def _remove(effect, collection: str, index: int) -> None:
    items, path = getattr(effect, collection), f"{effect.path_from_id()}.{collection}"
    places = {index: None} | {i: i - 1 for i in range(index + 1, len(items))}
    items.remove(index)
    animation.reindex(effect.id_data, path, places)


def _move(effect, collection: str, index: int, to: int) -> None:
    items, path = getattr(effect, collection), f"{effect.path_from_id()}.{collection}"
    order = list(range(len(items)))
    order.insert(to, order.pop(index))
    items.move(index, to)
    animation.reindex(effect.id_data, path, {old: new for new, old in enumerate(order)})
