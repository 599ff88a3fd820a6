"""The command over moments between frames, end to end."""

import numpy as np
import pytest
from standin import Between, moments, spread
from support import packages, read_picture, recipe, write_frames

from shutter_addon.core.frames import light
from shutter_addon.media import flow, open_source

STEPS, COUNT, CUT = 4, 10, 6


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    """Two shots: the first file, and all moments in linear light (count, H, W, 3)."""
    rng = np.random.default_rng(8)
    shots = [rng.integers(0, 256, (6, 10, 3), dtype=np.uint8).repeat(4, 0).repeat(4, 1) for _ in range(2)]
    frames = [np.roll(shots[k >= CUT], k, axis=1) for k in range(COUNT)]
    first = write_frames(tmp_path_factory.mktemp("film"), frames)
    with open_source(first) as source:
        every = moments(np.stack([source.read(k) for k in range(COUNT)]), STEPS)
    return first, light.to_linear(every[..., :3] / 255)


@pytest.fixture
def run(command_here, tmp_path, monkeypatch):
    """Renders in this process by moments that are known: what is said on stderr."""
    monkeypatch.setattr(flow, "Between", Between)

    def run(source, output, recipe, *arguments):
        return command_here(source, "--output", tmp_path / output, *arguments, recipe=recipe).stderr

    return run


def shown(frames, indices, weights):
    weights = np.asarray(weights) / np.sum(weights)
    return light.to_encoded(np.tensordot(weights, frames[list(indices)], 1)) * 255


def test_chunks_are_the_whole(run, film, tmp_path):
    """Bit for bit. Which pictures these are, test_smooth.py has."""
    first, _frames = film
    data = recipe(2, [1, 1], inbetween=STEPS)
    run(first, "whole", data)
    for chunk in ("7:10", "1:2", "3:6"):
        run(first, "parts", data, "--frames", chunk)
    whole, parts = ([read_picture(path) for path in sorted((tmp_path / way).iterdir())] for way in ("whole", "parts"))
    assert len(whole) == COUNT
    np.testing.assert_array_equal(whole, parts)


def test_source_time_ramps(run, film, tmp_path, same_pixels):
    """A fourth of the speed, then backward; the film ends with the last key. A still frame is the moment there."""
    first, frames = film
    time = [{"frame": 1, "value": 2}, {"frame": 9, "value": 4}, {"frame": 17, "value": 2}]
    bars = [1, 1]
    run(first, "out", recipe(2, bars, inbetween=STEPS, time=time), "--frames", "1:17")
    for frame, start, way in ((1, 4, 1), (2, 5, 1), (6, 9, 1), (12, 9, -1), (16, 5, -1)):
        places = start + way * np.arange(len(bars) * STEPS)
        expected = shown(frames, places, spread(bars, STEPS))
        same_pixels(read_picture(tmp_path / "out" / f"{frame:04d}.png"), expected, 1)
    run(first, "still", recipe(2, [1, 0], inbetween=STEPS, time=time), "--frames", "1:8")
    for frame in range(1, 9):
        same_pixels(read_picture(tmp_path / "still" / f"{frame:04d}.png"), shown(frames, [frame + 3], [1]), 1)
    run(first, "nearest", recipe(1, [1], time=time), "--frames", "4:8")
    for frame, source in ((4, 2), (5, 2), (7, 3), (8, 3)):  # 2.75, 3, 3.5 and 3.75, the first is 1
        same_pixels(read_picture(tmp_path / "nearest" / f"{frame:04d}.png"), shown(frames, [4 * source], [1]), 1)


def test_a_recipe_of_the_first_version(run, film, tmp_path, same_pixels):
    """Its bars count moments, and it says a method; what is shown is within the frames that it showed."""
    first, frames = film
    data = recipe(8, [1, 1, 1, 1, 0.5, 0.5, 0.5, 0.5], inbetween=STEPS, inbetween_method="good") | {"version": 1}
    said = run(first, "out", data, "--frames", 2)
    assert f'{tmp_path / "recipe.json"}: shutter "S0": bars ' in said
    assert "of the older file are one filmed frame now" in said
    bars = [1, 0.5]
    same_pixels(read_picture(tmp_path / "out" / "0002.png"), shown(frames, range(4, 12), spread(bars, STEPS)), 1)


def test_a_saved_edit_in_blender(command_here, film, tmp_path, blender, blenders_python, monkeypatch):
    """With real flow: as the library renders it, and nothing lies beside it."""
    first, _ = film
    monkeypatch.setenv("PYTHONPATH", str(packages(tmp_path / "packages", blenders_python)))
    places = ["--save", f"{tmp_path}/edit/e.blend", "--output", f"{tmp_path}/out", "--frames", "4:7"]
    command_here(first, *places, recipe=recipe(3, np.ones(3), inbetween=STEPS))
    assert [path.name for path in (tmp_path / "edit").iterdir()] == ["e.blend"]
    done = blender(tmp_path / "edit" / "e.blend", "-o", f"{tmp_path}/again/", "-a")
    assert done.returncode == 0, done.stderr
    for frame in range(4, 8):
        found, expected = (read_picture(tmp_path / way / f"{frame:04d}.png") for way in ("again", "out"))
        assert np.abs(found[..., :3] - expected[..., :3]).max() <= 1, frame
