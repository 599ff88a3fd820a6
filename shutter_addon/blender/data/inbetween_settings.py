"""In-between frames of an effect: where they lie, and how they are made."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import PropertyGroup

from ...core.memo import Kept
from ...core.messages import EffectError
from ...core.model.effect import Method
from ...media import inbetween_cache
from . import validation

FOLDER = "virtual_shutter_inbetween"
METHODS: dict[str, Method] = {"QUICK": "quick", "GOOD": "good"}


class Settings(NamedTuple):
    """Where in-between frames lie, how many frames there are for each of the source, and a method of media.flow."""

    folder: Path
    factor: int
    method: Method


def folder(effect: PropertyGroup) -> Path:
    """The folder of the effect's in-between frames. EffectError: there is none, beside a file that is not saved,
    or of an extension that is not installed."""
    if validation.word(effect, "inbetween_place") == "USER":
        package = __package__.rpartition(".shutter_addon")[0]
        try:
            return Path(bpy.utils.extension_path_user(package, path=FOLDER))
        except ValueError:
            raise EffectError(rpt_("only an installed extension has a folder of its own")) from None
    library = effect.id_data.library
    file = bpy.path.abspath(library.filepath) if library else bpy.data.filepath
    if not file:
        raise EffectError(rpt_("in-between frames lie beside the .blend file: save it first"))
    return Path(file).parent / FOLDER


def factor(effect: PropertyGroup) -> int:
    """How many frames there are for each of the source; 1: in-between frames are off. EffectError: it is none of those
    there are."""
    return int(validation.word(effect, "inbetween"))


def method(effect: PropertyGroup) -> Method:
    """One of media.flow.METHODS."""
    return METHODS[validation.word(effect, "inbetween_method")]


def settings(effect: PropertyGroup, given: Path | None = None) -> Settings:
    """The effect's settings, as media.inbetween takes them; given: a folder in place of its own. EffectError: there is
    no folder."""
    return Settings(given or folder(effect), factor(effect), method(effect))


class BuiltStamps:
    """Which in-between frames there are on disk, as stamps: equal ones, and none was built or removed meanwhile.

    is_held: while in-between frames are built stamps stay as they are: those that come count when the build has
    ended"""

    _MOST = 64

    def __init__(self) -> None:
        self._known: Kept[tuple, tuple] = Kept()
        self.is_held = False

    def of(self, settings: Settings, stem: str) -> tuple:
        """The stamp of the frames of sources whose files have that stem."""
        key = *settings, stem
        if not self.is_held:
            self._known.pop(key, None)
        return self._known.ask(key, lambda: inbetween_cache.stamp(*settings, stem), self._MOST)

    def forget(self) -> None:
        """Forgets all: before another file is loaded."""
        self._known.clear()


built = BuiltStamps()
