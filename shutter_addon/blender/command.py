"""The command: from a source and a recipe to a finished film, through Blender's sequencer.

`python -m shutter_addon render …`, and `blender -c shutter render …` in an installed Blender. `inbetween` in place of
`render` builds in-between frames alone, `track` has a recipe's region follow what it covers, or its camera what stands
still, `benchmark` measures the machine.
"""

import argparse
import json
import os
import re
import sys
import traceback
from contextlib import contextmanager, suppress
from dataclasses import replace
from itertools import groupby
from pathlib import Path
from typing import get_args

import bpy

from ..compute import benchmark
from ..compute.device import NoDeviceError
from ..core import atomic_write, recipe, region_keys, retiming
from ..core.effect import Region
from ..core.messages import sentence, signed
from ..media import MediaError, PrefetchSource, camera_tracking, filmed_frames, open_source, registration, tracking
from ..media.completeness import is_whole_blend, why_short
from ..media.cuts import ShotSource
from ..media.files import check_name
from ..media.matte_files import MatteFile
from ..media.sequence import by_number
from .data import inbetween_settings, snapshot, source_media, strips, validation
from .editing import new_edit
from .rendering import devices, film_output, machine, session

BAD_INPUT = 2
# Pixels along a picture's side, and frames of a window, that can be measured.
MOST_PIXELS, MOST_FRAMES = 16384, 256
FACTORS = get_args(recipe.Factor)  # 1: none
METHODS = tuple(inbetween_settings.METHODS.values())
FAULTS = (recipe.RecipeError, MediaError, film_output.OutputError, validation.EffectError, NoDeviceError)


def main(argv: list[str]) -> int:
    """Runs the command; its exit code: 0, or 2 after one sentence on stderr; 130 where it was stopped."""
    parser, arguments = _parser(), None
    try:
        arguments = parser.parse_args(argv)
        for path in vars(arguments).values():
            if isinstance(path, Path):
                check_name(path)
        _COMMANDS[arguments.command](arguments)
    except SystemExit as stop:  # argparse: --help, or what it has said on stderr
        return stop.code
    except KeyboardInterrupt:  # while in-between frames are built; those that are finished stay
        return film_output.INTERRUPTED
    except film_output.InterruptedRenderError as stopped:
        return _refuse(str(stopped), film_output.INTERRUPTED)
    except FAULTS as error:
        return _refuse(str(error))
    except MemoryError as error:
        return _refuse(str(error) or "not enough memory")
    except OSError as error:
        place = next(filter(None, (getattr(arguments, name, None) for name in ("output", "save", "cache", "json"))))
        return _refuse(film_output.in_words(error, place))
    except RuntimeError as error:  # from Blender
        return _refuse(film_output.message(error))
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        return _refuse(f"internal error: {error!r} in {Path(place.filename).name}, line {place.lineno}")
    return 0


def _refuse(reason: str, code: int = BAD_INPUT) -> int:
    with suppress(OSError):  # nobody reads it
        print(signed(reason), file=sys.stderr)
    return code


def _place(text: str) -> Path:
    """A path as it is named. Two slashes at its beginning, which Blender takes for the .blend's folder, are one."""
    if not text:
        raise argparse.ArgumentTypeError("a name is missing")
    return Path(re.sub("^//+", "/", os.path.abspath(text)))


def _sizes(text: str) -> list[tuple[int, int]]:
    found = [re.fullmatch(r"(\d{1,5})x(\d{1,5})", part) for part in text.split(",")]
    sizes = [(int(match[1]), int(match[2])) for match in found if match]
    if len(sizes) < len(found) or not all(1 <= n <= MOST_PIXELS for size in sizes for n in size):
        raise argparse.ArgumentTypeError(f'"{sentence(text, 40)}" is not WxH,… with 1 to {MOST_PIXELS} pixels a side')
    return sizes


def _windows(text: str) -> list[int]:
    found = [int(part) if re.fullmatch(r"\d{1,4}", part) else 0 for part in text.split(",")]
    if not all(2 <= window <= MOST_FRAMES for window in found):
        raise argparse.ArgumentTypeError(f'"{sentence(text, 40)}" is not L,… with 2 to {MOST_FRAMES} frames')
    return found


