"""A shutter's bars: painted, keyed, and as they are at the current frame."""

from collections.abc import Sequence
from contextlib import suppress

import bpy
import numpy as np
from bpy.app.translations import pgettext_iface as iface_
from bpy.types import Context, FCurve, PropertyGroup, Scene, Strip

from ...core import revision
from ...core.model import shutters
from ...core.model.choices import COMBINES
from ..data import fcurves, snapshot
from ..data.consistency import bars
from ..rendering import effect_source, invalidation, sessions


def summary(weights: np.ndarray, combine: str = "AVERAGE") -> str:
    """A shutter's bars (L,) in words: its angle, and how many of the frames that is; or how many it combines otherwise
    (choices.COMBINES)."""
    if not shutters.exposure(weights):
        return iface_("All bars are zero: the shutter never opens")
    if combine != "AVERAGE":
        name, count = next(name for word, name, _ in COMBINES if word == combine), np.count_nonzero(weights)
        words = iface_("{combine} of 1 frame") if count == 1 else iface_("{combine} of {count} frames")
        return words.format(combine=iface_(name), count=count)
    angle, window = shutters.open_angle(weights), len(weights)
    words = iface_("{angle}° ({frames} of {window} frames)")
    return words.format(angle=f"{angle:.0f}", frames=f"{angle / 360 * window:.3g}", window=window)


def open_for(scene: Scene, effect: PropertyGroup, strip: Strip, index: int) -> str | None:
    """For how many frames a shutter is open at the current frame whose trail has a length, in words; None: its bars say
    that, or there is no picture. For what is drawn: worked out once, with all that the live preview shows, until
    something changes."""
    shutter, frame = effect.shutters[index], scene.frame_current
    has_length = shutter.length == "TIMELINE" or (shutter.follow != "NOTHING" and shutter.length == "MOTION")
    is_shown = strip.left_handle <= frame < strip.right_handle and not bpy.app.is_job_running("RENDER")
    if not (has_length and is_shown):
        return None
    try:
        state = sessions.of_drawing().request(invalidation.current(scene, effect, strip, frame), frame).state
    except effect_source.FAULTS:  # which the live preview tells
        return None
    words = iface_("Open for {frames} of {window} frames here")
    return words.format(frames=f"{state.open_for[index]:.3g}", window=state.options.window)


def set_bars(shutter: PropertyGroup, weights: Sequence[float] | np.ndarray) -> None:
    """Gives a shutter these bars (L,); those that stay are not touched."""
    for bar, weight in zip(shutter.bars, weights, strict=True):
        if bar.weight != np.float32(weight):
            bar.weight = weight


def auto_key(context: Context) -> bool:
    """Whether Blender's auto keying is on."""
    return context.scene.tool_settings.use_keyframe_insert_auto


def paint(effect: PropertyGroup, index: int, weights: Sequence[float] | np.ndarray, key: bool = False) -> None:
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


def key_bars(effect: PropertyGroup, index: int) -> None:
    """Keys all bars of a shutter at the current frame, as Blender's own key buttons do."""
    # Between keys the bars stand where their F-curves are, a cross-fade: the picture is made with others.
    shutter, scene = effect.shutters[index], effect.id_data
    set_bars(shutter, bars_now(effect, index))
    for path in _paths(effect, index):
        # Without a frame Blender takes that of the window's scene, which may be another one.
        scene.keyframe_insert(path, group=shutter.name, frame=scene.frame_current)


def _paths(effect: PropertyGroup, index: int) -> list[str]:
    """Of the weights of a shutter's bars, from the scene."""
    path = f"{effect.path_from_id()}.shutters[{index}].bars"
    return [f"{path}[{k}].weight" for k in range(len(effect.shutters[index].bars))]


def unkey_bars(effect: PropertyGroup, index: int) -> bool:
    """Deletes the keys of a shutter's bars at the current frame; whether there were any."""
    scene = effect.id_data
    curves, is_deleted = fcurves.Curves(scene), False
    for path in filter(curves.find, _paths(effect, index)):
        with suppress(RuntimeError):  # no key at this frame
            is_deleted |= scene.keyframe_delete(path, frame=scene.frame_current)
    return is_deleted


def shown(effect: PropertyGroup, index: int) -> tuple[np.ndarray, list[str]]:
    """What bars_now and key_state say, for what is drawn: worked out once until something changes."""
    key = effect.scene.session_uid, index, effect.id_data.frame_float
    return revision.until_change("bars", key, lambda: _read(effect, index))


def key_state(effect: PropertyGroup, index: int) -> list[str]:
    """For each of a shutter's bars, as Blender colours its fields: "", "animated", "keyed" here, or "changed" since."""
    scene = effect.id_data
    curves = fcurves.Curves(scene)
    bars_and_paths = zip(effect.shutters[index].bars, _paths(effect, index), strict=True)
    return [_state(curves.find(path), bar.weight, scene) for bar, path in bars_and_paths]


def _state(curve: FCurve | None, value: float, scene: Scene) -> str:
    if curve is None:
        return ""
    frame = scene.frame_current_final  # by which keys are stretched
    if abs(max(curve.evaluate(scene.frame_float), 0.0) - value) > 1e-4:  # no bar is below 0, a curve may be
        return "changed"
    return "keyed" if any(abs(key.co[0] - frame) < 1e-3 for key in curve.keyframe_points) else "animated"


def bars_now(effect: PropertyGroup, index: int) -> np.ndarray:
    """Bars (L,) that the picture at the current frame is made with, interpolated between keys.

    Bars that were changed since, and not keyed yet, count as they stand. EffectError: the picture cannot be made.
    """
    return _read(effect, index)[0]


def _read(effect: PropertyGroup, index: int) -> tuple[np.ndarray, list[str]]:
    scene, states = effect.id_data, key_state(effect, index)
    if "changed" in states:
        return bars(effect.shutters[index]), states
    return snapshot.bars_at(scene, effect, index, scene.frame_float), states
