"""Folders in which a stranger may have put anything: no link is followed, and nothing but plain files is opened."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Callable
from io import BufferedReader
from pathlib import Path

_PLAIN = sum(getattr(os, name, 0) for name in ("O_NOFOLLOW", "O_NONBLOCK", "O_NOCTTY", "O_BINARY"))
_JUNCTION = 0xA0000003  # st_reparse_tag of a folder on Windows that leads to another


class Folder:
    """A folder itself. What a name in it stands for is looked at just before it is used; what is opened is looked at
    again. Everything here may raise OSError."""

    def __init__(self, path: Path) -> None:
        """OSError: there is none, or it is a link."""
        self.path = path
        _check(path.lstat(), stat.S_ISDIR, errno.ENOTDIR)

    def folder(self, name: str) -> Folder:
        """A folder in this one."""
        return Folder(self.path / name)

    def entries(self) -> list[os.DirEntry]:
        """All that lies here."""
        with os.scandir(self.path) as entries:
            return list(entries)

    def files(self) -> list[os.DirEntry]:
        """The plain files that lie here."""
        return [entry for entry in self.entries() if entry.is_file(follow_symlinks=False)]

    def open(self, name: str, most: int) -> BufferedReader:
        """A plain file of at most so many bytes, to be read."""
        path = self.path / name
        _check(path.lstat(), stat.S_ISREG, errno.EINVAL)
        file = os.fdopen(os.open(path, os.O_RDONLY | _PLAIN), "rb")
        status = os.fstat(file.fileno())
        if not stat.S_ISREG(status.st_mode) or status.st_size > most:
            file.close()
            raise _error(errno.EFBIG)
        return file

    def read(self, name: str, most: int) -> bytes:
        """What is in a plain file of at most so many bytes."""
        with self.open(name, most) as file:
            return file.read(most)

    def remove(self, name: str) -> int:
        """Removes a plain file, by this name. Gives its bytes."""
        path = self.path / name
        status = path.lstat()
        _check(status, stat.S_ISREG, errno.EINVAL)
        path.unlink()
        return status.st_size

    def remove_part(self, name: str, is_ours: Callable[[str], object]) -> None:
        """Removes a folder in this one, with the plain files in it whose names are of ours."""
        part = self.folder(name)
        for entry in part.files():
            if is_ours(entry.name):
                part.remove(entry.name)
        part.path.rmdir()


def own_folder(path: Path) -> Folder:
    """A folder of ours, new if there is none. The one that it lies in may be a link to another disk. OSError: it is a
    link itself."""
    path.mkdir(parents=True, exist_ok=True)
    return Folder(path)


def _check(status: os.stat_result, is_kind: Callable[[int], bool], otherwise: int) -> None:
    if stat.S_ISLNK(status.st_mode) or getattr(status, "st_reparse_tag", 0) == _JUNCTION:
        raise OSError(errno.ELOOP, "it is a link, and none is followed")
    if not is_kind(status.st_mode):
        raise _error(otherwise)


def _error(number: int) -> OSError:
    return OSError(number, os.strerror(number))
