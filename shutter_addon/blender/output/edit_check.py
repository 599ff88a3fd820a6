"""Checking whether an edit can be rendered on this machine, without rendering it."""

from __future__ import annotations

import math
import os
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
from ..data import effect_version, requirements, selection, snapshot, source_media, strips
from ..rendering import effect_source, job_snapshots, pictures
from ..rendering.session import RenderContext, RenderSession


@dataclass
class EffectCheck:
    """The check of an effect.

    Attributes:
        strip: Its name.
        source: The footage's first file; "" if it cannot be read.
        size: Width and height of its pictures.
        window: Filmed frames of the longest window.
        shutters: Their number.
        inbetween: Moments per filmed frame; 1 without *Smooth*.
        mattes: The number of outlines' mattes that have to be carried first, by their folder.
        faults, notes: Messages. Notes are about effects that can be rendered, but not as one may expect.
    """

    strip: str
    shutters: int
    source: str = ""
    size: tuple[int, int] = (0, 0)
    window: int = 0
    inbetween: int = 1
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
    check = EffectCheck(strip=strip.name, shutters=len(effect.shutters))
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
        check.inbetween = source.step
        check.window = max(request.state.options.window for request in requests.values()) // source.step
        _check_frames(check, renderer, requests)
        _check_mattes(check, source, requests)
        check.notes += _notes(check, taken, requests, source)
    return check


def _requests(session: RenderSession, taken: snapshot.Snapshot, check: EffectCheck) -> dict[float, Request]:
    """Return the requests of frames that can be shown. A fault of several frames is noted once."""
    requests, context = {}, RenderContext(session)
    faults: dict[str, list[str]] = {}
    for frame in sorted(taken.frames):
        try:
            requests[frame] = session.request(taken, frame, context)
        except effect_source.FAULTS as error:
            kind = re.sub(r"\bframe -?[\d.]+", "", str(error))
            faults.setdefault(kind, []).append(str(error))
    for sentences in faults.values():
        more = f" (and at {len(sentences) - 1} more frames)" if len(sentences) > 1 else ""
        check.faults.append(sentences[0] + more)
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
    check.source, check.size = os.path.normpath(medium.path), (medium.width, medium.height)
    saved = effect.scene.render.resolution_x, effect.scene.render.resolution_y
    if saved != check.size:
        words = "{}×{}, but was {}×{} when the edit was saved".format(*check.size, *saved)
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
    """Return the faults of filmed frames: missing files, else a first or last frame that cannot be decoded."""
    files, missing = source.files, []
    if len(files) > 1:
        for path in sorted({files[index] for index in indices}):
            try:
                check_file(path)
            except MediaError as error:
                missing.append(str(error))
    if missing:
        more = f" (and {len(missing) - 1} more files)" if len(missing) > 1 else ""
        return [missing[0] + more]
    faults = []
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


def _notes(
    check: EffectCheck, taken: snapshot.Snapshot, requests: dict[float, Request], source: FrameSource
) -> list[str]:
    notes = list({sentence: None for request in requests.values() for sentence in pictures.unread(taken, request)})
    if source.by_blender:
        notes.append(pictures.SLOW_DECODING)
    if lacking := sum(check.mattes.values()):
        notes.append(f"{lacking} mattes of outlines are not tracked yet: the first render does that, frame by frame")
    return notes


def left_out(scene: Scene, frames: range) -> list[str]:
    """Return why the sequencer leaves out effects at some of these frames."""
    reasons = [why for shown, why in requirements.left_out(scene) if frame_ranges.common(shown, frames)]
    return list(dict.fromkeys(reasons))


def stale_films(scene: Scene, frames: range) -> list[str]:
    """Return notes on baked strips that are shown at some of these frames although their effect has changed."""
    found = []
    for shown, _at in requirements.scenes_at(scene, frames):
        for strip in strips.effect_strips(shown):
            films = [each for each in selection.of_bake(shown, strip) if each.type in strips.SOURCES]
            effect = strips.effect_of(shown, strip.scene)
            is_shown = any(requirements.is_shown(shown, film, frames) for film in films)
            if effect and is_shown and effect_version.is_changed(shown, effect, strip):
                found.append(f'"{strip.name}": the effect has changed since it was baked, and its baked strip is shown')
    return found
