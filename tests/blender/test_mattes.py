"""Mattes and ramps in Blender: files, strips of the edit, as they are trimmed and retimed, and what becomes of them."""

import functools
import json
import shutil

import av
import numpy as np
import pytest
from support import copy_all, effect_of, image_strip, in_sequencer, recipe, request, sequencer, write_frames
from test_mask_reading import draw

from shutter_addon.blender.data import annotations, recipe_import, selection, source_media, strips
from shutter_addon.blender.interface import region_gizmo
from shutter_addon.blender.output import matte_export
from shutter_addon.blender.rendering import invalidation, sessions
from shutter_addon.core import revision
from shutter_addon.core.frames import light
from shutter_addon.core.recipes import recipe_file, records
from shutter_addon.media.image_writing import write_exr

WIDTH, HEIGHT, COUNT = 48, 32, 12
OPTIONS = {"light": "encoded", "interpolation": "value"}


@pytest.fixture(scope="module")
def footage(tmp_path_factory):
    """Frames of one grey each, 10 levels apart; the first one's path."""
    frames = [np.full((HEIGHT, WIDTH, 3), 20 + 10 * i, np.uint8) for i in range(COUNT)]
    return write_frames(tmp_path_factory.mktemp("footage"), frames)


def values(index):
    """What frame `index` of a matte says (H, W), 0 to 255: not the same anywhere, nor at any two frames."""
    y, x = np.indices((HEIGHT, WIDTH))
    return ((x * 5 + y * 3 + index * 17) % 256).astype(np.uint8)


@pytest.fixture
def matte(tmp_path):
    """Its first file."""
    return write_frames(tmp_path / "matte", [np.stack([values(i)] * 3, axis=-1) for i in range(COUNT)], "m")


def region(path=None, **fields):
    kind = {"kind": "matte", "path": str(path)} if path else {"kind": "ramp"}
    return {"name": "m", "shutter": "S1", **kind, **fields}


def data(*regions, **options):
    """Where a matte is 1, the frame after the shown one is seen, else the shown one."""
    return recipe(2, [1, 0], [0, 1], regions=regions, **OPTIONS | options)


@pytest.fixture
def shown(bpy, edit, footage):
    """Makes an effect of a recipe; its strip, the effect, and a function that gives the coefficients of its second
    shutter (H, W), as the pictures at a timeline frame show them."""

    def show(content, change=lambda source: None):
        source = image_strip(edit, footage)
        change(source)
        strip, effect = effect_of(edit, source, content)

        return strip, effect, functools.partial(coefficients_of, edit, effect, strip)

    yield show
    sessions.forget()


def coefficients_of(edit, effect, strip, frame):
    asked = request(edit, effect, strip, frame)
    levels = 255 * light.to_encoded(asked.picture()[..., 0].astype(float))
    return (levels - (20 + 10 * asked.index)) / 10


def strip_of(edit, path, frame=1, count=COUNT, name="matte"):
    found = edit.sequence_editor.strips.new_image(name, str(path), 4, frame)
    for i in range(2, count + 1):
        found.elements.append(f"m{i:04d}.png")
    return found


def close(found, expected):
    """To a hundredth: a picture's levels lie ten apart."""
    return np.abs(found - expected).max() < 0.01


def test_a_file_follows_the_footage(shown, matte):
    """Trimmed and in reverse, the matte's frames stay with those they belong to."""

    def change(source):
        source.left_handle = 4
        source.use_reverse_frames = True

    _strip, _effect, coefficients = shown(data(region(matte)), change)
    for frame in (4, 7, 11):
        # the last frame has none after it
        assert close(-coefficients(frame), values(COUNT - frame) / 255)


def test_the_timeline_and_an_offset(shown, matte):
    content = data(region(matte, timing="timeline", offset=2))
    _strip, _effect, coefficients = shown(content, lambda source: setattr(source, "left_handle", 4))
    assert close(coefficients(6), values(6 - 4 + 2) / 255)
    assert close(coefficients(11), values(9) / 255)


def test_a_file_without_colours_has_a_channel_by_name(bpy, edit, shown, tmp_path):
    write_exr(tmp_path / "0001.exr", np.full((HEIGHT, WIDTH, 1), 0.25, np.float32), ["S1"])
    strip, effect, coefficients = shown(data())
    edit.sequence_editor.active_strip, effect.active_shutter = strip, 1
    with sequencer(bpy):
        with pytest.raises(RuntimeError, match="no colour channels, only S1"):
            bpy.ops.shutter.matte_add(filepath=str(tmp_path / "0001.exr"))
        bpy.ops.shutter.matte_add(filepath=str(tmp_path / "0001.exr"), channel_name="S1")
    assert close(coefficients(2), 0.25)


