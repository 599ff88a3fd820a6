"""Drives a Blender window as a person does: mouse and keys by xdotool, a picture of the screen, steps with redraws.

A story is a generator function, run inside Blender; each `yield` lets Blender handle events and redraw.
"""

import json
import os
import subprocess
import sys
import traceback
import warnings
from functools import partial
from importlib import import_module
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).parents[1]))
import thread_guard

# Blender ignores the environment's filters unless it gets an option, which the command that opens it need not take.
for deprecated in (DeprecationWarning, PendingDeprecationWarning):
    warnings.simplefilter("error", deprecated)

NAME = "bl_ext.user_default.virtual_shutter"
PREVIEWS = f"{NAME}.shutter_addon.blender.rendering.previews"
OUT = Path(os.environ.get("SHUTTER_PICTURES", "/tmp/shutter-window"))
_QUICK = "-define", "png:compression-level=1"  # a third of the time, for a tenth more bytes
STEP = 0.25  # seconds that Blender gets for events and redraws
noted = []  # facts for the report
_texts = 0  # characters of the last text in the status bar


rendering = partial(bpy.app.is_job_running, "RENDER")


def part(name):
    """A module of the extension that is enabled now."""
    return import_module(f"{NAME}.shutter_addon.{name}")


def windows():
    return bpy.context.window_manager.windows


def edit():
    """Undo makes a new scene of it: never keep it."""
    return bpy.data.scenes["Edit"]


def enable():
    import addon_utils

    module = addon_utils.enable(NAME, default_set=True)
    assert module, "the extension could not be enabled"


def video_editing_opened():
    """A new file of Blender's template for it, with the extension, which a new file disables; generator: yield from
    it. Its edit renders PNG pictures that can be compared with the source's."""
    bpy.context.preferences.view.render_display_type = "NONE"  # its window would cover the other
    enable()
    bpy.ops.wm.read_homefile(app_template="Video_Editing")
    yield 1.0
    enable()
    bpy.context.preferences.view.smooth_view = 0  # a view that still moves is nowhere
    scene = windows()[0].workspace.sequencer_scene
    scene.name = "Edit"
    scene.sequence_editor_create()
    scene.view_settings.view_transform = "Standard"
    scene.render.dither_intensity = 0
    scene.render.image_settings.media_type = "IMAGE"
    scene.render.image_settings.file_format = "PNG"


def composing(previews):
    """Whether a first or a better picture is being made."""
    smooth = part("features.smooth.blender.smooth_previews")
    coming = smooth._coming.values()  # private: pictures of all effects
    return previews.looking.slices.last is not None or not all(each.is_over for each in coming)


def play(story, seconds=STEP):
    """Runs a story step by step; quits Blender with its end or its first failure."""
    OUT.mkdir(parents=True, exist_ok=True)
    thread_guard.on(reviewed_alone=False)  # which functions run on a thread depends on how fast the machine is
    steps, handled = story(), False

    def step():
        nonlocal handled
        if handled := not handled:  # a busy Blender runs this before what came meanwhile: that first
            return 0.01
        # What comes next is done with what a picture looks like; a window that goes on shows it later.
        previews = sys.modules.get(PREVIEWS)
        is_composing = previews and composing(previews) and not previews.may_be_late()
        del previews  # a module that is held would be taken for one that outlives the extension
        if is_composing:
            return 0.01
        try:
            wait = next(steps)
        except StopIteration:
            _finish("")
            return None
        except BaseException:
            shot("failure")
            _finish(traceback.format_exc())
            return None
        return wait or seconds

    bpy.app.timers.register(step, first_interval=1.0, persistent=True)


def quit_blender():
    """Ends the story as a person does, and not by leaving the process; generator: yield from it."""
    _tell("")
    bpy.ops.wm.quit_blender()
    yield 30
    raise AssertionError("Blender did not quit")


def _tell(fault):
    sys.stdout.flush()
    (OUT / "result.json").write_text(json.dumps({"fault": fault, "seen": noted}, indent=1))


def _finish(fault):
    fault = fault or "\n".join(thread_guard.faults())
    _tell(fault)
    if fault:
        print(fault, file=sys.stderr, flush=True)
    os._exit(1 if fault else 0)


def saw(**facts):
    noted.append(facts)


def shot(name):
    path = OUT / f"{name}.png"
    subprocess.run(["import", "-window", "root", *_QUICK, str(path)], check=True)
    return path


def shot_when_shown(name):
    """A picture of the screen once it shows what Blender has been told: it draws late where the machine is busy, and
    Vulkan presents later still; generator: yield from it. A new text in the status bar, which redraws nothing else, is
    drawn with all that waits to be."""
    before = _status_bar()
    # An operator that draws writes its own text over it with its next event.
    yield from until(lambda: _status_bar() != before, "the screen shows what is drawn", 30, _tell_status)
    shot(name)


