"""The command `check`: planted faults are told, all of them, each by its place; and what a sound edit is made of."""

import io
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support import ROOT, noise_film, recipe, write_frames, write_movie, write_tone

from shutter_addon.blender import command
from shutter_addon.blender.data import recipe_import, versions
from shutter_addon.blender.editing import add_effect, shutter_edits
from shutter_addon.core.farm import job_file
from shutter_addon.core.recipes import recipe_file
from shutter_addon.features.outlines import carrying
from shutter_addon.media.rendered_pictures import read

FRAMES, WINDOW = 8, 4


@pytest.fixture
def noise(edit, tmp_path):
    """Has an edit of noise under an effect open."""
    frames = np.random.default_rng(1).integers(0, 256, (FRAMES, 48, 64, 3), dtype=np.uint8)
    noise_film(edit, frames, tmp_path)


def now():
    """Scene, effect and its strip of the edit that is open: the command opens another than the test began with."""
    import bpy

    edit = bpy.context.scene
    return edit, edit.virtual_shutter.effects[0], edit.sequence_editor.strips["Shutter"]


@pytest.fixture
def check(bpy, tmp_path, capsys):
    """Saves the open edit, and runs the command on it in this process: sentences and printed lines."""

    def run(*options, change=lambda: None):
        path = tmp_path / "edit.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True, compress=False)
        change()
        capsys.readouterr()
        code = command.main([str(argument) for argument in ("check", path, *options)])
        told = capsys.readouterr()
        sentences = [line.removeprefix("Virtual Shutter: ") for line in told.err.splitlines()]
        assert code == (2 if sentences else 0)
        return sentences, told.out.splitlines()

    return run


def test_a_sound_edit(noise, check, tmp_path):
    sentences, lines = check("--output", tmp_path / "out", "--frames", "2-3", "--device", "cpu")
    assert sentences == []
    edit = tmp_path / "edit.blend"
    key = lines[0].split()[-1]
    assert lines == [f"Edit: {edit}, version {key}", "Frames: 2 to 3, 64×48", "Device: NumPy"]
    version = versions.of_edit(now()[0])
    assert version.key == key
    assert (tmp_path / "out" / job_file.NAME).exists()
    job_file.guard(tmp_path / "out", version)
    assert command.main(["render", str(edit), "--output", str(tmp_path / "out"), "--frames", "2"]) == 0
    assert read(tmp_path / "out" / "0002.png").edit == key


@pytest.mark.parametrize(
    ("plant", "sentence"),
    [
        (lambda folder: shutil.rmtree(folder / "in"), "f0001.png: no such file in "),
        (lambda folder: [(folder / "in" / f"f000{n}.png").unlink() for n in (5, 6, 8)], "f0005.png: no such file in "),
        (lambda folder: (folder / "in" / "f0008.png").write_bytes(b"no picture"), "f0008.png: cannot be read"),
        (
            lambda folder: write_frames(folder / "in", np.zeros((FRAMES, 24, 32, 3), np.uint8)),
            "f0001.png: is 32×24, but was 64×48 when the edit was saved",
        ),
        (lambda folder: shutil.rmtree(folder / "matte"), "m0001.png: no such file"),
        (lambda folder: (folder / "matte" / "m0001.png").write_bytes(b"none"), "m0001.png: cannot be read"),
        (lambda folder: (folder / "matte" / "m0008.png").write_bytes(b"none"), "m0008.png: cannot be read"),
    ],
)
def test_footage_and_mattes(noise, check, tmp_path, plant, sentence):
    edit, effect, strip = now()
    write_frames(tmp_path / "matte", np.full((FRAMES, 48, 64, 3), 128, np.uint8), "m")
    region = {"shutter": "S1", "kind": "matte", "path": "matte/m0001.png"}
    data = recipe(WINDOW, np.ones(WINDOW), [1, 0, 0, 0], regions=[region])
    recipe_import.apply(edit, effect, strip, recipe_file.parse(json.dumps(data)), tmp_path)
    assert check()[0] == []
    (found,) = check(change=lambda: plant(tmp_path))[0]
    assert found.startswith('"Shutter": ')
    assert sentence in found


