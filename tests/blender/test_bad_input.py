"""Bad input: one sentence on stderr, exit code 2, and nothing half-written."""

import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from support import noise, read_picture, recipe, refused, write_frames, write_movie

from shutter_addon.blender.editing import add_effect
from shutter_addon.media import MediaError, open_source
from shutter_addon.media.rendered_pictures import whole_pictures

ROOT = Path(__file__).parents[2]
STILL = recipe(4, [1, 0, 0, 0])


@pytest.fixture(scope="module")
def frames(tmp_path_factory):
    return write_frames(tmp_path_factory.mktemp("frames"), noise(6, 16, 20, 3))


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


def test_a_strip_whose_folder_is_not_utf8(edit, frames, tmp_path):
    """Blender's file browser finds such files."""
    odd = tmp_path / os.fsdecode(b"caf\xe9")
    shutil.copytree(frames.parent, odd)
    source = edit.sequence_editor.strips.new_image("images", str(frames), 1, 1)
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


def test_no_recipe(command_here, frames, tmp_path):
    """The sentence is that of core; here, it is the only one, with the file's name."""
    path = tmp_path / "field.json"
    path.write_text(json.dumps(STILL | {"\ud800\x1b": 1}))
    done = command_here(frames, "--recipe", path, "--output", tmp_path / "out", check=False)
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


def test_outputs_that_cannot_be(command_here, frames, tmp_path):
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
        refused(command_here(frames, *options, recipe=STILL, check=False), word)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "recipe.json"]
    assert (tmp_path / "file").read_text() == "mine"


@pytest.mark.parametrize("output", ["out", "film.mp4", "save"])
def test_a_full_disk(command_here, frames, tmp_path, output):
    """No file may grow beyond 400 bytes: what Blender gets when the disk is full."""
    option = ["--save", tmp_path / "save.blend"] if output == "save" else ["--output", tmp_path / output]
    (tmp_path / "recipe.json").write_text(json.dumps(STILL))
    before = resource.getrlimit(resource.RLIMIT_FSIZE), signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (400, before[0][1]))
    try:
        done = command_here(frames, "--recipe", tmp_path / "recipe.json", *option, check=False)
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


def test_no_gl(command, frames, tmp_path):
    """Without GL, NumPy composes and says so."""
    env = {"__EGL_VENDOR_LIBRARY_FILENAMES": "/none", "LIBGL_DRIVERS_PATH": "/none", "EGL_PLATFORM": "none"}
    done = command(frames, "--output", tmp_path / "out", "--frames", "1:2", recipe=STILL, env=env)
    assert "composing with NumPy" in done.stderr
    assert len(list((tmp_path / "out").iterdir())) == 2
