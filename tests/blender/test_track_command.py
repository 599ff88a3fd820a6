"""The command `track`: from a recipe to the same recipe with keys."""

import json
import os
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from support import ROOT, recipe, write_frames

from shutter_addon.core.model import motions
from shutter_addon.core.model.keyframes import Constant
from shutter_addon.core.recipes import recipe_file
from shutter_addon.features.tracking import camera_tracking, tracking

WIDTH, HEIGHT, COUNT = 160, 120, 12
CROSS = [[[0.35, 0.5], [0.65, 0.5]], [[0.5, 0.35], [0.5, 0.65]]]


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    """A textured wall that goes 3 pixels to the right and 1 up with every frame, on images."""
    wall = np.random.default_rng(5).integers(0, 256, (40, 50, 3)).repeat(5, 0).repeat(5, 1).astype(np.uint8)
    views = [wall[20 + n : 20 + n + HEIGHT, 60 - 3 * n : 60 - 3 * n + WIDTH] for n in range(COUNT)]
    return write_frames(tmp_path_factory.mktemp("wall"), np.stack(views))


@pytest.fixture
def track(run, tmp_path):
    """Runs the command in this process: its exit code, and what it says on stderr."""

    def tracked(source, *arguments, **given):
        (tmp_path / "recipe.json").write_text(json.dumps(given.pop("recipe", plain())))
        code, said = run("track", source, "--recipe", tmp_path / "recipe.json", *arguments)
        return code, said.strip()

    return tracked


def plain(**region):
    fields = {"name": "cross", "shutter": "S1", "kind": "line", "strokes": CROSS}
    return recipe(2, [1, 1], [1, 0], regions=[{"shutter": "S0", "strokes": [[[0, 0]]]}, fields | region])


def said(path):
    """What a recipe's file says."""
    text = recipe_file.dump(recipe_file.load(path))
    return json.loads(text, object_hook=lambda fields: SimpleNamespace(**fields))


def keys(path):
    return getattr(said(path).regions[1], "keys", [])


def expected(frame, start=5):
    return 3 * (frame - start) / WIDTH, 1 * (frame - start) / HEIGHT


def test_the_recipe_gets_the_keys_that_the_motion_needs(track, film, tmp_path):
    output, report = tmp_path / "out" / "tracked.json", tmp_path / "report.json"
    assert track(film, "--region", "cross", "--frame", 5, "--output", output, "--report", report) == (0, "")
    found = keys(output)
    assert [key.frame for key in found] == [1, 5, 12]
    assert (found[1].location, found[1].rotation, found[1].scale) == ([0, 0], 0, 1)
    for key in found:
        assert key.location == pytest.approx(expected(key.frame), abs=0.3 / WIDTH)
        assert (key.rotation, key.scale) == (pytest.approx(0, abs=0.3), pytest.approx(1, abs=0.005))
    told = json.loads(report.read_text())
    assert [each["frame"] for each in told["frames"]] == list(range(1, COUNT + 1))
    assert all(each["confidence"] > tracking.SURE for each in told["frames"])
    assert told["stops"] == []
    before, after = said(tmp_path / "recipe.json"), said(output)
    assert (after.shutters, after.regions[0]) == (before.shutters, before.regions[0])


def test_every_key_is_kept_on_demand_and_only_in_those_frames(track, film, tmp_path):
    given = plain(keys=[{"frame": n, "location": [0.5, 0.5], "ease": "bezier"} for n in (2, 6.5, 11)])
    given["regions"][1]["keys"][1]["location"] = [0, 0]
    options = ("--region", "cross", "--frame", 6, "--frames", "4:8", "--motion", "location", "--all-keys")
    assert track(film, *options, "--output", tmp_path / "t.json", recipe=given) == (0, "")
    found = keys(tmp_path / "t.json")
    assert [key.frame for key in found] == [2, 3, 4, 5, 6, 7, 8, 11]
    assert (found[0].ease, found[0].location, found[-1].location) == ("bezier", [0.5, 0.5], [0.5, 0.5])
    assert {key.scale for key in found} == {1.0}
    # at frame 6, and at the keys that were not tracked, it is where the keys had put it
    effects = (recipe_file.load(tmp_path / name).for_picture(WIDTH / HEIGHT) for name in ("recipe.json", "t.json"))
    before, after = (effect.regions[1].moves.location for effect in effects)
    for frame in (1, 2, 6, 11, 12):
        assert after.at(frame) == pytest.approx(before.at(frame)), frame


def test_a_redrawn_shape_stays_drawn_as_it_was_and_on_what_it_covers(track, film, tmp_path):
    other = [[[0.5, 0.4], [0.7, 0.6]]]
    given = plain(keys=[{"frame": 4}, {"frame": 8, "strokes": other, "ease": "bezier"}])
    assert track(film, "--region", "cross", "--frame", 5, "--output", tmp_path / "t.json", recipe=given) == (0, "")
    files = tmp_path / "t.json", tmp_path / "recipe.json"
    shapes = [recipe_file.load(path).for_picture(WIDTH / HEIGHT).regions[1] for path in files]
    for frame in range(1, COUNT + 1):
        after, was = (np.concatenate(shape.drawings.at(frame)) for shape in shapes)
        assert after == pytest.approx(was, abs=1e-6)
        since = motions.centre(shapes[0].drawings.at(frame)) - motions.centre(shapes[0].drawings.at(5))
        assert since + shapes[0].moves.location.at(frame) == pytest.approx(expected(frame), abs=1.2 / WIDTH)


