"""Masks at any frame, against Blender's own Mask strip."""

import random
from contextlib import contextmanager
from itertools import product

import numpy as np
import pytest
from support import write_frames

from shutter_addon.blender.data import struct_dna
from shutter_addon.core.messages import EffectError
from shutter_addon.features.masks.blender import blender_masks

AVERAGE = 0.5  # what a picture may differ by, in 8-bit levels: Blender cuts off fractions
ASTRAY = 0.001  # share of pixels that may differ by more than 8 levels
FRAMES = 1, 11, 21, 31, 41


@pytest.fixture
def mask(bpy, edit):
    """An empty mask, whose first frame is no other number's."""
    mask = bpy.data.masks.new("M")
    mask.frame_start, mask.frame_end = 5, 60
    return mask


@pytest.fixture
def assert_as_the_strip(bpy, edit, render):
    """Compares a mask with what its strip shows at frames; read from another frame, so that nothing stands there."""

    def compare(mask, frames, size=(161, 90)):
        edit.render.resolution_x, edit.render.resolution_y = size
        edit.sequence_editor.strips.new_mask("mask", mask, 1, 1)
        shown = render(edit, frames)
        edit.frame_set(77)
        shapes = blender_masks.at_frames(mask, [mask.frame_start + f - 1 for f in frames])
        found = [255 * shape.values(*size) for shape in shapes]
        assert edit.frame_current == 77
        differences = np.abs(np.array(found) - [shown[f][..., 0] for f in frames])
        assert differences.mean((1, 2)).max() <= AVERAGE
        assert (differences > 8).mean((1, 2)).max() <= ASTRAY
        return shown

    return compare


@pytest.fixture
def mask_editor(bpy, edit):
    """The context of a clip editor that shows a clip and a mask."""

    @contextmanager
    def opened(clip, mask):
        window = bpy.data.window_managers[0].windows[0]
        area = window.screen.areas[0]
        area.type = "CLIP_EDITOR"
        space = area.spaces.active
        space.clip, space.mode, space.mask = clip, "MASK", mask
        region = next(region for region in area.regions if region.type == "WINDOW")
        with bpy.context.temp_override(window=window, area=area, region=region, space_data=space):
            yield space

    return opened


@pytest.fixture
def clip(bpy, edit, tmp_path):
    def load(width, height, start=1):
        frames = np.zeros((45, height, width, 3), np.uint8)
        clip = bpy.data.movieclips.load(str(write_frames(tmp_path / f"clip{width}", frames)))
        clip.frame_start = start
        assert tuple(clip.size) == (width, height)
        return clip

    return load


def draw(layer, corners, weight=0.0, types=("AUTO", "AUTO"), **options):
    """A spline through corners (x, y)."""
    spline = layer.splines.new()
    spline.points.add(len(corners) - 1)
    for point, corner in zip(spline.points, corners, strict=True):
        point.co = point.handle_left = point.handle_right = corner
        point.handle_left_type, point.handle_right_type = types
        point.weight = weight
    spline.use_cyclic = True
    for name, value in options.items():
        setattr(spline, name, value)
    return spline


def blob(dice, count, radius=0.2):
    """Corners around a place, either way."""
    x, y, turn = dice.uniform(0.2, 0.8), dice.uniform(0.35, 0.65), dice.choice((-1, 1))
    reach = [radius * dice.uniform(0.7, 1.3) for _ in range(count)]
    angles = [turn * k * 2 * np.pi / count for k in range(count)]
    return [(x + r * np.cos(a), y + r * np.sin(a)) for r, a in zip(reach, angles, strict=True)]


@pytest.mark.parametrize("seed", range(1, 7))
def test_layers_of_all_kinds(mask, assert_as_the_strip, seed):
    dice = random.Random(seed)
    words = type(mask.layers.new(name="first")).bl_rna.properties
    for index in range(dice.randint(1, 3)):
        layer = mask.layers.new(name="L") if index else mask.layers[0]
        layer.alpha, layer.invert = dice.choice((1, 1, 0.6)), index > 0 and dice.random() < 0.4
        layer.falloff = dice.choice(words["falloff"].enum_items.keys())
        layer.blend = dice.choice(words["blend"].enum_items.keys()) if index else "MERGE_ADD"
        layer.use_fill_holes = dice.random() < 0.4
        for _ in range(dice.randint(1, 3)):
            draw(
                layer,
                blob(dice, dice.randint(3, 9), dice.uniform(0.05, 0.3)),
                dice.choice((0, 0.02, 0.1)),
                (dice.choice(("AUTO", "VECTOR", "FREE", "ALIGNED", "ALIGNED_DOUBLESIDE")),) * 2,
                use_cyclic=dice.random() < 0.8,
                weight_interpolation=dice.choice(("EASE", "LINEAR")),
            )
    hidden = mask.layers.new(name="hidden")
    draw(hidden, blob(dice, 5))
    hidden.hide_render = True
    shown = assert_as_the_strip(mask, (1,), dice.choice([(161, 90), (91, 160), (63, 64), (200, 51)]))
    assert seed > 1 or shown[1][..., 0].any()


