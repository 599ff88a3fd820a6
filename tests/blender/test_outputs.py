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
from support import read_picture, recipe, write_frames

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


def refused(done, *words):
    assert done.returncode == 2, (done.returncode, done.stderr)
    (line,) = done.stderr.strip().splitlines()
    assert line.startswith("Virtual Shutter: ")
    assert len(line) <= 300
    for word in words:
        assert word.lower() in line.lower()  # "No space left" is what the system says, "no space left" what we do


def everything(folder):
    """All files in a folder with their content."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def link(path, target):
    path.symlink_to(target)
    return path


def hard(path, target):
    path.hardlink_to(target)
    return path


@pytest.mark.parametrize(
    "output",
    [
        lambda movie: movie,
        lambda movie: hard(movie.with_name("hard.mp4"), movie),
        lambda movie: link(movie.with_name("folder"), movie.parent) / "movie.mp4",
    ],
)
def test_a_movie_is_not_written_over_itself(command, movie, tmp_path, output):
    path = output(movie)
    (tmp_path / "recipe.json").write_text(json.dumps(STILL))
    before = everything(tmp_path)
    done = command(movie, "--output", path, "--frames", "1:2", recipe=STILL, check=False)
    refused(done, path.name, "movie.mp4", "which is read")
    assert everything(tmp_path) == before


@pytest.mark.parametrize(
    "options",
    [
        lambda folder: ["--output", link(folder / "link", folder / "in"), "--frames", "6"],
        lambda folder: ["--output", folder / "in", "--frames", "3"],  # which is missing: it would be a part of it
        lambda folder: ["--save", folder / "in" / "0002.png"],
        lambda folder: ["--save", hard(folder / "x.blend", folder / "recipe.json"), "--output", folder / "out"],
        lambda folder: ["--output", folder / "out", "--format", "exr", "--weights", folder / "out"],
    ],
)
def test_nothing_that_is_read_or_written_is_written_over(command, frames, tmp_path, options):
    (tmp_path / "in" / "0003.png").unlink()
    (tmp_path / "recipe.json").write_text(json.dumps(STILL))
    arguments = options(tmp_path)
    before = everything(tmp_path)
    refused(command(frames, *arguments, recipe=STILL, check=False))
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


def test_names_of_folders_are_names(command, frames, tmp_path):
    folders = Path("out", *NAMES, "a.b.")
    command(frames, "--output", tmp_path / folders, "--frames", "2:3", recipe=STILL)
    assert sorted(everything(tmp_path / "out")) == [f"{folders.relative_to('out')}/{n:04d}.png" for n in (2, 3)]


@pytest.mark.parametrize("name", ["{blend_name}-{fps}#a}"])
def test_names_of_movies_are_names(command, frames, tmp_path, name):
    command(frames, f"--output={tmp_path / 'out' / name}.mp4", "--frames", "2:3", recipe=STILL)
    assert sorted(everything(tmp_path / "out")) == [f"{name}.mp4"]


def test_where_an_edit_cannot_be_saved_comes_first(command, frames, tmp_path):
    (tmp_path / "folder.blend").mkdir()
    for place in (tmp_path / "folder.blend", "/proc/a.blend"):
        refused(command(frames, "--save", place, recipe=STILL, check=False), f"Virtual Shutter: {place}: ")


@pytest.mark.parametrize(
    ("name", "word"),
    [("a\\b", "\\"), ("l" * 300, "too long"), ("a.mp4/", "is a folder")],
)
def test_names_that_cannot_be(command, frames, tmp_path, name, word):
    if name.endswith("/"):
        (tmp_path / name).mkdir()
    done = command(frames, "--output", tmp_path / name, recipe=STILL, check=False)
    refused(done, word)
    assert not list(tmp_path.rglob("*.part*"))


def test_a_saved_edit_renders_to_the_same_place(command, blender, frames, tmp_path):
    """The same bytes, too: nothing in a file says when and where it was rendered."""
    folder = tmp_path / "{fps}#"
    command(frames, "--output", folder / "out", "--save", folder / "edit.blend", "--frames", "2:3", recipe=STILL)
    ours = everything(folder / "out")
    shutil.rmtree(folder / "out")
    made = []
    for _ in range(2):
        done = blender(folder / "edit.blend", "-a")
        assert done.returncode == 0, done.stderr
        made.append(everything(folder / "out"))
        for name in ours:
            difference = read_picture(folder / "out" / name) - read_picture(frames.parent / name)
            assert np.abs(difference).max() < 0.1  # levels: another machine's drivers
        shutil.rmtree(folder / "out")
    assert made[0] == made[1]
    assert made[0].keys() == ours.keys()


@pytest.mark.parametrize("ending", ["png", "exr"])
def test_equal_pixels_are_equal_files(command, frames, tmp_path, ending):
    for name in ("a", "b"):
        options = ["--format", ending, "--weights", tmp_path / f"w{name}", "--frames", "2:3"]
        command(frames, "--output", tmp_path / name, *options, recipe=STILL)
    assert everything(tmp_path / "a") == everything(tmp_path / "b")
    assert everything(tmp_path / "wa") == everything(tmp_path / "wb")
    assert b"Time" not in (tmp_path / "a" / f"0002.{ending}").read_bytes()


def test_what_was_finished_of_a_movie_is_kept(command, frames, tmp_path):
    path = frames.parent / "0005.png"
    path.write_bytes(path.read_bytes()[:200])
    for part in ("film.part.mp4", "film.part-2.mp4"):
        done = command(frames, "--output", tmp_path / "film.mp4", recipe=STILL, check=False)
        assert done.returncode == 2
        (line,) = (line for line in done.stderr.splitlines() if not line.startswith("libpng"))
        assert line.startswith("Virtual Shutter: 0005.png: ")
        assert line.endswith(f"its first 4 frames are in {part}")
        with open_source(tmp_path / part) as film:
            assert film.count == 4
            film.read(3)
    assert not (tmp_path / "film.mp4").exists()
    assert not list(tmp_path.rglob(".part-*"))


def started(source, tmp_path, output, **options):
    (tmp_path / "recipe.json").write_text(json.dumps(STILL))
    arguments = ["--recipe", tmp_path / "recipe.json", "--output", output]
    command = [sys.executable, "-m", "shutter_addon", "render", source, *arguments]
    return subprocess.Popen(list(map(str, command)), cwd=ROOT, stderr=subprocess.PIPE, text=True, **options)


def test_what_killed_renders_leave_is_cleared(command, movie, frames, tmp_path):
    """An hour later; and nothing else is."""
    out = tmp_path / "out"
    with started(movie, tmp_path, out) as process:
        while not list(out.glob("*.png")):
            assert process.poll() is None
        process.kill()
    (left,) = out.glob(".part-*")
    old = left.stat().st_mtime - 7200
    mine, running = out / ".part-mine", out / f".part-{'0' * 16}"
    mine.mkdir(), running.mkdir()
    planted = link(out / f".part-{'1' * 16}", tmp_path / "in")
    for path in [left, *left.iterdir(), mine]:
        os.utime(path, (old, old))
    elsewhere = [tmp_path / name / f".part-{'2' * 16}" for name in ("weights", "saved")]
    for folder in elsewhere:
        folder.mkdir(parents=True)
        os.utime(folder, (old, old))
    places = ["--output", out, "--weights", tmp_path / "weights", "--save", tmp_path / "saved" / "a.blend"]
    command(frames, *places, "--frames", "1", recipe=STILL)
    assert not any(folder.exists() for folder in (left, *elsewhere))
    assert mine.exists()
    assert running.exists()
    assert planted.is_symlink()
    assert len(list((tmp_path / "in").iterdir())) == 6


@pytest.mark.parametrize("stream", [">&-", "<&- >&- 2>&-"])
def test_closed_streams(frames, tmp_path, stream):
    (tmp_path / "recipe.json").write_text(json.dumps(STILL))
    options = f"--recipe {tmp_path}/recipe.json --frames 1:3"
    script = f"{sys.executable} -m shutter_addon render {frames} {options} --output {tmp_path}/film.mp4 {stream}"
    assert subprocess.run(["sh", "-c", script], cwd=ROOT, check=False).returncode == 0
    assert whole_pictures(tmp_path / "film.mp4") == 3


@pytest.mark.parametrize("content", ["", "raise MemoryError"])
def test_a_broken_blender_library(tmp_path, content):
    (tmp_path / "bpy.py").write_text(content)
    done = subprocess.run(
        [sys.executable, "-m", "shutter_addon", "render", "--help"],
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    refused(done, "Blender as a library")


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("MemoryError()", ["not enough memory"]),
        ("RuntimeError('Error: out of\\n luck')", ["out of luck"]),
        ("PermissionError(13, 'Permission denied', 'there')", ["there: Permission denied"]),
    ],
)
def test_whatever_goes_wrong_is_one_sentence(frames, tmp_path, fault, words):
    (tmp_path / "recipe.json").write_text(json.dumps(STILL))
    code = f"""
import sys
from shutter_addon import __main__
from shutter_addon.blender.editing import whole_edits
def make_edit(*_):
    raise {fault}
whole_edits.make_edit = make_edit
sys.argv[1:] = ["render", {str(frames)!r}, "--recipe", {str(tmp_path / "recipe.json")!r}, "--output", "out"]
sys.exit(__main__.main())
"""
    refused(subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False), *words)


def test_a_second_signal_ends_at_once(movie, tmp_path):
    """The first one waits for Blender to finish the movie."""
    with started(movie, tmp_path, tmp_path / "film.mp4") as process:
        while not list(tmp_path.glob(".part-*/film.mp4")):
            assert process.poll() is None
        process.send_signal(signal.SIGINT)
        process.send_signal(signal.SIGTERM)
        process.wait(60)
        assert process.returncode == 130
        assert "Traceback" not in process.stderr.read()
