"""What is done with an effect as a recipe has it: in whose frames 1 is the strip's first, in fractions of the picture.

recipe_file.py reads and writes it.
"""

from __future__ import annotations

import os
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from ..messages import UserError, sentence
from ..model.effect import Effect, FileContent, MatteRegion, Region


class RecipeError(UserError, ValueError):
    """A recipe that breaks the format; the message is one sentence (core.messages) that begins with the place."""

    def __init__(self, text: str):
        super().__init__(sentence(text))


# What a shutter follows that moves with the camera.
CAMERA = "camera"


def contents(source: Effect) -> list[FileContent]:
    """What its mattes are read from, as it stands in the recipe."""
    found = [region.content for region in source.regions if isinstance(region, MatteRegion)]
    return [content for content in found if isinstance(content, FileContent)]


def moved(source: Effect, old: Path, new: Path) -> Effect:
    """The same effect for a recipe in another folder: relative paths of mattes lead to the same files."""

    def rebased(region: Region | MatteRegion) -> Region | MatteRegion:
        if not isinstance(region, MatteRegion) or not isinstance(content := region.content, FileContent):
            return region
        if Path(content.path).is_absolute():
            return region
        return replace(region, content=replace(content, path=relative(old / content.path, new)))

    return source.with_parts([rebased(region) for region in source.regions])


def relative(path: Path, folder: Path) -> str:
    """The path of a matte, as a recipe in a folder has it: relative, if there is such a one."""
    with suppress(ValueError):  # on another drive
        way = os.path.relpath(path, folder)
        # ".." leads out of where a linked folder really lies
        if os.path.realpath(os.path.join(folder, way)) == os.path.realpath(path):
            return Path(way).as_posix()
    return Path(os.path.abspath(path)).as_posix()
