"""The footage of a source strip: its files, how they are opened, and the strip's timing, retiming keys and proxies."""

import ctypes
import math
from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import Scene, Strip

from ...core.caches import RecentValues
from ...core.frames.frame_source import FrameSource
from ...core.frames.retiming import RetimingKey, StripTiming
from ...media import MediaError, open_source
from ...media.files import stamp
from ...media.opening import with_proxy
from ...media.sequence import by_number
from . import external_files
from .struct_dna import LayoutError, read, record

_KEPT = 512
_TIMES = (
    *("name", "content_start", "content_end", "content_trim_start", "content_trim_end", "left_handle"),
    *("use_reverse_frames", "strobe"),
)
# Records of Blender's memory, for struct_dna.record.
_SEQUENCE = ("char name[64]", "S64"), ("SeqRetimingHandle *retiming_handles", "u8"), ("int retiming_handle_num", "i4")
_KEY = ("double strip_frame_index", "f8"), ("int flag", "i4"), ("float retiming_factor", "f4")


_known: RecentValues[Hashable, Any] = RecentValues()  # what `stamps` and `spec` return


def media_key(strip: Strip) -> tuple:
    """Return a key for a strip's files and how they are read. Equal keys mean the same frames.

    The key changes when the first or last file is replaced; when another one is, only after look_again.

    Raises:
        MediaError: The strip has no files, or is a clip strip that is undistorted or stabilized.
    """
    count, path = _files(strip)
    ends = [(str(end), stamp(end)) for end in dict.fromkeys((path(0), path(count - 1)))]
    others = stamps((strip.id_data.session_uid, strip.name, count), lambda: map(path, range(count)))
    return strip.type, count, *ends, others, *reading(strip)


def look_again() -> None:
    """Forget what is known of files on disk, so that all are checked when they are next needed."""
    _known.clear()


def stamps(place: Hashable, files: Callable[[], Iterable[Path]]) -> int:
    """Return a number for the state (times of change and sizes) of files on disk, to notice when one is replaced.

    The number is cached. Files are looked at only if it is not, so changes are noticed only after look_again.

    Args:
        place: Key under which the number is cached.
        files: Returns the files' paths.
    """
    return _known.ask(place, lambda: hash(tuple(map(stamp, files()))), _KEPT)


def reading(strip: Strip) -> tuple:
    """Return the settings by which a strip's files are read: color space, alpha and the like."""
    clip = strip.clip if strip.type == "MOVIECLIP" else None
    reader = clip if strip.type == "MOVIECLIP" else strip
    return (
        reader and reader.colorspace_settings.name,
        strip.alpha_mode,
        strip.use_deinterlace,
        getattr(strip, "stream_index", 0),
        clip and (clip.filepath, clip.frame_offset, strip.undistort, strip.stabilize2d),
    )


@dataclass(frozen=True)
class Proxy:
    """A strip's proxy: smaller copies of its files that previews of one size read in place of the footage.

    Attributes:
        path: The proxy movie, or a folder with a proxy picture for each picture of the strip.
        of_images: Whether `path` is a folder of pictures.
        stamp: State of the files. It changes when the proxy is built again.
    """

    path: Path
    of_images: bool
    stamp: tuple


@dataclass(frozen=True)
class SourceSpec:
    """A strip's footage and how it is read, as plain data: equal specs give the same frames.

    Attributes:
        key: What media_key returns for the strip.
        path: The movie, or the first picture.
        files: The picture file of each frame, for strips that read pictures; None: a movie.
        options: Other arguments of media.open_source, by name.
    """

    key: tuple
    path: Path = field(compare=False)
    files: tuple[Path, ...] | None = field(compare=False)
    options: dict = field(compare=False)

    def open(self, divisor: int = 1, proxy: Proxy | None = None) -> FrameSource:
        """Open the footage, with colors and alpha as Blender's strip shows them.

        Args:
            divisor: Factor by which both sides of frames are reduced, as in media.open_source.
            proxy: Proxy to read frames from. If it cannot be read or does not fit the footage, the footage is read
                instead, as with None.

        Raises:
            MediaError: The footage cannot be read.
        """
        medium = open_source(self.path, files=self.files, divisor=divisor, **self.options)
        if proxy is None:
            return medium
        how = {name: self.options[name] for name in ("colorspace", "config")}
        if proxy.of_images and self.files:
            files = [of_image(proxy.path, file) for file in self.files]
            # Blender has converted all but data to the sequencer's color space.
            how = {"files": files, "colorspace": "Non-Color" if how["colorspace"] == "Non-Color" else None}
        return with_proxy(medium, proxy.path, **how)


