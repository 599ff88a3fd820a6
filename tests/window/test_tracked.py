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


def excerpt(movie, frames, to):
    """Some frames of a movie, small, without its sound, which would be a strip of its own."""
    with av.open(movie) as read, av.open(to, "w") as written:
        stream = written.add_stream("libx264", rate=24, options={"qp": "10"})
        stream.width, stream.height, stream.pix_fmt = 640, 360, "yuv420p"
        for number, frame in enumerate(read.decode(video=0)):
            if number in frames:
                smaller = frame.to_ndarray(width=640, height=360, format="rgb24")
                written.mux(stream.encode(av.VideoFrame.from_ndarray(smaller)))
        written.mux(stream.encode())
    return to


def test_a_subject(tmp_path):
    """One stroke is enough, without Track: from an empty file to a rendered Sharp Subject in eight actions. The bunny
    is sharp, from head to foot, and leaves no ghost of the frames around."""
    (tmp_path / "footage").mkdir()
    footage = excerpt(ROOT / "assets" / "bigbuckbunny.mp4", range(68, 116, 3), tmp_path / "footage" / "bunny.mp4")
    given = {"footage": footage, "packages": packages(tmp_path / "packages")}
    seen, console = tell("subject_story.py", "opengl", linked(tmp_path), **given)
    assert "Traceback" not in console
    facts = {name: entry[name] for entry in seen for name in entry}
    assert len(facts["actions"]) <= 8
    final = pixels(tmp_path / "final.png")
    with open_source(footage) as source:
        before, plain, behind = (source.read(index)[..., :3].astype(float) for index in (6, 7, 8))
    apart = np.abs(final - plain).max(axis=2)
    for row, column in ((90, 235), (150, 240), (240, 245), (95, 110)):  # chin, belly, arm
        assert apart[row - 4 : row + 5, column - 4 : column + 5].mean() <= 3, (row, column)
    moving = np.maximum(np.abs(before - plain), np.abs(behind - plain)).max(axis=2) > 40
    assert moving.sum() > 500
    assert apart[moving].mean() < 15, "a ghost of the frames around"


def test_an_outline(tmp_path):
    """Drawn at two frames, carried beside Blender to those between, shown, rendered: she is sharp at one of these, in
    the preview as in what is rendered, without a ghost."""
    given = {"footage": shutil.copy(ROOT / "assets" / "walkers.mp4", tmp_path)}
    given["packages"] = packages(tmp_path / "packages")
    seen, console = tell("outline_story.py", "opengl", linked(tmp_path), **given)
    assert "Traceback" not in console
    facts = {name: entry[name] for entry in seen for name in entry}
    assert facts["drawings"] == [62, 78]
    final = pixels(tmp_path / "final_0070.png")
    with open_source(given["footage"]) as source:
        apart = np.abs(final - source.read(69)[..., :3])
    assert apart[215:250, 350:362].mean() <= 3, "her jacket"
    assert apart.max() > 60, "others walk"
    assert apart_on_screen(pixels(tmp_path / "7_full_quality.png"), final) <= 1
