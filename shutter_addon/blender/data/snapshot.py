"""Read an effect strip from Blender's data: as a snapshot, which is plain data, or as a recipe.

To be called on Blender's main thread only. A snapshot holds no Blender data, so other threads may use it, and it does
not change with the scene. Blender evaluates the F-curves, at the frames that are asked for. Drivers, NLA strips and
further layers of an action do not count (docs/manual.md).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import FCurve, PropertyGroup, Scene, Strip

from ... import features
from ...core.frames.retiming import StripTiming
from ...core.messages import EffectError, UserError, translated
from ...core.model import effect as model
from ...core.model import keyframes, limits, mattes, outlines, state_at
from ...core.model.fields import fields_of
from ...core.model.frame_state import Options
from ...core.recipes import key_fitting
from . import matte_content, preferences, sampled, source_media, strips, validation
from .annotations import LAYERS, image_to_picture, layer_of, layers_of, picture_size
from .fcurves import curves_under, points_of, progress, stretched
from .sampled import Frames, Sampling


@dataclass(frozen=True, eq=False)
class Snapshot:
    """All that the pictures of an effect strip depend on, at some timeline frames, without Blender's data.

    Attributes:
        scene: session_uid of the effect scene.
        origin: Timeline frame that corresponds to frame 0 of the effect scene.
        first: First timeline frame of the strip.
        film: Frame step and last frame of a render, from the scene that has the strip.
        frames: Timeline frames for which pictures can be made.
        effect: The effect, with values over time for these frames.
        source: The footage, and how it is read.
        timing: The source strip's timing: which frame of the footage it shows when. None if the effect's *Custom Time*
            (effect.time) says so instead.
        blended: Color space in which the sequencer blends the strip with those below. "" if it does not blend it: the
            strip replaces them, or its source is muted.
        folder: Folder of the .blend file; None: it was never saved.
    """

    scene: int
    origin: float
    first: int
    film: tuple[int, int]
    frames: frozenset[float]
    effect: model.Effect
    source: source_media.SourceSpec
    timing: StripTiming | None
    blended: str
    folder: Path | None = None

    def timeline_frame(self, scene_frame: float) -> float:
        """Return the timeline frame at which a frame of the effect scene is shown."""
        return self.origin + scene_frame


def take(scene: Scene, effect: PropertyGroup, strip: Strip, frames: Frames) -> Snapshot:
    """Return the snapshot of an effect strip.

    Args:
        scene: The scene that has the strip.
        effect: The effect that the strip shows.
        strip: The effect strip.
        frames: Timeline frames for which pictures will be made.

    Raises:
        EffectError, MediaError: There is no source, or the effect cannot be shown at any frame.
    """
    source = strips.source_of(scene, effect, strip)
    return Snapshot(
        scene=effect.scene.session_uid,
        origin=strips.timeline_frame(strip, 0),
        first=strip.left_handle,
        film=(scene.frame_step, scene.frame_end),
        frames=frozenset(frames),
        effect=read(scene, effect, strip, frames),
        source=source_media.spec(source),
        timing=None if effect.use_source_time else source_media.timing_of(source),
        blended="" if strip.blend_type == "REPLACE" or source.mute else scene.sequencer_colorspace_settings.name,
        folder=Path(bpy.data.filepath).parent if bpy.data.filepath else None,
    )


def read(scene: Scene, effect: PropertyGroup, strip: Strip, frames: Frames) -> model.Effect:
    """Return an effect as the model has it, with keyed properties sampled at timeline frames.

    An error that concerns only one frame is raised later, when that frame's values are asked for.

    Args:
        scene: The scene that has the strip.
        effect: The effect that the strip shows.
        strip: The effect strip.
        frames: Timeline frames for which the effect will be asked.

    Raises:
        EffectError, MediaError: It cannot be shown at any frame: for example, it has no shutter, too many regions, or a
            matte without content.
    """
    check_counts(effect)
    layers = any(region.is_layer for region in effect.regions)
    # With layers, motions count for every region, at all frames around.
    followed = {s.follow_region for s in effect.shutters if s.follow == "REGION"}
    narrow = Sampling.of(scene, effect, strip, frames)
    wide = replace(narrow, frames=_around(effect, frames, layers))
    names = [shutter.name for shutter in effect.shutters]
    regions = tuple(
        _any_region(wide if layers or region.name in followed else narrow, i, names.index(region.shutter))
        for i, region in enumerate(effect.regions)
        if region.shutter in names
    )
    options, camera = _options(narrow), _camera(wide)
    return model.Effect(
        shutters=tuple(
            replace(_shutter(narrow, i, options), follow=_followed(shutter, regions, camera))
            for i, shutter in enumerate(effect.shutters)
        ),
        regions=regions,
        options=options,
        time=wide.time,
        camera=camera,
        **(wide if layers else narrow).fields(effect, narrow.path, model.Effect),
    )


def _around(effect: PropertyGroup, frames: Frames, has_layers: bool) -> Frames:
    """Return the timeline frames at which motions and *Custom Time* are sampled: `frames`, with more around if needed.

    Frames around are needed if an exposure follows a motion, if its length is *Timeline*, or if layers are filled from
    other frames.

    Args:
        frames: Timeline frames for which pictures will be made.
        has_layers: Whether a region of the effect is a layer.
    """
    if has_layers or any(shutter.follow != "NOTHING" for shutter in effect.shutters):
        smooth = max(validation.number(shutter, "follow_smooth") for shutter in effect.shutters)
        reach = state_at.reach(validation.number(effect, "window")) + smooth
        if has_layers:
            reach += validation.number(effect, "plate_reach") + 1
    elif any(shutter.length == "TIMELINE" for shutter in effect.shutters):
        reach = 1
    else:
        return frames
    return np.unique(np.add.outer(sorted(frames), np.arange(-reach, reach + 1))).tolist()


def _followed(shutter: PropertyGroup, regions: Sequence[model.AnyRegion], camera: model.Camera) -> model.Subject | None:
    """Return the region or the camera that a shutter's exposure moves with; None: it follows nothing.

    Args:
        shutter: The shutter's property group.
        regions: The effect's regions, as the model has them, among which the followed one is found by its name.
        camera: The effect's camera, as the model has it.

    Raises:
        EffectError: The shutter is to follow a region that is not among them.
    """
    follow = validation.word(shutter, "follow")
    if follow == "NOTHING":
        return None
    if follow == "CAMERA":
        return camera
    followed = next((region for region in regions if region.name == shutter.follow_region), None)
    if followed is None:
        sentence = rpt_('{place}: there is no region "{region}" to follow')
        raise EffectError(sentence.format(place=validation.place(shutter), region=shutter.follow_region))
    return followed


def bars_at(scene: Scene, effect: PropertyGroup, index: int, frame: float) -> np.ndarray:
    """Return a shutter's bars at a timeline frame, interpolated between keys.

    Args:
        scene: The scene that has the effect.
        index: Index of the shutter in the effect.
        frame: The timeline frame.

    Returns:
        (L,): how much each of the window's L frames counts in the exposure.

    Raises:
        EffectError: A bar is out of range, or the number of bars differs from the window's length.
    """
    sampling = Sampling.of(scene, effect, None, (frame,))
    options = _options(sampling)
    return _shutter(sampling, index, options).bars.at(frame, options.at(frame).interpolation)


def strokes_at(scene: Scene, effect: PropertyGroup, strip: Strip, index: int, frame: float) -> list[np.ndarray]:
    """Return a region's strokes at a timeline frame, each as points (n, 2) in fractions of the picture.

    The region's motion (its location, rotation and scale) is not applied. A matte or ramp has no strokes.

    Args:
        index: Index of the region in the effect.

    Raises:
        EffectError: A stroke is beyond limits.MAX_DISTANCE.
    """
    if effect.regions[index].kind in strips.MATTES:
        return []
    with translated(rpt_):
        return region_at(scene, effect, strip, index, (frame,)).drawings.at(frame)


def region_at(scene: Scene, effect: PropertyGroup, strip: Strip, index: int, frames: Frames) -> Any:
    """Return a region as plain data, sampled at timeline frames, for tracking and drawing.

    An error that concerns only one frame is raised later, when that frame's values are read.

    Args:
        index: Index of the region in the effect.
        frames: The timeline frames.

    Returns:
        A MatteRegion for a matte or ramp, else a Region. An outline is given as a "lasso", with its curves as
        strokes; a subject as a "line", with the strokes that mark it or, without any, its outlines. The shutter is
        always 0, not the region's own.
    """
    read_region = _region if effect.regions[index].kind in strips.OUTLINED else _any_region
    return read_region(Sampling.of(scene, effect, strip, frames), index, 0)


def carried_outline(
    scene: Scene, effect: PropertyGroup, strip: Strip, index: int, frames: Frames
) -> tuple[Any, dict[float, int]]:
    """Return what is needed to read the mattes of a subject, or of an outline that is tracked between drawings.

    Args:
        index: Index of the region in the effect.
        frames: Timeline frames.

    Returns:
        The CarriedFile that makes the mattes, one for each frame of the footage. And by timeline frame, the number
        (from 0) of the frame of the footage that is shown there.

    Raises:
        EffectError, MediaError: The outline is not tracked (*Linear*), or there is no source that can be read.
    """
    sampling = Sampling.of(scene, effect, strip, frames)
    _curves, file = _drawn(sampling, index)
    if file is None:
        place = validation.place(effect.regions[index])
        raise EffectError(rpt_("{place}: a linear outline is not tracked").format(place=place))
    return file, matte_content.filmed_frames(sampling)


def source_frames(scene: Scene, effect: PropertyGroup, strip: Strip, frames: Frames) -> dict[float, int]:
    """Return which frame of the source's footage is shown at each timeline frame.

    Returns:
        By timeline frame, the number of the frame of the footage, from 0.

    Raises:
        EffectError, MediaError: The effect has no source strip, or that has no files or an unreadable movie.
    """
    return matte_content.filmed_frames(Sampling.of(scene, effect, strip, frames))


def camera_at(scene: Scene, effect: PropertyGroup, frames: Frames) -> model.Camera:
    """Return the effect's camera motion as plain data, sampled at timeline frames."""
    return _camera(Sampling.of(scene, effect, None, frames))


