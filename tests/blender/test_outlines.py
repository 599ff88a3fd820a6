"""Outlines in Blender: recipes in and out, trimmed and reversed strips, and the mattes that are kept beside a file."""

import numpy as np
import pytest
from OpenImageIO import ImageBuf
from support import effect_of, image_strip, recipe, request, write_frames

from shutter_addon.blender.data import selection, snapshot
from shutter_addon.blender.editing import region_edits
from shutter_addon.blender.rendering import previews, sessions
from shutter_addon.core.frames import light
from shutter_addon.core.model import outlines
from shutter_addon.features.outlines.blender import outline_carrying, outline_operators
from shutter_addon.features.outlines.carried_mattes import CarriedMattes
from shutter_addon.features.outlines.subject_mattes import CarriedFile

WIDTH, HEIGHT, COUNT = 96, 64, 12
OPTIONS = {"light": "encoded", "interpolation": "value"}


def ground(index):
    """Frames that differ by 10 levels, and show a square that walks by 4 pixels a frame, textured."""
    y, x = np.indices((HEIGHT, WIDTH))
    frame = np.repeat((60 + 10 * index + 5 * ((x // 3 + y // 3) % 2))[..., None], 3, axis=2)
    left = 10 + 4 * index
    frame[20:44, left : left + 24] = np.stack([(x * 7 + y * 11) % 90 + 150] * 3, axis=2)[20:44, 10:34] * (1, 0.3, 0.3)
    return frame.astype(np.uint8)


def square(index):
    """Its outline in the source's frame `index`, from 0."""
    left, right, low, high = (10 + 4 * index) / WIDTH, (34 + 4 * index) / WIDTH, 20 / HEIGHT, 44 / HEIGHT
    return [[[left, low], [right, low], [right, high], [left, high]]]


@pytest.fixture(scope="module")
def footage(tmp_path_factory):
    """The first frame's path."""
    return write_frames(tmp_path_factory.mktemp("footage"), [ground(i) for i in range(COUNT)])


def region(*frames, shown=lambda frame: frame - 1, **fields):
    """Drawn at these timeline frames, where the source's frame `shown` is."""
    keys = [{"frame": frame, "strokes": square(shown(frame)), "ease": "linear"} for frame in frames]
    return {"name": "o", "shutter": "S1", "kind": "outline", "strokes": keys[0]["strokes"], "keys": keys, **fields}


@pytest.fixture
def edited(bpy, edit, footage):
    """Makes an effect of a recipe with regions: its strip and the effect."""

    def make(*regions, change=lambda source: None):
        source = image_strip(edit, footage)
        change(source)
        return effect_of(edit, source, recipe(2, [1, 0], [0, 1], regions=regions, **OPTIONS))

    yield make
    sessions.forget()


def coefficients(strip, effect, frame):
    """Those of the region's shutter (H, W) at a timeline frame."""
    return request(strip.id_data, effect, strip, frame).coefficients()[1]


def covered(index):
    return outlines.coverage(square(index), WIDTH, HEIGHT)


def test_carried(bpy, edited, tmp_path):
    """In between and beyond; turned inside out. Mattes lie beside a file that was saved."""
    strip, effect = edited(region(1, 9))
    for frame in (1, 3, 5, 8, 10):
        assert np.abs(coefficients(strip, effect, frame) - covered(frame - 1)).mean() < 0.01, frame
    effect.regions[0].invert = True
    assert np.abs(coefficients(strip, effect, 5) - (1 - covered(4))).mean() < 0.01
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "edit.blend"))
    sessions.forget()
    coefficients(strip, strip.id_data.virtual_shutter.effects[0], 5)
    names = [path.name[:8] for path in (tmp_path / "virtual_shutter_mattes").glob("*/*.png")]
    assert sorted(names) == [f"{index:08d}" for index in range(1, 8)]


def test_drawings_stay_with_the_footage(edited):
    """Of a strip that is trimmed and runs backward, a drawing is of the source's frame that was seen there."""

    def change(source):
        source.left_handle = 3
        source.use_reverse_frames = True

    strip, effect = edited(region(1, 8, shown=lambda frame: COUNT - 2 - frame), change=change)
    for frame in (3, 6, 10):
        assert np.abs(coefficients(strip, effect, frame) - covered(COUNT - frame)).mean() < 0.01, frame


def test_as_a_layer_it_leaves_no_ghost(edited):
    """Both frames of the window show the square; the one behind it does not."""
    strip, effect = edited(region(1, 6, 12, layer=True))
    picture = 255 * light.to_encoded(request(strip.id_data, effect, strip, 5).picture()[..., :3].astype(float))
    ahead = covered(5) * (1 - covered(4)) > 0.99
    grounds = [ground(index)[0, :6].mean() for index in (4, 5)]
    assert picture[ahead].mean() < max(grounds) + 4


@pytest.fixture
def chosen(edited):
    """Makes an effect with an outline that is drawn at these frames, to be edited."""

    def make(*args, **fields):
        strip, effect = edited(region(*args, **fields))
        selection.choose(strip.id_data, strip)
        effect.active_shutter = 1
        return strip, effect

    return make


def drawn_at(effect, index=0):
    layer = effect.scene.annotation.layers[effect.regions[index].layer]
    return sorted(drawing.frame_number for drawing in layer.frames)


@pytest.mark.parametrize("between", ["carried", "straight"])
def test_what_is_carried_becomes_a_drawing(bpy, chosen, between):
    """It encloses what the matte covers; a drawing that is there already stays as it is."""
    strip, effect = chosen(1, 9, between=between)
    scene = strip.id_data
    scene.frame_set(6)
    expected = coefficients(strip, effect, 6)
    assert bpy.ops.shutter.outline_draw() == {"FINISHED"}
    assert drawn_at(effect) == [1, 6, 9]
    found = outline_operators.curves_now(scene, effect, strip, 0)
    assert np.abs(outlines.coverage(found, WIDTH, HEIGHT) - expected).mean() < 0.01
    assert bpy.ops.shutter.outline_draw() == {"FINISHED"}
    assert outline_operators.curves_now(scene, effect, strip, 0) == found


def test_the_next_drawing_needed(bpy, chosen):
    """Where the sides agree, none is; else it is where they agree least, between the drawings that do not belong
    together."""
    strip, effect = chosen(1, 5, 9)
    assert bpy.ops.shutter.outline_needed() == {"CANCELLED"}
    scene = strip.id_data
    scene.frame_set(9)
    wrong = [[(x + 0.12, y) for x, y in each] for each in outline_operators.curves_now(scene, effect, strip, 0)]
    region_edits.draw_curves(effect, strip, effect.regions[0], wrong, 9)
    scene.frame_set(1)
    assert bpy.ops.shutter.outline_needed() == {"FINISHED"}
    frame, confidence = outline_operators.next_needed(scene, effect, strip, 0)
    assert scene.frame_current == frame in (6, 7, 8)
    assert confidence < 0.75
    effect.regions[0].between = "STRAIGHT"
    with pytest.raises(RuntimeError, match="a linear outline is not tracked"):
        bpy.ops.shutter.outline_needed()


def test_one_drawing_says_where_the_next_is_needed(bpy, chosen, monkeypatch):
    strip, effect = chosen(1)
    assert bpy.ops.shutter.outline_needed() in ({"FINISHED"}, {"CANCELLED"})
    sure = [1.0, 0.9, 0.9, 0.7, 0.7, 0.6, 0.4, 0.2, 0.0, 0.0, 0.0, None]
    monkeypatch.setattr(CarriedMattes, "confidence", lambda _self, number: sure[number])
    assert outline_operators.next_needed(strip.id_data, effect, strip, 0) == (11, 0.0)
    sure[6:] = [0.9] * 6
    assert outline_operators.next_needed(strip.id_data, effect, strip, 0) == (6, 0.6)


@pytest.mark.parametrize(("frames", "fields"), [((1,), {}), ((1, 9), {}), ((1, 9), {"between": "straight"})])
def test_its_motion_is_that_of_what_it_encloses(bpy, chosen, frames, fields):
    """As keys of its location, which say how it moves and do not move it."""
    strip, effect = chosen(*frames, **fields)
    effect.regions[0].motion = "LOCATION"
    strip.id_data.frame_set(1)
    before = coefficients(strip, effect, 6)
    assert bpy.ops.shutter.track(direction="FORWARD") == {"FINISHED"}
    frames = range(1, 10)  # at the last one the recipe has set a key
    (found,) = snapshot.read(strip.id_data, effect, strip, frames).regions
    centres = [found.centre(frame) + found.placement(frame).location for frame in frames]
    ways = (np.array(centres) - centres[0]) * (WIDTH, HEIGHT)
    assert np.abs(ways - np.outer(np.arange(9), (4, 0))).max() < 1
    assert found.placement(6).rotation == 0
    assert found.opacity.at(12) == 1, "a matte says itself where it is"
    np.testing.assert_array_equal(coefficients(strip, effect, 6), before)


@pytest.mark.parametrize(
    ("kind", "strokes"),
    [
        ("line", [[[0.28, 0.4], [0.4, 0.5], [0.28, 0.6]]]),
        ("lasso", [[[0.2, 0.25], [0.55, 0.22], [0.54, 0.75], [0.22, 0.72]]]),
        ("outline", [[[0.2, 0.25], [0.55, 0.22], [0.54, 0.75], [0.22, 0.72]]]),
    ],
)
def test_outline_it(bpy, edited, kind, strokes):
    """A stroke through the square, or a rough line around it, becomes its outline at that frame."""
    said = {"name": "o", "shutter": "S1", "kind": kind, "strokes": strokes, "width": 0.02}
    strip, effect = edited(said)
    selection.choose(strip.id_data, strip)
    effect.active_shutter = 1
    strip.id_data.frame_set(5)
    assert bpy.ops.shutter.outline_it() == {"FINISHED"}
    assert effect.regions[0].kind == "OUTLINE"
    assert effect.regions[0].motion == ("SCALE" if kind == "outline" else "LOCATION")
    assert 5 in drawn_at(effect)
    found = outlines.coverage(outline_operators.curves_now(strip.id_data, effect, strip, 0), WIDTH, HEIGHT) > 0.5
    expected = covered(4) > 0.5
    assert np.count_nonzero(found & expected) > 0.9 * np.count_nonzero(found | expected)


@pytest.mark.parametrize(("word", "levels"), [("PNG", 65535), ("EXR", 1)])
def test_export(bpy, chosen, tmp_path, word, levels):
    strip, effect = chosen(1, 9)
    expected = {frame: coefficients(strip, effect, frame) for frame in (1, 5, 12)}
    folder = tmp_path / "mattes"
    assert bpy.ops.shutter.matte_export(directory=str(folder), format=word) == {"FINISHED"}
    files = sorted(folder.iterdir())
    assert [file.name for file in files] == [f"{frame:04d}.{word.lower()}" for frame in range(1, COUNT + 1)]
    for frame, values in expected.items():
        image = ImageBuf(str(folder / f"{frame:04d}.{word.lower()}"))
        assert image.nchannels == 1
        np.testing.assert_allclose(image.get_pixels("float")[..., 0], values, atol=0.51 / 65535 if levels > 1 else 1e-6)
    (tmp_path / "file").write_text("")
    with pytest.raises(RuntimeError, match="file"):
        bpy.ops.shutter.matte_export(directory=str(tmp_path / "file"), format=word)
    assert sorted(path.name for path in tmp_path.iterdir() if path.name != "mattes") == ["file"]


@pytest.fixture
def moving_mask(bpy):
    """A mask of the square with shape keys at its first and last frame."""
    window = bpy.context.window
    area, mask = window.screen.areas[0], bpy.data.masks.new("m")
    area.ui_type = "IMAGE_EDITOR"
    space, spline = area.spaces.active, mask.layers.new(name="m").splines.new()
    space.mode, space.mask, mask.layers[0].alpha = "MASK", mask, 1.0
    spline.points.add(4 - len(spline.points))
    spline.use_cyclic = True
    area_region = next(region for region in area.regions if region.type == "WINDOW")
    for frame in (1, COUNT):
        window.scene.frame_current = frame
        window.view_layer.update()  # the operator would update, too, and reset the points to the last key
        for point, (x, y) in zip(spline.points, square(frame - 1)[0], strict=True):
            place = x, (y - 0.5) * HEIGHT / WIDTH + 0.5
            point.handle_type, point.select = "FREE", True
            point.co = point.handle_left = point.handle_right = place
        with bpy.context.temp_override(window=window, area=area, region=area_region):
            bpy.ops.mask.shape_key_insert()
    return mask


def test_from_a_mask(bpy, chosen, moving_mask):
    strip, effect = chosen(2)
    bpy.data.masks.new("empty")
    with pytest.raises(RuntimeError, match='mask "empty" encloses nothing in the strip'):
        bpy.ops.shutter.outline_from_mask(mask="empty")
    assert len(effect.regions) == 1
    assert bpy.ops.shutter.outline_from_mask(mask=moving_mask.name) == {"FINISHED"}
    again = effect.regions[-1]
    assert (again.kind, again.between, effect.active_region) == ("OUTLINE", "STRAIGHT", len(effect.regions) - 1)
    effect.regions[0].opacity = 0
    for frame in (2, 4, 7, 12):
        assert np.abs(coefficients(strip, effect, frame) - covered(frame - 1)).mean() < 0.015, frame


def test_what_fails_beside_blender_is_told_once(bpy, monkeypatch):
    """Whatever it is: else the file would be asked for with every look at the preview."""
    file, arrived, said = CarriedFile(footage=Unreadable(), drawings=((0, outlines.curves(square(0))),)), [], []
    monkeypatch.setattr(previews, "show_carried", lambda: arrived.append(True))
    outline_carrying.carry(file, [0])
    outline_carrying._mattes.carrying.future.exception()  # waits for the thread
    assert outline_carrying._look() is None  # the timer, which no Blender without a window calls
    assert arrived == [True]
    assert outline_carrying.failure(file) == "internal error: RuntimeError('of a library')"
    outline_carrying.want_matte(file, 0)
    outline_carrying.note_tracking(said.append)
    assert said == [f"Shutter: {outline_carrying.failure(file)}"]
    assert outline_carrying.progress() is None
    outline_carrying.forget_pictures()


class Unreadable:
    def open(self):
        raise RuntimeError("of a library")