CROSSED = {
    "star": [[(0.5 + 0.4 * np.sin(k * 0.8 * np.pi), 0.5 + 0.25 * np.cos(k * 0.8 * np.pi)) for k in range(5)]],
    "nested": [[(0.1, 0.3), (0.9, 0.3), (0.9, 0.7), (0.1, 0.7)], [(0.3, 0.4), (0.6, 0.4), (0.6, 0.6), (0.3, 0.6)]],
    "against": [[(0.1, 0.3), (0.5, 0.3), (0.5, 0.6), (0.1, 0.6)], [(0.3, 0.4), (0.3, 0.7), (0.9, 0.7), (0.9, 0.4)]],
}


# Blender's sweep line loses parts of splines that cross one another, and with holes keeps what one goes around twice:
# with it, they are not as in Blender.
@pytest.mark.parametrize(("name", "solver"), [*product(CROSSED, ["CDT"]), ("nested", "SWEEP_LINE")])
@pytest.mark.parametrize("holes", [False, True])
def test_splines_that_cross(mask, assert_as_the_strip, name, solver, holes):
    layer = mask.layers.new(name="L")
    layer.fill_solver, layer.use_fill_holes = solver, holes
    for corners in CROSSED[name]:
        draw(layer, corners, 0.01, ("VECTOR", "VECTOR"))
    assert_as_the_strip(mask, (1,))


@pytest.mark.parametrize("size", [(161, 90), (90, 161)])
def test_shape_keys_and_keyed_opacity(bpy, mask, assert_as_the_strip, mask_editor, clip, edit, size):
    dice = random.Random(3)
    layers = [mask.layers.new(name=name) for name in ("Lay", 'Äußerer "Rand"')]
    layers[1].blend = "SUBTRACT"
    for layer in layers:
        for types in (("AUTO", "AUTO"), ("ALIGNED", "ALIGNED"), ("VECTOR", "FREE")):
            draw(layer, blob(dice, 6, 0.15), 0.04, types)
    with mask_editor(clip(40, 30), mask):
        for frame in (5, 15, 40):
            edit.frame_set(frame)
            for layer in layers:
                for point in (point for spline in layer.splines for point in spline.points):
                    point.select = True
                    point.co = [place + dice.uniform(-0.06, 0.06) for place in point.co]
                    point.handle_left = (point.handle_left[0] + dice.uniform(-0.02, 0.02), point.handle_left[1])
                    point.weight *= dice.uniform(0.5, 1.5)
            assert bpy.ops.mask.shape_key_insert() == {"FINISHED"}
    layers[0].keyframe_insert("alpha", frame=10)
    layers[0].alpha = 0.2
    layers[0].keyframe_insert("alpha", frame=35)
    shown = assert_as_the_strip(mask, FRAMES, size)
    assert len({picture.tobytes() for picture in shown.values()}) == len(FRAMES)


@pytest.fixture
def moving(bpy, edit, mask, mask_editor, clip):
    """The mask, with a spline that has shape keys at frames 5 and 30, at frame 30."""
    spline = draw(mask.layers.new(name="L"), blob(random.Random(2), 5), 0.05)
    with mask_editor(clip(40, 30), mask):
        for frame in (5, 30):
            edit.frame_set(frame)
            spline.points[0].co = (frame / 50, 0.5)
            spline.points[0].select = True
            bpy.ops.mask.shape_key_insert()
    return mask


def assert_refused(mask):
    with pytest.raises(EffectError, match='mask "M" moves: use "Outline from Mask", or take a film'):
        blender_masks.still_mask(mask)


def test_shape_keys_are_read_and_refused(moving, monkeypatch):
    """Reading leaves the mask as it is. Another Blender may have shape keys elsewhere."""
    spline = moving.layers["L"].splines[0]
    stood = [tuple(point.co) for point in spline.points]
    first, last, beyond = blender_masks.at_frames(moving, (5, 30, 100))
    assert [tuple(point.co) for point in spline.points] == stood
    assert last == beyond != first
    assert_refused(moving)

    def elsewhere(*_):
        raise struct_dna.LayoutError

    monkeypatch.setattr(blender_masks, "record", elsewhere)
    assert blender_masks.still_mask(moving).layers[0].splines[0].points[0][1][0] == pytest.approx(0.6)


def test_keyed_opacity_and_parents_are_refused(bpy, mask, mask_editor, clip, edit):
    layer = mask.layers.new(name="L")
    spline, clip = draw(layer, blob(random.Random(2), 5)), clip(40, 30)
    blender_masks.still_mask(mask)
    layer.keyframe_insert("alpha", frame=10)
    assert_refused(mask)
    layer.keyframe_delete("alpha", frame=10)
    blender_masks.still_mask(mask)
    clip.tracking.tracks.active = clip.tracking.tracks.new(name="T", frame=1)
    with mask_editor(clip, mask):
        for point in spline.points:
            point.select = True
        assert bpy.ops.mask.parent_set() == {"FINISHED"}
    assert_refused(mask)


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 1e20])
def test_numbers_that_are_none_are_refused(bpy, mask, value):
    layer = mask.layers.new(name="L")
    spline = draw(layer, blob(random.Random(2), 5))
    spline.points[2].co = (value, 0.5)
    with pytest.raises(EffectError, match='mask "M": a point, a feather or an opacity is not a usable number'):
        blender_masks.still_mask(mask)
    spline.points[2].co = (0.5, 0.5)
    layer.alpha = value
    with pytest.raises(EffectError, match="not a usable number"):
        blender_masks.still_mask(mask)
