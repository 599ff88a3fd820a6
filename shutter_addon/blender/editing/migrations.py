"""What becomes of a file of an older format as it is loaded."""

from collections.abc import Callable

import bpy

from ..data import annotations, data_format, strips
from . import shown_annotations

_OLDER_NAMES = "Shutter ", "Scribbles ", "Verschluss ", "Markierungen "  # of annotations made for effects


def take_over() -> None:
    """Marks in a file of an older version what was made for effects, and what is left of those that are gone:
    annotations of such a name that nothing but previews uses."""
    for scene in strips.local_scenes():
        made = [scene.annotation]
        if scene.camera is not None and scene.camera.name == f"{scene.name} Camera":
            made.append(scene.camera.data)
        for each in made if scene.virtual_shutter.identity else ():
            if each is not None and each.library is None:
                each.virtual_shutter_made = scene.virtual_shutter.identity
    for annotation in _unmarked():
        if annotation.users == shown_annotations.shown_by(annotation) > 0:
            annotation.virtual_shutter_made = annotations.GONE


def leave_to_user() -> None:
    """Annotations of such a name that the user made stay where the file is opened again."""
    for annotation in _unmarked():
        annotation.virtual_shutter_made = annotations.USERS


def _unmarked() -> list:
    own = [each for each in bpy.data.annotations if each.library is None and not each.virtual_shutter_made]
    return [each for each in own if each.name.startswith(_OLDER_NAMES)]


# By the format that each leads to, in order. They are run as a file is loaded of which anything is older, and may find
# newer scenes beside: what needs no change is left as it is.
MIGRATIONS: tuple[tuple[int, Callable[[], None]], ...] = ((1, take_over),)


def migrate() -> None:
    """Brings the file that was loaded to the format of this version."""
    stored = data_format.of_file()
    for number, change in MIGRATIONS:
        if stored < number:
            change()
    data_format.stamp_migrated()  # and not as it is saved: autosave tells nobody