def test_a_strip_is_read_as_it_is_trimmed_muted_and_retimed(edit, shown, matte):
    _strip, effect, coefficients = shown(data(region(matte)))
    own = strip_of(edit, matte, 5)
    own.mute, own.use_reverse_frames = True, True
    effect.regions[0].matte = "STRIP"
    effect.regions[0].strip_name = own.name
    assert close(coefficients(7), values(COUNT - 3) / 255)
    assert close(coefficients(2), values(COUNT - 1) / 255)  # before it begins
    own.use_reverse_frames = False
    assert close(coefficients(7), values(2) / 255)
    own.name = "another name"
    assert effect.regions[0].strip_name == "another name"
    assert close(coefficients(7), values(2) / 255)
    right = own.split(frame=8, split_method="SOFT")
    right.content_start -= 2
    assert close(coefficients(7), values(2) / 255)
    assert close(coefficients(9), values(6) / 255)
    for part in (own, right):
        edit.sequence_editor.strips.remove(part)
    with pytest.raises(Exception, match='region "m": its matte strip was deleted'):
        coefficients(7)


def test_a_file_is_moved_with_its_mattes(bpy, edit, shown, matte, footage, tmp_path):
    """Chosen after the file was saved, and before that; then appended to another file, and linked."""
    first = tmp_path / "here"
    first.mkdir()
    for folder in (matte.parent, footage.parent):
        shutil.copytree(folder, first / folder.name)
    edit.name = "Edit"
    content = data(region(first / "matte" / "m0001.png"))
    shown(content, lambda source: setattr(source, "directory", str(first / footage.parent.name)))
    bpy.ops.wm.save_as_mainfile(filepath=str(first / "edit.blend"))
    (effect,) = edit.virtual_shutter.effects
    recipe_import.apply(edit, effect, strips.effect_strips(edit)[0], recipe_file.parse(json.dumps(content)))
    assert effect.regions[0].image.filepath == "//matte/m0001.png"
    bpy.ops.wm.save_mainfile()
    first.rename(tmp_path / "there")
    moved = str(tmp_path / "there" / "edit.blend")

    def assert_shown():
        edit = bpy.data.scenes["Edit"]
        (effect,) = edit.virtual_shutter.effects
        assert close(coefficients_of(edit, effect, strips.effect_strips(edit)[0], 3), values(2) / 255)

    bpy.ops.wm.open_mainfile(filepath=moved)
    assert_shown()
    for link in (False, True):
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        with bpy.data.libraries.load(moved, link=link) as (_there, here):
            here.scenes = ["Edit"]
        assert_shown()


def test_a_copy_of_a_strip_is_another_matte(bpy, edit, shown, matte):
    """Of the source, given other files, and of a matte; the parts of one that was cut are one."""
    _strip, effect, _coefficients = shown(data(region(matte), region(matte, name="n")))
    strips = edit.sequence_editor.strips
    own = strip_of(edit, matte, 3)
    own.virtual_shutter_source = effect.source
    one, other = effect.regions
    for each in (one, other):
        each.matte, each.strip_name = "STRIP", own.name
        assert each.strip_name == own.name
    copy = strip_of(edit, matte, 1, name="copy")
    copy.virtual_shutter_source, copy.virtual_shutter_matte = own.virtual_shutter_source, own.virtual_shutter_matte
    other.strip_name = copy.name
    assert (one.strip_name, other.strip_name) == (own.name, copy.name)
    right = copy.split(frame=6, split_method="SOFT")
    one.strip_name = right.name
    assert one.strip == other.strip
    strips.remove(copy)
    assert other.strip_name == right.name


def test_sentences_for_what_is_not_there(bpy, edit, shown, matte):
    _strip, effect, coefficients = shown(data(region(matte)))
    one = effect.regions[0]
    matte.with_name("m0006.png").write_bytes(b"no picture")
    with pytest.raises(Exception, match=r"m0006\.png"):
        coefficients(6)
    assert close(coefficients(7), values(6) / 255)
    generated = bpy.data.images.new("generated", 4, 4)
    edit.sequence_editor.strips.new_effect("color", "COLOR", 6, 1, length=5)
    for changed, sentence in (
        ({"channel": "NAMED"}, 'region "m": its channel has no name'),
        ({"channel_name": "Depth.Z"}, r"m0001\.png: has no channel Depth\.Z"),
        ({"channel": "RED", "image": None}, 'region "m": it has no matte file'),
        ({"image": generated}, 'image "generated" is not a movie, image sequence or picture on disk'),
        ({"matte": "STRIP"}, 'region "m": it has no matte strip'),
        ({"strip_name": "color"}, 'its matte strip "color" is not a movie, image or clip strip'),
        ({"matte": "MASK"}, 'region "m": it has no mask'),
    ):
        for name, value in changed.items():
            setattr(one, name, value)
        with pytest.raises(Exception, match=sentence):
            coefficients(7)
    one.opacity = 0
    one.kind = "RAMP"
    assert close(coefficients(7), 0)


