"""The extension without any wheel, on pictures: Blender's GPU shows them, and renders them for another thread. Then on
a movie, which a second Blender decodes."""

import os

import bpy
import numpy as np
import support
from driver import OUT, edit, override, part, render, render_ended, saw, shot, strip_added, video_editing_opened


def add_effect():
    frames = np.random.default_rng(1).integers(0, 256, (12, 36, 64, 3), dtype=np.uint8)
    first = support.write_frames(OUT / "frames", frames)
    add_shutter(strip_added("Noise", first))


def add_shutter(strip):
    edit().sequence_editor.active_strip = strip
    with override("SEQUENCER"):
        assert bpy.ops.shutter.add_effect("INVOKE_DEFAULT") == {"FINISHED"}
    bpy.context.window_manager.virtual_shutter.view = "COEFFICIENTS"


def rendered():
    render("job.png", write_still=True)
    yield from render_ended()


def steps():
    yield from video_editing_opened()
    edit().render.resolution_x, edit().render.resolution_y = 64, 36
    add_effect()
    yield 1.0
    shot("preview")
    contexts, said = part("blender.rendering.sessions"), []
    of_engine = contexts.of_engine
    contexts.of_engine = lambda say: of_engine(lambda words: (said.append(words), say(words)))
    edit().frame_set(3)
    yield 1.0
    assert not said, said
    effect = edit().virtual_shutter.effects[0]
    context, asked = contexts.of_drawing(), part("blender.rendering.job_snapshots").of(effect.scene, 3)
    compositor = context.renderer(context.request(*asked)).compositor
    assert compositor.device.name, "the preview is on Blender's GPU"
    shown = part("blender.rendering.pictures").picture(context, *asked)
    for strip in part("blender.data.strips").effect_strips(edit()):
        strip.invalidate_cache("RAW")
    yield from rendered()
    job = support.read_picture(OUT / "job.png")[..., :3] / 255
    light = np.where(job <= 0.04045, job / 12.92, ((job + 0.055) / 1.055) ** 2.4)
    assert np.abs(light - shown[..., :3]).max() < 0.01, np.abs(light - shown[..., :3]).max()
    yield from movie_shown()
    saw(said=said)


def movie_shown():
    """With a still frame for a shutter, an effect is the movie itself."""
    strip = edit().sequence_editor.strips.new_movie("Movie", os.environ["SHUTTER_FOOTAGE"], 5, 30)
    edit().frame_set(60)
    yield 1.0
    yield from rendered()
    plain = support.read_picture(OUT / "job.png")[..., :3]
    assert plain.std() > 20, "there is a movie"
    add_shutter(strip)
    edit().virtual_shutter.effects[1].window = 1
    yield 1.0
    shot("movie")
    yield from rendered()
    shown = support.read_picture(OUT / "job.png")[..., :3]
    assert np.abs(shown - plain).max() <= 1, np.abs(shown - plain).max()
