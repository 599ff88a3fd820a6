"""Strips of the edit that are mattes: found by an identity, so that they may be renamed and cut."""

import uuid

from bpy.app.translations import pgettext_rpt as rpt_

from . import strips, validation
from .validation import EffectError


def strip_name(region) -> str:
    """The name of the first strip that is a region's matte; "": there is none."""
    return next((strip.name for strip in _parts(region)), "")


def choose_strip(region, name: str) -> None:
    """Makes a strip a region's matte, by its name, with the other parts of it, if it was cut; no strip, where none is
    called so."""
    editor = region.id_data.sequence_editor
    strip = editor and editor.strips_all.get(name)
    if strip is None:
        region.strip = ""
        return
    known = strip.virtual_shutter_matte
    same = [other for other in editor.strips_all if known and other.virtual_shutter_matte == known]
    parts = [strip, *(other for other in same if _is_part(other, strip))]
    if len(parts) != len(same):  # it has no identity yet, or that of a strip which it is a copy of
        identity = uuid.uuid4().hex
        for part in parts:
            part.virtual_shutter_matte = identity
    region.strip = strip.virtual_shutter_matte


def _is_part(other, strip) -> bool:
    """Whether a strip and another one that has its identity were cut from one."""
    overlap = min(other.right_handle, strip.right_handle) - max(other.left_handle, strip.left_handle)
    return strips.origin(other) == strips.origin(strip) and overlap <= 0


def strips_of(region) -> list:
    """The movie, image and clip strips that are a region's matte: several, where one was cut. EffectError: there is
    none."""
    found = _parts(region)
    if not found:
        words = rpt_("{place}: its matte strip was deleted") if region.strip else rpt_("{place}: it has no matte strip")
        raise EffectError(words.format(place=validation.place(region)))
    shown = [strip for strip in found if strip.type in strips.SOURCES]
    if not shown:
        sentence = rpt_('{place}: its matte strip "{strip}" is not a movie, image or clip strip')
        raise EffectError(sentence.format(place=validation.place(region), strip=found[0].name))
    return shown


def part_at(parts: list, frame: float):
    """Of the parts of a strip that was cut the one that shows a timeline frame, or the nearest."""
    return min(parts, key=lambda part: max(part.left_handle - frame, frame - part.right_handle + 1, 0))


def _parts(region) -> list:
    editor = region.id_data.sequence_editor
    strips_all = editor.strips_all if editor and region.strip else ()
    return [strip for strip in strips_all if strip.virtual_shutter_matte == region.strip]
