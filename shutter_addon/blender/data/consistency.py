"""Keep an effect consistent when a part of it is edited: bars fit the window, regions follow their shutters."""

from collections.abc import Callable, Container

import numpy as np
from bpy.types import Context, FCurve, PropertyGroup

from ...core.model import keyframes, limits, shutters
from ...core.model.effect import STILL_CAMERA, Shutter
from . import fcurves, strips, validation
from .annotations import layer_of, layers_of
from .fcurves import numbers
from .selection import active_region, own_regions


def changed(group: PropertyGroup, _context: Context) -> None:
    """Make Blender render the frames of a scene's effect strips again. It is an update callback of properties.

    Blender's sequencer caches finished frames and does not know that they depend on the property.

    Args:
        group: The property group that has the changed property. All effects of its scene are rendered again.
    """
    strips.invalidate(group.id_data)


def choose_region(effect: PropertyGroup) -> None:
    """Make sure that the active region belongs to the active shutter, since the list of regions shows no others.

    If it does not, activate the region of the active shutter whose index is nearest. Do nothing if the shutter has no
    regions.
    """
    own = own_regions(effect)
    if own and effect.active_region not in own:
        effect.active_region = min(own, key=lambda i: abs(i - effect.active_region))


def aim_pen(effect: PropertyGroup, name: str = "layer") -> None:
    """Make Blender's annotation tool draw on an annotation layer of the active region.

    Do nothing if there is no active region, or it does not have that layer.

    Args:
        name: The region's property that names the layer: one of annotations.LAYERS.
    """
    region = active_region(effect)
    layer = layer_of(effect, region, name) if region else None
    if layer is not None:
        layers = effect.scene.annotation.layers
        layers.active_index = next(i for i, other in enumerate(layers) if other == layer)


def unique(name: str, taken: Container[str]) -> str:
    """Return a name that is not in `taken`: `name` itself, or `name` with a number at the end, as in "Name.001".

    The result has at most limits.MAX_NAME characters. If necessary, `name` is cut.
    """
    number, wanted = 0, name[: limits.MAX_NAME]
    while wanted in taken:
        number += 1
        end = f".{number:03d}"
        wanted = name[: limits.MAX_NAME - len(end)] + end
    return wanted


def rename(effect: PropertyGroup, old: str, new: str) -> str:
    """Return a unique name for a shutter that the user renames, and give it to the regions that use the shutter.

    Regions refer to their shutter by name. If another shutter still has the old name, this shutter is its copy, and the
    regions stay with the other one.

    Args:
        effect: The effect that has the shutter.
        old: The shutter's name until now.
        new: The name that the user typed.
    """
    others = [shutter.name for shutter in effect.shutters]
    others.remove(old)
    new = unique(new, others)
    # Another shutter with the old name is the original, which has the regions; this one is its copy.
    if old not in others:
        for region in effect.regions:
            if region.shutter == old:
                region.shutter = new
    return new


def refollow(effect: PropertyGroup, old: str, new: str | None) -> None:
    """Update the shutters whose exposure follows a region, after the region was renamed or removed.

    Shutters refer to the region by name. Nothing changes if another region still has the old name.

    Args:
        effect: The effect that has the region.
        old: The region's name before.
        new: The region's new name. None: it was removed, so the shutters follow nothing from now on.
    """
    if [region.name for region in effect.regions].count(old) > (0 if new is None else 1):
        return
    for shutter in effect.shutters:
        if shutter.follow_region == old != new:
            shutter.follow_region = new or ""
            if new is None and shutter.follow == "REGION":
                shutter.follow = "NOTHING"


def bars(shutter: PropertyGroup) -> np.ndarray:
    """Return a shutter's stored bars, float64 (L,): how much each frame of its window counts, apart from keys."""
    return numbers(shutter.bars, "weight").astype(np.float64)


