"""Options that several commands have, and reading their inputs."""

import argparse
import os
import re
import sys
from pathlib import Path

from bpy.types import Scene

from ...core.frames.frame_source import FrameSource
from ...core.messages import sentence
from ...core.model.effect import Effect
from ...core.recipes import recipe_file
from ...media import open_source
from ...media.sequence import by_number
from ..devices import available
from ..editing import whole_edits
from ..output import film_output
from ..rendering import render_job


def to_path(text: str) -> Path:
    """Parse a path. Leading slashes become one, since Blender takes two for the .blend file's folder."""
    if not text:
        raise argparse.ArgumentTypeError("a name is missing")
    return Path(re.sub("^//+", "/", os.path.abspath(text)))


def megabytes(text: str) -> int | None:
    """Parse a number of megabytes. 0 is None, as without the option."""
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of megabytes")
    return int(text) or None


def add_device(parser: argparse.ArgumentParser) -> None:
    """Add the options for the device that composes pictures."""
    parser.add_argument(
        "--device",
        choices=available.CHOICES,
        help="opengl: OpenGL 4.3; blender: Blender's own GPU; gpu: either; cpu: NumPy; auto: the first of these that"
        " works (default: as in Blender's preferences, else auto)",
    )
    parser.add_argument(
        "--gpu-memory",
        type=megabytes,
        metavar="MB",
        help="GPU memory for textures (default: as in Blender's preferences, else three quarters, and at most half of"
        " the machine's memory)",
    )


def recipe(path: Path) -> Effect:
    """Read a recipe. Print a warning if older versions showed another picture. RecipeError: it is invalid."""
    found = recipe_file.load(path)
    if found.lost is not None:
        told = f"{path}: {found.lost}"  # not translated
        render_job.say(told)
    return found


def open_footage(path: Path) -> FrameSource:
    """Open a source. Print a warning about files that were left out."""
    medium = open_source(path)
    if left_out := medium.left_out:
        render_job.say(left_out)
    return medium


def files(medium: FrameSource) -> list[Path]:
    """Return the source's files, including those that a sequence lacks, which would belong to it if they appeared."""
    files = medium.files
    beside = by_number(files[0], listed=True) if len(files) > 1 else None
    return [*files, *(map(beside, range(len(files))) if beside else ())]


def open_edit(path: Path, asked: str | None) -> tuple[Scene, range]:
    """Open a saved edit. Return its scene and frames as `frames`. UserError: there is no such edit, or frame."""
    scene = whole_edits.open_edit(path)
    return scene, frames(asked, range(scene.frame_start, scene.frame_end + 1), "edit")


def frames(text: str | None, whole: range, what: str = "clip") -> range:
    """Return the timeline frames of `A:B` (or `A-B`, as schedulers name chunks), of `A` alone, or all frames.

    Raises:
        OutputError: The clip has no such frames.
    """
    if text is None:
        return whole
    numbers = re.fullmatch(r"(\d{1,9})(?:[:-](\d{1,9}))?", text)
    if not numbers:
        raise film_output.OutputError(f'--frames: "{sentence(text, 40)}" is not A:B')
    first, last = int(numbers[1]), int(numbers[2] or numbers[1])
    if not whole[0] <= first <= last <= whole[-1]:
        raise film_output.OutputError(f"--frames: {text} is not within the {what}'s frames {whole[0]}:{whole[-1]}")
    return range(first, last + 1)


def print_line(text: str) -> None:
    """Print to stdout, with "?" for characters that the terminal lacks. OutputError: it cannot be written there."""
    encoding = sys.stdout.encoding or "utf-8"
    try:
        print(text.encode(encoding, "replace").decode(encoding), flush=True)
    except BrokenPipeError:  # the reader has gone
        pass
    except OSError as error:
        raise film_output.OutputError(f"stdout: {error.strerror or error}") from None
