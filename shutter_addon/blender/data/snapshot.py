"""An effect strip as plain data, and as a recipe: the one place that reads what an effect is from Blender's data.

On Blender's main thread alone. What comes of it holds no Blender data, so that threads may read it, and it does not
change when the scene does. Channels are sampled at the frames that are asked for: Blender's F-curves are evaluated by
Blender itself. Drivers, NLA strips and further layers of an action do not count (docs/manual.md).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from bpy.app.translations import pgettext_n as n_
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import FCurve, PropertyGroup, Scene, Strip

from ...core.frames.retiming import StripTiming
from ...core.messages import EffectError, UserError, translated
from ...core.model import effect as model
from ...core.model import following, keyframes, limits, mattes, outlines
from ...core.model.fields import fields_of
from ...core.model.frame_state import Options
from ...core.recipes import baking
from ...media.carried_mattes import CarriedFile
from ...media.subject_mattes import SubjectFile
from . import matte_content, sampled, source_media, strips, validation
from .annotations import LAYERS, image_to_picture, layer_of, layers_of, picture_size
from .fcurves import Curves, curves_under, key_frames, leading, progress, stretched
from .sampled import Frames

# Sentences of core/model/effect.py, which are looked up where they are passed on.
_CORE = (
    n_('shutter "{name}" at frame {frame}: {fault}'),
    n_('region "{name}": a point of its strokes is too far from the picture'),
    n_('region "{name}": more than {most} points together with the regions before it'),
    n_('shutter "{name}": bars {first} to {last} of the older file are one filmed frame now, and expose other moments'),
)


@dataclass(frozen=True, eq=False)
class Snapshot:
    """All that the pictures of an effect strip depend on; frames are timeline frames.

    scene: session_uid of the effect's scene, whose frame 0 is shown at the timeline frame `origin`
    effect: its channels are sampled at `frames`
    source: what is read, and `timing`, when; None: the effect's own source time says that
    blended: the sequencer's colour space, in which Blender lays the strip over others; "": it does not
    first: the strip's first timeline frame; film: from frame to frame of the scene's film, and its last frame
    folder: that of the .blend file; None: it was not saved"""

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
        """The timeline frame at which the effect's scene is at one of its own."""
        return self.origin + scene_frame


def take(scene: Scene, effect: PropertyGroup, strip: Strip, frames: Frames) -> Snapshot:
    """The snapshot of an effect strip at timeline frames. EffectError, MediaError: there is no source, or no picture at
    any frame."""
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
    """An effect, its channels sampled at timeline frames; strip: the effect strip that shows it. EffectError: it has no
    shutter, or more of anything than an effect has. What is wrong at one frame is told at that frame."""
    check_counts(effect)
    curves, path = Curves(scene), effect.path_from_id()
    options = _options(curves, path, effect, frames)
    names = [shutter.name for shutter in effect.shutters]
    followed = {shutter.follow_region for shutter in effect.shutters if shutter.follow == "REGION"}
    layers = any(region.is_layer for region in effect.regions)
    if layers:  # then every one says where they are, in all frames around
        followed = {region.name for region in effect.regions}
    around = _around(effect, frames)
    sampling = _Sampling.of(curves, effect, strip, around)
    regions = tuple(
        _any_region(
            sampling if region.name in followed else replace(sampling, frames=frames), i, names.index(region.shutter)
        )
        for i, region in enumerate(effect.regions)
        if region.shutter in names
    )
    camera = _camera(curves, effect, around)
    return model.Effect(
        shutters=tuple(
            replace(_shutter(curves, effect, i, options, frames), follow=_followed(shutter, regions, camera))
            for i, shutter in enumerate(effect.shutters)
        ),
        regions=regions,
        options=options,
        time=sampling.time,
        camera=camera,
        **sampled.sampled_fields(curves, effect, path, model.Effect, around if layers else frames),
    )


def _around(effect: PropertyGroup, frames: Frames) -> Frames:
    """The frames at which motions are asked for: where a shutter follows something, or a region is a layer, those
    around these frames too."""
    has_layers = any(region.is_layer for region in effect.regions)
    if not has_layers and all(shutter.follow == "NOTHING" for shutter in effect.shutters):
        beside = int(any(shutter.length == "TIMELINE" for shutter in effect.shutters))
        return np.unique(np.add.outer(sorted(frames), np.arange(-beside, beside + 1))).tolist() if beside else frames
    smooth = max(validation.number(shutter, "follow_smooth") for shutter in effect.shutters)
    reach = following.reach(validation.number(effect, "window")) + smooth
    if has_layers:
        reach += validation.number(effect, "plate_reach") + 1
    return np.unique(np.add.outer(sorted(frames), np.arange(-reach, reach + 1))).tolist()