def test_a_frame_that_is_written_again_is_read_again(shown, matte):
    """In its file, which leaves the first file and the folder as they are."""
    _strip, _effect, coefficients = shown(data(region(matte)))
    assert close(coefficients(6), values(5) / 255)
    matte.with_name("m0006.png").write_bytes(matte.read_bytes())
    source_media.look_again()
    assert close(coefficients(6), values(0) / 255)


def test_the_stream_of_a_movie_strip(edit, shown, tmp_path):
    path = tmp_path / "two.mkv"
    with av.open(str(path), "w") as out:
        streams = [out.add_stream("ffv1", rate=25) for _ in range(2)]
        for stream in streams:
            stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "gray"
        for stream, grey in zip(streams, (51, 102), strict=True):
            frame = av.VideoFrame.from_ndarray(np.full((HEIGHT, WIDTH), grey, np.uint8), "gray")
            out.mux([*stream.encode(frame), *stream.encode()])
    _strip, effect, coefficients = shown(data(region(ramp="linear")))
    own = edit.sequence_editor.strips.new_movie("movie", str(path), 4, 1)
    one = effect.regions[0]
    one.kind, one.matte, one.strip_name = "MATTE", "STRIP", own.name
    assert close(coefficients(1), 0.2)
    own.stream_index = 1
    assert close(coefficients(1), 0.4)


def test_export_writes_strips_and_points_to_files(edit, shown, matte, tmp_path):
    content = data(
        region(matte, offset=1, channel="green", opacity=0.25),
        region(matte, name="strip/1", width=0.0),
        region(ramp="radial", keys=[{"frame": 1, "location": [0.25, 0]}], blend="add", name="r"),
        region(ramp="luminance", opacity=0.5, name="l"),
    )
    strip, effect, coefficients = shown(content)
    own = strip_of(edit, matte, 3, 6)
    effect.regions[1].matte, effect.regions[1].strip_name = "STRIP", own.name
    (tmp_path / "out").mkdir()

    def export(name):
        path = tmp_path / "out" / name
        recipe_file.save(matte_export.recipe_for(edit, effect, strip, path), path)
        return recipe_file.load(path)

    saved = export("r.json")
    said, before = (records.recipe_of(each)["regions"] for each in (saved, recipe_file.parse(json.dumps(content))))
    assert said[0] == before[0] | {"path": "../matte/m0001.png"}
    assert said[1]["path"] == "r mattes/2 strip_1/0001.png"
    before = [coefficients(frame) for frame in (1, 4, 10)]
    edit.sequence_editor.strips.remove(own)
    recipe_import.apply(edit, effect, strip, saved, tmp_path / "out")
    for frame, expected in zip((1, 4, 10), before, strict=True):
        assert close(coefficients(frame), expected)
    assert records.recipe_of(export("again.json")) == records.recipe_of(saved)


def test_an_export_spares_what_it_reads(edit, shown, matte, tmp_path):
    """A strip of the pictures that an export has written."""
    strip, effect, _coefficients = shown(data(region(matte)))
    one = effect.regions[0]
    one.matte, one.strip_name = "STRIP", strip_of(edit, matte).name
    matte_export.recipe_for(edit, effect, strip, tmp_path / "r.json")
    written = tmp_path / "r mattes" / "1 m" / "0001.png"
    one.strip_name = edit.sequence_editor.strips.new_image("again", str(written), 5, 1).name
    with pytest.raises(Exception, match="1 m: its pictures are read by the effect"):
        matte_export.recipe_for(edit, effect, strip, tmp_path / "r.json")
    assert matte_export.recipe_for(edit, effect, strip, tmp_path / "other.json").regions


@pytest.fixture
def mask(bpy, edit):
    """All of the picture and more, by half."""
    mask = bpy.data.masks.new("mask")
    layer = mask.layers.new(name="layer")
    layer.alpha = 0.5
    draw(layer, ((-1, -1), (2, -1), (2, 2), (-1, 2)), types=("VECTOR", "VECTOR"))
    return mask


