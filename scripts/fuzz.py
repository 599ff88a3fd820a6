"""Tries hostile recipes and media, each in a process of its own, and keeps what fails.

python scripts/fuzz.py [--minutes M | --inputs N] [--seed S] [--kinds recipes,media] [--output DIR]
python scripts/fuzz.py --repeat DIR

A failure is: an exception other than the sentences that are meant for users, a traceback, a signal, another exit code
of the command than 0 and 2, too much time or memory, files touched outside of the working folder, a source changed,
half-written files left behind, other pictures from the same input, devices that differ from the reference. An input
depends on its kind, the seed and its number alone, as long as code and packages are the same. What failed lies in
DIR/KIND-SEED-NUMBER: its input, which may be made smaller by hand before it is repeated, and what was said.
"""

import argparse
import collections
import itertools
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from fuzzing import ROOT, trial

KINDS = {kind: f"fuzzing.{kind}" for kind in ("recipes", "media")}


def main(argv=None) -> int:
    arguments = _parser().parse_args(argv)
    if arguments.repeat:
        folder = arguments.repeat.resolve()
        faults = trial.repeat(folder, KINDS[_kind(folder)], arguments.seconds)
        print((folder / trial.LOG).read_text(errors="replace"), *faults, sep="\n")
        return bool(faults)
    numbers = itertools.count(arguments.first)
    if arguments.inputs is not None:
        numbers = itertools.islice(numbers, arguments.inputs)
    else:
        end = time.monotonic() + 60 * arguments.minutes
        numbers = itertools.takewhile(lambda _: time.monotonic() < end, numbers)
    kinds = {kind: KINDS[kind] for kind in arguments.kinds}
    tried, failures = fuzz(kinds, arguments.seed, arguments.output.resolve(), numbers, arguments.seconds)
    _sum_up(tried, failures)
    return bool(failures)


def _parser():
    parser = argparse.ArgumentParser("fuzz", description="Hostile input of every kind.")
    parser.add_argument("--minutes", type=float, default=5, help="how long it goes on (default: 5)")
    parser.add_argument("--inputs", type=int, metavar="N", help="in place of that, how many inputs of each kind")
    parser.add_argument("--first", type=int, default=0, metavar="NUMBER", help="of the first input (default: 0)")
    parser.add_argument("--seed", default="1", help="(default: 1)")
    parser.add_argument("--kinds", type=_kinds, default=list(KINDS), help=f"(default: {','.join(KINDS)})")
    parser.add_argument("--output", type=Path, default=ROOT / "out" / "fuzz", metavar="DIR", help="for what fails")
    parser.add_argument("--seconds", type=float, default=15, help="that an input may compute (default: 15)")
    parser.add_argument("--repeat", type=Path, metavar="DIR", help="an input that failed, once more")
    return parser


def _kinds(text: str) -> list[str]:
    if unknown := [kind for kind in text.split(",") if kind not in KINDS]:
        raise argparse.ArgumentTypeError(f"there is no {unknown[0]}; there are {', '.join(KINDS)}")
    return text.split(",")


def fuzz(kinds: dict[str, str], seed: str, output: Path, numbers, seconds: float) -> tuple[dict, dict]:
    """Tries inputs of these numbers of each kind, whose modules are given by name.

    Gives how many of each kind were tried, and by the folder of each that failed its faults, which are printed."""
    tried, failures = collections.Counter(), {}
    inputs = ((output / f"{kind}-{seed}-{number}", kinds[kind]) for number in numbers for kind in kinds)
    for folder, faults in trial.attempts(inputs, seconds):
        tried[_kind(folder)] += 1
        if faults:
            failures[folder] = faults
            print(f"{folder.name}: {faults[0]}\n    scripts/fuzz --repeat {folder}", flush=True)
    return dict(tried), failures


def _sum_up(tried: dict, failures: dict) -> None:
    alike = collections.defaultdict(list)
    for folder, faults in failures.items():
        alike[_kind(folder), trial.gist(faults[0])].append(folder)
    for (kind, gist), folders in sorted(alike.items(), key=lambda item: -len(item[1])):
        print(f"{len(folders):4} × {kind}: {gist}\n         scripts/fuzz --repeat {folders[0]}")
    for kind, count in tried.items():
        print(f"{kind}: {count} inputs, {sum(_kind(folder) == kind for folder in failures)} failed")


def _kind(folder: Path) -> str:
    return folder.name.split("-")[0]


if __name__ == "__main__":
    sys.exit(main())