def spec(strip: Strip) -> SourceSpec:
    """Return a strip's footage and how it is read.

    Raises:
        MediaError: The strip has no files, or is a clip strip that is undistorted or stabilized.
    """
    key = media_key(strip)
    return _known.ask(key, lambda: _spec(strip, key), _KEPT)


def _spec(strip: Strip, key: tuple) -> SourceSpec:
    count, path = _files(strip)
    config = Path(bpy.utils.system_resource("DATAFILES", path="colormanagement"), "config.ocio")
    alpha = "premultiplied" if strip.alpha_mode == "PREMUL" else "straight"  # the strip decides, not the files
    options = {
        "stream": getattr(strip, "stream_index", 0),
        "colorspace": reading(strip)[0],
        "config": config,
        "alpha": None if strip.type == "MOVIECLIP" else alpha,
        "deinterlace": strip.type == "MOVIE" and strip.use_deinterlace,
    }
    files = None if is_movie(strip) else tuple(map(path, range(count)))
    return SourceSpec(key=key, path=path(0), files=files, options=options)


def files(strip: Strip) -> list[Path]:
    """Return the files of a movie, image or clip strip, including missing ones and ones that effects cannot use.

    Raises:
        MediaError: An image strip has no pictures, or a clip strip has no clip.
    """
    count, path = _clip_files(strip) if strip.type == "MOVIECLIP" else _files(strip)
    return list(map(path, range(count)))


def first_frame(strip: Strip) -> int:
    """Return how many frames of a movie a clip strip skips at its beginning (*Frame Offset*); 0 for other strips."""
    return strip.clip.frame_offset if strip.type == "MOVIECLIP" and is_movie(strip) else 0


def is_movie(strip: Strip) -> bool:
    """Tell whether a movie, image or clip strip reads a movie file, not pictures."""
    clip = strip.clip if strip.type == "MOVIECLIP" else None
    return strip.type == "MOVIE" or (clip is not None and clip.source == "MOVIE")


def _files(strip: Strip) -> tuple[int, Callable[[int], Path]]:
    """Return the number of a strip's files, and a function from an index (from 0) to a file's path.

    Raises:
        MediaError: An image strip has no pictures, or a clip strip has no clip, or is undistorted or stabilized.
    """
    if strip.type == "MOVIECLIP":
        if strip.clip is not None and (strip.undistort or strip.stabilize2d):
            sentence = rpt_('strip "{strip}": undistorted or stabilized clips are not supported')
            raise MediaError(sentence.format(strip=strip.name))
        return _clip_files(strip)
    if strip.type == "MOVIE":
        movie = external_files.absolute(strip, strip.filepath)
        return 1, lambda _i: movie
    folder, elements = external_files.absolute(strip, strip.directory), strip.elements
    if not elements:
        raise MediaError(rpt_('strip "{strip}" has no files').format(strip=strip.name))
    return len(elements), lambda i: folder / elements[i].filename


def _clip_files(strip: Strip) -> tuple[int, Callable[[int], Path]]:
    """Return the number of a clip strip's files, and a function from an index (from 0) to a file's path.

    The files are the clip's movie, or its numbered pictures from its *Frame Offset* on, whether they exist or not.

    Raises:
        MediaError: The strip has no clip.
    """
    clip = strip.clip
    if clip is None:
        raise MediaError(rpt_('strip "{strip}" has no clip').format(strip=strip.name))
    path = external_files.absolute(clip, clip.filepath)
    beside = by_number(path)
    if clip.source == "MOVIE" or beside is None:
        return 1, lambda _i: path
    return max(clip.frame_duration, 1), lambda i: beside(clip.frame_offset + i)


