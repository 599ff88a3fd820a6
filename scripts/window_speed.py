"""Measure how quick the live preview is in Blender's own window, beside the plain strip, in turns in one run.

    blender --factory-startup --python scripts/window_speed.py -- FOOTAGE.mp4 OUT.json \\
        [--size 1280x720] [--percent 100] [--zoom fit|full] [--ways plain,live] [--sync NONE|FRAME_DROP]

--percent: the preview's size in Blender's menu; --zoom full: a pixel of the picture to one of the screen. It prints
frames per second, processor time per frame, the timeline's advance beside the clock (1 keeps time), how far the shown
frame strays from the clock, and memory. It takes any Blender 5.2 with the extension enabled and a window.
"""

import argparse
import json
import statistics
import sys
import time
from pathlib import Path

import bpy
import gpu

WINDOW, ROUNDS, SECONDS = 16, 3, 4.0
WAYS = "plain", "live"


def arguments():
    parser = argparse.ArgumentParser()
    parser.add_argument("footage")
    parser.add_argument("out")
    parser.add_argument("--size", default="1280x720")
    parser.add_argument("--percent", default="100", choices=("25", "50", "75", "100"))
    parser.add_argument("--zoom", default="fit", choices=("fit", "full"))
    parser.add_argument("--ways", default=",".join(WAYS))
    parser.add_argument("--sync", default="NONE", choices=("NONE", "FRAME_DROP"))
    return parser.parse_args(sys.argv[sys.argv.index("--") + 1 :])


OPTIONS = arguments()
SIZE = tuple(map(int, OPTIONS.size.split("x")))


def extension():
    """The extension's package of Blender's layer, under whatever name it is installed."""
    return next(m for n, m in sys.modules.items() if n.endswith("virtual_shutter.shutter_addon.blender"))


def make_edit():
    import addon_utils

    addon_utils.enable("bl_ext.user_default.virtual_shutter")
    bpy.ops.wm.read_homefile(app_template="Video_Editing")
    addon_utils.enable("bl_ext.user_default.virtual_shutter")
    edit = bpy.data.scenes[0]
    edit.render.resolution_x, edit.render.resolution_y = SIZE
    edit.frame_start, edit.sync_mode = 1, OPTIONS.sync
    editor = edit.sequence_editor_create()
    # Finished frames would be shown again without any work: not what is measured.
    editor.use_cache_raw = editor.use_cache_final = False
    source = editor.strips.new_movie("Footage", OPTIONS.footage, 1, 1)
    edit.frame_end = source.right_handle - WINDOW - 1
    # Where playing keeps time, the film is not to end meanwhile: Blender's clock starts anew there.
    edit.render.fps = 240 if OPTIONS.sync == "NONE" else min(24, max(1, int(edit.frame_end / (SECONDS + 2))))
    editor.active_strip = source
    return edit, source


def add_effect(edit, source):
    """Three shutters on two lines and the border."""
    from importlib import import_module

    names = (
        "blender.editing.add_effect",
        "blender.data.recipe_import",
        "core.recipes.recipe_file",
        "core.model.shutters",
    )
    package = extension().__name__.rpartition(".")[0]
    add_effect, recipe_import, recipe_file, shutters = (import_module(f"{package}.{name}") for name in names)
    strip, effect = add_effect.add_effect(edit, source)
    lines = {"Sharp": [[0.3, 0.2], [0.5, 0.8]], "Ramp": [[0.7, 0.2], [0.7, 0.8]]}
    bars = {"Long": "ANGLE_360", "Sharp": "STILL", "Ramp": "RAMP_UP"}
    data = {
        "version": 1,
        "window": WINDOW,
        "border": True,
        "shutters": [{"name": n, "bars": shutters.preset_bars(p, WINDOW).tolist()} for n, p in bars.items()],
        "regions": [{"shutter": n, "kind": "line", "width": 0.02, "strokes": [points]} for n, points in lines.items()],
    }
    recipe_import.apply(edit, effect, strip, recipe_file.parse(json.dumps(data)))
    return strip


