"""The command: from a source and a recipe to a finished film, through Blender's sequencer.

`python -m shutter_addon render …`, and `blender -c shutter render …` in an installed Blender.
"""

import argparse
import os
import re
import sys
from pathlib import Path

import bpy

from ..compute.errors import NoDeviceError
from ..compute.renderer import DEVICES
from ..core import recipe
from ..media import MediaError, open_source
from . import edits, effects, outputs, pictures

BAD_INPUT = 2
FAULTS = (recipe.RecipeError, MediaError, outputs.OutputError, effects.EffectError, NoDeviceError)


def main(argv: list[str]) -> int:
    """Runs the command; its exit code: 0, or 2 after one sentence on stderr."""
    parser = _parser()
    try:
        arguments = parser.parse_args(argv)
        _render(arguments)
    except SystemExit as stop:  # argparse: --help, or what it has said on stderr
        return stop.code
    except FAULTS as error:
        return _refuse(str(error))
    except OSError as error:
        return _refuse(f"{error.filename or arguments.output}: {error.strerror or error}")
    return 0


def _refuse(sentence: str) -> int:
    print(f"Virtual Shutter: {sentence}", file=sys.stderr)
    return BAD_INPUT


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser("shutter", description="Every pixel its own exposure.")
    render = parser.add_subparsers(dest="command", required=True).add_parser(
        "render", help="render a source through a recipe"
    )
    render.add_argument("source", type=Path, help="a movie, or the first file of an image sequence")
    render.add_argument("--recipe", type=Path, required=True, help="the effect, a JSON file")
    render.add_argument("--output", type=Path, help=f"a folder, or a movie ({', '.join(outputs.MOVIES)})")
    render.add_argument(
        "--format", choices=tuple(outputs.FORMATS), help="of the pictures in a folder: 16-bit png, float exr"
    )
    render.add_argument("--frames", metavar="A:B", help="timeline frames A to B; 1 is the strip's first")
    render.add_argument("--device", choices=DEVICES, default="auto", help="gpu: OpenGL 4.3; cpu: NumPy")
    render.add_argument("--weights", type=Path, metavar="DIR", help="also write the coefficients, as float EXR")
    render.add_argument("--save", type=Path, metavar="FILE.blend", help="keep the edit")
    return parser


def _render(arguments) -> None:
    if arguments.output is None and arguments.save is None:
        raise outputs.OutputError("nothing to do: give --output, --save or both")
    source_recipe = recipe.load(arguments.recipe)
    path = Path(os.path.abspath(arguments.source))
    with open_source(path) as medium:
        output = Path(os.path.abspath(arguments.output)) if arguments.output else None
        if output:
            outputs.check(output, arguments.format, (medium.width, medium.height))
        frames = _frames(arguments.frames, medium.count)
        edit = edits.make_edit(path, medium, source_recipe)
    edit.frame_start, edit.frame_end = frames
    if output:
        outputs.set_output(edit, output, arguments.format or "png", alpha=medium.alpha != "opaque")
    if arguments.save:
        _save(edit, Path(os.path.abspath(arguments.save)))
    if output:
        pictures.device, pictures.weights_folder = arguments.device, arguments.weights
        if arguments.weights:
            arguments.weights.mkdir(parents=True, exist_ok=True)
        outputs.film(edit, output)


def _frames(text: str | None, count: int) -> tuple[int, int]:
    """First and last timeline frame of `A:B`, of `A` alone, or of the whole clip."""
    if text is None:
        return 1, count
    numbers = re.fullmatch(r"(-?\d+)(?::(-?\d+))?", text)
    if not numbers:
        raise outputs.OutputError(f'--frames: "{text}" is not A:B')
    first, last = int(numbers[1]), int(numbers[2] or numbers[1])
    if not 1 <= first <= last <= count:
        raise outputs.OutputError(f"--frames: {text} is not within the clip's frames 1:{count}")
    return first, last


def _save(edit, path: Path) -> None:
    """Saves the edit, its paths relative to the file: it may be opened on another machine."""
    path.parent.mkdir(parents=True, exist_ok=True)
    edits.make_paths_relative(edit, path.parent)
    try:
        bpy.ops.wm.save_as_mainfile(filepath=str(path), check_existing=False, compress=True)
    except RuntimeError as error:
        raise outputs.OutputError(f"{path}: {outputs.message(error)}") from None
