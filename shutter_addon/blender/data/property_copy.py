"""Copy property groups as Blender stores them, read structs as plain data, and set attributes for a while."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any

from bpy.types import PropertyGroup, bpy_struct

# Types that effects point to, and their collections in bpy.data.
POINTED = {"MovieClip": "movieclips", "Image": "images", "Mask": "masks"}


def copy_properties(old: PropertyGroup, new: PropertyGroup) -> None:
    """Copy all stored values of a property group to another, including properties that only newer versions define.

    The copy's pointers refer to the same data-blocks. No update callback runs.
    """
    there, copied = old.bl_system_properties_get(do_create=True), new.bl_system_properties_get(do_create=True)
    for name, value in there.items():
        copied[name] = value


def plain(struct: bpy_struct) -> dict[str, Any]:
    """Return all properties of a Blender struct, nested ones too, as plain data. Pointers become session_uids."""
    found: dict[str, Any] = {}
    for prop in struct.bl_rna.properties:
        name, value = prop.identifier, getattr(struct, prop.identifier)
        if prop.type == "COLLECTION":
            found[name] = [plain(item) for item in value]
        elif name != "rna_type" and isinstance(value, PropertyGroup):
            found[name] = plain(value)
        elif prop.type == "POINTER":
            if value is not None and prop.fixed_type.identifier in POINTED:
                found[name] = value.session_uid
        elif name == "co_ui" or prop.is_skip_save:
            continue  # setting co_ui moves a key's handles
        elif (prop.type, value) != ("ENUM", ""):  # a number without an item
            found[name] = tuple(value) if getattr(prop, "is_array", False) else value
    return found


@contextmanager
def for_a_while(changes: Iterable[tuple[object, str, object]]) -> Iterator[None]:
    """Set attributes within a `with` block, and restore their old values at its end, even after an exception.

    Args:
        changes: For each attribute (object, attribute name, value within the block).
    """
    changes = list(changes)
    before = [(owner, name, getattr(owner, name)) for owner, name, _ in changes]
    try:
        for change in changes:
            setattr(*change)
        yield
    finally:
        for change in before:
            setattr(*change)
