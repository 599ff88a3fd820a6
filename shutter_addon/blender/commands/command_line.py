"""What several commands of the command line share: option types, options, and opening footage, recipes and edits."""

import argparse
import math
import os
import re
import sys
from pathlib import Path

import bpy
from bpy.types import Scene

from ...core.frames.frame_source import FrameSource
from ...core.messages import UserError, sentence
from ...core.model.effect import Effect
from ...core.model.keyframes import SourceTime
from ...core.model.limits import MAX_FRAME
from ...core.recipes import recipe_file
from ...media import open_source
from ...media.sequence import by_number
from ..data import requirements
from ..devices import available
from ..output import film_output
from ..rendering import render_job


def to_path(text: str) -> Path:
    """Return the absolute path that an option's text names. It is used as argparse's `type`.

    Several leading slashes become one, because Blender reads a leading // as "relative to the .blend file".

    Raises:
        ArgumentTypeError: The text is empty.
    """
    if not text:
        raise argparse.ArgumentTypeError("a name is missing")
    return Path(re.sub("^//+", "/", os.path.abspath(text)))


def megabytes(text: str) -> int | None:
    """Return an option's number of megabytes; None for 0, as if the option were not given. It is argparse's `type`.

    Raises:
        ArgumentTypeError: The text is not a whole number from 0 on.
    """
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of megabytes")
    return int(text) or None


def add_device(parser: argparse.ArgumentParser) -> None:
    """Add `--device` and `--gpu-memory`, which choose the device that composes pictures and limit its memory."""
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
    """Read an effect from a recipe, which is a JSON file.

    Print a warning if an older version wrote the recipe and this version cannot reproduce its picture exactly.

    Raises:
        RecipeError: The recipe is invalid.
    """
    found = recipe_file.load(path)
    if found.lost is not None:
        message = f"{path}: {found.lost}"  # not translated
        render_job.say(message)
    return found


def open_footage(path: Path) -> FrameSource:
    """Open a movie or an image sequence by its first file. Print a warning if files of the sequence were left out."""
    medium = open_source(path)
    if left_out := medium.left_out:
        render_job.say(left_out)
    return medium


def files(medium: FrameSource) -> list[Path]:
    """Return the paths of the footage's files, which a render must not overwrite.

    If an image sequence has gaps, the result includes the paths of its missing files: a file written there would become
    part of the sequence.

    Args:
        medium: The opened footage.
    """
    files = medium.files
    beside = by_number(files[0], listed=True) if len(files) > 1 else None
    return [*files, *(map(beside, range(len(files))) if beside else ())]


def length(medium: FrameSource, source_recipe: Effect) -> int:
    """Return the length of the edit in timeline frames: the footage's, or more if the recipe's time has later keys."""
    time = source_recipe.time
    keys = [math.ceil(frame) for frame, _ in time.keys] if isinstance(time, SourceTime) else []
    return min(max([medium.count, *keys]), MAX_FRAME)


def open_edit(path: Path, asked: str | None = None, name: str | None = None) -> tuple[Scene, range]:
    """Open a saved edit (.blend) without running its scripts.

    Args:
        path: The .blend file.
        asked: The text of the option `--frames`, which `frames` parses; None: all frames of the scene.
        name: The scene to use. None: the active scene. Only that one is checked for having strips, and for having no
            drivers that need scripts.

    Returns:
        The scene, and the timeline frames that were asked for.

    Raises:
        UserError: The file cannot be opened, there is no such scene, a check failed, or `asked` is malformed or not
            within the scene's frames. Also if the scene's render setting `use_sequencer` is off, or `use_multiview`
            (stereoscopy) is on.
    """
    if not path.is_file():
        raise UserError(f"{path}: " + ("is no file" if path.exists() else "no such file"))
    try:
        with film_output.quiet():
            # With its windows, like `blender -b`: load_ui=False would stay set for later files.
            bpy.ops.wm.open_mainfile(filepath=str(path), use_scripts=False)
    except RuntimeError as error:
        raise UserError(f"{path}: {film_output.message(error)}") from None
    if name is not None and name not in bpy.data.scenes:
        raise UserError(f'{path}: has no scene "{sentence(name, 40)}"')
    scene = bpy.context.scene if name is None else bpy.data.scenes[name]
    if name is None and not _has_strips(scene):
        others = [other.name for other in bpy.data.scenes if _has_strips(other)]
        where = f'; make "{others[0]}" the active one, and save the file' if others else ""
        raise UserError(f'{path}: its active scene, "{scene.name}", has no strips{where}')
    for setting, wanted in (("use_sequencer", True), ("use_multiview", False)):
        if getattr(scene.render, setting) != wanted:
            name, turn = scene.render.bl_rna.properties[setting].name, "on" if wanted else "off"
            raise UserError(f'{path}: turn "{name}" {turn} in the scene "{scene.name}", and save the file')
    for owner, driver in _scripts(scene) if name is None else ():  # drivers do not matter for the effects of a scene
        words = f'a driver of the {owner.bl_rna.name.lower()} "{owner.name}" needs scripts, which are not run'
        words += f" ({sentence(driver.expression, 40)}); bake it to keyframes, and save the file"
        raise UserError(f"{path}: {words}")
    return scene, frames(asked, range(scene.frame_start, scene.frame_end + 1), "edit")


def _scripts(scene: Scene) -> list[tuple]:
    """Return (owner, driver) of each driver in the rendered data that fails because scripts are not run."""
    used = requirements.used_data(scene, range(scene.frame_start, scene.frame_end + 1))
    drivers = [(item, curve.driver) for item in used for curve in _driven(item)]
    complex_ones = [pair for pair in drivers if pair[1].type == "SCRIPTED" and not pair[1].is_simple_expression]
    if complex_ones:  # evaluation finds out which of them are valid
        with film_output.quiet():
            for other in used.intersection(bpy.data.scenes):
                for layer in other.view_layers:
                    layer.update()
    return [(owner, driver) for owner, driver in complex_ones if not driver.is_valid]


def _driven(item: bpy.types.ID) -> list:
    """Return the F-curves of all drivers of a data-block and of its node tree."""
    animations = (getattr(each, "animation_data", None) for each in (item, getattr(item, "node_tree", None)))
    return [curve for animation in animations if animation for curve in animation.drivers]


def _has_strips(scene: Scene) -> bool:
    return bool(scene.sequence_editor and scene.sequence_editor.strips)


def frames(text: str | None, whole: range, what: str = "clip") -> range:
    """Parse the text of the option `--frames`.

    Args:
        text: "A:B" or "A-B" for the frames from A to B, including B; "A" for that frame alone; None: the whole range.
        whole: All frames that exist.
        what: What has these frames, "clip" or "edit". Only the error message uses it.

    Raises:
        OutputError: The text is malformed, or its frames are not within `whole`.
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
    """Print a line to stdout, with "?" for characters that the encoding of stdout lacks.

    If stdout is a pipe and its reader has ended, the line is dropped without an error.

    Raises:
        OutputError: Writing to stdout failed in any other way.
    """
    encoding = sys.stdout.encoding or "utf-8"
    try:
        print(text.encode(encoding, "replace").decode(encoding), flush=True)
    except BrokenPipeError:  # the reader has gone
        pass
    except OSError as error:
        raise film_output.OutputError(f"stdout: {error.strerror or error}") from None
