"""The gallery: recipes load, items are listed without Blender, and one is made from end to end."""

import dataclasses
import re
import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from OpenImageIO import ImageBuf

from gallery import NAMES, bunny, rolling_repair, stills, time_map
from gallery.item import ASSETS, HERE, ROOT, Shot
from gallery.matte_contents import with_contents
from shutter_addon.compute.renderer import Renderer, open_compositor
from shutter_addon.compute.request import Request
from shutter_addon.core.frames import light
from shutter_addon.core.model.clip import Clip
from shutter_addon.core.model.shutters import displace
from shutter_addon.core.model.state_at import state_at
from shutter_addon.core.recipes import recipe_file
from shutter_addon.media import open_source
from shutter_addon.media.matte_values import MatteValues

SCRIPT = str(ROOT / "scripts" / "gallery.py")
# Where on the bunny's picture: rows and columns.
HEAD, ARM, MEADOW = np.s_[130:230, 430:530], np.s_[110:230, 250:330], np.s_[500:700, 900:1200]


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        ([], 0, "".join(f"{name} .*\n" for name in NAMES)),
        (["bunny", "nothing"], 2, "gallery: there is no nothing; there are pendulum, .*\n"),
        (["--output", "file", "bunny"], 2, "gallery: .*file/bunny: Not a directory\n"),
    ],
)
def test_names_need_no_blender(arguments, code, said, tmp_path, monkeypatch, capsys):
    (tmp_path / "file").touch()
    monkeypatch.chdir(tmp_path)
    for module in [name for name in sys.modules if name.startswith("gallery.")]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.setitem(sys.modules, "bpy", None)
    monkeypatch.setattr(sys, "argv", [SCRIPT, *arguments])
    with pytest.raises(SystemExit) as stop:
        runpy.run_path(SCRIPT, run_name="__main__")
    assert (stop.value.code or 0) == code
    told = capsys.readouterr()
    assert re.fullmatch(said, told.err if code else told.out)


@pytest.mark.parametrize("path", sorted(HERE.glob("*.json")), ids=lambda path: path.stem)
def test_recipes_load(path):
    assert path.stem.split("-")[0] in NAMES
    assert recipe_file.load(path).shutters


def test_the_repair_shows_rows_of_as_much_time_as_the_camera_reads():
    """From half a readout before the shown frame, in steps of a moment, to as long behind it."""
    effect = with_contents(recipe_file.load(HERE / "rolling_repair.json").for_picture(16 / 9))
    steps = effect.options.at(1).step
    moment = state_at(effect, Clip(16, 9, rolling_repair.COUNT).stepped(steps), rolling_repair.FRAME)
    rows = np.linspace(-0.5, 0.5, 5) / effect.regions[0].moves.scale.at(1)
    shares = displace(moment.state.bars, np.stack([0.5 - rows, 0.5 + rows], axis=-1))
    times = shares @ np.arange(shares.shape[1]) - moment.state.options.before
    assert times / steps == pytest.approx(rolling_repair.READOUT * np.linspace(-0.5, 0.5, 5), abs=1e-6)
    assert (shares > 0).sum(axis=1).max() == 2


def test_an_item_from_end_to_end(tmp_path, monkeypatch):
    """Into a folder of the caller's.

    Its head and the meadow are the source's, within what a movie's compression takes; its arms are not.
    """
    make = runpy.run_path(SCRIPT)["make"]
    monkeypatch.chdir(tmp_path.parent)
    frames = bunny.FRAME, bunny.FRAME + 1
    assert make(dataclasses.replace(bunny.ITEM, frames=frames), Path(tmp_path.name), docs=False) == 0
    assert {path.name for path in tmp_path.iterdir()} == {f"bunny.{end}" for end in ("blend", "json", "mp4", "png")}
    shot = Shot(bunny.ITEM.footage(tmp_path), tmp_path / "bunny.json", tmp_path / "bunny.mp4", frames[0])
    difference = np.abs(shot.result(bunny.FRAME) - shot.source(bunny.FRAME)).mean(axis=2)
    assert difference[HEAD].mean() < 0.02
    assert difference[MEADOW].mean() < 0.02
    assert difference[ARM].mean() > 0.1
    still = ImageBuf(str(tmp_path / "bunny.png")).get_pixels()
    assert still.shape[1:] == (1632, 3)
    assert still.std() > 0.1


@pytest.mark.parametrize("name", ["time_map", "time_map-angle"])
def test_time_maps_are_frames_put_together(name):
    """A pixel whose time is a whole frame's is that frame's to the bit, and others mix the two frames around."""
    source, effect = open_source(time_map.ITEM.footage(None)), recipe_file.load(HERE / f"{name}.json")
    height, width, shown = source.height, source.width, time_map.FRAME - 1
    renderer = Renderer(open_compositor(), source, MatteValues(width, height))
    request = Request(shown, with_contents(effect.for_picture(width / height)).at(time_map.FRAME))
    made = light.to_encoded(renderer.picture(request)[..., :3]) * 255
    frames = np.stack([source.read(shown + k)[..., :3] for k in range(33)])
    y, x = np.mgrid[:height, :width]
    # When a pixel is seen, in frames since the shown one: from top to bottom, or clockwise around a point.
    turn = np.degrees(np.arctan2(x + 0.5 - 0.35 * width, 0.45 * height - y - 0.5)) % 360 / 360
    time = 32 * (turn if name == "time_map-angle" else (y + 0.5) / height)
    before = np.floor(time).astype(int)
    share = (time - before)[..., None]
    first, second = (light.to_linear(frames[before + k, y, x] / 255) for k in (0, 1))
    assert np.abs(light.to_encoded((1 - share) * first + share * second) * 255 - made).max() < 0.1
    whole = time == before
    assert whole.any()
    assert np.array_equal(np.rint(made[whole]), frames[before, y, x][whole])


def test_a_contact_sheet_of_two_frames(tmp_path):
    """The source stands for the result as well: so the first and the last picture of a row are alike."""
    film = ASSETS / "bigbuckbunny.mp4"
    arguments = film, ASSETS / "bunny.json", film, tmp_path / "sheet.png", 6, 45
    command = [sys.executable, ROOT / "scripts" / "contact_sheet.py", *map(str, arguments)]
    subprocess.run(command, cwd=ROOT, check=True)
    assert [path.name for path in tmp_path.iterdir()] == ["sheet.png"]
    sheet = ImageBuf(str(tmp_path / "sheet.png")).get_pixels()
    height = (sheet.shape[0] - stills.GAP) // 2
    for top in (stills.GAP, stills.GAP + height):
        row = sheet[top : top + 200, stills.GAP :]
        source, scribbles, coefficients, result = (part[:, :380] for part in np.split(row, 4, axis=1))
        np.testing.assert_allclose(result.mean(axis=(0, 1)), source.mean(axis=(0, 1)), atol=0.01)
        assert np.abs(scribbles - source).mean() > 0.1
        np.testing.assert_allclose(coefficients[100, 10], (0.2, 0.5, 1.0), atol=0.02)  # the long shutter's color
        assert np.ptp(coefficients, axis=(0, 1)).max() > 0.5, "the face has another shutter"
