"""Strokes that are tracked, and what is seen of an effect, by mouse: each a story in a real window."""

import shutil

import numpy as np
import pytest
from screens import apart_on_screen, assert_alike, crop, pixels
from telling import BUNNY, ROOT, backends, excerpt, facts_of, linked, needs_window, packages, tell

from shutter_addon.media import open_source

pytestmark = needs_window


def test_one_stroke(tmp_path):
    """Drawn inside a walker, tracked, mended, stopped by Esc: where the stroke is, the film is as sharp as its source,
    and those who walk beside are not."""
    footage = ROOT / "assets" / "walkers.mp4"
    given = {"footage": shutil.copy(footage, tmp_path), "packages": packages(tmp_path)}
    seen = tell("one_stroke_story", "opengl", linked(tmp_path), **given)
    facts = facts_of(seen)
    assert facts["edge_aware"] > 0.9
    for name, edited in (("tracked", ["70"]), ("mended", ["70", "85"]), ("escaped", ["70", "85"])):
        kinds = facts[name]
        assert [frame for frame, kind in kinds.items() if kind != "GENERATED"] == edited, name
        assert len(kinds) > 5, name
    with open_source(footage) as source:
        for entry in (entry for entry in seen if "rendered" in entry):
            frame, (x, y) = entry["rendered"], entry["stroke"]
            apart = np.abs(pixels(tmp_path / f"final_{frame:04d}.png") - source.read(frame - 1)[..., :3])
            row, column = round((1 - y) * apart.shape[0]), round(x * apart.shape[1])
            assert apart[row - 2 : row + 3, column - 2 : column + 3].max() <= 6, frame
            assert apart.max() > 60, frame


@pytest.mark.parametrize("backend", backends("vulkan"))
def test_the_first_stroke(backend, tmp_path):
    """From an empty file to a tracked, rendered frame in twelve actions, at most five of them in the tab. Draw and the
    pen show the sharp frame, and a finished stroke the result: the stroke's subject is sharp, up to her edges."""
    (tmp_path / "footage").mkdir()
    footage = tmp_path / "footage" / "walkers.mp4"
    excerpt(ROOT / "assets" / "walkers.mp4", range(60, 90), footage, (384, 288))
    seen = tell("first_stroke_story", backend, linked(tmp_path), footage=footage, packages=packages(tmp_path))
    facts = facts_of(seen)
    assert len(facts["actions"]) <= 12
    assert sum(in_tab for _what, in_tab in facts["actions"]) <= 5
    left, top, right, bottom = facts["box"]
    shown = [crop(tmp_path, entry)[top:bottom, left:right] for entry in seen if "step" in entry]
    sharp, result, pressed, tracked, plain = shown
    for picture, name in ((sharp, "sharp"), (pressed, "pressed")):
        assert_alike(picture, plain, tmp_path / f"{name}_difference.png")
    for picture in (result, tracked):
        assert (np.abs(picture - plain).max(axis=2) > 30).mean() > 0.02
    final, (x, y) = pixels(tmp_path / "final.png"), facts["stroke"]
    with open_source(footage) as source:
        apart = np.abs(final - source.read(21)[..., :3])
    row, column = round((1 - y) * apart.shape[0]), round(x * apart.shape[1])
    assert apart[row - 2 : row + 3, column - 2 : column + 3].max() <= 6
    assert apart.max() > 60


def test_a_subject(tmp_path):
    """One stroke is enough, without Track: from an empty file to a rendered Sharp Subject in eight actions. The bunny
    is sharp, from head to foot, and leaves no ghost of the frames around."""
    (tmp_path / "footage").mkdir()
    footage = tmp_path / "footage" / "bunny.mp4"
    excerpt(BUNNY, range(74, 104, 3), footage, (320, 180))
    seen = tell("subject_story", "opengl", linked(tmp_path), footage=footage, packages=packages(tmp_path))
    facts = facts_of(seen)
    assert len(facts["actions"]) <= 8
    final = pixels(tmp_path / "final.png")
    with open_source(footage) as source:
        before, plain, behind = (source.read(index)[..., :3].astype(float) for index in (4, 5, 6))
    apart = np.abs(final - plain).max(axis=2)
    for row, column in ((45, 117), (75, 120), (120, 122), (47, 55)):  # chin, belly, arm
        assert apart[row - 2 : row + 3, column - 2 : column + 3].mean() <= 3, (row, column)
    moving = np.maximum(np.abs(before - plain), np.abs(behind - plain)).max(axis=2) > 40
    assert moving.sum() > 125
    assert apart[moving].mean() < 15, "a ghost of the frames around"


def test_an_outline(tmp_path):
    """Drawn at two frames, carried beside Blender to those between, shown, rendered: she is sharp at one of these, in
    the preview as in what is rendered, without a ghost."""
    footage = excerpt(ROOT / "assets" / "walkers.mp4", range(90), tmp_path / "walkers.mp4", (384, 288))
    seen = tell("outline_story", "opengl", linked(tmp_path), footage=footage, packages=packages(tmp_path))
    facts = facts_of(seen)
    assert facts["drawings"] == [66, 74]
    final = pixels(tmp_path / "final_0070.png")
    with open_source(footage) as source:
        apart = np.abs(final - source.read(69)[..., :3])
    assert apart[108:125, 175:181].mean() <= 3, "her jacket"
    assert apart.max() > 60, "others walk"
    assert apart_on_screen(pixels(tmp_path / "7_full_quality.png"), final) <= 1
