"""What a film costs on a farm: core-hours, storage and traffic, computed from parts that are measured here.

    python scripts/farm_plan.py FOOTAGE [--hours 2] [--exposure 16] [--nodes 1,10,1000] [--cores 16] [--json PARTS]
    python scripts/farm_plan.py --parts PARTS [--nodes 1,10,1000] [--cores 16] [--network 10]

Needs Blender as a library (bpy), and Linux. The command is run on FOOTAGE as on a node: chunks of two lengths, whose
difference is the time of a picture, and whose rest is what every chunk pays anew: the start, and the frames of its
window that lie behind its last picture. Three shutters, scribbled; an exposure of 16 frames, with Smooth off and at 8×.

Times are processor times, which other work on the machine lengthens less than waits. Much of a picture's is one
thread's, so that no process keeps many cores busy: a node has a worker for each of its cores, and the join, which is
one process, takes as long as its longest thread. What so many workers lose to memory's speed is not counted, nor what a
GPU that composes would save.
"""

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path

from shutter_addon.core.farm import chunks
from shutter_addon.core.model import presets
from shutter_addon.media import open_source

SMOOTH = 1, 8  # off, and eight moments for a frame
LENGTHS = 1, 13  # pictures of the chunks that are measured
FIRST = 9  # their first timeline frame


@dataclass(frozen=True)
class Parts:
    """What was measured. Times in seconds of a core, sizes in bytes.

    smooth: moments from a filmed frame to the next; window: filmed frames that a shutter exposes
    once: what a chunk pays whatever its length; picture: one more of its pictures; picture_thread: its longest thread
    join: a picture of the film; join_thread: its longest thread
    memory: of a process that renders; source, output: a frame's file"""

    smooth: int
    window: int
    once: float
    picture: float
    picture_thread: float
    join: float
    join_thread: float
    memory: float
    source: float
    output: float

    def chunk(self, pictures: int) -> float:
        return self.once + pictures * self.picture

    def read(self, pictures: int) -> float:
        """Bytes that a chunk reads."""
        return chunks.decoded(pictures, self.window) * self.source


@dataclass(frozen=True)
class Use:
    """What a command used: seconds of all its threads together and of its longest one, bytes of memory at most."""

    total: float
    thread: float
    memory: float


@dataclass(frozen=True)
class Plan:
    """What a film costs on so many nodes.

    chunk: pictures of one; work: core-hours of all
    hours: until the pictures are done; join: hours of the join, were it as fast as its longest thread
    anew: share of the pictures' core-hours that goes into what chunks pay anew; storage: bytes that are kept
    traffic: bytes that are read and written until the pictures are done; joined: those that the join reads"""

    chunk: int
    work: float
    hours: float
    join: float
    anew: float
    storage: float
    traffic: float
    joined: float


def plan(parts: Parts, pictures: int, nodes: int, cores: int, longest: int) -> Plan:
    """Each core has a worker of its own. longest: pictures of a chunk at most; all workers are busy to the end."""
    workers = nodes * cores
    rounds = math.ceil(pictures / (longest * workers))
    chunk = math.ceil(pictures / (rounds * workers))
    count = math.ceil(pictures / chunk)
    rendered, written = count * parts.once + pictures * parts.picture, pictures * parts.output
    return Plan(
        chunk=chunk,
        work=(rendered + pictures * parts.join) / 3600,
        hours=rounds * parts.chunk(chunk) / 3600,
        join=pictures * parts.join_thread / 3600,
        anew=count * parts.once / rendered,
        storage=written + pictures * parts.source,
        traffic=written + count * parts.read(chunk),
        # It compares all checksums before Blender reads the first picture: no machine's memory has them by then.
        joined=2 * pictures * parts.output,
    )