def test_a_mask_is_exported_as_pictures(shown, mask, tmp_path):
    strip, effect, coefficients = shown(data(region(ramp="linear", opacity=0.5)))
    one = effect.regions[0]
    one.kind, one.matte, one.mask = "MATTE", "MASK", mask
    expected = coefficients(7)
    saved = matte_export.recipe_for(strip.id_data, effect, strip, tmp_path / "r.json")
    recipe_import.apply(strip.id_data, effect, strip, saved, tmp_path)
    assert effect.regions[0].matte == "IMAGE"
    assert close(coefficients(7), expected)
    assert close(coefficients(7), np.full((HEIGHT, WIDTH), 0.25))


def test_handles_of_a_ramp(bpy, edit, shown, monkeypatch):
    """About the middle of the line that it runs along."""
    strip, effect, _coefficients = shown(data(region(ramp="linear")))
    selection.choose(edit, strip)
    effect.active_shutter, ramp = 1, effect.regions[0]
    ramp.location, ramp.rotation, ramp.scale = (0.1, 0), np.pi / 2, 0.5
    # Without a window, a region has no pixels.
    monkeypatch.setattr(annotations, "picture_to_region", lambda *_: np.eye(3))
    with sequencer(bpy):
        where = region_gizmo.place(bpy.context)
        assert np.allclose(where.centre, (0.6, 0.5))
        assert np.allclose(where.corner, (0.6, 0.5 + 0.125 * WIDTH / HEIGHT))
        ramp.ramp = "LUMINANCE"
        assert region_gizmo.place(bpy.context) is None
        handle = region_gizmo.SHUTTER_GT_region
        pressed = handle.invoke(handle, bpy.context, None)
        assert pressed == {"CANCELLED"}, "a handle that was there a moment ago moves nothing"


def test_cut_and_pasted_effects_have_their_mattes(bpy, edit, shown, matte, mask):
    """The strip that is a matte is cut and pasted as well, and has another name by then."""
    _strip, effect, coefficients = shown(data(region(matte), region(matte, name="n"), region(matte, name="o")))
    own, image = strip_of(edit, matte, 3), effect.regions[0].image
    effect.regions[1].matte, effect.regions[1].strip_name = "STRIP", own.name
    effect.regions[2].matte, effect.regions[2].mask, effect.regions[2].opacity = "MASK", mask, 0.5
    before = coefficients(7)
    edit.frame_set(1)
    copy_all(bpy)
    in_sequencer(bpy, bpy.ops.sequencer.delete)
    assert not edit.virtual_shutter.effects
    edit.sequence_editor.strips.new_effect("matte", "COLOR", 8, 1, length=5)
    in_sequencer(bpy, bpy.ops.sequencer.paste)
    (effect,) = edit.virtual_shutter.effects
    assert (effect.regions[0].image, effect.regions[2].mask) == (image, mask)
    assert effect.regions[1].strip_name == "matte.001"
    assert close(coefficients_of(edit, effect, strips.effect_strips(edit)[0], 7), before)


def test_a_changed_mask_drops_finished_frames(bpy, edit, shown, matte, mask):
    _strip, effect, _coefficients = shown(data(region(matte)))
    effect.regions[0].matte, effect.regions[0].mask = "MASK", mask
    layer = mask.layers[0]
    point = layer.splines[0].points[0]
    clip = bpy.data.movieclips.load(str(matte))
    clip.tracking.tracks.new(name="T", frame=1)

    def parented():
        parent = point.parent
        parent.id_type, parent.id, parent.parent, parent.sub_parent = "MOVIECLIP", clip, "Camera", "T"

    changes = {
        "point": lambda: setattr(point, "co", (0.1, 0.3)),
        "feather": lambda: setattr(point, "weight", 0.1),
        "layer": lambda: setattr(layer, "invert", True),
        "opacity": lambda: layer.keyframe_insert("alpha", frame=1),
        "still": lambda: layer.keyframe_delete("alpha", frame=1),
        "parent": parented,
        "removed": lambda: bpy.data.masks.remove(mask),
    }
    invalidation.invalidate_changed(edit)
    for name, change in changes.items():
        number = revision.edit.number
        change()
        bpy.context.view_layer.update()  # whose handler looks for what has changed
        assert revision.edit.number > number + 1, name
        assert not invalidation.invalidate_changed(edit), name


def test_copies_of_a_matte_strip(edit, shown, matte):
    _strip, effect, coefficients = shown(data(region(matte)))
    own = strip_of(edit, matte, 3, 4)
    effect.regions[0].matte, effect.regions[0].strip_name = "STRIP", own.name
    copy = strip_of(edit, matte, 7, 6, "copy")
    copy.virtual_shutter_matte = own.virtual_shutter_matte  # as Blender's Duplicate has it
    assert close(coefficients(5), values(2) / 255)
    assert close(coefficients(6), values(3) / 255)
    assert close(coefficients(11), values(4) / 255), "the one that lies there counts"