def _seconds(text: str) -> float:
    if not re.fullmatch(r"\d{1,6}(\.\d{1,6})?", text):
        raise argparse.ArgumentTypeError(f'"{sentence(text, 40)}" is no number of seconds')
    return float(text)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser("shutter", description="Every pixel its own exposure.")
    commands = parser.add_subparsers(dest="command", required=True)
    render = commands.add_parser("render", help="render a source through a recipe")
    render.add_argument("source", type=_place, help="a movie, or the first file of an image sequence")
    render.add_argument("--recipe", type=_place, required=True, help="the effect, a JSON file")
    render.add_argument("--output", type=_place, help=f"a folder, or a movie ({', '.join(film_output.MOVIES)})")
    render.add_argument(
        "--format", choices=tuple(film_output.FORMATS), help="of the pictures in a folder: 16-bit png, float exr"
    )
    render.add_argument("--frames", metavar="A:B", help="timeline frames A to B; 1 is the strip's first")
    render.add_argument(
        "--device",
        choices=devices.CHOICES,
        help="opengl: OpenGL 4.3; blender: Blender's own GPU; gpu: either; cpu: NumPy; auto: the first of these that"
        " works (default: as in Blender's preferences, else auto)",
    )
    render.add_argument("--weights", type=_place, metavar="DIR", help="also write the coefficients, as float EXR")
    render.add_argument("--save", type=_place, metavar="FILE.blend", help="keep the edit")
    render.add_argument(
        "--inbetween", type=int, choices=FACTORS, help="in-between frames, in place of the recipe's factor"
    )
    render.add_argument("--inbetween-method", choices=METHODS, help="in place of the recipe's")
    render.add_argument(
        "--cache",
        type=_place,
        metavar="DIR",
        help="where in-between frames lie"
        f' (default: "{inbetween_settings.FOLDER}" beside the output, or beside FILE.blend)',
    )
    build = commands.add_parser("inbetween", help="build a source's in-between frames")
    build.add_argument("source", type=_place, help="a movie, or the first file of an image sequence")
    build.add_argument(
        "--factor", type=int, choices=FACTORS[1:], required=True, help="how many times the source's rate"
    )
    build.add_argument("--method", choices=METHODS, default="quick", help="of optical flow")
    build.add_argument("--frames", metavar="A:B", help="source frames A to B, and up to the one behind; 1 is the first")
    build.add_argument("--cache", type=_place, metavar="DIR", required=True, help="where in-between frames shall lie")
    track = commands.add_parser("track", help="follow what a region covers, or the camera")
    track.add_argument("source", type=_place, help="a movie, or the first file of an image sequence")
    track.add_argument("--recipe", type=_place, required=True, help="the effect, a JSON file")
    track.add_argument("--region", metavar="NAME", help="the region that is to follow")
    track.add_argument("--camera", action="store_true", help="in its place: the camera, by all that regions leave free")
    track.add_argument("--frame", type=int, required=True, metavar="F", help="the frame at which it lies right")
    track.add_argument(
        "--frames", metavar="A:B", help="timeline frames A to B, both ways from F; 1 is the strip's first"
    )
    track.add_argument(
        "--motion", choices=registration.MOTIONS, default="scale", help="location; rotation too; or scale as well"
    )
    track.add_argument("--all-keys", action="store_true", help="a key at every frame, needed or not")
    track.add_argument("--output", type=_place, required=True, metavar="R2.json", help="the recipe with the keys")
    track.add_argument("--report", type=_place, metavar="FILE.json", help="how sure each frame is, and where it ended")
    measured = commands.add_parser("benchmark", help="measure how fast this machine composes, for a bug report")
    measured.add_argument("--device", choices=devices.CHOICES, help="as for render")
    measured.add_argument("--json", type=_place, metavar="FILE.json", help="also write what was measured")
    measured.add_argument("--sizes", type=_sizes, default=benchmark.SIZES, metavar="WxH,…", help="of pictures")
    measured.add_argument("--windows", type=_windows, default=benchmark.WINDOWS, metavar="L,…", help="their lengths")
    measured.add_argument(
        "--seconds", type=_seconds, default=60.0, help="about how long it may take; what would take longer is left out"
    )
    return parser


