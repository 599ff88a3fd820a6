"""The command `track`: keys for a region of a recipe, which follows what it covers, or for the camera."""

import json
from argparse import ArgumentParser, Namespace
from contextlib import ExitStack
from dataclasses import replace
from typing import Any

from .... import features
from ....blender.commands import command_line
from ....blender.data import preferences
from ....blender.data.source_media import SourceSpec
from ....blender.output import film_output
from ....blender.rendering import effect_source, render_job
from ....core import atomic_write
from ....core.frames.frame_source import FrameSource
from ....core.model import outlines, presence
from ....core.model.clip import Clip
from ....core.model.effect import Camera, Effect, OutlineRegion, Region, SubjectRegion
from ....core.model.scribbles import Drawings
from ....core.recipes import recipe, recipe_file, region_keys
from ....media import PrefetchSource
from ....media.cuts import ShotSource
from ....media.footage import Footage
from .. import camera_tracking, matte_tracking, registration, tracking

HELP = "follow what a region covers, or the camera"


def add(parser: ArgumentParser) -> None:
    option, to_path = parser.add_argument, command_line.to_path
    option("source", type=to_path, help="a movie, or the first file of an image sequence")
    option("--recipe", type=to_path, required=True, help="the effect, a JSON file")
    option("--region", metavar="NAME", help="the region to track")
    option("--camera", action="store_true", help="track the camera instead, by everything outside of regions")
    option("--frame", type=int, required=True, metavar="F", help="the frame at which it is in place")
    option("--frames", metavar="A:B", help="timeline frames A to B, both ways from F; 1 is the strip's first")
    option("--motion", choices=registration.MOTIONS, default="scale", help="location; rotation too; or scale as well")
    option("--all-keys", action="store_true", help="a key at every frame, needed or not")
    option("--hold", action="store_true", help="stay opaque where the track has ended: no keys of opacity")
    option("--output", type=to_path, required=True, metavar="R2.json", help="the recipe with the keys")
    option("--report", type=to_path, metavar="FILE.json", help="each frame's confidence, and where tracking ended")


def run(arguments: Namespace) -> None:
    if arguments.camera == (arguments.region is not None):
        raise film_output.OutputError("track: give either --region NAME or --camera")
    source_recipe = command_line.recipe(arguments.recipe)
    index = None if arguments.camera else _region_index(arguments, source_recipe)
    subject = recipe.CAMERA if arguments.camera else arguments.region
    with command_line.open_footage(arguments.source) as medium:
        film_output.refuse_overwriting(
            filter(None, (arguments.output, arguments.report)),
            [arguments.source, *command_line.files(medium), arguments.recipe],
        )
        frames = command_line.frames(arguments.frames, range(1, command_line.length(medium, source_recipe) + 1))
        if arguments.frame not in frames:
            within = f"{frames[0]}:{frames[-1]}"
            raise film_output.OutputError(f"--frame: {arguments.frame} is not within the frames {within}")
        try:
            tracked, stops = _followed(arguments, source_recipe, index, medium, frames)
        except tracking.TrackingError as error:
            raise tracking.TrackingError(f"{subject}: {error}") from None
        size = medium.width, medium.height
    old: Any = source_recipe.camera if index is None else source_recipe.regions[index]
    placements = {frame: step.placement for frame, step in tracked.items()}
    new: Any = region_keys.with_placements(old, placements, {arguments.frame}, size, thin=not arguments.all_keys)
    if not arguments.hold:
        reach = replace(source_recipe.options.at(1), step=1).reach  # the bars of a recipe count filmed frames
        new = _ended(new, reach, tracked, stops, arguments.frame, frames)
    regions = [new if region is old else region for region in source_recipe.regions]
    keyed = source_recipe.with_parts(regions, new if index is None else None)
    _write_track(arguments, keyed, tracked, stops)
    for stop in stops:
        said = f"{subject}: not tracked from frame {stop.frame} on: {stop.fault}"  # not translated
        render_job.say(said)


def _region_index(arguments: Namespace, source_recipe: Effect) -> int:
    names = [region.name for region in source_recipe.regions]
    if arguments.region not in names:
        raise film_output.OutputError(f'{arguments.recipe}: there is no region "{arguments.region}"')
    index = names.index(arguments.region)
    if not isinstance(source_recipe.regions[index], Region | OutlineRegion | SubjectRegion):
        fault = f'region "{arguments.region}" is a matte or a ramp, and has no strokes to track'
        raise film_output.OutputError(f"{arguments.recipe}: {fault}")
    return index


