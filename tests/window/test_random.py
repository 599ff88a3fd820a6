"""Random operators in a real window; SHUTTER_SEEDS (1,2,3) and SHUTTER_STEPS (500) try others than CI does."""

import json
import os
import subprocess
import sys

import numpy as np
import OpenImageIO
import pytest
from fresh import PACKAGES, installed
from telling import NO_NETWORK, ROOT, backends, linked, needs_window, tell

pytestmark = needs_window

SEEDS = os.environ.get("SHUTTER_SEEDS", "1").split(",")
STEPS = os.environ.get("SHUTTER_STEPS", "40")
COUNT, TOLERANCE = 30, 1


def pixels(path):
    return OpenImageIO.ImageBuf(str(path)).get_pixels(OpenImageIO.UINT8)[..., :3].astype(int)


@pytest.fixture(scope="module")
def footage(tmp_path_factory):
    """A sequence of frames, a recipe, and what the command makes of them: the folder."""
    folder = tmp_path_factory.mktemp("footage")
    (folder / "frames").mkdir()
    for number, frame in enumerate(np.random.default_rng(1).integers(0, 256, (COUNT, 54, 96, 3), dtype=np.uint8)):
        OpenImageIO.ImageBuf(frame).write(str(folder / "frames" / f"{number + 1:04d}.png"))
    line = {"name": "Line", "shutter": "Sharp", "strokes": [[[0.2, 0.2], [0.6, 0.9]]], "width": 0.1}
    shutters = [{"name": "Long", "bars": [1] * 6}, {"name": "Sharp", "bars": [0, 0, 1, 0, 0, 0]}]
    recipe = {"version": 2, "window": 6, "border": True, "shutters": shutters, "regions": [line]}
    (folder / "recipe.json").write_text(json.dumps(recipe))
    command = (sys.executable, "-m", "shutter_addon", "render", folder / "frames" / "0001.png")
    options = ("--recipe", folder / "recipe.json", "--output", folder / "expected", "--device", "opengl")
    subprocess.run([*command, *options], check=True, cwd=ROOT)
    return folder


def assert_right(seen, footage, folder):
    """Every picture that a story noted is the source's frame, or the effect's as the command renders it."""
    for entry in seen:
        assert (folder / entry["still"]).exists(), (entry, folder)
        (index, through), picture = entry["shows"], pixels(folder / entry["still"])
        name = f"{index % COUNT + 1:04d}.png"
        expected = pixels(footage / ("expected" if through else "frames") / name)
        assert np.abs(picture - expected).max() <= TOLERANCE, (entry, folder)


@pytest.mark.parametrize("backend", backends("vulkan"))
@pytest.mark.parametrize("seed", SEEDS)
def test_random_operators(seed, backend, footage, tmp_path):
    given = {"footage": footage / "frames" / "0001.png", "recipe": footage / "recipe.json"}
    seen, console = tell("random_story.py", backend, linked(tmp_path), **given, seed=seed, steps=STEPS)
    assert "Traceback" not in console
    assert_right(seen, footage, tmp_path)


@pytest.mark.parametrize("seed", SEEDS)
def test_random_operators_of_the_zip_without_wheels(seed, footage, real_blender, blenders_python, tmp_path):
    """Installed in a Blender that has never seen the extension, without a network."""
    build = [sys.executable, ROOT / "scripts" / "build.py", "--output", tmp_path / "dist"]
    subprocess.run([*build, "--python", blenders_python, "--system", "linux-x64"], check=True, capture_output=True)
    (path,) = (tmp_path / "dist").glob("*no_wheels.zip")
    given = {"footage": footage / "frames" / "0001.png", "recipe": footage / "recipe.json"}
    given["hidden"] = " ".join(PACKAGES)
    installed([*NO_NETWORK, *real_blender], path, tmp_path / "user")
    seen, console = tell("random_story.py", "opengl", tmp_path, before=NO_NETWORK, **given, seed=seed, steps=STEPS)
    assert "Traceback" not in console
    assert_right(seen, footage, tmp_path)
