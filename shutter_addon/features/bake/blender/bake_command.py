"""The command `bake`: render one effect of a saved edit to a film, which an ordinary strip can show."""

import itertools
import os
from argparse import SUPPRESS, ArgumentParser, Namespace
from contextlib import suppress

from bpy.types import PropertyGroup, Scene, Strip

from ....blender.commands import command_line
from ....blender.data import strips
from ....blender.output import film_output
from ....core.messages import sentence
from . import baked_film

HELP = "render one effect of a saved edit, for a strip to show"


def add(parser: ArgumentParser) -> None:
    option, to_path = parser.add_argument, command_line.to_path
    option("source", type=to_path, help="a saved edit (.blend)")
    option("--strip", required=True, metavar="NAME", help="its effect strip")
    option("--scene", metavar="NAME", help="the strip's scene (default: the active one)")
    option("--format", choices=tuple(baked_film.KINDS), default="movie", help="H.264, or float EXR (default: movie)")
    option("--output", type=to_path, metavar="DIR", help="folder of the film (default: beside the edit)")
    command_line.add_device(parser)
    option("--attached", action="store_true", help=SUPPRESS)  # to the Blender whose copy of an edit it reads


def run(arguments: Namespace) -> None:
    scene, _frames = command_line.open_edit(arguments.source, name=arguments.scene)
    scene.frame_set(scene.frame_current)  # evaluates drivers and keys
    if arguments.attached:
        arguments.source.unlink(missing_ok=True)
        os.set_blocking(0, False)
    effect, strip = _effect_strip(scene, arguments.strip)
    film = baked_film.film_of(scene, effect, strip, baked_film.KINDS[arguments.format], arguments.output)
    if arguments.attached:
        _check_parent(film)
    total, numbers = len(film.frames), itertools.count(1)
    with film_output.progress(total, "frame") as moved:

        def frame_done() -> None:
            moved()
            command_line.print_line(f"{next(numbers)} of {total}")
            if arguments.attached:
                _check_parent(film)

        baked_film.render(scene, effect, strip, film, frame_done)
    command_line.print_line(str(film.place))


def _check_parent(film: baked_film.Film) -> None:
    """Check that the Blender that started this process still runs: if it ends, our standard input is closed.

    Args:
        film: The film being baked, for the message.

    Raises:
        InterruptedRenderError: That Blender has ended, so the bake has to end as well.
    """
    with suppress(OSError):  # nothing to read: it is still there
        if not os.read(0, 1):
            raise film_output.InterruptedRenderError(f"{film.place}: stopped")


def _effect_strip(scene: Scene, name: str) -> tuple[PropertyGroup, Strip]:
    """Find the effect strip with a name, and return its effect and the strip.

    Raises:
        OutputError: The scene has no strip with this name that shows an effect.
    """
    for strip in strips.effect_strips(scene):
        if strip.name == name and (effect := strips.effect_of(scene, strip.scene)) is not None:
            return effect, strip
    raise film_output.OutputError(f'--strip: there is no Shutter strip "{sentence(name, 40)}"')
