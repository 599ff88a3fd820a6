"""Rendering frames of a saved edit into a folder that several machines share, each frame once."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

from bpy.types import Scene

from ...core.farm import job_file
from ...core.farm.claims import Claims
from ...core.farm.job_file import EditVersion
from ...core.frames import frame_ranges
from ...media import rendered_pictures
from ..rendering import render_job
from . import film_output

RUN = 8  # frames per claim of a machine
Stamps = dict[Path, tuple | None]  # rendered_pictures.stamp of pictures
_PAUSE = 1.0  # seconds between checks of what others have finished


def check(folder: Path, file_format: str | None, frames: range, read: list[Path]) -> None:
    """Raise OutputError if an edit's frames cannot be rendered there.

    Args:
        file_format: None for PNG, if the folder cannot be mistaken for a file.
        read: Files that must not be overwritten.
    """
    if film_output.is_movie(folder):
        words = "a saved edit is rendered to a folder of pictures, not to a movie"
        raise film_output.OutputError(f"{folder}: {words}")
    film_output.check_folder(folder, file_format)
    film_output.blender_path(str(folder))
    film_output.refuse_overwriting(film_output.pictures_of(folder, file_format or "png", frames), read)


def check_resumable(scene: Scene) -> None:
    """Raise OutputError if pictures cannot carry the edit's version."""
    if scene.render.use_stamp:
        words = "the edit burns metadata into its pictures, so that they carry no version; turn Burn Into Image off"
        raise film_output.OutputError(f"--resume: {words}")


def render(scene: Scene, folder: Path, file_format: str, version: EditVersion, *, resume: bool) -> None:
    """Render all frames of the edit to pictures that carry the key of its version.

    Args:
        resume: Skip finished frames, and wait for frames that other processes render, until these finish or give up.

    Raises:
        OutputError, InterruptedRenderError: See film_output.render_made_edit, or the folder's job has changed.
        OSError: The folder cannot be written to.
    """
    if resume:
        check_resumable(scene)
    film_output.set_pictures(scene, file_format, job_file.note(version.key))
    film_output.make_folder(folder)
    is_finished = partial(_is_finished, version.key, {})
    frames = range(scene.frame_start, scene.frame_end + 1)
    pictures = dict(zip(frames, film_output.pictures_of(folder, file_format, frames), strict=True))

    def move(part: Path, picture: Path) -> None:
        job_file.guard(folder, version)  # again, as the job may have changed
        part.replace(picture)

    with film_output.progress(len(pictures), "frame") as moved:
        write = partial(film_output.render_frames, scene, folder, moved, move)
        if resume:
            _render_missing(scene, folder, pictures, is_finished, write, moved)
        else:
            write()


def _render_missing(
    scene: Scene, folder: Path, pictures: dict[int, Path], is_finished: Callable, write: Callable, moved: Callable
) -> None:
    missing, waits = dict(pictures), False
    with Claims(folder) as claims, film_output.stoppable() as stopped:
        while True:
            for frame in [frame for frame, picture in missing.items() if is_finished(picture)]:
                del missing[frame]
                moved()
            if not missing:
                break
            if stopped:
                raise film_output.InterruptedRenderError(f"{folder}: stopped")
            if run := _claim_run(claims, missing, is_finished):
                scene.frame_start, scene.frame_end = min(run), max(run)
                try:
                    write()
                finally:
                    for picture in run.values():
                        claims.release(_name(picture))
                missing = {frame: picture for frame, picture in missing.items() if frame not in run}
            else:
                if not waits:
                    awaited = frame_ranges.in_words(list(missing))
                    words = f"{folder}: waiting for {awaited}, which other workers have claimed"
                    render_job.say(words)
                waits = True
                time.sleep(_PAUSE)


def _claim_run(claims: Claims, missing: dict[int, Path], is_finished: Callable) -> dict[int, Path]:
    """Claim the first missing frames without a gap. Return them; empty if others have claimed all."""
    run: dict[int, Path] = {}
    for frame, picture in missing.items():
        if len(run) == RUN or (run and frame - 1 not in run):
            break
        if claims.take(_name(picture)):
            if not is_finished(picture):  # since the last check
                run[frame] = picture
                continue
            claims.release(_name(picture))
        if run:
            break
    return run


def _name(picture: Path) -> str:
    """Return the name of a picture's claim."""
    return f"{picture.stem}_{picture.suffix[1:]}"


def _is_finished(key: str, rejected: Stamps, picture: Path) -> bool:
    """Return whether a picture is undamaged and of this version of the edit.

    Args:
        rejected: Stamps of pictures that were not, which are not read again; this function adds to them.
    """
    stamp = rendered_pictures.stamp(picture) if picture.is_file() else None  # opening a pipe would wait forever
    if stamp is None or rejected.get(picture) == stamp:
        return False
    if rendered_pictures.read(picture, key) is not None:
        return True
    rejected[picture] = stamp
    return False
