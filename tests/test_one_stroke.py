"""One stroke beside the truth, as scripts/one_stroke.py measures it, on few small frames."""

import json
import subprocess
import sys

from gallery.item import ROOT

# In a process of its own: an empty scene would take the other tests' edits away.
MEASURE = """
import json, sys
from dataclasses import replace
from pathlib import Path
sys.path.insert(1, "scripts")
import one_stroke, one_stroke_scenes as truth
folder = Path(sys.argv[1])
scene = replace(truth.SCENES[0], board=lambda frame: truth.across(18 + frame), start=3)
truth.render(scene, folder, (160, 90), count=5, samples=2)
keyed = one_stroke.tracked(scene, folder)
masks = one_stroke.Masks(folder, keyed)
found = {way: masks.overlap(way)["worst"] for way in ("one stroke", "without edges")}
print(json.dumps(one_stroke.motion(scene, folder, keyed) | found))
"""


def test_one_stroke_is_the_subject(tmp_path):
    command = [sys.executable, "-c", MEASURE, str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout.splitlines()[-1])
    assert found["tracked"] == found["seen"] == 5
    assert found["error"] < 1
    assert found["wrong_but_sure"] == 0
    assert found["one stroke"] > 0.9
    assert found["without edges"] < 0.8