def fit_bars(effect: PropertyGroup) -> None:
    """Adapt the bars of all shutters after the length of the effect's window, or its position, has changed.

    A shutter has a bar for each frame of the window: how much that frame contributes. If the bars are still those of
    the shutter's preset, they become the preset's bars for the new window. Otherwise the shutter no longer counts as
    having a preset. If the length has changed, its bars are resampled, at each key, too: their shape and mean height
    stay.
    """
    for index, shutter in enumerate(effect.shutters):
        shutter.preset = preset_of(effect, index)
        if shutter.preset:
            shutter.preset_position = effect.position
            made = shutters.preset_bars(shutter.preset, effect.window, effect.position.lower())
            _change_bars(effect, index, lambda _old, made=made: made)
        elif len(shutter.bars) not in (0, effect.window):
            _change_bars(effect, index, lambda old: shutters.resample(old, effect.window))


def count_filmed(effect: PropertyGroup) -> None:
    """Convert the bars of an effect in data format 1 to the current meaning: a bar for each filmed frame of the window.

    In format 1 there was a bar for each moment: each filmed frame, and each frame computed between two of them. The
    effect's window becomes shorter accordingly.

    Raises:
        EffectError: A value is out of range.
    """
    steps, position = int(effect.inbetween), validation.word(effect, "position").lower()
    for index, shutter in enumerate(effect.shutters):
        counted = Shutter(
            name=shutter.name,
            bars=keyframes.Bars(keyframes.Constant(None)),
            follow=None if shutter.follow == "NOTHING" else STILL_CAMERA,
            length=shutter.length.lower(),
            combine=shutter.combine.lower(),
        )
        _change_bars(effect, index, lambda old, counted=counted: counted.filmed(old, steps, position).bars)
    effect.window = -(-effect.window // steps)


def preset_of(effect: PropertyGroup, index: int) -> str:
    """Return the preset (a key of shutters.PRESETS) whose bars a shutter still has; "": it has none.

    It has none if its bars were changed since the preset was chosen, or have F-curves.

    Args:
        index: The shutter's index.
    """
    shutter, weights = effect.shutters[index], bars(effect.shutters[index])
    if shutter.preset not in shutters.PRESETS or not weights.size:
        return ""
    made = shutters.preset_bars(shutter.preset, len(weights), shutter.preset_position.lower()).astype(np.float32)
    path = f"{effect.path_from_id()}.shutters[{index}].bars["
    is_kept = np.array_equal(weights, made) and not fcurves.curves_under(effect.id_data, path)
    return shutter.preset if is_kept else ""


def _change_bars(effect: PropertyGroup, index: int, change: Callable[..., np.ndarray]) -> None:
    """Replace a shutter's bars by the results of a function, also at each key if the bars have keys.

    Args:
        index: The shutter's index.
        change: Takes the bars (L,): how much each frame counts. It returns the new bars, which may have another length,
            the same one in all calls.
    """
    shutter = effect.shutters[index]
    scene, path = effect.id_data, f"{effect.path_from_id()}.shutters[{index}].bars"
    curves = fcurves.Curves(scene)
    old = bars(shutter)
    keyed = {k: curve for k in range(len(old)) if (curve := curves.find(f"{path}[{k}].weight"))}
    words = curves.keys(list(keyed.values()))
    keys = [(frame, change(_bars_keyed(old, keyed, frame)), ease) for frame, ease in words]
    fcurves.remove_curves(scene, f"{path}[")
    shutter.bars.clear()
    for k, weight in enumerate(change(old)):
        shutter.bars.add().weight = weight
        if keys:
            new = [(frame, bar[k], ease) for frame, bar, ease in keys]
            fcurves.set_keys(scene, f"{path}[{k}].weight", 0, new)


def _bars_keyed(old: np.ndarray, keyed: dict[int, FCurve], frame: float) -> np.ndarray:
    """Return a shutter's bars (L,) at a timeline frame: those with an F-curve evaluated, the others as stored.

    Negative values of F-curves become 0.

    Args:
        old: The stored bars (L,).
        keyed: The F-curves by the index of their bar.
        frame: The timeline frame.
    """
    weights = old.copy()
    weights[list(keyed)] = [max(curve.evaluate(frame), 0.0) for curve in keyed.values()]
    return weights


def color_layers(effect: PropertyGroup, shutter: PropertyGroup) -> None:
    """Give the annotation layers of a shutter's regions the shutter's color, except those of *Not This* strokes."""
    for region in effect.regions:
        for layer in layers_of(effect, region) if region.shutter == shutter.name else ():
            if layer.info != region.not_layer:
                layer.color = shutter.color
