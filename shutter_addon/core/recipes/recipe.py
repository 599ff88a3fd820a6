"""What is done with an effect as a recipe has it: in whose frames 1 is the strip's first, in fractions of the picture.

recipe_file.py reads and writes it.
"""

from __future__ import annotations

import os
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..messages import UserError, sentence
from ..model import shutters
from ..model.effect import Effect, FileContent, MatteRegion, Region
from ..model.keyframes import Bars, Channel, Constant, Keys


class RecipeError(UserError, ValueError):
    """A recipe that breaks the format; the message is one sentence (core.messages) that begins with the place."""

    def __init__(self, text: str):
        super().__init__(sentence(text))


# What a shutter follows that moves with the camera.
CAMERA = "camera"


def with_inbetween(source: Effect, factor: int) -> Effect:
    """The same effect over another number of in-between frames: its bars stand for the same times.

    RecipeError: they would be too many."""
    options = source.options.at(1)

    def changed(bars: np.ndarray) -> np.ndarray:
        return shutters.multiplied(bars, options.step, factor, options.position)

    def multiplied(channel: Channel) -> Channel:
        if isinstance(channel, Keys):
            return replace(channel, values=tuple(map(changed, channel.values)))
        return Constant(changed(channel.at(1)))

    window = options.window * factor
    try:
        bars = [Bars(multiplied(shutter.bars.channel), shutter.bars.keys) for shutter in source.shutters]
    except shutters.ShutterError:
        count = window // options.step
        raise RecipeError(
            f"window: {count} bars for {factor}× in-between frames, the most are {shutters.MAX_WINDOW}"
        ) from None
    made = tuple(replace(shutter, bars=each) for shutter, each in zip(source.shutters, bars, strict=True))
    options = replace(options, window=-(-window // options.step), step=factor)
    return replace(source, shutters=made, options=Constant(options))


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
