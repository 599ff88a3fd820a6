"""Whether there is a place for what an edit is rendered to: folders that can be written to, and room on their disks."""

import os
import shutil
from pathlib import Path
from typing import NamedTuple

from ...core import atomic_write


class Need(NamedTuple):
    """What a folder, which may not be there yet, is to hold: bytes at most, and what they are, for a sentence."""

    folder: Path
    size: int
    what: str


def picture(width: int, height: int, sample: int) -> int:
    """The bytes that an RGBA picture file takes at most: of noise, which is not compressed, with what the formats add
    to each block, line and file. sample: bytes of one"""
    samples = width * height * 4 * sample
    return samples + samples // 256 + 16 * height + 4096


def faults(needs: list[Need]) -> list[str]:
    """A sentence for each folder that cannot be written to, and for each disk that has not the room."""
    sentences = [fault for folder in dict.fromkeys(need.folder for need in needs) for fault in _unwritable(folder)]
    disks: dict[int, list[Need]] = {}
    for need in needs:
        disks.setdefault(os.stat(_existing(need.folder)).st_dev, []).append(need)
    for disk in disks.values():
        size, left = sum(need.size for need in disk), free(disk[0].folder)
        if size > left:
            what = " and ".join(dict.fromkeys(need.what for need in disk if need.size))
            sentences.append(f"{disk[0].folder}: {what} may take {in_units(size)}, {in_units(left)} are free")
    return sentences


def free(folder: Path) -> int:
    """Bytes on the disk that has the folder, or will."""
    return shutil.disk_usage(_existing(folder)).free


def in_units(count: int) -> str:
    """Bytes for people."""
    sizes = {"GB": 1 << 30, "MB": 1 << 20, "kB": 1 << 10}
    unit = next((unit for unit, size in sizes.items() if count >= size), "kB")
    return f"{count / sizes[unit]:.1f} {unit}"


def _unwritable(folder: Path) -> list[str]:
    place = _existing(folder)
    if not place.is_dir():
        return [f"{place}: is a file, and no folder"]
    try:
        with atomic_write.part_folder(place):  # what permissions and mounts promise is not always so
            return []
    except OSError as error:
        return [f"{place}: {error.strerror or error}"]


def _existing(folder: Path) -> Path:
    """The folder, or the innermost of those around it that is there."""
    return next(path for path in (folder, *folder.parents) if path.exists())
