"""Keys of everything that an effect's pictures depend on, so that previews and bakes notice when they are out of date.

Previews drop finished frames when `preview_key` changes. A bake stores `key`, a hash that stays the same when the
strips are moved on the timeline or the files on disk.
"""

import hashlib
from collections.abc import Callable, Hashable, Iterator
from dataclasses import replace

import numpy as np
from bpy.types import PropertyGroup, Scene, Strip

from ... import features
from ...core import revision
from ...core.frames.retiming import StripTiming
from ...core.messages import EffectError, UserError
from ...core.model import effect as model
from ...core.model.fields import fields_of
from ...core.model.frame_state import Options
from ...media import MediaError
from . import fcurves, matte_content, preferences, snapshot, source_media, strips, versions
from .annotations import LAYERS, TRANSFORM, layer_of, picture_size
from .external_files import every
from .fcurves import numbers
from .property_copy import plain

# Identifies the files of a strip, or of a region whose matte is an image.
Files = Callable[[Strip | PropertyGroup], Hashable]

_MOVES = "location", "rotation", "scale"
_BEZIER = 2  # of Keyframe.interpolation as a number; those above have parameters


def frames_of(strip: Strip) -> range:
    """Return the frames that an effect strip covers; 0 is strips.origin, the start of its untrimmed content.

    All parts of a cut strip have the same origin, so the numbers of their frames can be compared.
    """
    start = round(strips.origin(strip))
    return range(strip.left_handle - start, strip.right_handle - start)


def key(scene: Scene, effect: PropertyGroup, strip: Strip, frames: range) -> str:
    """Return a hash of all that an effect's pictures depend on, so that a bake notices when it is out of date.

    The hash covers the settings and the contents of files. It stays the same if all strips move together on the
    timeline, or files move on disk.

    Args:
        scene: The scene that has the effect.
        strip: The effect strip.
        frames: The frames that are or will be baked, numbered as in frames_of.

    Returns:
        16 hexadecimal digits.

    Raises:
        EffectError, MediaError: The effect cannot be rendered, for example because it has no source.
    """
    start = round(strips.origin(strip))
    snapshot.check_counts(effect)
    source = strips.source_of(scene, effect, strip)
    rate = scene.render.fps / scene.render.fps_base
    digest = hashlib.sha256()
    for part in (
        (versions.extension(), versions.colours(), rate, frames, picture_size(effect)),
        _source(effect, source, _contents, start),
        *_settings(effect),
        *parts(effect, strip, _contents, start),
    ):
        digest.update(repr(part).encode() + b"\0")
    return digest.hexdigest()[:16]


def preview_key(scene: Scene, effect: PropertyGroup, strip: Strip) -> int:
    """Return a hash that changes when an effect's pictures change for a reason that Blender does not report.

    Previews ask for it often, and drop their finished frames when it changes. So it does not read files: it uses their
    paths, sizes and times. It leaves out properties that have an update callback, since that drops the frames, too.
    """
    source = strips.nearest_source(scene, effect, strip)
    lies = None if source is None else (source.left_handle, _source(effect, source, _stamps, 0))
    names = tuple(shutter.name for shutter in effect.shutters)
    return hash((names, lies, *parts(effect, strip, _stamps)))


def is_changed(scene: Scene, effect: PropertyGroup, strip: Strip) -> bool:
    """Tell whether an effect differs from what its strip was baked with, or cannot be shown any more."""
    bake, frames = strip.virtual_shutter_bake, frames_of(strip)
    if frames.start < bake.first or frames.stop > bake.first + bake.count:
        return True  # the strip is longer now
    try:
        return key(scene, effect, strip, range(bake.first, bake.first + bake.count)) != bake.version
    except (UserError, MemoryError):
        return True


