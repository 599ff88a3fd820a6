"""The command `track`: track a region of a recipe, or the camera, through footage, and write a recipe with the keys.

It makes an edit, tracks there as *Track* does in the window, and exports the effect.
"""

import json
from argparse import ArgumentParser, Namespace
from collections.abc import Iterator
from typing import Any

from bpy.types import FCurve, PropertyGroup

from ....blender.commands import command_line, render_command
from ....blender.data import fcurves, selection, strips
from ....blender.editing import motion_keys
from ....blender.editing.motion_keys import MotionKeys
from ....blender.output import film_output, matte_export
from ....blender.rendering import render_job
from ....core import atomic_write
from ....core.messages import EffectError
from ....core.model.effect import Effect
from ....core.recipes import recipe, recipe_file
from .. import registration
from . import track_region

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
    with command_line.open_footage(arguments.source) as medium:
        film_output.refuse_overwriting(
            filter(None, (arguments.output, arguments.report)),
            [arguments.source, *command_line.files(medium), arguments.recipe],
        )
        frames = command_line.frames(arguments.frames, range(1, command_line.length(medium, source_recipe) + 1))
        if arguments.frame not in frames:
            within = f"{frames[0]}:{frames[-1]}"
            raise film_output.OutputError(f"--frame: {arguments.frame} is not within the frames {within}")
        scene = render_command.make_edit(arguments.source, medium, source_recipe, arguments.recipe.parent)
    scene.frame_set(arguments.frame)
    _scene, effect, strip = selection.seen(scene)
    index, subject = (None, recipe.CAMERA) if arguments.camera else (_region_index(arguments, effect), arguments.region)
    moving = selection.moving(effect, index)
    moving.motion, moving.track_all_keys = arguments.motion.upper(), arguments.all_keys
    moving.track_ends = not arguments.hold
    keys = MotionKeys(effect, index, moving.motion)
    _offer_keys(keys, frames)
    tracked = {arguments.frame}
    try:
        with film_output.progress(len(frames), "frame") as moved:
            moved()
            for frame in track_region.track(scene, effect, strip, index, frames):
                tracked.add(frame)
                moved()
    except EffectError as error:
        raise film_output.OutputError(f"{subject}: {error}") from None
    _drop_keys_between(keys, tracked)
    stops = sorted((round(effect.start + stop.frame), stop.fault) for stop in moving.stops)
    sure = zip(*(each.tolist() for each in keys.confidence()), strict=True)
    report = {
        **({"camera": True} if arguments.camera else {"region": arguments.region}),
        "frame": arguments.frame,
        "motion": arguments.motion,
        "frames": [{"frame": int(frame), "confidence": round(share, 3)} for frame, share in sure if frame in tracked],
        "stops": [{"frame": frame, "reason": fault} for frame, fault in stops],
    }
    _write(arguments, matte_export.recipe_for(scene, effect, strip, arguments.output), report)
    for frame, fault in stops:
        said = f"{subject}: not tracked from frame {frame} on: {fault}"  # not translated
        render_job.say(said)


def _region_index(arguments: Namespace, effect: PropertyGroup) -> int:
    if (index := effect.regions.find(arguments.region)) < 0:
        raise film_output.OutputError(f'{arguments.recipe}: there is no region "{arguments.region}"')
    if effect.regions[index].kind in strips.MATTES:
        fault = f'region "{arguments.region}" is a matte or a ramp, and has no strokes to track'
        raise film_output.OutputError(f"{arguments.recipe}: {fault}")
    return index


def _curves(keys: MotionKeys) -> Iterator[FCurve]:
    path = selection.moving(keys.effect, keys.index).path_from_id()
    for name in motion_keys.CHANNELS:
        yield from fcurves.curves_under(keys.effect.id_data, f"{path}.{name}")


def _offer_keys(keys: MotionKeys, frames: range) -> None:
    """Mark the keys of a motion at some frames as made by tracking, so that tracking may replace them."""
    for key in (key for curve in _curves(keys) for key in curve.keyframe_points):
        if frames[0] <= key.co[0] <= frames[-1]:
            key.type, key.back = motion_keys.MADE, key.co[1]


def _drop_keys_between(keys: MotionKeys, tracked: set[int]) -> None:
    """Remove the keys of a motion between the first and the last tracked frame, except at tracked frames."""
    for curve in _curves(keys):
        for key in list(curve.keyframe_points)[::-1]:
            if min(tracked) < key.co[0] < max(tracked) and key.co[0] not in tracked:
                curve.keyframe_points.remove(key, fast=True)
        curve.update()


def _write(arguments: Namespace, result: Effect, report: dict[str, Any]) -> None:
    """Write the recipe to --output and the report to --report, both or neither."""
    for path in filter(None, (arguments.output, arguments.report)):
        film_output.make_folder(path.parent)
    with atomic_write.writing(arguments.output) as part:
        part.write_text(recipe_file.dump(result), encoding="utf-8")
        if arguments.report:
            with atomic_write.writing(arguments.report) as other:
                other.write_text(json.dumps(report, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