def timing_of(strip: Strip) -> StripTiming:
    """Return which frame of its footage a source strip shows when, as plain data."""
    render = strip.id_data.render
    keys = retiming_keys(strip)
    is_known = keys is not None
    if keys is None:
        even = RetimingKey(0.0, 0, 0.0), RetimingKey(strip.content_end - strip.content_start, 0, 1.0)
        keys = even if len(getattr(strip, "retiming_keys", ())) > 1 else ()
    return StripTiming(
        first=first_frame(strip) if strip.type == "MOVIECLIP" else 0,
        scene_fps=render.fps / render.fps_base,
        keys=keys,
        is_known=is_known,
        **{name: getattr(strip, name) for name in _TIMES},
    )


def retiming_keys(strip: Strip) -> tuple[RetimingKey, ...] | None:
    """Return a strip's retiming keys, read from Blender's memory; None: they cannot be read.

    Blender's Python API would not do. It gives only the keys' frames, and none for clip strips. In Blender 5.2, it
    counts these frames from the start of the edit's first strip.
    """
    try:
        name, first, count = read(record("Sequence", *_SEQUENCE), strip.as_pointer())
        kind = record("SeqRetimingHandle", *_KEY)
    except LayoutError:
        return None
    if name.partition(b"\0")[0][2:] != strip.name.encode():  # behind the letters SQ
        return None
    stored = np.frombuffer(ctypes.string_at(first, count * kind.itemsize), kind) if count else ()
    keys = tuple(RetimingKey(*key.tolist()) for key in stored)
    return keys if are_retiming_keys(keys) else None


def are_retiming_keys(keys: Sequence[RetimingKey]) -> bool:
    """Return whether keys can be Blender's: finite and in order."""
    numbers = [number for key in keys for number in (key.index, key.factor)]
    return all(map(math.isfinite, numbers)) and all(a.index <= b.index for a, b in pairwise(keys))


def proxy_of(scene: Scene, strip: Strip, percent: int) -> Proxy | None:
    """Return the proxy that previews of one size read for a strip; None: they read the footage itself.

    They do so if the strip has no proxy of this size, if the proxy has a custom file or folder or is missing on disk,
    for clip strips, and for image strips if the sequencer's color space is not sRGB.

    Args:
        scene: The scene that has the strip.
        strip: The source strip.
        percent: Size of the preview: 25, 50, 75 or 100.
    """
    if strip.type not in ("MOVIE", "IMAGE") or not strip.use_proxy or not getattr(strip.proxy, f"build_{percent}"):
        return None
    if strip.proxy.use_proxy_custom_file or strip.proxy.use_proxy_custom_directory:
        return None
    if strip.type == "MOVIE":
        movie = external_files.absolute(strip, strip.filepath)
        stream = f"_st{strip.stream_index}" if strip.stream_index else ""
        return _proxy(_folder(scene, movie.parent) / movie.name / f"proxy_{percent}{stream}.avi")
    if scene.sequencer_colorspace_settings.name != "sRGB":  # the color space of Blender's proxy pictures
        return None
    folder = _folder(scene, external_files.absolute(strip, strip.directory)) / "images" / str(percent)
    ends = strip.elements[0], strip.elements[-1]
    return _proxy(folder, *(of_image(folder, element.filename) for element in ends))


def of_image(folder: Path, image: str | Path) -> Path:
    """Return the proxy file of an image file, in a folder of proxies."""
    return folder / f"{Path(image).name}_proxy.jpg"


def _folder(scene: Scene, beside: Path) -> Path:
    """Return the folder in which Blender keeps proxies: the scene's, or a folder beside the footage.

    Args:
        scene: The scene, whose proxies may all be stored in one folder.
        beside: Folder of the footage.
    """
    if scene.sequence_editor.proxy_storage == "PROJECT":  # Blender finds it from the open file
        return Path(bpy.path.abspath(scene.sequence_editor.proxy_dir or "//BL_proxy"))
    return beside / "BL_proxy"


def _proxy(path: Path, *files: Path) -> Proxy | None:
    """Return a proxy; None: one of its files is missing.

    Args:
        path: The proxy movie, or the folder of proxy pictures.
        files: For a folder, the pictures in it that are checked. For a movie, none.
    """
    stamps = tuple(map(stamp, files or (path,)))
    return None if None in stamps else Proxy(path, bool(files), stamps)
