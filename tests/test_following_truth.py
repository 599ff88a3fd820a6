"""Exposures that follow beside the truth, as scripts/following_truth.py measures them, on few small frames."""

import json
import subprocess
import sys

from gallery.item import ROOT

# In a process of its own: an empty scene would take the other tests' edits away.
MEASURE = """
import json, sys
from pathlib import Path
sys.path.insert(1, "scripts")
import following_truth
from gallery import scenes
pan, tripod = following_truth.pan_scene, following_truth.tripod_scene
pan.SIZE, pan.COUNT, pan.FRAME, pan.WINDOW = (240, 135), 11, 6, 9
scenes.SIZE, tripod.COUNT, tripod.FRAME = (384, 216), 5, 3
print(json.dumps({SCENE}))
"""


def measured(folder, call):
    command = [sys.executable, "-c", MEASURE.replace("{SCENE}", call), str(folder)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def test_a_panning_shot_is_what_a_panning_camera_takes(tmp_path):
    rows = measured(tmp_path, "following_truth.panning(Path(sys.argv[1]), samples=16)")
    found = {row.pop("picture"): row for row in rows}
    assert found["following"]["part"] > 0.95 > 0.7 > found["plain exposure"]["part"]
    assert found["following"]["all"] > 0.93 > found["a single frame"]["all"]
    assert found["following"]["detail"] > 0.85 > found["plain exposure"]["detail"]


def test_following_the_camera_is_a_tripod(tmp_path):
    *rows, track = measured(tmp_path, "following_truth.handheld(Path(sys.argv[1]))")
    similar = {row["picture"]: row["part"] for row in rows}
    assert similar["following"] > 0.97 > 0.95 > similar["plain exposure"]
    assert track["off"] < 1
    assert 0.7 < track["seen"] < 0.99
