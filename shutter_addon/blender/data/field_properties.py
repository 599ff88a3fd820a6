"""Blender's properties of what the model's fields define (core/model/fields.py)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    StringProperty,
)

from ...core.model.choices import UNKEYED
from ...core.model.fields import Field, fields_of
from .consistency import changed

KEYED = {"ANIMATABLE"}  # as properties are where nothing else is said


def with_fields(*kinds: type, **more: dict) -> Callable[[type], type]:
    """A decorator: adds to a class, behind its own properties, those of the fields of the model's classes.

    more: for a property of that name in Blender, what is said of it beside its field, such as its `update`"""

    def added(group: type) -> type:
        for field in fields_of(*kinds).values():
            group.__annotations__[field.blender] = _property(field, **more.get(field.blender, {}))
        return group

    return added


def _property(field: Field, **more: Any) -> object:
    """A field as Blender's property: of what pictures are made by, unless it is a text, which is a name."""
    kind, default = type(field.default), field.default
    said: dict = {"name": field.label, "description": field.description, "translation_context": field.context}
    if kind is str and not field.choices:
        return StringProperty(**said, default=default, **more)
    said |= {"update": changed, "options": KEYED if field.keyed else UNKEYED} | more
    if field.choices:
        return EnumProperty(**said, items=field.choices, default=str(default).upper())
    said["default"] = default
    if kind is bool:
        return BoolProperty(**said)
    if kind is tuple:
        return FloatVectorProperty(**said, size=len(default), min=field.least, max=field.most, subtype=field.subtype)
    most = kind(field.most)
    said |= {"min": kind(field.least), "max": most, "soft_max": kind(field.soft_most or most), "subtype": field.subtype}
    if kind is int:
        return IntProperty(**said)
    return FloatProperty(**said, precision=field.precision, step=1 if field.precision > 2 else 3)