def measured(footage: Path, smooth: int, window: int, folder: Path) -> Parts:
    """Runs the command. subprocess.CalledProcessError: it failed."""
    recipe, edit = folder / f"{smooth}.json", folder / f"{smooth}.blend"
    recipe.write_text(json.dumps(effect_recipe(window, smooth)))
    short, long = LENGTHS
    outputs = {length: folder / f"{smooth}-{length}" for length in LENGTHS}
    rendered = {
        length: used(
            *("render", footage, "--recipe", recipe, "--output", output, "--save", edit),
            *("--frames", f"{FIRST}:{FIRST + length - 1}"),
        )
        for length, output in outputs.items()
    }
    join = "join", outputs[long], "--edit", edit, "--output", folder / "film.mp4"
    joined = {length: used(*join, "--frames", f"{FIRST}:{FIRST + length - 1}") for length in LENGTHS}
    picture, film = per_picture(rendered), per_picture(joined)
    with open_source(footage) as medium:
        source = sum(path.stat().st_size for path in medium.files) / medium.count
    return Parts(
        smooth=smooth,
        window=window,
        once=rendered[short].total - short * picture.total,
        picture=picture.total,
        picture_thread=picture.thread,
        join=film.total,
        join_thread=film.thread,
        memory=rendered[long].memory,
        source=source,
        output=mean_size(outputs[long].glob("*.png")),
    )


def per_picture(found: dict[int, Use]) -> Use:
    """What one more picture takes; found: what so many take."""
    (short, less), (long, more) = found.items()
    count = long - short
    return Use((more.total - less.total) / count, (more.thread - less.thread) / count, more.memory)


def mean_size(paths) -> float:
    sizes = [path.stat().st_size for path in paths]
    return sum(sizes) / max(1, len(sizes))


def effect_recipe(window: int, smooth: int) -> dict:
    """Three shutters on two lines and the border."""
    bars = {"Long": "ANGLE_360", "Sharp": "STILL", "Twice": "TWO_CUTS"}
    lines = {"Sharp": [[0.3, 0.2], [0.5, 0.8]], "Twice": [[0.7, 0.2], [0.7, 0.8]]}
    return {
        "version": 2,
        "window": window,
        "inbetween": smooth,
        "border": True,
        "shutters": [{"name": name, "bars": presets.bars(preset, window).tolist()} for name, preset in bars.items()],
        "regions": [{"shutter": n, "kind": "line", "width": 0.02, "strokes": [points]} for n, points in lines.items()],
    }


def used(*arguments) -> Use:
    """What the command used. subprocess.CalledProcessError: it failed."""
    command = [sys.executable, "-m", "shutter_addon", *map(str, arguments)]
    process, threads = subprocess.Popen(command), {}
    while True:
        pid, status, usage = os.wait4(process.pid, os.WNOHANG)
        if pid:
            break
        threads |= thread_times(process.pid)
        time.sleep(0.05)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, command)
    return Use(usage.ru_utime + usage.ru_stime, max(threads.values()), usage.ru_maxrss * 1024)