def timeline():
    for area in bpy.context.window_manager.windows[0].screen.areas:
        if area.type == "SEQUENCE_EDITOR" and area.spaces.active.view_type == "SEQUENCER":
            region = next(region for region in area.regions if region.type == "WINDOW")
            return {"window": bpy.context.window_manager.windows[0], "area": area, "region": region}


def playing(edit, seconds):
    """What the preview shows while it plays, a dict of numbers; generator, which returns them."""
    drawn_at, shown, advanced = [], [], [0]

    def drawn():
        # Blender may go to another frame without drawing it, and draw one twice.
        if shown != [edit.frame_current]:
            length = edit.frame_end - edit.frame_start + 1
            advanced[0] += (edit.frame_current - shown[0]) % length if shown else 0
            shown[:] = [edit.frame_current]
            drawn_at.append((time.perf_counter(), time.process_time(), advanced[0]))

    with bpy.context.temp_override(**timeline()):
        bpy.ops.screen.animation_play()
    yield 1.0
    handler = bpy.types.SpaceSequenceEditor.draw_handler_add(drawn, (), "PREVIEW", "POST_PIXEL")
    while len(drawn_at) < 3:
        yield seconds
    bpy.types.SpaceSequenceEditor.draw_handler_remove(handler, "PREVIEW")
    with bpy.context.temp_override(**timeline()):
        bpy.ops.screen.animation_cancel(restore_frame=False)
    (first, first_cpu, _), (last, last_cpu, _) = drawn_at[0], drawn_at[-1]
    count = len(drawn_at) - 1
    off = [frames / edit.render.fps - (when - first) for when, _, frames in drawn_at]
    return {
        "fps": count / (last - first),
        "cpu ms": (last_cpu - first_cpu) / count * 1000,
        "time kept": advanced[0] / (last - first) / edit.render.fps,
        "off s": max(off) - min(off),
        "resident MB": resident(),
    }


def resident() -> float:
    """Megabytes of memory that the process has now; 0 where the system does not say."""
    try:
        lines = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text(encoding="utf-8").splitlines())
    except OSError:
        return 0.0
    return int(lines["VmRSS"].split()[0]) / 1024


def previewed():
    area = next(a for a in timeline()["window"].screen.areas if getattr(a.spaces.active, "view_type", "") == "PREVIEW")
    area.spaces.active.proxy_render_size = f"PROXY_{OPTIONS.percent}"
    region = next(region for region in area.regions if region.type == "PREVIEW")
    with bpy.context.temp_override(window=timeline()["window"], area=area, region=region):
        bpy.ops.sequencer.view_all_preview()
        if OPTIONS.zoom == "full":
            bpy.ops.sequencer.view_zoom_ratio(ratio=1.0)


def story():
    edit, source = make_edit()
    yield 1.0
    strip = add_effect(edit, source)
    previewed()
    yield 1.0
    results = {}
    for _ in range(ROUNDS):
        for way in OPTIONS.ways.split(","):
            strip.mute = way == "plain"
            bpy.context.window_manager.virtual_shutter.live = way == "live"
            edit.frame_set(1)
            yield 0.5
            numbers = yield from playing(edit, SECONDS)
            for name, value in numbers.items():
                results.setdefault(f"{way} {name}", []).append(value)
            yield 0.2
    summary = {name: {"median": statistics.median(v), "all": v} for name, v in results.items()}
    summary["renderer"] = gpu.platform.renderer_get(), gpu.platform.backend_type_get()
    with open(OPTIONS.out, "w", encoding="utf-8") as file:
        json.dump(summary, file, indent=1)
    for name, value in summary.items():
        print(name, f"{value['median']:.2f}" if isinstance(value, dict) else value, flush=True)
    bpy.ops.wm.quit_blender()


def start():
    steps = story()

    def step():
        try:
            return next(steps) or 0.1
        except StopIteration:
            return None

    bpy.app.timers.register(step, first_interval=1.0, persistent=True)


start()