def _followed(shutter: PropertyGroup, regions: Sequence[model.AnyRegion], camera: model.Camera) -> model.Subject | None:
    """What a shutter follows. EffectError: there is no such region."""
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
    """Bars (L,) of a shutter at a timeline frame, whether or not a picture can be made of them. EffectError: they are
    not as many as the window is long, or one cannot be."""
    curves, frames = Curves(scene), (frame,)
    options = _options(curves, effect.path_from_id(), effect, frames)
    shutter = _shutter(curves, effect, index, options, frames)
    return shutter.bars.at(frame, options.at(frame).interpolation)


def strokes_at(scene: Scene, effect: PropertyGroup, strip: Strip, index: int, frame: float) -> list[np.ndarray]:
    """A region's strokes (n, 2) on the picture at a timeline frame, not moved yet; a matte has none. EffectError: they
    lie nowhere."""
    if effect.regions[index].kind in strips.MATTES:
        return []
    with translated(rpt_):
        return region_at(scene, effect, strip, index, (frame,)).drawings.at(frame)


def region_at(scene: Scene, effect: PropertyGroup, strip: Strip, index: int, frames: Frames) -> Any:
    """A region as plain data, by its kind a Region or a MatteRegion, its channels sampled at timeline frames; an
    outline is the Region that its curves would be as a lasso, and a subject that of its strokes as lines. What is wrong
    at one frame is told at that frame."""
    read_region = _region if effect.regions[index].kind in strips.OUTLINED else _any_region
    return read_region(_Sampling.of(Curves(scene), effect, strip, frames), index, 0)


def matte_content_at(
    scene: Scene, effect: PropertyGroup, strip: Strip, index: int, frames: Frames
) -> keyframes.Channel:
    """The content of a region that is a matte, an outline too, sampled at timeline frames; as region_at."""
    region: Any = _any_region(_Sampling.of(Curves(scene), effect, strip, frames), index, 0)
    return region.content


def carried_outline(
    scene: Scene, effect: PropertyGroup, strip: Strip, index: int, frames: Frames
) -> tuple[CarriedFile | SubjectFile, dict[float, int]]:
    """What gives the mattes of an outline or a subject, and which of the source's filmed frames timeline frames show.
    EffectError, MediaError: it is straight, or has no source."""
    region = effect.regions[index]
    sampling = _Sampling.of(Curves(scene), effect, strip, frames)
    shown = source_frames(scene, effect, strip, frames)
    if region.kind == "SUBJECT":
        return _subject_file(sampling, *_marks(sampling, index).values()), shown
    if validation.word(region, "between") == "STRAIGHT":
        raise EffectError(rpt_("{place}: a linear outline is not tracked").format(place=validation.place(region)))
    return _carried(sampling, _drawings(sampling, index)), shown


def drawn_outline(scene: Scene, effect: PropertyGroup, strip: Strip, index: int) -> dict[int, outlines.Curves]:
    """The curves of an outline by the source's filmed frame at which they are drawn. EffectError, MediaError: it has no
    source."""
    sampling = _Sampling.of(Curves(scene), effect, strip, ())
    return _by_source_frame(sampling, _drawings(sampling, index))


def source_frames(scene: Scene, effect: PropertyGroup, strip: Strip, frames: Frames) -> dict[float, int]:
    """Which of the source's filmed frames an effect strip shows, by timeline frame. EffectError, MediaError: nobody
    knows."""
    time = _Sampling.of(Curves(scene), effect, strip, frames).time
    shown = matte_content.shown_frame(scene, effect, strip, time)
    return {frame: int(shown(frame)) for frame in frames}


