"""Render frames of a saved edit into a folder that several machines share, so that each frame is rendered once."""

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
_PAUSE = 1.0  # seconds between checks of what others have finished


def check(folder: Path, file_format: str | None, frames: range, read: list[Path]) -> None:
    """Check that an edit's frames can be rendered to a folder.

    Args:
        file_format: The option --format; None: not given, which means PNG.
        frames: Timeline frames to render.
        read: Files that must not be overwritten.

    Raises:
        OutputError: The frames cannot be rendered there.
    """
    if film_output.is_movie(folder):
        raise film_output.OutputError(f"{folder}: a saved edit is rendered to a folder of pictures, not to a movie")
    film_output.check_folder(folder, file_format)
    film_output.blender_path(str(folder))
    film_output.refuse_overwriting(film_output.pictures_of(folder, file_format or "png", frames), read)


def check_resumable(scene: Scene) -> None:
    """Check that the edit's pictures can carry a note of its version, by which --resume recognizes finished ones.

    Raises:
        OutputError: The edit burns metadata into its pictures, so that they carry no version.
    """
    if scene.render.use_stamp:
        why = "the edit burns metadata into its pictures, so that they carry no version; turn Burn Into Image off"
        raise film_output.OutputError(f"--resume: {why}")


def render(scene: Scene, folder: Path, file_format: str, version: EditVersion, *, resume: bool) -> None:
    """Render all frames of an edit to pictures that carry the key of the edit's version.

    Args:
        scene: The edit's scene, whose frame range is rendered.
        file_format: A key of film_output.FORMATS.
        version: The edit's version.
        resume: Skip finished frames, and wait for frames that other processes render, until these finish or give up.

    Raises:
        OutputError, InterruptedRenderError: As in film_output.render_made_edit, or another version is rendered there.
        OSError: The folder cannot be written to.
    """
    if resume:
        check_resumable(scene)
    film_output.set_pictures(scene, file_format, job_file.note(version.key))
    film_output.make_folder(folder)
    frames = range(scene.frame_start, scene.frame_end + 1)
    pictures = dict(zip(frames, film_output.pictures_of(folder, file_format, frames), strict=True))

    def move(part: Path, picture: Path) -> None:
        job_file.guard(folder, version)  # again, as the job may have changed
        part.replace(picture)

    with film_output.progress(len(pictures), "frame") as moved:
        write = partial(film_output.render_frames, scene, folder, moved, move)
        if resume:
            _resume(scene, folder, pictures, version.key, write, moved)
        else:
            write()


def _resume(scene: Scene, folder: Path, missing: dict[int, Path], key: str, write: Callable, moved: Callable) -> None:
    waits = False
    with Claims(folder) as claims, film_output.stoppable() as stopped:
        while missing:
            if stopped:
                raise film_output.InterruptedRenderError(f"{folder}: stopped")
            if run := _claim_run(claims, missing, key, moved):
                scene.frame_start, scene.frame_end = min(run), max(run)
                try:
                    write()
                finally:
                    for frame in run:
                        claims.release(_name(missing.pop(frame)))
            elif missing:
                if not waits:
                    awaited = frame_ranges.in_words(list(missing))
                    words = f"{folder}: waiting for {awaited}, which other workers have claimed"
                    render_job.say(words)
                waits = True
                time.sleep(_PAUSE)


def _claim_run(claims: Claims, missing: dict[int, Path], key: str, moved: Callable) -> list[int]:
    """Claim up to RUN successive missing frames, so that no other process renders them.

    Frames that have been finished meanwhile are removed from `missing`.

    Args:
        missing: Path of each picture not known to be finished, by frame. Changed in place.
        key: Key of the edit's version, which finished pictures carry.
        moved: Called for each frame that is removed from `missing`.

    Returns:
        The claimed frames; empty if all missing frames are claimed by others or are finished.
    """
    run: list[int] = []
    for frame, picture in list(missing.items()):
        if len(run) == RUN or (run and frame - 1 != run[-1]):
            break
        if rendered_pictures.read(picture, key) is not None:
            del missing[frame]
            moved()
        elif claims.take(_name(picture)):
            if rendered_pictures.read(picture, key) is None:  # nobody has rendered it since the last look
                run.append(frame)
                continue
            claims.release(_name(picture))
        if run:
            break
    return run


def _name(picture: Path) -> str:
    """Return the name under which processes claim a picture, such as 0001_png for 0001.png."""
    return f"{picture.stem}_{picture.suffix[1:]}"
