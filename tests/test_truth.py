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
    done = run("--output", str(made), "--json", str(made / "rows.json"), "--size", "96x64", "--samples", "512")
    assert done.returncode == 0, done.stderr
    return made


@pytest.mark.parametrize("case", ["box", "triangle", "rolling"])
def test_it_is_cycles_own_exposure(folder, case):
    rows = {row["picture"]: row for row in json.loads((folder / "rows.json").read_text()) if row["case"] == case}
    assert rows["ours"]["similarity"] > SIMILAR > rows["wrong"]["similarity"]
    assert rows["ours"]["mean"] < 1 < rows["wrong"]["mean"]
    assert rows["ours"]["similarity"] < 1, "a picture compared with itself"


def test_it_leaves_the_pictures_and_no_parts(folder):
    assert {file.name for file in folder.iterdir()} == {"rows.json", "truth.png"}


def test_what_cannot_be_measured_is_said():
    pytest.importorskip("bpy")
    done = run("--samples", "100")
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1].endswith("100 is not a multiple of 64: each sub-frame has as many")
