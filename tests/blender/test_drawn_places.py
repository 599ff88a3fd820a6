"""A stroke lies where it was drawn, however its region has been moved, and moves along with it from there."""

import numpy as np
import pytest
from support import write_frames

from shutter_addon.blender.data import annotations, selection, snapshot
from shutter_addon.blender.editing import motion_keys, region_edits
from shutter_addon.core.model import scribbles
from shutter_addon.core.model.motions import Placement

FIRST = np.array([(-30.0, -20.0), (10.0, 25.0), (30.0, 5.0)])  # in pixels from the picture's middle
SECOND = np.array([(60.0, 10.0), (75.0, -15.0), (110.0, 0.0)])
MOVES = {
    "shifted": Placement((100 / 640, 0.0)),
    "turned": Placement((0.1, -0.05), 40.0),
    "all": Placement((-0.2, 0.1), -75.0, 1.6),
}


@pytest.fixture
def region(bpy, effect):
    """Of one stroke, drawn at frame 1, keyed where it lies there and somewhere else at frame 11."""
    effect.scene.render.resolution_x, effect.scene.render.resolution_y = 640, 360
    region_edits.first_drawn(effect, effect.shutters[1], "LINE")
    pen(bpy, 1, FIRST)
    return effect.regions[0]


def pen(bpy, frame, points, *, by_draw=True):
    """What Blender's pen leaves; by_draw: it was taken up by Draw, and is not chosen by hand."""
    bpy.context.scene.frame_set(frame)
    _scene, effect, strip = selection.active(bpy.context)
    if by_draw:
        region_edits.begin_drawing(effect, strip, 0)
    layer = annotations.layer_of(effect, effect.regions[0])
    there = {drawing.frame_number: drawing for drawing in layer.frames}
    annotations.add_stroke(there.get(frame) or layer.frames.new(frame), points)


def move(bpy, frame, placed):
    """As a handle is dragged."""
    bpy.context.scene.frame_set(frame)
    effect = selection.active(bpy.context)[1]
    region_edits.hold_drawings(effect, 0)
    region = effect.regions[0]
    region.location, region.rotation, region.scale = placed.location, np.radians(placed.rotation), placed.scale
    motion_keys.insert(effect, 0)


def in_pixels(strokes):
    """From the picture's middle."""
    return [points * (640, 360) - (320, 180) for points in strokes]


def seen(bpy, frame):
    """The strokes at a frame, in pixels from the picture's middle."""
    scene, effect, strip = selection.active(bpy.context)
    return in_pixels(snapshot.region_at(scene, effect, strip, 0, (frame,)).at(frame).strokes)


def same(strokes, *expected):
    return len(strokes) == len(expected) and np.abs(np.subtract(strokes, expected)).max() < 1e-3


@pytest.mark.parametrize("by_draw", [True, False], ids=["draw", "pen"])
@pytest.mark.parametrize("placed", MOVES.values(), ids=MOVES)
def test_a_stroke_lies_where_it_was_drawn_and_is_dragged_from_there(bpy, region, placed, by_draw):
    """At another frame, of a region that has keys; the first drawing stays where it was."""
    move(bpy, 1, Placement())
    move(bpy, 11, placed)
    (moved,) = seen(bpy, 11)
    assert np.abs(moved - FIRST).max() > 50
    pen(bpy, 11, SECOND, by_draw=by_draw)
    assert same(seen(bpy, 1), FIRST)
    assert same(seen(bpy, 11), SECOND)
    assert not same(seen(bpy, 6), SECOND)
    x, y = placed.location
    move(bpy, 11, Placement((x + 0.125, y), placed.rotation, placed.scale))
    assert same(seen(bpy, 11), np.add(SECOND, (80, 0)))
    assert same(seen(bpy, 1), FIRST)
    pen(bpy, 11, FIRST)
    assert same(seen(bpy, 11), np.add(SECOND, (80, 0)), FIRST), "one more at the same frame"
    move(bpy, 11, Placement((x + 0.125, y + 0.25), placed.rotation, placed.scale))
    assert same(seen(bpy, 11), np.add(SECOND, (80, 90)), np.add(FIRST, (0, 90)))


