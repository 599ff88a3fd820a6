"""The version of an edit, which marks its pictures on any machine, and the job file beside the pictures, which keeps
machines from rendering different versions into one folder."""

from __future__ import annotations

import hashlib
import json
import re
from dataclasses import asdict, dataclass
from pathlib import Path

from .. import atomic_write
from ..messages import UserError

NAME = "virtual_shutter_job.json"
_VERSION = 1  # of the file format
_NOTE = "virtual_shutter edit "  # prefix of the key in a picture's metadata


@dataclass(frozen=True)
class Footage:
    """A movie, a picture or an image sequence that the edit reads.

    Attributes:
        name: Of the first file.
        files: How many.
        content: A hexadecimal digest of the files.
        missing: Name of the first missing or unreadable file, or "".
    """

    name: str
    files: int
    content: str
    missing: str = ""


@dataclass(frozen=True)
class EditVersion:
    """Everything that an edit's pictures depend on, except for the device.

    Attributes:
        blend: SHA-256 of the .blend file, hexadecimal.
        extension, blender: Versions.
        colours: Of the OpenColorIO configuration: its SHA-256, the name of a built-in one, or "" for Blender's own.
        footage: In the order in the .blend file.
    """

    blend: str
    extension: str
    blender: str
    colours: str
    footage: tuple[Footage, ...]

    @property
    def key(self) -> str:
        """16 hexadecimal digits that are equal for copies of the edit, regardless of paths."""
        footage = [(each.files, each.content) for each in self.footage]
        parts = self.blend, self.extension, self.blender, self.colours, footage
        return hashlib.sha256(json.dumps(parts).encode()).hexdigest()[:16]

    def difference(self, other: EditVersion) -> str | None:
        """Return the first difference from another version, as the end of a sentence about that; None: none."""
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


def _configuration(version: EditVersion) -> str:
    which = version.colours[:16] or "of Blender"
    return f"the OpenColorIO configuration {which}"


def note(key: str) -> str:
    """Return the text for a picture's metadata."""
    return _NOTE + key


def key_in(text: str) -> str | None:
    """Return the key in a picture's metadata, or None."""
    match = re.fullmatch(re.escape(_NOTE) + "([0-9a-f]{16})", text)
    return match and match[1]


class JobError(UserError, ValueError):
    """The job file is damaged, or of another version. The message is one sentence."""


def write(folder: Path, version: EditVersion) -> None:
    """Write the job file into the pictures' folder, whole or not at all. OSError: it cannot be written."""
    data = {"version": _VERSION, "edit": {**asdict(version), "key": version.key}}
    with atomic_write.writing(folder / NAME) as part:
        part.write_text(json.dumps(data, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def read(folder: Path) -> EditVersion | None:
    """Return the version of the job in a folder, or None without a job.

    Raises:
        JobError: The file is damaged, or of a newer version.
        OSError: It cannot be read.
    """
    path = folder / NAME
    try:
        data = json.loads(path.read_bytes())
        if data["version"] != _VERSION:
            raise JobError(f"{path}: is of a newer version of the extension")
        edit = data["edit"]
        texts = {name: str(edit[name]) for name in ("blend", "extension", "blender", "colours")}
        return EditVersion(footage=tuple(Footage(**each) for each in edit["footage"]), **texts)
    except FileNotFoundError:
        return None
    except JobError:
        raise
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        raise JobError(f"{path}: is damaged; check the edit again") from None


def guard(folder: Path, here: EditVersion) -> None:
    """Raise JobError if a folder's job is of another version than `here`. OSError: the job file cannot be read."""
    job = read(folder)
    if job is not None and (difference := here.difference(job)):
        raise JobError(f"{folder / NAME}: the job {difference}")