def check_counts(effect: PropertyGroup) -> None:
    """Check that an effect has a shutter, and not too many shutters or regions.

    Raises:
        EffectError: It has none, or too many.
    """
    if not effect.shutters:
        raise EffectError(rpt_('"{effect}" has no shutter').format(effect=effect.name))
    if full := validation.why_full(effect):
        raise EffectError(": ".join((validation.place(effect), full)))


def _options(sampling: Sampling) -> keyframes.Channel:
    """Return an effect's options over time. Asked for a frame at which one is out of range, they raise EffectError."""
    fields = fields_of(Options).items()
    found = {name: sampling.curves.find(f"{sampling.path}.{name}") for name, field in fields if field.keyed}
    keyed = {name: curve for name, curve in found.items() if curve}

    def at(frame: float) -> Options:
        numbers = {name: curve.evaluate(frame) for name, curve in keyed.items()}
        return Options(**{name: sampled.value(sampling.effect, field, numbers.get(name)) for name, field in fields})

    return sampling.over(keyed, at)


def _shutter(sampling: Sampling, index: int, options: keyframes.Channel) -> model.Shutter:
    """Return a shutter as the model has it, but with no followed region or camera, which `read` adds.

    If its bars cannot be read, the error is raised when they are asked for.

    Args:
        sampling: Reads the effect.
        index: Index of the shutter in the effect.
        options: Channel of the effect's options, which give the window's length.
    """
    path, shutter = f"{sampling.path}.shutters[{index}]", sampling.effect.shutters[index]
    bars = sampled.tried(_bars, sampling, path, shutter, options)
    if isinstance(bars, EffectError):
        bars = keyframes.Bars(keyframes.Constant(bars))
    unused = [] if shutter.use_threshold else ["threshold", "softness"]
    if validation.word(shutter, "follow") == "NOTHING" or shutter.length != "MOTION":
        unused += ["trail"] if shutter.length != "MOTION" else ["trail", "length"]
    return model.Shutter(bars=bars, **sampling.fields(shutter, path, model.Shutter, unused))


