"""What recipes and their users share: errors, the word for the camera, and the files of mattes.

In an effect from a recipe, frame 1 is the strip's first, and points are fractions of the picture. recipe_file.py reads
and writes recipes.
"""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from ..messages import UserError
from ..model.effect import Effect, FileContent, MatteRegion


class RecipeError(UserError, ValueError):
    """A recipe breaks the format. The message is one sentence that begins with the place, like `shutters[1].bars`."""


# The name by which a shutter follows the camera.
CAMERA = "camera"


def contents(source: Effect) -> list[FileContent]:
    """Return the matte files that an effect from a recipe names."""
    found = [region.content for region in source.regions if isinstance(region, MatteRegion)]
    return [content for content in found if isinstance(content, FileContent)]


def relative(path: Path, folder: Path) -> str:
    """Return the path of a matte file as a recipe in `folder` names it, with forward slashes.

    It is relative to the folder, with ".." if needed. It is absolute if the file is on another drive, or if ".." would
    lead elsewhere because of linked folders.
    """
    with suppress(ValueError):  # on another drive
        way = os.path.relpath(path, folder)
        # With linked folders, ".." can lead elsewhere.
        if os.path.realpath(os.path.join(folder, way)) == os.path.realpath(path):
            return Path(way).as_posix()
    return Path(os.path.abspath(path)).as_posix()
