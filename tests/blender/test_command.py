"""The command, from footage and a recipe to files; and bad input: one sentence, exit code 2, nothing half-written."""

import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import OpenImageIO
import pytest
from support import ROOT, noise, read_picture, recipe, refused, write_frames, write_movie

from shutter_addon.blender.commands import command_line
from shutter_addon.blender.editing import add_effect
from shutter_addon.core.frames import light
from shutter_addon.media import MediaError, open_source
from shutter_addon.media.rendered_pictures import whole_pictures

STILL = recipe(4, [1, 0, 0, 0])


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    """Twelve frames of random pixels: folder's first file, frames (12, 48, 64, 3) uint8."""
    frames = noise(12, 48, 64, 3)
    return write_frames(tmp_path_factory.mktemp("noise"), frames), frames


def linear(frames):
    return light.to_linear(np.asarray(frames, dtype=np.float64) / 255)


def levels(values):
    return light.to_encoded(values) * 255


def test_a_still_frame_gives_the_sequence_back(command, film, tmp_path, same_pixels):
    first, frames = film
    command(first, "--output", tmp_path / "out", recipe=STILL)
    names = sorted(p.name for p in (tmp_path / "out").iterdir())
    assert names == [f"{i:04d}.png" for i in range(1, 13)]
    for i, name in enumerate(names):
        same_pixels(read_picture(tmp_path / "out" / name), frames[i], 1)