def parts(effect: PropertyGroup, strip: Strip, files: Files, start: int | None = None) -> Iterator[Hashable]:
    """Yield what an effect's pictures depend on, apart from the source and properties with an update callback.

    That is: numbers of bars, regions, strokes, mattes, F-curves, *Time Stretching*, and the strip's transform and
    mirroring. Of keyed properties, the F-curves are yielded but not the current value, which changes with every frame
    that plays.

    Args:
        strip: The effect strip.
        files: Returns a value that identifies the files of a strip or an image matte: `_stamps` or `_contents`.
        start: The timeline frame from which frames are counted, so that the result does not change if all strips move
            together. None: frames are those of the timeline.
    """
    scene, names = effect.id_data, [shutter.name for shutter in effect.shutters]
    yield tuple(len(shutter.bars) for shutter in effect.shutters)
    for region in effect.regions:
        yield names.index(region.shutter) if region.shutter in names else None
        yield from _strokes(effect, region, start)
        if region.kind == "MATTE":
            yield from _matte(region, files, start)
    yield fcurves.stretched(scene)
    transform = f"{strip.path_from_id()}.transform."
    yield from _curves(scene, effect.path_from_id() + ".", start)
    yield from _curves(scene, transform, start)
    keyed = {c.data_path.removeprefix(transform) for c in fcurves.curves_under(scene, transform) if fcurves.drives(c)}
    # As text, because NaN never equals NaN.
    yield repr([getattr(strip.transform, name) for name in TRANSFORM if name not in keyed])
    yield repr(tuple(strip.transform.origin)), strip.use_flip_x, strip.use_flip_y


def _source(effect: PropertyGroup, source: Strip, files: Files, start: int) -> Hashable:
    """Return what identifies the source's footage, and which of its frames is shown at which time.

    Args:
        source: The source strip.
        files: As in `parts`.
        start: The timeline frame from which frames are counted.

    Returns:
        The strip's timing, and what `files` returns. The timing is None if *Custom Time* of the effect replaces it.
    """
    return None if effect.use_source_time else timing(source, start), files(source)


def _settings(effect: PropertyGroup) -> Iterator[Hashable]:
    """Yield names and values of the properties without F-curves that an effect's pictures depend on.

    Names and colors of the effect's items are left out. A region that a shutter follows is yielded as its index. If
    there are subjects, a digest of the file of the network that finds them is yielded, too.
    """
    path, followed = effect.path_from_id(), [region.name for region in effect.regions]
    curves = filter(fcurves.drives, fcurves.curves_under(effect.id_data, path + "."))
    keyed = {(curve.data_path, curve.array_index) for curve in curves}

    def values(group: PropertyGroup, place: str, *names: str) -> Iterator[Hashable]:
        for name in names:
            value, where = getattr(group, name), f"{path}{place}.{name}"
            numbers = (value,) if isinstance(value, str | float | int) else tuple(value)
            yield name, tuple(number for i, number in enumerate(numbers) if (where, i) not in keyed)

    yield from values(effect, "", *_setting_names(model.Effect, Options), "use_source_time", "source_time")
    yield from values(effect.camera, ".camera", *_setting_names(model.Camera), *_MOVES)
    for i, shutter in enumerate(effect.shutters):
        yield from values(shutter, f".shutters[{i}]", *_setting_names(model.Shutter), "follow")
        is_followed = shutter.follow == "REGION" and shutter.follow_region in followed
        yield followed.index(shutter.follow_region) if is_followed else None
        for k, bar in enumerate(shutter.bars):
            yield from values(bar, f".shutters[{i}].bars[{k}]", "weight")
    if any(region.kind == "SUBJECT" for region in effect.regions):
        yield tuple(versions.digests([preferences.model()]))
    names = _setting_names(model.Region, model.OutlineRegion, model.FileContent, model.RampContent)
    for i, region in enumerate(effect.regions):
        yield from values(region, f".regions[{i}]", *names, "kind", "matte", "channel_name", *_MOVES)
        yield tuple((noted.frame, tuple(noted.location), noted.rotation, noted.scale) for noted in region.drawn)


def _setting_names(*kinds: type) -> list[str]:
    """Return the names of Blender's properties for the fields of the model's classes, except texts and colors."""
    fields = fields_of(*kinds).values()
    return [field.blender for field in fields if field.choices or not isinstance(field.default, str | tuple)]


