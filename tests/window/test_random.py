"""Random operators in a real window; SHUTTER_SEEDS (1,2,3) and SHUTTER_STEPS (500) try others than CI does."""

import os

import numpy as np
import pytest
from fresh import PACKAGES, installed
from screens import pixels
from telling import NO_NETWORK, backends, built, command_renders, linked, needs_window, noise, recipe, tell

pytestmark = needs_window

SEEDS = os.environ.get("SHUTTER_SEEDS", "1").split(",")
STEPS = os.environ.get("SHUTTER_STEPS", "40")
COUNT, TOLERANCE = 30, 1


@pytest.fixture(scope="module")
def footage(tmp_path_factory):
    """A sequence of frames, a recipe, and what the command makes of them: the folder."""
    folder = tmp_path_factory.mktemp("footage")
    command_renders(noise(folder, COUNT, (96, 54)), recipe(folder, [0, 0, 1, 0, 0, 0]), folder / "expected")
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
    seen = tell("random_story", backend, linked(tmp_path), **given, seed=seed, steps=STEPS)
    assert_right(seen, footage, tmp_path)


@pytest.mark.parametrize("seed", SEEDS)
def test_random_operators_of_the_zip_without_wheels(seed, footage, real_blender, blenders_python, tmp_path):
    """Installed in a Blender that has never seen the extension, without a network."""
    path = built(tmp_path, blenders_python, "no_wheels")
    given = {"footage": footage / "frames" / "0001.png", "recipe": footage / "recipe.json"}
    given["hidden"] = " ".join(PACKAGES)
    installed([*NO_NETWORK, *real_blender], path, tmp_path / "user")
    seen = tell("random_story", "opengl", tmp_path, before=NO_NETWORK, **given, seed=seed, steps=STEPS)
    assert_right(seen, footage, tmp_path)
