"""Scripts that compare pictures with the truth: each on few small ones, and one sentence for what is not there."""

import json
import runpy
import subprocess
import sys

import pytest

from gallery.item import ROOT

pytest.importorskip("bpy")
sys.path.append(str(ROOT / "scripts"))
import carried_mattes
import outline_scenes


def rows_of(name, folder, *options):
    command = [sys.executable, f"scripts/{name}.py", *map(str, options), "--json", folder / "rows.json"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads((folder / "rows.json").read_text())


def measured(folder, code):
    """What code prints as JSON, in a process of its own: an empty scene would take other tests' edits away."""
    head = "import json, sys\nfrom pathlib import Path\nsys.path.insert(1, 'scripts')\nfolder = Path(sys.argv[1])\n"
    done = subprocess.run([sys.executable, "-c", head + code, folder], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.parametrize(
    ("name", "options", "sentence"),
    [
        ("quality", ["none.mp4"], "quality: none.mp4: no such file"),
        ("inbetween_quality", ["--films", "none.mp4", "--parts", "films"], "inbetween_quality: none.mp4: no such file"),
        ("truth", ["--samples", "100"], "truth.py: error: --samples: 100 is not a multiple of 64"),
    ],
)
def test_what_cannot_be_measured_is_one_sentence(name, options, sentence, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", [f"{name}.py", *options])
    with pytest.raises(SystemExit) as stop:
        runpy.run_path(f"{ROOT}/scripts/{name}.py", run_name="__main__")
    assert stop.value.code == 2
    assert capsys.readouterr().err.splitlines()[-1].startswith(sentence)


def test_a_shutter_over_subframes_is_the_exposure_that_cycles_computes(tmp_path):
    """And a wrong one is not. At so few samples and pixels, Cycles' noise leaves 0.99 of the similarity."""
    found = rows_of("truth", tmp_path, "--output", tmp_path, "--size", "96x64", "--samples", "512")
    assert {file.name for file in tmp_path.iterdir()} == {"rows.json", "truth.png"}
    for case in ("box", "triangle", "rolling"):
        rows = {row["picture"]: row for row in found if row["case"] == case}
        assert 1 > rows["ours"]["similarity"] > 0.99 > rows["wrong"]["similarity"]
        assert rows["ours"]["mean"] < 1 < rows["wrong"]["mean"]


def test_sped_up_footage_is_blurred_as_cycles_own(tmp_path):
    """With Length: Timeline. Its streak is as long within a quarter of a pixel, which is how far moments lie apart."""
    options = "--output", tmp_path, "--frames", "1", "--size", "320x180", "--samples", "128"
    rows = {(row["case"], row["picture"]): row for row in rows_of("timeline_truth", tmp_path, *options)}
    for case in ("eight times", "ramp"):
        assert rows[case, "timeline"]["similarity"] >= 0.97
        assert rows[case, "timeline"]["length"] == pytest.approx(rows[case, "timeline"]["truth"], abs=0.25)
    assert rows["ramp", "bars"]["similarity"] < 0.95
    assert rows["ramp", "bars"]["length"] > 2 * rows["ramp", "bars"]["truth"]
    assert (tmp_path / "timeline_truth.png").exists()


def test_rolling_shutter_repair_is_cycles_picture_of_all_rows_at_once(tmp_path):
    options = "--output", tmp_path, "--readouts", "50", "--size", "240x136", "--samples", "32"
    rows = rows_of("rolling_truth", tmp_path, *options)
    assert len(rows) == 3
    for row in rows:
        assert row["psnr"] >= 32
        assert row["psnr"] >= row["unrepaired"] + 3
        assert row["bent"] <= 0.5 < row["skewed"]
        assert float(row["found"].removesuffix(" %")) == pytest.approx(50, rel=0.1)
    assert (tmp_path / "rolling_truth.png").exists()


def test_blocks_that_share_a_shutter_look_like_full_resolution(tmp_path):
    """By the structural similarity that the paper obtained."""
    rows = rows_of("quality", tmp_path, "--frames", "1")
    films = "assets/pedestrians.avi", "--frames", "1", "--windows", "64", "--bars", "preset"
    rows += rows_of("quality", tmp_path, *films)
    assert {row["film"] for row in rows} == {"bigbuckbunny.mp4", "pedestrians.avi"}
    assert {(row["bars"], row["window"]) for row in rows} == {("preset", 16), ("random", 16), ("preset", 64)}
    for row in rows:
        assert 0.9982 <= row["mean"] < 1, row
        assert 0.9777 <= row["worst"] < 1, row


def test_coefficients_that_follow_edges_change_by_less_than_a_level(tmp_path):
    options = "--frames", "2", "--aggregate", "4", "--noise", "8", "--films", "pedestrians.avi"
    rows = {row["guide"]: row for row in rows_of("edge_flicker", tmp_path, *options)}
    assert rows["steadied"]["still"] > 0.5
    assert 0 < rows["steadied"]["mean"] < min(rows["alone"]["mean"], 1)


LAYERS = """
import layer_truth as truth
scene = truth.SCENES[0]
case = truth.render(scene, folder / "parts", (160, 90), samples=8)
print(json.dumps(truth.measure(case, folder)))
"""


def test_layers_are_near_the_truth(tmp_path):
    found = {(row["picture"], row["way"]): row for row in measured(tmp_path, LAYERS)}
    for picture in ("sharp subject", "clean trail"):
        ways = "without the switch", "layer, true matte", "layer, Cryptomatte"
        before, after, cryptomatte = (found[picture, way] for way in ways)
        assert before["ring"] < 30
        assert min(after["ring"], cryptomatte["ring"]) >= 36
        assert after["same bits elsewhere"]
    assert found["clean trail", "layer, true matte"]["plate"] >= 40


ONE_STROKE = """
from dataclasses import replace
import one_stroke, one_stroke_scenes as truth
scene = replace(truth.SCENES[0], board=lambda frame: truth.across(18 + frame), start=3)
truth.render(scene, folder, (160, 90), count=5, samples=2)
keyed = one_stroke.tracked(scene, folder)
masks = one_stroke.Masks(folder, keyed)
found = {way: masks.overlap(way)["worst"] for way in ("one stroke", "without edges")}
print(json.dumps(one_stroke.motion(scene, folder, keyed) | found))
"""


def test_one_stroke_is_the_subject(tmp_path):
    found = measured(tmp_path, ONE_STROKE)
    assert found["tracked"] == found["seen"] == 5
    assert found["error"] < 1
    assert found["wrong_but_sure"] == 0
    assert found["one stroke"] > 0.9
    assert found["without edges"] < 0.8


PANNING = """
import following_truth as truth
truth.pan_scene.SIZE = 240, 135
truth.pan_scene.COUNT, truth.pan_scene.FRAME, truth.pan_scene.WINDOW = 11, 6, 9
print(json.dumps(truth.panning(folder, samples=16)))
"""


def test_a_panning_shot_is_what_a_panning_camera_takes(tmp_path):
    found = {row.pop("picture"): row for row in measured(tmp_path, PANNING)}
    assert found["following"]["part"] > 0.95 > 0.7 > found["plain exposure"]["part"]
    assert found["following"]["all"] > 0.93 > found["a single frame"]["all"]
    assert found["following"]["detail"] > 0.85 > found["plain exposure"]["detail"]


HANDHELD = """
import following_truth as truth
from gallery import scenes
scenes.SIZE, truth.tripod_scene.COUNT, truth.tripod_scene.FRAME = (384, 216), 5, 3
print(json.dumps(truth.handheld(folder)))
"""


def test_following_the_camera_is_a_tripod(tmp_path):
    *rows, track = measured(tmp_path, HANDHELD)
    similar = {row["picture"]: row["part"] for row in rows}
    assert similar["following"] > 0.97 > 0.95 > similar["plain exposure"]
    assert track["off"] < 1
    assert 0.7 < track["seen"] < 0.99


@pytest.mark.parametrize(("name", "most"), [("walking", 6), ("moving camera", 6), ("blurred", 10), ("occluded", 8)])
def test_mattes_carried_between_outlines(name, most, monkeypatch):
    """That are ten frames apart, beside flow alone and the true alpha."""
    monkeypatch.setattr(outline_scenes, "COUNT", 11)
    scene = next(scene for scene in outline_scenes.SCENES if scene.name == name)
    frames, alphas = map(list, zip(*outline_scenes.frames(scene), strict=True))
    alone, found, levels, _seconds = carried_mattes.measured(frames, alphas, 10)
    assert found >= alone + 0.05
    assert levels <= most
