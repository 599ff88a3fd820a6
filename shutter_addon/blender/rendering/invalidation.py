"""The sequencer keeps finished frames, and previews what they read of an effect; this drops both when it has changed.

Blender knows of a strip's own properties only. Properties of the effect drop frames by their update callbacks; keys,
strokes and the source are compared with what they were, as no callback tells of them.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator

import bpy
import numpy as np
from bpy.types import Annotation, FCurve, Mask, PropertyGroup, Scene, Strip, bpy_prop_collection

from ...core import revision
from ...core.messages import EffectError
from ...media import MediaError
from ..data import fcurves, geometry, mask_reading, matte_content, matte_strips, snapshot, source_media, strips
from ..data.snapshot import Snapshot, SourceFiles
from ..data.strip_timing import retiming_keys
from . import render_settings

_signatures: dict[int, int] = {}  # by effect scene
_files: dict[int, tuple[int, dict[str, SourceFiles]]] = {}  # by effect scene: the revision of the look, files by source
_current = revision.UntilChange()
_masks = revision.UntilChange()  # by mask: what it shows at its start
_spoilt: set[int] = set()  # session_uids of scenes of whose frames the sequencer may keep one that failed
_lesser: set[int] = set()  # likewise, one that is less than the full picture, for a preview

# Keyframe.interpolation as a number: constant, linear, bezier, then the others.
_BEZIER = 2
_TIMING = (
    *("content_start", "content_end", "content_trim_start", "content_trim_end", "left_handle", "right_handle"),
    *("use_reverse_frames", "strobe"),
)


def current(scene: Scene, effect: PropertyGroup, strip: Strip, frame: float) -> Snapshot:
    """The snapshot of an effect strip at a timeline frame, for what is drawn: taken once until something changes.
    EffectError, MediaError: as snapshot.take."""
    uid = effect.scene.session_uid

    def take() -> Snapshot:
        number, files = _files.get(uid, (None, None))
        known = files if number == revision.number() else None
        return snapshot.take(scene, effect, strip, (frame,), folder=render_settings.settings().inbetween, files=known)

    return _current.get((uid, strip.name, frame), take)


def forget() -> None:
    """Forgets what the effects of a file were, before another one is loaded."""
    _signatures.clear()
    _files.clear()
    _current.clear()
    _masks.clear()
    revision.changed()


def drop_removed() -> None:
    """Forgets effect scenes that are gone."""
    scenes = {scene.session_uid for scene in bpy.data.scenes}
    for known in (_signatures, _files):
        for uid in known.keys() - scenes:
            del known[uid]


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
    if not bpy.app.timers.is_registered(drop_lesser):
        bpy.app.timers.register(drop_lesser)  # should the handler not be called


def drop_lesser() -> None:
    """Drops what the sequencer keeps of pictures for previews."""
    _drop(_lesser)


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
    drop_removed()
    if not scene.virtual_shutter.effects:
        return False
    changed = False
    shown = {strip.scene: strip for strip in strips.effect_strips(scene)}
    looked: dict[int, dict[str, SourceFiles]] = {}
    for effect in scene.virtual_shutter.effects:
        if (strip := shown.get(effect.scene)) is None:
            continue
        uid = effect.scene.session_uid
        signature = hash(tuple(_signature(scene, effect, strip, looked)))
        if _signatures.setdefault(uid, signature) != signature:
            _signatures[uid] = signature
            strips.invalidate(scene, effect.scene)
            changed = True
    _files.update((uid, (revision.number(), files)) for uid, files in looked.items())
    return changed


def _signature(scene: Scene, effect: PropertyGroup, strip: Strip, looked: dict) -> Iterator[Hashable]:
    """All that the effect's pictures depend on, but for properties with an update callback. looked: gets what the
    source reads, by the effect's scene."""
    for shutter in effect.shutters:
        yield shutter.name, len(shutter.bars)
    for region in effect.regions:
        yield region.shutter
        yield from _strokes(effect.scene.annotation, region.layer)
        if region.kind == "MATTE":
            yield from _matte(region)
    yield fcurves.stretched(scene)
    path = effect.path_from_id()
    for curve in fcurves.curves_under(scene, path + "."):
        yield curve.data_path.removeprefix(path)
        yield from _curve(curve)
    transform = strip.transform
    # As words: "not a number" is never the same again.
    yield repr([getattr(transform, name) for name in geometry.TRANSFORM]), repr(tuple(transform.origin))
    yield strip.use_flip_x, strip.use_flip_y  # scribbles lie mirrored with it
    if (source := strips.nearest_source(scene, effect, strip)) is not None:
        yield from _source(effect, source, looked)


def _curve(curve: FCurve) -> Iterator[Hashable]:
    yield curve.array_index, curve.mute, curve.extrapolation
    yield from _keys(curve.keyframe_points)
    for modifier in curve.modifiers:
        yield from (repr(getattr(modifier, p.identifier)) for p in modifier.bl_rna.properties if p.type != "POINTER")


def _keys(points: bpy_prop_collection) -> Iterator[Hashable]:
    for name in ("handle_left", "co", "handle_right"):
        yield _bytes(points, name, 2, np.float32)
    interpolations = _bytes(points, "interpolation", 1, np.int32)
    yield interpolations
    if max(interpolations, default=0) > _BEZIER:  # one of those that have parameters
        yield _bytes(points, "easing", 1, np.int32)
        for name in ("back", "amplitude", "period"):
            yield _bytes(points, name, 1, np.float32)


def _strokes(annotation: Annotation | None, layer: str) -> Iterator[Hashable]:
    for drawing in annotation.layers[layer].frames if annotation and layer in annotation.layers else ():
        yield drawing.frame_number
        for stroke in drawing.strokes:
            yield _bytes(stroke.points, "co", 3, np.float32)


def _matte(region: PropertyGroup) -> Iterator[Hashable]:
    """What a matte shows, but for properties of the region."""
    try:
        if region.matte == "IMAGE":
            yield matte_content.image_file(region)
        for part in matte_strips.strips_of(region) if region.matte == "STRIP" else ():
            yield from _timing(part)
            yield source_media.media_key(part)
        if region.matte == "MASK" and region.mask is not None:
            yield from _mask(region.mask)
    except (MediaError, EffectError) as error:
        yield str(error)


def _mask(mask: Mask) -> Iterator[Hashable]:
    # Blender tells of these; many points take long to read.
    yield _masks.get(mask.session_uid, lambda: hash((mask.frame_start, mask_reading.mask_at(mask, mask.frame_start))))
    yield from mask_reading.motion(mask)
    for curve in fcurves.curves_under(mask, ""):
        yield curve.data_path
        yield from _curve(curve)


def _timing(source: Strip) -> Iterator[Hashable]:
    yield tuple(getattr(source, name) for name in _TIMING)
    yield retiming_keys(source)


def _source(effect: PropertyGroup, source: Strip, looked: dict) -> Iterator[Hashable]:
    yield from _timing(source)
    yield source_media.reading(source)
    try:
        files = snapshot.source_files(effect, source, render_settings.settings().inbetween)
    except (MediaError, EffectError) as error:
        yield str(error)  # a file that was missing may be there again
    else:
        looked[effect.scene.session_uid] = {source.name: files}
        yield files


def _bytes(collection: bpy_prop_collection, name: str, size: int, dtype: type) -> bytes:
    values: np.ndarray = np.empty(size * len(collection), dtype)
    collection.foreach_get(name, values)
    return values.tobytes()
