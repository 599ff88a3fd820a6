"""How fast a movie is read by PyAV and by a second Blender, in turn, and films that are rendered of it.

    .venv/bin/python scripts/movie_speed.py [FOOTAGE.mp4] [--frames 100] [--rounds 5] [--blender "blender"]

onward: frames in order, per second; far: single frames far from each other, milliseconds each; film: `shutter render`
with a box of 16 frames, seconds a frame, without the start: a film of all frames less one of two, per frame more.
--blender: the Blender that decodes; without it, the `bpy` wheel does."""

import argparse
import json
import shlex
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from shutter_addon.media import decoding_child, open_source  # noqa: E402
from shutter_addon.media.blender_movie import BlenderMovie  # noqa: E402

SCRIPT = ROOT / "shutter_addon" / "blender" / "data" / "decoding_process.py"
ALONE = ["--background", "--factory-startup", "--offline-mode", "-noaudio", "--python"]
RENDER = """
import sys
sys.modules |= dict.fromkeys(sys.argv.pop(1).split())
from shutter_addon.__main__ import main
sys.exit(main())
"""


def timed(work) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def read(source, frames) -> float:
    """Seconds a frame."""
    return timed(lambda: [source.read(index) for index in frames]) / len(frames)


def rendered(footage: Path, folder: Path, hidden: str, frames: int) -> float:
    """Seconds a frame more."""
    recipe = folder / "recipe.json"
    recipe.write_text(json.dumps({"version": 1, "window": 16, "shutters": [{"name": "Box", "bars": [1] * 16}]}))

    def film(last):
        arguments = [
            "render",
            footage,
            "--recipe",
            recipe,
            "--output",
            folder / f"{last}{hidden}",
            "--frames",
            f"1:{last}",
        ]
        command = [sys.executable, "-c", RENDER, hidden, *map(str, arguments)]
        return timed(lambda: subprocess.run(command, cwd=ROOT, check=True, capture_output=True))

    return (film(frames) - film(2)) / (frames - 2)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("footage", type=Path, nargs="?", default=ROOT / "assets" / "bigbuckbunny.mp4")
    parser.add_argument("--frames", type=int, default=100)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--blender")
    options = parser.parse_args()
    decoder = [*shlex.split(options.blender), *ALONE, SCRIPT, "--"] if options.blender else [sys.executable, SCRIPT]
    decoding_child.lend(list(map(str, decoder)))
    ways = {"PyAV": open_source(options.footage), "Blender": BlenderMovie(options.footage)}
    far = [(37 * k) % options.frames for k in range(12)]
    found: dict[str, dict[str, list[float]]] = {name: {"onward": [], "far": [], "film": []} for name in ways}
    for _ in range(options.rounds):
        for name, source in ways.items():
            found[name]["onward"].append(1 / read(source, range(options.frames)))
            found[name]["far"].append(1000 * read(source, far))
        with tempfile.TemporaryDirectory() as folder:
            for name, hidden in (("PyAV", ""), ("Blender", "av")):
                found[name]["film"].append(rendered(options.footage, Path(folder), hidden, options.frames))
    for name, kinds in found.items():
        for kind, values in kinds.items():
            median, least, most = statistics.median(values), min(values), max(values)
            print(f"{name}, {kind}: {median:.4g}, from {least:.4g} to {most:.4g}")


if __name__ == "__main__":
    main()
