"""What scripts/fuzz.py tries: a module per kind of input, with two functions.

make(random, folder) writes an input into a folder, by that source of chance alone. run(folder) runs the product on a
copy of it, and raises what is a fault. In the copy, what lies in the WRITTEN folders alone may change."""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
WRITTEN = ("out", "cache")

# For the tests' makers of footage, edits and recipes, and their comparisons of a device with the references.
TESTS = "tests", "tests/media", "tests/blender", "tests/compute", "tests/differential"
sys.path[:0] = [str(ROOT / folder) for folder in (".", *TESTS)]
