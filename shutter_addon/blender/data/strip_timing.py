"""How a source strip lies on the timeline, with its retiming keys, of which Blender's Python API gives a part."""

import ctypes

from bpy.app.translations import pgettext_rpt as rpt_

from ...core.frames.retiming import RetimingKey, StripTiming, are_retiming_keys
from ...core.messages import EffectError
from . import source_media

_FIELDS = (
    *("name", "content_start", "content_end", "content_trim_start", "content_trim_end", "left_handle"),
    *("use_reverse_frames", "strobe"),
)


def timing_of(strip) -> StripTiming:
    """The timing of a source strip, as plain data. EffectError: its retiming keys cannot be read."""
    render, is_clip = strip.id_data.render, strip.type == "MOVIECLIP"
    return StripTiming(
        is_clip=is_clip,
        first=source_media.first_frame(strip) if is_clip else 0,
        scene_fps=render.fps / render.fps_base,
        keys=tuple(_retiming_keys(strip)),
        **{name: getattr(strip, name) for name in _FIELDS},
    )


def _retiming_keys(strip) -> list[RetimingKey]:
    """The strip's retiming keys from Blender's memory: Python gets their timeline frames, but not what they show.

    Of a clip strip it gets none at all.
    SeqRetimingKey begins with double strip_frame_index, int flag, float retiming_factor. EffectError: not in this
    Blender.
    """

    class Raw(ctypes.Structure):
        _fields_ = (("index", ctypes.c_double), ("flag", ctypes.c_int), ("factor", ctypes.c_float))

    shown = list(getattr(strip, "retiming_keys", ()))
    raw = [Raw.from_address(key.as_pointer()) for key in shown]
    keys = [RetimingKey(key.index, key.flag, key.factor) for key in raw]
    if not are_retiming_keys(keys, [key.timeline_frame - strip.content_start for key in shown]):
        sentence = rpt_('strip "{strip}": its retiming keys cannot be read in this version of Blender')
        raise EffectError(sentence.format(strip=strip.name))
    return keys
