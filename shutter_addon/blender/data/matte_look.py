"""What a panel shows of a matte: its size and length, and what is wrong with it."""

from __future__ import annotations

from contextlib import closing
from functools import lru_cache
from typing import NamedTuple

from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import PropertyGroup, Scene, Strip

from ...core import revision
from ...core.messages import UserError, translated
from ...core.model import keyframes
from ...core.model.mattes import FileFrames
from ...media.opening import MatteFile
from . import matte_content, snapshot


class Look(NamedTuple):
    """What a panel says of a matte: sentences, or "".

    Attributes:
        text: Size and length.
        fault: Why it cannot be shown.
        note: That its last frame holds.
    """

    text: str = ""
    fault: str = ""
    note: str = ""


def look(scene: Scene, effect: PropertyGroup, strip: Strip, region: PropertyGroup) -> Look:
    """Return what to say of a region that is a matte, kept until something changes."""
    index = list(effect.regions).index(region)
    key = effect.scene.session_uid, index, strip.name
    return revision.until_change("matte", key, lambda: _look(scene, effect, strip, index))


def _look(scene: Scene, effect: PropertyGroup, strip: Strip, index: int) -> Look:
    frame, region = strip.left_handle, effect.regions[index]
    try:
        with translated(rpt_):
            content = snapshot.region_at(scene, effect, strip, index, (frame,)).content
            shown = content.at(frame)
    except UserError as error:
        return Look(fault=str(error))
    file = getattr(shown, "file", None)
    if file is None:
        return Look()
    size = _size(file)
    if isinstance(size, str):
        return Look(fault=size)
    width, height, count = size
    text = iface_("{width} × {height}, {count} frames").format(width=width, height=height, count=count)
    if count == 1:
        text = iface_("{width} × {height}, one picture").format(width=width, height=height)
    return Look(text, note=_note(scene, effect, strip, region, content, count))


def _note(
    scene: Scene, effect: PropertyGroup, strip: Strip, region: PropertyGroup, content: keyframes.Channel, count: int
) -> str:
    """Return a sentence if a matte is shorter than the film."""
    if region.matte == "STRIP":
        ends = max(part.right_handle for part in matte_content.parts_for(region, strip))
        return iface_("Ends before the film: its last frame holds") if ends < strip.right_handle else ""
    if not isinstance(content, FileFrames) or count == 1:
        return ""
    if content.first is not None:
        last = strip.right_handle - 1 - content.first
    else:
        try:
            last = snapshot.last_shown(scene, effect, strip)
        except UserError:  # the live preview shows it
            return ""
    if content.offset + last < count:
        return ""
    return iface_("Shorter than the film: its last frame holds")


@lru_cache(64)
def _size(file: MatteFile) -> tuple[int, int, int] | str:
    """Return width, height and number of frames, or why the file cannot be read."""
    try:
        with closing(file.open()) as source:
            return source.width, source.height, source.count
    except UserError as error:
        return str(error)