def _tell_status():
    global _texts
    _texts = _texts % 20 + 1
    window = windows()[0]
    with bpy.context.temp_override(window=window):
        window.workspace.status_text_set("#" * _texts)


def _status_bar():
    height = windows()[0].height
    box = f"300x16+0+{height - 18}"
    return subprocess.run(["import", "-window", "root", "-crop", box, "rgb:-"], check=True, capture_output=True).stdout


def xdotool(*arguments):
    subprocess.run(["xdotool", *map(str, arguments)], check=True)


def pen_left():
    """The tool of before a stroke."""
    with override("PREVIEW"):
        bpy.ops.wm.tool_set_by_id(name="builtin.select_box")


def area_of(kind, view=None):
    """The first area of a kind; view: of a sequencer, its view type."""
    for area in windows()[0].screen.areas:
        if area.type == kind and (view is None or area.spaces.active.view_type == view):
            return area
    raise LookupError(f"no {kind} {view or ''}")


def region_of(area, kind="WINDOW"):
    return next(region for region in area.regions if region.type == kind)


def override(view):
    """Operators run as in the sequencer's area of that view type."""
    area = area_of("SEQUENCE_EDITOR", view)
    region = region_of(area, "PREVIEW" if view == "PREVIEW" else "WINDOW")
    return bpy.context.temp_override(window=windows()[0], area=area, region=region)


def screen(region, x, y):
    """Screen coordinates, top row 0, of a point in a region, whose rows go up."""
    height = windows()[0].height
    return round(region.x + x), round(height - 1 - region.y - y)


def move(region, x, y):
    xdotool("mousemove", *screen(region, x, y))


def edge_moved(area, right: int, up: int):
    window = windows()[0]
    x = area.x + (area.width if right else area.width // 2)
    y = area.y + (area.height if up else area.height // 2)
    xdotool("mousemove", x, window.height - 1 - y)  # where no region is active
    yield 0.5
    with bpy.context.temp_override(window=window):
        bpy.ops.screen.area_move(x=x, y=y, delta=right + up)
    yield 0.5


def click(region, x, y, repeat=1):
    move(region, x, y)
    xdotool("click", "--repeat", repeat, "--delay", 60, 1)


def drag(region, points, hold=()):
    """Presses at the first point, goes through the others, releases at the last; generator: yield from it."""
    move(region, *points[0])
    yield
    for key in hold:
        xdotool("keydown", key)
    xdotool("mousedown", 1)
    yield
    for point in points[1:]:
        move(region, *point)
        yield 0.08
    yield
    xdotool("mouseup", 1)
    for key in hold:
        xdotool("keyup", key)
    yield


def strip_added(name, first, channel=1, start=1):
    """An image strip, the active one, of all pictures beside the first."""
    strip = edit().sequence_editor.strips.new_image(name, str(first), channel, start)
    for path in sorted(first.parent.iterdir())[1:]:
        strip.elements.append(path.name)
    edit().sequence_editor.active_strip = strip
    return strip


def render(path, **options):
    edit().render.filepath = f"{OUT}/{path}"
    with bpy.context.temp_override(window=windows()[0], scene=edit()):
        bpy.ops.render.render("INVOKE_DEFAULT", **options)


def film(folder, first, last):
    edit().frame_start, edit().frame_end = first, last
    render(f"{folder}/", animation=True)


def render_ended(seconds=200):
    return until(lambda: not rendering(), "the render ends", seconds)


def until(condition, what, seconds=10, again=None, wait=STEP):
    """Waits for a condition; generator: yield from it. again: called now and every two seconds until it comes about.
    wait: seconds from one look to the next."""
    for step in range(int(seconds / wait)):
        if condition():
            return
        if again and step % int(2 / wait) == 0:
            again()
        yield wait
    raise AssertionError(f"it did not come about that {what}")


def key(*names):
    xdotool("key", *names)


def text(words):
    xdotool("type", "--delay", 40, words)


def effect_added():
    """Shutter in the timeline's Add menu, found by typing; generator: yield from it."""
    region = region_of(area_of("SEQUENCE_EDITOR", "SEQUENCER"))
    move(region, region.width / 2, region.height / 2)
    yield
    key("shift+a")
    yield 0.5
    text("shutter")
    yield 0.7
    shot("menu")
    # A menu that is not open yet misses Return; once there is an effect, it is closed, and Return goes nowhere else.
    yield from until(lambda: len(edit().virtual_shutter.effects), "the menu adds the effect", 10, lambda: key("Return"))