def _followed(
    arguments: Namespace, source_recipe: Effect, index: int | None, medium: FrameSource, frames: range
) -> tuple[dict, list]:
    """Track a region or the camera. Return the found steps by frame, and where tracking ended early.

    Raises:
        TrackingError: Tracking failed at the first frame.
    """
    effect = source_recipe.for_picture(medium.width / medium.height)
    subject: Any = effect.camera if index is None else effect.regions[index]
    options = source_recipe.options.at(1)
    step = effect_source.steps_of(medium, options.step, options.window, skip_repeats=options.skip_repeats)
    with ExitStack() as ends:
        moments = medium if step == 1 else features.needed("SmoothSource")(medium, step)
        shots = ends.enter_context(ShotSource(PrefetchSource(moments), step))
        moved = ends.enter_context(film_output.progress(len(frames), "frame"))
        clip = Clip.of(shots, source_recipe.time)
        footage = Footage(shots, lambda frame: clip.shown(frame).source_frame)
        if index is None:
            regions = [region for region in effect.regions if isinstance(region, Region)]
            track: tracking.Track = camera_tracking.CameraTrack(subject, regions)
        elif isinstance(subject, OutlineRegion | SubjectRegion):
            track = matte_tracking.MatteTrack(subject, _cover(arguments, subject, clip, ends))
        else:
            track = tracking.RegionTrack(subject)
        tracked = []
        for each in track.follow(footage, arguments.frame, frames, motion=arguments.motion):
            tracked.append(each)
            moved()
    stops = [each for each in tracked if each.fault]
    if len(tracked) - len(stops) < 2:
        raise tracking.TrackingError(stops[0].fault if stops else tracking.ALONE)
    return {each.frame: each for each in tracked if not each.fault}, stops


def _cover(
    arguments: Namespace, region: OutlineRegion | SubjectRegion, clip: Clip, ends: ExitStack
) -> matte_tracking.Cover:
    """Return the cover of an outline or a subject; `ends` closes its mattes."""
    if isinstance(region, OutlineRegion) and region.between == "straight":
        return matte_tracking.cover_within(region.drawings.at)

    def filmed(frame: float) -> int:
        return clip.shown(frame).source_frame // clip.step

    def curves(drawn: Drawings) -> dict[int, outlines.Curves]:
        pairs = zip(drawn.frames, drawn.strokes, strict=True)
        return {filmed(frame): outlines.curves(strokes) for frame, strokes in pairs}

    drawings, subject = region.drawings, None
    if isinstance(region, SubjectRegion):
        drawings = region.outlines
        subject = features.needed("MarkedSubject")(strokes=curves(region.drawings), nots=curves(region.nots))
    footage = SourceSpec(key=(), path=arguments.source, files=None, options={})
    drawn = tuple(sorted(curves(drawings).items()))
    file = features.needed("CarriedFile")(footage, drawn, None, subject, preferences.model())
    return matte_tracking.cover_of(ends.enter_context(file.open()), filmed)


def _ended(moving: Any, reach: int, tracked: dict, stops: list, start: int, frames: range) -> Any:
    """Return the region or camera with keys that fade it out where it was not tracked."""
    seen = [frame for frame, step in tracked.items() if step.confidence > 0]
    ends = [presence.Stop(stop.frame, stop.frame > start, stop.fault == tracking.SHOT_ENDS) for stop in stops]
    if isinstance(moving, Camera):
        keys = presence.keys(seen, ends, (), max(reach, presence.FADE), beside=1)
        return replace(moving, influence=region_keys.with_ends(moving.influence, keys, frames))
    if isinstance(moving, OutlineRegion | SubjectRegion):  # its matte is empty there
        return moving
    keys = presence.keys(seen, ends, {start})
    return replace(moving, opacity=region_keys.with_ends(moving.opacity, keys, frames))


def _write_track(arguments: Namespace, result: Effect, tracked: dict, stops: list) -> None:
    """Write the recipe and the report, both or neither."""
    report = {
        **({"camera": True} if arguments.camera else {"region": arguments.region}),
        "frame": arguments.frame,
        "motion": arguments.motion,
        "frames": [{"frame": n, "confidence": round(tracked[n].confidence, 3)} for n in sorted(tracked)],
        "stops": [{"frame": stop.frame, "reason": stop.fault} for stop in stops],
    }
    for path in filter(None, (arguments.output, arguments.report)):
        film_output.make_folder(path.parent)
    with atomic_write.writing(arguments.output) as part:
        moved = recipe.moved(result, arguments.recipe.parent, arguments.output.parent)
        part.write_text(recipe_file.dump(moved), encoding="utf-8")
        if arguments.report:
            with atomic_write.writing(arguments.report) as other:
                other.write_text(json.dumps(report, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
