"""The command: from a source and a recipe to a finished film, through Blender's sequencer.

`python -m shutter_addon render …`, and `blender -c shutter render …` in an installed Blender.
"""

import argparse
import os
import re
import shutil
import signal
import sys
import tempfile
from contextlib import contextmanager
from pathlib import Path

import bpy
from tqdm import tqdm

from ..compute.renderer import DEVICES, NoDeviceError
from ..core import recipe
from ..media import MediaError, open_source
from . import edits, effects, engine, pictures

BAD_INPUT = 2
INTERRUPTED = 130
FAULTS = (recipe.RecipeError, MediaError, edits.OutputError, effects.EffectError, NoDeviceError)


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
    print(f"shutter: {sentence}", file=sys.stderr)
    return BAD_INPUT


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser("shutter", description="Every pixel its own exposure.")
    render = parser.add_subparsers(dest="command", required=True).add_parser(
        "render", help="render a source through a recipe"
    )
    render.add_argument("source", type=Path, help="a movie, or the first file of an image sequence")
    render.add_argument("--recipe", type=Path, required=True, help="the effect, a JSON file")
    render.add_argument("--output", type=Path, help=f"a folder, or a movie ({', '.join(edits.MOVIES)})")
    render.add_argument("--format", choices=edits.FORMATS, help="of the pictures in a folder: 16-bit png, float exr")
    render.add_argument("--frames", metavar="A:B", help="timeline frames A to B; 1 is the strip's first")
    render.add_argument("--device", choices=DEVICES, default="auto", help="gpu: OpenGL 4.3; cpu: NumPy")
    render.add_argument("--weights", type=Path, metavar="DIR", help="also write the coefficients, as float EXR")
    render.add_argument("--save", type=Path, metavar="FILE.blend", help="keep the edit")
    return parser


def _render(arguments) -> None:
    if arguments.output is None and arguments.save is None:
        raise edits.OutputError("nothing to do: give --output, --save or both")
    source_recipe = recipe.load(arguments.recipe)
    path = Path(os.path.abspath(arguments.source))
    with open_source(path) as medium:
        output = Path(os.path.abspath(arguments.output)) if arguments.output else None
        if output:
            edits.check_output(output, arguments.format, (medium.width, medium.height))
        frames = _frames(arguments.frames, medium.count)
        edit = edits.make_edit(path, medium, source_recipe)
    edit.frame_start, edit.frame_end = frames
    if output:
        edits.set_output(edit, output, arguments.format or "png")
    if arguments.save:
        _save(Path(os.path.abspath(arguments.save)))
    if output:
        pictures.device, pictures.weights_folder = arguments.device, arguments.weights
        if arguments.weights:
            arguments.weights.mkdir(parents=True, exist_ok=True)
        film(edit, output)


def _frames(text: str | None, count: int) -> tuple[int, int]:
    """First and last timeline frame of `A:B`, of `A` alone, or of the whole clip."""
    if text is None:
        return 1, count
    numbers = re.fullmatch(r"(-?\d+)(?::(-?\d+))?", text)
    if not numbers:
        raise edits.OutputError(f'--frames: "{text}" is not A:B')
    first, last = int(numbers[1]), int(numbers[2] or numbers[1])
    if not 1 <= first <= last <= count:
        raise edits.OutputError(f"--frames: {text} is not within the clip's frames 1:{count}")
    return first, last


def _save(path: Path) -> None:
    """Saves the edit, its paths relative to the file: it may be opened on another machine."""
    path.parent.mkdir(parents=True, exist_ok=True)
    scene = bpy.context.scene
    bpy.ops.wm.save_as_mainfile(filepath=str(path), check_existing=False, compress=True)
    bpy.ops.file.make_paths_relative()
    if scene.render.filepath:
        scene.render.filepath = bpy.path.relpath(scene.render.filepath)
    bpy.ops.wm.save_mainfile(compress=True)


def film(edit, output: Path) -> None:
    """Renders the edit to a movie or a folder, each file whole or not at all: Blender writes into a folder beside
    the output, and what is finished moves out of it."""
    folder = output.parent if edits.is_movie(output) else output
    folder.mkdir(parents=True, exist_ok=True)
    part = Path(tempfile.mkdtemp(prefix=".part-", dir=folder))
    final, edit.render.filepath = edit.render.filepath, str(part / output.name if edits.is_movie(output) else part)
    if not edits.is_movie(output):
        edit.render.filepath += os.sep
    count = edit.frame_end - edit.frame_start + 1

    def clean_up():
        shutil.rmtree(part, ignore_errors=True)

    try:
        with (
            _leaving(clean_up),
            tqdm(total=count, unit="frame", disable=None) as bar,
            _frames_written(bar, part, folder),
        ):
            bpy.ops.render.render(animation=True, scene=edit.name)
    except RuntimeError as error:
        raise edits.OutputError(str(error).removeprefix("Error: ").strip()) from None
    finally:
        edit.render.filepath = final
        clean_up()


@contextmanager
def _leaving(clean_up):
    """Whatever ends the process inside Blender's render cleans up: an engine without a picture, Ctrl-C, a farm's TERM.

    Python raises nothing through Blender: it would print the exception and go on."""
    stops = {signal.SIGINT: None, signal.SIGTERM: None}
    for number in stops:
        stops[number] = signal.signal(number, lambda *_: engine.leave(INTERRUPTED))
    engine.before_leaving.append(clean_up)
    try:
        yield
    finally:
        engine.before_leaving.remove(clean_up)
        for number, before in stops.items():
            signal.signal(number, before)


@contextmanager
def _frames_written(bar, part: Path, folder: Path):
    """Moves each finished picture from `part` to `folder`, and the progress bar on."""

    def moved(*_):
        bar.update()
        for path in part.iterdir():
            if path.suffix.lower() not in edits.MOVIES:
                path.replace(folder / path.name)

    bpy.app.handlers.render_write.append(moved)
    try:
        yield
        for path in part.iterdir():
            path.replace(folder / path.name)
    finally:
        bpy.app.handlers.render_write.remove(moved)
