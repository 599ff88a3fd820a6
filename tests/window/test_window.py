"""The extension in a real window: an editor's first minutes, by mouse and keyboard, on both of Blender's backends."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import av
import cv2
import numpy as np
import OpenImageIO
import pytest
from telling import ROOT, linked, needs_window, tell

from shutter_addon.media import open_source
from shutter_addon.media.completeness import whole_pictures

TOLERANCE = 2

pytestmark = needs_window


def pixels(path, box=None):
    """8-bit RGB of a picture file, or of its box of left, top, right, bottom."""
    image = OpenImageIO.ImageBuf(str(path)).get_pixels(OpenImageIO.UINT8)[..., :3].astype(int)
    left, top, right, bottom = box or (0, 0, image.shape[1], image.shape[0])
    return image[top:bottom, left:right]


def assert_alike(picture, expected, keep, tolerance=TOLERANCE):
    """Within the tolerance; otherwise the amplified difference is kept."""
    assert picture.shape == expected.shape
    apart = np.abs(picture - expected)
    if apart.max() > tolerance:
        image = OpenImageIO.ImageBuf(OpenImageIO.ImageSpec(*apart.shape[1::-1], 3, "uint8"))
        image.set_pixels(OpenImageIO.ROI(), np.minimum(apart * 20, 255).astype(np.uint8))
        image.write(str(keep))
    assert apart.max() <= tolerance, f"{apart.max()} levels apart, {(apart > tolerance).mean():.2%}; see {keep}"


@pytest.fixture(scope="session", params=["opengl", "vulkan"])
def told(request, tmp_path_factory):
    """The first minutes, on a backend: the folder of the pictures, what was noted, and the console."""
    folder = tmp_path_factory.mktemp(request.param)
    return folder, *tell("story.py", request.param, linked(folder))


def test_bars_between_keys_and_the_extension_disabled(tmp_path):
    _seen, console = tell("bars_and_disable.py", "opengl", linked(tmp_path))
    assert "Traceback" not in console


def test_blender_quits_after_a_render(tmp_path):
    tell("quitting.py", "opengl", linked(tmp_path))


def test_without_wheels(tmp_path):
    """The preview and a render's thread are on Blender's own GPU; it says why."""
    ((seen,), console) = tell("without_wheels.py", "opengl", linked(tmp_path))
    (said,) = seen["said"]
    assert "moderngl" in said
    assert "composing on Blender's own GPU" in said
    assert said in console
    assert "Traceback" not in console


def test_preview_and_film_take_turns_where_the_gpu_is_small(tmp_path):
    """Each has room for the running sums of its window, and both have not."""
    size, megabytes = (480, 270), 34
    (tmp_path / "frames").mkdir()
    for number, frame in enumerate(np.random.default_rng(1).integers(0, 256, (20, *size[::-1], 3), dtype=np.uint8)):
        OpenImageIO.ImageBuf(frame).write(str(tmp_path / "frames" / f"{number + 1:04d}.png"))
    line = {"shutter": "Sharp", "strokes": [[[0.2, 0.2], [0.6, 0.9]]], "width": 0.1}
    shutters = [{"name": "Long", "bars": [1] * 16}, {"name": "Sharp", "bars": [1] + [0] * 15}]
    path, first = tmp_path / "recipe.json", tmp_path / "frames" / "0001.png"
    path.write_text(json.dumps({"version": 1, "window": 16, "border": True, "shutters": shutters, "regions": [line]}))
    given = {"footage": first, "recipe": path, "megabytes": megabytes}
    (*seen, told), console = tell("memory_story.py", "opengl", linked(tmp_path), **given)
    assert "Traceback" not in console
    assert f"the {megabytes // 4} MB that may be taken of the GPU are too few for 16 frames" in told["said"][-1]
    options = ("--recipe", path, "--output", tmp_path / "expected", "--device", "opengl", "--frames", "1:4")
    subprocess.run([sys.executable, "-m", "shutter_addon", "render", first, *options], check=True, cwd=ROOT)
    sums = 17 * 8 * size[0] * size[1]
    assert [found["device"] for found in seen] == ["GLDevice", "RelayedDevice"]
    for found, folder in zip(seen, ("OPENGL", "BLENDER"), strict=True):
        assert found["before"][0] > sums
        assert found["before"][1] == found["job"][1] == found["after"][1] == "Sums"
        assert found["freed"][1] is None
        assert found["kept"][1] is None
        assert found["most"] <= found["limit"] == megabytes << 20
        for name in ("0001.png", "0002.png", "0003.png", "0004.png"):
            apart = np.abs(pixels(tmp_path / folder / name) - pixels(tmp_path / "expected" / name))
            assert apart.max() <= 1, (folder, name)


def test_films_on_blenders_own_gpu(tmp_path):
    """In a job of the window, moderngl hidden: as moderngl renders them without a window; ten in a row, and their
    textures take what the first one's took."""
    (tmp_path / "frames").mkdir()
    for number, frame in enumerate(np.random.default_rng(1).integers(0, 256, (30, 54, 96, 3), dtype=np.uint8)):
        OpenImageIO.ImageBuf(frame).write(str(tmp_path / "frames" / f"{number + 1:04d}.png"))
    line = {"name": "Moved", "shutter": "Sharp", "strokes": [[[0.2, 0.2], [0.6, 0.9]]], "width": 0.1}
    line["keys"] = [{"frame": 1}, {"frame": 30, "location": [0.3, 0.1]}]
    shutters = [{"name": "Long", "bars": [1] * 6}, {"name": "Sharp", "bars": [0, 0, 1, 0, 0, 0]}]
    path, first = tmp_path / "recipe.json", tmp_path / "frames" / "0001.png"
    path.write_text(json.dumps({"version": 1, "window": 6, "border": True, "shutters": shutters, "regions": [line]}))
    given = {"footage": first, "recipe": path}
    seen, console = tell("own_gpu_story.py", "vulkan", linked(tmp_path), **given)
    assert "Traceback" not in console
    assert console.count("composing on Blender's own GPU") == 2  # of each file's first film
    reason = "View > Render Sequencer Animation cannot use Blender's own GPU, as Render > Render Animation can"
    assert console.count(f"and {reason}; composing with NumPy, which is slow") == 1
    assert f"{reason}\n" in console  # where NumPy is not allowed
    assert len(list(tmp_path.glob("refused/*"))) < 4
    held = [found for entry in seen for found in entry.values()]
    assert {tuple(found[:2]) for found in held} == {("RelayedDevice", held[0][1])}
    assert len({used for *_, used in held}) == 1
    options = ("--recipe", path, "--output", tmp_path / "expected", "--device", "opengl")
    subprocess.run([sys.executable, "-m", "shutter_addon", "render", first, *options], check=True, cwd=ROOT)
    assert 3 <= len(list((tmp_path / "stopped").iterdir())) < 30
    for folder, count in (("film", 30), ("short", 12), ("waited", 4), ("after", 5)):
        names = sorted(file.name for file in (tmp_path / folder).iterdir())
        assert names == [f"{number:04d}.png" for number in range(1, count + 1)]
        for name in names:
            apart = np.abs(pixels(tmp_path / folder / name) - pixels(tmp_path / "expected" / name))
            assert apart.max() <= 1, (folder, name)


