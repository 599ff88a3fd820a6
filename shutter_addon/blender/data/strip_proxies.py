"""Where Blender's sequencer keeps the proxies of a strip."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import bpy
from bpy.types import Scene, Strip

from ...media.files import stamp
from . import external_files


@dataclass(frozen=True)
class Proxy:
    """What previews of one size read in place of a strip's footage.

    path: a movie; of_images: a folder with a picture for each of the strip's
    stamp: tells files that were built anew"""

    path: Path
    of_images: bool
    stamp: tuple


def proxy_of(scene: Scene, strip: Strip, percent: int) -> Proxy | None:
    """What Blender reads of a strip in previews of that size, in percent; None: the footage itself."""
    if strip.type not in ("MOVIE", "IMAGE") or not strip.use_proxy or not getattr(strip.proxy, f"build_{percent}"):
        return None
    by_strip = scene.sequence_editor.proxy_storage == "PER_STRIP"
    if by_strip and strip.proxy.use_proxy_custom_file:
        return _proxy(_absolute(strip.proxy.filepath))
    if strip.type == "MOVIE":
        movie = external_files.absolute(strip, strip.filepath)
        stream = f"_st{strip.stream_index}" if strip.stream_index else ""
        return _proxy(_folder(scene, strip, movie.parent) / movie.name / f"proxy_{percent}{stream}.avi")
    if scene.sequencer_colorspace_settings.name != "sRGB":  # what Blender keeps its pictures in
        return None
    folder = _folder(scene, strip, external_files.absolute(strip, strip.directory)) / "images" / str(percent)
    ends = strip.elements[0], strip.elements[-1]
    return _proxy(folder, *(of_image(folder, element.filename) for element in ends))


def of_image(folder: Path, image: str | Path) -> Path:
    """The proxy of an image file, by its name or path."""
    return folder / f"{Path(image).name}_proxy.jpg"


def _folder(scene: Scene, strip: Strip, beside: Path) -> Path:
    """Where the strip's proxies lie; beside: the folder of its footage."""
    if scene.sequence_editor.proxy_storage == "PROJECT":
        return _absolute(scene.sequence_editor.proxy_dir or "//BL_proxy")
    if strip.proxy.use_proxy_custom_directory:
        return _absolute(strip.proxy.directory)
    return beside / "BL_proxy"


def _proxy(path: Path, *files: Path) -> Proxy | None:
    """files: those of a folder that are looked at. None: one is missing."""
    stamps = tuple(map(stamp, files or (path,)))
    return None if None in stamps else Proxy(path, bool(files), stamps)


def _absolute(path: str) -> Path:
    """Blender finds folders of proxies from the file that is open, wherever their strip is from."""
    return Path(bpy.path.abspath(path))
