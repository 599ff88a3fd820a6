"""Edit a shutter's bars: paint, key, and read them at the current frame."""

from collections.abc import Sequence
from contextlib import suppress

import bpy
import numpy as np
from bpy.app.translations import pgettext_iface as iface_
from bpy.types import Context, FCurve, PropertyGroup, Scene, Strip

from ...core import revision
from ...core.model import shutters
from ...core.model.choices import COMBINES
from ..data import fcurves, snapshot, strips
from ..data.consistency import bars
from ..rendering import effect_source, invalidation, sessions


def summary(weights: np.ndarray, combine: str = "AVERAGE") -> str:
    """Return a text about bars (L,): their angle and number of frames, or what they combine (choices.COMBINES)."""
    if not np.any(weights):
        return iface_("All bars are zero: the shutter never opens")
    if combine != "AVERAGE":
        name, count = next(name for word, name, _ in COMBINES if word == combine), np.count_nonzero(weights)
        words = iface_("{combine} of 1 frame") if count == 1 else iface_("{combine} of {count} frames")
        return words.format(combine=iface_(name), count=count)
    angle, window = shutters.open_angle(weights), len(weights)
    words = iface_("{angle}° ({frames} of {window} frames)")
    return words.format(angle=f"{angle:.0f}", frames=f"{angle / 360 * window:.3g}", window=window)


def told(scene: Scene, effect: PropertyGroup, strip: Strip, weights: np.ndarray) -> str:
    """Return a text about the active shutter's bars (L,): `summary`, or how many frames an exposure whose length varies
    is open for at the current frame. The result is kept until something changes."""
    index, frame = effect.active_shutter, scene.frame_current
    shutter = effect.shutters[index]
    has_length = shutter.length == "TIMELINE" or (shutter.follow != "NOTHING" and shutter.length == "MOTION")
    if has_length and strips.is_at(strip, frame) and not bpy.app.is_job_running("RENDER"):
        with suppress(*effect_source.FAULTS):  # the live preview shows the error
            state = sessions.of_drawing().request(invalidation.current(scene, effect, strip, frame), frame).state
            count = np.count_nonzero(shutters.are_open(state.bars[index]))
            words = iface_("Open for {frames} of {window} frames here")
            return words.format(frames=count, window=state.options.window)
    return summary(weights, shutter.combine)


def set_bars(shutter: PropertyGroup, weights: Sequence[float] | np.ndarray) -> None:
    """Set the weights (L,) of a shutter's bars that differ."""
    for bar, weight in zip(shutter.bars, weights, strict=True):
        if bar.weight != np.float32(weight):
            bar.weight = weight


def auto_key(context: Context) -> bool:
    """Return whether Blender's Auto Keying is on."""
    return context.scene.tool_settings.use_keyframe_insert_auto


def paint(effect: PropertyGroup, index: int, weights: Sequence[float] | np.ndarray, key: bool = False) -> None:
    """Set a shutter's bars (L,) at the current frame, changing their number if necessary.

    Args:
        key: insert keyframes for them.
    """
    shutter = effect.shutters[index]
    while len(shutter.bars) > len(weights):
        shutter.bars.remove(len(shutter.bars) - 1)
    while len(shutter.bars) < len(weights):
        shutter.bars.add()
    set_bars(shutter, weights)
    if key:
        key_bars(effect, index)


def key_bars(effect: PropertyGroup, index: int) -> None:
    """Insert keyframes for all bars of a shutter at the current frame."""
    # Between keys, the values of F-curves differ from the bars that the picture uses.
    shutter, scene = effect.shutters[index], effect.id_data
    set_bars(shutter, bars_now(effect, index))
    for path in _paths(effect, index):
        # Without a frame, Blender would use the one of the window's scene, which may be another one.
        scene.keyframe_insert(path, group=shutter.name, frame=scene.frame_current)


def _paths(effect: PropertyGroup, index: int) -> list[str]:
    """Return the data paths of a shutter's weights, from the scene."""
    path = f"{effect.path_from_id()}.shutters[{index}].bars"
    return [f"{path}[{k}].weight" for k in range(len(effect.shutters[index].bars))]


def unkey_bars(effect: PropertyGroup, index: int) -> bool:
    """Delete the keyframes of a shutter's bars at the current frame. Return whether there were any."""
    scene = effect.id_data
    curves, is_deleted = fcurves.Curves(scene), False
    for path in filter(curves.find, _paths(effect, index)):
        with suppress(RuntimeError):  # no keyframe here
            is_deleted |= scene.keyframe_delete(path, frame=scene.frame_current)
    return is_deleted


def shown(effect: PropertyGroup, index: int) -> tuple[np.ndarray, list[str]]:
    """Return bars (L,) and key states for drawing code. The result is kept until something changes."""
    key = effect.scene.session_uid, index, effect.id_data.frame_float
    return revision.until_change("bars", key, lambda: _read(effect, index))


def key_state(effect: PropertyGroup, index: int) -> list[str]:
    """Return the state of each bar, as Blender colors fields: "", "animated", "keyed" or "changed"."""
    scene = effect.id_data
    curves = fcurves.Curves(scene)
    bars_and_paths = zip(effect.shutters[index].bars, _paths(effect, index), strict=True)
    return [_state(curves.find(path), bar.weight, scene) for bar, path in bars_and_paths]


def _state(curve: FCurve | None, value: float, scene: Scene) -> str:
    if curve is None:
        return ""
    frame = scene.frame_current_final  # keyframes are stretched like this one
    if abs(max(curve.evaluate(scene.frame_float), 0.0) - value) > 1e-4:  # no bar is below 0, a curve may be
        return "changed"
    return "keyed" if any(abs(key.co[0] - frame) < 1e-3 for key in curve.keyframe_points) else "animated"


def bars_now(effect: PropertyGroup, index: int) -> np.ndarray:
    """Return the bars (L,) of the picture at the current frame, interpolated between keyframes.

    Bars that were changed and not keyed yet count as they are.

    Raises:
        EffectError: the picture is impossible.
    """
    return _read(effect, index)[0]


def _read(effect: PropertyGroup, index: int) -> tuple[np.ndarray, list[str]]:
    scene, states = effect.id_data, key_state(effect, index)
    if "changed" in states:
        return bars(effect.shutters[index]), states
    return snapshot.bars_at(scene, effect, index, scene.frame_float), states