def thread_times(pid: int) -> dict[str, float]:
    """Seconds of processor time of each of a process's threads."""
    times = {}
    for thread in Path(f"/proc/{pid}/task").glob("*"):
        with suppress(OSError):  # it has come to its end
            user, system = (thread / "stat").read_text().rpartition(")")[2].split()[11:13]
            times[thread.name] = (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")
    return times


def parts_table(found: list[Parts]) -> str:
    """Markdown. In brackets: of it, what the longest thread takes."""
    lines = [
        "| Smooth | window | chunk, anew | picture | join | memory | source | picture |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for each in found:
        picture = f"{each.picture:.1f} s ({each.picture_thread:.1f} s)"
        join = f"{each.join:.1f} s ({each.join_thread:.1f} s)"
        times, sizes = f"{each.once:.1f} s | {picture} | {join}", f"{in_mb(each.source)} | {in_mb(each.output)}"
        lines.append(f"| {name(each)} | {each.window} | {times} | {each.memory / 1e9:.1f} GB | {sizes} |")
    return "\n".join(lines)


def plans_table(found: list[Parts], pictures: int, nodes: list[int], cores: int, network: float) -> str:
    """Markdown. The network's column is what the traffic takes alone; network: of the storage, in Gbit/s."""
    lines = [
        "| Smooth | nodes | chunk | core-hours | anew | pictures | network | join | network | storage | traffic |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for parts in found:
        for count in nodes:
            each = plan(parts, pictures, count, cores, chunks.chunk_size(parts.window))
            loads = [span(load / speed(network) / 3600) for load in (each.traffic, each.joined)]
            times = f"{span(each.hours)} | {loads[0]} | {span(each.join)} | {loads[1]}"
            size = f"{each.storage / 1e12:.1f} TB | {(each.traffic + each.joined) / 1e12:.1f} TB"
            work = f"{each.work:,.0f} | {each.anew:.1%}"
            lines.append(f"| {name(parts)} | {count:,} | {each.chunk} | {work} | {times} | {size} |")
    return "\n".join(lines)


def name(parts: Parts) -> str:
    """What the panel calls so many moments."""
    return f"{parts.smooth}×" if parts.smooth > 1 else "off"


def in_mb(size: float) -> str:
    """In words, of a size in bytes."""
    return f"{size / 1e6:.1f} MB"


def speed(network: float) -> float:
    """Bytes a second; network: in Gbit/s."""
    return network * 1e9 / 8


def served(parts: Parts, pictures: int, cores: int, network: float) -> float:
    """How many nodes the storage serves before they wait for it, while they work on pictures."""
    one = plan(parts, pictures, 1, cores, chunks.chunk_size(parts.window))
    return speed(network) * one.hours * 3600 / one.traffic


def span(hours: float) -> str:
    """In words, of a time in hours."""
    return f"{hours:,.1f} h" if hours >= 1 else f"{hours * 60:.0f} min"


def dominated(parts: Parts) -> float:
    """The chunk, in pictures, below which what is paid anew takes more time than the pictures."""
    return parts.once / parts.picture


def numbers(text: str) -> list[int]:
    return [int(part) for part in text.split(",")]


def main(arguments=None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("footage", type=Path, nargs="?")
    parser.add_argument("--parts", type=Path, help="what was measured before, in place of the footage")
    parser.add_argument("--hours", type=float, default=2, help="of film")
    parser.add_argument("--rate", type=float, default=24, help="frames a second")
    parser.add_argument("--exposure", type=int, default=16, help="filmed frames")
    parser.add_argument("--smooth", type=numbers, default=SMOOTH, help="moments for a filmed frame")
    parser.add_argument("--nodes", type=numbers, default=[1, 10, 1000])
    parser.add_argument("--cores", type=int, default=16, help="of a node")
    parser.add_argument("--network", type=float, default=10, help="of the storage, in Gbit/s")
    parser.add_argument("--json", type=Path, help="also write the parts")
    options = parser.parse_args(arguments)
    if (options.footage is None) == (options.parts is None):
        parser.error("either FOOTAGE or --parts, one of the two")
    if options.parts:
        found = [Parts(**each) for each in json.loads(options.parts.read_text())]
    else:
        with tempfile.TemporaryDirectory() as folder:
            found = [measured(options.footage, smooth, options.exposure, Path(folder)) for smooth in options.smooth]
    if options.json:
        options.json.write_text(json.dumps([asdict(each) for each in found], indent=1) + "\n")
    print(parts_table(found), end="\n\n")
    pictures = round(options.hours * 3600 * options.rate)
    print(plans_table(found, pictures, options.nodes, options.cores, options.network))
    for each in found:
        nodes = served(each, pictures, options.cores, options.network)
        print(f"Smooth {name(each)}: most of it is paid anew below {dominated(each):.1f} pictures a chunk")
        print(f"Smooth {name(each)}: the storage serves {nodes:.1f} nodes")
    return 0


if __name__ == "__main__":
    sys.exit(main())
