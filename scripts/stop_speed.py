"""How long Blender takes to be free again after Esc, measured in its own window by real key presses.

    blender --factory-startup --python scripts/stop_speed.py -- FOOTAGE.mp4 OUT.json \\
        [--presses 20] [--jobs render,play,scrub,track] [--window 16] [--device auto] [--smooth 1] \\
        [--packages DIR]

xdotool presses Esc at some moment of each job, from a process of its own: Blender need not have time for it. What
counts is the time from that press until the job has ended and a timer ticks again; `idle` is the time until what works
for it beside Blender has nothing left to do, either, so that nothing waits that comes next. Three shutters on two
strokes that follow edges.

stroke, drag and move press the mouse in its place: a stroke is drawn, a region's handle is dragged, and the ruler is
clicked while a picture is composed, with a sharp subject. What counts is the time from letting go of the button until
the preview shows that, as a picture or with a note.

render: Render Animation as a job; play: the preview plays; scrub: the playhead is dragged to and fro; track: the
strokes' region is tracked.

Any Blender 5.2 with the extension enabled, started with a window and `--python` this file, will do.
--smooth: moments for a filmed frame, or auto.
--packages: a folder with OpenCV, where Blender has none.
"""

import argparse
import json
import os
import random
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
import traceback
from importlib import import_module
from pathlib import Path

import bpy
import gpu

JOBS = "render", "play", "scrub", "track"
PATIENCE = 60.0


def arguments():
    parser = argparse.ArgumentParser()
    parser.add_argument("footage", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--presses", type=int, default=20)
    parser.add_argument("--jobs", default=",".join(JOBS))
    parser.add_argument("--window", type=int, default=16)
    parser.add_argument("--device", default="auto")
    parser.add_argument("--smooth", default="1", choices=("1", "auto", "2", "4", "8", "16"))
    parser.add_argument("--zoom", default="fit", choices=("fit", "full"))
    parser.add_argument("--packages")
    return parser.parse_args(sys.argv[sys.argv.index("--") + 1 :])


OPTIONS = arguments()
FOLDER = Path(tempfile.mkdtemp(prefix="stop-speed-"))
if OPTIONS.packages:
    sys.path.append(OPTIONS.packages)
_random = random.Random(7)


def part(name):
    """A module of the extension, under whatever name that is installed."""
    layer = next(name for name in sys.modules if name.endswith("virtual_shutter.shutter_addon.blender"))
    return import_module(f"{layer.rpartition('.')[0]}.{name}")


def window():
    return bpy.context.window_manager.windows[0]


def edit_now():
    return window().workspace.sequencer_scene


def region(view):
    area = next(
        area
        for area in window().screen.areas
        if area.type == "SEQUENCE_EDITOR" and area.spaces.active.view_type == view
    )
    kind = "PREVIEW" if view == "PREVIEW" else "WINDOW"
    return area, next(region for region in area.regions if region.type == kind)


def within(view):
    area, found = region(view)
    return bpy.context.temp_override(window=window(), area=area, region=found)


def on_screen(found, x, y):
    return round(found.x + x), round(window().height - 1 - found.y - y)


def xdotool(*words):
    subprocess.run(["xdotool", *map(str, words)], check=True)


def make_edit():
    import addon_utils

    addon_utils.enable("bl_ext.user_default.virtual_shutter")
    bpy.ops.wm.read_homefile(app_template="Video_Editing")
    yield 1.0
    addon_utils.enable("bl_ext.user_default.virtual_shutter", default_set=True)
    bpy.context.preferences.view.render_display_type = "NONE"
    addon = next(addon for name, addon in bpy.context.preferences.addons.items() if name.endswith("virtual_shutter"))
    addon.preferences.device = OPTIONS.device.upper()
    edit = edit_now()
    edit.render.resolution_x, edit.render.resolution_y, edit.frame_start = 1920, 1080, 1
    edit.render.filepath = str(FOLDER / "frames") + "/"
    edit.render.image_settings.media_type, edit.render.image_settings.file_format = "IMAGE", "PNG"
    source = edit.sequence_editor_create().strips.new_movie("Footage", str(OPTIONS.footage), 1, 1)
    edit.frame_end = source.right_handle - 1
    edit.sequence_editor.active_strip = source
    add_effect(edit, source)
    bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "edit.blend"))
    with within("PREVIEW"):
        bpy.ops.sequencer.view_all_preview()
        if OPTIONS.zoom == "full":
            bpy.ops.sequencer.view_zoom_ratio(ratio=1.0)
    with within("SEQUENCER"):
        bpy.ops.sequencer.view_all()
    yield 3.0


