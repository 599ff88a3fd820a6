"""Saved edits, rendered by many processes in chunks: the same bits as Blender's own render, each frame once."""

import os
import random
import shutil
from dataclasses import replace

import numpy as np
import pytest
from support import flip_bit, noise_film, read_picture, refused

from shutter_addon.blender.data import versions
from shutter_addon.core.farm import job_file

COUNT = 14  # frames


@pytest.fixture
def save(bpy, tmp_path):
    """Saves the edit that is open, with the paths of its footage relative to it."""

    def saved(name="edit.blend"):
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / name))
        bpy.ops.file.make_paths_relative()
        bpy.ops.wm.save_mainfile()
        return tmp_path / name

    return saved


@pytest.fixture
def saved(bpy, edit, save, tmp_path):
    """An edit that is more than a source and its effect: the source goes on behind the effect, which lets it shine
    through, below a second strip of footage; with dither, a view transform and a size of its own."""
    noise = np.random.default_rng(3).integers(0, 256, (COUNT, 24, 40, 3), dtype=np.uint8)
    _source, _effect, strip = noise_film(edit, noise, tmp_path)
    strip.blend_alpha = 0.75
    strip.right_handle = COUNT - 1
    other = edit.sequence_editor.strips.new_image("other", str(tmp_path / "in" / "f0001.png"), 5, 4)
    other.right_handle, other.blend_alpha = 9, 0.25
    edit.view_settings.view_transform, edit.render.dither_intensity = "AgX", 1
    edit.render.resolution_x, edit.render.resolution_y, edit.render.resolution_percentage = 80, 48, 50
    edit.frame_step = 3
    return save()


def bits(folder, ending="png"):
    return {path.name: read_picture(path).tobytes() for path in sorted(folder.glob(f"*.{ending}"))}


def places(folder):
    """What changes where a file is written anew."""
    return {path.name: (path.stat().st_ino, path.stat().st_mtime_ns) for path in folder.glob("*.png")}


@pytest.mark.parametrize("file_format", ["png", "exr"])
def test_chunks_in_any_order_are_blenders_own_render(bpy, saved, run, tmp_path, file_format):
    chunks = ["1:3", "4", "5-11", "12:14"]
    random.Random(7).shuffle(chunks)
    for chunk in chunks:
        more = ["--resume"] if chunk == "4" else []
        output = "--output", tmp_path / "out", "--format", file_format
        assert run("render", saved, *output, "--frames", chunk, *more) == (0, "")
    bpy.ops.wm.open_mainfile(filepath=str(saved))
    scene = bpy.context.scene
    settings = scene.render.image_settings
    settings.media_type = "IMAGE"
    settings.file_format, settings.color_depth = {"png": ("PNG", "16"), "exr": ("OPEN_EXR", "32")}[file_format]
    scene.render.filepath, scene.frame_step = str(tmp_path / "own") + "/", 1
    bpy.ops.render.render(animation=True)
    found = bits(tmp_path / "out", file_format)
    assert found == bits(tmp_path / "own", file_format)
    assert list(found) == [f"{frame:04d}.{file_format}" for frame in range(1, COUNT + 1)]
    assert len(set(found.values())) == COUNT
    assert sorted(os.listdir(tmp_path / "out")) == list(found)


