"""The command `check`: find out, without rendering, whether a saved edit can be rendered on this machine.

It prints what it found on stdout and each fault on stderr. With faults, the exit code is 2.
"""

import re
import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path

import bpy
from bpy.types import Scene

from ...compute.devices.device import NoDeviceError
from ...core.farm import job_file
from ..data import external_files, versions
from ..devices import available
from ..output import edit_check, error_report, film_output, shared_frames
from ..rendering import render_job, render_settings
from . import command_line

HELP = "find out whether an edit can be rendered here"


def add(parser: ArgumentParser) -> None:
    option, to_path = parser.add_argument, command_line.to_path
    option("edit", metavar="FILE.blend", type=to_path, help="a saved edit")
    option("--frames", metavar="A:B", help="timeline frames A to B (default: all of the edit)")
    option("--output", type=to_path, metavar="DIR", help="folder for the frames; it gets the job's file")
    option("--format", choices=tuple(film_output.FORMATS), help="of the frames (default: png)")
    option("--resume", action="store_true", help="the frames will be rendered with --resume")
    movies = ", ".join(film_output.MOVIES)
    option("--movie", type=to_path, metavar="FILE", help=f"the movie that the frames will be joined to ({movies})")
    command_line.add_device(parser)
    option("--report", action="store_true", help="print a report for a bug report, without names")


def run(arguments: Namespace) -> None:
    scene, frames = command_line.open_edit(arguments.edit, arguments.frames)
    version = versions.of_edit(scene)
    device, notes, faults = _checked(arguments, scene, frames)
    if arguments.output and not faults:
        faults += external_files.raised(film_output.make_folder, arguments.output)
        faults += external_files.raised(job_file.write, arguments.output, version)
    lines = [
        f"Edit: {arguments.edit}, version {version.key}",
        "Frames: {} to {}, {}×{}".format(frames[0], frames[-1], *film_output.size(scene)),
        f"Device: {device}",
        *[f"Note: {note}" for note in notes],
    ]
    command_line.print_line(error_report.text(scene) if arguments.report else "\n".join(lines))
    for fault in faults:
        render_job.say(fault)
    if faults:
        sys.exit(2)


def _checked(arguments: Namespace, scene: Scene, frames: range) -> tuple[str, list[str], list[str]]:
    """Choose the render device, and look for what would make a render of these frames fail.

    Args:
        arguments: The parsed options of `check`.
        scene: The scene of the opened edit.
        frames: The timeline frames to render.

    Returns:
        Three results: the device's name ("none" if there is none), the notes, and the faults. Notes and faults are
        sentences for the user. Only faults prevent a render.
    """
    faults = [*_version_faults(scene), *_setting_faults(arguments, scene, frames)]
    device, lesser = "none", None
    try:
        kind, lesser = available.choose(render_settings.wanted())
        device = available.name(kind)
    except NoDeviceError as error:
        faults.append(str(error))
    found, notes, folders = edit_check.effects(scene, frames)
    faults += found
    faults += external_files.faults(scene, frames, sources=False)  # the effects' own faults are already there
    faults += external_files.sound_faults(scene, frames)
    movie = arguments.movie and arguments.movie.parent
    for folder in filter(None, dict.fromkeys((arguments.output, movie, *folders))):
        faults += external_files.raised(film_output.check_writable, folder)
    return device, [note for note in (lesser, *notes) if note], faults


def _version_faults(scene: Scene) -> list[str]:
    """Return a sentence for each newer version, of the extension or of Blender, that saved the edit."""
    faults, saved, here = [], scene.virtual_shutter.version, versions.extension()
    if _numbers(saved) > _numbers(here):
        faults.append(f"the edit was saved by version {saved} of the extension, this machine has {here}")
    if bpy.data.version > bpy.app.version_file:
        by = ".".join(map(str, bpy.data.version[:2]))  # the file's third number differs from a release's
        faults.append(f"the edit was saved by Blender {by}, this machine has {bpy.app.version_string}")
    return faults


def _numbers(version: str) -> list[int]:
    return [int(number) for number in re.findall(r"\d+", version)]


def _setting_faults(arguments: Namespace, scene: Scene, frames: range) -> list[str]:
    """Return why the frames, or the movie that they will be joined to, cannot be written where the options say."""
    read = [arguments.edit, *versions.read_files(scene)]
    faults = external_files.raised(shared_frames.check_resumable, scene) if arguments.resume else []
    if arguments.output:
        faults += external_files.raised(shared_frames.check, arguments.output, arguments.format, frames, read)
    if arguments.movie:
        faults += external_files.raised(film_output.check_movie, arguments.movie, read)
    is_movie = arguments.movie or scene.render.image_settings.media_type == "VIDEO"
    film = arguments.movie or Path("film.mp4" if is_movie else "frames")
    return faults or external_files.raised(film_output.check, film, None, film_output.size(scene))
