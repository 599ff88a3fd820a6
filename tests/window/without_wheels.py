"""The extension without any wheel, on pictures: Blender's GPU shows them, and renders them for another thread. Then on
a movie, which a second Blender decodes.

Run in a Blender with a window, the checkout linked as an extension."""

# ruff: noqa: E402 (Blender finds the helpers once it knows their folders)
import os
import sys
from pathlib import Path

TESTS = Path(__file__).parents[1]
sys.path[:0] = [str(TESTS / "window"), str(TESTS / "blender"), str(TESTS)]

from fresh import PACKAGES

sys.modules |= dict.fromkeys(PACKAGES)  # None: there is no such module

import bpy
import numpy as np
import support
from driver import OUT, area_of, play, region_of, saw, shot, until, video_editing_opened

NAME = "bl_ext.user_default.virtual_shutter"


def edit_now():
    return bpy.context.window_manager.windows[0].workspace.sequencer_scene


def part(name):
    return sys.modules[f"{NAME}.shutter_addon.blender.{name}"]


def add_effect():
    frames = np.random.default_rng(1).integers(0, 256, (12, 36, 64, 3), dtype=np.uint8)
    first = support.write_frames(OUT / "frames", frames)
    strips = edit_now().sequence_editor_create().strips
    strip = strips.new_image("Noise", str(first), 1, 1)
    for path in sorted(first.parent.iterdir())[1:]:
        strip.elements.append(path.name)
    add_shutter(strip)


def add_shutter(strip):
    edit_now().sequence_editor.active_strip = strip
    area = area_of("SEQUENCE_EDITOR", "SEQUENCER")
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window, area=area, region=region_of(area)):
        assert bpy.ops.shutter.add_effect("INVOKE_DEFAULT") == {"FINISHED"}
    bpy.context.window_manager.virtual_shutter.view = "COEFFICIENTS"


def rendered():
    """The current frame, by a job of the window."""
    edit, ended = edit_now(), []
    edit.render.image_settings.media_type = "IMAGE"
    edit.render.image_settings.file_format = "PNG"
    edit.render.filepath = str(OUT / "job.png")
    bpy.app.handlers.render_complete.append(lambda *_: ended.append(True))
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0], scene=edit):
        bpy.ops.render.render("INVOKE_DEFAULT", write_still=True)
    yield from until(lambda: ended, "the render ends", 30)
    yield from until(lambda: not bpy.app.is_job_running("RENDER"), "its job ends")  # the file is written by then


def story():
    yield from video_editing_opened()
    edit = edit_now()
    edit.render.resolution_x, edit.render.resolution_y, edit.render.dither_intensity = 64, 36, 0
    edit.view_settings.view_transform = "Standard"
    add_effect()
    yield 1.0
    shot("preview")
    contexts, said = part("rendering.sessions"), []
    of_engine = contexts.of_engine
    contexts.of_engine = lambda say: of_engine(lambda words: (said.append(words), say(words)))
    edit.frame_set(3)
    yield 1.0
    assert not said, said
    effect = edit.virtual_shutter.effects[0]
    context, asked = contexts.of_drawing(), part("rendering.job_snapshots").of(effect.scene, 3)
    compositor = context.renderer(context.request(*asked)).compositor
    assert compositor.device.name, "the preview is on Blender's GPU"
    shown = part("rendering.pictures").picture(context, *asked)
    for strip in part("data.strips").effect_strips(edit):
        strip.invalidate_cache("RAW")
    yield from rendered()
    job = support.read_picture(OUT / "job.png")[..., :3] / 255
    light = np.where(job <= 0.04045, job / 12.92, ((job + 0.055) / 1.055) ** 2.4)
    assert np.abs(light - shown[..., :3]).max() < 0.01, np.abs(light - shown[..., :3]).max()
    yield from movie_shown()
    saw(said=said)


def movie_shown():
    """With a still frame for a shutter, an effect is the movie itself."""
    strip = edit_now().sequence_editor.strips.new_movie("Movie", os.environ["SHUTTER_FOOTAGE"], 5, 30)
    edit_now().frame_set(60)
    yield 1.0
    yield from rendered()
    plain = support.read_picture(OUT / "job.png")[..., :3]
    assert plain.std() > 20, "there is a movie"
    add_shutter(strip)
    edit_now().virtual_shutter.effects[1].window = 1
    yield 1.0
    shot("movie")
    yield from rendered()
    shown = support.read_picture(OUT / "job.png")[..., :3]
    assert np.abs(shown - plain).max() <= 1, np.abs(shown - plain).max()


play(story)
