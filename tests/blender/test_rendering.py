"""Renders whose pictures fail: they end with a sentence, whoever renders, and nothing without its effect is written."""

import numpy as np
import pytest
from support import effect_of, image_strip, read_picture, recipe, write_frames

from shutter_addon.blender import handlers, rendering
from shutter_addon.blender.data import source_media, strips
from shutter_addon.blender.rendering import render_job, sessions
from shutter_addon.media.rendered_pictures import whole_pictures

BROKEN = 4


@pytest.fixture
def film(bpy, edit, tmp_path):
    """Six frames under an effect that shows them a frame late, to be rendered as pictures; the edit."""
    sessions.forget()
    frames = np.random.default_rng(0).integers(0, 256, (6, 32, 32, 3), dtype=np.uint8)
    effect_of(edit, image_strip(edit, write_frames(tmp_path / "in", frames)), recipe(2, [0, 1]))
    edit.render.resolution_x = edit.render.resolution_y = 32
    edit.frame_start, edit.frame_end = 1, 6
    edit.render.image_settings.media_type = "IMAGE"
    edit.render.image_settings.file_format = "PNG"
    edit.render.use_file_extension = True
    edit.render.filepath = f"{tmp_path / 'out'}/"
    yield edit
    scene = bpy.context.scene  # of whatever file is open now
    render_job.begin(scene)  # which forgets the failure of the one before
    render_job.end(scene, alone=False)


def broken(tmp_path):
    """Damages a frame; what undoes that."""
    path = tmp_path / "in" / f"f{BROKEN:04d}.png"
    data = path.read_bytes()
    path.write_bytes(data[:100])
    return lambda: path.write_bytes(data)


def to_movie(edit, path):
    edit.render.image_settings.media_type = "VIDEO"
    edit.render.ffmpeg.format, edit.render.ffmpeg.codec = "MPEG4", "H264"
    edit.render.use_file_extension = False
    edit.render.filepath = str(path)


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def effect_scene(edit):
    return edit.virtual_shutter.effects[0].scene


def test_a_python_that_uses_blender_lives_on_and_what_follows_knows_nothing_of_the_failure(bpy, film, tmp_path, capfd):
    mend, scene = broken(tmp_path), effect_scene(film)
    for _ in range(2):  # the sequencer keeps what it showed in the failed picture's place
        assert bpy.ops.render.render(animation=True) == {"CANCELLED"}
        assert names(tmp_path / "out") == ["0001.png", "0002.png"]
        said = capfd.readouterr().err
        assert said.count("Virtual Shutter: f0004.png") == 1
        assert "Traceback" not in said
    assert len(bpy.data.scenes) == 2
    assert bpy.ops.render.render(scene=scene.name) == {"FINISHED"}
    film.frame_set(3)
    scene.frame_set(3)
    capfd.readouterr()
    for _ in range(2):  # an effect's own scene ends like any film
        assert bpy.ops.render.render(scene=scene.name) == {"CANCELLED"}
        assert capfd.readouterr().err.count("Virtual Shutter: f0004.png") == 1
    mend()
    sessions.forget()
    assert bpy.ops.render.render(animation=True) == {"FINISHED"}
    assert len(names(tmp_path / "out")) == 6
    expected = read_picture(tmp_path / "in" / "f0004.png")
    assert np.abs(read_picture(tmp_path / "out" / "0003.png")[..., :3] - expected).max() <= 1


def test_a_movie_is_finished_up_to_the_picture_that_fails_and_a_single_frame_not_written(bpy, film, tmp_path):
    broken(tmp_path)
    film.frame_set(3)
    film.render.filepath = str(tmp_path / "still.png")
    assert bpy.ops.render.render(write_still=True) == {"CANCELLED"}
    assert not (tmp_path / "still.png").exists()
    to_movie(film, tmp_path / "film.mp4")
    assert bpy.ops.render.render(animation=True) == {"CANCELLED"}
    assert whole_pictures(tmp_path / "film.mp4") == 2


