"""What a film costs on a farm: core-hours, storage and traffic, computed from parts that are measured here.

    python scripts/farm_plan.py FOOTAGE [--hours 2] [--exposure 16] [--nodes 1,10,1000] [--cores 16] [--json PARTS]
    python scripts/farm_plan.py --parts PARTS [--nodes 1,10,1000] [--cores 16] [--network 10]

Needs Blender as a library (bpy). The command is run on FOOTAGE as on a node: in-betweens of a few pairs of frames, and
chunks of two lengths, whose difference is the time of a picture, and whose rest is what every chunk pays anew: the
start, and the frames of its window that lie behind its last picture. Three shutters, scribbled; an exposure of 16
source frames, which at factor 8 are 128 of the window. Times are processor times of one core: a GPU that composes takes
its share out of them. A node works on one chunk after another, with all of its cores.
"""

import argparse
import json
import math
import resource
import subprocess
import sys
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path

from shutter_addon.core import chunks, presets
from shutter_addon.media import open_source

LENGTHS = {1: (1, 6), 8: (1, 3)}  # pictures of the chunks that are measured, by factor
FIRST = 9  # their first timeline frame


@dataclass(frozen=True)
class Parts:
    """What was measured at a factor of in-between frames. Times in seconds of a core, sizes in bytes.

    window: frames that a shutter exposes, in-between frames included
    once: what a chunk pays whatever its length; picture: one more of its pictures
    pair: the in-between frames of a pair of source frames; join: a picture of the film
    source, between, output: a frame's file"""

    factor: int
    window: int
    once: float
    picture: float
    pair: float
    join: float
    source: float
    between: float
    output: float

    def chunk(self, pictures: int) -> float:
        return self.once + pictures * self.picture

    def read(self, pictures: int) -> float:
        """Bytes that a chunk reads."""
        frames = chunks.decoded(pictures, self.window, self.factor)
        filmed = frames / self.factor
        return filmed * self.source + (frames - filmed) * self.between


@dataclass(frozen=True)
class Plan:
    """What a film costs on so many nodes.

    chunk: pictures of one; work: core-hours of all
    hours: until in-betweens and pictures are done; join: hours of the join, which is one process
    anew: share of the pictures' core-hours that goes into what chunks pay anew; storage, traffic: bytes that are kept,
    and that are read and written in all"""

    chunk: int
    work: float
    hours: float
    join: float
    anew: float
    storage: float
    traffic: float


def plan(parts: Parts, pictures: int, nodes: int, cores: int, chunk: int) -> Plan:
    """chunk: pictures of one at most; there is one for each node at least."""
    chunk = min(chunk, math.ceil(pictures / nodes))
    count = math.ceil(pictures / chunk)
    rendered, built = count * parts.once + pictures * parts.picture, pictures * parts.pair
    longest = math.ceil(count / nodes) * parts.chunk(chunk)
    betweens = pictures * (parts.factor - 1) * parts.between
    written = betweens + pictures * parts.output
    # What windows read; what in-betweens are made of; and the pictures, for the film.
    read = count * parts.read(chunk) + (pictures * parts.source if parts.factor > 1 else 0) + pictures * parts.output
    return Plan(
        chunk,
        (rendered + built + pictures * parts.join) / 3600,
        (longest + built / nodes) / cores / 3600,
        pictures * parts.join / cores / 3600,
        count * parts.once / rendered,
        written + pictures * parts.source,
        written + read,
    )