def last_shown(scene: Scene, effect: PropertyGroup, strip: Strip) -> float:
    """The last of the source's frames that an effect strip shows (see matte_content.shown_frame); where keys say which
    these are, of a hundred frames of the strip. EffectError, MediaError: it cannot be known."""
    first, last = strip.left_handle, strip.right_handle - 1
    frames, time = (first, last), None
    if effect.use_source_time:
        frames = *range(first, last, max(1, (last - first) // 100)), last
        time = sampled.source_time(Curves(scene), effect.path_from_id(), effect, frames)
    return max(map(matte_content.shown_frame(scene, effect, strip, time), frames))


def camera_at(scene: Scene, effect: PropertyGroup, frames: Frames) -> model.Camera:
    """The camera as plain data, its channels sampled at timeline frames; as region_at."""
    return _camera(Curves(scene), effect, frames)


def check_counts(effect: PropertyGroup) -> None:
    """EffectError: there are no shutters, or more of anything than an effect has."""
    if not effect.shutters:
        raise EffectError(rpt_('"{effect}" has no shutter').format(effect=effect.name))
    for sentence, items, most in (
        (rpt_("{place}: {count} shutters, {most} are the most"), effect.shutters, limits.MAX_SHUTTERS),
        (rpt_("{place}: {count} regions, {most} are the most"), effect.regions, limits.MAX_REGIONS),
    ):
        if len(items) > most:
            raise EffectError(sentence.format(place=validation.place(effect), count=len(items), most=most))


def _options(curves: Curves, path: str, effect: PropertyGroup, frames: Frames) -> keyframes.Channel:
    """EffectErrors in it: an option that no effect can have."""
    fields = fields_of(Options).items()
    try:
        keyed = {name: curves.find(f"{path}.{name}") for name, field in fields if field.keyed}
    except EffectError as error:
        return keyframes.Constant(error)

    def at(frame: float) -> Options:
        numbers = {name: curve.evaluate(frame) for name, curve in keyed.items() if curve is not None}
        return Options(**{name: sampled.value(effect, field, numbers.get(name)) for name, field in fields})

    return sampled.over(frames if any(keyed.values()) else None, at)


def _shutter(
    curves: Curves, effect: PropertyGroup, index: int, options: keyframes.Channel, frames: Frames
) -> model.Shutter:
    """A shutter, but for what it follows."""
    path, shutter = f"{effect.path_from_id()}.shutters[{index}]", effect.shutters[index]
    bars = sampled.tried(_bars, curves, path, shutter, options, frames)
    if isinstance(bars, EffectError):
        bars = keyframes.Bars(keyframes.Constant(bars))
    unused = [] if shutter.use_threshold else ["threshold", "softness"]
    if validation.word(shutter, "follow") == "NOTHING" or shutter.length != "MOTION":
        unused += ["trail"] if shutter.length != "MOTION" else ["trail", "length"]
    return model.Shutter(bars=bars, **sampled.sampled_fields(curves, shutter, path, model.Shutter, frames, unused))


def _bars(
    curves: Curves, path: str, shutter: PropertyGroup, options: keyframes.Channel, frames: Frames
) -> keyframes.Bars:
    """EffectError: they are not as many as the window is long."""
    stored = [bar.weight for bar in shutter.bars]
    keyed = {i: curve for i in range(len(stored)) if (curve := curves.find(f"{path}.bars[{i}].weight"))}
    chosen = (sampled.tried(options.at, frame) for frame in frames)
    for window in {state.window for state in chosen if isinstance(state, Options)}:
        check_bar_count(shutter, window)
    if not keyed:
        return keyframes.Bars(keyframes.Constant(_bars_over(shutter, stored, keyed, [0.0])[0.0]))
    keys = curves.keys(list(keyed.values()))
    ways = _ways(list(keyed.values()), [frame for frame, _ease in keys], frames) if keys else {}
    needed = {*frames, *(end for ends, _share in ways.values() for end in ends)}
    values = keyframes.Samples(_bars_over(shutter, stored, keyed, sorted(needed)))
    if not keys:  # curves of samples or of modifiers alone
        return keyframes.Bars(values)
    return keyframes.Bars(values, keys, keyframes.Samples({frame: share for frame, (_ends, share) in ways.items()}))


def _bars_over(
    shutter: PropertyGroup, stored: list[float], keyed: dict[int, FCurve], frames: list[float]
) -> dict[float, np.ndarray | UserError]:
    """The bars (L,) at frames; keyed: F-curves by the bar's index."""
    rows = np.tile(np.array(stored), (len(frames), 1))
    for i, curve in keyed.items():
        # No bar is below 0, a curve may be; "not a number" stays what it is.
        rows[:, i] = np.clip([curve.evaluate(frame) for frame in frames], 0.0, limits.MAX_BAR)
    usable = ((rows >= 0) & (rows <= limits.MAX_BAR)).all(axis=1)
    return {
        frame: row if good else sampled.tried(validation.check, shutter.bars, "weight", row)
        for frame, row, good in zip(frames, rows, usable, strict=True)
    }


def _ways(curves: list, keys: list[float], frames: Frames) -> dict[float, tuple[tuple[float, float], float]]:
    """Of frames, the keys before and after each, and how far the curve has gone between them that changes most."""
    ways, leaders = {}, {}
    for frame in frames:
        before, after, _share = keyframes.span(keys, frame)
        ends = keys[before], keys[after]
        if ends not in leaders:
            leaders[ends] = leading(curves, *ends)
        ways[frame] = ends, progress(*leaders[ends], frame)
    return ways


def check_bar_count(shutter: PropertyGroup, window: int) -> None:
    """EffectError: a shutter has not as many bars as the window is long."""
    if len(shutter.bars) != window:
        sentence = rpt_("{place}: {count} bars, and {window} frames")
        raise EffectError(sentence.format(place=validation.place(shutter), count=len(shutter.bars), window=window))


@dataclass(frozen=True)
class _Sampling:
    """What the regions of an effect are read from.

    frames: the timeline frames at which channels are sampled
    placement: of the strip's picture (sampled.placement); time: of the source, None where its strip says that"""

    curves: Curves
    effect: PropertyGroup
    strip: Strip
    frames: Frames
    placement: keyframes.Channel
    time: keyframes.Channel | None

    @staticmethod
    def of(curves: Curves, effect: PropertyGroup, strip: Strip, frames: Frames) -> _Sampling:
        moments, time = frames, None
        if any(shutter.length == "TIMELINE" for shutter in effect.shutters):
            moments = np.unique(np.add.outer(sorted(frames), (-0.5, 0, 0.5))).tolist()
        if effect.use_source_time:
            time = sampled.source_time(curves, effect.path_from_id(), effect, moments)
        return _Sampling(
            curves=curves,
            effect=effect,
            strip=strip,
            frames=frames,
            placement=sampled.placement(curves, effect, strip, frames),
            time=time,
        )


def _any_region(sampling: _Sampling, index: int, shutter: int) -> model.Region | model.MatteRegion:
    """The region of that index; shutter: the index of its shutter."""
    effect, curves, frames = sampling.effect, sampling.curves, sampling.frames
    region, path = effect.regions[index], f"{effect.path_from_id()}.regions[{index}]"
    if region.kind not in strips.LAID:
        return _region(sampling, index, shutter)
    moves = sampled.moves(curves, region, path, frames)
    kind: type[model.MatteRegion] = model.MatteRegion
    drawn: dict = {}
    if region.kind == "OUTLINE":
        drawings = _drawings(sampling, index)
        kind, drawn = model.OutlineRegion, {"drawings": drawings}
        content = sampled.tried(_outlines, sampling, region, drawings)
    elif region.kind == "SUBJECT":
        kind, drawn = model.SubjectRegion, _marks(sampling, index)
        content = sampled.tried(lambda: mattes.FileFrames(file=_subject_file(sampling, *drawn.values())))
    else:
        content = sampled.tried(matte_content.content, effect, sampling.strip, region, moves, frames, sampling.time)
    fields = sampled.tried(sampled.sampled_fields, curves, region, path, kind, frames)
    if isinstance(fields, UserError):  # of a choice; it is told where the matte is asked for
        content = content if isinstance(content, UserError) else fields
        choices = [name for name, each in fields_of(kind).items() if each.choices]
        fields = sampled.sampled_fields(curves, region, path, kind, frames, choices)
    if isinstance(content, UserError):
        content = keyframes.Constant(content)
    return kind(shutter=shutter, content=content, moves=moves, **drawn, **fields)


def _outlines(sampling: _Sampling, region: PropertyGroup, drawings: model.Drawings) -> keyframes.Channel:
    """The content of an outline. EffectError, MediaError: there is no source."""
    if validation.word(region, "between") == "STRAIGHT":
        return model.drawn_outlines(drawings)
    return mattes.FileFrames(file=_carried(sampling, drawings))


def _carried(sampling: _Sampling, drawings: model.Drawings) -> CarriedFile:
    drawn = _by_source_frame(sampling, drawings)
    return matte_content.carried_file(sampling.effect, sampling.strip, drawn)


def _subject_file(sampling: _Sampling, *marks: model.Drawings) -> SubjectFile:
    """marks: of _marks."""
    strokes, nots, drawn = (_by_source_frame(sampling, each) for each in marks)
    return matte_content.subject_file(sampling.effect, sampling.strip, strokes, nots, drawn)


def _by_source_frame(sampling: _Sampling, drawings: model.Drawings) -> dict[int, outlines.Curves]:
    """The curves of drawings by the source's filmed frame. EffectError, MediaError: there is no source."""
    numbers, effect, strip = drawings.frames, sampling.effect, sampling.strip
    there = _Sampling.of(sampling.curves, effect, strip, numbers)
    placed = replace(drawings, placement=there.placement)
    shown = matte_content.shown_frame(effect.id_data, effect, strip, there.time)
    return {int(shown(frame)): outlines.curves(placed.drawing(i, frame)) for i, frame in enumerate(numbers)}


def _drawings(sampling: _Sampling, index: int, layer: str = "layer") -> model.Drawings:
    effect, path = sampling.effect, f"{sampling.effect.path_from_id()}.regions[{index}]"
    return sampled.drawings(sampling.curves, path, effect, effect.regions[index], sampling.placement, None, layer)


def _marks(sampling: _Sampling, index: int) -> dict[str, model.Drawings]:
    """What is drawn in a subject, by the names of model.SubjectRegion."""
    names = "drawings", "nots", "outlines"
    return {name: _drawings(sampling, index, layer) for name, layer in zip(names, LAYERS, strict=True)}


def _region(sampling: _Sampling, index: int, shutter: int) -> model.Region:
    effect, curves, frames = sampling.effect, sampling.curves, sampling.frames
    region, path = effect.regions[index], f"{effect.path_from_id()}.regions[{index}]"
    layer = layer_of(effect, region)
    has_outlines_alone = region.kind == "SUBJECT" and not (layer and layer.frames)
    name = "outline_layer" if has_outlines_alone else "layer"
    return model.Region(
        shutter=shutter,
        kind=keyframes.Constant(sampled.tried(_word_of_kind, region)),
        drawings=sampled.drawings(curves, path, effect, region, sampling.placement, frames, name),
        moves=sampled.moves(curves, region, path, frames),
        **sampled.sampled_fields(curves, region, path, model.Region, frames),
    )


def _word_of_kind(region: PropertyGroup) -> str:
    word = validation.word(region, "kind").lower()
    return {"outline": "lasso", "subject": "line"}.get(word, word)


def _camera(curves: Curves, effect: PropertyGroup, frames: Frames) -> model.Camera:
    path = effect.camera.path_from_id()
    moves = sampled.moves(curves, effect.camera, path, frames)
    return model.Camera(moves, **sampled.sampled_fields(curves, effect.camera, path, model.Camera, frames))


def recipe_of(scene: Scene, effect: PropertyGroup, strip: Strip, contents: Sequence = ()) -> model.Effect:
    """The effect as a recipe, whose frame 1 is the strip's first; left out is what baking.baked leaves out, and regions
    without a shutter. contents: see baking.baked. EffectError: it cannot be rendered as it stands."""
    check_counts(effect)
    shown = range(strip.left_handle, strip.right_handle)
    if not -limits.MAX_FRAME <= shown.start <= shown.stop <= limits.MAX_FRAME:
        sentence = rpt_('strip "{strip}" lies at frames {first} to {last}, where no timeline is')
        raise EffectError(sentence.format(strip=strip.name, first=shown.start, last=shown.stop - 1))
    drawn = [region for region in strips.drawn_regions(effect) if layers_of(effect, region)]
    for item in (*effect.shutters, *drawn, *strips.matte_regions(effect)):
        _check_name(item)
    for shutter in effect.shutters:
        for component in shutter.color:
            validation.number(shutter, "color", component)
    if effect.regions and image_to_picture(strip, picture_size(effect)) is None:
        sentence = rpt_('strip "{strip}" is too small to find its scribbles')
        raise EffectError(sentence.format(strip=strip.name))
    with translated(rpt_):
        plain = read(scene, effect, strip, sorted({*shown, *_keyed(scene, effect)}))
        return baking.baked(plain, shown, contents)


def _keyed(scene: Scene, effect: PropertyGroup) -> set[float]:
    """The timeline frames of the effect's keys and drawings."""
    curves, pace = curves_under(scene, effect.path_from_id() + "."), stretched(scene)
    # In float32, as the keys of Curves are.
    frames = set((np.array(key_frames(curves), np.float32) / pace).tolist())
    layers = (layer for region in effect.regions for layer in layers_of(effect, region))
    return frames.union(float(drawing.frame_number) for layer in layers for drawing in layer.frames)


def _check_name(item: PropertyGroup) -> None:
    """EffectError: the name is longer than a recipe has it, from a script or a file of another version."""
    if len(item.name) > limits.MAX_NAME:
        sentence = rpt_("{place}: its name has {count} characters, {most} are the most")
        words = {"place": validation.place(item), "count": len(item.name), "most": limits.MAX_NAME}
        raise EffectError(sentence.format(**words))
