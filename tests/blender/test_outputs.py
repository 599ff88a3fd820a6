"""Where files of the command go: nowhere over what it reads, exactly where they were named, and whole."""

import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support import read_picture, recipe, refused, write_frames

from shutter_addon.blender.commands import render_command
from shutter_addon.core import atomic_write
from shutter_addon.media import open_source
from shutter_addon.media.rendered_pictures import whole_pictures

ROOT = Path(__file__).parents[2]
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


def link(path, target):
    path.symlink_to(target)
    return path


def hard(path, target):
    path.hardlink_to(target)
    return path


def test_a_movie_is_not_written_over_itself(render, movie, tmp_path):
    paths = movie, hard(movie.with_name("hard.mp4"), movie), link(tmp_path / "folder", tmp_path) / "movie.mp4"
    before = everything(tmp_path)
    for path in paths:
        refused(render(movie, "--output", path, "--frames", "1:2"), path.name, "movie.mp4", "which is read")
    assert everything(tmp_path) == before


def test_nothing_that_is_read_or_written_is_written_over(render, frames, tmp_path):
    (tmp_path / "in" / "0003.png").unlink()
    link(tmp_path / "link", tmp_path / "in")
    hard(tmp_path / "x.blend", tmp_path / "recipe.json")
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


NAMES = [
    "{blend_name}",
    "{fps}",
    "{{fps}}",
    "a{b",
    "a}b",
    "a#b",
    "##",
    "%d",
    "~",
    "$HOME",
    "tr. ",
    "x\ny",
    "ü日本",
    "-",
]


def test_names_are_names(render, frames, tmp_path):
    folders, movie = Path("out", *NAMES, "a.b."), "{blend_name}-{fps}#a}.mp4"
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
    """The same bytes, too: nothing in a file says when and where it was rendered."""
    folder = tmp_path / "{fps}#"
    options = "--output", folder / "out", "--save", folder / "edit.blend", "--frames", "2:3"
    assert render(frames, *options) == (0, "")
    ours = everything(folder / "out")
    shutil.rmtree(folder / "out")
    keep = f"import os; os.rename({str(folder / 'out')!r}, {str(folder / 'first')!r})"
    done = blender(folder / "edit.blend", "-a", "--python-expr", keep, "-a")
    assert done.returncode == 0, done.stderr
    assert everything(folder / "out") == everything(folder / "first")
    assert everything(folder / "out").keys() == ours.keys()
    for name in ours:
        assert b"Date" not in (folder / "out" / name).read_bytes()
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
    """An hour later; and nothing else is."""
    out = tmp_path / "out"
    out.mkdir()
    killed = atomic_write.part_folder(out)  # which is never left
    left = killed.__enter__()
    (left / "0001.png").write_bytes(b"begun")
    old = left.stat().st_mtime - 7200
    mine, running = out / ".part-mine", out / f".part-{'0' * 16}"
    mine.mkdir(), running.mkdir()
    planted = link(out / f".part-{'1' * 16}", tmp_path / "in")
    elsewhere = [tmp_path / name / f".part-{'2' * 16}" for name in ("weights", "saved")]
    for folder in elsewhere:
        folder.mkdir(parents=True)
    for path in (left, *left.iterdir(), mine, *elsewhere):
        os.utime(path, (old, old))
    places = ["--output", out, "--weights", tmp_path / "weights", "--save", tmp_path / "saved" / "a.blend"]
    assert render(frames, *places, "--frames", "1") == (0, "")
    assert not any(folder.exists() for folder in (left, *elsewhere))
    assert mine.exists()
    assert running.exists()
    assert planted.is_symlink()
    assert len(list((tmp_path / "in").iterdir())) == 6


def test_closed_streams(frames, tmp_path):
    (tmp_path / "recipe.json").write_text(json.dumps(STILL))
    options = f"--recipe {tmp_path}/recipe.json --frames 1:3 --output {tmp_path}/film.mp4"
    script = f"{sys.executable} -m shutter_addon render {frames} {options} <&- >&- 2>&-"
    assert subprocess.run(["sh", "-c", script], cwd=ROOT, check=False).returncode == 0
    assert whole_pictures(tmp_path / "film.mp4") == 3


@pytest.mark.parametrize("content", ["", "raise MemoryError"])
def test_a_broken_blender_library(tmp_path, content):
    (tmp_path / "bpy.py").write_text(content)
    arguments = [sys.executable, "-m", "shutter_addon", "render", "--help"]
    environment = os.environ | {"PYTHONPATH": str(tmp_path)}
    done = subprocess.run(arguments, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    refused((done.returncode, done.stderr), "Blender as a library")


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


def test_a_second_signal_ends_at_once(movie, tmp_path):
    """The first one waits for Blender to finish the movie."""
    (tmp_path / "recipe.json").write_text(json.dumps(STILL))
    places = ["--recipe", tmp_path / "recipe.json", "--output", tmp_path / "film.mp4"]
    arguments = [sys.executable, "-m", "shutter_addon", "render", movie, *places]
    with subprocess.Popen(list(map(str, arguments)), cwd=ROOT, stderr=subprocess.PIPE, text=True) as process:
        while not list(tmp_path.glob(".part-*/film.mp4")):
            assert process.poll() is None
        process.send_signal(signal.SIGINT)
        process.send_signal(signal.SIGTERM)
        process.wait(60)
        assert process.returncode == 130
        assert "Traceback" not in process.stderr.read()