def test_footage_that_the_frames_do_not_need(noise, check, tmp_path):
    """Frames 1 and 2 expose the first five."""
    change = (tmp_path / "in" / "f0006.png").unlink
    assert check("--frames", "1:2", change=change)[0] == []


def _movie(path, count):
    pictures = [np.random.default_rng(i).integers(0, 256, (48, 64, 3), dtype=np.uint8) for i in range(count)]
    write_movie(path, pictures, "mpeg4", "yuv420p", 25)


@pytest.fixture
def film(edit, tmp_path):
    """The strip of a movie of 9 frames, with an effect."""
    _movie(tmp_path / "film.mp4", 9)
    edit.render.resolution_x, edit.render.resolution_y, edit.frame_end = 64, 48, 9
    source = edit.sequence_editor.strips.new_movie("m", str(tmp_path / "film.mp4"), 1, 1)
    shutter_edits.start(add_effect.add_effect(edit, source)[1])
    return source


def test_a_movie_that_plays_slower(film, check):
    film.retiming_keys.add(timeline_frame=1)
    film.retiming_keys[-1].timeline_frame = 31
    assert film.content_duration == 30
    assert check()[0] == []


def test_a_movie_that_is_shorter_than_its_strip(film, check, tmp_path):
    found, _ = check(change=lambda: _movie(tmp_path / "film.mp4", 6))
    assert found == ['"Shutter": film.mp4: has 6 frames, fewer than the 9 of strip "m"']


def test_a_shutter_that_never_opens(noise, check):
    _, effect, _ = now()
    for bar in effect.shutters[1].bars:
        bar.weight = 0
    (found,) = check()[0]
    assert found.startswith('"Shutter": shutter "S1" at frame 1: ')


def test_outlines(noise, check, tmp_path, monkeypatch):
    """Whose mattes are not carried yet: nothing is carried for this, and their number is told."""
    scene, effect, strip = now()
    box = [[[0.2, 0.2], [0.6, 0.2], [0.4, 0.7]]]
    keys = [{"frame": frame, "strokes": box} for frame in (1, FRAMES)]
    region = {"name": "o", "shutter": "S1", "kind": "outline", "strokes": box, "keys": keys}
    given = recipe(2, [1, 1], [0, 1], regions=[region])
    recipe_import.apply(scene, effect, strip, recipe_file.parse(json.dumps(given)))
    monkeypatch.setattr(carrying, "carried", None)
    sentences, lines = check()
    assert sentences == []
    assert f"{FRAMES} mattes of outlines are not tracked yet" in " ".join(lines)


def test_a_frame_that_a_moment_needs_is_missing(noise, check, tmp_path):
    """The second of its pair, which no bar is open for by itself: time stands between the two."""
    _edit, effect, _strip = now()
    effect.use_source_time, effect.source_time = True, 3.5
    for shutter in effect.shutters:
        for index, bar in enumerate(shutter.bars):
            bar.weight = index == 0
    effect.inbetween = "2"
    assert check("--frames", "1")[0] == []
    (fault,) = check("--frames", "1", change=lambda: (tmp_path / "in" / "f0004.png").unlink())[0]
    assert "f0004.png" in fault


def test_plain_strips(noise, check, tmp_path):
    edit = now()[0]
    editor = edit.sequence_editor
    write_tone(tmp_path / "tone.wav")
    _movie(tmp_path / "plain.mp4", 9)
    write_frames(tmp_path / "plain", np.zeros((3, 8, 8, 3), np.uint8))
    editor.strips.new_sound("sound", str(tmp_path / "tone.wav"), 5, 1)
    editor.strips.new_movie("movie", str(tmp_path / "plain.mp4"), 6, 1)
    images = editor.strips.new_image("plain", str(tmp_path / "plain" / "f0001.png"), 7, 1)
    images.elements.append("f0002.png")
    images.elements.append("f0003.png")
    assert check()[0] == []

    def plant():
        (tmp_path / "tone.wav").unlink()
        (tmp_path / "plain.mp4").write_bytes(b"no movie")
        (tmp_path / "plain" / "f0002.png").unlink()

    places = sorted(sentence.partition(": ")[0] for sentence in check(change=plant)[0])
    assert places == ['strip "movie"', 'strip "plain"', 'strip "sound"']


