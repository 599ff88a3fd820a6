"""The gallery's rendered footage: a render that was stopped goes on where it was, and torn frames never count."""

import subprocess
import sys

import numpy as np
from OpenImageIO import ImageBuf

from gallery.item import ROOT

# A process of its own: an empty scene would take the other tests' edits away.
RENDER = """
import sys
from pathlib import Path
from gallery import scenes
scenes.SIZE = 64, 36
folder = Path(sys.argv[1])
assert scenes.complete(folder, 3) is None
scenes.begin("#8fa6c4", samples=1)
scenes.camera((0, -9, 0), (0, 0, 0), 50)
ball = scenes.ball(1, (0, 0, 0), scenes.paint("#e4572e"))
scenes.animate(ball, 3, location=lambda frame: (frame - 2, 0, 0))
assert scenes.render_frames(folder, 3) == scenes.complete(folder, 3) == folder / "0001.png"
"""


def render(folder):
    done = subprocess.run([sys.executable, "-c", RENDER, folder], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_a_stopped_render_goes_on(tmp_path):
    (tmp_path / "0002.png").write_bytes(b"was finished before")
    (tmp_path / ".part.png").write_bytes(b"was stopped halfway")
    render(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["0001.png", "0002.png", "0003.png"]
    assert (tmp_path / "0002.png").read_bytes() == b"was finished before"
    first, last = (ImageBuf(str(tmp_path / name)).get_pixels() for name in ("0001.png", "0003.png"))
    assert np.abs(first - last).max() > 0.1, "the ball has moved"
