"""Checking whether an edit can be rendered on this machine, without rendering it."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path

from bpy.types import PropertyGroup, Scene, Strip

from ...compute.renderer import Renderer
from ...compute.request import Request
from ...core.frames import frame_ranges
from ...core.frames.frame_source import FrameSource
from ...core.messages import UserError
from ...core.model.mattes import FileFrame
from ...media import MediaError
from ...media.carried_mattes import CarriedMattes
from ...media.files import check_file
from ..data import requirements, snapshot, source_media, strips
from ..rendering import effect_source, job_snapshots, pictures
from ..rendering.session import RenderContext, RenderSession


@dataclass
class EffectCheck:
    """The check of an effect.

    Attributes:
        strip: Its name.
        mattes: The number of outlines' mattes that have to be carried first, by their folder.
        faults, notes: Messages. Notes are about effects that can be rendered, but not as one may expect.
    """

    strip: str
    mattes: dict[Path, int] = field(default_factory=dict)
    faults: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def effects(scene: Scene, frames: range) -> list[EffectCheck]:
    """Check the effects that the scene's frames show, including those of scenes in it.

    Files are opened, and the first and last frames that are needed are read.
    """
    # No GPU is needed, which would have to wait for its first picture, since only states and windows are read.
    session = RenderSession(lambda: ("cpu", None), lambda: None)
    try:
        return [_effect(session, shown) for shown in _shown_effects(scene, frames)]
    finally:
        session.forget()


def _shown_effects(film: Scene, frames: range) -> Iterator[tuple]:
    """Yield (scene, effect, strip, frames) of every effect that is shown at one of the film's frames."""
    wanted = dict(requirements.scenes_at(film, frames))
    for scene, effect, parts in job_snapshots.shown_effects(film):
        shown: set[float] = set()
        for part in parts if scene in wanted else ():
            start = strips.timeline_frame(part, 0)  # a strip can begin between frames
            at = frame_ranges.common(requirements.shown_frames(scene, part), wanted[scene])
            shown |= {start + math.floor(frame - start) for frame in at}
        if shown:
            yield scene, effect, parts[0], shown


def _effect(session: RenderSession, shown: tuple) -> EffectCheck:
    """Check an effect of `_shown_effects`."""
    scene, effect, strip, frames = shown
    check = EffectCheck(strip.name)
    if not _check_footage(check, scene, effect, strip):
        return check
    try:
        taken = snapshot.take(scene, effect, strip, frames)
        requests = _requests(session, taken, check)
    except effect_source.FAULTS as error:
        check.faults.append(str(error))
        return check
    if requests:
        renderer = session.renderer(next(iter(requests.values())).source)
        source = renderer.source
        _check_frames(check, renderer, requests)
        _check_mattes(check, source, requests)
        check.notes += {sentence: None for request in requests.values() for sentence in pictures.unread(taken, request)}
        if source.by_blender:
            check.notes.append(pictures.SLOW_DECODING)
        if lacking := sum(check.mattes.values()):
            check.notes.append(f"{lacking} mattes of outlines are not tracked yet: the first render does that")
    return check


def _requests(session: RenderSession, taken: snapshot.Snapshot, check: EffectCheck) -> dict[float, Request]:
    """Return the requests of frames that can be shown. A fault of several frames is noted at the first."""
    requests, context = {}, RenderContext(session)
    faults: dict[str, str] = {}
    for frame in sorted(taken.frames):
        try:
            requests[frame] = session.request(taken, frame, context)
        except effect_source.FAULTS as error:
            kind = re.sub(r"\bframe -?[\d.]+", "", str(error))
            faults.setdefault(kind, str(error))
    check.faults += faults.values()
    return requests


def _check_footage(check: EffectCheck, scene: Scene, effect: PropertyGroup, strip: Strip) -> bool:
    """Return whether the footage can be opened. Note if it has changed since the edit was saved.

    The effect's scene has the size of the footage then.
    """
    try:
        source = strips.source_of(scene, effect, strip)
        medium = source_media.open_media(source)
    except UserError as error:
        check.faults.append(str(error))
        return False
    medium.close()
    size = medium.width, medium.height
    saved = effect.scene.render.resolution_x, effect.scene.render.resolution_y
    if saved != size:
        words = "{}×{}, but was {}×{} when the edit was saved".format(*size, *saved)
        check.faults.append(f"{medium.path.name}: is {words}")
    timing = source_media.timing_of(source)
    rate = min(float(medium.fps or math.inf) / timing.scene_fps, 1.0)  # the strip can keep the movie's speed
    if not timing.keys and medium.count < int(source.content_duration * rate):
        words = f"{medium.count} frames, fewer than the {source.content_duration} of strip"
        check.faults.append(f'{medium.path.name}: has {words} "{source.name}"')
    return True


def _check_frames(check: EffectCheck, renderer: Renderer, requests: dict[float, Request]) -> None:
    """Check the files that windows need: all of image sequences, and the first and last frame of a movie."""
    step = renderer.source.step
    needed: set[int] = set().union(*map(renderer.missing, requests.values()))
    ends = {end for index in needed for end in (index // step, -(-index // step))}
    check.faults += _unreadable(renderer.source, ends, step)


def _unreadable(source: FrameSource, indices: set[int], step: int = 1) -> list[str]:
    """Return the faults of filmed frames: the first missing file, else ends that cannot be decoded."""
    files = source.files
    faults: list[str] = []
    try:
        for path in sorted({files[index] for index in indices}) if len(files) > 1 else ():
            check_file(path)
    except MediaError as error:
        return [str(error)]
    for index in dict.fromkeys((min(indices), max(indices))) if indices else ():
        try:
            source.read(index * step)
        except UserError as error:
            faults.append(str(error))
    return faults


def _check_mattes(check: EffectCheck, source: FrameSource, requests: dict[float, Request]) -> None:
    shown: dict = {}
    for request in requests.values():
        layers = request.state.layers
        of_layers = layers.mattes[request.index - layers.first] if layers else ()
        for matte in (*request.state.mattes, *filter(None, of_layers)):
            if isinstance(matte.content, FileFrame):
                shown.setdefault(matte.content.file, set()).add((matte.content, request.index // source.step))
    for file, contents in shown.items():
        try:
            with closing(file.open()) as medium:
                indices = {content.index(medium, index) for content, index in contents}
                indices = {min(max(index, 0), medium.count - 1) for index in indices}
                if isinstance(medium, CarriedMattes):
                    lacking = sum(not medium.has(index) for index in indices)
                    check.mattes[file.folder] = check.mattes.get(file.folder, 0) + lacking
                else:
                    check.faults += _unreadable(medium, indices)
        except UserError as error:
            check.faults.append(str(error))


def left_out(scene: Scene, frames: range) -> list[str]:
    """Return why the sequencer leaves out effects at some of these frames."""
    reasons = [why for shown, why in requirements.left_out(scene) if frame_ranges.common(shown, frames)]
    return list(dict.fromkeys(reasons))
