"""Check that values of an effect in a .blend file are in range, and tell the user where one is not.

Blender keeps properties in range where users and F-curves set them. Scripts and files of other versions get past that,
and NaN gets past every range.
"""

import math
import re
from collections.abc import Sequence
from typing import Any

import numpy as np
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_n as n_
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import Property, PropertyGroup

from ...core.messages import EffectError
from ...core.model import limits

_PLACES = {
    "": n_('effect "{name}"'),
    "shutters": n_('shutter "{name}"'),
    "regions": n_('region "{name}"'),
    "camera": n_('camera of effect "{name}"'),
}


def place(group: PropertyGroup) -> str:
    """Return what the user calls an effect, shutter, bar, region or camera, such as 'shutter "Sharp", bar 3'."""
    path = group.path_from_id()
    match = re.match(r".*?effects\[\d+\](?:\.(shutters|regions)\[\d+\])?", path)
    assert match  # the group is an effect, or lies in one
    kind = "camera" if path.endswith(".camera") else match[1] or ""
    words = rpt_(_PLACES[kind]).format(name=group.id_data.path_resolve(match[0]).name)
    bar = re.search(r"\.bars\[(\d+)\]$", path)
    return rpt_("{shutter}, bar {number}").format(shutter=words, number=int(bar[1]) + 1) if bar else words


def number(group: PropertyGroup, name: str, value: float | None = None) -> Any:
    """Return the number of a property after checking that it lies in the property's range.

    Args:
        group: The property group that has the property.
        name: The property's name.
        value: Number to check and return in place of the one that is stored; None: the stored one.

    Raises:
        EffectError: The number is out of the property's range, or NaN.
    """
    value, prop = getattr(group, name) if value is None else value, group.bl_rna.properties[name]
    if prop.hard_min <= value <= prop.hard_max:  # false for NaN
        return value
    show = math.degrees if prop.subtype == "ANGLE" else float
    low, high = (f"{show(limit):.7g}" for limit in (prop.hard_min, prop.hard_max))
    sentence = rpt_("{place}: {property} is {value}, not {low} to {high}")
    raise EffectError(
        sentence.format(place=place(group), property=_called(prop), value=f"{show(value):.7g}", low=low, high=high)
    )


def check(items: Sequence[PropertyGroup], name: str, numbers: np.ndarray) -> None:
    """Check that numbers for one property of the items of a collection lie in the property's range.

    Args:
        name: The property's name.
        numbers: (n,): a number for each item.

    Raises:
        EffectError: A number is out of the property's range, or NaN.
    """
    for item, value in zip(items, numbers.tolist(), strict=True):
        number(item, name, value)


def check_moving(moving: PropertyGroup) -> None:
    """Check that all stored float properties of a region or the camera are in range, and that a region's kind is valid.

    Raises:
        EffectError: A number is out of range, or the kind is none of its choices.
    """
    for prop in moving.bl_rna.properties:
        if prop.identifier == "kind":
            word(moving, "kind")
        for value in np.atleast_1d(getattr(moving, prop.identifier)) if prop.type == "FLOAT" else ():
            number(moving, prop.identifier, float(value))


def word(group: PropertyGroup, name: str, value: float | None = None) -> Any:
    """Return the identifier of the item that an enum property has, after checking that there is such an item.

    Args:
        group: The property group that has the property.
        name: The property's name.
        value: Number of an item, as an F-curve gives it, used in place of the stored item; None: the stored item.

    Raises:
        EffectError: There is no such item.
    """
    prop = group.bl_rna.properties[name]
    if value is None:
        identifier = getattr(group, name)
    else:
        wanted = round(value) if math.isfinite(value) else None
        identifier = next((item.identifier for item in prop.enum_items if item.value == wanted), "")
    if not identifier:
        sentence = rpt_("{place}: {property} is none of its choices")
        raise EffectError(sentence.format(place=place(group), property=_called(prop)))
    return identifier


def _called(prop: Property) -> str:
    return iface_(prop.name, prop.translation_context)


def why_full(effect: PropertyGroup, *, regions: int = 0, shutters: int = 0) -> str | None:
    """Return why an effect has no room for this many additional regions and shutters; None: it has room."""
    if len(effect.regions) + regions > limits.MAX_REGIONS:
        return rpt_("An effect can have at most {most} regions").format(most=limits.MAX_REGIONS)
    if len(effect.shutters) + shutters > limits.MAX_SHUTTERS:
        return rpt_("An effect can have at most {most} shutters").format(most=limits.MAX_SHUTTERS)
    return None
