"""The medium of a source strip: what it is, opened as shutter_addon.media has it."""

import os
from pathlib import Path

import bpy

from ..media import MediaError, open_source


def media_key(strip) -> tuple:
    """What the strip reads and how; equal keys give the same frames."""
    paths = _paths(strip)
    return (
        strip.type,
        tuple(map(str, paths)),
        tuple(_stamp(path) for path in dict.fromkeys((paths[0], paths[-1]))),
        strip.colorspace_settings.name,
        strip.alpha_mode,
        strip.use_deinterlace,
        getattr(strip, "stream_index", 0),
    )


def open_media(strip):
    """The strip's medium, as Blender would show it. MediaError: it cannot be read."""
    paths = _paths(strip)
    config = Path(bpy.utils.system_resource("DATAFILES", path="colormanagement/config.ocio"))
    return open_source(
        paths[0],
        files=paths if strip.type == "IMAGE" else None,
        stream=getattr(strip, "stream_index", 0),
        colorspace=strip.colorspace_settings.name,
        config=config,
        alpha="premultiplied" if strip.alpha_mode == "PREMUL" else "straight",
        deinterlace=strip.use_deinterlace,
    )


def _paths(strip) -> list[Path]:
    library = strip.id_data.library
    if strip.type == "MOVIE":
        return [Path(bpy.path.abspath(strip.filepath, library=library))]
    folder = Path(bpy.path.abspath(strip.directory, library=library))
    paths = [folder / element.filename for element in strip.elements]
    if not paths:
        raise MediaError(f'strip "{strip.name}" has no files')
    return paths


def _stamp(path: Path):
    """Tells a file that was replaced from what it was; None for a missing one."""
    try:
        status = os.stat(path)
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size