def _render(arguments) -> None:
    if arguments.output is None and arguments.save is None:
        raise film_output.OutputError("nothing to do: give --output, --save or both")
    source_recipe = _recipe(arguments)
    path = arguments.source
    with _opened(path) as medium:
        output, file_format = arguments.output, arguments.format or "png"
        if output:
            film_output.check(output, arguments.format, (medium.width, medium.height))
            if arguments.save and film_output.is_movie(output) and "#" in output.name:
                raise film_output.OutputError(f"{output}: in a saved edit, Blender takes # for the frames' numbers")
        frames = _frames(arguments.frames, new_edit.length(medium, source_recipe))
        read = path, *_files(medium), arguments.recipe, *_mattes(source_recipe, arguments.recipe.parent)
        film_output.spare(_written(arguments, file_format, frames), read)
        edit = new_edit.make_edit(path, medium, source_recipe, arguments.recipe.parent)
    edit.frame_start, edit.frame_end = frames
    if output:
        film_output.set_output(edit, output, file_format, alpha=medium.alpha != "opaque")
    if arguments.save:
        _save(edit, arguments.save)
    folder = _cache(arguments) if source_recipe.inbetween > 1 else None
    with session.using(session.RenderSettings(arguments.device, arguments.weights if output else None, folder)):
        if folder:
            _build_lacking(edit, folder)
        if output and arguments.weights:
            arguments.weights.mkdir(parents=True, exist_ok=True)
            film_output.clear_up(arguments.weights)
        if output:
            film_output.film(edit, output)


def _written(arguments, file_format: str, frames: tuple[int, int]) -> list[Path]:
    """All files that a render writes, but for in-between frames."""
    found = [arguments.save] if arguments.save else []
    if arguments.output and film_output.is_movie(arguments.output):
        found.append(arguments.output)
    elif arguments.output:
        found += film_output.pictures_of(arguments.output, file_format, frames)
        if arguments.weights:
            found += film_output.pictures_of(arguments.weights, "exr", frames)
    return found


def _files(medium) -> list[Path]:
    """The source's files, also those that are missing in an image sequence: it would show them, were they there."""
    files = medium.files
    beside = by_number(files[0]) if len(files) > 1 else None
    return [*files, *(map(beside, range(len(files))) if beside else ())]


def _mattes(source_recipe, folder: Path) -> list[Path]:
    """The files of a recipe's mattes; folder: where the recipe lies. MediaError: there are none."""
    found = []
    for region in source_recipe.regions:
        if isinstance(region, recipe.MatteRegion):
            with MatteFile(folder / region.path, region.channel).open() as matte:
                found += matte.files
    return found


def _opened(path: Path):
    """The source, with a word on stderr of files that were left out."""
    medium = open_source(path)
    if left_out := medium.left_out:
        print(signed(left_out), file=sys.stderr)
    return medium


def _recipe(arguments) -> recipe.Recipe:
    """The recipe, with the in-between frames that were asked for."""
    found = recipe.load(arguments.recipe)
    if arguments.inbetween is not None:
        found = recipe.with_inbetween(found, arguments.inbetween)
    return replace(found, inbetween_method=arguments.inbetween_method or found.inbetween_method)


def _cache(arguments) -> Path:
    """The folder of in-between frames: where a saved edit will look for them, if it is to be saved."""
    return arguments.cache or (arguments.save or arguments.output).parent / inbetween_settings.FOLDER


def _build_lacking(edit, folder: Path) -> None:
    """Builds the in-between frames that the edit's frames need."""
    strip = strips.effect_strips(edit)[0]
    effect = strips.effect_of(edit, strip.scene)
    shown = snapshot.take(edit, effect, strip, range(edit.frame_start, edit.frame_end + 1), folder=folder)
    with shown.source.open() as medium:
        _build(medium, *shown.inbetween, sorted(session.pairs(shown)))


def _build_alone(arguments) -> None:
    path = arguments.source
    with _opened(path) as medium:
        first, last = _frames(arguments.frames, medium.count)
        strip = new_edit.make_source(path, medium)
    # A strip may read the file in another way, with a colour space of Blender's own choice.
    with source_media.open_media(strip) as medium:
        pairs = range(first - 1, min(last, medium.count - 1))
        _build(medium, arguments.cache, arguments.factor, arguments.method, pairs)


