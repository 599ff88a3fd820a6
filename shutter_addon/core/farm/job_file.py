"""The version of an edit, which marks its pictures on any machine, and the job file beside the pictures, which keeps
machines from rendering different versions into one folder."""

import hashlib
import json
import re
from dataclasses import asdict, astuple, dataclass
from pathlib import Path

from .. import atomic_write
from ..messages import UserError

NAME = "virtual_shutter_job.json"
_NOTE = "virtual_shutter edit "  # prefix of the key in a picture's metadata
_WORDS = {
    "extension": "the extension",
    "blender": "Blender",
    "colours": "the OpenColorIO configuration",
    "blend": "the .blend file",
    "footage": "the footage",
}


@dataclass(frozen=True)
class EditVersion:
    """Everything that an edit's pictures depend on, except for the device.

    Attributes:
        extension, blender: Versions.
        colours: Of the OpenColorIO configuration: its SHA-256, the name of a built-in one, or "" for Blender's own.
        blend: SHA-256 of the .blend file, hexadecimal.
        footage: SHA-256 of what the edit reads besides, in the order in the .blend file.
    """

    extension: str
    blender: str
    colours: str
    blend: str
    footage: str

    @property
    def key(self) -> str:
        """16 hexadecimal digits that are equal for copies of the edit, regardless of paths."""
        return hashlib.sha256(json.dumps(astuple(self)).encode()).hexdigest()[:16]


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
    with atomic_write.writing(folder / NAME) as part:
        part.write_text(json.dumps({"version": 1, "edit": asdict(version)}, indent=1) + "\n", encoding="utf-8")


def guard(folder: Path, here: EditVersion) -> None:
    """Raise JobError if a folder's job is of another version than `here`. OSError: the job file cannot be read."""
    path = folder / NAME
    try:
        job = json.loads(path.read_bytes())["edit"]
        different = [name for name, text in asdict(here).items() if job[name] != text]
    except FileNotFoundError:
        return
    except (ValueError, TypeError, KeyError, RecursionError):
        raise JobError(f"{path}: is damaged; check the edit again") from None
    for name in different:
        there, own = str(job[name])[:16], str(getattr(here, name))[:16]
        raise JobError(f"{path}: the job is of another version of {_WORDS[name]} ({there}, here {own})")
