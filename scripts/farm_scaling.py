"""What a second worker brings: frames a second of two workers of one core each, and of one, over the same edit.

    python scripts/farm_scaling.py FOOTAGE RECIPE [--chunk 32] [--rounds 3] [--device opengl]

Needs Blender as a library (bpy), Linux and two free cores. Each worker renders chunks of a saved edit, one after
another, into its own folder, as a farm has it do; ways take turns, and medians count.
"""

import argparse
import os
import shlex
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

SHUTTER = (sys.executable, "-m", "shutter_addon")


def rendered(edit: Path, chunks: list[tuple[int, int]], cores: list[int], device: str, folder: Path) -> float:
    """Seconds until all chunks are rendered, each by the next of the cores' workers. CalledProcessError: one failed."""
    started = time.perf_counter()
    shares = [chunks[index :: len(cores)] for index in range(len(cores))]
    workers = [
        subprocess.Popen(["taskset", "-c", str(core), "sh", "-ec", script(edit, share, device, folder)])
        for core, share in zip(cores, shares, strict=True)
    ]
    for worker in workers:
        if worker.wait():
            raise subprocess.CalledProcessError(worker.returncode, worker.args)
    return time.perf_counter() - started


def script(edit: Path, chunks: list[tuple[int, int]], device: str, folder: Path) -> str:
    """What a worker runs in its shell."""
    commands = []
    for first, last in chunks:
        output = str(folder / str(first))
        commands.append([*SHUTTER, "render", str(edit), "--output", output, "--frames", f"{first}:{last}"])
        commands[-1] += ["--device", device, "--resume"]
    return "\n".join(map(shlex.join, commands))


def main(arguments=None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("footage", type=Path)
    parser.add_argument("recipe", type=Path)
    parser.add_argument("--chunk", type=int, default=32, help="frames")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--device", default="auto")
    options = parser.parse_args(arguments)
    cores = sorted(os.sched_getaffinity(0))[:2]
    chunks = [(1 + number * options.chunk, (number + 1) * options.chunk) for number in range(2)]
    frames = len(chunks) * options.chunk
    speeds: dict[int, list[float]] = {1: [], 2: []}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        edit = folder / "edit.blend"
        subprocess.run([*SHUTTER, "render", options.footage, "--recipe", options.recipe, "--save", edit], check=True)
        for turn in range(options.rounds):
            for workers in speeds:
                place = folder / f"{turn}-{workers}"
                seconds = rendered(edit, chunks, cores[:workers], options.device, place)
                speeds[workers].append(frames / seconds)
    one, two = (statistics.median(speeds[workers]) for workers in (1, 2))
    print(f"one worker {one:.2f} frames/s, two {two:.2f}: {two / one:.2f} times")
    return 0


if __name__ == "__main__":
    sys.exit(main())
