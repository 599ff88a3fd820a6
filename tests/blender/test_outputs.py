"""Where files of the command go: nowhere over what it reads, exactly where they were named, and whole."""

import json
import os
import shlex
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support import ROOT, read_picture, recipe, refused, write_frames

from shutter_addon.blender.commands import render_command
from shutter_addon.media import open_source
from shutter_addon.media.rendered_pictures import whole_pictures

STILL = recipe(1, [1])


@pytest.fixture
def frames(tmp_path):
    """Six pictures, named as the command names its own."""
    pictures = np.random.default_rng(0).integers(0, 256, (6, 16, 20, 3), dtype=np.uint8)
    return write_frames(tmp_path / "in", pictures, name="")


@pytest.fixture
def movie(bunny, tmp_path):
    return Path(shutil.copy(bunny, tmp_path / "movie.mp4"))


@pytest.fixture
def render(run, tmp_path):
    """Runs the command in this process, with a recipe of a still frame: its exit code, and what it says on stderr."""
    (tmp_path / "recipe.json").write_text(json.dumps(STILL))

    return lambda source, *words: run("render", source, "--recipe", tmp_path / "recipe.json", *words)


def everything(folder):
    """All files in a folder with their content."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_a_movie_is_not_written_over_itself(render, movie, tmp_path):
    (tmp_path / "hard.mp4").hardlink_to(movie)
    (tmp_path / "folder").symlink_to(tmp_path)
    before = everything(tmp_path)
    for path in (movie, tmp_path / "hard.mp4", tmp_path / "folder" / "movie.mp4"):
        refused(render(movie, "--output", path, "--frames", "1:2"), path.name, "movie.mp4", "which is read")
    assert everything(tmp_path) == before


def test_nothing_that_is_read_or_written_is_written_over(render, frames, tmp_path):
    (tmp_path / "in" / "0003.png").unlink()
    (tmp_path / "link").symlink_to(tmp_path / "in")
    (tmp_path / "x.blend").hardlink_to(tmp_path / "recipe.json")
    before = everything(tmp_path)
    out = "--output", tmp_path / "out"
    for options in (
        ("--output", tmp_path / "link", "--frames", "6"),
        ("--output", tmp_path / "in", "--frames", "3"),  # which is missing: it would be a part of it
        ("--save", tmp_path / "in" / "0002.png"),
        ("--save", tmp_path / "x.blend", *out),
        (*out, "--format", "exr", "--weights", tmp_path / "out"),
    ):
        refused(render(frames, *options))
        assert everything(tmp_path) == before


def test_names_are_names(render, frames, tmp_path):
    names = "{blend_name}", "{fps}", "{{fps}}", "a{b", "a}b", "a#b", "##", "%d", "~", "$HOME", "ü日本", "-"
    folders, movie = Path("out", *names, "tr. ", "x\ny", "a.b."), "{blend_name}-{fps}#a}.mp4"
    assert render(frames, "--output", tmp_path / folders, "--frames", "2:3") == (0, "")
    assert sorted(everything(tmp_path / "out")) == [f"{folders.relative_to('out')}/{n:04d}.png" for n in (2, 3)]
    assert render(frames, "--output", tmp_path / "film" / movie, "--frames", "2:3") == (0, "")
    assert sorted(everything(tmp_path / "film")) == [movie]


def test_names_that_cannot_be(render, frames, tmp_path):
    for name in ("folder.blend", "folder.mp4"):
        (tmp_path / name).mkdir()
    for option, place, words in (
        ("--output", tmp_path / "a\\b", "\\"),
        ("--output", tmp_path / ("l" * 300), "too long"),
        ("--output", tmp_path / "folder.mp4", "is a folder"),
        ("--save", tmp_path / "folder.blend", f"Virtual Shutter: {tmp_path / 'folder.blend'}: "),
        ("--save", "/proc/a.blend", "Virtual Shutter: /proc/a.blend: "),
    ):
        refused(render(frames, option, place), words)
    assert not list(tmp_path.rglob("*.part*"))


def test_a_saved_edit_renders_to_the_same_place(render, blender, frames, tmp_path):
    """Nothing in a file says when and where it was rendered."""
    folder = tmp_path / "{fps}#"
    options = "--output", folder / "out", "--save", folder / "edit.blend", "--frames", "2:3"
    assert render(frames, *options) == (0, "")
    ours = everything(folder / "out")
    shutil.rmtree(folder / "out")
    done = blender(folder / "edit.blend", "-a")
    assert done.returncode == 0, done.stderr
    found = everything(folder / "out")
    assert found.keys() == ours.keys()
    for name, content in found.items():
        assert b"Date" not in content
        assert b"Time" not in content
        difference = read_picture(folder / "out" / name) - read_picture(frames.parent / name)
        assert np.abs(difference).max() < 0.1  # levels: another machine's drivers


def test_equal_pixels_are_equal_files(render, frames, tmp_path):
    for ending in ("png", "exr"):
        for name in ("a", "b"):
            places = "--output", tmp_path / name / ending, "--weights", tmp_path / name / f"{ending}-weights"
            assert render(frames, *places, "--format", ending, "--frames", "2:3") == (0, "")
    found = everything(tmp_path / "a")
    assert len(found) == 8
    assert found == everything(tmp_path / "b")
    for name, content in found.items():  # the time of writing, or of the render, could be the same twice
        assert (b"1970:01:01" in content) if "weights" in name else not (b"Time" in content or b"Date" in content)


def test_what_was_finished_of_a_movie_is_kept(render, frames, tmp_path):
    path = frames.parent / "0005.png"
    path.write_bytes(path.read_bytes()[:200])
    for part in ("film.part.mp4", "film.part-2.mp4"):
        code, said = render(frames, "--output", tmp_path / "film.mp4")
        assert code == 2
        (line,) = (line for line in said.splitlines() if not line.startswith("libpng"))
        assert line.startswith("Virtual Shutter: 0005.png: ")
        assert line.endswith(f"its first 4 frames are in {part}")
        with open_source(tmp_path / part) as film:
            assert film.count == 4
            film.read(3)
    assert not (tmp_path / "film.mp4").exists()
    assert not list(tmp_path.rglob(".part-*"))


def test_what_killed_renders_leave_is_cleared(render, frames, tmp_path):
    """An hour later, wherever the command writes. tests/core/test_atomic_write.py has what else stays."""
    left = [tmp_path / name / f".part-{'2' * 16}" for name in ("out", "weights", "saved")]
    for folder in left:
        folder.mkdir(parents=True)
        os.utime(folder, (0, 0))
    places = ["--output", tmp_path / "out", "--weights", tmp_path / "weights", "--save", tmp_path / "saved" / "a.blend"]
    assert render(frames, *places, "--frames", "1") == (0, "")
    assert not any(folder.exists() for folder in left)


def test_closed_streams(render_words, frames, tmp_path):
    words = render_words([frames, "--frames", "1:3", "--output", tmp_path / "film.mp4"], STILL)
    script = f"{shlex.join([sys.executable, '-m', 'shutter_addon', *words])} <&- >&- 2>&-"
    assert subprocess.run(["sh", "-c", script], cwd=ROOT, check=False).returncode == 0
    assert whole_pictures(tmp_path / "film.mp4") == 3


@pytest.mark.parametrize("content", ["", "raise MemoryError"])
def test_a_broken_blender_library(command, tmp_path, content):
    (tmp_path / "bpy.py").write_text(content)
    refused(command("--help", check=False, env={"PYTHONPATH": str(tmp_path)}), "Blender as a library")


def test_a_second_signal_ends_at_once(render_words, movie, tmp_path):
    """The first one waits for Blender to finish the movie."""
    words = render_words([movie, "--output", tmp_path / "film.mp4"], STILL)
    arguments = [sys.executable, "-m", "shutter_addon", *words]
    with subprocess.Popen(arguments, cwd=ROOT, stderr=subprocess.PIPE, text=True) as process:
        while not list(tmp_path.glob(".part-*/film.mp4")):
            assert process.poll() is None
        process.send_signal(signal.SIGINT)
        process.send_signal(signal.SIGTERM)
        process.wait(60)
        assert process.returncode == 130
        assert "Traceback" not in process.stderr.read()


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (MemoryError(), "not enough memory"),
        (RuntimeError("Error: out of\n luck"), "out of luck"),
        (PermissionError(13, "Permission denied", "there"), "there: Permission denied"),
    ],
)
def test_whatever_goes_wrong_is_one_sentence(render, frames, tmp_path, monkeypatch, fault, words):
    def make_edit(*_arguments):
        raise fault

    monkeypatch.setattr(render_command, "make_edit", make_edit)
    refused(render(frames, "--output", tmp_path / "out"), words)