def _bars(sampling: Sampling, path: str, shutter: PropertyGroup, options: keyframes.Channel) -> keyframes.Bars:
    """Return a shutter's bars (how much each frame of its window counts) over time.

    If a bar is out of range at a frame, the error is raised when the bars at that frame are asked for.

    Args:
        sampling: Reads the effect.
        path: Data path of the shutter from the scene.
        options: Channel of the effect's options, which give the window's length.

    Raises:
        EffectError: The number of bars differs from the window's length.
    """
    curves, frames, stored = sampling.curves, sampling.frames, [bar.weight for bar in shutter.bars]
    keyed = {i: curve for i in range(len(stored)) if (curve := curves.find(f"{path}.bars[{i}].weight"))}
    chosen = (sampled.tried(options.at, frame) for frame in frames)
    for window in {state.window for state in chosen if isinstance(state, Options)}:
        if len(stored) != window:
            sentence = rpt_("{place}: {count} bars, and {window} frames")
            raise EffectError(sentence.format(place=validation.place(shutter), count=len(stored), window=window))
    if not keyed:
        return keyframes.Bars(keyframes.Constant(_bars_over(shutter, keyed, [0.0])[0.0]))
    keys = curves.keys(list(keyed.values()))
    ways = _ways(list(keyed.values()), [frame for frame, _ease in keys], frames) if keys else {}
    needed = {*frames, *(end for ends, _share in ways.values() for end in ends)}
    values = keyframes.Samples(_bars_over(shutter, keyed, sorted(needed)))
    if not keys:  # curves of samples or of modifiers alone
        return keyframes.Bars(values)
    return keyframes.Bars(values, keys, keyframes.Samples({frame: share for frame, (_ends, share) in ways.items()}))


