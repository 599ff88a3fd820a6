"""How quick a whole render is, from movie to movie, beside two references, measured in one run, interleaved.

    python scripts/render_speed.py [FOOTAGE] [--window 64] [--rounds 3] [--json FILE]
    blender -b --factory-startup --python scripts/render_speed.py -- …

Needs Blender as a library (bpy), or a Blender that has the extension's packages. Ways:
ours: FOOTAGE under an effect of three shutters, scribbled, through the sequencer;
constant: the same edit, but its engine returns a constant;
average: `ffmpeg -vf tmix` of as many frames, with the codec settings of Blender's output. It takes ffmpeg from PATH.
Each begins with nothing decoded and nothing compiled. Frames per second are medians. The films are checked: their
length, what they show, and ours against the NumPy compositor.
"""

from __future__ import annotations

import argparse
import json
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from functools import cache
from pathlib import Path

import av
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from shutter_addon import blender
from shutter_addon.blender.data import snapshot, strips
from shutter_addon.blender.editing import new_edit
from shutter_addon.blender.rendering import film_output, session
from shutter_addon.blender.rendering.engine import VirtualShutterEngine
from shutter_addon.compute.cpu import CPUCompositor
from shutter_addon.compute.renderer import Renderer
from shutter_addon.core import light, presets, recipe
from shutter_addon.media import MediaError, open_source
from shutter_addon.media.cuts import ShotSource

ROOT = Path(__file__).resolve().parents[1]
WAYS = ("ours", "constant", "average")
GREY = 0.25  # of the constant, in linear light
# Levels of 255, on average, that the codec may take means of 8 × 8 pixels away from what was given to it.
LOSSY = 1.5
# What Blender's settings are to x264.
_RATES, _PRESETS = {"HIGH": 20}, {"GOOD": "medium"}


def constant(engine, depsgraph) -> None:
    """The least that an engine can do."""
    width, height = engine.resolution_x, engine.resolution_y
    result = engine.begin_result(0, 0, width, height)
    result.layers[0].passes["Combined"].rect.foreach_set(_grey(width * height))
    engine.end_result(result)


@cache
def _grey(pixels: int) -> np.ndarray:
    return np.tile(np.array([GREY, GREY, GREY, 1], np.float32), pixels)


def effect_recipe(window: int) -> recipe.Recipe:
    """Three shutters on two lines and the border."""
    bars = {"Long": "ANGLE_360", "Sharp": "STILL", "Twice": "TWO_CUTS"}
    lines = {"Sharp": [[0.3, 0.2], [0.5, 0.8]], "Twice": [[0.7, 0.2], [0.7, 0.8]]}
    data = {
        "version": 1,
        "window": window,
        "border": True,
        "shutters": [{"name": name, "bars": presets.bars(preset, window).tolist()} for name, preset in bars.items()],
        "regions": [{"shutter": n, "kind": "line", "width": 0.02, "strokes": [points]} for n, points in lines.items()],
    }
    return recipe.parse(json.dumps(data))


def through_blender(edit, film: Path, render=VirtualShutterEngine.render) -> None:
    """Renders the edit; render: what the engine of its effect's scene does."""
    # Another engine would make it another strip, and the effect would go with it.
    kept, VirtualShutterEngine.render = VirtualShutterEngine.render, render
    try:
        session.forget()
        film_output.film(edit, film)
    finally:
        VirtualShutterEngine.render = kept


def average_command(ffmpeg: str, edit, footage: Path, window: int, film: Path) -> list[str]:
    to = edit.render.ffmpeg
    video = f"-c:v libx264 -preset {_PRESETS[to.ffmpeg_preset]} -crf {_RATES[to.constant_rate_factor]}"
    video += f" -g {to.gopsize} -bf {to.max_b_frames if to.use_max_b_frames else 0} -pix_fmt yuv420p"
    sound = "-an" if to.audio_codec == "NONE" else f"-c:a aac -b:a {to.audio_bitrate}k"
    given = [ffmpeg, "-v", "error", "-y", "-i", str(footage), "-vf", f"tmix=frames={window}"]
    return [*given, *video.split(), *sound.split(), str(film)]


