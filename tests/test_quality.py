"""Blocks of 2×2 pixels that share a shutter look like full resolution: the paper's figures for it, on two films."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
# Structural similarity that the paper obtained with its own.
AVERAGE, WORST = 0.9982, 0.9777


@pytest.fixture(scope="module")
def rows(tmp_path_factory):
    def measured(*options):
        file = tmp_path_factory.mktemp("quality") / "rows.json"
        subprocess.run([sys.executable, "scripts/quality.py", "--json", str(file), *options], cwd=ROOT, check=True)
        return json.loads(file.read_text())

    return measured("--frames", "2") + measured("--frames", "1", "--windows", "64", "--bars", "preset")


def test_every_case_is_measured(rows):
    assert {row["film"] for row in rows} == {"bigbuckbunny.mp4", "pedestrians.avi"}
    assert {(row["bars"], row["window"]) for row in rows} == {("preset", 16), ("random", 16), ("preset", 64)}


def test_blocks_look_like_full_resolution(rows):
    for row in rows:
        assert AVERAGE <= row["mean"] < 1, row
        assert WORST <= row["worst"] < 1, row


def test_a_film_that_is_not_there_is_one_sentence():
    command = [sys.executable, "scripts/quality.py", "none.mp4"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("quality: none.mp4: no such file")