def _bars_over(shutter: PropertyGroup, keyed: dict[int, FCurve], frames: Frames) -> dict[float, np.ndarray | UserError]:
    """Return a shutter's bars at timeline frames: how much each frame of its window counts.

    Bars without an F-curve have their stored value at all frames. F-curves are clipped to the range of bars.

    Args:
        keyed: F-curves by the index of the bar that they animate.

    Returns:
        The bars (L,) by timeline frame; an error in place of bars of which one is out of range or NaN.
    """
    rows = np.tile(np.array([bar.weight for bar in shutter.bars]), (len(frames), 1))
    for i, curve in keyed.items():
        # A curve may go below 0, a bar may not. NaN stays NaN, and is refused below.
        rows[:, i] = np.clip([curve.evaluate(frame) for frame in frames], 0.0, limits.MAX_BAR)
    usable = ((rows >= 0) & (rows <= limits.MAX_BAR)).all(axis=1)
    return {
        frame: row if good else sampled.tried(validation.check, shutter.bars, "weight", row)
        for frame, row, good in zip(frames, rows, usable, strict=True)
    }


def _ways(curves: list, keys: list[float], frames: Frames) -> dict[float, tuple[tuple[float, float], float]]:
    """Return which two keys are around each frame, and how far bars have come from the first to the second.

    Args:
        curves: F-curves of a shutter's bars.
        keys: Timeline frames of all their keys, ascending.
        frames: Timeline frames.

    Returns:
        For each frame: ((frame of the key before, frame of the key after), share 0 to 1). The curve whose value changes
        most between the two gives the share. On a key and outside all keys, both are the nearest key; the share is 0.
    """
    ways, leaders = {}, {}
    for frame in frames:
        before, after, _share = keyframes.span(keys, frame)
        ends = keys[before], keys[after]
        if ends not in leaders:
            reached = [(curve, curve.evaluate(ends[0]), curve.evaluate(ends[1])) for curve in curves]
            leaders[ends] = max(reached, key=lambda values: abs(values[2] - values[1]))
        ways[frame] = ends, progress(*leaders[ends], frame)
    return ways


def _any_region(sampling: Sampling, index: int, shutter: int) -> model.Region | model.MatteRegion:
    """Return a region of any kind (scribbles, outline, subject, matte or ramp) as the model has it.

    Args:
        sampling: Reads the effect.
        index: Index of the region in the effect.
        shutter: Index of the region's shutter in the effect.

    Raises:
        EffectError, MediaError: A matte has no content, a tracked outline or a subject has no source, or a setting is
            invalid.
    """
    region, path = sampling.effect.regions[index], f"{sampling.path}.regions[{index}]"
    if region.kind not in strips.LAID:
        return _region(sampling, index, shutter)
    moves = sampling.moves(region, path)
    kinds: dict = {"OUTLINE": model.OutlineRegion, "SUBJECT": model.SubjectRegion}
    drawn: dict = {}
    if region.kind in strips.OUTLINED:
        drawn, file = _drawn(sampling, index)
        content = mattes.FileFrames(file=file) if file else model.drawn_outlines(*drawn.values())
    else:
        content = matte_content.content(sampling, region, moves)
    kind = kinds.get(region.kind, model.MatteRegion)
    return kind(shutter=shutter, content=content, moves=moves, **drawn, **sampling.fields(region, path, kind))


