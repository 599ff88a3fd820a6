"""The format of what the extension keeps in .blend files: a number that each scene with effects carries.

A file of a newer format opens: what is not known here stays as it is stored, unseen, and nothing is tidied by itself.
"""

from collections.abc import Callable, Iterable, Iterator

from bpy.app.translations import pgettext_rpt as rpt_

from . import consistency, strips


def _count_filmed() -> Iterator[str | None]:
    """Format 2: bars count filmed frames, not the moments between them as well; frames that repeat stayed."""
    for scene in _holding():
        for effect in scene.virtual_shutter.effects if scene.virtual_shutter.format < 2 else ():
            if effect.inbetween not in ("1", "AUTO"):
                effect.skip_repeats = False
                yield consistency.count_filmed(effect)


# Raise it with the first change after a release that older versions would not understand: a property, an item of an
# enum, another meaning.
FORMAT = 2
# What then becomes of older files: by the format that each leads to, in order; the first version's was 1. They are run
# as a file is loaded of which anything is older, and may find newer scenes beside: what needs no change stays as it is.
# Each gives sentences of what it could not keep.
MIGRATIONS: tuple[tuple[int, Callable[[], Iterable[str | None]]], ...] = ((2, _count_filmed),)


def of_file() -> int:
    """The oldest format of the effects that can be changed, 0: of before there were numbers; this one, if there are
    none."""
    return min((scene.virtual_shutter.format for scene in _holding()), default=FORMAT)


def is_newer(scene) -> bool:
    """Whether a scene's effects are of a newer format than is known here."""
    return scene.virtual_shutter.format > FORMAT


def is_file_newer() -> bool:
    """Whether any scene that can be changed is: then nothing is written into the file but what the user changes."""
    return any(map(is_newer, strips.local_scenes()))


def new_effect(scene, number: int):
    """Adds an effect to a scene, which is noted to be of the oldest format of its effects: autosave tells nobody.

    number: the format of what the effect is filled with, FORMAT if it is new. A newer scene stays so."""
    group = scene.virtual_shutter
    if not is_newer(scene):
        group.format = min(number, group.format if group.effects else FORMAT)
    return group.effects.add()


def migrate() -> str | None:
    """Brings the file that was loaded to this format, and notes that in all scenes with effects: not as it is saved,
    as autosave tells nobody. The sentence about the first thing that could not be kept; None: all was."""
    stored = of_file()
    lost = [sentence for number, change in MIGRATIONS if stored < number for sentence in change()]
    for scene in _holding():
        if scene.virtual_shutter.format != FORMAT:
            scene.virtual_shutter.format = FORMAT
    return next(filter(None, lost), None)


def stamp_saved(version: str) -> None:
    """Notes in all scenes with effects the version of the extension that saves them. Their format stays: one that was
    appended from an older file has its own until the file is loaded, and so migrated."""
    for scene in _holding():
        scene.virtual_shutter.version = version


def note(scenes: Iterable) -> str | None:
    """The sentence about the first of these scenes whose effects are of a newer format, linked ones last; None: none
    is."""
    newer = sorted(filter(is_newer, scenes), key=lambda scene: scene.library is not None)
    if not newer:
        return None
    scene = newer[0]
    if scene.library is not None:  # it is left alone in any case
        sentence = rpt_(
            '"{scene}" was saved by a newer version of Virtual Shutter ({version}): what this one does not know '
            "is kept, but not shown"
        )
    else:
        sentence = rpt_(
            '"{scene}" was saved by a newer version of Virtual Shutter ({version}): what this one does not know '
            "is kept, but not shown, and no effect in this file follows strips that you move, copy or delete"
        )
    return sentence.format(scene=scene.name, version=scene.virtual_shutter.version)


def _holding() -> list:
    return [scene for scene in strips.local_scenes() if scene.virtual_shutter.effects]
