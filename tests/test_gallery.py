"""The gallery: recipes load, items are listed without Blender, and one is made from end to end."""

import dataclasses
import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from OpenImageIO import ImageBuf

from gallery import NAMES, bunny
from gallery.item import HERE, ROOT, Shot
from shutter_addon.core import recipe

SCRIPT = str(ROOT / "scripts" / "gallery.py")
WITHOUT_BPY = """
import runpy, sys
sys.modules["bpy"] = None
sys.argv = sys.argv[1:]
runpy.run_path(sys.argv[0], run_name="__main__")
"""
# Where on the bunny's picture: rows and columns.
HEAD, ARM, MEADOW = np.s_[130:230, 430:530], np.s_[110:230, 250:330], np.s_[500:700, 900:1200]


def listed(*arguments):
    command = [sys.executable, "-c", WITHOUT_BPY, SCRIPT, *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)


def test_the_list_needs_no_blender():
    done = listed()
    assert done.returncode == 0, done.stderr
    assert [line.split()[0] for line in done.stdout.splitlines()] == list(NAMES)


def test_an_unknown_name_is_one_sentence():
    done = listed("bunny", "nothing")
    assert done.returncode == 2
    assert done.stderr.startswith("gallery: there is no nothing; there are pendulum, ")


def test_a_folder_that_cannot_be_made_is_one_sentence(tmp_path):
    (tmp_path / "file").touch()
    done = listed("--output", str(tmp_path / "file"), "bunny")
    assert done.returncode == 2
    assert done.stderr == f"gallery: {tmp_path}/file/bunny: Not a directory\n"


def test_help_says_where_a_relative_folder_lies():
    assert "scripts/gallery takes it from the project's folder" in " ".join(listed("--help").stdout.split())


@pytest.mark.parametrize("path", sorted(HERE.glob("*.json")), ids=lambda path: path.stem)
def test_recipes_load(path):
    assert path.stem.split("-")[0] in NAMES
    assert recipe.load(path).shutters


def test_an_item_from_end_to_end(tmp_path, monkeypatch):
    """Into a folder of the caller's.

    Its head and the meadow are the source's, within what a movie's compression takes; its arms are not.
    """
    make = runpy.run_path(SCRIPT)["make"]
    monkeypatch.chdir(tmp_path.parent)
    frames = bunny.FRAME, bunny.FRAME + 1
    assert make(dataclasses.replace(bunny.ITEM, frames=frames), Path(tmp_path.name), docs=False) == 0
    assert {path.name for path in tmp_path.iterdir()} == {f"bunny.{end}" for end in ("blend", "json", "mp4", "png")}
    shot = Shot(bunny.footage(tmp_path), tmp_path / "bunny.json", tmp_path / "bunny.mp4", frames[0])
    difference = np.abs(shot.result(bunny.FRAME) - shot.source(bunny.FRAME)).mean(axis=2)
    assert difference[HEAD].mean() < 0.02
    assert difference[MEADOW].mean() < 0.02
    assert difference[ARM].mean() > 0.1
    still = ImageBuf(str(tmp_path / "bunny.png")).get_pixels()
    assert still.shape[1:] == (1632, 3)
    assert still.std() > 0.1
