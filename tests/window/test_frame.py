"""The way of a preview's frame: the page that tells it, and how often it comes back to a room."""

import importlib
import sys

from telling import ROOT, linked, needs_window, tell

sys.path.append(str(ROOT / "scripts"))  # at the end: gallery is a package, and a script there
frame_way = importlib.import_module("frame_way")

pytestmark = needs_window


def test_a_preview_goes_the_way_of_the_page(tmp_path):
    seen, console = tell("frame_story.py", "opengl", linked(tmp_path))
    assert "Traceback" not in console
    ways = {entry["frame"]: entry["stops"] for entry in seen if "frame" in entry}
    told = [(stop.path, stop.function) for stop in frame_way.ways()["preview_frame"]]
    made = [(path, function) for path, function, _back in ways["played"]]
    assert [stop for stop in made if stop in told] == told
    for stops in ways.values():
        back = [(path, function) for path, function, comes_back in stops if comes_back]
        # One of them for Slide, which asks for the shot before it composes; two for smooth pictures behind plain ones.
        assert len(back) <= 13, "\n".join(map(str, stops))
