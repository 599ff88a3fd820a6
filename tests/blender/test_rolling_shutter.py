"""Rolling Shutter Repair and Find Readout: which moment each row is shown at, and what both say."""

import numpy as np
import pytest
import support
from support import image_strip, request, started, write_frames

from shutter_addon.blender.data import consistency, recipe_import
from shutter_addon.blender.editing import shutter_edits
from shutter_addon.blender.output import matte_export
from shutter_addon.blender.rendering import sessions
from shutter_addon.core.model import limits, windows
from shutter_addon.core.pixels import compositor
from shutter_addon.features.rolling_shutter.blender import rolling_shutter_repair as rolling_shutter

WIDTH, HEIGHT, COUNT = 160, 120, 16


def frames(share, way=18):
    """Poles that go from side to side, row by row (COUNT, H, W, 3)."""
    y, x = (np.arange(HEIGHT) + 0.5)[:, None], np.arange(WIDTH)[None]
    for t in range(COUNT):
        moved = way * np.sin((t + share * (y / HEIGHT - 0.5)) / 2)
        picture = np.full((HEIGHT, WIDTH), 170.0)
        for left, wide in ((25, 6), (60, 9), (95, 5), (125, 8)):
            covered = np.clip(np.minimum(x + 1, left + wide + moved) - np.maximum(x, left + moved), 0, 1)
            picture += (50 - picture) * covered
        yield np.repeat(np.rint(picture)[..., None], 3, axis=2).astype(np.uint8)


@pytest.fixture
def edited(bpy, edit, tmp_path):
    """Makes an effect of footage with a readout, as the button does; its strip and the effect. From frame 1 on."""

    def make(share=0.0, turned=False):
        pictures = [picture.swapaxes(0, 1) if turned else picture for picture in frames(share)]
        source = image_strip(edit, write_frames(tmp_path / "in", pictures))
        strip, effect = started(edit, source, chosen=True)
        edit.frame_set(8)
        return strip, effect

    yield make
    sessions.forget()


def moments(strip, effect, at=8):
    """When each pixel (H, W) is shown, in filmed frames from the shown one on; and over how many frames it is."""
    asked = request(strip.id_data, effect, strip, at)
    options = asked.state.options
    places = windows.positions(options, asked.index, asked.direction)
    coefficients = np.moveaxis(asked.coefficients(), 0, -1)
    exposed = compositor.mixed_shutter(asked.state, coefficients)
    shown = (exposed * places).sum(axis=-1) / exposed.sum(axis=-1)
    return (shown - asked.index) / options.step, (exposed > 1e-6).sum(axis=-1)


def expected(share, side):
    down, right = ((np.arange(n) + 0.5) / n - 0.5 for n in (HEIGHT, WIDTH))
    along = {"TOP": down[:, None], "BOTTOM": -down[:, None], "LEFT": right[None], "RIGHT": -right[None]}[side]
    return np.broadcast_to(-share * along, (HEIGHT, WIDTH))


@pytest.mark.parametrize("backward", [False, True])
@pytest.mark.parametrize(("side", "share"), [("TOP", 0.03), ("BOTTOM", 0.25), ("LEFT", 0.431), ("RIGHT", 1.0)])
def test_each_row_is_shown_when_the_middle_one_was_filmed(bpy, edit, edited, share, side, backward):
    """Exactly evenly from edge to edge, each of two neighboring moments."""
    strip, effect = edited()
    edit.sequence_editor.strips["images"].use_reverse_frames = backward
    assert call(bpy, side=side, readout=100 * share) == {"FINISHED"}
    shown, count = moments(strip, effect)
    np.testing.assert_allclose(shown, expected(share, side), atol=2e-6)
    assert count.max() == 2
    assert (effect.inbetween, effect.window, effect.position) == ("8", 8, "CENTER")


def test_what_was_there_before_stays_beside_it_and_one_undo_takes_it_back(bpy, edited):
    _strip, effect = edited()
    bpy.ops.ed.undo_push(message="before")
    call(bpy, side="TOP", readout=50)
    assert [shutter.name for shutter in effect.shutters] == ["Earlier", "Long", "Sharp", "Later"]
    assert consistency.bars(effect.shutters["Long"]).tolist() == [1] * 8
    assert [consistency.bars(effect.shutters[i]).sum() for i in (0, 2, 3)] == [1, 1, 1]
    bpy.ops.ed.undo()
    effect = bpy.context.scene.virtual_shutter.effects[0]
    assert (effect.inbetween, effect.window, len(effect.shutters), len(effect.regions)) == ("1", 8, 2, 0)


def call(bpy, name="rolling_shutter", **settings):
    return support.call(bpy, name, **settings)


