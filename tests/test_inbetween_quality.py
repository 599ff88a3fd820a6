"""What the comparison of moments between frames says when it cannot be made."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.mark.parametrize("part", ["films", "speed"])
def test_a_film_that_is_not_there_is_one_sentence(part):
    command = [sys.executable, "scripts/inbetween_quality.py", "--films", "none.mp4", "--parts", part]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("inbetween_quality: none.mp4: no such file")
    assert done.stderr.count("\n") == 1
