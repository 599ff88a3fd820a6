"""A shutter over sub-frames is the exposure that Cycles computes; a wrong shutter is not."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
# What Cycles' noise leaves of the similarity, at so few samples and pixels.
SIMILAR = 0.99


def run(*options):
    return subprocess.run([sys.executable, "scripts/truth.py", *options], cwd=ROOT, capture_output=True, text=True)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    pytest.importorskip("bpy")
    made = tmp_path_factory.mktemp("truth")
    small = ("--cases", "box", "--size", "96x64", "--samples", "512")
    done = run("--output", str(made), "--json", str(made / "rows.json"), *small)
    assert done.returncode == 0, done.stderr
    return made


def test_the_box_is_cycles_own(folder):
    rows = {row["picture"]: row for row in json.loads((folder / "rows.json").read_text())}
    assert rows["ours"]["similarity"] > SIMILAR > rows["wrong"]["similarity"]
    assert rows["ours"]["mean"] < 0.5 < rows["wrong"]["mean"]
    assert rows["ours"]["similarity"] < 1, "a picture compared with itself"


def test_it_leaves_the_pictures_and_no_parts(folder):
    assert {file.name for file in folder.iterdir()} == {"rows.json", "truth.png"}


def test_what_cannot_be_measured_is_said():
    pytest.importorskip("bpy")
    done = run("--cases", "disc")
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1].endswith("'disc' is none of box, triangle, rolling")