def test_again_it_changes_the_readout_and_another_smoothness_keeps_it(bpy, edited):
    strip, effect = edited()
    call(bpy, side="TOP", readout=30)
    for shutter, name in zip(effect.shutters, "ABCD", strict=True):
        shutter.name = name
    effect.regions[0].name = "E"
    before = [shutter.name for shutter in effect.shutters]
    call(bpy, side="LEFT", readout=80)
    assert [shutter.name for shutter in effect.shutters] == before
    np.testing.assert_allclose(moments(strip, effect)[0], expected(0.8, "LEFT"), atol=2e-6)
    for smooth in ("8", "16"):
        effect.inbetween = smooth
        assert rolling_shutter.of(effect) == (0, pytest.approx(0.8), "LEFT")
    call(bpy, side="TOP")
    shown, count = moments(strip, effect)
    np.testing.assert_allclose(shown, expected(0.8, "TOP"), atol=2e-6)
    assert (count.max(), len(effect.regions)) == (2, 1)


@pytest.mark.parametrize(
    ("window", "share", "taken", "steps"), [(1, 1.0, 3, 8), (33, 0.5, 33, 4), (128, 0.5, 128, 2), (200, 0.5, 200, 1)]
)
def test_a_short_window_becomes_as_long_as_it_takes_and_a_long_one_has_fewer_moments(
    bpy, edited, window, share, taken, steps
):
    strip, effect = edited()
    effect.window = window
    call(bpy, side="TOP", readout=100 * share)
    assert (effect.inbetween, effect.window) == ("8", taken)
    assert request(strip.id_data, effect, strip, 8).state.options.step == steps
    np.testing.assert_allclose(moments(strip, effect)[0], expected(share, "TOP"), atol=2e-6)


def test_a_time_map_is_no_repair(bpy, edited):
    _strip, effect = edited()
    effect.position, effect.inbetween = "CENTER", "2"
    shutter_edits.add_time_map(effect, "LINEAR")
    assert rolling_shutter.of(effect) is None
    effect.shutters.clear()
    assert rolling_shutter.of(effect) is None


def test_a_recipe_keeps_it(bpy, edit, edited, tmp_path):
    strip, effect = edited()
    call(bpy, side="BOTTOM", readout=40)
    saved = matte_export.recipe_for(edit, effect, strip, tmp_path / "r.json")
    recipe_import.apply(edit, effect, strip, saved, tmp_path)
    assert rolling_shutter.of(effect) == (0, pytest.approx(0.4), "BOTTOM")
    np.testing.assert_allclose(moments(strip, effect)[0], expected(0.4, "BOTTOM"), atol=2e-6)
    assert consistency.bars(effect.shutters[0]).sum() == 1


@pytest.mark.parametrize(
    ("share", "reads", "side"),
    [(0.4, "ROWS", "TOP"), (-0.6, "ROWS", "BOTTOM"), (0.4, "COLUMNS", "LEFT"), (-0.4, "COLUMNS", "RIGHT")],
)
def test_a_readout_is_found_and_repaired(bpy, edited, share, reads, side):
    _strip, effect = edited(share, turned=reads == "COLUMNS")
    assert call(bpy, "find_readout", reads=reads) == {"FINISHED"}
    assert rolling_shutter.of(effect) == (0, pytest.approx(abs(share), rel=0.1), side)


def test_where_nothing_more_fits_it_is_greyed_out(bpy, edited, capfd):
    """A value that no effect can have is no traceback."""
    _strip, effect = edited()
    for _ in range(limits.MAX_REGIONS):
        effect.regions.add()
    assert not bpy.ops.shutter.rolling_shutter.poll()
    effect.regions.clear()
    assert bpy.ops.shutter.rolling_shutter.poll()
    effect.inbetween, effect.position = "2", "CENTER"
    call(bpy, side="TOP", readout=50)
    effect["inbetween"] = 77
    bpy.ops.shutter.find_readout.poll()
    assert "Traceback" not in "".join(capfd.readouterr())


@pytest.mark.parametrize(
    ("share", "reads", "sentence"),
    [(0.4, "COLUMNS", "cannot be found here: too few straight lines"), (0.0, "ROWS", "moving lines stay upright")],
)
def test_where_it_cannot_be_found_one_sentence_says_so(bpy, edited, share, reads, sentence):
    _strip, effect = edited(share)
    with pytest.raises(RuntimeError, match=sentence):
        call(bpy, "find_readout", reads=reads)
    assert (effect.inbetween, len(effect.shutters)) == ("1", 2)


def test_it_does_not_look_beyond_a_cut(bpy, edited, tmp_path):
    """Of the other shot, whose readout is another one."""
    strip, effect = edited(0.4)
    is_dark = np.arange(HEIGHT)[:, None, None] // 30 % 2 == 0
    others = [np.where(is_dark, picture // 3, picture).astype(np.uint8) for picture in frames(-0.4, way=14)]
    write_frames(tmp_path / "in", others, name="g")
    source = next(s for s in strip.id_data.sequence_editor.strips if s.type == "IMAGE")
    for _ in range(4):
        source.elements.pop(index=len(source.elements) - 1)
    for number in range(1, COUNT):
        source.elements.append(f"g{number:04d}.png")
    assert call(bpy, "find_readout", reads="ROWS") == {"FINISHED"}
    assert rolling_shutter.of(effect) == (0, pytest.approx(0.4, rel=0.1), "TOP")