def _drawn(sampling: Sampling, index: int) -> tuple[dict[str, Any], Any]:
    """Return the drawings of an outline or a subject, and what makes its mattes by tracking them through the footage.

    Args:
        sampling: Reads the effect.
        index: Index of the region in the effect.

    Returns:
        The drawings, by the names of the fields in the model's region class: "drawings" and, for a subject, also "nots"
        and "outlines". And a CarriedFile, or None for an outline that is not tracked (*Linear*).

    Raises:
        EffectError, MediaError: The mattes are tracked, but there is no source, or its files cannot be read.
    """
    region = sampling.effect.regions[index]
    is_subject = region.kind == "SUBJECT"
    names = dict(zip(("drawings", "nots", "outlines"), LAYERS, strict=True)) if is_subject else {"drawings": LAYERS[0]}
    drawn = {name: sampling.drawings(index, True, layer) for name, layer in names.items()}
    if not is_subject and validation.word(region, "between") == "STRAIGHT":
        return drawn, None
    *marks, curves = (_by_source_frame(sampling, each) for each in drawn.values())
    made: dict = matte_content.tracked(sampling) | {"drawings": tuple(sorted(curves.items()))}
    if not is_subject:
        return drawn, features.needed("CarriedFile")(**made)
    subject = features.needed("MarkedSubject")(strokes=marks[0], nots=marks[1])
    return drawn, features.needed("CarriedFile")(**made, subject=subject, model=preferences.model())


def _by_source_frame(sampling: Sampling, drawings: model.Drawings) -> dict[int, outlines.Curves]:
    """Return drawn curves by the frame of the footage, from 0, that the source shows at the timeline frame of each.

    The curves are in fractions of the picture. If two drawings lie on the same frame of the footage, the later counts.

    Raises:
        EffectError, MediaError: There is no source, or its files cannot be read.
    """
    there = replace(sampling, frames=drawings.frames)
    placed = replace(drawings, placement=there.placement)
    filmed = matte_content.filmed_frames(there).items()
    return {number: outlines.curves(placed.drawing(i, frame)) for i, (frame, number) in enumerate(filmed)}


def _region(sampling: Sampling, index: int, shutter: int) -> model.Region:
    region, path = sampling.effect.regions[index], f"{sampling.path}.regions[{index}]"
    layer = layer_of(sampling.effect, region)
    has_outlines_alone = region.kind == "SUBJECT" and not (layer and layer.frames)
    layer_name = "outline_layer" if has_outlines_alone else "layer"
    word = validation.word(region, "kind").lower()
    return model.Region(
        shutter=shutter,
        kind={"outline": "lasso", "subject": "line"}.get(word, word),
        drawings=sampling.drawings(index, layer_name=layer_name),
        moves=sampling.moves(region, path),
        **sampling.fields(region, path, model.Region),
    )


def _camera(sampling: Sampling) -> model.Camera:
    camera, path = sampling.effect.camera, sampling.effect.camera.path_from_id()
    return model.Camera(sampling.moves(camera, path), **sampling.fields(camera, path, model.Camera))


def recipe_of(scene: Scene, effect: PropertyGroup, strip: Strip, contents: Sequence = ()) -> model.Effect:
    """Return an effect in the form that recipe files have, whose frame 1 is the strip's first frame.

    Regions whose shutter does not exist are left out, and so are scribbles, outlines and subjects (what a model
    finds under strokes) of which nothing is drawn (see key_fitting.with_keys).

    Args:
        scene: The scene that has the strip.
        effect: The effect that the strip shows.
        strip: The effect strip.
        contents: The file or ramp that the recipe names for each matte and ramp region that is not left out, in the
            order of the regions. It replaces the region's own. The default is for effects without such regions.

    Raises:
        EffectError, MediaError: The effect cannot be rendered as it is, the strip or a key lies beyond
            limits.MAX_FRAME, or the strip is shown too small for strokes to be placed (annotations.image_to_picture).
    """
    check_counts(effect)
    shown, keyed = range(strip.left_handle, strip.right_handle), _keyed(scene, effect)
    for frame in (shown.start, shown.stop, *keyed):
        if not abs(frame) <= limits.MAX_FRAME:  # true for NaN
            sentence = rpt_('strip "{strip}": frame {frame} lies beyond the timeline')
            raise EffectError(sentence.format(strip=strip.name, frame=f"{frame:.7g}"))
    if effect.regions and image_to_picture(strip, picture_size(effect)) is None:
        raise EffectError(rpt_('strip "{strip}" is too small to find its scribbles').format(strip=strip.name))
    with translated(rpt_):
        return key_fitting.with_keys(read(scene, effect, strip, sorted({*shown, *keyed})), shown, contents)


def _keyed(scene: Scene, effect: PropertyGroup) -> set[float]:
    """Return the timeline frames at which an effect has keys or drawings."""
    curves, pace = curves_under(scene, effect.path_from_id() + "."), stretched(scene)
    frames = {frame for curve in curves for frame in (points_of(curve)[:, 0] / pace).tolist()}
    layers = (layer for region in effect.regions for layer in layers_of(effect, region))
    return frames.union(float(drawing.frame_number) for layer in layers for drawing in layer.frames)
