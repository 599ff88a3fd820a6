"""In-between frames of an effect: where they lie, and its source with them."""

from pathlib import Path

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from . import effects

FOLDER = "inbetween"
METHODS = {"QUICK": "quick", "GOOD": "good"}

given: Path | None = None  # the command's: a folder for whatever effect


def folder(effect) -> Path:
    """The folder of the effect's in-between frames. EffectError: there is none beside a file that is not saved."""
    if given is not None:
        return given
    if effect.inbetween_place == "USER":
        package = __package__.rpartition(".shutter_addon")[0]
        return Path(bpy.utils.extension_path_user(package, path=FOLDER))
    if not bpy.data.filepath:
        raise effects.EffectError(rpt_("in-between frames lie beside the .blend file: save it first"))
    return Path(bpy.path.abspath(f"//{FOLDER}"))


def factor(effect) -> int:
    """How many frames there are for each of the source; 1: in-between frames are off."""
    return int(effect.inbetween)


def source(medium, effect):
    """The medium itself, or an Inbetween over it. EffectError, MediaError: there can be none."""
    from ..media.inbetween import Inbetween

    if factor(effect) == 1:
        return medium
    return Inbetween(medium, folder(effect), factor(effect), METHODS[effect.inbetween_method])
