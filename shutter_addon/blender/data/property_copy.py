"""Property groups as they are stored, enum numbers without an item included; and values that they have for a while."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any

from bpy.types import PropertyGroup, bpy_struct


def copy_properties(old: PropertyGroup, new: PropertyGroup) -> None:
    """Gives a new property group all that is stored in another one, also what a newer version has stored there; IDs
    stay shared. It calls no update functions: what depends on each other is copied as it is."""
    there, copied = old.bl_system_properties_get(do_create=True), new.bl_system_properties_get(do_create=True)
    for name, value in there.items():
        copied[name] = value


def is_group(struct: bpy_struct, name: str) -> bool:
    """Whether a property is a property group within a struct."""
    return name != "rna_type" and isinstance(getattr(struct, name), PropertyGroup)


def stored(group: bpy_struct, name: str) -> Any:
    """A property's value for a copy of the group; of an enum that has none of its items, the number it is kept as."""
    value = getattr(group, name)
    if value == "" and group.bl_rna.properties[name].type == "ENUM" and isinstance(group, PropertyGroup):
        return group.bl_system_properties_get()[name]
    return value


def store(group: bpy_struct, name: str, value: object) -> None:
    """Gives a property what `stored` gave."""
    if isinstance(value, int) and group.bl_rna.properties[name].type == "ENUM":
        group.bl_system_properties_get(do_create=True)[name] = value
    else:
        setattr(group, name, value)


@contextmanager
def for_a_while(changes: Iterable[tuple[object, str, object]]) -> Iterator[None]:
    """Inside, attributes have other values. changes: owner, name and value of each."""
    changes = list(changes)
    before = [(owner, name, getattr(owner, name)) for owner, name, _ in changes]
    try:
        for change in changes:
            setattr(*change)
        yield
    finally:
        for change in before:
            setattr(*change)
