"""The gallery's rendered footage: every scene can be built, a render that was stopped goes on where it was, and torn
frames never count."""

import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from OpenImageIO import ImageBuf

from gallery import object_matte
from gallery.item import ROOT
from shutter_addon.core.recipes import recipe_file
from shutter_addon.media.opening import MatteFile

# Each in a process of its own: an empty scene would take the other tests' edits away.
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
FIRST_FRAME = """
import sys
from importlib import import_module
from pathlib import Path
from gallery import scenes
scenes.SIZE = 64, 36
render_frames = scenes.render_frames
scenes.render_frames = lambda folder, count, *options: render_frames(folder, 1, *options)
for name in sys.argv[2:]:
    print("FOOTAGE", import_module(f"gallery.{name}").ITEM.footage(Path(sys.argv[1]) / name), sep="\\n")
"""


SCENES = "pendulum", "sphere", "displacement", "hands", "rolling_shutter", "rolling_repair", "light_trails"


def run(code, *arguments):
    command = [sys.executable, "-c", code, *arguments]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_stopped_render_goes_on(tmp_path):
    (tmp_path / "0002.png").write_bytes(b"was finished before")
    (tmp_path / ".part.png").write_bytes(b"was stopped halfway")
    run(RENDER, tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["0001.png", "0002.png", "0003.png"]
    assert (tmp_path / "0002.png").read_bytes() == b"was finished before"
    first, last = (ImageBuf(str(tmp_path / name)).get_pixels() for name in ("0001.png", "0003.png"))
    assert np.abs(first - last).max() > 0.1, "the ball has moved"


@pytest.fixture(scope="module")
def footage(tmp_path_factory):
    names, folder = (*SCENES, "object_matte"), tmp_path_factory.mktemp("scenes")
    said = run(FIRST_FRAME, folder, *names).splitlines()
    paths = [path for before, path in pairwise(said) if before == "FOOTAGE"]
    return folder, {name: ImageBuf(path).get_pixels()[..., :3] for name, path in zip(names, paths, strict=True)}


def test_scenes_are_built_and_rendered(footage):
    for name in SCENES:
        picture = footage[1][name]
        assert picture.shape[1] == 64, name
        assert picture.std() > 0.02, f"there is something to be seen of {name}"


def test_an_objects_matte_is_rendered_beside_it(footage):
    """The recipe names its file and its channel. It covers what is red there, in part at its edges."""
    folder, picture = footage[0] / "object_matte", footage[1]["object_matte"]
    (region,) = recipe_file.load(ROOT / "gallery" / "object_matte.json").regions
    content = region.content
    assert content.channel == f"{object_matte.NAME}.V"
    values = MatteFile(folder / Path(content.path).relative_to("footage"), content.channel).open().read(0)
    assert values.shape == picture.shape[:2]
    assert 0.02 < values.mean() < 0.2
    assert ((values > 0) & (values < 1)).any()
    redness = picture[..., 0] - picture[..., 1:3].mean(axis=2)
    assert redness[values == 1].mean() > redness[values == 0].mean() + 0.2
