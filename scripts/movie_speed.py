"""How fast a movie is read by PyAV and by a second Blender, in turn, and films that are rendered of it.

    .venv/bin/python scripts/movie_speed.py [FOOTAGE.mp4] [--frames 100] [--rounds 5] [--no-films] [--blender "blender"]

onward: frames in order, per second; processor: its time for each of these, milliseconds (Linux); far: single frames far
from each other, milliseconds each; film: `shutter render` with a box of 16 frames, seconds a frame, without the start:
a film of all frames less one of two, per frame more.
--blender: the Blender that decodes; without it, the `bpy` wheel does."""

import argparse
import json
import os
import shlex
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from shutter_addon.media import blender_movie, open_source  # noqa: E402
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


def used(pid: int) -> float:
    """Seconds of the processor that a process and those that it began have taken; 0 where there is no /proc."""
    place = Path(f"/proc/{pid}")
    if not place.exists():
        return 0.0
    fields = (place / "stat").read_text().rpartition(")")[2].split()
    begun = (place / "task" / str(pid) / "children").read_text().split()
    return sum(map(int, fields[11:13])) / os.sysconf("SC_CLK_TCK") + sum(map(used, map(int, begun)))


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
    parser.add_argument("--no-films", action="store_true")
    options = parser.parse_args()
    decoder = [*shlex.split(options.blender), *ALONE, SCRIPT, "--"] if options.blender else [sys.executable, SCRIPT]
    blender_movie.lend(list(map(str, decoder)))
    ways = {"PyAV": open_source(options.footage), "Blender": BlenderMovie(options.footage)}
    far = [(37 * k) % options.frames for k in range(12)]
    kinds = "onward", "processor", "far", "film"
    found: dict[str, dict[str, list[float]]] = {name: {kind: [] for kind in kinds} for name in ways}
    for _ in range(options.rounds):
        for name, source in ways.items():
            before = used(os.getpid())
            found[name]["onward"].append(1 / read(source, range(options.frames)))
            found[name]["processor"].append(1000 * (used(os.getpid()) - before) / options.frames)
            found[name]["far"].append(1000 * read(source, far))
        with tempfile.TemporaryDirectory() as folder:
            for name, hidden in () if options.no_films else (("PyAV", ""), ("Blender", "av")):
                found[name]["film"].append(rendered(options.footage, Path(folder), hidden, options.frames))
    for name, measured in found.items():
        for kind, values in ((kind, values) for kind, values in measured.items() if values):
            median, least, most = statistics.median(values), min(values), max(values)
            print(f"{name}, {kind}: {median:.4g}, from {least:.4g} to {most:.4g}")


if __name__ == "__main__":
    main()
