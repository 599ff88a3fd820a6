"""What Blender deprecates of strips, and will remove, is used nowhere."""

import re
import warnings
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FOLDERS = ("shutter_addon", "scripts", "gallery", "tests", "docs", ".")
SUFFIXES = {".py", ".md", ""}
# Scenes, clips and masks have properties of the same names, which stay.
OTHERS = {"scene", "effect_scene", "edit", "edit()", "film", "clip", "mask"}


def deprecated(bpy):
    """Names of strips' deprecated properties; and those of them that other types have as well."""
    strips, others = set(), set()
    for name in dir(bpy.types):
        rna = getattr(getattr(bpy.types, name), "bl_rna", None)
        for prop in rna.properties if rna else ():
            (strips if prop.is_deprecated and name.endswith("Strip") else others).add(prop.identifier)
    return strips, strips & others


def files():
    found = (path for folder in FOLDERS for path in (ROOT / folder).glob("*" if folder == "." else "**/*"))
    return [path for path in found if path.is_file() and path.suffix in SUFFIXES and ".venv" not in path.parts]


def uses(path, alone, shared):
    """Where a file uses a name which strips alone have, or one that others share, of a strip."""
    text = path.read_text(encoding="utf-8", errors="replace")
    if alone:
        yield from re.findall(rf"\b(?:{'|'.join(alone)})\b", text)
    if path.suffix == ".py":
        yield from (
            use for use in re.findall(rf"((?:\w+(?:\(\))?)?)\.({'|'.join(shared)})\b", text) if use[0] not in OTHERS
        )


def test_nothing_deprecated_of_strips(bpy):
    strips, shared = deprecated(bpy)
    assert len(strips) >= 9
    assert shared
    assert len(files()) > 100
    assert not {path: found for path in files() if (found := list(uses(path, strips - shared, shared)))}


def test_what_is_deprecated_fails(edit):
    """Of Blender and of Python."""
    strip = edit.sequence_editor.strips.new_effect("strip", "COLOR", 1, 1, length=9)
    name = next(prop.identifier for prop in strip.bl_rna.properties if prop.is_deprecated)
    with pytest.raises(SystemError):  # Blender gives the value beside the exception, which Python takes for a fault
        getattr(strip, name)
    with pytest.raises(PendingDeprecationWarning):
        warnings.warn("soon", PendingDeprecationWarning, stacklevel=1)