def add_effect(edit, source):
    recipe_file, shutters = part("core.recipes.recipe_file"), part("core.model.shutters")
    strip, effect = part("blender.editing.add_effect").add_effect(edit, source)
    bars = {"Long": "ANGLE_360", "Half": "ANGLE_180", "Ramp": "RAMP_UP"}
    strokes = {"Half": [[0.4, 0.3], [0.45, 0.6]], "Ramp": [[0.75, 0.2], [0.7, 0.7]]}
    regions = [
        {"name": name, "shutter": name, "kind": "line", "width": 0.02, "strokes": [stroke]}
        for name, stroke in strokes.items()
    ]
    data = {
        "version": 2,
        "window": OPTIONS.window,
        "inbetween": OPTIONS.smooth if OPTIONS.smooth == "auto" else int(OPTIONS.smooth),
        "border": True,
        "edge_aware": 1,
        "shutters": [{"name": n, "bars": shutters.preset_bars(p, OPTIONS.window).tolist()} for n, p in bars.items()],
        "regions": regions,
    }
    part("blender.data.recipe_import").apply(edit, effect, strip, recipe_file.parse(json.dumps(data)))
    effect.active_shutter = 1


def operators():
    return part("blender.rendering.render_job").operators_running()


def effect_now():
    return edit_now().virtual_shutter.effects[0]


# Jobs: each begins, and tells what it is whether it runs.


def render():
    edit = edit_now()
    edit.frame_set(1)
    with bpy.context.temp_override(window=window(), scene=edit):
        bpy.ops.render.render("INVOKE_DEFAULT", animation=True)
    return lambda: bpy.app.is_job_running("RENDER")


def play():
    edit_now().frame_set(1)
    with within("SEQUENCER"):
        bpy.ops.screen.animation_play()
    return lambda: window().screen.is_animation_playing


def scrub():
    """The mouse goes on by itself, as Blender has no time for it."""
    _area, timeline = region("SEQUENCER")
    places = [on_screen(timeline, timeline.width * _random.uniform(0.2, 0.8), timeline.height - 12) for _ in range(40)]
    moves = " ".join(f"mousemove {x} {y} sleep 0.1" for x, y in places)
    xdotool("mousemove", *places[0])
    subprocess.Popen(["sh", "-c", f"xdotool mousedown 1 {moves}; xdotool mouseup 1"])
    return lambda: "ANIM_OT_change_frame" in operators()


def track():
    bpy.ops.ed.undo_push(message="Before")
    with within("PREVIEW"):
        bpy.ops.shutter.track("INVOKE_DEFAULT", direction="FORWARD")
    return lambda: "SHUTTER_OT_track" in operators()


# Jobs of the mouse: each gives places on the screen, of which the first is pressed and the last let go at, and what
# tells a draw of the preview that it is done.


def on_preview(x, y):
    """On the screen, of a point in fractions of the picture."""
    found, render = region("PREVIEW")[1], edit_now().render
    size = render.resolution_x, render.resolution_y
    return on_screen(found, *found.view2d.view_to_region((x - 0.5) * size[0], (y - 0.5) * size[1], clip=False))


def stroke():
    with within("PREVIEW"):
        bpy.ops.shutter.draw("INVOKE_DEFAULT")
    count, x = strokes_drawn(), _random.uniform(0.4, 0.6)
    return [on_preview(x, 0.4), on_preview(x, 0.5)], lambda: strokes_drawn() > count


def strokes_drawn():
    layers = effect_now().scene.annotation.layers
    return sum(len(frame.strokes) for layer in layers for frame in layer.frames)


