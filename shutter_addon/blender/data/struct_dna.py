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
    """This Blender's layout of a record (C struct) differs from the expected one, or cannot be read."""


@cache
def record(name: str, *fields: tuple[str, str]) -> np.dtype:
    """Return the NumPy type of a record (C struct) in Blender's memory, limited to some of its fields, for `read`.

    Args:
        name: The struct's name in Blender's source.
        fields: For each field its declaration in Blender and its NumPy format, such as ("char name[64]", "S64"). A
            linked list consists of two addresses, of its first and its last item.

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
    """Return the fields of a record at an address in Blender's memory, in the order in which `record` was given them.

    Args:
        kind: The record's type, from `record`.
        address: The record's address.

    Returns:
        A number, bytes, or for an array a list, for each field.
    """
    fields = np.frombuffer(ctypes.string_at(address, kind.itemsize), kind)[0]
    return tuple(fields[name].tolist() for name in kind.names or ())


@cache
def described() -> dict[str, tuple[int, dict[str, int]]]:
    """Return the layout of all records (C structs) in Blender's memory, by name.

    Returns:
        For each record, its size in bytes, and the offset in bytes of each field by its declaration, such as "char
        name[64]". Empty if the layout cannot be read. Either answer is cached, because masks are read at every frame.
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
    """Read one list of words (names or types) from the description of records.

    Args:
        data: The description.
        at: Offset of the list: a mark of four bytes such as "NAME", then the number of words, then the words.

    Returns:
        The words, and the offset of what follows the list.
    """
    (count,) = struct.unpack_from("<i", data, at + 4)
    words = bytes(data[at + 8 :]).split(b"\0", count)[:count]
    end = at + 8 + sum(map(len, words)) + count
    return [word.decode() for word in words], -(-end // 4) * 4


def _length(name: str, size: int) -> int:
    """Return how many bytes a field takes: the size of its type, or of a pointer, times its array dimensions.

    Args:
        name: Name as declared, such as "*next" (a pointer) or "co[3]" (an array).
        size: Size of the field's type in bytes.
    """
    one = _POINTER if name.startswith(("*", "(*")) else size
    return one * math.prod(map(int, re.findall(r"\[(\d+)\]", name)))