def test_in_between_frames_are_built_and_removed(tmp_path):
    seen, console = tell("inbetween_story.py", "opengl", linked(tmp_path))
    states = [(entry["shown"], entry["state"]) for entry in seen if "shown" in entry]
    assert states == [
        ("missing", "missing"),
        ("partial", "partial"),
        ("ready", "ready"),
        ("stale", "stale"),
        ("again", "ready"),
        ("removed", "missing"),
    ]
    assert "Traceback" not in console


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


def broken_film(path):
    """For track_ends_story.py: 30 frames of a film, 40 of the walkers, covered in the last seven, 10 of grey, and 30 of
    the other film again, 768×576."""
    shots = []
    for name, first, count in (("bigbuckbunny", 0, 30), ("walkers", 50, 40), ("", 0, 10), ("bigbuckbunny", 60, 30)):
        if not name:
            shots += [np.full((576, 768, 3), 110, np.uint8)] * count
            continue
        with open_source(ROOT / "assets" / f"{name}.mp4") as source:
            frames = [source.read(first + n)[..., :3] for n in range(count)]
        shots += [cv2.resize(frame, (768, 576), interpolation=cv2.INTER_AREA) for frame in frames]
    for n in range(63, 70):
        shots[n] = shots[n].copy()
        shots[n][:, 200:560] = 110
    with av.open(str(path), "w") as film:
        stream = film.add_stream("libx264", rate=25, options={"crf": "10"})
        stream.width, stream.height, stream.pix_fmt = 768, 576, "yuv420p"
        for frame in shots:
            film.mux(stream.encode(av.VideoFrame.from_ndarray(frame, "rgb24")))
        film.mux(stream.encode())
    return path


