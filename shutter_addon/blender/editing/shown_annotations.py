"""Give previews the annotation of the effect that they show, and leave the user's own annotations alone.

Blender shows an effect's annotation only while the pen is down, because it ignores that strokes move. Otherwise our
draw handler draws it. Every sequencer space keeps an annotation, even in hidden editors and workspaces. It is a user of
the annotation, and would save it in the file.
"""

from __future__ import annotations

from collections.abc import Iterator

import bpy
from bpy.types import ID, Annotation, SpaceSequenceEditor

from ..data import selection
from ..data.annotations import USERS
from ..rendering import previews


def follow() -> None:
    """Give previews that have an effect's annotation that of the effect at the playhead, for the pen to draw in.

    Without an effect there, take the annotation away until there is one. Never replace an annotation of the user's. Let
    Blender show an effect's annotation only while the pen is down; at other times, our draw handler draws its strokes.
    """
    for window in bpy.data.window_managers[0].windows:
        seen = selection.seen(window.workspace.sequencer_scene or window.scene)
        for area in window.screen.areas:
            if area.type == "SEQUENCE_EDITOR" and is_other(area.spaces.active, seen):
                give(area.spaces.active, seen[1].scene.annotation if seen else None)
            if area.type == "SEQUENCE_EDITOR" and is_laid_wrong(area.spaces.active):
                area.spaces.active.preview_overlay.show_annotation ^= True


def is_laid_wrong(space: SpaceSequenceEditor) -> bool:
    """Tell whether a preview shows an effect's annotation while the pen is up, or hides it while the pen is down."""
    is_effects = space.annotation is not None and is_own(space.annotation)
    return is_effects and space.preview_overlay.show_annotation != previews.pen_is_down()


def is_other(space: SpaceSequenceEditor, seen: tuple | None) -> bool:
    """Tell whether a preview needs another annotation, because it has that of an effect that it does not show.

    An annotation of the user's is never replaced. A preview without an annotation needs one only if it shows an effect
    and had an effect's annotation that the extension or undo took away.

    Args:
        space: The preview.
        seen: What selection.seen returns for the preview's scene: the visible effect; None: no effect is visible.
    """
    wanted = seen[1].scene.annotation if seen else None
    if space.annotation is None:
        return wanted is not None and space.as_pointer() in previews.looking.emptied
    return space.annotation != wanted and is_own(space.annotation)


def is_own(made: ID) -> bool:
    """Tell whether an annotation or camera was made for an effect, not by the user."""
    return made.virtual_shutter_made not in ("", USERS)


def give(space: SpaceSequenceEditor, annotation: Annotation | None) -> None:
    """Give a preview an effect's annotation; None: take its annotation away until an effect is visible again."""
    before = space.annotation
    if before is not None and annotation is not None and not is_own(before):
        before.use_fake_user = True  # keeps the user's annotation in the file
    if annotation is None:
        space.preview_overlay.show_annotation = True
    space.annotation = annotation
    (previews.looking.emptied.discard if annotation else previews.looking.emptied.add)(space.as_pointer())


def let_go(annotation: ID) -> None:
    """Take an annotation away from all previews, before the annotation is removed from the file."""
    for space in _spaces():
        if space.annotation == annotation:
            give(space, None)


def before_undo(*_: object) -> None:
    """Note which previews have an effect's annotation. Undo may take it away and does not give it back."""
    for space in _spaces():
        if space.annotation is not None and is_own(space.annotation):
            previews.looking.emptied.add(space.as_pointer())


def forget() -> None:
    """Forget from which previews annotations were taken away, before another file is loaded."""
    previews.looking.emptied.clear()


def _spaces() -> Iterator[SpaceSequenceEditor]:
    for screen in bpy.data.screens:
        for area in screen.areas:
            yield from (space for space in area.spaces if space.type == "SEQUENCE_EDITOR")