def _track(arguments) -> None:
    if arguments.camera == (arguments.region is not None):
        raise film_output.OutputError("track: either --region NAME or --camera, one of the two")
    source_recipe = recipe.load(arguments.recipe)
    index = None if arguments.camera else _region_index(arguments, source_recipe)
    subject = recipe.CAMERA if arguments.camera else arguments.region
    with _opened(arguments.source) as medium:
        film_output.spare(
            filter(None, (arguments.output, arguments.report)), [arguments.source, *_files(medium), arguments.recipe]
        )
        first, last = _frames(arguments.frames, new_edit.length(medium, source_recipe))
        if not first <= arguments.frame <= last:
            raise film_output.OutputError(f"--frame: {arguments.frame} is not within the frames {first}:{last}")
        try:
            tracked, stops = _followed(arguments, source_recipe, index, medium, range(first, last + 1))
        except tracking.TrackingError as error:
            raise tracking.TrackingError(f"{subject}: {error}") from None
        size = medium.width, medium.height
    placements = {frame: found.placement for frame, found in tracked.items()}
    with_keys = _keyed(source_recipe, index, placements, {arguments.frame}, size, thin=not arguments.all_keys)
    _write_track(arguments, with_keys, tracked, stops)
    for stop in stops:
        if stop.fault == tracking.SHOT_ENDS:
            near = stop.frame - 1 if stop.frame > arguments.frame else stop.frame + 1
            said = f"{subject}: tracked to frame {near}, where the shot ends"
        else:
            said = f"{subject}: not tracked from frame {stop.frame} on: {stop.fault}"
        print(signed(said), file=sys.stderr)


def _region_index(arguments, source_recipe) -> int:
    names = [region.name for region in source_recipe.regions]
    if arguments.region not in names:
        raise film_output.OutputError(f'{arguments.recipe}: there is no region "{arguments.region}"')
    index = names.index(arguments.region)
    if not isinstance(source_recipe.regions[index], recipe.Region):
        sentence = f'region "{arguments.region}" is a matte or a ramp, and has no strokes to track'
        raise film_output.OutputError(f"{arguments.recipe}: {sentence}")
    return index


def _followed(arguments, source_recipe, index: int | None, medium, frames: range) -> tuple[dict, list]:
    """What tracking of a region, or of the camera, found by frame, and where it ended before the last frame.
    TrackingError: at once."""
    effect = source_recipe.effect(medium.width / medium.height)
    subject = effect.camera if index is None else effect.regions[index]
    times = {frame: _shown(source_recipe, frame, medium.count) for frame in frames}
    filmed = filmed_frames.FilmedFrames(times, arguments.frame)
    with ShotSource(PrefetchSource(medium)) as shots, film_output.progress(len(filmed.frames), "frame") as moved:
        footage = tracking.Footage(shots, filmed.index_at)
        what = footage, filmed.start, filmed.frames
        if index is None:
            drawn = [region for region in effect.regions if isinstance(region, Region)]
            regions = [filmed.seen(region) for region in drawn]
            steps = camera_tracking.follow_camera(filmed.seen(subject), regions, *what, motion=arguments.motion)
        else:
            steps = tracking.follow(filmed.seen(subject), *what, motion=arguments.motion)
        tracked = []
        for step in steps:
            tracked.append(step)
            moved()
    found = list(filmed.on_timeline(subject, tracked, footage.size))
    stops = [each for each in found if each.fault]
    if len(found) - len(stops) < 2:
        raise tracking.TrackingError(stops[0].fault if stops else tracking.ALONE)
    return {each.frame: each for each in found if not each.fault}, stops


def _keyed(source_recipe, index: int | None, *placements, thin: bool) -> recipe.Recipe:
    """The recipe with placements as keys of a region, or of the camera; arguments as of region_keys."""
    if index is None:
        return region_keys.with_camera(source_recipe, *placements, thin=thin)
    regions = list(source_recipe.regions)
    regions[index] = region_keys.with_placements(regions[index], *placements, thin=thin)
    return replace(source_recipe, regions=regions)


def _shown(source_recipe, frame: int, count: int) -> float:
    """Which of a source's frames, from 0 on, a recipe shows at a timeline frame; a fraction: an in-between one."""
    time, factor = source_recipe.time_at(frame), source_recipe.inbetween
    filmed = (frame if time is None else time) - 1
    return retiming.nearest(filmed, factor, (count - 1) * factor + 1) / factor


