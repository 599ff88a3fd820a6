"""The command over in-between frames, end to end."""

import hashlib
import json
import os
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import av
import numpy as np
import pytest
from standin import between
from support import read_picture, recipe, write_frames

from shutter_addon.core.frames import light
from shutter_addon.media import open_source

ROOT = Path(__file__).parents[2]
COUNT, CUT = 10, 6


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    """Two shots: the first file, and all frames at 4× in linear light (count, H, W, 3)."""
    rng = np.random.default_rng(8)
    shots = [rng.integers(0, 256, (6, 10, 3), dtype=np.uint8).repeat(4, 0).repeat(4, 1) for _ in range(2)]
    first = write_frames(
        tmp_path_factory.mktemp("film"), np.stack([np.roll(shots[k >= CUT], k, axis=1) for k in range(COUNT)])
    )
    with open_source(first) as source:
        frames = [source.read(k) for k in range(COUNT)]
    every = []
    for k, (a, b) in enumerate(pairwise(frames)):
        every += [a, *([a, a, b] if k == CUT - 1 else between(a, b, 4))]
    return first, light.to_linear(np.stack([*every, frames[-1]])[..., :3] / 255)


@pytest.fixture
def run(tmp_path):
    def run(command, source, *arguments, check=True, **given):
        arguments = [command, source, *arguments]
        if given:
            (tmp_path / "recipe.json").write_text(json.dumps(given["recipe"]))
            arguments += ["--recipe", tmp_path / "recipe.json"]
        done = subprocess.run(
            [sys.executable, str(ROOT / "tests" / "blender" / "standin.py"), *map(str, arguments)],
            env=os.environ | {"PYTHONPATH": str(ROOT)},
            capture_output=True,
            text=True,
            check=False,
        )
        assert not check or done.returncode == 0, done.stderr
        return done

    return run


def built(cache):
    """{name: hash} of the in-between frames in a folder."""
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in cache.glob("*/*.png")}


def numbers(cache):
    return sorted(int(name[:8]) for name in built(cache))


def shown(frames, indices):
    return light.to_encoded(frames[list(indices)].mean(axis=0)) * 255


def test_a_render_builds_what_its_frames_need(run, film, tmp_path, same_pixels):
    """Beside the output; the recipe's bars stand for the same times: three of a frame are twelve of 4×."""
    first, frames = film
    data = recipe(3, np.ones(3))
    run("render", first, "--output", tmp_path / "out", "--frames", "2:3", "--inbetween", 4, recipe=data)
    for frame in (2, 3):
        start = (frame - 1) * 4
        picture = read_picture(tmp_path / "out" / f"{frame:04d}.png")
        same_pixels(picture, shown(frames, range(start, start + 12)), 1)
    # frames 2 and 3 see those from 4 to 19: pairs 1 to 4
    assert numbers(tmp_path / "virtual_shutter_inbetween") == [i for i in range(5, 20) if i % 4]


def test_what_lies_behind_a_layer_is_sought_in_filmed_frames(run, film, tmp_path):
    """The layer covers it while that is exposed, and has left when the layer itself is. It is seen before the exposure;
    in-between frames are built of the exposure alone."""
    square = [[[0.3, 0.3], [0.7, 0.3], [0.7, 0.7], [0.3, 0.7]]]
    layer = {"name": "R", "kind": "lasso", "shutter": "S1", "strokes": square, "layer": True}
    places = {1: -0.3, 3: 0, 4: 0, 6: 0.3}
    layer["keys"] = [{"frame": f, "location": [x, 0], "ease": "linear"} for f, x in places.items()]
    data = recipe(4, [1, 1, 0, 0], [0, 0, 0, 1], regions=[layer], border=True)
    run("render", film[0], "--output", tmp_path / "out", "--frames", "3:3", "--inbetween", 4, recipe=data)
    assert (tmp_path / "out" / "0003.png").is_file()
    assert {number // 4 for number in numbers(tmp_path / "virtual_shutter_inbetween")} == {2, 3, 4}


def test_chunks_are_the_whole(run, film, tmp_path):
    """Pictures and in-between frames, bit for bit; the window stops in the middle of the cut's pair."""
    first, frames = film
    data = recipe(8, np.ones(8), inbetween=4)
    run("render", first, "--output", tmp_path / "whole" / "film", recipe=data)
    for chunk in ("7:10", "1:2", "3:6"):
        run("render", first, "--output", tmp_path / "parts" / "film", "--frames", chunk, recipe=data)
    for frame in range(1, COUNT + 1):
        whole, part = (read_picture(tmp_path / way / "film" / f"{frame:04d}.png") for way in ("whole", "parts"))
        assert np.array_equal(whole, part)
        window = np.arange((frame - 1) * 4, (frame - 1) * 4 + 8)
        window = np.minimum(window, 22 if frame <= CUT else 36)
        assert np.abs(whole - shown(frames, window)).max() <= 1
    assert built(tmp_path / "whole" / "virtual_shutter_inbetween") == built(
        tmp_path / "parts" / "virtual_shutter_inbetween"
    )


def test_built_alone_by_a_farm_they_are_those_that_a_render_takes(run, film, tmp_path):
    first, _ = film
    for chunk in ("1:4", "5:10"):
        run("inbetween", first, "--factor", 4, "--frames", chunk, "--cache", tmp_path / "cache")
    assert numbers(tmp_path / "cache") == [i for i in range(36) if i % 4 and i // 4 != CUT - 1]
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "cache").glob("*/*.png")}
    data = recipe(8, np.ones(8), inbetween=4)
    run("render", first, "--output", tmp_path / "out", "--cache", tmp_path / "cache", recipe=data)
    assert {path: path.stat().st_mtime_ns for path in (tmp_path / "cache").glob("*/*.png")} == before
    assert not (tmp_path / "virtual_shutter_inbetween").exists()