def test_the_eraser_finds_what_is_seen(bpy, region):
    """Where the region has moved, all of it becomes a drawing there; where it has not, its drawing stays the one."""
    scene, effect, strip = selection.active(bpy.context)
    layer = annotations.layer_of(effect, region)
    scene.frame_set(6)
    region_edits.begin_drawing(effect, strip, 0, erases=True)
    assert [drawing.frame_number for drawing in layer.frames] == [1]
    move(bpy, 1, Placement())
    move(bpy, 11, MOVES["all"])
    before = seen(bpy, 11)
    region_edits.begin_drawing(effect, strip, 0, erases=True)
    stored = {drawing.frame_number: annotations.strokes_of(drawing) for drawing in layer.frames}
    assert stored.keys() == {1, 11}
    assert same(stored[11], *before)
    assert same(seen(bpy, 11), *before)
    assert same(seen(bpy, 1), FIRST)


def test_a_file_of_before_means_what_it_meant(bpy, region):
    """Where nothing is noted, drawings lie where the region has not moved, until the pen is taken up."""
    region.drawn.clear()
    scene, effect, _strip = selection.active(bpy.context)
    annotations.add_stroke(annotations.layer_of(effect, region).frames.new(11), SECOND)
    for frame, x in ((1, 0.0), (11, 100 / 640)):
        scene.frame_set(frame)
        region.location = x, 0
        motion_keys.insert(effect, 0)
    assert same(seen(bpy, 11), np.add(SECOND, (100, 0)))
    pen(bpy, 11, FIRST)
    assert same(seen(bpy, 11), np.add(SECOND, (100, 0)), FIRST)


def test_a_recipe_keeps_its_meaning(bpy, region):
    """Keys move the strokes: those of a drawing are what they are seen as, taken back."""
    move(bpy, 1, Placement())
    move(bpy, 11, MOVES["all"])
    pen(bpy, 11, SECOND)
    exported = snapshot.recipe_of(*selection.active(bpy.context)).regions[0]
    strokes, there = exported.drawings.strokes[exported.drawings.frames.index(11)], exported.placement(11)
    placed = scribbles.transform(strokes, there.location, there.rotation, there.scale, 640 / 360)
    assert same(in_pixels(placed), SECOND)


def test_outlines_stay_as_they_are_drawn(bpy, region):
    region.kind = "OUTLINE"
    move(bpy, 11, MOVES["shifted"])
    scene, effect, strip = selection.active(bpy.context)
    region_edits.begin_drawing(effect, strip, 0)
    strokes = snapshot.strokes_at(scene, effect, strip, 0, 11)
    assert same(in_pixels(strokes), FIRST)
    region_edits.draw_curves(effect, strip, region, strokes, 11)
    assert same(in_pixels(snapshot.strokes_at(scene, effect, strip, 0, 11)), FIRST)


def test_a_picture_point_lies_where_blender_draws_it(bpy, edit, render, tmp_path):
    """annotations.picture_to_image against a bright pixel block in a rendered, transformed strip."""
    picture = np.zeros((1, 40, 60, 3), dtype=np.uint8)
    picture[0, 10:14, 40:44] = 255  # center: 42/60 across, 12/40 from the top
    strip = edit.sequence_editor.strips.new_image("image", str(write_frames(tmp_path / "in", picture)), 1, 1)
    edit.render.resolution_x, edit.render.resolution_y = 100, 80
    t = strip.transform
    t.offset_x, t.offset_y, t.scale_x, t.scale_y, t.rotation, t.origin = 7, -5, 1.2, 0.9, 0.5, (0.3, 0.6)
    shown = render(edit, [1])[1][..., 0]
    y, x = (np.indices(shown.shape).reshape(2, -1) * shown.ravel()).sum(axis=1) / shown.sum() + 0.5
    matrix = annotations.picture_to_image(strip, (60, 40))
    expected = scribbles.mapped(matrix, np.array([[42 / 60, 1 - 12 / 40]]))[0]
    assert (x - 50, 40 - y) == pytest.approx(tuple(expected), abs=0.6)
