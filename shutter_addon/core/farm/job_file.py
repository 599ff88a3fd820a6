"""The version of an edit, which tells pictures of it from those of another version, on any machine; and the file beside
a job's pictures that says which version they are of: no machine renders another one among them."""

from __future__ import annotations

import hashlib
import json
import re
import stat
from dataclasses import asdict, dataclass
from pathlib import Path

from .. import atomic_write
from ..messages import UserError

NAME = "virtual_shutter_job.json"
_VERSION = 1  # of the file's format
_LARGEST = 1 << 26  # bytes
_NOTE = "virtual_shutter edit "  # what a picture's metadata say, before the key


@dataclass(frozen=True)
class Footage:
    """Files that the edit reads: a movie, a picture, or those of an image sequence.

    name: of the first file; files: how many; content: a digest of theirs, in hexadecimal
    missing: the name of the first that is missing or cannot be read; "": none is"""

    name: str
    files: int
    content: str
    missing: str = ""


@dataclass(frozen=True)
class EditVersion:
    """All that an edit's pictures depend on, but for the device that composes them.

    blend: SHA-256 of the .blend file, in hexadecimal; extension, blender: their versions
    colours: of the OpenColorIO configuration, its SHA-256 or the name of one that OpenColorIO brings; "": Blender's own
    footage: in the order in which the .blend names it"""

    blend: str
    extension: str
    blender: str
    colours: str
    footage: tuple[Footage, ...]

    @property
    def key(self) -> str:
        """16 hexadecimal digits: equal for copies of the edit, wherever its files lie and whatever they are called."""
        footage = [(each.files, each.content) for each in self.footage]
        parts = self.blend, self.extension, self.blender, self.colours, footage
        return hashlib.sha256(json.dumps(parts).encode()).hexdigest()[:16]

    def difference(self, other: EditVersion) -> str | None:
        """What is different here from another version, the first thing of all, as the end of a sentence about that
        version; None: nothing is."""
        if self.key == other.key:
            return None
        if self.extension != other.extension:
            return f"is of version {other.extension} of the extension, this machine has {self.extension}"
        if self.blender != other.blender:
            return f"is of Blender {other.blender}, this machine has {self.blender}"
        if self.colours != other.colours:
            return f"is of {_configuration(other)}, this machine has {_configuration(self)}"
        if self.blend != other.blend:
            return "is of another version of the .blend file"
        for here, there in zip(self.footage, other.footage, strict=False):
            if (here.files, here.content) != (there.files, there.content):
                if here.missing:
                    return f"is of other footage: {here.missing} is missing or cannot be read on this machine"
                name = here.name if here.files == 1 else f"one of the {here.files} files from {here.name} on"
                return f"is of other footage: {name} has other content on this machine"
        return "is of other footage"

    def as_data(self) -> dict:
        """For JSON."""
        return {**asdict(self), "key": self.key}

    @classmethod
    def from_data(cls, data: dict) -> EditVersion:
        """What `as_data` gave. KeyError, TypeError, ValueError: it gave no such thing."""
        footage = tuple(Footage(**one) for one in data["footage"])
        texts = {name: str(data[name]) for name in ("blend", "extension", "blender", "colours")}
        return cls(footage=footage, **texts)


def _configuration(version: EditVersion) -> str:
    which = version.colours[:16] or "of Blender"
    return f"the OpenColorIO configuration {which}"


def note(key: str) -> str:
    """What the metadata of a picture say of its edit's version."""
    return _NOTE + key


def key_in(text: str) -> str | None:
    """The key in what a picture's metadata say; None: they say nothing of an edit."""
    match = re.fullmatch(re.escape(_NOTE) + "([0-9a-f]{16})", text)
    return match and match[1]


class JobError(UserError, ValueError):
    """The file is damaged, or says another version than this machine's; the message is one sentence for the user."""


def write(folder: Path, version: EditVersion) -> None:
    """Writes the file into the pictures' folder, whole or not at all. OSError: it cannot be written."""
    data = {"version": _VERSION, "edit": version.as_data()}
    with atomic_write.writing(folder / NAME) as part:
        part.write_text(json.dumps(data, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def read(folder: Path) -> EditVersion | None:
    """The version of the edit that the pictures' folder is for; None: there is no job. JobError: the file is damaged,
    or a pipe or the like. OSError: it cannot be read."""
    path = folder / NAME
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):  # a pipe would never open
            raise JobError(f"{path}: is no file")
        if status.st_size > _LARGEST:
            raise ValueError
        data = json.loads(path.read_bytes())
        if data["version"] != _VERSION:
            raise JobError(f"{path}: is of a newer version of the extension")
        return EditVersion.from_data(data["edit"])
    except FileNotFoundError:
        return None
    except JobError:
        raise
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        raise JobError(f"{path}: is damaged; check the edit again") from None


def guard(folder: Path, here: EditVersion) -> None:
    """JobError: the folder is for pictures of another version than this machine would render. OSError: it cannot be
    known."""
    job = read(folder)
    if job is not None and (difference := here.difference(job)):
        raise JobError(f"{folder / NAME}: the job {difference}")
