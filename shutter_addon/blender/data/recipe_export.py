"""The recipe of an effect: the inverse of recipe_import.apply."""

from collections.abc import Sequence

import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_

from ...core.messages import EffectError, translated
from ...core.model import limits
from ...core.model.effect import Effect
from ...core.recipes import baking
from . import annotations, fcurves, snapshot, strips, validation


def recipe_of(scene, effect, strip, contents: Sequence = ()) -> Effect:
    """The effect as a recipe, whose frame 1 is the strip's first; left out is what baking.baked leaves out, and regions
    without a shutter. contents: see baking.baked. EffectError: it cannot be rendered as it stands."""
    snapshot.check_counts(effect)
    shown = range(strip.left_handle, strip.right_handle)
    if not -limits.MAX_FRAME <= shown.start <= shown.stop <= limits.MAX_FRAME:
        sentence = rpt_('strip "{strip}" lies at frames {first} to {last}, where no timeline is')
        raise EffectError(sentence.format(strip=strip.name, first=shown.start, last=shown.stop - 1))
    drawn = [region for region in strips.drawn_regions(effect) if annotations.layer_of(effect, region)]
    for item in (*effect.shutters, *drawn, *strips.matte_regions(effect)):
        _check_name(item)
    for shutter in effect.shutters:
        for component in shutter.color:
            validation.number(shutter, "color", component)
    if effect.regions and annotations.image_to_picture(strip, annotations.picture_size(effect)) is None:
        sentence = rpt_('strip "{strip}" is too small to find its scribbles')
        raise EffectError(sentence.format(strip=strip.name))
    with translated(rpt_):
        plain = snapshot.read(scene, effect, strip, sorted({*shown, *_keyed(scene, effect)}))
        return baking.baked(plain, shown, contents)


def _keyed(scene, effect) -> set[float]:
    """The timeline frames of the effect's keys and drawings."""
    curves, pace = fcurves.curves_under(scene, effect.path_from_id() + "."), fcurves.stretched(scene)
    # In float32, as the keys of Curves are.
    frames = set((np.array(fcurves.key_frames(curves), np.float32) / pace).tolist())
    layers = (annotations.layer_of(effect, region) for region in effect.regions)
    return frames.union(float(drawing.frame_number) for layer in layers if layer for drawing in layer.frames)


def _check_name(item) -> None:
    """EffectError: the name is longer than a recipe has it, from a script or a file of another version."""
    if len(item.name) > limits.MAX_NAME:
        sentence = rpt_("{place}: its name has {count} characters, {most} are the most")
        words = {"place": validation.place(item), "count": len(item.name), "most": limits.MAX_NAME}
        raise EffectError(sentence.format(**words))
