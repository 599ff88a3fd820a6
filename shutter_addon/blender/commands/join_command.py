"""The command `join`: rendered frames, and the sound of their edit, as a movie."""

from ...core.farm import job_file
from ...media.files import stamp
from ..data import missing_media, versions
from ..editing import saved_edit
from ..output import film_join, film_output
from . import command_line
from .command_line import place


def add(commands) -> None:
    parser = commands.add_parser("join", help="make a movie of rendered frames, with the edit's sound and settings")
    option = parser.add_argument
    option("folder", metavar="FRAMES", type=place, help="the folder of the frames")
    option("--edit", type=place, required=True, metavar="FILE.blend", help="what they were rendered from")
    option("--output", type=place, required=True, help=f"a movie ({', '.join(film_output.MOVIES)})")
    option("--frames", metavar="A:B", help="timeline frames A to B (default: all of the edit)")
    parser.set_defaults(run=run)


def run(arguments) -> None:
    opened = stamp(arguments.edit)
    scene = saved_edit.open_edit(arguments.edit)
    whole = scene.frame_start, scene.frame_end
    frames = command_line.frames(arguments.frames, whole, "edit")
    film_join.check(arguments.output, [arguments.edit, *versions.read_files(scene), *versions.sounds()])
    for fault in missing_media.sound_faults(scene, range(frames[0], frames[1] + 1)):
        raise film_output.OutputError(fault)  # Blender would make a silent film
    film_join.say_what_is_left_out(arguments.folder, whole)
    version = saved_edit.version(scene, arguments.edit, opened)
    job_file.guard(arguments.folder, version)
    film_join.join(scene, arguments.folder, arguments.output, frames, version.key)
