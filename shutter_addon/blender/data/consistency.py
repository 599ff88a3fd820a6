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
    """Have the effect's frames made again after a property changed, as its update callback.

    Blender's sequencer keeps finished frames and does not know that they depend on the property.
    """
    strips.invalidate(group.id_data)


def choose_region(effect: PropertyGroup) -> None:
    """Make a region of the active shutter active, the nearest in order, unless one already is.

    The list of regions shows only those of the active shutter.
    """
    own = own_regions(effect)
    if own and effect.active_region not in own:
        effect.active_region = min(own, key=lambda i: abs(i - effect.active_region))


def aim_pen(effect: PropertyGroup, name: str = "layer") -> None:
    """Make Blender's annotation tool draw on an annotation layer of the active region.

    Args:
        name: One of annotations.LAYERS: which of the region's layers.
    """
    region = active_region(effect)
    layer = layer_of(effect, region, name) if region else None
    if layer is not None:
        layers = effect.scene.annotation.layers
        layers.active_index = next(i for i, other in enumerate(layers) if other == layer)


def unique(name: str, taken: Container[str]) -> str:
    """Return a name that is not in `taken`: the name itself, or with a number, as in "Name.001".

    It has at most limits.MAX_NAME characters, as in recipes.
    """
    number, wanted = 0, name[: limits.MAX_NAME]
    while wanted in taken:
        number += 1
        end = f".{number:03d}"
        wanted = name[: limits.MAX_NAME - len(end)] + end
    return wanted


def rename(effect: PropertyGroup, old: str, new: str) -> str:
    """Return the name to give a renamed shutter, made unique, and enter it in the regions of the shutter.

    Args:
        old: The shutter's name until now.
        new: The name that was typed.
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
    """Update the shutters whose exposure follows a region, after it was renamed or removed.

    Nothing changes if another region still has the old name.

    Args:
        new: The region's new name; None: it was removed, and the shutters follow nothing.
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
    """Fit all shutters' bars (how much each frame counts) after the window's length or position has changed.

    A shutter whose bars are still those of its preset gets the preset's bars for the new window. Any other loses its
    preset; its bars, at keys too, are resampled, which keeps their shape and their share of the light.
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
    """Convert an effect of format 1, whose bars counted moments between frames, too, to bars of the footage's frames.

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
    """Return the preset that a shutter still has, a key of shutters.PRESETS; "": it has none.

    It has its last preset as long as its bars are neither edited nor keyed.
    """
    shutter, weights = effect.shutters[index], bars(effect.shutters[index])
    if shutter.preset not in shutters.PRESETS or not weights.size:
        return ""
    made = shutters.preset_bars(shutter.preset, len(weights), shutter.preset_position.lower()).astype(np.float32)
    path = f"{effect.path_from_id()}.shutters[{index}].bars["
    is_kept = np.array_equal(weights, made) and not fcurves.curves_under(effect.id_data, path)
    return shutter.preset if is_kept else ""


def _change_bars(effect: PropertyGroup, index: int, change: Callable[..., np.ndarray]) -> None:
    """Replace a shutter's bars (how much each frame counts) by `change(bars)`, also at each key.

    Args:
        index: Of the shutter.
        change: Takes the bars (L,) and returns new ones, maybe of another number.
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
    """Return a shutter's bars (L,) at a timeline frame: the values of F-curves, at least 0, and `old` for the others.

    Args:
        old: The stored bars (L,).
        keyed: F-curves by the index of their bar.
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