def check(way: str, film: Path, edit, footage: Path) -> float | None:
    """How far the film's pictures are from what they should be, in levels; for the average no more is asked than
    that it has pictures. AssertionError: the film is not what was timed."""
    with open_source(footage) as source, open_source(film) as made:
        with av.open(str(film)) as container:
            count = sum(packet.size > 0 for packet in container.demux(video=0))
        assert count == source.count, f"{way}: {count} frames instead of {source.count}"
        chosen = sorted({0, source.count // 2, source.count - 1})
        shown = {index: made.read(index)[..., :3] for index in chosen}
        if way == "average":
            assert all(picture.std() > 5 for picture in shown.values()), f"{way}: pictures without content"
            return None
        expected = _composed(edit, source, chosen) if way == "ours" else {}
    grey = np.full((8, 8, 3), 255 * light.to_encoded(np.float32(GREY)))
    error = max(float(np.abs(_means(shown[i]) - _means(expected.get(i, grey))).mean()) for i in chosen)
    assert error < LOSSY, f"{way}: {error:.2f} levels off"
    return error


def _means(picture: np.ndarray) -> np.ndarray:
    """Means of 8 × 8 pixels, which a codec hardly touches."""
    height, width = (n // 8 * 8 for n in picture.shape[:2])
    return picture[:height, :width].reshape(height // 8, 8, width // 8, 8, 3).mean(axis=(1, 3), dtype=np.float32)


def _composed(edit, source, indices) -> dict[int, np.ndarray]:
    """What the effect shows of source frames, in levels; composed by NumPy."""
    strip = strips.effect_strips(edit)[0]
    effect = strips.effect_of(edit, strip.scene)
    shown = snapshot.read(edit, effect, strip, [index + 1 for index in indices])
    renderer = Renderer(CPUCompositor(), ShotSource(source))
    return {index: 255 * light.to_encoded(renderer.picture(index, shown.at(index + 1)))[..., :3] for index in indices}


def measure(args) -> list[dict]:
    with open_source(args.footage) as medium:
        edit = new_edit.make_edit(args.footage, medium, effect_recipe(args.window), args.footage.parent)
        count, size = medium.count, (medium.width, medium.height)
    ffmpeg = shutil.which("ffmpeg")
    if ffmpeg is None:
        print("There is no ffmpeg on the PATH: the way “average” is left out.", file=sys.stderr, flush=True)
    rates = {way: [] for way in WAYS if ffmpeg or way != "average"}
    errors = {}
    with tempfile.TemporaryDirectory() as folder:
        films = {way: Path(folder, f"{way}.mp4") for way in rates}
        film_output.set_output(edit, films["ours"], "png", alpha=False)
        for _ in range(args.rounds):
            for way, film in films.items():
                start = time.perf_counter()
                if way == "average":
                    subprocess.run(average_command(ffmpeg, edit, args.footage, args.window, film), check=True)
                elif way == "constant":
                    through_blender(edit, film, constant)
                else:
                    through_blender(edit, film)
                rates[way].append(count / (time.perf_counter() - start))
                if way not in errors:
                    errors[way] = check(way, film, edit, args.footage)
    common = {"width": size[0], "height": size[1], "window": args.window, "frames": count}
    return [
        {"way": way, **common, "fps": statistics.median(found), "all": found, "error": errors[way]}
        for way, found in rates.items()
    ]


def report(rows: list[dict]) -> str:
    found = {row["way"]: row["fps"] for row in rows}
    lines = [f"{rows[0]['width']}×{rows[0]['height']}, window {rows[0]['window']}, {rows[0]['frames']} frames"]
    for row in rows:
        error = "" if row["error"] is None else f"  {row['error']:.2f} levels from what it should show"
        share = "" if row["way"] == "ours" else f"  ours is {found['ours'] / row['fps']:.2f} of it"
        lines.append(f"{row['way']:9s} {row['fps']:7.2f} fps{share}{error}")
    return "\n".join(lines)


def parse(arguments=None):
    parser = argparse.ArgumentParser("render_speed.py", description=__doc__.partition("\n")[0])
    add = parser.add_argument
    add("footage", type=Path, nargs="?", default=ROOT / "assets" / "bigbuckbunny.mp4", metavar="FOOTAGE")
    add("--window", type=int, default=64)
    add("--rounds", type=int, default=3)
    add("--json", type=Path, help="where the rows are written")
    return parser.parse_args(arguments)


def main(arguments=None) -> int:
    args = parse(arguments)
    args.footage = args.footage.resolve()
    blender.register()
    try:
        rows = measure(args)
    except MediaError as error:
        print(f"render_speed: {error}", file=sys.stderr)
        return 2
    print(report(rows), flush=True)
    if args.json:
        args.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    # Inside Blender, what comes before "--" is Blender's own.
    sys.exit(main(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else None))
