"""What several commands take: values of their options, and the source that they read."""

import argparse
import os
import re
import sys
from argparse import Namespace
from collections.abc import Iterable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import NamedTuple

from bpy.types import Scene

from ...core.farm.job_file import EditVersion
from ...core.frames.frame_source import FrameSource
from ...core.messages import UserError, sentence
from ...core.model.effect import Effect
from ...core.model.fields import fields_of
from ...core.model.frame_state import Options
from ...core.recipes import recipe_file
from ...media import open_source
from ...media.files import stamp
from ...media.sequence import by_number
from ..data import versions
from ..devices import available
from ..editing import whole_edits
from ..output import film_output
from ..rendering import render_job, render_settings

SMOOTH = tuple(map(str, fields_of(Options)["step"].words))  # 1: off


def place(text: str) -> Path:
    """A path as it is named. Two slashes at its beginning, which Blender takes for the .blend's folder, are one."""
    if not text:
        raise argparse.ArgumentTypeError("a name is missing")
    return Path(re.sub("^//+", "/", os.path.abspath(text)))


def megabytes(text: str) -> int | None:
    """None for 0: as without the option."""
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"{text!r} is no number of megabytes")
    return int(text) or None


def add_device(parser: argparse.ArgumentParser) -> None:
    """The options that say what composes pictures."""
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
        help="of the GPU's memory, what textures may take (default: as in Blender's preferences, else three quarters,"
        " and half of the machine's memory at most)",
    )


def rendered_by(arguments: Namespace) -> AbstractContextManager[None]:
    """Inside, renders are composed as these options say."""
    return render_settings.using(arguments.device, gpu_memory=arguments.gpu_memory)


def refuse(arguments: Namespace, names: Iterable[str], why: str) -> None:
    """OutputError: one of these options is given, which is for something else."""
    for name in names:
        if getattr(arguments, name) is not None:
            raise film_output.OutputError(f"--{name.replace('_', '-')}: {why}")


def recipe(path: Path) -> Effect:
    """The recipe in a file, with a word on stderr where it showed another picture once. RecipeError: there is none."""
    found = recipe_file.load(path)
    if found.lost is not None:
        told = f"{path}: {found.lost}"  # no message that is translated
        render_job.say(told)
    return found


def opened(path: Path) -> FrameSource:
    """The source, with a word on stderr of files that were left out."""
    medium = open_source(path)
    if left_out := medium.left_out:
        render_job.say(left_out)
    return medium


def files(medium: FrameSource) -> list[Path]:
    """The source's files, also those that are missing in an image sequence: it would show them, were they there."""
    files = medium.files
    beside = by_number(files[0], listed=True) if len(files) > 1 else None
    return [*files, *(map(beside, range(len(files))) if beside else ())]


class Edit(NamedTuple):
    """A saved edit that is open.

    frames: those of its timeline that are asked for; whole: all; opened: the file's stamp, before it was"""

    path: Path
    scene: Scene
    frames: range
    whole: range
    opened: tuple[int, int] | None

    def version(self) -> EditVersion:
        """Give the version of the edit as it was opened.

        Raises:
            UserError: It was saved over since, so that its key would be that of another edit.
            OSError: It is gone.
        """
        current = versions.of_edit(self.scene)
        if stamp(self.path) != self.opened:
            raise UserError(f"{self.path}: was saved over while it was opened; start again")
        return current


def open_edit(path: Path, asked: str | None) -> Edit:
    """Opens a saved edit; asked: as for `frames`. UserError, OutputError: there is no such edit, or frame."""
    opened = stamp(path)
    scene = whole_edits.open_edit(path)
    whole = range(scene.frame_start, scene.frame_end + 1)
    return Edit(path, scene, frames(asked, whole, "edit"), whole, opened)


def frames(text: str | None, whole: range, what: str = "clip") -> range:
    """The timeline frames of `A:B` (or `A-B`, as schedulers name chunks), of `A` alone, or of the whole. OutputError:
    what is rendered has no such frames."""
    if text is None:
        return whole
    numbers = re.fullmatch(r"(\d{1,9})(?:[:-](\d{1,9}))?", text)
    if not numbers:
        raise film_output.OutputError(f'--frames: "{sentence(text, 40)}" is not A:B')
    first, last = int(numbers[1]), int(numbers[2] or numbers[1])
    if not whole[0] <= first <= last <= whole[-1]:
        raise film_output.OutputError(f"--frames: {text} is not within the {what}'s frames {whole[0]}:{whole[-1]}")
    return range(first, last + 1)


def tell(text: str) -> None:
    """Prints it on stdout; characters that a terminal lacks as "?". OutputError: it cannot be written there."""
    encoding = sys.stdout.encoding or "utf-8"
    try:
        print(text.encode(encoding, "replace").decode(encoding), flush=True)
    except BrokenPipeError:  # nobody reads on
        pass
    except OSError as error:
        raise film_output.OutputError(f"stdout: {error.strerror or error}") from None
