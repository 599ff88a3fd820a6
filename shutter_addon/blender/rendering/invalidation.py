"""When an effect has changed, drop the frames that the sequencer keeps and the snapshots of previews.

Blender drops frames only when a strip's own properties change. Properties of an effect drop frames by update callbacks.
Keys, strokes and sources are compared with what they were, because no callback reports them.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import bpy
from bpy.types import PropertyGroup, Scene, Strip

from ...core import revision
from ..data import effect_version, snapshot, strips
from ..data.snapshot import Snapshot
from ..devices import main_thread


@dataclass
class _Frames:
    """What is known of effects' frames in the sequencer's cache, by session_uid of the effect scene.

    Attributes:
        signatures: effect_version.preview_key of each effect when invalidate_changed last looked.
        failed: Effects of which a picture failed. Their frames have to be dropped.
        reduced: Effects of which a preview got a frame in less than full quality. Their frames have to be dropped.
    """

    signatures: dict[int, int] = field(default_factory=dict)
    failed: set[int] = field(default_factory=set)
    reduced: set[int] = field(default_factory=set)


_frames = _Frames()


def current(scene: Scene, effect: PropertyGroup, strip: Strip, frame: float) -> Snapshot:
    """Return the snapshot of an effect strip (plain data) at a timeline frame, cached until something changes.

    Raises:
        EffectError, MediaError: As in snapshot.take.
    """
    key = effect.scene.session_uid, strip.name, frame
    return revision.until_change("snapshot", key, lambda: snapshot.take(scene, effect, strip, (frame,)))


def forget() -> None:
    """Forget cached data about the file's effects and frames, before another file is loaded."""
    _frames.signatures.clear()
    revision.changed()


def mark_failed(scene: int) -> None:
    """Note that a picture of the effect scene with this session_uid failed."""
    _frames.failed.add(scene)


def drop_failed() -> None:
    """Drop the frames that the sequencer keeps of failed effects; it would show them without asking the engine."""
    _drop(_frames.failed)


def mark_reduced(scene: int) -> None:
    """Note that the sequencer's cache got a picture of an effect in less than full quality, or none.

    Blender would use the picture for renders, scopes and the color picker, too, so drop_reduced drops it soon.

    Args:
        scene: session_uid of the effect scene.
    """
    _frames.reduced.add(scene)
    main_thread.later(drop_reduced)  # in case the handler is not called


def drop_reduced() -> None:
    """Drop the frames that the sequencer keeps of the effects that mark_reduced has noted."""
    _drop(_frames.reduced)


def _drop(noted: set[int]) -> None:
    """Drop the frames of the effect scenes with these session_uids, and empty the set."""
    uids = {noted.pop() for _ in range(len(noted))}
    for scene in bpy.data.scenes if uids else ():
        for strip in strips.effect_strips(scene):
            if strip.scene.session_uid in uids:
                strip.invalidate_cache("RAW")


def invalidate_changed(scene: Scene) -> bool:
    """Drop cached frames of a scene's effects that changed since the last call in a way that Blender does not report.

    Such changes are those of keyframes, strokes, mattes and the source, among others (effect_version.preview_key).
    Current values of keyed properties do not count, as they change with every frame that plays.

    Returns:
        Whether an effect has changed. An effect that was not seen before has not.
    """
    if not scene.virtual_shutter.effects:
        return False
    changed = False
    shown = {strip.scene: strip for strip in strips.effect_strips(scene)}
    for effect in scene.virtual_shutter.effects:
        if (strip := shown.get(effect.scene)) is None:
            continue
        uid = effect.scene.session_uid
        signature = effect_version.preview_key(scene, effect, strip)
        if _frames.signatures.setdefault(uid, signature) != signature:
            _frames.signatures[uid] = signature
            strips.invalidate(scene, effect.scene)
            changed = True
    return changed
