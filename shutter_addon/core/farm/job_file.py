"""The file beside a job's pictures that says what they are of: no machine renders another version among them."""

import json
import stat
from pathlib import Path

from .. import atomic_write
from ..messages import UserError
from .edit_version import EditVersion

NAME = "virtual_shutter_job.json"
_VERSION = 1  # of the file's format
_LARGEST = 1 << 26  # bytes


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
