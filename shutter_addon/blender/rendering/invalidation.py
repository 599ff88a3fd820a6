"""The sequencer keeps finished frames; this drops them when what an effect depends on has changed.

Blender knows of a strip's own properties only. Properties of the effect drop frames by their update callbacks; keys,
strokes and the source are compared with what they were, as no callback tells of them.
"""

import bpy
import numpy as np

from ...media import MediaError
from ...media import inbetween_cache as files
from ..data import effects, fcurves, inbetween_settings, source_media, strips

_signatures: dict = {}  # by effect scenes
_KEPT = 64
_built: dict[tuple, tuple] = {}  # by folder, source, factor and method: the stamp of their in-between frames
spoilt: set[int] = set()  # session_uids of scenes of whose frames the sequencer may keep one that failed
building = False  # while in-between frames are built, those that come count when the build has ended

# Keyframe.interpolation as a number: constant, linear, bezier, then the others.
_BEZIER = 2
_PLACE = ("offset_x", "offset_y", "scale_x", "scale_y", "rotation")
_TIMING = (
    *("content_start", "content_end", "content_trim_start", "content_trim_end", "left_handle", "right_handle"),
    *("use_reverse_frames", "strobe"),
)


def built_key(effect, source) -> tuple:
    """Which in-between frames an effect has of the files that its source reads; equal keys: the same, and none was
    built or removed meanwhile. MediaError: the source strip has no files."""
    try:
        if inbetween_settings.factor(effect) == 1:
            return ()
        folder, *made = inbetween_settings.settings(effect)
    except effects.EffectError as error:
        return (str(error),)
    key = folder, source_media.stem(source), *made
    if not (building and key in _built):
        _built.pop(key, None)
        while len(_built) >= _KEPT:
            del _built[next(iter(_built))]
        _built[key] = files.stamp(*key)
    return *key, _built[key]


def forget() -> None:
    """Forgets what the effects of a file were, before another one is loaded."""
    _signatures.clear()
    _built.clear()


def drop_removed() -> None:
    """Forgets effect scenes that are gone."""
    scenes = {scene.session_uid for scene in bpy.data.scenes}
    for uid in _signatures.keys() - scenes:
        del _signatures[uid]


def drop_spoilt() -> None:
    """Drops what the sequencer keeps of pictures that failed: it would show them again without asking."""
    for edit in bpy.data.scenes if spoilt else ():
        for strip in strips.effect_strips(edit):
            if strip.scene.session_uid in spoilt:
                strip.invalidate_cache("RAW")
    spoilt.clear()


def invalidate_changed(edit) -> bool:
    """Drops the finished frames of the edit's effects whose keys, strokes or source have changed since the last call;
    whether there are any.

    The values of keyed properties do not count: they change with every frame that plays."""
    for gone in _signatures.keys() - {scene.session_uid for scene in bpy.data.scenes}:
        del _signatures[gone]
    if not edit.virtual_shutter.effects:
        return False
    changed = False
    shown = {strip.scene: strip for strip in strips.effect_strips(edit)}
    for effect in edit.virtual_shutter.effects:
        if (strip := shown.get(effect.scene)) is None:
            continue
        signature = hash(tuple(_signature(edit, effect, strip)))
        if _signatures.setdefault(effect.scene.session_uid, signature) != signature:
            _signatures[effect.scene.session_uid] = signature
            strips.invalidate(edit, effect.scene)
            changed = True
    return changed


def _signature(edit, effect, strip):
    """All that the effect's pictures depend on, but for properties with an update callback."""
    for shutter in effect.shutters:
        yield shutter.name, len(shutter.bars)
    for region in effect.regions:
        yield region.shutter
        yield from _strokes(effect.scene.annotation, region.layer)
    path = effect.path_from_id()
    for curve in fcurves.curves_under(edit, path + "."):
        yield curve.data_path.removeprefix(path), curve.array_index, curve.mute, curve.extrapolation
        yield from _keys(curve.keyframe_points)
        for modifier in curve.modifiers:
            yield from (
                repr(getattr(modifier, p.identifier)) for p in modifier.bl_rna.properties if p.type != "POINTER"
            )
    transform = strip.transform
    # As words: "not a number" is never the same again.
    yield repr([getattr(transform, name) for name in _PLACE]), repr(tuple(transform.origin))
    yield strip.use_flip_x, strip.use_flip_y  # scribbles lie mirrored with it
    if (source := strips.nearest_source(edit, effect, strip)) is not None:
        yield from _source(effect, source)


def _keys(points):
    for name in ("handle_left", "co", "handle_right"):
        yield _bytes(points, name, 2, np.float32)
    interpolations = _bytes(points, "interpolation", 1, np.int32)
    yield interpolations
    if max(interpolations, default=0) > _BEZIER:  # one of those that have parameters
        yield _bytes(points, "easing", 1, np.int32)
        for name in ("back", "amplitude", "period"):
            yield _bytes(points, name, 1, np.float32)


def _strokes(annotation, layer: str):
    for drawing in annotation.layers[layer].frames if annotation and layer in annotation.layers else ():
        yield drawing.frame_number
        for stroke in drawing.strokes:
            yield _bytes(stroke.points, "co", 3, np.float32)


def _source(effect, source):
    yield tuple(getattr(source, name) for name in _TIMING)
    yield source_media.reading(source)
    yield tuple(key.timeline_frame for key in getattr(source, "retiming_keys", ()))
    try:
        yield source_media.files_key(source)  # a file that was missing may be there again
        yield built_key(effect, source)
    except MediaError as error:
        yield str(error)


def _bytes(collection, name: str, size: int, dtype) -> bytes:
    values = np.empty(size * len(collection), dtype)
    collection.foreach_get(name, values)
    return values.tobytes()
