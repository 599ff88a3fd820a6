"""The medium of a source strip: what it is, opened as shutter_addon.media has it; and how the strip lies on the
timeline, where Blender's sequencer keeps its proxies, and its retiming keys, of which Blender's Python API gives a
part."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import Scene, Strip

from ...core.frames.frame_source import FrameSource
from ...core.frames.retiming import RetimingKey, StripTiming, are_retiming_keys
from ...core.memo import Kept
from ...media import MediaError, open_source
from ...media.files import stamp
from ...media.opening import with_proxy
from ...media.sequence import by_number
from . import external_files
from .struct_dna import LayoutError, memory, read, record, text

_AT_ONCE = 100  # files of a sequence, which may be long, that one look asks, beside the first and the last
_REST = 1.0  # seconds from one look at them to the next: on a network's drive a look takes a while
_KEPT = 256
_TIMES = (
    *("name", "content_start", "content_end", "content_trim_start", "content_trim_end", "left_handle"),
    *("use_reverse_frames", "strobe"),
)
# Records of Blender's memory, as struct_dna.record takes them.
_SEQUENCE = ("char name[64]", "S64"), ("SeqRetimingHandle *retiming_handles", "u8"), ("int retiming_handle_num", "i4")
_KEY = ("double strip_frame_index", "f8"), ("int flag", "i4"), ("float retiming_factor", "f4")


@dataclass
class _Look:
    """What is known of a strip's files: path and stamp of each, which of them is next, how many are still to be asked
    at once, when some were asked last, and a number that changes with what is known."""

    known: list
    next: int
    due: int
    when: float = 0.0
    key: int = 0


_specs: Kept[tuple, SourceSpec] = Kept()  # by media_key
_looks: Kept[tuple, _Look] = Kept()  # by scene and strip, or by image, and how many files they have
_resting = False  # while a film is rendered, all its files have been asked before it


def media_key(strip: Strip) -> tuple:
    """What the strip reads and how; equal keys give the same frames."""
    return strip.type, *files_key(strip), *reading(strip)


def files_key(strip: Strip) -> tuple:
    """The strip's files: the first and the last as they are now, and those between as they were when they were looked
    at: a hundred of them a second, in turn, and none while a film is rendered. MediaError: it has none."""
    count, path = _files(strip)
    ends = dict.fromkeys((path(0), path(count - 1)))
    place = strip.id_data.session_uid, strip.name
    return count, *((str(end), stamp(end)) for end in ends), between(place, count, path)


def look_again() -> None:
    """Has all files asked again at the next look."""
    for look in list(_looks.values()):
        look.due = len(look.known)


def rest(resting: bool) -> None:
    """While a film renders, the files between a sequence's first and last are asked after look_again alone."""
    global _resting
    _resting = resting


def forget() -> None:
    """Forgets what the files were, before another file is loaded."""
    rest(False)
    _looks.clear()
    _specs.clear()


def between(place: tuple, count: int, path: Callable[[int], Path]) -> int:
    """A number that changes when a file of a sequence is found replaced. One that is gone is not: what was made of it
    still holds, and whoever needs the file itself is told.

    place: what knows it, a strip or an image, as a key; count: of its files; path: gives that of each by its index"""
    if count < 3:
        return 0
    look = _looks.ask((*place, count), lambda: _Look(known=[None] * count, next=0, due=count), _KEPT)
    if not look.due and (_resting or time.monotonic() - look.when < _REST):
        return look.key
    changed = False
    for index in range(look.next, look.next + max(look.due, min(_AT_ONCE, count))):
        file = path(index % count)
        current, known = (file, stamp(file)), look.known[index % count]
        if current != known and (known is None or current[1] is not None or current[0] != known[0]):
            look.known[index % count], changed = current, True
    look.next, look.due, look.when = (index + 1) % count, 0, time.monotonic()
    if changed:
        look.key = hash(tuple(look.known))
    return look.key


