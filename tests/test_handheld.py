"""A long exposure held in the hand beside the tripod's, as scripts/handheld.py measures it, on few small frames."""

import json
import subprocess
import sys

from gallery.item import ROOT

# In a process of its own: an empty scene would take the other tests' edits away.
MEASURE = """
import json, sys
from pathlib import Path
sys.path.insert(1, "scripts")
import handheld
from gallery import scenes
scenes.SIZE, handheld.scene.COUNT, handheld.scene.FRAME = (384, 216), 5, 3
print(json.dumps(handheld.measure(Path(sys.argv[1]))))
"""


def test_following_the_camera_is_a_tripod(tmp_path):
    command = [sys.executable, "-c", MEASURE, str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout.splitlines()[-1])
    similar = {row["picture"]: row["seen"] for row in found["rows"]}
    assert similar["following the camera"] > 0.97 > 0.95 > similar["plain exposure"]
    assert found["off"] < 1
    assert 0.7 < found["seen"] < 0.99