def test_a_window_stops_at_a_cut(command_here, tmp_path, same_pixels):
    """In chunks as in one go, and not where the recipe says so."""
    shots = [noise(6, 8, 3, seed=seed).repeat(8, 0).repeat(8, 1) for seed in range(2)]
    frames = np.stack([np.roll(shots[k // 6], k, axis=1) for k in range(12)])
    first = write_frames(tmp_path / "film", frames)
    data = recipe(4, np.ones(4))
    command_here(first, "--output", tmp_path / "whole", recipe=data)
    for chunk in ("1:4", "5:5", "6:12"):
        command_here(first, "--output", tmp_path / "chunks", "--frames", chunk, recipe=data)
    for k in range(12):
        window = np.minimum(np.arange(k, k + 4), 5 if k < 6 else 11)
        whole, part = (read_picture(tmp_path / way / f"{k + 1:04d}.png") for way in ("whole", "chunks"))
        same_pixels(whole, levels(linear(frames[window]).mean(axis=0)), 1)
        assert np.array_equal(whole, part)
    command_here(first, "--output", tmp_path / "off", "--frames", "5", recipe=data | {"stop_at_cuts": False})
    same_pixels(read_picture(tmp_path / "off" / "0005.png"), levels(linear(frames[4:8]).mean(axis=0)), 1)


def test_weights_have_a_channel_for_each_layer(command_here, film, tmp_path):
    ramp = {"kind": "ramp", "ramp": "linear", "shutter": "S1", "layer": True}
    ends = [{"frame": 1, "value": 0.5, "ease": "constant"}, {"frame": 3, "value": 0}]
    regions = [ramp | {"name": "S0"}, ramp | {"name": "Gone", "opacity": ends}]
    data = recipe(4, [1] * 4, [1, 0, 0, 0], aggregate=2, regions=regions)
    options = "--output", tmp_path / "out", "--weights", tmp_path / "w", "--frames", "2:3"
    command_here(film[0], *options, recipe=data)
    images = [OpenImageIO.ImageBuf(str(tmp_path / "w" / f"000{frame}.exr")) for frame in (2, 3)]
    names, pixels = images[0].spec().channelnames, [np.moveaxis(image.get_pixels(), -1, 0) for image in images]
    assert images[1].spec().channelnames == names
    there, gone = (dict(zip(names, found, strict=True)) for found in pixels)
    assert there.keys() == {"S0", "S1", "S0.001", "Gone"}
    expected = np.broadcast_to((np.arange(32) * 2 + 1) / 64, (24, 32))
    assert np.abs(there["S0.001"] - expected).max() < 1e-4
    assert np.abs(there["Gone"] - expected / 2).max() < 1e-4
    assert np.array_equal(gone["S0.001"], there["S0.001"])
    assert not gone["Gone"].any()
    assert (there["S0"] == 1).all()
    data = recipe(4, [1] * 4, regions=[regions[1] | {"shutter": "S0"}])
    command_here(film[0], *options[:2], "--weights", tmp_path / "one", "--frames", "3", recipe=data)
    assert not OpenImageIO.ImageBuf(str(tmp_path / "one" / "0003.exr")).get_pixels()[..., 0].any()


def test_chunks_and_order_change_no_bit(command_here, film, tmp_path):
    first, _ = film
    moving = {"shutter": "S1", "strokes": [[[0.2, 0.2], [0.4, 0.6]]], "width": 0.1, "layer": True}
    moving["keys"] = [{"frame": 1}, {"frame": 12, "location": [0.4, 0.1], "rotation": 40}]
    still = {"shutter": "S0", "strokes": [[[0.9, 0.1], [0.9, 0.9]]]}
    edges = {"edge_aware": 1.0, "border": True, "aggregate": 4}
    data = recipe(6, *np.random.default_rng(2).random((2, 6)), regions=[still, moving], **edges)
    command_here(first, "--output", tmp_path / "whole", "--frames", "2:8", recipe=data)
    for chunk in ("6:8", "4"):
        command_here(first, "--output", tmp_path / "parts", "--frames", chunk, recipe=data)
    for frame in (4, 6, 7, 8):
        whole, part = (tmp_path / f / f"{frame:04d}.png" for f in ("whole", "parts"))
        assert np.array_equal(read_picture(whole), read_picture(part))


def test_exr_is_scene_linear(command_here, film, tmp_path):
    first, frames = film
    command_here(first, "--output", tmp_path / "out", "--format", "exr", "--frames", "1", recipe=recipe(4, np.ones(4)))
    assert np.abs(read_picture(tmp_path / "out" / "0001.exr") - linear(frames[:4]).mean(axis=0)).max() < 1e-3


@pytest.fixture(scope="module")
def with_sound(tmp_path_factory):
    """Ten frames of 160×90 that become brighter, at 25 a second, with a tone."""
    ramp = np.add.outer(np.arange(90), np.arange(160)) // 2
    pictures = np.stack([np.repeat((ramp + 12 * index)[..., None], 3, -1) for index in range(10)]).astype(np.uint8)
    path = tmp_path_factory.mktemp("sound") / "film.mkv"
    return write_movie(path, pictures, rate=25, tone=8000 * np.sin(np.arange(19200) * 0.05))


@pytest.mark.parametrize("ending", [".mp4", ".mov", ".mkv", ".webm", ".avi"])
def test_movies(command_here, with_sound, tmp_path, ending):
    output = tmp_path / f"film{ending}"
    command_here(with_sound, "--output", output, "--frames", "3:8", recipe=STILL)
    assert [p.name for p in tmp_path.iterdir() if p.name.startswith((".", "film"))] == [output.name]
    with open_source(output) as film, open_source(with_sound) as source:
        late = ending == ".avi"  # Blender's AVI shows the first frame twice
        assert (film.width, film.height, film.fps) == (160, 90, 25)
        assert film.count in (6, 7)  # containers that give the sound's length alone may end a frame later
        assert film.has_audio
        assert np.abs(film.read(3 + late).astype(float) - source.read(5)).mean() < 4


def test_source_time_up_to_the_last_frame_of_the_timeline(command_here, film, tmp_path, same_pixels):
    """A freeze of more than an hour, a way on behind it, and the last frame that Blender has."""
    first, frames = film
    keys = {1: 2, 100_100: 2, 100_104: 6, 1_048_574: 12}
    data = recipe(1, [1], time=[{"frame": frame, "value": value} for frame, value in keys.items()])
    for chunk in ("100100:100104", "1048574"):
        command_here(first, "--output", tmp_path / "out", "--frames", chunk, recipe=data)
    shown = {100_100: 2, 100_101: 3, 100_102: 4, 100_103: 5, 100_104: 6, 1_048_574: 12}
    assert len(list((tmp_path / "out").iterdir())) == len(shown)
    for frame, number in shown.items():
        same_pixels(read_picture(tmp_path / "out" / f"{frame:04d}.png"), frames[number - 1], 1)


def test_alpha_is_carried(command_here, tmp_path, same_pixels):
    frames = noise(4, 16, 20, 4)
    frames[:, :8, :, 3] = 255
    frames[:, 12:, :, 3] = 0
    first = write_frames(tmp_path / "in", frames)
    command_here(first, "--output", tmp_path / "out", "--frames", "1", recipe=recipe(2, [1, 1]))
    picture = read_picture(tmp_path / "out" / "0001.png")
    alpha = frames[:2, ..., 3:].astype(float) / 255
    total = (linear(frames[:2, ..., :3]) * alpha).mean(axis=0)
    mean = alpha.mean(axis=0)
    same_pixels(picture[..., 3:], mean * 255, 1)
    expected = levels(total / np.maximum(mean, 1e-6))
    assert np.abs(picture[..., :3] - expected)[mean[..., 0] > 0.1].max() <= 1.5


@pytest.mark.parametrize("suffix", [".png", ".jp2"])
def test_files_that_a_gap_would_show_are_the_sources_own(film, tmp_path, suffix):
    """The number in a suffix is none of theirs."""
    for path in sorted(write_frames(tmp_path, film[1][:4]).parent.iterdir()):
        path.rename(path.with_suffix(suffix))
    (tmp_path / f"f0003{suffix}").unlink()
    with open_source(tmp_path / f"f0001{suffix}") as source:
        assert tmp_path / f"f0003{suffix}" in command_line.files(source)


# Bad input


def test_no_medium(command_here, tmp_path):
    for name in ("empty.mp4", "empty.png"):
        (tmp_path / name).write_bytes(b"")
    write_frames(tmp_path / "folder", np.zeros((1, 1, 1, 3), dtype=np.uint8))
    for name, words in (
        ("missing.mp4", ["no such file"]),
        ("empty.mp4", ["empty"]),
        ("empty.png", ["empty"]),
        ("folder", []),
        ("folder/f0001.png", ["1×1", "4×4"]),
    ):
        done = command_here(tmp_path / name, "--output", tmp_path / "out", recipe=STILL, check=False)
        refused(done, *words or [name])
        assert not (tmp_path / "out").exists()


def test_a_strip_whose_folder_is_not_utf8(edit, film, tmp_path):
    """Blender's file browser finds such files."""
    odd = tmp_path / os.fsdecode(b"caf\xe9")
    shutil.copytree(film[0].parent, odd)
    source = edit.sequence_editor.strips.new_image("images", str(film[0]), 1, 1)
    source.directory = str(odd)
    with pytest.raises(MediaError, match="its path is not UTF-8"):
        add_effect.add_effect(edit, source)


def test_a_movie_cut_off_in_the_middle(command_here, tmp_path):
    """Frames before the end are good; a frame that is not there is said, and stops the render."""
    pictures = noise(40, 32, 48, 3)
    data = write_movie(tmp_path / "whole.mkv", pictures, rate=10).read_bytes()
    (tmp_path / "cut.mkv").write_bytes(data[: len(data) // 2])
    with open_source(tmp_path / "cut.mkv") as source:
        assert source.count == 40
    done = command_here(tmp_path / "cut.mkv", "--output", tmp_path / "out", recipe=recipe(1, [1]), check=False)
    refused(done, "cut.mkv", "cannot be decoded")
    finished = [np.rint(read_picture(path)) for path in sorted((tmp_path / "out").iterdir())]
    assert 15 <= len(finished) <= 20
    assert np.array_equal(finished, pictures[: len(finished)])


def test_no_recipe(command_here, film, tmp_path):
    """The sentence is that of core; here, it is the only one, with the file's name."""
    path = tmp_path / "field.json"
    path.write_text(json.dumps(STILL | {"\ud800\x1b": 1}))
    done = command_here(film[0], "--recipe", path, "--output", tmp_path / "out", check=False)
    refused(done, "field.json", "unknown field \\ud800\\x1b")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("width", "height"), [(33, 17), (4, 129)])
def test_odd_sizes(command_here, tmp_path, width, height):
    pictures = noise(2, height, width, 3)
    first = write_frames(tmp_path / "in", pictures)
    lasso = {"shutter": "S1", "kind": "lasso", "strokes": [[[0, 0], [1, 0], [1, 1]]]}
    data = recipe(2, [1, 0], [1, 1], regions=[lasso])
    command_here(first, "--output", tmp_path / "out", recipe=data)
    command_here(first, "--output", tmp_path / "plain", recipe=recipe(1, [1]))
    assert np.array_equal(np.rint(read_picture(tmp_path / "plain" / "0002.png")), pictures[1])
    done = command_here(first, "--output", tmp_path / "film.mp4", recipe=data, check=False)
    refused(done, "film.mp4", "even sizes")


def test_outputs_that_cannot_be(command_here, film, tmp_path):
    (tmp_path / "file").write_text("mine")
    odd = tmp_path / os.fsdecode(b"caf\xe9")
    for options, word in (
        (["--output", tmp_path / "file" / "out"], "file"),
        (["--output", tmp_path / "file"], "file"),
        (["--output", tmp_path / "film.gif"], "film.gif: neither a folder nor one of .mp4"),
        (["--output", "/proc/out"], "/proc"),
        (["--output", "/proc/film.mp4"], "/proc"),
        (["--output", tmp_path / "a.mp4", "--format", "exr"], "--format"),
        (["--output", tmp_path / "out", "--frames=0:3"], "--frames: 0:3"),
        (["--output", tmp_path / "out", "--frames=a:b"], '--frames: "a:b"'),
        (["--output", tmp_path / "out", "--frames=1:" + "9" * 5000], '--frames: "1:999'),
        ([], "--output"),
        (["--save", "/proc/x.blend"], "/proc"),
        (["--save", odd / "a.blend", "--output", tmp_path / "out"], "caf\\udce9/a.blend: its path is not UTF-8"),
    ):
        refused(command_here(film[0], *options, recipe=STILL, check=False), word)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "recipe.json"]
    assert (tmp_path / "file").read_text() == "mine"


@pytest.mark.parametrize("output", ["out", "film.mp4", "save"])
def test_a_full_disk(command_here, film, tmp_path, output):
    """No file may grow beyond 400 bytes: what Blender gets when the disk is full."""
    option = ["--save", tmp_path / "save.blend"] if output == "save" else ["--output", tmp_path / output]
    (tmp_path / "recipe.json").write_text(json.dumps(STILL))
    before = resource.getrlimit(resource.RLIMIT_FSIZE), signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (400, before[0][1]))
    try:
        done = command_here(film[0], "--recipe", tmp_path / "recipe.json", *option, check=False)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before[0])
        signal.signal(signal.SIGXFSZ, before[1])
    assert done.returncode == 2, done.stderr
    assert str(option[1]) in done.stderr
    left = [p for p in tmp_path.rglob("*") if p.is_file() and p.name != "recipe.json"]
    assert not left


@pytest.mark.parametrize(("number", "output"), [(signal.SIGINT, "out"), (signal.SIGTERM, "film.mp4")])
def test_stopped_halfway(render_words, tmp_path, number, output):
    """Finished frames stay, whole, and those of a movie under a name that says so; nothing else does."""
    first = write_frames(tmp_path / "in", noise(6, 90, 160, 3))
    to_and_fro = [{"frame": 1 + 5 * turn, "value": 6 if turn % 2 else 1} for turn in range(200)]
    arguments = render_words([first, "--output", tmp_path / output], recipe(4, [1] * 4, time=to_and_fro))
    with subprocess.Popen([sys.executable, "-m", "shutter_addon", *arguments], cwd=ROOT, stderr=-1) as process:
        wait_for(lambda: len(list(tmp_path.rglob(".part-*"))), process)
        if output == "out":
            wait_for(lambda: len(list((tmp_path / "out").glob("*.png"))) >= 3, process)
        else:
            wait_for(lambda: any(p.stat().st_size > 1000 for p in tmp_path.glob(".part-*/*")), process)
        os.kill(process.pid, number)
        process.wait(timeout=60)
    assert process.returncode == 130
    shutil.rmtree(first.parent)
    left = sorted(p for p in tmp_path.rglob("*") if p.is_file() and p.name != "recipe.json")
    assert not list(tmp_path.rglob(".part-*"))
    if output == "film.mp4":
        assert [path.name for path in left] == ["film.part.mp4"]
        assert 1 <= whole_pictures(left[0]) < 996
    else:
        assert 3 <= len(left) < 996
        for path in left:
            assert read_picture(path).shape == (90, 160, 3)


def wait_for(condition, process):
    while not condition():
        assert process.poll() is None, process.stderr.read()
        time.sleep(0.02)


def test_without_gl_numpy_composes_and_says_so(command, film, tmp_path):
    env = {"__EGL_VENDOR_LIBRARY_FILENAMES": "/none", "LIBGL_DRIVERS_PATH": "/none", "EGL_PLATFORM": "none"}
    done = command(film[0], "--output", tmp_path / "out", "--frames", "1:2", recipe=STILL, env=env)
    assert "composing with NumPy" in done.stderr
    assert len(list((tmp_path / "out").iterdir())) == 2
