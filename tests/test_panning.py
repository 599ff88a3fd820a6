"""A panning shot beside the truth, as scripts/panning.py measures it, on few small frames."""

import json
import subprocess
import sys

from gallery.item import ROOT

# In a process of its own: an empty scene would take the other tests' edits away.
MEASURE = """
import json, sys
from pathlib import Path
sys.path.insert(1, "scripts")
import panning
panning.scene.SIZE = 240, 135
panning.scene.COUNT, panning.scene.FRAME, panning.scene.WINDOW = 11, 6, 9
print(json.dumps({row.pop("picture"): row for row in panning.measure(Path(sys.argv[1]), samples=16)}))
"""


def test_a_panning_shot_is_what_a_panning_camera_takes(tmp_path):
    command = [sys.executable, "-c", MEASURE, str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout.splitlines()[-1])
    assert found["panning shot"]["subject"] > 0.95 > 0.7 > found["plain exposure"]["subject"]
    assert found["panning shot"]["all"] > 0.93 > found["a single frame"]["all"]
    assert found["panning shot"]["detail"] > 0.85 > found["plain exposure"]["detail"]
