"""The sequencer keeps finished frames, and previews what they read of an effect; this drops both when it has changed.

Blender knows of a strip's own properties only. Properties of the effect drop frames by their update callbacks; keys,
strokes and the source are compared with what they were, as no callback tells of them.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator

import bpy
from bpy.types import PropertyGroup, Scene, Strip

from ...core import revision
from ...core.messages import EffectError
from ...media import MediaError
from ..data import effect_version, matte_content, snapshot, source_media, strips
from ..data.snapshot import Snapshot
from ..devices import main_thread

_signatures: dict[int, int] = {}  # by session_uid of the effect scene, which no other one gets
_spoilt: set[int] = set()  # session_uids of scenes of whose frames the sequencer may keep one that failed
_lesser: set[int] = set()  # likewise, one that is less than the full picture, for a preview


def current(scene: Scene, effect: PropertyGroup, strip: Strip, frame: float) -> Snapshot:
    """The snapshot of an effect strip at a timeline frame, for what is drawn: taken once until something changes.
    EffectError, MediaError: as snapshot.take."""
    key = effect.scene.session_uid, strip.name, frame
    return revision.until_change("snapshot", key, lambda: snapshot.take(scene, effect, strip, (frame,)))


def forget() -> None:
    """Forgets what the effects of a file were, before another one is loaded."""
    _signatures.clear()
    revision.changed()


def spoil(scene: int) -> None:
    """A picture of an effect scene, by its session_uid, failed."""
    _spoilt.add(scene)


def drop_spoilt() -> None:
    """Drops what the sequencer keeps of pictures that failed: it would show them again without asking."""
    _drop(_spoilt)


def keep_until_drawn(scene: int) -> None:
    """The sequencer was given less than the picture of an effect scene, by its session_uid, for a preview that it
    draws. Nobody else may get that: Blender shares what it keeps with renders, scopes and the colour picker. So the
    draw handler drops it."""
    _lesser.add(scene)
    main_thread.later(drop_lesser)  # should the handler not be called


def drop_lesser() -> None:
    """Drops what the sequencer keeps of pictures for previews."""
    _drop(_lesser)


def drop_frames() -> None:
    """Drops the finished frames of all effects; a timer as well."""
    for scene in bpy.data.scenes:
        strips.invalidate(scene)


def _drop(noted: set[int]) -> None:
    """Empties a set of session_uids of effect scenes, and drops what the sequencer keeps of those."""
    uids = {noted.pop() for _ in range(len(noted))}
    for scene in bpy.data.scenes if uids else ():
        for strip in strips.effect_strips(scene):
            if strip.scene.session_uid in uids:
                strip.invalidate_cache("RAW")


def invalidate_changed(scene: Scene) -> bool:
    """Drops the finished frames of the scene's effects whose keys, strokes or source have changed since the last call;
    whether there are any.

    The values of keyed properties do not count: they change with every frame that plays."""
    if not scene.virtual_shutter.effects:
        return False
    changed = False
    shown = {strip.scene: strip for strip in strips.effect_strips(scene)}
    for effect in scene.virtual_shutter.effects:
        if (strip := shown.get(effect.scene)) is None:
            continue
        uid = effect.scene.session_uid
        signature = hash(tuple(_signature(scene, effect, strip)))
        if _signatures.setdefault(uid, signature) != signature:
            _signatures[uid] = signature
            strips.invalidate(scene, effect.scene)
            changed = True
    return changed


def _signature(scene: Scene, effect: PropertyGroup, strip: Strip) -> Iterator[Hashable]:
    """All that the effect's pictures depend on, but for properties with an update callback."""
    yield tuple(shutter.name for shutter in effect.shutters)
    yield from effect_version.parts(scene, effect, strip, _files_of)
    if (source := strips.nearest_source(scene, effect, strip)) is not None:
        yield effect_version.timing(source), source.left_handle
        yield source_media.reading(source)
        try:
            yield source_media.media_key(source)
        except (MediaError, EffectError) as error:
            yield str(error)  # a file that was missing may be there again


def _files_of(owner: Strip | PropertyGroup) -> Hashable:
    """What a strip, or a region whose matte is an image, reads, as it is on disk now."""
    return source_media.media_key(owner) if isinstance(owner, Strip) else matte_content.image_file(owner)
