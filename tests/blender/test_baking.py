"""Baking: an effect as files that an ordinary strip shows, and the effect again."""

import os
import time
from pathlib import Path

import numpy as np
import pytest
from support import copy_all, in_sequencer, noise, noise_film, picture_of, read_picture, refused

from shutter_addon.blender import command
from shutter_addon.blender.data import selection, strips
from shutter_addon.blender.editing import reconcile
from shutter_addon.blender.output import film_output
from shutter_addon.core import revision
from shutter_addon.core.frames import light
from shutter_addon.features.bake.blender import bake_operators, baked_film
from shutter_addon.media import film_parts

COUNT, SIZE = 9, (24, 40)


def gradients():
    ramp = np.add.outer(np.arange(SIZE[0]) * 3, np.arange(SIZE[1]) * 3) + np.arange(COUNT)[:, None, None] * 6
    return np.repeat(ramp[..., None], 3, -1).astype(np.uint8)


@pytest.fixture
def film(bpy, edit, on_numpy, tmp_path):
    """Makes a saved edit of noise, or of gradients, under an effect, its strip active: scene, effect, strip."""

    def make(channels=3, *, smooth=False):
        edit.render.fps = 25
        frames = gradients() if smooth else noise(COUNT, *SIZE, channels)
        _source, effect, strip = noise_film(edit, frames, tmp_path)
        selection.choose(edit, strip)
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "edit.blend"), relative_remap=False)
        return edit, effect, strip

    return make


def bake(bpy, kind="OPEN_EXR"):
    assert bpy.ops.shutter.bake(file_format=kind) == {"FINISHED"}
    return baked_in(bpy.context.scene)[0]


def baked_in(scene):
    return [strip for strip in scene.sequence_editor.strips_all if "Baked" in strip.name]


def rendered(bpy, scene, folder, frames):
    """The edit's frames as float EXR, by Blender."""
    settings = scene.render.image_settings
    settings.media_type, settings.file_format = "IMAGE", "OPEN_EXR"
    settings.color_depth, settings.exr_codec = "32", "ZIP"
    pictures = []
    for frame in frames:
        scene.frame_set(frame)
        scene.render.filepath = str(folder / f"{frame}")
        bpy.ops.render.render(write_still=True)
        pictures.append(read_picture(folder / f"{frame}.exr"))
    return np.array(pictures)


@pytest.mark.parametrize("channels", [3, 4])
def test_an_exr_has_the_bits_of_the_effect(bpy, film, tmp_path, channels):
    scene, effect, strip = film(channels)
    whole = range(1, COUNT + 1)
    before = rendered(bpy, scene, tmp_path / "effect", whole)
    assert np.ptp(before) > 0.5
    composed = [picture_of(effect.scene, frame) for frame in whole]
    baked = bake(bpy)
    assert strip.mute
    assert baked.channel > strip.channel
    assert (baked.left_handle, baked.right_handle) == (strip.left_handle, strip.right_handle)
    written = [read_picture(Path(bpy.path.abspath(baked.directory)) / element.filename) for element in baked.elements]
    assert (np.array(written) == np.array(composed)[..., :channels]).all()
    # Of the effect's picture Blender's way through the sequencer's colors leaves less.
    assert np.abs(rendered(bpy, scene, tmp_path / "baked", whole) - before).max() < 1e-4


def test_a_movie_is_off_by_little(bpy, film, tmp_path):
    scene, _effect, _strip = film(smooth=True)
    before = rendered(bpy, scene, tmp_path / "effect", (1, 5, 9))
    baked = bake(bpy, "MOVIE")
    assert baked.content_end - baked.content_start == COUNT
    after = rendered(bpy, scene, tmp_path / "baked", (1, 5, 9))
    off = 255 * np.abs(light.to_encoded(after) - light.to_encoded(before))
    assert off.max() <= 5
    assert off.mean() <= 1