def test_an_effect_whose_scene_was_deleted(noise, check, bpy):
    bpy.data.scenes.remove(now()[2].scene)
    assert check()[0] == ['the scene of "Shutter" was deleted']


def test_a_newer_extension_and_blender(noise, check, bpy, tmp_path, monkeypatch):
    path, here, (major, minor, _) = tmp_path / "edit.blend", versions.extension(), bpy.app.version_file
    monkeypatch.setattr(versions, "extension", lambda: "99.1.0")

    def change():
        monkeypatch.undo()
        saved_by, content = f"v{major:02}{minor:02}".encode(), path.read_bytes()
        assert saved_by in content[:20]
        path.write_bytes(content.replace(saved_by, f"v{major:02}{minor + 1:02}".encode(), 1))

    found, _ = check(change=change)
    assert found[0] == f"the edit was saved by version 99.1.0 of the extension, this machine has {here}"
    assert found[1].startswith(f"the edit was saved by Blender {major}.{minor + 1}, this machine has {major}.{minor}")


@pytest.mark.parametrize(
    ("name", "options", "sentence"),
    [
        ("in", [], "f0001.png"),
        ("in\\to", [], "Blender cannot write to a path with \\"),
        ("out.mp4", [], "a saved edit is rendered to a folder of pictures, not to a movie"),
        ("out.v2", [], "out.v2: neither a folder nor one of .mp4"),
        ("out.v2", ["--format", "png"], ""),
    ],
)
def test_a_place_that_render_refuses(noise, check, tmp_path, name, options, sentence):
    for number in range(1, FRAMES + 1):  # as pictures are called
        (tmp_path / "in" / f"{number:04d}.png").hardlink_to(tmp_path / "in" / f"f{number:04d}.png")
    found, _ = check("--output", tmp_path / name, *options)
    assert len(found) == bool(sentence)
    if sentence:
        assert sentence in found[0]
        assert not (tmp_path / name / job_file.NAME).exists()
        assert (tmp_path / name).exists() == (name == "in")


def test_an_edit_that_cannot_be_resumed(noise, check):
    now()[0].render.use_stamp = True
    assert check()[0] == []
    (fault,) = check("--resume")[0]
    assert fault.startswith("--resume: the edit burns metadata into its pictures")


@pytest.mark.parametrize(
    ("width", "name", "sentence"),
    [
        (64, "film.mp4", ""),
        (64, "film", "film: none of .mp4"),
        (64, "in/f0001.png/film.mp4", "f0001.png: is a file, not a folder"),
        (64, "folder.mp4", "folder.mp4: is a folder, not a movie"),
        (65, "film.mp4", "film.mp4: a movie has even sizes, not 65×48"),
    ],
)
def test_a_movie_that_join_refuses(noise, check, tmp_path, width, name, sentence):
    (tmp_path / "folder.mp4").mkdir()
    now()[0].render.resolution_x = width
    found, _ = check("--movie", tmp_path / name, "--output", tmp_path / "out")
    assert [sentence in fault for fault in found] == [True] * bool(sentence)
    assert (tmp_path / "out").exists() == (not sentence)
    assert not list(tmp_path.glob("film*"))


def test_nobody_reads_the_report(bpy, noise, tmp_path):
    """Python itself would tell of the closed pipe at its end."""
    path = tmp_path / "edit.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    reader, writer = os.pipe()
    os.close(reader)
    arguments = [sys.executable, "-m", "shutter_addon", "check", str(path)]
    done = subprocess.run(arguments, cwd=ROOT, stdout=writer, stderr=subprocess.PIPE, check=False)
    os.close(writer)
    assert (done.returncode, done.stderr) == (0, b"")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no full device")
def test_a_report_that_cannot_be_written(noise, check, monkeypatch):
    full = io.TextIOWrapper(io.FileIO("/dev/full", "w"), write_through=True)
    assert check(change=lambda: monkeypatch.setattr(sys, "stdout", full))[0] == ["stdout: No space left on device"]
