"""The extension in a real window: an editor's first minutes, by mouse and keyboard."""

import cv2
import numpy as np
import pytest
from screens import TOLERANCE, assert_alike, crop, means, pixels
from telling import BUNNY, SMALL, backends, excerpt, linked, needs_window, packages, steps_of, tell

pytestmark = needs_window


@pytest.fixture(scope="session", params=backends("opengl"))
def told(request, tmp_path_factory):
    """The first minutes, on a backend: the folder of the pictures, and what was noted."""
    folder = tmp_path_factory.mktemp(request.param)
    footage = excerpt(BUNNY, range(100), folder / "bunny.mp4", (320, 180))
    return folder, tell("story", request.param, linked(folder), footage=footage)


def test_every_step_is_undone_and_redone(told):
    """Data is compared in the window; here, what the preview showed. No exception reaches the console."""
    folder, seen = told
    steps = steps_of(seen)
    assert "Error" not in (folder / "console.txt").read_text()
    repeated = [name for name in steps if name.endswith(("_undo", "_redo"))]
    assert len(repeated) == 14
    for name in repeated:
        first = name.rpartition("_")[0]
        if steps[name]["crop"][2:] != steps[first]["crop"][2:]:
            continue  # the sidebar, which is no data, was not open yet
        shown, before = (crop(folder, steps[step]) for step in (name, first))
        assert_alike(shown, before, folder / f"{name}_difference.png")


def test_every_step_changes_the_picture(told):
    folder, seen = told
    steps = [entry for entry in seen if not entry.get("step", "_undo").endswith(("_undo", "_redo", "_loaded"))]
    assert len(steps) == 8
    shown = [crop(folder, entry) for entry in steps]
    for before, after, entry in zip(shown, shown[1:], steps[1:], strict=False):
        changed = before.shape != after.shape or (np.abs(before - after) > TOLERANCE).any()
        assert changed, f"{entry['step']} shows nothing new"


def test_a_loaded_file_shows_what_was_saved(told):
    folder, seen = told
    steps = steps_of(seen)
    saved, loaded = (crop(folder, steps[name]) for name in ("8_key_later_redo", "9_loaded"))
    assert_alike(loaded, saved, folder / "loaded_difference.png")


def test_preview_and_render_agree(told):
    """The live preview, the preview without it, what is drawn over it, and View ▸ Render Sequencer Animation: with what
    is rendered by a job of its own."""
    folder, seen = told
    boxes = {entry["picture"]: entry.get("box") for entry in seen if "picture" in entry}
    final = pixels(folder / "final.png")
    for name in ("live", "sequencer"):
        assert_alike(pixels(folder / f"{name}.png", boxes[name]), final, folder / f"{name}_difference.png")
    first, second = (pixels(path) for path in sorted(folder.glob("animation_*.png")))
    assert_alike(first, final, folder / "animation_difference.png")
    assert np.abs(second - first).max() > TOLERANCE
    # But next to black: Blender keeps what is drawn in 8 bits, and shows them with a gamma of 2.2. What is drawn was
    # composed in levels, which costs one of them.
    drawn, dark = pixels(folder / "drawn.png", boxes["drawn"]), final < 8
    assert dark.mean() < 0.2
    assert_alike(np.where(dark, 0, drawn), np.where(dark, 0, final), folder / "drawn_difference.png", TOLERANCE + 1)
    assert np.abs(drawn - final).max() <= 6


def test_previews_of_any_size_and_renders_after_them(tmp_path):
    """At 100, 50 and 25 %, in all views and by scopes; whatever was shown before, a render is the full picture. Playing
    keeps time."""
    footage = excerpt(BUNNY, range(132), tmp_path / "bunny.mp4", (640, 360))
    seen = tell("preview_sizes_story", "opengl", linked(tmp_path), screen=SMALL, footage=footage)
    steps = steps_of(seen)
    composed = {name: tuple(of_one) for name, entry in steps.items() for of_one in entry["composed"]}
    expected = dict.fromkeys(steps, (160, 90)) | dict.fromkeys(("at_100", "at_50", "enlarged"), (320, 180))
    expected |= {"engine": (640, 360)} | dict.fromkeys(
        ("proxy_note", "proxy", "proxy_still", "proxy_by_blender", "after"), (160, 90, "proxy")
    )
    assert composed == expected | {"proxy_of_half": (320, 180, "proxy")}
    pictures = {name: crop(tmp_path, entry) for name, entry in steps.items()}
    middle = {name: picture[60:-60] for name, picture in pictures.items()}  # below the header
    beside = (middle["image"] <= 3).all(axis=(0, 2))  # the edit's image
    assert 20 < beside.sum() < beside.size / 2
    assert middle["enlarged"][:, beside].max() <= 3
    for name, most in (("at_100", 2.5), ("at_50", 2.5), ("at_25", 4), ("image", 4), ("after", 9)):
        assert np.abs(pictures[name] - pictures["engine"]).mean() < most, name
    for name, other, most in (
        ("no_proxy_built", "at_25", 0.01),
        ("proxy_unused", "at_25", 0.01),
        ("proxy", "after", 1),
    ):
        assert np.abs(pictures[name] - pictures[other]).mean() < most, name
    assert np.abs(pictures["proxy"] - pictures["at_25"]).mean() > 2  # Blender's lose much
    ours, blenders = (means(pictures[name]) for name in ("proxy_still", "proxy_by_blender"))
    assert np.abs(ours - blenders).mean() < 1.5
    assert (pictures["waveform"] > 60).mean() > 0.05
    (played,) = (entry for entry in seen if "drawn" in entry)
    when, frames, composed = zip(*played["drawn"], strict=True)
    assert composed == tuple(frame - 1 for frame in frames)
    # On a software renderer few of the film's frames come in time. What is shown instead is the frame of that time. A
    # busy machine may hold one up.
    off = [(frame - frames[0]) / played["rate"] - (at - when[0]) for at, frame in zip(when, frames, strict=True)]
    assert len(when) > 2
    assert np.mean(np.abs(off - np.median(off)) < 0.6) > 0.5
    background = pixels(tmp_path / "background_0050.png")
    for name in ("job", "script", "script_again", "playing", "handler", "scene_strip", "job_after"):
        assert np.array_equal(pixels(tmp_path / f"{name}.png"), background), name
    for name in ("opengl", "opengl_job_0050"):
        assert_alike(pixels(tmp_path / f"{name}.png"), background, tmp_path / "opengl_difference.png")