def _curves(owner: Scene, path: str, start: int | None) -> Iterator[Hashable]:
    """Yield paths, keys, handles and modifiers of the F-curves of a scene under a data path, in a fixed order.

    Args:
        owner: The scene.
        path: F-curves whose data path starts with this count. It is removed from the yielded paths.
        start: As in `parts`.
    """
    for curve in sorted(fcurves.curves_under(owner, path), key=lambda curve: (curve.data_path, curve.array_index)):
        yield curve.data_path.removeprefix(path), curve.array_index, curve.mute, curve.extrapolation
        points = curve.keyframe_points
        for name in ("handle_left", "co", "handle_right"):
            places = numbers(points, name, size=2)
            if start is not None:  # rounded, because float32 errors differ between frames
                places[:, 0] = np.round(places[:, 0] - start, 2) + 0.0
            yield places.tobytes()
        interpolations = numbers(points, "interpolation", np.int32)
        yield interpolations.tobytes()
        if max(interpolations.tolist(), default=0) > _BEZIER:
            yield numbers(points, "easing", np.int32).tobytes()
            yield tuple(numbers(points, name).tobytes() for name in ("back", "amplitude", "period"))
        for modifier in curve.modifiers:
            yield repr(plain(modifier))


def _strokes(effect: PropertyGroup, region: PropertyGroup, start: int | None) -> Iterator[Hashable]:
    for name in LAYERS if region.kind == "SUBJECT" else LAYERS[:1]:
        layer = layer_of(effect, region, name)
        for drawing in layer.frames if layer else ():
            yield drawing.frame_number - (start or 0)
            for stroke in drawing.strokes:
                yield numbers(stroke.points, "co", size=3).tobytes()


def _matte(region: PropertyGroup, files: Files, start: int | None) -> Iterator[Hashable]:
    """Yield what a region's matte depends on: its files, the matte strips with their timing, or its mask.

    Of the properties of the region itself, only the channel of an image is included. If the region has no matte that
    can be used, the error message is yielded, but nothing for a missing mask.

    Args:
        region: A region whose kind is "MATTE".
        files: As in `parts`.
        start: As in `parts`.
    """
    try:
        if region.matte == "IMAGE":
            yield files(region)
        for part in matte_content.strips_of(region) if region.matte == "STRIP" else ():
            yield part.left_handle - (start or 0), part.right_handle - (start or 0)
            yield timing(part, start or 0)
            yield files(part)
        if region.matte == "MASK" and region.mask is not None:
            # Blender reports changes of a mask, and many points take long to read.
            mask = region.mask
            yield revision.until_change("mask", mask.session_uid, lambda: repr(features.needed("still_mask")(mask)))
    except (MediaError, EffectError) as error:
        yield str(error)


def timing(strip: Strip, start: int = 0) -> StripTiming:
    """Return which of its frames a movie, image or clip strip shows at which time. Equal results show the same.

    The result does not depend on the strip's name, or on where it was cut.

    Args:
        start: The timeline frame from which the start and end of its content are counted.
    """
    lies = source_media.timing_of(strip)
    begins, ends = lies.content_start - start, lies.content_end - start
    return replace(lies, name="", left_handle=0, content_start=begins, content_end=ends)


def _stamps(owner: Strip | PropertyGroup) -> Hashable:
    """Return a value that identifies the files of a strip or an image matte, by paths, sizes and modification times.

    If there are none, or an effect cannot use them, the value is the error message.

    Args:
        owner: The strip, or the region that has the matte.
    """
    try:
        return source_media.media_key(owner) if isinstance(owner, Strip) else matte_content.image_file(owner)
    except (MediaError, EffectError) as error:
        return str(error)


def _contents(owner: Strip | PropertyGroup) -> Hashable:
    """Return a value that identifies the files of a strip or an image matte, by their contents.

    Args:
        owner: The strip, or the region that has the matte.

    Returns:
        How the files are read, and a digest of each. A missing file has "missing: NAME" in place of the digest.

    Raises:
        EffectError, MediaError: The strip or the region has no files, or an effect cannot use them.
    """
    if isinstance(owner, Strip):
        spec = source_media.spec(owner)
        read = repr(sorted(item for item in spec.options.items() if item[0] != "config"))
        found = list(spec.files or [spec.path])
    else:
        matte_content.image_path(owner)
        read, found = matte_content.channel(owner), every(owner.image)
    digests = zip(found, versions.digests(found), strict=True)
    return read, tuple(digest or f"missing: {path.name}" for path, digest in digests)
