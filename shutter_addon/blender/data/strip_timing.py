"""How a source strip lies on the timeline, with its retiming keys, of which Blender's Python API gives a part."""

from bpy.app.translations import pgettext_rpt as rpt_

from ...core.frames.retiming import RetimingKey, StripTiming, are_retiming_keys
from ...core.messages import EffectError
from . import source_media
from .struct_dna import LayoutError, read, record

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
    """The strip's retiming keys from Blender's memory: Python gets their timeline frames, but not what they show. Of a
    clip strip it gets none at all. EffectError: not in this Blender."""
    shown = list(getattr(strip, "retiming_keys", ()))
    indices = [float(key.timeline_frame - strip.content_start) for key in shown]
    try:
        kind = record("SeqRetimingHandle", "double strip_frame_index", "int flag", "float retiming_factor")
    except LayoutError:
        if len(shown) <= 2:  # the first and the last, which show the content's start and its end
            return [RetimingKey(index, 0, factor) for index, factor in zip(indices, (0.0, 1.0), strict=False)]
    else:
        keys = [RetimingKey(*read(kind, key.as_pointer()).tolist()) for key in shown]
        if are_retiming_keys(keys, indices):
            return keys
    sentence = rpt_(
        'strip "{strip}": its retiming keys cannot be read in this version of Blender; keys of Source Time can take'
        " their place"
    )
    raise EffectError(sentence.format(strip=strip.name))
