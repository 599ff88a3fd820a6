"""Which annotation the previews show: that of the effect that is seen, none where none is seen, and never another one
in place of one that the user made. Blender shows an effect's while the pen is down alone: it has it as it was drawn, at
whatever frame, and our draw handler where it is now.

A sequencer keeps its annotation in every one of its spaces, those too that lie behind another editor or in a workspace
that is not shown: each is a user of it, and would bring it into the saved file.
"""

from __future__ import annotations

from collections.abc import Iterator

import bpy
from bpy.types import ID, Annotation, SpaceSequenceEditor

from ..data import selection
from ..data.annotations import USERS
from ..rendering import previews

_emptied: set[int] = set()  # addresses of spaces whose annotation was an effect's, until none was seen or it went
_shown: dict[int, bool] = {}  # by such an address, whether the user's own annotations are shown there


def follow() -> None:
    """Previews that are shown, and have an effect's scribbles, get those of the effect that is seen."""
    for window in bpy.data.window_managers[0].windows:
        seen = selection.seen(window.workspace.sequencer_scene or window.scene)
        for area in window.screen.areas:
            if area.type == "SEQUENCE_EDITOR" and is_other(area.spaces.active, seen):
                give(area.spaces.active, seen[1].scene.annotation if seen else None)
            if area.type == "SEQUENCE_EDITOR" and is_laid_wrong(area.spaces.active):
                area.spaces.active.preview_overlay.show_annotation ^= True


def is_laid_wrong(space: SpaceSequenceEditor) -> bool:
    """Whether Blender shows an effect's annotation in a preview without the pen, or does not with it."""
    is_effects = space.annotation is not None and is_own(space.annotation)
    return is_effects and space.preview_overlay.show_annotation != previews.pen_is_down()


def is_other(space: SpaceSequenceEditor, seen: tuple | None) -> bool:
    """Whether a preview has to get another annotation, for what selection.seen has found in its scene."""
    wanted = seen[1].scene.annotation if seen else None
    if space.annotation is None:
        return wanted is not None and space.as_pointer() in _emptied
    return space.annotation != wanted and is_own(space.annotation)


def is_own(made: ID) -> bool:
    """Whether an annotation, or a camera, was made for an effect."""
    return made.virtual_shutter_made not in ("", USERS)


def give(space: SpaceSequenceEditor, annotation: Annotation | None) -> None:
    """Makes an effect's annotation that of a preview; one of the user's goes on without it. None: takes it away until
    an effect is seen."""
    before = space.annotation
    if before is not None and annotation is not None and not is_own(before):
        before.use_fake_user = True  # or it would not be saved
    if before is None or not is_own(before):
        _shown[space.as_pointer()] = space.preview_overlay.show_annotation
    if annotation is None:
        space.preview_overlay.show_annotation = _shown.get(space.as_pointer(), True)
    space.annotation = annotation
    (_emptied.discard if annotation else _emptied.add)(space.as_pointer())


def let_go(annotation: ID) -> None:
    """Takes an annotation away from all previews."""
    for space in _spaces():
        if space.annotation == annotation:
            give(space, None)


def before_undo(*_: object) -> None:
    """Notes where scribbles are shown: Blender takes away what undo removes, and does not give it back."""
    for space in _spaces():
        if space.annotation is not None and is_own(space.annotation):
            _emptied.add(space.as_pointer())


def forget() -> None:
    """Forgets the previews of a file, before another one is loaded."""
    _emptied.clear()
    _shown.clear()


def _spaces() -> Iterator[SpaceSequenceEditor]:
    for screen in bpy.data.screens:
        for area in screen.areas:
            yield from (space for space in area.spaces if space.type == "SEQUENCE_EDITOR")
