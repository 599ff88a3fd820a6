"""The command `join`: a movie of rendered frames, with the edit's sound."""

from argparse import ArgumentParser, Namespace

from ....blender.commands import command_line
from ....blender.data import external_files, versions
from ....blender.output import film_output
from ....core.farm import job_file
from . import film_join

HELP = "make a movie of rendered frames, with the edit's sound and settings"


def add(parser: ArgumentParser) -> None:
    option, to_path = parser.add_argument, command_line.to_path
    option("folder", metavar="FRAMES", type=to_path, help="the folder of the frames")
    option("--edit", type=to_path, required=True, metavar="FILE.blend", help="the edit that they were rendered from")
    option("--output", type=to_path, required=True, help=f"a movie ({', '.join(film_output.MOVIES)})")
    option("--frames", metavar="A:B", help="timeline frames A to B (default: all of the edit)")


def run(arguments: Namespace) -> None:
    scene, frames = command_line.open_edit(arguments.edit, arguments.frames)
    film_output.check_movie(arguments.output, [arguments.edit, *versions.read_files(scene)])
    for fault in external_files.sound_faults(scene, frames):
        raise film_output.OutputError(fault)  # Blender would make a silent film
    version = versions.of_edit(scene)
    job_file.guard(arguments.folder, version)
    film_join.join(scene, arguments.folder, arguments.output, frames, version.key)