@pytest.mark.parametrize(("subject", "start"), [("region", 1), ("camera", 20), ("region", 31)])
def test_between_filmed_frames_it_goes_straight(track, film, tmp_path, subject, start):
    """From frame to frame by a quarter of a filmed one's time, as moments do; from one of these as well. The region is
    redrawn meanwhile."""
    moved = [[[0.45, 0.5], [0.75, 0.5]], [[0.6, 0.35], [0.6, 0.65]]]
    given = plain(keys=[{"frame": 1}, {"frame": 30, "strokes": moved}])
    given |= {"inbetween": 4, "time": [{"frame": 1, "value": 1}, {"frame": 45, "value": 12}]}
    options = ("--region", "cross") if subject == "region" else ("--camera",)
    options += ("--frame", start, "--all-keys", "--output", tmp_path / "t.json")
    if subject == "camera":
        given["regions"] = []
    assert track(film, *options, recipe=given) == (0, "")
    effect = recipe_file.load(tmp_path / "t.json").for_picture(WIDTH / HEIGHT)
    moving = effect.regions[1] if subject == "region" else effect.camera
    places = {frame: np.add(moving.placement(frame).location, moving.centre(frame)) for frame in range(1, 46)}
    for frame, place in places.items():
        assert place - places[start] == pytest.approx(expected(frame / 4, start / 4), abs=0.3 / WIDTH), frame


def test_what_is_shown_twice_is_tracked_once(track, film, tmp_path):
    """There and back through the same frames, and a jump of four of them."""
    keyed = [{"frame": n, "value": v, "ease": "linear"} for n, v in ((1, 6), (11, 11), (23, 5), (24, 1))]
    given = plain() | {"time": keyed, "inbetween": 2}
    options = ("--region", "cross", "--frame", 1, "--all-keys", "--report", tmp_path / "r.json")
    assert track(film, *options, "--output", tmp_path / "t.json", recipe=given) == (0, "")
    found = {key.frame: key.location for key in keys(tmp_path / "t.json")}
    for frame, index in ((11, 11), (23, 5), (24, 1), (10, 10.5), (13, 10)):
        assert found[frame] == pytest.approx(expected(index, 6), abs=0.4 / WIDTH)


@pytest.mark.parametrize("between", ["carried", "straight"])
def test_an_outline_gets_keys_of_what_it_encloses(track, film, tmp_path, between):
    box = [[[0.35, 0.35], [0.65, 0.35], [0.65, 0.65], [0.35, 0.65]]]
    given = plain(kind="outline", strokes=box, between=between)
    options = ("--region", "cross", "--frame", 5, "--motion", "location", "--all-keys")
    assert track(film, *options, "--output", tmp_path / "t.json", recipe=given) == (0, "")
    found = keys(tmp_path / "t.json")
    assert [key.frame for key in found] == list(range(1, COUNT + 1))
    for key in found:
        assert key.location == pytest.approx(expected(key.frame), abs=1 / WIDTH)
    assert said(tmp_path / "t.json").regions[1].strokes == box


