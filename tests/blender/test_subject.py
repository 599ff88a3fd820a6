"""Subjects in Blender: drawn, saved, as recipes, rendered, turned into outlines, and what is said of bad input."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
from support import effect_of, image_strip, recipe, write_frames
from test_outlines import coefficients

from shutter_addon.blender.data import annotations, preferences, selection, snapshot
from shutter_addon.blender.editing import region_edits
from shutter_addon.blender.output import matte_export
from shutter_addon.blender.rendering import sessions
from shutter_addon.core.recipes import recipe_file
from shutter_addon.features.outlines.blender import outline_carrying, outline_operators

WIDTH, HEIGHT, COUNT, RADIUS = 192, 128, 6, 28
STROKE = [[0.3, 0.45], [0.34, 0.5], [0.3, 0.55]]


def disc(index):
    """Which pixels it covers in the source's frame `index`, from 0."""
    y, x = np.indices((HEIGHT, WIDTH))
    return np.hypot(x - 60 - 5 * index, y - 64) < RADIUS


def ground(index):
    """A checkered disc that walks over a plain ground."""
    y, x = np.indices((HEIGHT, WIDTH))
    frame = np.repeat((70 + x // 8)[..., None], 3, axis=2)
    checks = np.stack([220 - 60 * ((x - 5 * index) // 6 + y // 6) % 2] * 3, 2) * (1, 0.4, 0.3)
    frame[disc(index)] = checks[disc(index)]
    return frame.astype(np.uint8)


@pytest.fixture(scope="module")
def footage(tmp_path_factory):
    """The first frame's path."""
    return write_frames(tmp_path_factory.mktemp("footage"), [ground(i) for i in range(COUNT)])


@pytest.fixture
def edited(bpy, edit, footage):
    """Makes an effect with a region; its strip, which is chosen, and the effect."""

    def make(kind="subject", **fields):
        fields = {"name": "o", "shutter": "S1", "kind": kind, "strokes": [STROKE]} | fields
        content = recipe(2, [1, 1], [1, 0], regions=[fields], light="encoded", interpolation="value")
        strip, effect = effect_of(edit, image_strip(edit, footage), content)
        effect.active_shutter = 1
        selection.choose(edit, strip)
        edit.frame_set(1)
        return strip, effect

    yield make
    outline_carrying.forget_pictures()
    sessions.forget()


def overlap(matte, index):
    inside = matte > 0.5
    return (inside & disc(index)).sum() / (inside | disc(index)).sum()


def test_one_stroke(bpy, edited):
    """A scribble becomes a subject, which is shown around the disc, and follows it; a scribble again on a click."""
    strip, effect = edited("line", width=0.03)
    assert bpy.ops.shutter.subject_find() == {"FINISHED"}
    assert effect.regions[0].kind == "SUBJECT"
    for frame in (1, 4, 6):
        assert overlap(coefficients(strip, effect, frame), frame - 1) > 0.9, frame
    (curve,) = outline_operators.curves_now(strip.id_data, effect, strip, 0)
    assert np.abs(np.mean(curve, axis=0) - (60 / WIDTH, 0.5)).max() < 0.02
    assert bpy.ops.shutter.subject_scribble() == {"FINISHED"}
    assert (effect.regions[0].kind, len(snapshot.strokes_at(strip.id_data, effect, strip, 0, 1))) == ("LINE", 1)


def test_rendered_as_a_layer(bpy, edited, render):
    """Sharp Subject, without Track: the disc is sharp, and leaves no ghost."""
    strip, effect = edited()
    edit = strip.id_data
    edit.render.resolution_x, edit.render.resolution_y = WIDTH, HEIGHT
    assert bpy.ops.shutter.sharp_subject() == {"FINISHED"}
    picture = render(edit, [3])[3][..., :3]
    inside = disc(2) & disc(1) & disc(3)
    assert np.abs(picture - ground(2))[inside].mean() < 2
    ghost = (disc(1) | disc(3)) & ~disc(2) & (coefficients(strip, effect, 3) < 0.01)
    assert np.abs(picture - ground(5))[ghost & ~disc(5)].mean() < 6


def test_saved_and_opened(bpy, edited, tmp_path):
    """With strokes on what it is not and a drawing; both lie in annotation layers of their own."""
    drawing = [[[0.2, 0.2], [0.4, 0.2], [0.4, 0.8], [0.2, 0.8]]]
    edited(not_strokes=[[[0.8, 0.5], [0.9, 0.5]]], keys=[{"frame": 4, "strokes": drawing}])
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "edit.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "edit.blend"))
    edit = bpy.context.scene
    effect, strip = edit.virtual_shutter.effects[0], edit.sequence_editor.strips_all["Shutter"]
    region = effect.regions[0]
    layers = annotations.layers_of(effect, region)
    assert [[d.frame_number for d in layer.frames] for layer in layers] == [[1], [1], [4]]
    assert coefficients(strip, effect, 4)[30:98, 42:72].mean() > 0.99, "the drawing overrules the model"
    assert overlap(coefficients(strip, effect, 1), 0) > 0.9
    assert len(list((tmp_path / "virtual_shutter_mattes").glob("*/*.png"))) >= 2


def test_recipe_and_back(edited, tmp_path):
    drawing = [[[0.2, 0.2], [0.4, 0.2], [0.4, 0.8]]]
    strokes = [{"frame": 1, "strokes": [STROKE]}, {"frame": 3, "strokes": [STROKE, STROKE]}]
    strip, effect = edited(strokes=strokes, not_strokes=[[[0.8, 0.5], [0.9, 0.5]]], width=0.01, layer=True)
    region_edits.draw_curves(effect, strip, effect.regions[0], [np.array(drawing[0])], 5)
    found = matte_export.recipe_for(strip.id_data, effect, strip, tmp_path / "r.json")
    (region,) = json.loads(recipe_file.dump(found), object_hook=lambda fields: SimpleNamespace(**fields)).regions
    assert (region.kind, region.layer, round(region.width, 6)) == ("subject", True, 0.01)
    assert [(key.frame, len(key.strokes)) for key in region.strokes] == [(1, 1), (3, 2)]
    assert np.allclose(region.strokes[0].strokes[0], STROKE, atol=1e-4)
    assert np.allclose(region.not_strokes, [[[0.8, 0.5], [0.9, 0.5]]], atol=1e-4)
    assert [key.frame for key in region.keys] == [5]
    assert np.allclose(region.keys[0].strokes, drawing, atol=1e-4)


def test_as_an_outline(bpy, edited):
    strip, effect = edited()
    assert bpy.ops.shutter.subject_outline() == {"FINISHED"}
    region = effect.regions[0]
    assert (region.kind, len(annotations.layers_of(effect, region))) == ("OUTLINE", 1)
    assert overlap(coefficients(strip, effect, 1), 0) > 0.9
    assert bpy.ops.shutter.subject_find() == {"FINISHED"}
    assert (region.kind, region.layer, region.outline_layer) == ("SUBJECT", "", "o")
    assert overlap(coefficients(strip, effect, 1), 0) > 0.9
    bpy.ops.shutter.region_remove()
    assert not effect.scene.annotation.layers


def test_not_this(bpy, edited):
    """The second button of Draw aims the pen at a layer of its own, for subjects alone."""
    _strip, effect = edited()
    assert bpy.ops.shutter.draw(not_this=True) == {"FINISHED"}
    layers = effect.scene.annotation.layers
    assert layers.active_note == effect.regions[0].not_layer != ""
    assert bpy.ops.shutter.draw() == {"FINISHED"}
    assert layers.active_note == effect.regions[0].layer
    bpy.ops.shutter.subject_scribble()
    with pytest.raises(RuntimeError, match="The region is not a subject"):
        bpy.ops.shutter.draw(not_this=True)


def test_the_least_sure_frame(bpy, edited, monkeypatch):
    """Next Unsure Frame makes all mattes, and goes to where their confidence is lowest. Panning Shot keys the motion of
    what they cover."""
    strip, effect = edited()
    bpy.ops.shutter.outline_needed()
    file, shown = outline_operators.carried_frames(strip.id_data, effect, strip, 0)
    mattes = file.open()
    sure = {frame: mattes.confidence(number) for frame, number in shown.items()}
    mattes.close()
    assert None not in sure.values()
    monkeypatch.setattr(outline_operators, "SURE_SUBJECT", 1.1)
    assert bpy.ops.shutter.track_look() == {"FINISHED"}
    assert sure[strip.id_data.frame_current] == min(sure.values())
    strip.id_data.frame_set(1)
    assert bpy.ops.shutter.panning_shot() == {"FINISHED"}
    strip.id_data.frame_set(6)
    assert abs(effect.regions[0].location[0] - 25 / WIDTH) < 0.01


def test_nothing_under_the_stroke(bpy, edited, capfd):
    _strip, effect = edited("line", strokes=[[[0.9, 0.9], [0.97, 0.95]]])
    assert bpy.ops.shutter.subject_find() == {"CANCELLED"}
    assert "The model finds no subject under the stroke" in capfd.readouterr().out
    assert effect.regions[0].kind == "LINE"


@pytest.mark.parametrize(("content", "message"), [(None, "cannot be read"), (b"not a model", "or no ONNX model")])
def test_without_a_model(bpy, edited, tmp_path, monkeypatch, content, message):
    """One sentence, when it is asked for, rendered, and checked."""
    path = tmp_path / "other.onnx"
    if content is not None:
        path.write_bytes(content)
    monkeypatch.setattr(preferences, "model", lambda: path)
    strip, effect = edited("line")
    with pytest.raises(RuntimeError, match=message):
        bpy.ops.shutter.subject_find()
    effect.regions[0].kind = "SUBJECT"
    with pytest.raises(Exception, match=message):
        coefficients(strip, effect, 1)
