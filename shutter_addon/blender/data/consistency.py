"""Keep parts of an effect consistent: bars with the window, regions with shutters' names, scribbles with colors."""

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
    """Drop finished frames, as an update callback: the sequencer does not know what effect strips depend on."""
    strips.invalidate(group.id_data)


def choose_region(effect: PropertyGroup) -> None:
    """Make the nearest region of the active shutter active, unless one is: the list shows only those."""
    own = own_regions(effect)
    if own and effect.active_region not in own:
        effect.active_region = min(own, key=lambda i: abs(i - effect.active_region))


def aim_pen(effect: PropertyGroup, name: str = "layer") -> None:
    """Make strokes go to a layer of the active region. `name` is one of annotations.LAYERS."""
    region = active_region(effect)
    layer = layer_of(effect, region, name) if region else None
    if layer is not None:
        layers = effect.scene.annotation.layers
        layers.active_index = next(i for i, other in enumerate(layers) if other == layer)


def unique(name: str, taken: Container[str]) -> str:
    """Return a name, cut as in recipes, with a number where it is taken, as Blender names things."""
    number, wanted = 0, name[: limits.MAX_NAME]
    while wanted in taken:
        number += 1
        end = f".{number:03d}"
        wanted = name[: limits.MAX_NAME - len(end)] + end
    return wanted


def rename(effect: PropertyGroup, old: str, new: str) -> str:
    """Return a unique name for a shutter, and let its regions follow."""
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
    """Let shutters follow a renamed region, or nothing if it is gone. Nothing changes if another has the old name."""
    if [region.name for region in effect.regions].count(old) > (0 if new is None else 1):
        return
    for shutter in effect.shutters:
        if shutter.follow_region == old != new:
            shutter.follow_region = new or ""
            if new is None and shutter.follow == "REGION":
                shutter.follow = "NOTHING"


def bars(shutter: PropertyGroup) -> np.ndarray:
    """Return a shutter's bars without keys, float64 (L,)."""
    return numbers(shutter.bars, "weight").astype(np.float64)


def fit_bars(effect: PropertyGroup) -> None:
    """Fit bars after the window's length or position has changed.

    Shutters that keep to a preset get its bars. Others lose the preset. Their bars, at keys too, keep their shape and
    share of light.
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
    """Convert an effect of format 1, whose bars counted moments between filmed frames, to bars of filmed frames.

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
    """Return the preset that a shutter keeps to, a key of shutters.PRESETS, or "".

    That is its last preset, as long as the bars are not edited or keyed.
    """
    shutter, weights = effect.shutters[index], bars(effect.shutters[index])
    if shutter.preset not in shutters.PRESETS or not weights.size:
        return ""
    made = shutters.preset_bars(shutter.preset, len(weights), shutter.preset_position.lower()).astype(np.float32)
    path = f"{effect.path_from_id()}.shutters[{index}].bars["
    is_kept = np.array_equal(weights, made) and not fcurves.curves_under(effect.id_data, path)
    return shutter.preset if is_kept else ""


def _change_bars(effect: PropertyGroup, index: int, change: Callable[..., np.ndarray]) -> None:
    """Apply a function to a shutter's bars, and to their values at all keys. It may change their number."""
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
    """Return the bars at a frame, where F-curves drive some of them."""
    weights = old.copy()
    weights[list(keyed)] = [max(curve.evaluate(frame), 0.0) for curve in keyed.values()]
    return weights


def color_layers(effect: PropertyGroup, shutter: PropertyGroup) -> None:
    """Give scribbles the color of their shutter."""
    for region in effect.regions:
        for layer in layers_of(effect, region) if region.shutter == shutter.name else ():
            if layer.info != region.not_layer:
                layer.color = shutter.color
