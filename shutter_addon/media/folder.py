"""Folders of ours in whose place a stranger may have put a link: none is followed."""

from __future__ import annotations

import errno
import stat
from pathlib import Path

_JUNCTION = 0xA0000003  # st_reparse_tag of a folder on Windows that leads to another


def own_folder(path: Path) -> None:
    """Make a folder of ours, if there is none. The one that it lies in may be a link to another disk.

    Raises:
        OSError: It cannot be made, or it is a link itself.
    """
    path.mkdir(parents=True, exist_ok=True)
    refuse_link(path)


def refuse_link(path: Path) -> None:
    """Raise OSError for a link, and where there is nothing."""
    status = path.lstat()
    if stat.S_ISLNK(status.st_mode) or getattr(status, "st_reparse_tag", 0) == _JUNCTION:
        raise OSError(errno.ELOOP, "it is a link, and none is followed")