def test_resume_renders_what_is_missing_damaged_or_of_another_version(bpy, saved, run, tmp_path):
    out, other = tmp_path / "out", tmp_path / "other"
    assert run("render", saved, "--output", out)[0] == 0
    whole, before = bits(out), places(out)
    assert run("render", saved, "--output", out, "--resume") == (0, "")
    assert places(out) == before
    bpy.ops.wm.open_mainfile(filepath=str(saved))
    bpy.context.scene.sequence_editor.strips["other"].blend_alpha = 0.5
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "changed.blend"))
    assert run("render", tmp_path / "changed.blend", "--output", other, "--frames", "5")[0] == 0
    assert bits(other)["0005.png"] != whole["0005.png"]
    (out / "0002.png").unlink()
    flip_bit(out / "0003.png")
    content = (out / "0003.png").read_bytes()
    (out / "0004.png").write_bytes(content[: len(content) // 2])
    shutil.copy(other / "0005.png", out / "0005.png")
    shutil.copy(tmp_path / "in" / "f0007.png", out / "0007.png")
    before = places(out)
    assert run("render", saved, "--output", out, "--resume") == (0, "")
    after = places(out)
    changed = [name for name in sorted(after) if after[name] != before.get(name)]
    assert changed == ["0002.png", "0003.png", "0004.png", "0005.png", "0007.png"]
    assert bits(out) == whole
    assert sorted(os.listdir(out)) == sorted(whole)
    footage = tmp_path / "in" / "f0014.png"
    footage.write_bytes(footage.read_bytes()[:-12] + bytes(12))  # other content: all is of another version
    assert run("render", saved, "--output", out, "--resume", "--frames", "1:2")[0] == 0
    assert [name for name in sorted(after) if places(out)[name] != after[name]] == ["0001.png", "0002.png"]


@pytest.mark.parametrize("codec", ["NONE", "DWAA"])
def test_a_damaged_exr_is_rendered_again(bpy, saved, run, save, tmp_path, codec):
    """Whatever codec the edit has: not all have checksums, nor are all lossless."""
    bpy.context.scene.render.image_settings.exr_codec = codec
    out = "--output", tmp_path / "out", "--format", "exr", "--frames", "1:2"
    assert run("render", save(), *out)[0] == 0
    whole = bits(tmp_path / "out", "exr")
    flip_bit(tmp_path / "out" / "0002.exr")
    assert run("render", saved, *out, "--resume")[0] == 0
    assert bits(tmp_path / "out", "exr") == whole


@pytest.mark.parametrize("resume", [[], ["--resume"]])
def test_a_job_of_a_newer_version_ends_an_older_ones_render(bpy, saved, run, tmp_path, resume):
    bpy.ops.wm.open_mainfile(filepath=str(saved))
    newer = replace(versions.of_edit(bpy.context.scene), blend="00" * 32)
    out = tmp_path / "out"

    @bpy.app.handlers.persistent
    def begin_newer(scene, *_):
        if scene.frame_current == 3:  # it was rendered, and is not yet moved to its place
            job_file.write(out, newer)

    bpy.app.handlers.render_write.append(begin_newer)
    done = run("render", saved, "--output", out, *resume)
    bpy.app.handlers.render_write.remove(begin_newer)
    refused(done, job_file.NAME, "another version of the .blend file")
    assert sorted(os.listdir(out)) == ["0001.png", "0002.png", job_file.NAME]


def test_missing_media_are_those_of_the_frames(bpy, edit, run, save, tmp_path):
    def image(name):
        made = bpy.data.images.new(name, 4, 4)
        made.source, made.filepath = "FILE", str(tmp_path / name)
        return made

    room, material = bpy.data.scenes.new("Room"), bpy.data.materials.new("paint")
    mesh = bpy.data.meshes.new("mesh")
    mesh.materials.append(material)
    room.collection.objects.link(bpy.data.objects.new("thing", mesh))
    tree = material.node_tree
    tree.nodes.new("ShaderNodeTexImage").image = image("paint.png")
    tiles = image("wood.<UDIM>.png")
    tiles.source = "TILED"
    tiles.tiles.new(1012)
    (tmp_path / "wood.1001.png").write_bytes(b"wood")
    tree.nodes.new("ShaderNodeTexImage").image = tiles
    image("unused.png").use_fake_user = True
    new = edit.sequence_editor.strips
    new.new_effect("grey", "COLOR", 1, 1, length=9)
    new.new_scene("room", room, 3, 4).right_handle = 7
    edit.frame_start, edit.frame_end = 1, 9
    edit.render.resolution_x, edit.render.resolution_y = 16, 8
    saved, out = save(), ("--output", tmp_path / "out")
    assert run("check", saved, "--frames", "1:3") == (0, "")
    assert run("render", saved, "--frames", "3", *out) == (0, "")
    code, said = run("check", saved, "--frames", "3:4")
    assert code == 2
    faults = ['image "paint.png": paint.png: no such', 'image "wood.<UDIM>.png": wood.1012.png: no such']
    assert [any(fault in line for line in said.splitlines()) for fault in faults] == [True, True]
    assert len(said.splitlines()) == 2
    refused(run("render", saved, "--frames", "3:4", *out), "no such file in")
    assert sorted(os.listdir(tmp_path / "out")) == ["0003.png"]


def test_what_cannot_be_done_is_one_sentence(bpy, saved, run, save, tmp_path):
    out = "--output", tmp_path / "out"
    (tmp_path / "folder.blend").mkdir()
    for arguments, *words in [
        ((saved,), "--output"),
        ((saved, "--output", tmp_path / "film.mp4"), "film.mp4", "folder of pictures"),
        ((saved, *out, "--recipe", tmp_path / "r.json"), "--recipe"),
        ((saved, *out, "--weights", tmp_path / "w"), "--weights"),
        ((saved, *out, "--frames", "3:15"), "3:15", "the edit's frames 1:14"),
        ((saved, *out, "--frames", "3:"), "3:"),
        ((tmp_path / "none.blend", *out), "none.blend", "no such file"),
        ((tmp_path / "folder.blend", *out), "folder.blend", "is no file"),
        ((tmp_path / "in" / "f0001.png", *out), "--recipe"),
        ((tmp_path / "in" / "f0001.png", *out, "--recipe", tmp_path / "r.json", "--resume"), "--resume"),
    ]:
        refused(run("render", *arguments), *words)
    for content in (b"", b"BLENDER nonsense", saved.read_bytes()[:5000]):
        (tmp_path / "bad.blend").write_bytes(content)
        refused(run("render", tmp_path / "bad.blend", *out), "bad.blend")
    bpy.ops.wm.open_mainfile(filepath=str(saved))
    bpy.context.scene.render.use_stamp = True
    refused(run("render", save("burnt.blend"), *out, "--resume"), "--resume", "Burn Into Image")
    bpy.ops.wm.open_mainfile(filepath=str(saved))
    name, bpy.context.window.scene = bpy.context.scene.name, bpy.data.scenes.new("Empty")
    refused(run("render", save("two.blend"), *out), "Empty", f'make "{name}" the active one')
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("place", ["nowhere", "inner", "material"])
def test_a_driver_that_needs_scripts_is_named(bpy, edit, run, save, tmp_path, place):
    """Wherever it drives what the edit shows; others are nobody's concern, nor are those that Blender does evaluate."""
    edit.sequence_editor.strips.new_effect("grey", "COLOR", 1, 1, length=2)
    edit.frame_start, edit.frame_end = 1, 2
    edit.render.resolution_x, edit.render.resolution_y = 16, 8
    inner, room = bpy.data.scenes.new("Inner"), bpy.data.scenes.new("Room")
    inner.sequence_editor_create().strips.new_scene("room", room, 1, 1)
    strip = edit.sequence_editor.strips.new_scene("inner", inner, 2, 1)
    strip.scene_input, strip.right_handle = "SEQUENCER", 3
    mesh, material = bpy.data.meshes.new("mesh"), bpy.data.materials.new("Paint")
    mesh.materials.append(material)
    thing, unused = bpy.data.objects.new("Thing", mesh), bpy.data.objects.new("Unused", None)
    room.collection.objects.link(thing)
    thing.driver_add("hide_render").driver.expression = "max([0, 0]) + frame * 0"
    unused.driver_add("hide_render").driver.expression = "bpy.data.is_dirty"
    if place == "nowhere":
        assert run("render", save(), "--output", tmp_path / "out")[0] == 0
        return
    owner, name, path = {
        "inner": (inner, "Inner", "audio_volume"),
        "material": (material.node_tree, "Paint", 'nodes["Principled BSDF"].inputs["IOR"].default_value'),
    }[place]
    owner.driver_add(path).driver.expression = "bpy.context.scene.frame_current"
    code, said = run("render", save(), "--output", tmp_path / "out")
    assert code == 2
    assert f'"{name}" needs scripts, which are not run (bpy.context' in said.splitlines()[-1]  # Blender tells it, too
