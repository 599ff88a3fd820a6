"""Edit a shutter's bars (how much each frame of its window counts): set, key and unkey them, and read them."""

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
    """Return a text for the user about a shutter's bars, such as "180° (4 of 8 frames)".

    If all bars are zero, it says that the shutter never opens.

    Args:
        weights: The bars (L,): how much each frame of the window counts.
        combine: How frames are combined, the identifier of an item of choices.COMBINES. For "AVERAGE", the text has the
            angle of a rotary shutter with the same light; 360° is the whole window. For others, it has the number of
            frames that are combined, and no angle.
    """
    if not np.any(weights):
        return iface_("All bars are zero: the shutter never opens")
    if combine != "AVERAGE":
        name, count = next(name for word, name, _ in COMBINES if word == combine), np.count_nonzero(weights)
        words = iface_("{combine} of 1 frame") if count == 1 else iface_("{combine} of {count} frames")
        return words.format(combine=iface_(name), count=count)
    angle, window = shutters.open_angle(weights), len(weights)
    words = iface_("{angle}° ({frames} of {window} frames)")
    return words.format(angle=f"{angle:.0f}", frames=f"{angle / 360 * window:.3g}", window=window)


def current_summary(scene: Scene, effect: PropertyGroup, strip: Strip, weights: np.ndarray) -> str:
    """Return a text for the user about the active shutter's bars: how long it is open.

    If the exposure's length varies (*Timeline*, or *Distance* of what it follows), the text says how many frames are
    open at the playhead. Otherwise it is the text of `summary`; also if the playhead is not on the strip, during a
    render, and where the effect has an error.

    Args:
        scene: The scene that has the strip.
        effect: The effect that the strip shows.
        strip: The effect strip.
        weights: The bars (L,): how much each frame of the window counts.
    """
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
    """Set the weights of a shutter's bars. Bars that have the wanted weight already are not touched.

    Args:
        weights: (L,): how much each frame of the window counts, one for each bar.
    """
    for bar, weight in zip(shutter.bars, weights, strict=True):
        if bar.weight != np.float32(weight):
            bar.weight = weight


def auto_key(context: Context) -> bool:
    """Tell whether Blender's *Auto Keying* is on."""
    return context.scene.tool_settings.use_keyframe_insert_auto


def paint(effect: PropertyGroup, index: int, weights: Sequence[float] | np.ndarray, key: bool = False) -> None:
    """Give a shutter as many bars as there are weights, and set their stored weights.

    Args:
        index: Index of the shutter in the effect.
        weights: (L,): how much each frame of the window counts.
        key: Also insert keyframes at the current frame. Without them, animated bars change back with the next frame.
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
    """Insert keyframes at the current frame for all bars of a shutter, with the weights of the picture there.

    Args:
        index: Index of the shutter in the effect.

    Raises:
        EffectError: As for bars_now.
    """
    # Between keys, the values of F-curves differ from the bars that the picture uses.
    shutter, scene = effect.shutters[index], effect.id_data
    set_bars(shutter, bars_now(effect, index))
    for path in _paths(effect, index):
        # Without a frame, Blender would use the one of the window's scene, which may be another one.
        scene.keyframe_insert(path, group=shutter.name, frame=scene.frame_current)


def _paths(effect: PropertyGroup, index: int) -> list[str]:
    """Return the data paths, relative to the scene, of the weights of a shutter's bars, one for each bar."""
    path = f"{effect.path_from_id()}.shutters[{index}].bars"
    return [f"{path}[{k}].weight" for k in range(len(effect.shutters[index].bars))]


def unkey_bars(effect: PropertyGroup, index: int) -> bool:
    """Delete the keyframes that a shutter's bars have at the current frame. Return whether there were any."""
    scene = effect.id_data
    curves, is_deleted = fcurves.Curves(scene), False
    for path in filter(curves.find, _paths(effect, index)):
        with suppress(RuntimeError):  # no keyframe here
            is_deleted |= scene.keyframe_delete(path, frame=scene.frame_current)
    return is_deleted


def shown(effect: PropertyGroup, index: int) -> tuple[np.ndarray, list[str]]:
    """Return what the bar editor draws of a shutter at the current frame. It is cached until something changes.

    Args:
        index: Index of the shutter in the effect.

    Returns:
        The bars (L,), from bars_now; and the animation state of each bar, from key_state.

    Raises:
        EffectError: As for bars_now.
    """
    key = effect.scene.session_uid, index, effect.id_data.frame_float
    return revision.until_change("bars", key, lambda: _read(effect, index))


def key_state(effect: PropertyGroup, index: int) -> list[str]:
    """Return the animation state of each of a shutter's bars at the current frame, which the bar editor shows in color.

    Args:
        index: Index of the shutter.

    Returns:
        A word for each bar: "" (no F-curve determines it), "changed" (its stored weight differs from its F-curve,
        because it was edited and not keyed yet), "keyed" (it has a keyframe at this frame) or "animated" (none here).
    """
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
    """Return a shutter's bars (L,) at the current frame: how much each frame of the window counts in the picture.

    Bars with keyframes are interpolated. But if any bar was changed and is not keyed yet, all bars are returned as they
    are stored, without a check.

    Args:
        index: Index of the shutter.

    Raises:
        EffectError: A bar or an option of the effect is out of range, or the number of bars is not the window's length.
    """
    return _read(effect, index)[0]


def _read(effect: PropertyGroup, index: int) -> tuple[np.ndarray, list[str]]:
    scene, states = effect.id_data, key_state(effect, index)
    if "changed" in states:
        return bars(effect.shutters[index]), states
    return snapshot.bars_at(scene, effect, index, scene.frame_float), states