def measured(footage: Path, factor: int, exposure: int, folder: Path) -> Parts:
    """Runs the command. subprocess.CalledProcessError: it failed."""
    window, cache, recipe = exposure * factor, folder / "inbetween", folder / f"{factor}.json"
    recipe.write_text(json.dumps(effect_recipe(window, factor)))
    short, long = LENGTHS[factor]
    pairs = long + exposure
    pair = 0.0
    if factor > 1:
        frames = f"{FIRST}:{FIRST + pairs - 1}"
        pair = seconds("inbetween", footage, "--factor", factor, "--cache", cache, "--frames", frames) / pairs
    edit = folder / f"{factor}.blend"
    outputs = {length: folder / f"{factor}-{length}" for length in (short, long)}
    times = {
        length: seconds(
            *("render", footage, "--recipe", recipe, "--output", output, "--cache", cache),
            *("--save", edit),
            *("--frames", f"{FIRST}:{FIRST + length - 1}"),
        )
        for length, output in outputs.items()
    }
    join = "join", outputs[long], "--edit", edit, "--output", folder / "film.mp4"
    picture = (times[long] - times[short]) / (long - short)
    joined = {length: seconds(*join, "--frames", f"{FIRST}:{FIRST + length - 1}") for length in (short, long)}
    with open_source(footage) as medium:
        source = sum(path.stat().st_size for path in medium.files) / medium.count
    between, output = mean_size(cache.rglob("*.png")), mean_size(outputs[long].glob("*.png"))
    once, join_one = times[short] - short * picture, (joined[long] - joined[short]) / (long - short)
    return Parts(factor, window, once, picture, pair, join_one, source, between, output)


def mean_size(paths) -> float:
    sizes = [path.stat().st_size for path in paths]
    return sum(sizes) / max(1, len(sizes))


def effect_recipe(window: int, factor: int) -> dict:
    """Three shutters on two lines and the border."""
    bars = {"Long": "ANGLE_360", "Sharp": "STILL", "Twice": "TWO_CUTS"}
    lines = {"Sharp": [[0.3, 0.2], [0.5, 0.8]], "Twice": [[0.7, 0.2], [0.7, 0.8]]}
    return {
        "version": 1,
        "window": window,
        "inbetween": factor,
        "border": True,
        "shutters": [{"name": name, "bars": presets.bars(preset, window).tolist()} for name, preset in bars.items()],
        "regions": [{"shutter": n, "kind": "line", "width": 0.02, "strokes": [points]} for n, points in lines.items()],
    }


def seconds(*arguments) -> float:
    """Processor time of the command."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, "-m", "shutter_addon", *map(str, arguments)], check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def parts_table(found: list[Parts]) -> str:
    """Markdown."""
    lines = [
        "| factor | window | chunk, anew | picture | in-betweens | join | source | in-between | picture |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for each in found:
        times = " | ".join(f"{time:.1f} s" if time else "" for time in (each.once, each.picture, each.pair, each.join))
        sizes = " | ".join(f"{size / 1e6:.1f} MB" if size else "" for size in (each.source, each.between, each.output))
        lines.append(f"| {each.factor} | {each.window} | {times} | {sizes} |")
    return "\n".join(lines)


def plans_table(found: list[Parts], pictures: int, nodes: list[int], cores: int, network: float) -> str:
    """Markdown. The network's column is what the traffic takes alone; network: of the storage, in Gbit/s."""
    lines = [
        "| factor | nodes | chunk | core-hours | anew | pictures | join | network | storage | traffic | of a node |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for parts in found:
        for count in nodes:
            each = plan(parts, pictures, count, cores, chunks.chunk_size(parts.window, parts.factor))
            speed = each.traffic * 8 / (each.hours * 3600 * count) / 1e6
            times = f"{span(each.hours)} | {span(each.join)} | {span(each.traffic * 8 / network / 1e9 / 3600)}"
            size = f"{each.storage / 1e12:.1f} TB | {each.traffic / 1e12:.1f} TB | {speed:,.0f} Mbit/s"
            work = f"{each.work:,.0f} | {each.anew:.1%}"
            lines.append(f"| {parts.factor} | {count:,} | {each.chunk} | {work} | {times} | {size} |")
    return "\n".join(lines)


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
    parser.add_argument("--exposure", type=int, default=16, help="source frames")
    parser.add_argument("--factors", type=numbers, default=[1, 8])
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
            found = [measured(options.footage, factor, options.exposure, Path(folder)) for factor in options.factors]
    if options.json:
        options.json.write_text(json.dumps([asdict(each) for each in found], indent=1) + "\n")
    print(parts_table(found), end="\n\n")
    pictures = round(options.hours * 3600 * options.rate)
    print(plans_table(found, pictures, options.nodes, options.cores, options.network))
    for each in found:
        print(f"factor {each.factor}: most of it is paid anew below {dominated(each):.1f} pictures a chunk")
    return 0


if __name__ == "__main__":
    sys.exit(main())