def reading(strip: Strip) -> tuple:
    """How the strip's files are read: colour space, alpha and the like."""
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
    """What previews of one size read in place of a strip's footage.

    path: a movie; of_images: a folder with a picture for each of the strip's
    stamp: tells files that were built anew"""

    path: Path
    of_images: bool
    stamp: tuple


@dataclass(frozen=True)
class SourceSpec:
    """What a source strip reads, and how: plain data, equal where it gives the same frames.

    files: of an image strip, one per frame; None: a movie, or what is found beside `path`
    options: of media.open_source"""

    key: tuple
    path: Path = field(compare=False)
    files: tuple[Path, ...] | None = field(compare=False)
    options: dict = field(compare=False)

    def open(self, divisor: int = 1, proxy: Proxy | None = None) -> FrameSource:
        """The medium, as Blender would show it; divisor: of media.open_source; proxy: what frames are read from, where
        it fits. MediaError: it cannot be read."""
        medium = open_source(self.path, files=self.files, divisor=divisor, **self.options)
        if proxy is None:
            return medium
        how = {name: self.options[name] for name in ("colorspace", "config")}
        if proxy.of_images and self.files:
            files = [of_image(proxy.path, file) for file in self.files]
            # Blender has converted them to the sequencer's colour space, but for data.
            how = {"files": files, "colorspace": "Non-Color" if how["colorspace"] == "Non-Color" else None}
        return with_proxy(medium, partial(open_source, proxy.path, **how))


def spec(strip: Strip, key: tuple | None = None) -> SourceSpec:
    """What a source strip reads; key: its media_key, where that is known. MediaError: it has no files."""
    key = key or media_key(strip)
    return _specs.ask(key, lambda: _spec(strip, key), _KEPT)


def _spec(strip: Strip, key: tuple) -> SourceSpec:
    count, path = _files(strip)
    config = Path(bpy.utils.system_resource("DATAFILES", path="colormanagement"), "config.ocio")  # finds folders only
    alpha = "premultiplied" if strip.alpha_mode == "PREMUL" else "straight"  # whatever the files say
    options = {
        "stream": getattr(strip, "stream_index", 0),
        "colorspace": reading(strip)[0],
        "config": config,
        "alpha": None if strip.type == "MOVIECLIP" else alpha,
        "deinterlace": strip.type == "MOVIE" and strip.use_deinterlace,
    }
    return SourceSpec(
        key=key, path=path(0), files=None if is_movie(strip) else tuple(path(i) for i in range(count)), options=options
    )


def open_media(strip: Strip) -> FrameSource:
    """The strip's medium, as Blender would show it. MediaError: it cannot be read."""
    return spec(strip).open()


def files(strip: Strip) -> list[Path]:
    """The files of a movie, image or clip strip, there or not, whether or not an effect can read it so. MediaError: it
    has none."""
    count, path = _clip_files(strip) if strip.type == "MOVIECLIP" else _files(strip)
    return [path(index) for index in range(count)]


def first_frame(strip: Strip) -> int:
    """Which frame of the medium is the first of the strip's content."""
    return strip.clip.frame_offset if strip.type == "MOVIECLIP" and is_movie(strip) else 0


def is_movie(strip: Strip) -> bool:
    """Whether a movie, image or clip strip reads a movie."""
    clip = strip.clip if strip.type == "MOVIECLIP" else None
    return strip.type == "MOVIE" or (clip is not None and clip.source == "MOVIE")


def _files(strip: Strip) -> tuple[int, Callable[[int], Path]]:
    """How many files the strip reads, and a function that gives the path of each."""
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
    """A clip's movie, or its images by their numbers, without a gap."""
    clip = strip.clip
    if clip is None:
        raise MediaError(rpt_('strip "{strip}" has no clip').format(strip=strip.name))
    path = external_files.absolute(clip, clip.filepath)
    beside = by_number(path)
    if clip.source == "MOVIE" or beside is None:
        return 1, lambda _i: path
    return max(clip.frame_duration, 1), lambda i: beside(clip.frame_offset + i)


def timing_of(strip: Strip) -> StripTiming:
    """The timing of a source strip, as plain data."""
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