def drag():
    with within("PREVIEW"):
        bpy.ops.wm.tool_set_by_id(name="builtin.select_box")
        centre = part("blender.interface.region_gizmo").place(bpy.context).centre
    found, step = region("PREVIEW")[1], _random.choice((-12, 12))
    at, to = on_screen(found, *centre), on_screen(found, centre[0] + step, centre[1])
    before, halfway = place_now(), ((at[0] + to[0]) // 2, at[1])  # the first move begins the drag
    return [at, halfway, to], lambda: place_now() != before


def place_now():
    return tuple(effect_now().regions[effect_now().active_region].location)


def move():
    timeline, before = region("SEQUENCER")[1], edit_now().frame_current
    frame = before - 20 if before > edit_now().frame_end / 2 else before + 20
    edit_now().frame_set(frame + 5)  # whose picture is composed when the button is pressed
    at = on_screen(timeline, timeline.view2d.view_to_region(frame, 0, clip=False)[0], timeline.height - 12)
    return [at], lambda: abs(edit_now().frame_current - frame) <= 1


def is_pen_down():
    return part("blender.rendering.previews").pen_is_down()


def told(job, tick=0.02):
    """Seconds until the preview shows what a mouse has done, twice; generator, which returns them."""
    draws: list = []
    (first, *others), is_done = job()
    note = FOLDER / "pressed"
    note.unlink(missing_ok=True)
    for x in (first[0] - 9, first[0]):  # a handle lights up under a pointer that moves
        xdotool("mousemove", x, first[1])
        yield 1.0
    if others:  # each is looked at, however long a picture takes; then the button is let go at any moment
        xdotool("mousedown", 1)
        for place in others:
            yield 0.3
            xdotool("mousemove", *place)
        yield 0.3
    last = f"sleep {_random.uniform(0, 0.5):.3f}" if others else "xdotool mousedown 1 sleep 0.2"

    def drawn():
        if is_done() and not is_pen_down():
            draws.append(time.time())

    handler = bpy.types.SpaceSequenceEditor.draw_handler_add(drawn, (), "PREVIEW", "POST_PIXEL")
    subprocess.Popen(["sh", "-c", f"{last}; date +%s.%N > {note}; xdotool mouseup 1"])
    end = time.time() + 4 * PATIENCE
    while not (shown := [moment for moment in draws if note.exists() and moment > float(note.read_text() or "inf")]):
        assert time.time() < end, f"{job.__name__}: nothing is shown"
        yield tick
    bpy.types.SpaceSequenceEditor.draw_handler_remove(handler, "PREVIEW")
    yield 1.5
    return (shown[0] - float(note.read_text()),) * 2


TOLD = stroke, drag, move


def device_queue():
    """What comes last of what the render's device has to do; None: it has done it."""
    session = part("blender.rendering.sessions").OFFSCREEN
    # Its `run` would wait here, and begin a thread where there is none.
    return session._executor and session._executor.submit(lambda: None)


def pressed(after: float) -> Path:
    """Has Esc pressed after so many seconds; the file gets the time of the press."""
    note = FOLDER / "pressed"
    note.unlink(missing_ok=True)
    command = f"sleep {after:.3f}; date +%s.%N > {note}.part; mv {note}.part {note}; xdotool key Escape"
    subprocess.Popen(["sh", "-c", command])
    return note


def one(job, tick=0.01):
    """Seconds from a press until Blender is free, and until its device is; generator, which returns them."""
    timeline = region("SEQUENCER")[1]
    if job is not scrub:
        xdotool("mousemove", *on_screen(timeline, timeline.width / 2, timeline.height / 2))
    yield 0.3
    runs = job()
    if job is scrub:
        end = time.time() + PATIENCE
        while not runs():
            assert time.time() < end, "scrubbing does not begin"
            yield tick
    note = pressed(_random.uniform(0.5, 3.0))
    end = time.time() + PATIENCE
    while not note.exists() or runs():
        if time.time() > end or (not runs() and not note.exists()):
            raise RuntimeError(f"{job.__name__}: {'Esc does not end it' if note.exists() else 'it ended by itself'}")
        yield tick
    free = time.time()
    last = device_queue() if job is render else None
    while last is not None and not last.done():
        yield tick
    at = float(note.read_text())
    idle = time.time()
    yield 4.5 if job is scrub else 1.0
    return free - at, idle - at


def undone(job):
    if job is track:
        with within("SEQUENCER"):
            bpy.ops.ed.undo()
    shutil.rmtree(FOLDER / "frames", ignore_errors=True)


def story():
    yield from make_edit()
    if any(job.__name__ in OPTIONS.jobs.split(",") for job in TOLD):
        effect_now().active_region = 0
        part("blender.editing.shutter_edits").sharp_subject(effect_now(), 0)
        edit_now().frame_set(40)
        yield 1.0
    results = {"renderer": (gpu.platform.renderer_get(), gpu.platform.backend_type_get()), "options": str(OPTIONS)}
    for name in OPTIONS.jobs.split(","):
        job, times = globals()[name], []
        while len(times) < OPTIONS.presses:
            try:
                times.append((yield from (told if job in TOLD else one)(job)))
            except RuntimeError as error:
                print(error, flush=True)
                if "does not end" in str(error):
                    raise
            undone(job)
            yield 0.5
        free, idle = zip(*times, strict=True)
        results[name] = {"free": free, "idle": idle}
        row = [f"{function(values):.2f}" for values in (free, idle) for function in (statistics.median, max)]
        print(f"| {name} | {' | '.join(row)} |", flush=True)
    OPTIONS.out.write_text(json.dumps(results, indent=1), encoding="utf-8")
    shutil.rmtree(FOLDER, ignore_errors=True)
    bpy.ops.wm.quit_blender()


def start():
    steps = story()

    def step():
        try:
            return next(steps) or 0.1
        except StopIteration:
            return None
        except BaseException:
            traceback.print_exc()
            os._exit(1)

    bpy.app.timers.register(step, first_interval=1.0, persistent=True)


start()