@pytest.mark.parametrize(
    ("shown", "last"), [({}, 6), ({"inbetween": 4, "time": [{"frame": 1, "value": 1}, {"frame": 45, "value": 12}]}, 23)]
)
def test_where_it_ends_is_said(track, tmp_path, shown, last):
    rng = np.random.default_rng(1)
    shots = [rng.integers(0, 256, (12, 16, 3), dtype=np.uint8).repeat(10, 0).repeat(10, 1) for _ in range(2)]
    first = write_frames(tmp_path / "two", np.stack([shots[n // 6] for n in range(12)]))
    options = ("--region", "cross", "--frame", 3, "--output", tmp_path / "t.json", "--report", tmp_path / "r.json")
    code, said = track(first, *options, recipe=plain() | shown)
    assert (code, said) == (0, f"Virtual Shutter: cross: not tracked from frame {last + 1} on: {tracking.SHOT_ENDS}")
    assert json.loads((tmp_path / "r.json").read_text())["stops"] == [{"frame": last + 1, "reason": tracking.SHOT_ENDS}]
    region = recipe_file.load(tmp_path / "t.json").for_picture(4 / 3).regions[1]
    assert [region.opacity.at(frame) for frame in (1, last, last + 1, 99)] == [1, 1, 0, 0]
    assert [key.frame for key in keys(tmp_path / "t.json")] == [1, 3, last]
    assert track(first, *options, "--hold", recipe=plain(keys=[{"frame": 1}, {"frame": last + 3}]) | shown)[0] == 0
    assert recipe_file.load(tmp_path / "t.json").regions[1].opacity == Constant(1.0)
    assert keys(tmp_path / "t.json")[-1].frame == last + 3


def test_opacities_that_a_recipe_has_stay(track, film, tmp_path):
    faded = [{"frame": 1, "value": 0.0}, {"frame": 4, "value": 0.5, "ease": "constant"}, {"frame": 8, "value": 0.0}]
    options = "--region", "cross", "--frame", 8, "--frames", "7:10", "--output", tmp_path / "o.json"
    assert track(film, *options, recipe=plain(opacity=faded))[0] == 0
    before, after = (said(tmp_path / name).regions[1].opacity for name in ("recipe.json", "o.json"))
    assert before == after


def test_bad_input_is_one_sentence_and_writes_nothing(track, film, tmp_path):
    flat = write_frames(tmp_path / "flat", np.full((3, HEIGHT, WIDTH, 3), 90, np.uint8))
    one = write_frames(tmp_path / "one", np.zeros((1, HEIGHT, WIDTH, 3), np.uint8))
    cross, output = ("--region", "cross"), tmp_path / "t.json"
    far = plain(strokes=[[[5, 5], [6, 6]]])
    for source, options, given, end in (
        (flat, (*cross, "--frame", 2), plain(), tracking.FEW),
        (one, (*cross, "--frame", 1), plain(), tracking.ALONE),
        (film, (*cross, "--frame", 3), far, tracking.OUTSIDE),
        (flat, ("--camera", "--frame", 2), plain(), f"camera: {camera_tracking.BARE}"),
        (film, ("--frame", 3), plain(), "track: give either --region NAME or --camera"),
        (film, (*cross, "--camera", "--frame", 3), plain(), "track: give either --region NAME or --camera"),
        (film, ("--region", "circle", "--frame", 3), plain(), 'there is no region "circle"'),
        (film, (*cross, "--frame", 13), plain(), "--frame: 13 is not within the frames 1:12"),
        (film, (*cross, "--frame", 3, "--frames", "4:9"), plain(), "--frame: 3 is not within the frames 4:9"),
        (film, (*cross, "--frame", 3, "--frames", "4:99"), plain(), "4:99 is not within the clip's frames 1:12"),
        (tmp_path / "none.mp4", (*cross, "--frame", 3), plain(), f"none.mp4: no such file in {tmp_path}"),
    ):
        code, said = track(source, *options, "--output", output, recipe=given)
        assert code == 2
        assert said.startswith("Virtual Shutter: ")
        assert said.endswith(end)
        assert "\n" not in said
        assert not output.exists()


def test_the_camera_gets_keys_that_a_shutter_follows(track, film, tmp_path):
    given = plain(strokes=[[[0.5, 0.5]]]) | {"camera": [{"frame": 20, "location": [0.5, 0]}]}
    options = ("--camera", "--frame", 5, "--output", tmp_path / "t.json", "--report", tmp_path / "r.json")
    assert track(film, *options, recipe=given) == (0, "")
    before, after = (said(tmp_path / name) for name in ("recipe.json", "t.json"))
    camera = recipe_file.load(tmp_path / "t.json").camera
    shift = np.subtract(camera.placement(12).location, camera.placement(1).location)
    assert shift == pytest.approx(expected(12, 1), abs=0.3 / WIDTH)
    assert camera.placement(5).location == (0.5, 0), "as it was"
    assert [key.frame for key in after.camera] == [1, 5, 12, 20]
    assert (after.regions, after.shutters) == (before.regions, before.shutters)
    told = json.loads((tmp_path / "r.json").read_text())
    assert (told["camera"], "region" in told, len(told["frames"])) == (True, False, COUNT)
    assert track(film, *options, "--all-keys", recipe=given) == (0, "")
    assert [key.frame for key in said(tmp_path / "t.json").camera] == [*range(1, COUNT + 1), 20]


def test_what_is_read_is_not_written_over(track, film, tmp_path):
    """Neither file is written if one cannot be."""
    code, said = track(film, "--region", "cross", "--frame", 3, "--output", tmp_path / "recipe.json")
    assert (code, "which is read" in said) == (2, True)
    assert keys(tmp_path / "recipe.json") == []
    same = ("--output", tmp_path / "t.json", "--report", tmp_path / "t.json")
    assert track(film, "--region", "cross", "--frame", 3, *same)[0] == 2
    (tmp_path / "folder").mkdir()
    code, said = track(film, "--region", "cross", "--frame", 3, *same[:3], tmp_path / "folder")
    assert (code, said.count("\n")) == (2, 0)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["folder", "recipe.json"]


def test_a_process_with_one_thread_writes_the_same_bytes(track, film, tmp_path):
    options = ["--region", "cross", "--frame", "5", "--all-keys", "--output"]
    assert track(film, *options, tmp_path / "a.json")[0] == 0
    arguments = ["track", film, "--recipe", tmp_path / "recipe.json", *options, tmp_path / "b.json"]
    command = [sys.executable, "-m", "shutter_addon", *map(str, arguments)]
    subprocess.run(command, cwd=ROOT, env=os.environ | {"OPENCV_FOR_THREADS_NUM": "1"}, check=True)
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()
