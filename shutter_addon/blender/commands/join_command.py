"""The command `join`: rendered frames, and the sound of their edit, as a movie."""

from ...core.farm import job_file
from ..data import missing_media, versions
from ..editing import saved_edit
from ..output import film_join, film_output
from . import command_line


def add(commands) -> None:
    parser = commands.add_parser("join", help="make a movie of rendered frames, with the edit's sound and settings")
    parser.add_argument("folder", metavar="FRAMES", type=command_line.place, help="the folder of the frames")
    parser.add_argument(
        "--edit", type=command_line.place, required=True, metavar="FILE.blend", help="what they were rendered from"
    )
    parser.add_argument(
        "--output", type=command_line.place, required=True, help=f"a movie ({', '.join(film_output.MOVIES)})"
    )
    parser.add_argument("--frames", metavar="A:B", help="timeline frames A to B (default: all of the edit)")
    parser.set_defaults(run=run)


def run(arguments) -> None:
    opened = versions.stamp(arguments.edit)
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
