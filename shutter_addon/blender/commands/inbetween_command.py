"""The command `inbetween`: a source's in-between frames alone, or all that a saved edit needs."""

from __future__ import annotations

import argparse
from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from bpy.types import Scene

from ...core.frames.frame_source import FrameSource
from ...media import inbetween
from ..data import inbetween_settings, requirements, snapshot, source_media
from ..editing import new_edit, saved_edit
from ..output import film_output
from ..rendering import job_snapshots, render_settings, sessions
from . import command_line
from .command_line import place


def add(commands: argparse._SubParsersAction) -> None:
    parser = commands.add_parser("inbetween", help="build a source's in-between frames, or those that an edit needs")
    option = parser.add_argument
    option("source", type=place, help="a movie, the first file of an image sequence, or a saved edit (.blend)")
    option("--factor", type=int, choices=command_line.FACTORS[1:], help="how many times the source's rate")
    option("--method", choices=command_line.METHODS, help="of optical flow (default: quick)")
    option(
        "--frames",
        metavar="A:B",
        help="source frames A to B, and up to the one behind; 1 is the first; of an edit: its timeline frames",
    )
    option("--cache", type=place, metavar="DIR", help="where in-between frames shall lie")
    parser.set_defaults(run=run)


def run(arguments: Namespace) -> None:
    if saved_edit.is_saved(arguments.source):
        _build_edit(arguments)
    else:
        _build_source(arguments)


def _build_edit(arguments: Namespace) -> None:
    command_line.refuse(arguments, ("factor", "method", "cache"), "is for a source; a saved edit says it itself")
    edit = command_line.open_edit(arguments.source, arguments.frames)
    edit.scene.frame_start, edit.scene.frame_end = edit.frames[0], edit.frames[-1]
    build_lacking(edit.scene)


def _build_source(arguments: Namespace) -> None:
    for name in ("factor", "cache"):
        if getattr(arguments, name) is None:
            raise film_output.OutputError(f"--{name} is missing: only a saved edit (.blend) says it itself")
    path = arguments.source
    with command_line.opened(path) as medium:
        frames = command_line.frames(arguments.frames, range(1, medium.count + 1))
        strip = new_edit.make_source(path, medium)
    # A strip may read the file in another way, with a colour space of Blender's own choice.
    with source_media.open_media(strip) as medium:
        pairs = range(frames[0] - 1, min(frames[-1], medium.count - 1))
        _build(medium, arguments.cache, arguments.factor, arguments.method or "quick", pairs)


def build_lacking(film: Scene) -> None:
    """Builds the in-between frames that a film's frames need, of all effects that it shows, where they are looked
    for."""
    film.frame_set(film.frame_start)
    for scene, effect, parts in job_snapshots.shown_effects(film):
        shown = [strip for strip in parts if requirements.shown_frames(scene, strip)]
        if not shown or inbetween_settings.factor(effect) == 1:
            continue
        frames = job_snapshots.asked_frames(scene, shown, scene == film)
        if scene == film:
            frames = {frame for frame in frames if film.frame_start - 1 < frame <= film.frame_end}
        needing = snapshot.take(scene, effect, shown[0], frames, folder=render_settings.settings().inbetween)
        assert needing.inbetween is not None  # by its factor
        with needing.source.open() as medium:
            _build(medium, *needing.inbetween, pairs=sorted(needed_pairs(needing)))


def needed_pairs(shown: snapshot.Snapshot) -> set[int]:
    """The pairs of neighbouring source frames whose in-betweens are needed to show an effect strip at the snapshot's
    frames, each by its first. It reads what it must to find cuts. One of FAULTS: they cannot be shown."""
    context = sessions.of_render()
    pairs: set[int] = set()
    for frame in sorted(shown.frames):
        request = context.request(shown, frame)
        renderer = context.renderer(request)
        source: Any = renderer.source
        needed = renderer.needed(request, known=False)
        pairs |= {index // source.step for index in needed if index % source.step}
        source.release()  # what it read is not shown here
    return pairs


def _build(medium: FrameSource, folder: Path, factor: int, method: str, pairs: Sequence[int]) -> None:
    """Builds the in-betweens of these pairs of source frames, each given by its first, in ascending order."""
    with film_output.stoppable() as stopped, film_output.progress(len(pairs), "pair") as moved:
        told: dict = {"update": lambda *_: moved(), "cancelled": lambda: bool(stopped)}
        inbetween.build(medium, folder, factor, method, **told, pairs=pairs)
    if stopped:
        raise film_output.InterruptedRenderError(f"{folder}: stopped; what is finished stays")
