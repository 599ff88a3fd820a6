"""Files outside the .blend file that its data-blocks name, and which of those that an edit needs are missing."""

from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import bpy
from bpy.types import ID, Scene, Strip

from ...core.frames import frame_ranges
from ...core.messages import UserError, of_file
from ...media import MediaError, open_source
from ...media.files import check_file, check_sound
from ...media.sequence import numbered_alike
from . import requirements, strips


def named(item: ID) -> list[Path]:
    """Return the paths of the files that a data-block uses; empty if it is packed, generated or has no file.

    A tiled image has a file for each tile. Of an image sequence, only the file whose path Blender stores is returned.

    Args:
        item: A data-block with a file path, such as an image, clip, font or library.
    """
    source = getattr(item, "source", "FILE")
    if source in ("GENERATED", "VIEWER") or item.filepath in ("", "<builtin>") or getattr(item, "packed_file", None):
        return []
    if source == "TILED":
        return [absolute(item, item.filepath.replace("<UDIM>", str(tile.number))) for tile in item.tiles]
    return [absolute(item, item.filepath)]


def every(item: ID) -> list[Path]:
    """Return the files as `named` does, but for an image sequence all of its pictures, in order."""
    files = named(item)
    if getattr(item, "is_sequence", False) or getattr(item, "source", "") == "SEQUENCE":
        with suppress(MediaError):
            return [file for path in files for file in numbered_alike(path) or [path]]  # before the named one, too
    return files


def absolute(owner: ID | Strip, path: str) -> Path:
    """Return the absolute path of a file that a data-block or a strip uses.

    Args:
        owner: The data-block or the strip. A path that begins with // is relative to its .blend file, which may be a
            linked library.
        path: The path as it is stored, for example in `filepath`.
    """
    library = owner.library if isinstance(owner, bpy.types.ID) else owner.id_data.library
    return Path(bpy.path.abspath(path, library=library))


def relative(path: str) -> str:
    """Return a path relative to the open .blend file, or unchanged if they lie on different drives."""
    with suppress(ValueError):
        return bpy.path.relpath(path)
    return path


def faults(scene: Scene, frames: range, *, sources: bool) -> list[str]:
    """Return a sentence for each missing or unreadable file that pictures at these timeline frames need.

    These are files of movie, image and clip strips, of images, volumes, caches and fonts that are used, and of all
    libraries. Files of mattes are not checked. In scenes that Scene strips show, all frames count.

    Args:
        scene: The scene that is rendered.
        frames: Its timeline frames.
        sources: Whether to check source strips of effects, too, where they lie unmuted.
    """
    sentences = _of_strips(scene, frames, strips.SOURCES, sources=sources)
    used, data = requirements.used_data(scene, frames), bpy.data
    data_blocks = (*data.images, *data.volumes, *data.cache_files, *data.movieclips, *data.fonts)
    for item in (*filter(used.__contains__, data_blocks), *data.libraries):
        sentences += [f'{item.bl_rna.name.lower()} "{item.name}": {fault}' for fault in _of_item(item)]
    return list(dict.fromkeys(sentences))


def sound_faults(scene: Scene, frames: range) -> list[str]:
    """Return a sentence for each sound strip at these timeline frames whose file is missing or unreadable."""
    return _of_strips(scene, frames, ("SOUND",), sources=False)


def _of_strips(scene: Scene, frames: range, kinds: tuple[str, ...], *, sources: bool) -> list[str]:
    sentences = []
    for shown, wanted in requirements.shown_scenes(scene, frames).items():
        others = [] if sources else [each.source.name for each in strips.with_sources(shown)]
        for strip in shown.sequence_editor.strips_all:
            at = frame_ranges.common(requirements.shown_frames(shown, strip), wanted)
            if at and strip.type in kinds and strip.name not in others:
                sentences += [f'strip "{strip.name}": {fault}' for fault in _of_strip(strip, at)]
    return sentences


def _of_strip(strip: Strip, frames: range) -> Iterator[str]:
    if strip.type == "MOVIE":
        yield from raised(_open, absolute(strip, strip.filepath))
    elif strip.type == "IMAGE":
        elements = {element.filename for frame in frames if (element := strip.strip_elem_from_frame(frame))}
        folder = absolute(strip, strip.directory)
        yield from [fault for name in sorted(elements) for fault in raised(check_file, folder / name)][:1]
    elif strip.type == "MOVIECLIP":
        yield from _of_item(strip.clip) if strip.clip else ["it has no clip"]
    elif strip.type == "SOUND":
        yield from _of_item(strip.sound, check_sound) if strip.sound else ["it has no sound"]


def _of_item(item: ID, check: Callable = check_file) -> Iterator[str]:
    """Yield a sentence for each missing or unreadable file of a data-block.

    Of an image sequence, only the file whose path Blender stores is checked.

    Args:
        item: The data-block.
        check: Called with each path. It raises a MediaError if the file is missing or unreadable.
    """
    for path in named(item):
        yield from raised(check, path)


def raised(check: Callable, *arguments) -> list[str]:
    """Call `check(*arguments)` and return the message of its UserError or OSError in a list, empty without an error."""
    try:
        check(*arguments)
    except (UserError, OSError) as error:
        return [of_file(error, arguments[0])]
    return []


def _open(path: Path) -> None:
    open_source(path).close()