@pytest.mark.parametrize("backend", backends("opengl"))
def test_one_look_at_full_quality(backend, tmp_path):
    """From a preview that is composed at half size, by *Full Quality*: what F12 gives, pixel by pixel. It ends
    by a second click, with the frame, and with a change, and the view is as before."""
    footage = excerpt(BUNNY, range(80), tmp_path / "bunny.mp4", (320, 180))
    seen = tell("full_quality_story", backend, linked(tmp_path), screen=SMALL, footage=footage)
    steps = steps_of(seen)
    composed = {name: entry["composed"] for name, entry in steps.items()}
    assert composed == {name: [[160, 90]] for name in steps} | {"full": [[320, 180]]}
    for name in ("back", "next", "changed"):
        assert steps[name]["view"] == pytest.approx(steps["before"]["view"], abs=1.1), name
    assert np.abs(crop(tmp_path, steps["back"]) - crop(tmp_path, steps["before"])).mean() < 1
    full, final = pixels(tmp_path / "full.png"), pixels(tmp_path / "final.png")
    left, top, width, height = steps["full"]["crop"]
    x, y = steps["full"]["middle"]
    rows, columns = (top + 90, top + height - 40), (left + width // 2 + 60, left + width // 2 + 150)  # beside bars
    patch = full[slice(*rows), slice(*columns)]
    # Where the view lies on the picture Blender tells to a pixel.
    places = [(rows[0] - y + 90 + down, columns[0] - x + 160 + right) for down in (0, 1) for right in (-1, 0)]
    parts = [final[row : row + patch.shape[0], column : column + patch.shape[1]] for row, column in places]
    assert min(np.abs(patch - part).max() for part in parts) <= TOLERANCE


@pytest.mark.parametrize("backend", backends("vulkan"))
def test_a_rolling_shutter_is_repaired(backend, tmp_path):
    """Found from the menu: the pole stands upright, without a further click. Undone, it leans."""
    seen = tell("rolling_story", backend, linked(tmp_path), packages=packages(tmp_path))
    steps = steps_of(seen)
    assert [(entry["smooth"], entry["regions"]) for entry in steps.values()] == [("1", 0), *[("8", 1)] * 3, ("1", 0)]
    for name in ("2_found", "3_again"):
        assert steps[name]["readout"] == pytest.approx(60, abs=2), name
    leans = {name: lean(crop(tmp_path, steps[name])) for name in steps}
    assert steps["4_adjusted"]["readout"] == 30
    assert min(leans["1_skewed"], leans["5_undone"]) > 6
    assert max(leans["2_found"], leans["3_again"]) < 1
    assert leans["4_adjusted"] == pytest.approx(leans["1_skewed"] / 2, abs=1)


def lean(picture):
    """How far a red pole's middle goes from side to side in a picture, in pixels, in the middle of its rows."""
    red = np.clip(picture[..., 0] - picture[..., 1:].max(axis=2) - 60, 0, None)
    rows = np.flatnonzero(red.sum(axis=1) > 300)
    rows = rows[len(rows) // 5 : -len(rows) // 5]
    middles = (red[rows] * np.arange(red.shape[1])).sum(axis=1) / red[rows].sum(axis=1)
    return np.ptp(middles)


@pytest.mark.parametrize("backend", backends("vulkan"))
def test_what_is_needed_first_is_above_the_fold(backend, tmp_path):
    """In the default layout; the region's shutter is chosen there by the story. And no sentence of the notes is cut."""
    seen = tell("fold_story", backend, linked(tmp_path), packages=packages(tmp_path))
    notes, tabs = ([entry for entry in seen if name in entry] for name in ("step", "buttons"))
    assert [entry["step"] for entry in notes] == ["en_US_1.0", "de_DE_1.5"]
    for note, tab in zip(notes, tabs, strict=True):
        wanted = ["draw()", "track(direction='BOTH')", "panning_shot()", "sharp_subject()"]
        wanted += ["outline_it()"] if note["step"].endswith("1.0") else []  # the last row of what edits a region
        assert {f"bpy.ops.shutter.{name}" for name in wanted} <= set(tab["buttons"]), note["step"]
        sentences = crop(tmp_path, note)
        assert (sentences.min(axis=2) > 110).mean() > 0.01, "there are none"
        assert not ellipses(sentences, tab["scale"]), note["step"]


def ellipses(picture, unit):
    """Where Blender has cut a text: columns and rows of three dots beside each other, of bright text in pixels."""
    bright = (picture.min(axis=2) > 88).astype(np.uint8)
    _count, _labels, boxes, _centres = cv2.connectedComponentsWithStats(bright)
    dots = [(x, y) for x, y, width, height, _area in boxes[1:] if max(width, height) <= 3 * unit]
    return [
        (x, y) for x, y in dots if sum(abs(low - y) <= 1 and 0 <= right - x <= 12 * unit for right, low in dots) >= 3
    ]
