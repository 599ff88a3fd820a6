"""The command `check`: whether an edit can be rendered on this machine."""

from __future__ import annotations

import argparse
import json
import re
import sys
from argparse import Namespace
from collections.abc import Callable, Iterator
from pathlib import Path

import bpy
from bpy.types import Scene

from ...core.farm import job_file
from ...core.farm.job_file import EditVersion
from ...core.messages import UserError
from ...devices.device import NoDeviceError
from ..data import external_files, versions
from ..devices import available
from ..output import edit_check, error_report, film_join, film_output, shared_frames
from ..output.edit_check import EffectCheck
from ..rendering import render_job, render_settings
from . import command_line
from .command_line import to_path

_OF_EFFECT = "strip", "source", "size", "window", "shutters", "inbetween"  # reported fields of an EffectCheck


def add(commands: argparse._SubParsersAction) -> None:
    parser = commands.add_parser("check", help="find out whether an edit can be rendered here")
    option = parser.add_argument
    option("edit", metavar="FILE.blend", type=to_path, help="a saved edit")
    option("--frames", metavar="A:B", help="timeline frames A to B (default: all of the edit)")
    option("--output", type=to_path, metavar="DIR", help="folder for the frames; it gets the job's file")
    option("--format", choices=tuple(film_output.FORMATS), help="of the frames (default: png)")
    option("--resume", action="store_true", help="the frames will be rendered with --resume")
    movies = ", ".join(film_output.MOVIES)
    option("--movie", type=to_path, metavar="FILE", help=f"the movie that the frames will be joined to ({movies})")
    command_line.add_device(parser)
    printed = parser.add_mutually_exclusive_group()
    printed.add_argument("--json", action="store_true", help="print one JSON object")
    printed.add_argument("--report", action="store_true", help="print a report for a bug report, without names")
    parser.set_defaults(run=run)


def run(arguments: Namespace) -> None:
    edit = command_line.open_edit(arguments.edit, arguments.frames)
    scene = edit.scene
    with command_line.using_device(arguments):
        report = _report(arguments, scene, edit.frames, edit.version())
        if arguments.report:
            command_line.print_line(error_report.text(scene))
        elif arguments.json:
            command_line.print_line(json.dumps(report, indent=1))
        else:
            command_line.print_line("\n".join(_lines(report)))
    for fault in report["faults"]:
        render_job.say(fault)
    if report["faults"]:
        sys.exit(2)


def _report(arguments: Namespace, scene: Scene, frames: range, version: EditVersion) -> dict:
    """Return the result as JSON data (docs/command.md)."""
    faults = [*_version_faults(scene), *_setting_faults(arguments, scene, frames)]
    notes: list[str] = []
    device: str | None = None
    checks: list[EffectCheck] = []
    try:
        kind, lesser = available.choose(render_settings.wanted())
    except NoDeviceError as error:
        faults.append(str(error))
    else:
        notes += [lesser] if lesser else []
        device, checks = available.name(kind), edit_check.effects(scene, frames)
    for check in checks:
        faults += [f'"{check.strip}": {fault}' for fault in check.faults]
        notes += [f'"{check.strip}": {note}' for note in check.notes]
    faults += edit_check.left_out(scene, frames)
    notes += edit_check.stale_films(scene, frames)
    faults += external_files.faults(scene, frames, sources=False)  # the effects' own faults are already there
    faults += external_files.sound_faults(scene, frames)
    for folder in dict.fromkeys(_written_folders(arguments, checks)):
        faults += _fault(film_output.check_writable, folder)
    report = {
        "edit": str(arguments.edit),
        "key": version.key,
        "frames": [frames[0], frames[-1]],
        "size": list(film_output.size(scene)),
        "extension": {"here": version.extension, "saved": scene.virtual_shutter.version or None},
        "blender": {"here": version.blender, "saved": _file_version()},
        "device": device,
        "effects": [{name: getattr(check, name) for name in _OF_EFFECT} for check in checks],
        "notes": notes,
        "faults": faults,
    }
    if arguments.movie and film_output.is_movie(arguments.movie):  # last: it changes the scene
        faults += _fault(film_join.rehearse, scene, arguments.movie, arguments.format or "png", frames)
    if arguments.output and not faults:
        faults += _fault(film_output.make_folder, arguments.output) or _fault(job_file.write, arguments.output, version)
    return report


def _version_faults(scene: Scene) -> list[str]:
    """Check whether a newer version saved the file."""
    faults, saved, here = [], scene.virtual_shutter.version, versions.extension()
    if _numbers(saved) > _numbers(here):
        faults.append(f"the edit was saved by version {saved} of the extension, this machine has {here}")
    if bpy.data.version > bpy.app.version_file:
        faults.append(f"the edit was saved by Blender {_file_version()}, this machine has {bpy.app.version_string}")
    return faults


def _file_version() -> str:
    """Return the version of Blender that saved the edit. (The file's third number differs from a release's.)"""
    return ".".join(map(str, bpy.data.version[:2]))


def _numbers(version: str) -> list[int]:
    return [int(number) for number in re.findall(r"\d+", version)]


def _setting_faults(arguments: Namespace, scene: Scene, frames: range) -> list[str]:
    """Check whether the outputs can be written where they are wanted."""
    read = [arguments.edit, *versions.read_files(scene)]
    faults = _fault(shared_frames.check_resumable, scene) if arguments.resume else []
    if arguments.output:
        faults += _fault(shared_frames.check, arguments.output, arguments.format, frames, read)
    if arguments.movie:
        return faults + _fault(film_join.check, arguments.movie, [*read, *versions.sounds()])
    is_movie = scene.render.image_settings.media_type == "VIDEO"
    return faults + _fault(film_output.check, Path("film.mp4" if is_movie else "frames"), None, film_output.size(scene))


def _fault(check: Callable, *arguments) -> list[str]:
    """Return the message of the error that a check raises, if it does."""
    try:
        check(*arguments)
    except film_output.InterruptedRenderError:
        raise
    except (UserError, OSError) as error:
        return [film_output.in_words(error, arguments[0])]
    return []


def _written_folders(arguments: Namespace, checks: list[EffectCheck]) -> Iterator[Path]:
    """Yield the folders that the job will write to."""
    if arguments.output:
        yield arguments.output
    if arguments.movie:
        yield arguments.movie.parent
    for check in checks:
        yield from (folder for folder, count in check.mattes.items() if count)


def _lines(report: dict) -> list[str]:
    """Return the result as lines of text."""
    lines = [
        f"Edit: {report['edit']}, version {report['key']}",
        "Frames: {} to {}, {}×{}".format(*report["frames"], *report["size"]),
        _saved_by("Virtual Shutter", report["extension"]),
        _saved_by("Blender", report["blender"]),
    ]
    for effect in report["effects"]:
        words = "{}, {}×{}, exposures of {} frames, {} shutters".format(
            effect["source"] or "no footage", *effect["size"], effect["window"], effect["shutters"]
        )
        if effect["inbetween"] > 1:
            words += f", {effect['inbetween']} moments each"
        lines.append(f"Effect {effect['strip']}: {words}")
    lines.append(f"Device: {report['device'] or 'none'}")
    return lines + [f"Note: {note}" for note in report["notes"]]


def _saved_by(name: str, version: dict) -> str:
    saved = f"was saved by {version['saved']}" if version["saved"] else "does not name the version that saved it"
    return f"{name}: {version['here']}, the edit {saved}"
