"""Where fields lie in records (C structs) of Blender's memory, found at run time, to read what Python's API lacks.

Every .blend file ends with a description of all records (SDNA). Blender writes its own, and its compiler has checked
the offsets and sizes (dna_verify.cc). An empty file is written once and parsed.
"""

import ctypes
import math
import re
import struct
import tempfile
from functools import cache
from itertools import accumulate
from pathlib import Path

import bpy
import numpy as np

_POINTER = 8  # bytes


class LayoutError(Exception):
    """This Blender lays a record out differently, or its layout cannot be read."""


@cache
def record(name: str, *fields: tuple[str, str]) -> np.dtype:
    """Return the NumPy type of a record (C struct) in Blender's memory, limited to some of its fields.

    Args:
        name: The struct's name in Blender's source.
        fields: Each as Blender declares it, and as NumPy reads it: ("char name[64]", "S64"). A linked list has two
            addresses, of its first and its last item.

    Raises:
        LayoutError: This Blender has no such record or field.
    """
    size, places = described().get(name, (0, {}))
    declared = [words for words, _format in fields]
    if not places.keys() >= set(declared):
        raise LayoutError(name)
    offsets, formats = [places[words] for words in declared], [kind for _words, kind in fields]
    return np.dtype({"names": declared, "formats": formats, "offsets": offsets, "itemsize": size})


def read(kind: np.dtype, address: int) -> tuple:
    """Return the fields of a record at an address in Blender's memory: numbers, bytes and lists.

    Args:
        kind: The record's type, from `record`.
    """
    fields = np.frombuffer(ctypes.string_at(address, kind.itemsize), kind)[0]
    return tuple(fields[name].tolist() for name in kind.names or ())


@cache
def described() -> dict[str, tuple[int, dict[str, int]]]:
    """Return the layout of all records in Blender's memory, by their name.

    Returns:
        The record's size in bytes, and the offset in bytes of each field, by its declaration. Empty if the layout
        cannot be read. Either answer is kept, because masks are read at every frame.
    """
    try:
        with tempfile.TemporaryDirectory(prefix="virtual_shutter_dna_", ignore_cleanup_errors=True) as folder:
            file = Path(folder, "dna.blend")
            bpy.data.libraries.write(str(file), set(), compress=False)
            return parsed(file.read_bytes())
    except (OSError, RuntimeError, ValueError, IndexError, struct.error):
        return {}


def parsed(blend: bytes) -> dict[str, tuple[int, dict[str, int]]]:
    """Parse the description of records at the end of an uncompressed .blend file. Return them as `described` does.

    Raises:
        ValueError, IndexError, struct.error: There is none.
    """
    data = memoryview(blend)[blend.rindex(b"SDNANAME") + 4 :]
    names, at = _words(data, 0)
    kinds, at = _words(data, at)
    sizes = struct.unpack_from(f"<{len(kinds)}H", data, at + 4)
    at += 4 + -(-len(kinds) // 2) * 4
    (count,) = struct.unpack_from("<i", data, at + 4)
    at += 8
    records = {}
    for _ in range(count):
        own, number = struct.unpack_from("<2H", data, at)
        fields = list(struct.iter_unpack("<2H", data[at + 4 : at + 4 + 4 * number]))
        at += 4 + 4 * number
        lengths = [_length(names[name], sizes[kind]) for kind, name in fields]
        declared = [f"{kinds[kind]} {names[name]}" for kind, name in fields]
        records[kinds[own]] = sizes[own], dict(zip(declared, accumulate(lengths, initial=0), strict=False))
        if sum(lengths) != sizes[own]:
            raise ValueError(kinds[own])
    return records


def _words(data: memoryview, at: int) -> tuple[list[str], int]:
    """Return a list of words from the description, and the offset of the part behind it.

    Args:
        at: Offset of the list's mark of four bytes, which its number of words follows.
    """
    (count,) = struct.unpack_from("<i", data, at + 4)
    words = bytes(data[at + 8 :]).split(b"\0", count)[:count]
    end = at + 8 + sum(map(len, words)) + count
    return [word.decode() for word in words], -(-end // 4) * 4


def _length(name: str, size: int) -> int:
    """Return the bytes that a field takes: its type's size, or a pointer's, times its dimensions.

    Args:
        name: As declared, such as "*next" or "co[3]".
        size: Bytes of the field's type.
    """
    one = _POINTER if name.startswith(("*", "(*")) else size
    return one * math.prod(map(int, re.findall(r"\[(\d+)\]", name)))
