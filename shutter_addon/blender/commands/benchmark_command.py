"""The command `benchmark`: how fast this machine composes."""

from __future__ import annotations

import argparse
import json
import re
from argparse import Namespace

from ...compute import benchmark
from ...core.messages import sentence
from ..devices import available, machine
from ..output import film_output
from . import command_line

# Pixels along a picture's side, and frames of a window, that can be measured.
MOST_PIXELS, MOST_FRAMES = 16384, 256


def add(commands: argparse._SubParsersAction) -> None:
    parser = commands.add_parser("benchmark", help="measure how fast this machine composes, for a bug report")
    parser.add_argument("--device", choices=available.CHOICES, help="as for render")
    parser.add_argument("--json", type=command_line.place, metavar="FILE.json", help="also write what was measured")
    parser.add_argument("--sizes", type=_sizes, default=benchmark.SIZES, metavar="WxH,…", help="of pictures")
    parser.add_argument("--windows", type=_windows, default=benchmark.WINDOWS, metavar="L,…", help="frames a picture")
    parser.add_argument(
        "--seconds", type=_seconds, default=60.0, help="about how long it may take; what would take longer is left out"
    )
    parser.set_defaults(run=run)


def run(arguments: Namespace) -> None:
    compositor, lesser = machine.open_device(arguments.device)
    steps = len(arguments.sizes) * (len(arguments.windows) + 1)
    try:
        described = machine.described(compositor, lesser)
        with film_output.whole(arguments.json) as part, film_output.progress(steps, "row") as moved:
            rows, plays = benchmark.run(compositor, arguments.sizes, arguments.windows, arguments.seconds, moved)
            if part:
                report = {"machine": described, "rows": rows, "plays": plays}
                part.write_text(json.dumps(report, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    finally:
        compositor.release()
    lines = "\n".join(f"- {heading}: {value}" for heading, value in described.items())
    command_line.tell(f"{lines}\n\n{benchmark.table(rows, plays)}\n\n{benchmark.MEASURED}")


def _sizes(text: str) -> list[tuple[int, int]]:
    matches = [re.fullmatch(r"(\d{1,5})x(\d{1,5})", part) for part in text.split(",")]
    sizes = [(int(match[1]), int(match[2])) for match in matches if match]
    if len(sizes) < len(matches) or not all(1 <= n <= MOST_PIXELS for size in sizes for n in size):
        raise argparse.ArgumentTypeError(f'"{sentence(text, 40)}" is not WxH,… with 1 to {MOST_PIXELS} pixels a side')
    return sizes


def _windows(text: str) -> list[int]:
    windows = [int(part) if re.fullmatch(r"\d{1,4}", part) else 0 for part in text.split(",")]
    if not all(2 <= window <= MOST_FRAMES for window in windows):
        raise argparse.ArgumentTypeError(f'"{sentence(text, 40)}" is not L,… with 2 to {MOST_FRAMES} frames')
    return windows


def _seconds(text: str) -> float:
    if not re.fullmatch(r"\d{1,6}(\.\d{1,6})?", text):
        raise argparse.ArgumentTypeError(f'"{sentence(text, 40)}" is no number of seconds')
    return float(text)