@pytest.mark.parametrize(
    ("name", "fault", "told"),
    [
        ("pictures.resized", MemoryError(), "not enough memory"),
        ("pictures.picture", KeyboardInterrupt(), "was stopped"),
        ("sessions.of_engine", ValueError("odd"), "internal error"),
    ],
)
def test_no_fault_gives_a_plain_frame(bpy, film, tmp_path, capfd, monkeypatch, name, fault, told):
    def fails(*_arguments):
        raise fault

    module, function = name.split(".")
    monkeypatch.setattr(getattr(rendering, module), function, fails)
    film.render.image_settings.color_depth = "16"  # pictures of 8 bits need no engine
    assert bpy.ops.render.render(animation=True) == {"CANCELLED"}
    assert not (tmp_path / "out").exists()
    assert told in capfd.readouterr().err


def without_camera(bpy, edit, strip):
    bpy.data.objects.remove(strip.scene.camera)


def with_camera_elsewhere(bpy, edit, strip):
    edit.collection.objects.link(strip.scene.camera)
    strip.scene.collection.objects.unlink(strip.scene.camera)


def with_border(bpy, edit, strip):
    strip.scene.render.use_border = True
    strip.scene.render.border_max_x = 0.5


def with_compositing(bpy, edit, strip):
    tree = bpy.data.node_groups.new("Nodes", "CompositorNodeTree")
    if hasattr(strip.scene, "compositor_effects"):  # from Blender 5.3 on
        strip.scene.compositor_effects.new("Nodes").node_group = tree
    else:
        strip.scene.compositing_node_group = tree
    strip.scene.render.use_compositing = True


def with_setting(path, value):
    def change(bpy, edit, strip):
        owner, _, name = path.rpartition(".")
        setattr(strip.path_resolve(owner) if owner else strip, name, value)

    return change


CHANGES = [
    *(without_camera, with_camera_elsewhere, with_border, with_compositing),
    with_setting("scene_input", "SEQUENCER"),
    with_setting("scene.render.engine", "BLENDER_WORKBENCH"),
    with_setting("scene.render.resolution_percentage", 50),
    with_setting("scene.view_layers[0].use", False),
]


@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("late", [True, False])
def test_effects_mend_what_hides_them(bpy, film, tmp_path, change, late):
    """late: no update came before the render, as in a file that was saved by a Blender without the extension."""
    update = handlers.HANDLERS["depsgraph_update_post"]
    film.frame_set(2)
    film.render.filepath = str(tmp_path / "before.png")
    bpy.ops.render.render(write_still=True)
    strip = strips.effect_strips(film)[0]
    if late:
        bpy.app.handlers.depsgraph_update_post.remove(update)
    change(bpy, film, strip)
    strip.invalidate_cache("RAW")
    bpy.context.view_layer.update()
    if not late:
        update()
    film.render.filepath = str(tmp_path / "after.png")
    assert bpy.ops.render.render(write_still=True) == {"FINISHED"}
    if late:
        bpy.app.handlers.depsgraph_update_post.append(update)
    assert len(film.virtual_shutter.effects) == 1
    before, after = (read_picture(tmp_path / name) for name in ("before.png", "after.png"))
    assert np.array_equal(before, after)
    assert np.abs(after[..., :3] - read_picture(tmp_path / "in" / "f0003.png")).max() <= 1


def test_an_effect_that_lost_its_scene_is_no_plain_film(bpy, film, tmp_path, capfd):
    bpy.data.scenes.remove(effect_scene(film))
    film.frame_end = 3
    assert bpy.ops.render.render(animation=True) == {"CANCELLED"}
    assert not (tmp_path / "out").exists()
    assert 'Virtual Shutter: the scene of "Shutter" was deleted' in capfd.readouterr().err
    film.sequence_editor.strips["Shutter"].mute = True
    assert bpy.ops.render.render(animation=True) == {"FINISHED"}
    assert len(names(tmp_path / "out")) == 3