def test_unbake_brings_the_effect_back(bpy, film):
    """And leaves a copy of what was baked that was moved away."""
    scene, _effect, strip = film()
    before = {s.name for s in scene.sequence_editor.strips_all}
    baked = bake(bpy)
    place = Path(bpy.path.abspath(baked.directory))
    copy = scene.sequence_editor.strips.new_image("copy", str(place / "0001.exr"), 9, 200)
    copy.virtual_shutter_bake.identity = baked.virtual_shutter_bake.identity
    assert bpy.ops.shutter.unbake() == {"FINISHED"}
    assert {s.name for s in scene.sequence_editor.strips_all} == before | {"copy"}
    assert not strip.mute
    assert len(list(place.glob("*.exr"))) == COUNT  # files stay: baked again, they are found


def states(scene, strip):
    revision.changed()
    parts = bake_operators.effect_parts(scene, strip)
    return [bake_operators.is_stale(scene, strips.effect_of(scene, part.scene), part) for part in parts]


def test_it_says_that_it_is_stale(bpy, film):
    scene, effect, strip = film()
    strip.right_handle = 6
    baked = bake(bpy)

    assert states(scene, strip) == [False]
    effect.shutters[0].bars[1].weight = 0.5
    assert states(scene, strip) == [True]
    effect.shutters[0].bars[1].weight = 1
    effect.shutters[1].name = effect.regions[0].shutter = "another"  # names are no change
    assert states(scene, strip) == [False]
    strip.right_handle = baked.right_handle = strip.right_handle + 4
    assert states(scene, strip) == [True], "it is longer"


@pytest.mark.parametrize("kind", ["SOFT", "HARD"])
def test_both_are_cut_and_nothing_is_lost(bpy, film, tmp_path, kind):
    scene, effect, strip = film()
    before = rendered(bpy, scene, tmp_path / "effect", (3, 6))
    baked = bake(bpy)
    for each in [baked, strip, strips.source_of(scene, effect, strip)][: 3 if kind == "HARD" else 2]:
        each.split(5, kind)
    bpy.context.view_layer.update()
    assert states(scene, strip) == [kind == "HARD"] * 2  # which leaves another content
    selection.choose(scene, baked_in(scene)[1])
    assert bpy.ops.shutter.unbake() == {"FINISHED"}
    assert [s.mute for s in scene.sequence_editor.strips if s.type == "SCENE"] == [False] * 2
    assert not baked_in(scene)
    assert np.abs(rendered(bpy, scene, tmp_path / "after", (3, 6)) - before).max() < 1e-6


