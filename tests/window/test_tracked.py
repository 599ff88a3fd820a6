"""Strokes that are tracked, and what is seen of an effect, by mouse: each a story in a real window."""

import shutil

import av
import numpy as np
import pytest
from screens import apart_on_screen, assert_alike, crop, pixels
from telling import ROOT, backends, linked, needs_window, packages, tell

from shutter_addon.media import open_source

pytestmark = needs_window


def test_one_stroke(tmp_path):
    """Drawn inside a walker, tracked, mended, stopped by Esc: where the stroke is, the film is as sharp as its source,
    and those who walk beside are not."""
    footage = ROOT / "assets" / "walkers.mp4"
    given = {"footage": shutil.copy(footage, tmp_path), "packages": packages(tmp_path / "packages")}
    seen, console = tell("one_stroke_story.py", "opengl", linked(tmp_path), **given)
    assert "Traceback" not in console
    facts = {name: entry[name] for entry in seen for name in entry}
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
    footage = shutil.copy(ROOT / "assets" / "walkers.mp4", tmp_path / "footage")
    given = {"footage": footage, "packages": packages(tmp_path / "packages")}
    seen, console = tell("first_stroke_story.py", backend, linked(tmp_path), **given)
    assert "Traceback" not in console
    facts = {name: entry[name] for entry in seen for name in entry}
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
        apart = np.abs(final - source.read(81)[..., :3])
    row, column = round((1 - y) * apart.shape[0]), round(x * apart.shape[1])
    assert apart[row - 2 : row + 3, column - 2 : column + 3].max() <= 6
    assert apart.max() > 60


def silent(movie, to):
    """A copy of a movie without its sound, which would be a strip of its own."""
    with av.open(movie) as read, av.open(to, "w") as written:
        stream = written.add_stream_from_template(read.streams.video[0])
        for packet in read.demux(video=0):
            if packet.dts is not None:
                packet.stream = stream
                written.mux(packet)
    return to


def test_a_subject(tmp_path):
    """One stroke is enough, without Track: from an empty file to a rendered Sharp Subject in eight actions. The bunny
    is sharp, from head to foot, and leaves no ghost of the frames around."""
    (tmp_path / "footage").mkdir()
    footage = silent(ROOT / "assets" / "bigbuckbunny.mp4", tmp_path / "footage" / "bunny.mp4")
    given = {"footage": footage, "packages": packages(tmp_path / "packages")}
    seen, console = tell("subject_story.py", "opengl", linked(tmp_path), **given)
    assert "Traceback" not in console
    facts = {name: entry[name] for entry in seen for name in entry}
    assert len(facts["actions"]) <= 8
    final = pixels(tmp_path / "final.png")
    with open_source(footage) as source:
        plain = source.read(89)[..., :3]
    apart = np.abs(final - plain).max(axis=2)
    for row, column in ((180, 470), (300, 480), (480, 490), (200, 300), (560, 540)):  # face, belly, arm, foot
        assert apart[row - 4 : row + 5, column - 4 : column + 5].mean() <= 3, (row, column)
    assert apart.max() > 40, "the ground is exposed for long"


def test_an_outline(tmp_path):
    """Drawn at two frames, carried beside Blender to those between, shown, rendered: she is sharp at one of these, in
    the preview as in what is rendered, without a ghost."""
    given = {"footage": shutil.copy(ROOT / "assets" / "walkers.mp4", tmp_path)}
    given["packages"] = packages(tmp_path / "packages")
    seen, console = tell("outline_story.py", "opengl", linked(tmp_path), **given)
    assert "Traceback" not in console
    facts = {name: entry[name] for entry in seen for name in entry}
    assert facts["drawings"] == [62, 78]
    assert facts["mask"][0] >= 1
    assert facts["mask"][1] >= 12
    around_her = np.array(facts["clicked"]) * (768, 576)
    assert len(around_her) > 8, "between points it goes along edges"
    assert np.abs(around_her - around_her.mean(axis=0)).max(axis=0).tolist() <= [40, 70]
    final = pixels(tmp_path / "final_0070.png")
    with open_source(given["footage"]) as source:
        apart = np.abs(final - source.read(69)[..., :3])
    assert apart[215:250, 350:362].mean() <= 3, "her jacket"
    assert apart.max() > 60, "others walk"
    assert apart_on_screen(pixels(tmp_path / "7_full_quality.png"), final) <= 1
