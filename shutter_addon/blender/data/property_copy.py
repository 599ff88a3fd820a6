"""Property groups as they are stored, enum numbers without an item included; and values that they have for a while."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any

from bpy.types import PropertyGroup, bpy_struct


def copy_properties(old: PropertyGroup, new: PropertyGroup) -> None:
    """Copies a property group with all that is in it; IDs stay shared."""
    for prop in old.bl_rna.properties:
        name = prop.identifier
        if prop.type == "COLLECTION":
            getattr(new, name).clear()
            for item in getattr(old, name):
                copy_properties(item, getattr(new, name).add())
        elif is_group(old, name):
            copy_properties(getattr(old, name), getattr(new, name))
        elif not (prop.is_readonly or prop.is_skip_save):  # what is not saved only shows another one
            store(new, name, stored(old, name))
    _copy_unknown(old, new)


def _copy_unknown(old: PropertyGroup, new: PropertyGroup) -> None:
    """Copies what a newer version has stored in a property group, of which Blender knows the values alone."""
    there = old.bl_system_properties_get() or {}
    for name in set(there.keys()).difference(old.bl_rna.properties.keys()):
        new.bl_system_properties_get(do_create=True)[name] = there[name]


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
