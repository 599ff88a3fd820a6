"""Check whether an edit can be rendered on this machine, without rendering it."""

import math
from collections.abc import Iterator
from pathlib import Path

from bpy.types import PropertyGroup, Scene, Strip

from ...compute.request import Request
from ...core.frames import frame_ranges
from ...core.frames.frame_source import FrameSource
from ...core.model.mattes import FileFrame
from ...media.files import check_file
from ..data import requirements, snapshot, source_media, strips
from ..rendering import effect_source, job_snapshots, pictures
from ..rendering.session import RenderContext, RenderSession
from .film_output import OutputError


def effects(scene: Scene, frames: range) -> tuple[list[str], list[str], set[Path]]:
    """Check all effects that some frames of a film show, also in scenes inside its scene, each up to its first fault.

    Open the footage and mattes, and read the first and last frames that are needed of each.

    Returns:
        Three values: faults, sentences about why the edit cannot be rendered; notes about what may look unexpected; and
        the folders to which the render will write mattes.
    """
    faults, notes, folders = list[str](), list[str](), set[Path]()
    # No GPU is needed, which would have to wait for its first picture, since only states and windows are read.
    session = RenderSession(lambda: ("cpu", None), lambda: None)
    try:
        for owner, effect, strip, shown in _shown_effects(scene, frames):
            try:
                _check_footage(owner, effect, strip)
                said = _notes(session, folders, snapshot.take(owner, effect, strip, shown))
                notes += [f'"{strip.name}": {note}' for note in said]
            except (OutputError, *effect_source.FAULTS) as error:
                faults.append(f'"{strip.name}": {error}')
    finally:
        session.forget()
    reasons = [why for at, why in requirements.left_out(scene) if frame_ranges.common(at, frames)]
    return [*faults, *dict.fromkeys(reasons)], notes, folders


def _shown_effects(film: Scene, frames: range) -> Iterator[tuple]:
    """Yield the effects that some of a film's frames show; in scenes inside its scene, those shown at any frame.

    Yields:
        Scene, effect, its first effect strip, and the timeline frames of that scene at which the effect is shown.
    """
    wanted = requirements.shown_scenes(film, frames)
    for scene, effect, parts in job_snapshots.shown_effects(film):
        shown: set[float] = set()
        for part in parts if scene in wanted else ():
            start = strips.timeline_frame(part, 0)  # a strip can begin between frames
            at = frame_ranges.common(requirements.shown_frames(scene, part), wanted[scene])
            shown |= {start + math.floor(frame - start) for frame in at}
        if shown:
            yield scene, effect, parts[0], shown


def _notes(session: RenderSession, folders: set[Path], taken: snapshot.Snapshot) -> list[str]:
    """Check the footage and mattes of one effect at the frames of its snapshot, and return notes for the user.

    Args:
        folders: A set to which the folders of mattes that the render has to track are added.
        taken: The effect's snapshot, at the frames to check.

    Raises:
        effect_source.FAULTS: The first fault that is found.
    """
    context = RenderContext(session)
    requests = [context.request(taken, frame) for frame in sorted(taken.frames)]
    renderer = session.renderer(requests[0].source)
    # All files of image sequences that windows need, and the first and last frame of a movie.
    step, needed = renderer.source.step, set[int]().union(*map(renderer.missing, requests))
    _check_readable(renderer.source, {end for index in needed for end in (index // step, -(-index // step))}, step)
    lacking = _lacking_mattes(renderer.source, requests, folders)
    notes = list(dict.fromkeys(note for request in requests for note in pictures.unread(taken, request)))
    if renderer.source.by_blender:
        notes.append(pictures.SLOW_DECODING)
    if lacking:
        notes.append(f"{lacking} mattes of outlines are not tracked yet: the first render does that")
    return notes


def _check_footage(scene: Scene, effect: PropertyGroup, strip: Strip) -> None:
    """Check that an effect's footage exists, and has the size and at least the length that the saved edit expects.

    The size is that of the effect scene. The length is that of the source strip, and not checked if it is retimed.

    Raises:
        UserError: The footage is missing, or has changed.
    """
    source = strips.source_of(scene, effect, strip)
    with source_media.spec(source).open() as medium:
        size = medium.width, medium.height
        saved = effect.scene.render.resolution_x, effect.scene.render.resolution_y
        if saved != size:
            words = "{}×{}, but was {}×{} when the edit was saved".format(*size, *saved)
            raise OutputError(f"{medium.path.name}: is {words}")
        timing = source_media.timing_of(source)
        rate = min(float(medium.fps or math.inf) / timing.scene_fps, 1.0)  # the strip can keep the movie's speed
        if not timing.keys and medium.count < int(source.content_duration * rate):
            words = f"{medium.count} frames, fewer than the {source.content_duration} of strip"
            raise OutputError(f'{medium.path.name}: has {words} "{source.name}"')


def _check_readable(source: FrameSource, indices: set[int], step: int = 1) -> None:
    """Check that the files of some frames exist (for image sequences), and that the first and the last can be decoded.

    Args:
        source: What frames are read from.
        indices: Numbers of filmed frames, from 0.
        step: `source` numbers frames computed between filmed ones, too: filmed frame i is its frame i · step.

    Raises:
        MediaError: A file is missing, or a frame cannot be decoded.
    """
    files = source.files
    for path in sorted({files[index] for index in indices}) if len(files) > 1 else ():
        check_file(path)
    for index in {min(indices), max(indices)} if indices else ():
        source.read(index * step)


def _lacking_mattes(source: FrameSource, requests: list[Request], folders: set[Path]) -> int:
    """Check that matte files can be read at the frames of some pictures, and count tracked mattes that are missing.

    Args:
        source: The effect's footage.
        requests: The pictures.
        folders: A set to which the folders are added where missing tracked mattes will be stored.

    Returns:
        The number of mattes of outlines (one for each outline and frame) that the render will have to track.

    Raises:
        MediaError: A matte cannot be read.
    """
    shown: dict = {}
    lacking = 0
    for request in requests:
        layers = request.state.layers
        of_layers = layers.mattes[request.index - layers.first] if layers else ()
        for matte in (*request.state.mattes, *filter(None, of_layers)):
            if isinstance(matte.content, FileFrame):
                shown.setdefault(matte.content.file, set()).add((matte.content, request.index // source.step))
    for file, contents in shown.items():
        with file.open() as medium:
            indices = {content.index(medium, index) for content, index in contents}
            indices = {min(max(index, 0), medium.count - 1) for index in indices}
            if not hasattr(medium, "straight"):  # it is not tracked
                _check_readable(medium, indices)
            elif missing := sum(not medium.has(index) for index in indices):
                lacking += missing
                folders.add(file.folder)
    return lacking
