"""The format of an effect's data in .blend files, a number on each scene with effects, and migration of older formats.

Files of a newer format open. What is unknown in them stays as it is stored but is not shown, and nothing in them is
changed automatically.
"""

from collections.abc import Iterable

from bpy.app.translations import pgettext_rpt as rpt_

from . import consistency, strips

# Raise this with the first change after a release that older versions do not understand: a property, an enum item,
# another meaning. `migrate` leads to it.
FORMAT = 2


def is_newer(scene) -> bool:
    """Tell whether a newer version saved a scene's effects, in a format that this version does not know."""
    return scene.virtual_shutter.format > FORMAT


def is_file_newer() -> bool:
    """Tell whether a newer version saved any scene that can be changed. Then only the user's changes are written."""
    return any(map(is_newer, strips.local_scenes()))


def new_effect(scene, number: int):
    """Add an empty effect to a scene, and return it.

    The scene's data format becomes the oldest of its effects' formats, so that `migrate` converts them all. If a newer
    version of the extension saved the scene, its format stays. It is set here because no handler runs before an
    autosave.

    Args:
        number: The format of the data that the caller will fill the effect with.
    """
    group = scene.virtual_shutter
    if not is_newer(scene):
        group.format = min(number, group.format if group.effects else FORMAT)
    return group.effects.add()


def migrate() -> None:
    """Convert all effects to the current data format, and set the format of their scenes.

    Linked scenes are left out. This is done when a file was loaded, because no handler runs before an autosave. It must
    not be called if a newer version saved the file (`is_file_newer`).
    """
    for group in [scene.virtual_shutter for scene in _scenes_with_effects()]:
        for effect in group.effects if group.format < 2 else ():
            if effect.inbetween not in ("1", "AUTO"):  # bars count filmed frames now; repeated frames still count
                effect.skip_repeats = False
                consistency.count_filmed(effect)
        group.format = FORMAT


def stamp_saved(version: str) -> None:
    """Write the extension's version into all scenes with effects, except linked ones, before a file is saved.

    The scenes' data format stays as it is: an effect that was appended from an older file is converted by `migrate`
    when the file is loaded next.

    Args:
        version: The extension's version.
    """
    for scene in _scenes_with_effects():
        scene.virtual_shutter.version = version


def note(scenes: Iterable) -> str | None:
    """Return a warning for the user about the first scene with effects of a newer format; None: there is none."""
    newer = next(filter(is_newer, scenes), None)
    if newer is None:
        return None
    sentence = rpt_(
        '"{scene}" was saved by a newer version of Virtual Shutter ({version}): what this one does not know '
        "is kept, but not shown, and no effect in its file follows strips that you move, copy or delete"
    )
    return sentence.format(scene=newer.name, version=newer.virtual_shutter.version)


def _scenes_with_effects() -> list:
    return [scene for scene in strips.local_scenes() if scene.virtual_shutter.effects]
