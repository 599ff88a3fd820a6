"""A limit of the GPU's memory: the command's option, what is told, and what is given back."""

import numpy as np
import pytest
from support import noise, picture_of, read_picture, recipe, write_frames

from shutter_addon.blender.rendering import render_settings, sessions

SIZE = 480, 270
# In megabytes, for windows of 8 frames of that size: room for their running sums, and for no window.
ROOMY, SMALL = 64, 12


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    """The first of ten frames, and a recipe whose scribble moves."""
    keys = [{"frame": 1}, {"frame": 10, "location": [0.3, 0.1]}]
    moved = {"shutter": "S1", "strokes": [[[0.2, 0.2], [0.5, 0.8]]], "width": 0.1, "keys": keys}
    data = recipe(8, np.ones(8), [1] + [0] * 7, regions=[moved], border=True)
    return write_frames(tmp_path_factory.mktemp("film"), noise(10, *SIZE[::-1], 3)), data


def pictures(folder):
    return np.array([read_picture(path) for path in sorted(folder.iterdir())])


def test_little_memory_shows_the_same_and_says_so_once(command_here, film, tmp_path):
    first, data = film
    for name, megabytes in (("roomy", ROOMY), ("small", SMALL)):
        options = "--output", tmp_path / name, "--frames", "1:3", "--gpu-memory", str(megabytes)
        done = command_here(first, *options, recipe=data)
        told = "12 MB of GPU memory are too little for 8 frames of 480×270: every picture uploads all of them"
        assert done.stderr.count(told) == (name == "small"), done.stderr
    command_here(first, "--output", tmp_path / "part", "--frames", "3", "--gpu-memory", str(SMALL), recipe=data)
    roomy, small, part = (pictures(tmp_path / name) for name in ("roomy", "small", "part"))
    assert np.abs(small - roomy).max() <= 1 / 16
    assert np.array_equal(part[0], small[2])


def test_what_cannot_be_is_told(command_here, film, tmp_path):
    first, data = film
    for megabytes, sentence in (
        ("1", "in the 1 MB that it may take"),
        *((each, f"--gpu-memory: '{each}' is not a number of megabytes") for each in ("-5", "1.5", "much")),
    ):
        options = "--output", tmp_path / "none", "--gpu-memory", megabytes
        done = command_here(first, *options, recipe=data, check=False)
        assert done.returncode == 2
        assert sentence in done.stderr


def test_a_session_gives_back_what_it_took_and_settles_for_another_limit(bpy, edit, effect):
    sessions.forget()
    with render_settings.using(gpu_memory=ROOMY):
        sessions.close_if_device_changed()
        picture = picture_of(effect.scene, 1)
        budget = render_settings.memory()
        assert (budget.limit, budget.used > 0) == (ROOMY << 20, True)
        sessions.OFFSCREEN.free()
        assert np.array_equal(picture_of(effect.scene, 1), picture)
    with render_settings.using(gpu_memory=SMALL):
        sessions.close_if_device_changed()
        assert budget.used == 0
        assert np.abs(picture_of(effect.scene, 1) - picture).max() <= 2**-14
        budget = render_settings.memory()
        assert (budget.limit, budget.used > 0) == (SMALL << 20, True)
    sessions.forget()
    assert budget.used == 0
    sessions.close_if_device_changed()
    assert render_settings.memory().limit > ROOMY << 20
