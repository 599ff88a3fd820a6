"""Folders in which a stranger may have put anything: no link is followed, and nothing but plain files is opened."""

from __future__ import annotations

import errno
import hashlib
import os
import stat
from collections.abc import Callable
from contextlib import suppress
from io import BufferedReader
from pathlib import Path
from typing import Any, Self

_OPENS = os.open in os.supports_dir_fd and os.scandir in os.supports_fd
_PLAIN = sum(getattr(os, name, 0) for name in ("O_NOFOLLOW", "O_NONBLOCK", "O_NOCTTY", "O_BINARY"))
_JUNCTION = 0xA0000003  # st_reparse_tag of a folder on Windows that leads to another


class Folder:
    """A folder itself, open: what is done in it by name is done there, whatever becomes of its path meanwhile.

    Windows opens no folders: what a name stands for is looked at just before. Everything here may raise OSError."""

    def __init__(self, path: str | Path, within: Folder | None = None) -> None:
        """path: a name where it lies within another folder. OSError: there is none, or it is a link."""
        self.path: Path = within.path / path if within else Path(path)
        place = within._at(path) if within else {"path": path}
        self._descriptor: int | None = None
        _check(os.stat(**place, follow_symlinks=False), stat.S_ISDIR, errno.ENOTDIR)
        if _OPENS:
            self._descriptor = os.open(**place, flags=os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)

    def folder(self, name: str) -> Folder:
        """A folder in this one."""
        return Folder(name, self)

    def make(self, name: str) -> Folder:
        """A folder in this one, new if there is none."""
        with suppress(FileExistsError):
            os.mkdir(**self._at(name))
        return self.folder(name)

    def entries(self) -> list[os.DirEntry]:
        """All that lies here."""
        with os.scandir(self.path if self._descriptor is None else self._descriptor) as entries:
            return list(entries)

    def files(self) -> list[os.DirEntry]:
        """The plain files that lie here."""
        return [entry for entry in self.entries() if entry.is_file(follow_symlinks=False)]

    def status(self, name: str) -> os.stat_result:
        """That of the name itself, if it is a link."""
        return os.stat(**self._at(name), follow_symlinks=False)

    def open(self, name: str, most: int) -> BufferedReader:
        """A plain file of at most so many bytes, to be read."""
        _check(self.status(name), stat.S_ISREG, errno.EINVAL)
        file = os.fdopen(os.open(**self._at(name), flags=os.O_RDONLY | _PLAIN), "rb")
        status = os.fstat(file.fileno())
        if not stat.S_ISREG(status.st_mode) or status.st_size > most:
            file.close()
            raise _error(errno.EFBIG)
        return file

    def read(self, name: str, most: int) -> bytes:
        """What is in a plain file of at most so many bytes."""
        with self.open(name, most) as file:
            return file.read(most)

    def digest(self, name: str, most: int) -> str:
        """The SHA-256 of a plain file of at most so many bytes, in hexadecimal digits."""
        with self.open(name, most) as file:
            return hashlib.file_digest(file, "sha256").hexdigest()

    def append(self, name: str, data: bytes) -> None:
        """Writes at the end of a plain file that has no other name; it is made if there is none."""
        flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT | _PLAIN
        with os.fdopen(os.open(**self._at(name), flags=flags, mode=0o666), "ab") as file:
            status = os.fstat(file.fileno())
            if not stat.S_ISREG(status.st_mode) or status.st_nlink != 1:
                raise _error(errno.EEXIST)
            file.write(data)

    def remove(self, name: str) -> int:
        """Removes a plain file, by this name. Gives its bytes."""
        status = self.status(name)
        _check(status, stat.S_ISREG, errno.EINVAL)
        os.unlink(**self._at(name))
        return status.st_size

    def remove_folder(self, name: str) -> None:
        """Removes an empty folder."""
        os.rmdir(**self._at(name))

    def remove_part(self, name: str, is_ours: Callable[[str], object]) -> None:
        """Removes a folder in this one, with the plain files in it whose names are of ours."""
        with self.folder(name) as part:
            for entry in part.files():
                if is_ours(entry.name):
                    part.remove(entry.name)
        self.remove_folder(name)

    def close(self) -> None:
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None

    def _at(self, name: str | Path) -> dict[str, Any]:
        if self._descriptor is None:
            return {"path": self.path / name}
        return {"path": name, "dir_fd": self._descriptor}

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


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
