"""From the zip to a finished film, in a Blender that has never seen the extension."""

import os
from functools import partial

import bpy
import driver

FOOTAGE, ZIP, RECIPE = (os.environ[f"SHUTTER_{name}"] for name in ("FOOTAGE", "ZIP", "RECIPE"))
FIRST, LAST = map(int, os.environ["SHUTTER_FRAMES"].split(":"))


def installed():
    """As when the zip is dropped on the window: Blender asks, Return confirms."""
    window = driver.windows()[0]
    driver.click(driver.region_of(driver.area_of("VIEW_3D")), 300, 300)  # away with the splash screen
    yield 0.5
    with bpy.context.temp_override(window=window):
        bpy.ops.extensions.package_install_files("INVOKE_DEFAULT", url=ZIP)
    yield 0.7
    driver.shot("install")
    name, addons = driver.NAME, bpy.context.preferences.addons
    # A dialog that is not open yet misses Return.
    yield from driver.until(lambda: name in addons, "the extension is enabled", 30, partial(driver.key, "Return"))


def video_editing_opened():
    """By File ▸ New ▸ Video Editing, which keeps the extension."""
    bpy.ops.wm.read_homefile("EXEC_DEFAULT", app_template="Video_Editing")
    yield 1.0
    driver.windows()[0].workspace.sequencer_scene.name = "Edit"
    driver.edit().render.resolution_x, driver.edit().render.resolution_y = 1280, 720


def movie_added():
    add = bpy.ops.sequencer.movie_strip_add
    with driver.override("SEQUENCER"):
        add("EXEC_DEFAULT", True, filepath=FOOTAGE, channel=1, frame_start=1, move_strips=False)
    yield 0.5
    kinds = sorted(strip.type for strip in driver.edit().sequence_editor.strips_all)
    assert kinds == ["MOVIE", "SOUND"], kinds


def effect_added():
    strips = driver.edit().sequence_editor.strips_all
    driver.edit().sequence_editor.active_strip = next(strip for strip in strips if strip.type == "MOVIE")
    yield from driver.effect_added()


def recipe_imported():
    with driver.override("PREVIEW"):
        bpy.ops.shutter.recipe_import("EXEC_DEFAULT", True, filepath=RECIPE)
    driver.edit().frame_set((FIRST + LAST) // 2)
    yield 1.5
    effect = driver.edit().virtual_shutter.effects[0]
    driver.saw(shutters=[shutter.name for shutter in effect.shutters], regions=[r.name for r in effect.regions])
    driver.shot("imported")


def film_rendered():
    """Ctrl-F12 over the preview, in a file whose output is a movie."""
    render = driver.edit().render
    render.image_settings.media_type = "VIDEO"
    render.ffmpeg.format, render.ffmpeg.codec, render.ffmpeg.audio_codec = "MPEG4", "H264", "AAC"
    render.ffmpeg.constant_rate_factor = "PERC_LOSSLESS"
    render.use_file_extension = False
    render.filepath = str(driver.OUT / "film.mp4")
    driver.edit().frame_start, driver.edit().frame_end = FIRST, LAST
    region = driver.region_of(driver.area_of("SEQUENCE_EDITOR", "PREVIEW"), "PREVIEW")
    driver.move(region, region.width / 2, region.height - 30)  # over no handle
    yield 0.5
    # F12 by its code: to its name xdotool adds Alt, as if it changed terminals.
    driver.key("ctrl+96")
    yield from driver.until(driver.rendering, "a render begins")
    yield from driver.render_ended()
    driver.shot("rendered")


def steps():
    bpy.context.preferences.view.render_display_type = "NONE"  # its window would cover the other
    for step in (installed, video_editing_opened, movie_added, effect_added, recipe_imported, film_rendered):
        yield from step()