def test_a_movie_s_in_betweens_are_found_as_well(run, bunny, tmp_path):
    run("inbetween", bunny, "--factor", 2, "--frames", "3:4", "--cache", tmp_path / "cache")
    run(
        "render", bunny, "--output", tmp_path / "out", "--frames", 3, "--inbetween", 2, "--cache", tmp_path / "cache",
        recipe=recipe(2, [1, 1]),
    )  # fmt: skip
    assert numbers(tmp_path / "cache") == [5, 7]
    assert len(list((tmp_path / "cache").glob("*/manifest.json"))) == 1


def test_a_movie_that_blender_reads_with_a_colour_space_of_its_own(run, tmp_path):
    """10 bits of PQ: what is built alone is what a render of its strip looks for."""
    movie, cache = tmp_path / "pq.mkv", tmp_path / "cache"
    rng = np.random.default_rng(2)
    with av.open(str(movie), "w") as out:
        stream = out.add_stream("ffv1", rate=25)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p10le"
        stream.codec_context.color_trc, stream.codec_context.color_primaries = 16, 9  # PQ, BT.2020
        for _ in range(3):
            frame = av.VideoFrame.from_ndarray(rng.integers(0, 256, (48, 64, 3), dtype=np.uint8))
            out.mux(stream.encode(frame.reformat(format="yuv420p10le", threads=1)))
        out.mux(stream.encode())
    run("inbetween", movie, "--factor", 2, "--cache", cache)
    before = [*cache.iterdir()]
    run("render", movie, "--output", tmp_path / "out", "--cache", cache, recipe=recipe(2, [1, 1], inbetween=2))
    assert [*cache.iterdir()] == before
    assert len(before) == 1


def test_source_time_ramps(run, film, tmp_path, same_pixels):
    """A fourth of the speed, then backward, from the end of the shown frame's time; the film ends with the last key."""
    first, frames = film
    time = [{"frame": 1, "value": 2}, {"frame": 9, "value": 4}, {"frame": 17, "value": 2}]
    data = recipe(4, [1, 1, 0, 0], inbetween=4, time=time)
    run("render", first, "--output", tmp_path / "out", "--frames", "1:17", recipe=data)
    for frame, start, direction in ((1, 4, 1), (2, 5, 1), (6, 9, 1), (12, 9 + 3, -1), (16, 5 + 3, -1)):
        same_pixels(read_picture(tmp_path / "out" / f"{frame:04d}.png"), shown(frames, (start, start + direction)), 1)
    data = recipe(1, [1], time=time)
    run("render", first, "--output", tmp_path / "nearest", "--frames", "4:8", recipe=data)
    for frame, source in ((4, 2), (5, 2), (7, 3), (8, 3)):  # 2.75, 3, 3.5 and 3.75, the first is 1
        same_pixels(read_picture(tmp_path / "nearest" / f"{frame:04d}.png"), shown(frames, [4 * source]), 1)


def test_a_saved_edit_finds_them_beside_itself(run, film, tmp_path, blender, same_pixels):
    first, frames = film
    data = recipe(6, np.ones(6), inbetween=4)
    run("render", first, "--save", tmp_path / "edit" / "e.blend", "--frames", "2:2", recipe=data)
    assert numbers(tmp_path / "edit" / "virtual_shutter_inbetween") == [5, 6, 7, 9, 10, 11]
    (tmp_path / "edit").rename(tmp_path / "moved")
    done = blender(tmp_path / "moved" / "e.blend", "-o", f"{tmp_path}/out/", "-a")
    assert done.returncode == 0, done.stderr
    same_pixels(read_picture(tmp_path / "out" / "0002.png")[..., :3], shown(frames, range(4, 10)), 1)
    done = blender(tmp_path / "moved" / "e.blend", "-o", f"{tmp_path}/out/", "-f", "3")
    assert done.returncode == 2
    assert "in-between frames of frame" in done.stderr


@pytest.mark.parametrize(
    ("arguments", "data", "sentence"),
    [
        (["--inbetween", 16], recipe(20, np.ones(20)), "window: 320 bars for 16× in-between frames, the most are 256"),
        (["--inbetween", 3], recipe(2, [1, 1]), "invalid choice: 3"),
        ([], recipe(2, [1, 1], inbetween=3), "inbetween: 3 is none of 1, 2, 4, 8, 16"),
        ([], recipe(2, [1, 1], time=[{"frame": 2, "value": 1}] * 2), "time[1].frame: 2 does not follow 2"),
        (["--cache", "/dev/null/x"], recipe(2, [1, 1], inbetween=2), "in-between frames cannot be written there"),
    ],
)
def test_bad_input_is_one_sentence(run, film, tmp_path, arguments, data, sentence):
    done = run("render", film[0], "--output", tmp_path / "out", *arguments, recipe=data, check=False)
    assert done.returncode == 2
    assert sentence in done.stderr
    assert not list(tmp_path.glob("out/*"))