@pytest.mark.parametrize("kind", ["exr", "movie"])
def test_the_command_goes_on_where_it_was_broken_off(film, tmp_path, capfd, kind):
    film()
    words = ["bake", str(tmp_path / "edit.blend"), "--strip", "Shutter", "--format", kind]
    assert command.main(words) == 0
    said = capfd.readouterr().out.splitlines()
    place = Path(said[-1])
    counts = [line for line in said if line.endswith(f" of {COUNT}")]
    assert counts == [f"{done} of {COUNT}" for done in range(1, COUNT + 1)]
    assert place.parent == tmp_path / baked_film.FOLDER
    if kind == "movie":
        whole = place.read_bytes()
        assert film_parts.is_whole_movie(place, COUNT)
        assert not place.with_suffix(".parts").exists()
        place.write_bytes(whole[: len(whole) // 2])  # as a full disk leaves it, or a process that was killed
        assert command.main(words[:-2]) == 0
        assert place.read_bytes() == whole
        return
    pictures = sorted(place.iterdir())
    kept, lost, broken = pictures[0].stat().st_mtime_ns, pictures[3], pictures[5]
    whole = {path: path.read_bytes() for path in pictures}
    lost.unlink()
    broken.write_bytes(whole[broken][:-50])
    assert command.main(words) == 0
    assert {path: path.read_bytes() for path in place.iterdir()} == whole
    assert pictures[0].stat().st_mtime_ns == kept


def test_what_cannot_be_baked_is_one_sentence(film, tmp_path, run):
    film()
    for words, sentence in (
        (["--strip", "Other"], '--strip: there is no Shutter strip "Other"'),
        (["--strip", "Shutter", "--scene", "No"], 'has no scene "No"'),
    ):
        refused(run("bake", tmp_path / "edit.blend", *words), sentence)


def test_a_copy_of_all_of_it_is_unbaked_alone(bpy, film):
    scene, _effect, strip = film()
    bake(bpy)
    copy_all(bpy)
    scene.frame_set(101)
    in_sequencer(bpy, bpy.ops.sequencer.paste)
    assert len(scene.sequence_editor.strips) == 6
    reconcile.update()
    selection.choose(scene, strip)
    bpy.ops.shutter.unbake()
    assert len(baked_in(scene)) == 1
    copied = next(each for each in scene.sequence_editor.strips_all if each.type == "SCENE" and each != strip)
    assert copied.mute
    assert not strip.mute
    assert states(scene, copied) == [False]


def test_the_baked_strip_looks_as_the_effect_strip(bpy, film, tmp_path):
    """Transform, crop, flip and opacity, keys included, and in a meta strip."""
    scene, _effect, strip = film(4)
    strip.transform.offset_x, strip.transform.rotation, strip.crop.min_y = 3, 0.2, 4
    strip.transform.scale_x, strip.use_flip_x, strip.color_saturation = 0.5, True, 0.4
    for frame, opacity in ((1, 1.0), (9, 0.2)):
        strip.blend_alpha = opacity
        strip.keyframe_insert("blend_alpha", frame=frame)
        strip.transform.offset_y = frame
        strip.transform.keyframe_insert("offset_y", frame=frame)
    meta = scene.sequence_editor.strips.new_meta("Meta", 3, 1)
    meta.right_handle = COUNT + 1
    for each in list(scene.sequence_editor.strips):
        if each != meta:
            each.move_to_meta(meta)
    shown = (2, 6)
    before = rendered(bpy, scene, tmp_path / "effect", shown)
    assert bake(bpy).parent_meta() == meta
    after = rendered(bpy, scene, tmp_path / "baked", shown)
    assert np.ptp(before[0] - before[1]) > 0.1
    assert np.abs(after - before).max() < 1e-4
    bpy.ops.shutter.unbake()
    assert (rendered(bpy, scene, tmp_path / "again", shown) == before).all()


@pytest.mark.parametrize("change", ["location", "weight"])
def test_keys_that_moved_along_are_no_change_and_others_are(bpy, film, change):
    """Between keys Blender gives other floats at other frames."""
    scene, effect, strip = film()
    owner, name = (effect.regions[0], "location") if change == "location" else (effect.shutters[0].bars[1], "weight")
    for frame, value in ((1, 0.1), (4, 0.73), (9, 0.31)):
        setattr(owner, name, (value, 0) if change == "location" else value)
        owner.keyframe_insert(name, frame=frame)
    bake(bpy)
    assert states(scene, strip) == [False]
    for each in scene.sequence_editor.strips:
        each.content_start += 1007
    reconcile.update()
    assert states(scene, strip) == [False]
    point = scene.animation_data.action.layers[0].strips[0].channelbags[0].fcurves[0].keyframe_points[1]
    point.handle_right[0] += 0.5
    assert states(scene, strip) == [True]


@pytest.mark.parametrize("is_deleted", [False, True])
def test_what_lies_above_stays_above(bpy, film, tmp_path, is_deleted):
    """A title above the effect, with room above it alone; by a second bake as well, and where its strip is deleted."""
    scene, _effect, strip = film()
    title = scene.sequence_editor.strips.new_effect("title", "COLOR", strip.channel + 1, 1, length=COUNT)
    title.color, title.blend_type, title.transform.scale_x = (0, 1, 0), "ALPHA_OVER", 0.5
    scene.sequence_editor.channels[strip.channel + 2].mute = True
    before, channel = rendered(bpy, scene, tmp_path / "effect", (4,)), strip.channel
    baked = bake(bpy)
    assert np.abs(rendered(bpy, scene, tmp_path / "baked", (4,)) - before).max() < 1e-4
    assert (baked.channel, title.channel, strip.channel) == (channel, channel + 1, channel + 3)
    again = bake(bpy)
    assert (again.channel, title.channel, strip.channel) == (channel, channel + 1, channel + 3)
    if is_deleted:
        scene.sequence_editor.strips.remove(again)
    bpy.ops.shutter.unbake()
    assert strip.channel == channel
    assert (rendered(bpy, scene, tmp_path / "again", (4,)) == before).all()


def test_what_cannot_stand_in_is_refused(bpy, film):
    scene, _effect, strip = film(4)

    def refuses(sentence, kind="OPEN_EXR"):
        with pytest.raises(RuntimeError, match=sentence):
            bpy.ops.shutter.bake(file_format=kind)
        assert not strip.mute

    refuses("a movie has no transparency: bake to OpenEXR", "MOVIE")
    strip.strobe = 3
    refuses("is retimed, strobed or reversed")
    strip.strobe = 1
    scene.sequence_editor.strips.new_effect("blur", "GAUSSIAN_BLUR", 5, 1, length=COUNT, input1=strip)
    refuses("is the input of another strip")


def test_an_edit_that_is_not_saved_is_not_baked(bpy, edit, tmp_path):
    noise_film(edit, gradients(), tmp_path)
    with pytest.raises(RuntimeError, match="save it first"):
        bpy.ops.shutter.bake(file_format="OPEN_EXR")


def test_a_transparent_source_stays_muted_below_what_was_baked_of_it(bpy, film, tmp_path):
    scene, _effect, strip = film(4)
    bake(bpy)
    before = rendered(bpy, scene, tmp_path / "baked", (4,))
    scene.sequence_editor.strips.remove(strip)
    reconcile.update()
    assert (rendered(bpy, scene, tmp_path / "left", (4,)) == before).all()


def test_a_bake_leaves_no_copy(bpy, film, tmp_path):
    scene, effect, strip = film()
    left = tmp_path / baked_film.FOLDER / f".part-{0:016x}"  # of a killed bake
    left.mkdir(parents=True)
    os.utime(left, (0, 0))
    job = baked_film.start(scene, effect, strip, baked_film.film_of(scene, effect, strip, "OPEN_EXR"))
    try:
        assert not left.exists()
        assert job.process.wait(60) == 0
        assert not job.copy.exists(), "it has been read"
        assert job.failure() is None
        assert job.done() == COUNT
    finally:
        job.end()
    assert not list(tmp_path.glob("*.bake-*"))
    assert not list((tmp_path / baked_film.FOLDER).glob(".*"))


def test_a_job_tells_why_it_failed(bpy, film, tmp_path):
    scene, effect, strip = film()
    film_ = baked_film.film_of(scene, effect, strip, "OPEN_EXR")
    film_.place.parent.mkdir()
    film_.place.write_bytes(b"")
    job = baked_film.start(scene, effect, strip, film_)
    try:
        assert job.process.wait(60) == 2
        assert baked_film.FOLDER in job.failure()
        assert not job.failure().startswith("Virtual Shutter")
    finally:
        job.end()


def test_a_bake_ends_with_the_blender_that_began_it(bpy, film):
    scene, effect, strip = film()
    strip.right_handle = 3000  # it takes long
    job = baked_film.start(scene, effect, strip, baked_film.film_of(scene, effect, strip, "OPEN_EXR"))
    try:
        while not job.done():
            assert not job.is_over(), job.failure()
            time.sleep(0.05)
        job.process.stdin.close()  # as when that is killed
        assert job.process.wait(30) == film_output.INTERRUPTED
        assert 0 < job.done() < 2990
    finally:
        job.end()


@pytest.mark.skipif(os.name != "posix", reason="links need no rights there alone")
@pytest.mark.parametrize(("kind", "name"), [("OPEN_EXR", "0001.exr"), ("MOVIE", "0001.mp4")])
def test_nothing_is_baked_or_removed_behind_a_link(bpy, film, tmp_path, kind, name):
    scene, effect, strip = film()
    place = baked_film.film_of(scene, effect, strip, kind).place
    (outside := tmp_path / "outside").mkdir()
    (outside / name).write_bytes(b"mine")
    place.parent.mkdir()
    (link := place if kind == "OPEN_EXR" else place.with_suffix(".parts")).symlink_to(outside)
    with pytest.raises(RuntimeError, match="it is a link, and none is followed"):
        bpy.ops.shutter.bake(file_format=kind)
    link.unlink()
    bake(bpy, kind)
    if not link.exists():
        link.symlink_to(outside)
    bake(bpy, kind)
    assert [(path.name, path.read_bytes()) for path in outside.iterdir()] == [(name, b"mine")]
