"""What an editor makes of clips within minutes, by mouse and keys: each a story in a real window."""

import os

import cv2
import numpy as np
import pytest
from screens import assert_alike, pixels
from telling import ROOT, linked, needs_window, packages, tell, write_film

from shutter_addon.media import open_source

# Five minutes each on two cores: told for a release, as scripts/release does, and not for each commit.
IS_RELEASE = os.environ.get("SHUTTER_BACKENDS") == "both"
LONG = pytest.mark.skipif(not IS_RELEASE, reason="A LONG STORY: set SHUTTER_BACKENDS=both")
pytestmark = [needs_window, LONG]
CUTS = "final", "headless", "plain"
CLIPS = {  # of the assets: the first of forty frames, and their size
    "bunny.mp4": ("bigbuckbunny.mp4", 30, (320, 180)),
    "street.mp4": ("pedestrians.avi", 10, (240, 180)),
    "walkers.mp4": ("walkers.mp4", 40, (240, 180)),
}


@pytest.mark.parametrize("backend", ["opengl", "vulkan"])
def test_an_edit(backend, tmp_path):
    """Three clips, retimed, cut, dissolved, with an effect each: the film is that of a Blender without a window. Where
    there is no effect, and where an effect is sharp, it is the edit without effects."""
    (tmp_path / "footage").mkdir()
    for name, (asset, first, size) in CLIPS.items():
        with open_source(ROOT / "assets" / asset) as source:
            frames = [
                cv2.resize(source.read(first + n)[..., :3], size, interpolation=cv2.INTER_AREA) for n in range(40)
            ]
        write_film(tmp_path / "footage" / name, frames, 10)
    given = {"footage": tmp_path / "footage" / "bunny.mp4", "packages": packages(tmp_path / "packages")}
    seen, console = tell("edit_story.py", backend, linked(tmp_path), **given)
    assert "Traceback" not in console
    facts = {name: entry[name] for entry in seen for name in entry}
    films = {name: {path.stem[-4:]: pixels(path) for path in tmp_path.glob(f"{name}_*.png")} for name in CUTS}
    final, headless, plain = (films[name] for name in CUTS)
    assert len(final) == 116
    assert sorted(final) == sorted(headless) == sorted(plain)
    for number, picture in final.items():
        assert_alike(picture, headless[number], tmp_path / f"headless_difference_{number}.png", 1)
    assert_beside_plain(final, plain, facts, tmp_path)


def assert_beside_plain(final, plain, facts, folder):
    """By the ranges of effects, and where each of them is sharp."""
    within = {}
    for first, end, name in facts["effects"]:
        within |= {f"{frame:04d}": name for frame in range(first, end)}
    assert len(set(final) - set(within)) == 21, "between the second effect and the third"
    (dissolve_from, *_), (_, dissolve_to, _) = facts["effects"][1], facts["effects"][0]
    height, width = next(iter(final.values())).shape[:2]
    (left, y), (right, _y) = facts["sharp"]
    line = np.s_[height - 1 - int(y * height), int(left * width) : int(right * width)]
    moves = []
    for number, picture in final.items():
        apart = np.abs(picture - plain[number]).max(axis=2)
        if number not in within:
            assert apart.max() == 0, number
        elif int(number) >= dissolve_to:
            assert apart.max() > 20, number
            assert apart[line].max() <= 2, number
            moves.append(np.abs(picture - final[f"{int(number) - 2:04d}"])[line].max())
    assert dissolve_from < dissolve_to
    assert np.mean(np.array(moves) > 20) > 0.5, "people walk there"
