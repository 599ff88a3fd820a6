"""Strips of the scene that are mattes: found by an identity, so that they may be renamed and cut."""

from __future__ import annotations

import uuid

from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import PropertyGroup, Strip

from ...core.messages import EffectError
from . import strips, validation


def strip_name(region: PropertyGroup) -> str:
    """The name of the first strip that is a region's matte; "": there is none."""
    return next((strip.name for strip in _with_identity(region)), "")


def choose_strip(region: PropertyGroup, name: str) -> None:
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


def _is_part(other: Strip, strip: Strip) -> bool:
    """Whether a strip and another one that has its identity were cut from one."""
    return strips.origin(other) == strips.origin(strip) and not _overlap(_content(other), _content(strip))


def strips_of(region: PropertyGroup) -> list:
    """The movie, image and clip strips that have the identity of a region's matte: several, where it was cut or copied.
    EffectError: there is none."""
    matching = _with_identity(region)
    if not matching:
        words = rpt_("{place}: its matte strip was deleted") if region.strip else rpt_("{place}: it has no matte strip")
        raise EffectError(words.format(place=validation.place(region)))
    shown = [strip for strip in matching if strip.type in strips.SOURCES]
    if not shown:
        sentence = rpt_('{place}: its matte strip "{strip}" is not a movie, image or clip strip')
        raise EffectError(sentence.format(place=validation.place(region), strip=matching[0].name))
    return shown


def parts_for(region: PropertyGroup, effect_strip: Strip) -> list:
    """The parts of the strip that is a region's matte, where an effect strip shows it: of copies, the nearest in time.
    EffectError: there is none."""
    copies: list[list] = []
    for strip in sorted(strips_of(region), key=lambda strip: (strips.origin(strip), strip.left_handle)):
        fitting = [parts for parts in copies if not any(_overlap(_content(strip), _content(part)) for part in parts)]
        # Parts that were moved apart have other origins.
        same = [parts for parts in fitting if strips.origin(parts[-1]) == strips.origin(strip)]
        if fitting:
            (same or fitting)[-1].append(strip)
        else:
            copies.append([strip])
    shown = effect_strip.left_handle, effect_strip.right_handle
    nearest = min(copies, key=lambda parts: min(_apart(shown, (part.left_handle, part.right_handle)) for part in parts))
    return sorted(nearest, key=lambda part: part.left_handle)


def _content(strip: Strip) -> tuple[float, float]:
    """What a strip shows of its content, from frame to frame."""
    return strip.left_handle - strips.origin(strip), strip.right_handle - strips.origin(strip)


def _overlap(one: tuple[float, float], other: tuple[float, float]) -> bool:
    return min(one[1], other[1]) > max(one[0], other[0])


def _apart(one: tuple[float, float], other: tuple[float, float]) -> tuple[float, float]:
    """How far apart two spans lie, and where they meet, how far their starts."""
    return max(other[0] - one[1], one[0] - other[1], 0), abs(other[0] - one[0])


def part_at(parts: list, frame: float) -> Strip:
    """Of the parts of a strip that was cut the one that shows a timeline frame, or the nearest."""
    return min(parts, key=lambda part: max(part.left_handle - frame, frame - part.right_handle + 1, 0))


def _with_identity(region: PropertyGroup) -> list:
    editor = region.id_data.sequence_editor
    strips_all = editor.strips_all if editor and region.strip else ()
    return [strip for strip in strips_all if strip.virtual_shutter_matte == region.strip]
