"""How a source strip lies on the timeline, with its retiming keys, of which Blender's Python API gives a part."""

import numpy as np

from ...core.frames.retiming import RetimingKey, StripTiming, are_retiming_keys
from . import source_media
from .struct_dna import LayoutError, memory, read, record, text

_FIELDS = (
    *("name", "content_start", "content_end", "content_trim_start", "content_trim_end", "left_handle"),
    *("use_reverse_frames", "strobe"),
)
# Records of Blender's memory, as struct_dna.record takes them.
_SEQUENCE = ("char name[64]", "S64"), ("SeqRetimingHandle *retiming_handles", "u8"), ("int retiming_handle_num", "i4")
_KEY = ("double strip_frame_index", "f8"), ("int flag", "i4"), ("float retiming_factor", "f4")


def timing_of(strip) -> StripTiming:
    """The timing of a source strip, as plain data."""
    render = strip.id_data.render
    keys = retiming_keys(strip)
    is_known = keys is not None
    if keys is None:
        even = RetimingKey(0.0, 0, 0.0), RetimingKey(strip.content_end - strip.content_start, 0, 1.0)
        keys = even if len(getattr(strip, "retiming_keys", ())) > 1 else ()
    return StripTiming(
        first=source_media.first_frame(strip) if strip.type == "MOVIECLIP" else 0,
        scene_fps=render.fps / render.fps_base,
        keys=keys,
        is_known=is_known,
        **{name: getattr(strip, name) for name in _FIELDS},
    )


def retiming_keys(strip) -> tuple[RetimingKey, ...] | None:
    """The strip's retiming keys from Blender's memory. Python gets their frames alone, in Blender 5.2 as if the strip
    began with the first one of the edit, and of a clip strip nothing at all. None: they cannot be read."""
    try:
        name, first, count = read(record("Sequence", *_SEQUENCE), strip.as_pointer())
        kind = record("SeqRetimingHandle", *_KEY)
    except LayoutError:
        return None
    if text(name)[2:] != strip.name.encode():  # behind the letters SQ
        return None
    stored = np.frombuffer(memory(first, count * kind.itemsize), kind) if count else ()
    keys = tuple(RetimingKey(*key.tolist()) for key in stored)
    return keys if are_retiming_keys(keys) else None
