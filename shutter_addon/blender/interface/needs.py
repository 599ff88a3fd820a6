"""Conditions for operators: functions that return why an effect does not fit, in the user's language, or None."""

from collections.abc import Collection

from bpy.app.translations import pgettext_n as n_
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import PropertyGroup

from ...core.model.choices import DRAWN
from ..data import selection, strips, validation
from .operator_bases import Need


def a_shutter(effect: PropertyGroup) -> str | None:
    return None if selection.active_shutter(effect) is not None else rpt_("The effect has no shutter: add one")


def a_region(effect: PropertyGroup) -> str | None:
    return None if selection.active_region(effect) is not None else rpt_("The shutter has no region: draw one")


def _of_kind(kinds: Collection[str], sentence: str) -> Need:
    """Make a condition for operators: there is an active region, and it is of one of these kinds.

    Args:
        kinds: Items of choices.KINDS.
        sentence: Why a region of another kind does not fit, in English.

    Returns:
        A function that takes an effect and returns why it does not meet the condition, translated; None: it does.
    """

    def need(effect: PropertyGroup) -> str | None:
        if without := a_region(effect):
            return without
        return None if selection.active_region(effect).kind in kinds else rpt_(sentence)

    return need


strokes = _of_kind([word for word, *_ in DRAWN], n_("The region is a matte or a ramp without strokes"))
an_outline = _of_kind(strips.OUTLINED, n_("The region is not an outline or subject"))
a_subject = _of_kind({"SUBJECT"}, n_("The region is not a subject"))
a_cover = _of_kind(strips.LAID, n_("The region is not a matte, ramp, outline or subject"))


def room_for_a_region(effect: PropertyGroup) -> str | None:
    return a_shutter(effect) or validation.why_full(effect, regions=1)


def room_for_a_shutter(effect: PropertyGroup) -> str | None:
    return validation.why_full(effect, shutters=1)