@pytest.mark.parametrize("backend", ["opengl", "vulkan"])
def test_what_is_tracked_ends_with_its_track(tmp_path, backend):
    """A region counts in its shot alone, and fades where the subject is covered: elsewhere the picture is that of an
    effect without it. A camera is tracked through all shots; between them exposures become short, and long again."""
    given = {"footage": broken_film(tmp_path / "broken.mp4"), "packages": packages(tmp_path / "packages")}
    seen, console = tell("track_ends_story.py", backend, linked(tmp_path), **given)
    assert "Traceback" not in console
    facts = {name: entry[name] for entry in seen for name in entry}
    first, last = facts["region"][0][0], facts["region"][-1][0]
    assert 30 <= first < 45, "behind a lamp post, or at the cut"
    assert 62 <= last <= 66
    assert [value for _frame, value, _kind in facts["region"]] == [0, 1, 1, 0]
    assert {kind for *_, kind in facts["region"]} == {"GENERATED"}
    assert facts["gaps"] == [["-inf", str(first)], [str(last), "inf"]]
    steps = {entry["step"]: crop(tmp_path, entry) for entry in seen if "step" in entry}
    height = next(iter(steps.values())).shape[0]
    above = slice(height // 4, height * 3 // 4)  # the bar editor, and below notes, which come when they are known
    for frame in (20, 50, 61, 76):
        apart = np.abs(steps[f"there_{frame:03d}"][above] - steps[f"without_{frame:03d}"][above])
        assert (apart.max() > 25) == (frame in (50, 61)), frame
    assert facts["tracked"] == [1, 110]
    assert facts["camera_gaps"] == [["71", "80"]]
    values = {frame: value for frame, value, _kind in facts["camera"]}
    assert (values[70], values[81]) == (0, 0)
    assert max(values.values()) == 1


@pytest.mark.parametrize("backend", ["opengl", "vulkan"])
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


@pytest.mark.parametrize("backend", ["opengl", "vulkan"])
def test_a_panning_shot(tmp_path, backend):
    """A walker before a still camera: she is sharp, and the street, which stands still, streaks. A dragged bar shows at
    once. On the other backend than that of a single stroke, to spare time."""
    footage = ROOT / "assets" / "walkers.mp4"
    given = {"footage": shutil.copy(footage, tmp_path), "packages": packages(tmp_path / "packages")}
    seen, console = tell("panning_story.py", backend, linked(tmp_path), **given)
    assert "Traceback" not in console
    facts = {name: entry[name] for entry in seen for name in entry}
    assert facts["panned"] == [["Sharp", "REGION", "Sharp", [1] * 8], ["Long", "NOTHING", "", [1] * 8]]
    assert facts["way"] == ["LOCATION", 6]
    steps = {entry["step"]: crop(tmp_path, entry) for entry in seen if "step" in entry}
    height = steps["2_tracked"].shape[0]
    tracked, panned, back, bars = (steps[name][: height * 3 // 4] for name in sorted(steps))  # above the bar editor
    assert np.abs(tracked - panned).max() > 100
    assert_alike(back, panned, tmp_path / "back_difference.png")
    assert np.abs(bars - back).max() > 30
    with open_source(footage) as source:
        apart = np.abs(pixels(tmp_path / "final_0070.png") - source.read(69)[..., :3])
    x, y = facts["stroke"]
    row, column = round((1 - y) * apart.shape[0]), round(x * apart.shape[1])
    assert apart[row - 2 : row + 3, column - 2 : column + 3].max() <= 40
    assert apart[:60].max() > 120


@pytest.mark.parametrize("backend", ["opengl", "vulkan"])
def test_what_is_seen_is_edited_and_nothing_of_the_deleted_stays(backend, tmp_path):
    """A strip cut by K, its right half moved away: bars, strokes and tab are those of the half under the playhead. Then
    both are deleted, in four ways: no stroke stays in the picture, and undo brings it back."""
    seen, console = tell("seen_story.py", backend, linked(tmp_path))
    assert "Traceback" not in console
    entries = {entry["picture"]: entry for entry in seen}
    shown = {name: pixels(tmp_path / f"{name}.png", entry["preview"]) for name, entry in entries.items()}
    tabs = {name: pixels(tmp_path / f"{name}.png", entry["tab"]) for name, entry in entries.items()}
    assert_alike(tabs["4_left_again"], tabs["2_left"], tmp_path / "tab_difference.png")
    assert np.abs(tabs["3_right"] - tabs["2_left"]).max() > 50
    assert np.abs(tabs["5_between"] - tabs["2_left"]).max() > 50
    for name in shown:
        if name.startswith("7_") and name != "7_scene_removed":  # whose strips Blender shows as missing
            assert_alike(shown[name], shown["9_plain"], tmp_path / f"{name}_difference.png")
        if name.startswith("8_"):
            assert_alike(shown[name], shown["6_before"], tmp_path / f"{name}_difference.png", 12)
    assert np.abs(shown["6_before"] - shown["9_plain"]).max() > 50


def test_a_mask_as_a_matte(tmp_path):
    """Drawn in Blender's mask editor, with two shape keys: shown at once, moved by a new shape key, and the same in the
    preview, in a render and by a Blender without a window. Sharp within it, long exposed without."""
    seen, console = tell("mask_story.py", "vulkan", linked(tmp_path))
    assert "Traceback" not in console
    assert "Error" not in next(entry["background"] for entry in seen if "background" in entry)
    steps = {entry["step"]: crop(tmp_path, entry) for entry in seen if "step" in entry}
    effect, matte, redo, earlier, dragged = (steps[name] for name in sorted(steps))
    assert_alike(redo, matte, tmp_path / "redo_difference.png")
    for before, after in ((effect, matte), (matte, earlier), (matte, dragged)):
        assert (np.abs(before - after).max(axis=2) > 30).mean() > 0.01
    final = pixels(tmp_path / "final.png")
    boxes = {entry["picture"]: entry.get("box") for entry in seen if "picture" in entry}
    for name, box in (("live", boxes["live"]), ("background_0055", None)):
        assert_alike(pixels(tmp_path / f"{name}.png", box), final, tmp_path / f"{name}_difference.png")
    light = film_light(54)
    height, width = final.shape[:2]
    inside = np.s_[int(0.35 * height) : int(0.65 * height), int(0.3 * width) : int(0.5 * width)]
    outside = np.s_[:, int(0.75 * width) :]
    for place, expected in ((inside, light[0]), (outside, light.mean(axis=0))):
        assert_alike(final[place], levels(expected[place]), tmp_path / "expected_difference.png")


def test_a_time_map(tmp_path):
    """By the menu, turned, made radial: as frames that are taken for each pixel and mixed in light."""
    seen, console = tell("time_map_story.py", "opengl", linked(tmp_path))
    assert "Traceback" not in console
    steps = {entry["step"]: crop(tmp_path, entry) for entry in seen if "step" in entry}
    effect, linear, redo, turned, radial, result, played = (steps[name] for name in sorted(steps))
    for before, after in ((effect, linear), (linear, turned), (turned, radial)):
        assert (np.abs(before - after).max(axis=2) > 10).mean() > 0.1
    assert_alike(redo, linear, tmp_path / "redo_difference.png")
    assert_alike(played, result, tmp_path / "played_difference.png")
    final, light = pixels(tmp_path / "final.png"), film_light(49)
    height, width = final.shape[:2]
    y, x = np.indices((height, width)) + 0.5
    time = np.hypot(x - width / 2, y - height / 2) / (np.hypot(width, height) / 2) * 7
    expected = np.zeros_like(light[0])
    for k, frame in enumerate(light):
        expected += np.maximum(1 - np.abs(time - k), 0)[..., None] * frame
    assert_alike(final, levels(expected), tmp_path / "expected_difference.png")


def film_light(first):
    """Eight frames of the film from one on, in linear light (8, H, W, 3)."""
    with open_source(ROOT / "assets" / "bigbuckbunny.mp4") as source:
        frames = np.stack([source.read(first + k)[..., :3] for k in range(8)]) / 255
    return np.where(frames <= 0.04045, frames / 12.92, ((frames + 0.055) / 1.055) ** 2.4)


def levels(light):
    """Linear light in 8-bit sRGB."""
    encoded = np.where(light <= 0.0031308, light * 12.92, 1.055 * light ** (1 / 2.4) - 0.055)
    return np.round(encoded * 255).astype(int)


def packages(folder):
    """A folder of what tracking needs besides what the Blender of a distribution has."""
    import cv2
    import scenedetect

    folder.mkdir()
    site = Path(cv2.__file__).parents[1]
    assert site == Path(scenedetect.__file__).parents[1]
    for name in ("cv2", "scenedetect", "click", "platformdirs", "tqdm", *(p.name for p in site.glob("opencv*.libs"))):
        (folder / name).symlink_to(site / name)
    return folder


def test_no_exception_reaches_the_console(told):
    _folder, _seen, console = told
    assert "Traceback" not in console
    assert "Error" not in console, console


def test_every_step_is_undone_and_redone(told):
    """Data is compared in the window; here, what the preview showed."""
    folder, seen, _console = told
    steps = {entry["step"]: entry for entry in seen if "step" in entry}
    repeated = [name for name in steps if name.endswith(("_undo", "_redo"))]
    assert len(repeated) == 14
    for name in repeated:
        first = name.rpartition("_")[0]
        if steps[name]["crop"][2:] != steps[first]["crop"][2:]:
            continue  # the sidebar, which is no data, was not open yet
        shown, before = (crop(folder, steps[step]) for step in (name, first))
        assert_alike(shown, before, folder / f"{name}_difference.png")


def test_every_step_changes_the_picture(told):
    folder, seen, _console = told
    steps = [entry for entry in seen if not entry.get("step", "_undo").endswith(("_undo", "_redo", "_loaded"))]
    assert len(steps) == 8
    shown = [crop(folder, entry) for entry in steps]
    for before, after, entry in zip(shown, shown[1:], steps[1:], strict=False):
        changed = before.shape != after.shape or (np.abs(before - after) > TOLERANCE).any()
        assert changed, f"{entry['step']} shows nothing new"


def test_a_loaded_file_shows_what_was_saved(told):
    folder, seen, _console = told
    steps = {entry["step"]: entry for entry in seen if "step" in entry}
    saved, loaded = (crop(folder, steps[name]) for name in ("8_key_later_redo", "9_loaded"))
    assert_alike(loaded, saved, folder / "loaded_difference.png")


def test_preview_and_render_agree(told):
    """With the live preview, without it, and as rendered by a job of its own."""
    folder, seen, _console = told
    boxes = {entry["picture"]: entry.get("box") for entry in seen if "picture" in entry}
    final = pixels(folder / "final.png")
    for name in ("live", "sequencer"):
        assert_alike(pixels(folder / f"{name}.png", boxes[name]), final, folder / f"{name}_difference.png")


def test_the_sequencers_own_animation_agrees(told):
    """View ▸ Render Sequencer Animation, for which the window waits."""
    folder, _seen, _console = told
    first, second = (pixels(path) for path in sorted(folder.glob("animation_*.png")))
    assert_alike(first, pixels(folder / "final.png"), folder / "animation_difference.png")
    assert np.abs(second - first).max() > TOLERANCE


def test_what_is_drawn_over_the_preview_agrees(told):
    """All but colours next to black: Blender keeps what is drawn in 8 bits, and shows them with a gamma of 2.2. What is
    drawn was composed in levels, which costs one of them."""
    folder, seen, _console = told
    box = next(entry["box"] for entry in seen if entry.get("picture") == "drawn")
    drawn, final = pixels(folder / "drawn.png", box), pixels(folder / "final.png")
    dark = final < 8
    assert dark.mean() < 0.2
    assert_alike(np.where(dark, 0, drawn), np.where(dark, 0, final), folder / "drawn_difference.png", TOLERANCE + 1)
    assert np.abs(drawn - final).max() <= 6


def crop(folder, entry):
    left, top, width, height = entry["crop"]
    return pixels(folder / f"{entry['step']}.png", (left, top, left + width, top + height))


def block_means(picture, side=8):
    """Of squares of the screen, however pictures are enlarged to it."""
    height, width = (length // side for length in picture.shape[:2])
    return picture[: height * side, : width * side].reshape(height, side, width, side, 3).mean(axis=(1, 3))


def test_previews_of_any_size_and_renders_after_them(tmp_path):
    """At 100, 50 and 25 %, in all views and by scopes; whatever was shown before, a render is the full picture. Playing
    keeps time."""
    seen, console = tell("preview_sizes_story.py", "opengl", linked(tmp_path))
    assert "Traceback" not in console
    steps = {entry["step"]: entry for entry in seen if "step" in entry}
    composed = {name: tuple(of_one) for name, entry in steps.items() for of_one in entry["composed"]}
    expected = dict.fromkeys(steps, (320, 180)) | {"at_100": (640, 360), "at_50": (640, 360), "engine": (1280, 720)}
    expected |= dict.fromkeys(("proxy_note", "proxy", "proxy_still", "proxy_by_blender", "after"), (320, 180, "proxy"))
    assert composed == expected | {"proxy_of_half": (640, 360, "proxy")}
    pictures = {name: crop(tmp_path, entry) for name, entry in steps.items()}
    for name, most in (("at_100", 2.5), ("at_50", 2.5), ("at_25", 4), ("image", 4), ("after", 6)):
        assert np.abs(pictures[name] - pictures["engine"]).mean() < most, name
    for name, other, most in (
        ("no_proxy_built", "at_25", 0.01),
        ("proxy_unused", "at_25", 0.01),
        ("proxy", "after", 1),
    ):
        assert np.abs(pictures[name] - pictures[other]).mean() < most, name
    assert np.abs(pictures["proxy"] - pictures["at_25"]).mean() > 2  # Blender's lose much
    ours, blenders = (block_means(pictures[name]) for name in ("proxy_still", "proxy_by_blender"))
    assert np.abs(ours - blenders).mean() < 1.5
    assert (pictures["waveform"] > 60).mean() > 0.05
    (played,) = (entry for entry in seen if "drawn" in entry)
    when, frames, composed = zip(*played["drawn"], strict=True)
    assert composed == tuple(frame - 1 for frame in frames)
    # On a software renderer few of the film's frames come in time. What is shown instead is the frame of that time.
    off = [(frame - frames[0]) / played["rate"] - (at - when[0]) for at, frame in zip(when, frames, strict=True)]
    assert len(when) > 5
    assert max(off) - min(off) < 1.2
    background = pixels(tmp_path / "background_0050.png")
    for name in ("job", "script", "script_again", "playing", "handler", "scene_strip", "job_after"):
        assert np.array_equal(pixels(tmp_path / f"{name}.png"), background), name
    for name in ("opengl", "opengl_job_0050"):
        assert_alike(pixels(tmp_path / f"{name}.png"), background, tmp_path / "opengl_difference.png")


@pytest.mark.parametrize("backend", ["opengl", "vulkan"])
def test_one_look_at_full_quality(backend, tmp_path):
    """From a preview that is composed at half size, by the button at its note: what F12 gives, pixel by pixel. It ends
    by a second click, with the frame, and with a change, and the view is as before."""
    seen, console = tell("full_quality_story.py", backend, linked(tmp_path))
    assert "Traceback" not in console
    steps = {entry["step"]: entry for entry in seen if "step" in entry}
    composed = {name: entry["composed"] for name, entry in steps.items()}
    assert composed == {name: [[640, 360]] for name in steps} | {"full": [[1280, 720]]}
    for name in ("back", "next", "changed"):
        assert steps[name]["view"] == pytest.approx(steps["before"]["view"], abs=1.1), name
    assert np.abs(crop(tmp_path, steps["back"]) - crop(tmp_path, steps["before"])).mean() < 1
    full, final = pixels(tmp_path / "full.png"), pixels(tmp_path / "final.png")
    left, top, width, height = steps["full"]["crop"]
    x, y = steps["full"]["middle"]
    rows, columns = (top + 90, top + height - 40), (left + width // 2 + 60, left + width - 80)  # beside notes and bars
    patch = full[slice(*rows), slice(*columns)]
    # Where the view lies on the picture Blender tells to a pixel.
    places = [(rows[0] - y + 360 + down, columns[0] - x + 640 + right) for down in (0, 1) for right in (-1, 0)]
    parts = [final[row : row + patch.shape[0], column : column + patch.shape[1]] for row, column in places]
    assert min(np.abs(patch - part).max() for part in parts) <= TOLERANCE


@pytest.mark.parametrize("backend", ["opengl", "vulkan"])
def test_too_few_frames_for_a_streak(backend, tmp_path):
    """Said in the preview, with a button that builds what the strip needs, by which the steps go; undone and redone."""
    given = {"packages": packages(tmp_path / "packages")}
    seen, console = tell("strobing_story.py", backend, linked(tmp_path), **given)
    assert "Traceback" not in console
    steps = {entry["step"]: entry for entry in seen if "step" in entry}
    found = {name: (entry["factor"], entry["bars"], entry["label"] is None) for name, entry in steps.items()}
    stepped, smooth = ("1", [8, 8], False), ("4", [32, 32], True)
    assert found == {"1_steps": stepped, "2_smooth": smooth, "3_undone": stepped, "4_redone": smooth}
    for name in ("1_steps", "3_undone"):
        assert steps[name]["label"] == "4× In-Between Frames", name
    before, after = (crop(tmp_path, steps[name])[120:280] for name in ("1_steps", "2_smooth"))  # the picture alone
    assert detail(after) < 0.8 * detail(before)


@pytest.mark.parametrize("backend", ["opengl", "vulkan"])
def test_what_is_needed_first_is_above_the_fold(backend, tmp_path):
    """In the default layout; the region's shutter is chosen there by the story. And no sentence beneath is cut."""
    given = {"packages": packages(tmp_path / "packages")}
    seen, console = tell("fold_story.py", backend, linked(tmp_path), **given)
    assert "Traceback" not in console
    assert [entry["step"] for entry in seen] == ["en_US_1.0", "en_US_1.5", "de_DE_1.0", "de_DE_1.5"]
    wanted = ("draw()", "track(direction='BOTH')", "panning_shot()", "tripod()")
    for entry in seen:
        assert {f"bpy.ops.shutter.{name}" for name in wanted} <= set(entry["buttons"]), entry["step"]
        unit = float(entry["step"][-3:])
        sentences = crop(tmp_path, entry)[entry["below"] + round(15 * unit) : round(-15 * unit)]
        assert not ellipses(sentences, unit), entry["step"]


def ellipses(picture, unit):
    """Where Blender has cut a text: columns and rows of three dots beside each other, of bright text in pixels."""
    bright = (picture.min(axis=2) > 110).astype(np.uint8)
    _count, _labels, boxes, _centres = cv2.connectedComponentsWithStats(bright)
    dots = [(x, y) for x, y, width, height, _area in boxes[1:] if max(width, height) <= 3 * unit]
    return [
        (x, y) for x, y in dots if sum(abs(low - y) <= 1 and 0 <= right - x <= 12 * unit for right, low in dots) >= 3
    ]


def detail(picture):
    """How much neighbours along a row differ beyond what a smooth slope does."""
    return np.abs(np.diff(picture, 2, axis=1)).mean()


def test_renders_that_end_early(tmp_path):
    """A picture that fails ends the job, as Esc does: the movie is finished up to there, and a menu says why."""
    seen, console = tell("failing.py", "opengl", linked(tmp_path))
    ends = {entry["output"]: entry["ended"] for entry in seen if "output" in entry}
    assert ends == {
        "film.mp4": ["render_cancel"],
        "folder": ["render_cancel"],
        "stopped.mp4": ["render_cancel"],
        "after.mp4": ["render_complete"],
    }
    assert whole_pictures(tmp_path / "film.mp4") == 14
    assert len(list((tmp_path / "folder").iterdir())) == 14
    assert 1 <= whole_pictures(tmp_path / "stopped.mp4") < 185
    assert whole_pictures(tmp_path / "after.mp4") == 5
    assert console.count("Virtual Shutter: f0015.png: no such file") == 2
    assert "Traceback" not in console
    (scenes,) = (entry["scenes"] for entry in seen if "scenes" in entry)
    assert len(scenes) == 2
    assert [entry["shown"][0] for entry in seen if "shown" in entry] == [[360, 640, 4]]


@pytest.mark.parametrize("backend", ["opengl", "vulkan"])
@pytest.mark.parametrize("part", ["first", "second", "rendered", "modal", "handler", "current"])
def test_blender_lives_where_its_gpu_is_not_current(part, backend, tmp_path):
    """Whatever lets go of what it holds there, by whoever; and the preview is the same afterwards."""
    path = tmp_path / "recipe.json"
    line = {"shutter": "Sharp", "strokes": [[[0.2, 0.2], [0.6, 0.9]]], "width": 0.1}
    shutters = [{"name": "Long", "bars": [1] * 6}, {"name": "Sharp", "bars": [1] + [0] * 5}]
    path.write_text(json.dumps({"version": 1, "window": 6, "border": True, "shutters": shutters, "regions": [line]}))
    seen, console = tell("gpu_life_story.py", backend, linked(tmp_path), recipe=path, part=part)
    assert "Traceback" not in console
    assert {entry["lost"] for entry in seen} == {part != "current"}
    assert ("Blender's GPU cannot be used until a window is drawn" in console) == (part == "second")
    assert not (tmp_path / "refused.png").exists()
    pictures = [pixels(tmp_path / f"{name}.png", (300, 54, 900, 380)) for name in ("before", "after")]
    assert_alike(*pictures, tmp_path / "difference.png", tolerance=0)


@pytest.mark.parametrize(("backend", "hidden"), [("opengl", ""), ("vulkan", ""), ("vulkan", "moderngl")])
def test_esc_ends_a_render_between_two_passes(backend, hidden, tmp_path):
    """And the render's window shows the frame that was made. What is rendered afterwards is as ever."""
    shutters = [{"name": "Long", "bars": [1] * 8}, {"name": "Sharp", "bars": [1, *[0] * 7]}]
    line = {"name": "Line", "shutter": "Sharp", "strokes": [[[0.4, 0.3], [0.45, 0.6]]], "width": 0.02}
    data = {"version": 1, "window": 8, "border": True, "edge_aware": 1, "shutters": shutters, "regions": [line]}
    path = tmp_path / "recipe.json"
    path.write_text(json.dumps(data))
    seen, console = tell("stopping_story.py", backend, linked(tmp_path), recipe=path, hidden=hidden)
    assert "Traceback" not in console
    (ended,) = seen
    assert ended["whole"] > 300
    assert ended["after"] <= 5
    assert ended["finished_after"] == 0
    screen, written = pixels(tmp_path / "render_window.png"), sorted((tmp_path / "film").iterdir())
    assert min(apart_on_screen(screen, pixels(frame)) for frame in written) <= TOLERANCE
    for frame in (tmp_path / "after").iterdir():
        assert np.array_equal(pixels(frame), pixels(tmp_path / "film" / frame.name))


def apart_on_screen(screen, frame):
    """By how many levels the middle of a frame differs at most from where a screen shows it, pixel for pixel."""
    import cv2

    height, width = frame.shape[:2]
    middle = frame[height // 4 : 3 * height // 4, width // 4 : 3 * width // 4].astype(np.uint8)
    near = cv2.matchTemplate(screen.astype(np.uint8), middle, cv2.TM_SQDIFF)
    top, left = np.unravel_index(near.argmin(), near.shape)
    shown = screen[top : top + middle.shape[0], left : left + middle.shape[1]]
    return np.abs(shown - middle).max()


@pytest.mark.parametrize(("backend", "hidden"), [("opengl", "moderngl"), ("vulkan", "")])
def test_a_film_shows_what_was_when_it_began(backend, hidden, tmp_path):
    """200 changes while a film renders, at the end the strip deleted: no frame is another one before, and then the
    frames are those without it. So with the source deleted, and a single picture. A film ends where the effect's scene
    is deleted, and by undo, even while it waits for Blender's main thread. On OpenGL, and on Blender's own GPU."""
    seen, console = tell("stress.py", backend, linked(tmp_path), hidden=hidden)
    assert ("composing on Blender's own GPU" in console) == bool(hidden)
    assert "Traceback" not in console
    films = {entry["film"]: entry for entry in seen}
    ended = {name: film["ended"] for name, film in films.items()}
    assert ended == dict.fromkeys(("alone", "stressed", "after", "source", "picture"), "complete") | dict.fromkeys(
        ("scene", "undone", "asking"), "cancelled"
    )
    assert console.count('Virtual Shutter: the scene of "Shutter" was deleted') == 1
    pictures = {name: {p.name: pixels(p) for p in (tmp_path / name).iterdir()} for name in films}
    alone, stressed, after = (pictures[name] for name in ("alone", "stressed", "after"))
    assert len(alone) == len(stressed) == len(after) == 90
    names = sorted(alone)
    assert_same(pictures["source"], alone, names)
    assert_same(pictures["picture"], alone, ["0020.png"])
    assert_same(stressed, alone, names[:67])
    assert_same(stressed, after, names[67:])
    assert not any(np.array_equal(alone[name], after[name]) for name in names)


def assert_same(film, expected, names):
    """These frames are there and are the expected ones, bit for bit."""
    different = [name for name in names if not np.array_equal(film[name], expected[name])]
    assert not different