def test_a_linked_effect_that_cannot_be_mended_is_refused(bpy, film, tmp_path, capfd):
    mending = "depsgraph_update_post", "save_pre"
    for name in mending:
        getattr(bpy.app.handlers, name).remove(handlers.HANDLERS[name])
    film.name = "Film"
    bpy.data.objects.remove(effect_scene(film).camera)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"))
    for name in mending:
        getattr(bpy.app.handlers, name).append(handlers.HANDLERS[name])
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, wanted):
        wanted.scenes = ["Film"]
    linked = bpy.data.scenes["Film"]
    bpy.context.window.scene = linked
    assert bpy.ops.render.render(animation=True, scene=linked.name) == {"CANCELLED"}
    assert 'the scene of "Shutter" has no camera' in capfd.readouterr().err
    assert not (tmp_path / "out").exists()


def test_blender_itself_ends_with_exit_code_2(bpy, film, blender, tmp_path):
    """Unless a script renders, which lives on."""
    broken(tmp_path)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "edit.blend"))
    render = "import bpy; print(bpy.ops.render.render(animation=True)); print('ALIVE')"
    done = blender(tmp_path / "edit.blend", "--python-expr", render)
    assert "{'CANCELLED'}\nALIVE" in done.stdout
    assert names(tmp_path / "out") == ["0001.png", "0002.png"]
    to_movie(film, tmp_path / "film.mp4")
    bpy.ops.wm.save_mainfile()
    done = blender(tmp_path / "edit.blend", "-a")
    assert done.returncode == 2, done.stdout + done.stderr
    assert done.stderr.count("Virtual Shutter: f0004.png") == 1
    assert whole_pictures(tmp_path / "film.mp4") == 2


def test_a_scene_within_a_film_does_not_begin_it_again(bpy, film, monkeypatch):
    """Blender tells of a render's beginning for every Scene strip, at every frame."""
    shown = bpy.data.scenes.new("Shown")
    shown.render.engine, shown.render.resolution_x, shown.render.resolution_y = "CYCLES", 8, 8
    shown.cycles.samples = 1
    shown.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    shown.collection.objects.link(shown.camera)
    film.sequence_editor.strips.new_scene("Shown", shown, 7, 1)
    told, begun, prepare = [], [], source_media.look_again  # once, as a film begins
    monkeypatch.setattr(source_media, "look_again", lambda: begun.append(render_job.job.film) or prepare())
    bpy.app.handlers.render_init.append(lambda scene, *_: told.append(scene.name))
    try:
        bpy.ops.render.render(animation=True)
    finally:
        bpy.app.handlers.render_init.pop()
    assert told.count("Shown") > 1
    assert begun == [film.session_uid]


def test_light_is_that_of_the_working_space(bpy, film, tmp_path):
    film.render.image_settings.color_depth = "16"
    bpy.ops.wm.set_working_color_space(working_space="ACEScg", convert_colors=True)
    scene = bpy.context.scene
    strip = next(strip for strip in scene.sequence_editor.strips if strip.type == "SCENE")
    shown = []
    for name, frame in (("effect", 2), ("plain", 3)):
        scene.frame_set(frame)
        scene.render.filepath = str(tmp_path / name)
        bpy.ops.render.render(write_still=True, scene=scene.name)
        shown.append(read_picture(tmp_path / f"{name}.png"))
        strip.mute = True
    apart = np.abs(shown[0].astype(float) - shown[1])
    assert shown[1].std() > 0
    assert apart.max() <= shown[1].max() / 250


def test_an_edit_in_stereo_shows_its_effects_to_both_eyes(bpy, film, tmp_path):
    """Blender itself crashes there, where the scene of a strip has one view."""
    film.frame_set(2)
    names = "alone.png", "both_L.png", "both_R.png"
    for name, is_stereo in (("alone", False), ("both", True)):
        film.render.use_multiview, film.render.filepath = is_stereo, str(tmp_path / name)
        bpy.ops.render.render(write_still=True, scene=film.name)
    alone, *both = (read_picture(tmp_path / name) for name in names)
    assert alone.std() > 0
    assert all(np.array_equal(eye, alone) for eye in both)
