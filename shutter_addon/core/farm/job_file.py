"""The version of an edit, and a job file beside rendered pictures that names it.

The version also marks each picture. So machines that render into one folder notice if their edits differ.
"""

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
    """What tells versions of an edit apart: everything that its pictures depend on, except for the device.

    Attributes:
        extension: The version of this extension.
        blender: The version of Blender.
        colours: The OpenColorIO configuration: the name of one that is built into OpenColorIO, the SHA-256 of another
            one's file, or "" for the one that comes with Blender.
        blend: SHA-256 of the .blend file, hexadecimal.
        footage: One SHA-256, hexadecimal, for all other files that pictures are made from. Of a large file, only the
            size and some blocks count.
    """

    extension: str
    blender: str
    colours: str
    blend: str
    footage: str

    @property
    def key(self) -> str:
        """16 hexadecimal digits that stand for the version, equal for copies of the edit wherever these lie."""
        return hashlib.sha256(json.dumps(astuple(self)).encode()).hexdigest()[:16]


def note(key: str) -> str:
    """Return the text that marks a picture, in its metadata, with the key of an edit's version."""
    return _NOTE + key


def key_in(text: str) -> str | None:
    """Find the key of an edit's version in a text of a picture's metadata that `note` made. None: it has no key."""
    match = re.fullmatch(re.escape(_NOTE) + "([0-9a-f]{16})", text)
    return match and match[1]


class JobError(UserError, ValueError):
    """The job file in a folder is damaged, or names another version of the edit. The message is one sentence."""


def write(folder: Path, version: EditVersion) -> None:
    """Write the job file that names an edit's version into the folder of the rendered pictures, whole or not at all.

    A job file that is there already is replaced.

    Raises:
        OSError: It cannot be written.
    """
    with atomic_write.writing(folder / NAME) as part:
        part.write_text(json.dumps({"version": 1, "edit": asdict(version)}, indent=1) + "\n", encoding="utf-8")


def guard(folder: Path, here: EditVersion) -> None:
    """Check that a folder's job file names the version of the edit that this machine has.

    So machines that render into one folder cannot mix pictures of different edits. A folder without a job file passes.

    Args:
        folder: The folder of the rendered pictures.
        here: The version of the edit on this machine.

    Raises:
        JobError: The job file names another version, or is damaged.
        OSError: The job file exists, but cannot be read.
    """
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
