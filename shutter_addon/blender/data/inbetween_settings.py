"""In-between frames of an effect: where they lie, and its source with them."""

from pathlib import Path

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from . import effects, validation

FOLDER = "virtual_shutter_inbetween"
METHODS = {"QUICK": "quick", "GOOD": "good"}

given: Path | None = None  # the command's: a folder for whatever effect


def folder(effect) -> Path:
    """The folder of the effect's in-between frames. EffectError: there is none, beside a file that is not saved,
    or of an extension that is not installed."""
    if given is not None:
        return given
    if validation.word(effect, "inbetween_place") == "USER":
        package = __package__.rpartition(".shutter_addon")[0]
        try:
            return Path(bpy.utils.extension_path_user(package, path=FOLDER))
        except ValueError:
            raise effects.EffectError(rpt_("only an installed extension has a folder of its own")) from None
    library = effect.id_data.library
    file = bpy.path.abspath(library.filepath) if library else bpy.data.filepath
    if not file:
        raise effects.EffectError(rpt_("in-between frames lie beside the .blend file: save it first"))
    return Path(file).parent / FOLDER


def factor(effect) -> int:
    """How many frames there are for each of the source; 1: in-between frames are off. EffectError: it is none of those
    there are."""
    return int(validation.word(effect, "inbetween"))


def method(effect) -> str:
    """One of media.flow.METHODS."""
    return METHODS[validation.word(effect, "inbetween_method")]


def settings(effect) -> tuple[Path, int, str]:
    """Folder, factor and method, as media.inbetween takes them. EffectError: there is no folder."""
    return folder(effect), factor(effect), method(effect)


def source(medium, effect):
    """The medium itself, or an InbetweenSource over it. EffectError, MediaError: there can be none."""
    from ...media.inbetween import InbetweenSource

    if factor(effect) == 1:
        return medium
    return InbetweenSource(medium, *settings(effect))