def _write_track(arguments, result, tracked: dict, stops: list) -> None:
    """Writes the recipe, and the report of it, both whole or neither."""
    report = {
        **({"camera": True} if arguments.camera else {"region": arguments.region}),
        "frame": arguments.frame,
        "motion": arguments.motion,
        "frames": [{"frame": n, "confidence": round(tracked[n].confidence, 3)} for n in sorted(tracked)],
        "stops": [{"frame": stop.frame, "reason": stop.fault} for stop in stops],
    }
    for path in filter(None, (arguments.output, arguments.report)):
        path.parent.mkdir(parents=True, exist_ok=True)
        film_output.clear_up(path.parent)
    with atomic_write.writing(arguments.output) as part:
        moved = recipe.moved(result, arguments.recipe.parent, arguments.output.parent)
        part.write_text(recipe.dump(moved), encoding="utf-8")
        if arguments.report:
            with atomic_write.writing(arguments.report) as other:
                other.write_text(json.dumps(report, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def _build(medium, folder: Path, factor: int, method: str, pairs) -> None:
    """Builds the in-betweens of these pairs of source frames, each given by its first, in ascending order."""
    from ..media.inbetween import build

    with film_output.progress(len(pairs), "pair") as moved:
        # pairs that follow one another, whose difference from their place among all is the same
        for _, chunk in groupby(enumerate(pairs), lambda item: item[1] - item[0]):
            numbers = [pair for _, pair in chunk]
            build(medium, folder, factor, method, (numbers[0], numbers[-1]), update=lambda *_: moved())


def _frames(text: str | None, count: int) -> tuple[int, int]:
    """First and last timeline frame of `A:B`, of `A` alone, or of the whole clip."""
    if text is None:
        return 1, count
    numbers = re.fullmatch(r"(-?\d{1,9})(?::(-?\d{1,9}))?", text)
    if not numbers:
        raise film_output.OutputError(f'--frames: "{sentence(text, 40)}" is not A:B')
    first, last = int(numbers[1]), int(numbers[2] or numbers[1])
    if not 1 <= first <= last <= count:
        raise film_output.OutputError(f"--frames: {text} is not within the clip's frames 1:{count}")
    return first, last


def _save(edit, path: Path) -> None:
    """Saves the edit, its paths relative to the file: it may be opened on another machine. OutputError: it cannot be
    saved whole; what stood there stays."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        film_output.clear_up(path.parent)
        _save_whole(edit, path)
    except OSError as error:
        raise film_output.OutputError(f"{path}: {error.strerror or error}") from None


def _save_whole(edit, path: Path) -> None:
    with atomic_write.part_folder(path.parent) as folder:
        part = folder / "edit.blend"
        try:
            with film_output.quiet(), new_edit.paths_relative(edit, path.parent):
                bpy.ops.wm.save_as_mainfile(filepath=str(part), compress=True, copy=True, relative_remap=False)
        except RuntimeError as error:
            raise film_output.OutputError(f"{path}: {film_output.message(error)}") from None
        if not _is_whole(part, edit.name):
            raise film_output.OutputError(f"{path}: could not be saved whole; {why_short(folder)}")
        if path.is_file() and bpy.context.preferences.filepaths.save_version:
            path.replace(f"{path}1")  # as Blender itself keeps what stood there
        part.replace(path)


def _is_whole(path: Path, scene: str) -> bool:
    """Whether a .blend file was written to its end, and Blender finds the scene in it."""
    if not is_whole_blend(path):
        return False
    try:
        with bpy.data.libraries.load(str(path)) as (found, _):
            return scene in found.scenes
    except OSError:
        return False


def _benchmark(arguments) -> None:
    compositor, lesser = machine.open_device(arguments.device)
    steps = len(arguments.sizes) * (len(arguments.windows) + 1)
    try:
        described = machine.described(compositor, lesser)
        with _writing(arguments.json) as part, film_output.progress(steps, "row") as moved:
            rows, plays = benchmark.run(compositor, arguments.sizes, arguments.windows, arguments.seconds, moved)
            if part:
                found = {"machine": described, "rows": rows, "plays": plays}
                part.write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    finally:
        compositor.release()
    print("\n".join(f"- {heading}: {value}" for heading, value in described.items()))
    print(f"\n{benchmark.table(rows, plays)}\n\n{benchmark.MEASURED}")


@contextmanager
def _writing(path: Path | None):
    """What to write in place of a file, so that it is there whole or not at all; None for none."""
    if path is None:
        yield None
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    film_output.clear_up(path.parent)
    with atomic_write.writing(path) as part:
        yield part


_COMMANDS = {"render": _render, "inbetween": _build_alone, "track": _track, "benchmark": _benchmark}
