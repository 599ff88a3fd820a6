"""A film renders as a job of the window while an editor goes on working. Its frames go to a folder of its name."""

import json
import random
import sys
import threading
import time
from functools import partial

import bpy
import driver
import numpy as np
import support
from driver import OUT, edit, override, part, render, render_ended, saw, strip_added, until, video_editing_opened

FRAMES, STRESSED, PER_FRAME, SIZE = 30, 20, 6, (64, 96)
random_ = random.Random(14)


def strip(name):
    return edit().sequence_editor.strips_all.get(name)


def effect():
    return part("blender.data.strips").effect_of(edit(), strip("Shutter").scene)


# The edit


def effect_on(name, start):
    source = strip_added(name, OUT / "frames" / "f0001.png", start=start)
    source.blend_type = "REPLACE"  # and that of the effect: what lies below does not count
    with override("SEQUENCER"):
        assert bpy.ops.shutter.add_effect("EXEC_DEFAULT") == {"FINISHED"}


def opened():
    frames = np.random.default_rng(1).integers(0, 256, (FRAMES, *SIZE, 3), dtype=np.uint8)
    support.write_frames(OUT / "frames", frames)
    yield from video_editing_opened()
    edit().render.resolution_y, edit().render.resolution_x = SIZE
    edit().frame_start, edit().frame_end = 1, FRAMES
    effect_on("Other", FRAMES + 11)
    strip("Shutter").name = "Second"
    effect_on("Source", 1)
    line = [[0.1, 0.2], [0.6, 0.9]]
    moved = [{"frame": 1}, {"frame": 40, "location": [0.3, 0.1]}, {"frame": 80, "location": [0.0, -0.2]}]
    keyed = {1: [1, 0, 0, 0, 0, 0], 30: [0, 0, 0, 1, 1, 1], 70: [0.5, 0, 0, 0, 0, 1]}
    path = OUT / "recipe.json"
    regions = [
        {"name": "Moved", "shutter": "S1", "strokes": [line], "keys": moved},
        {"name": "Still", "shutter": "S2", "kind": "lasso", "strokes": [[[0.5, 0.1], [0.9, 0.1], [0.9, 0.5]]]},
    ]
    path.write_text(json.dumps(support.recipe(6, [1] * 6, keyed, [0, 0, 1, 0, 0, 0], regions=regions, border=True)))
    with override("PREVIEW"):
        assert bpy.ops.shutter.recipe_import("EXEC_DEFAULT", filepath=str(path)) == {"FINISHED"}
    bpy.ops.wm.save_as_mainfile(filepath=str(OUT / "edit.blend"))


def again():
    bpy.ops.wm.open_mainfile(filepath=str(OUT / "edit.blend"))
    yield 1.0


# What an editor does


def do(name, **options):
    """An operator of the extension, if it can be."""
    operator = getattr(bpy.ops.shutter, name)
    with override("PREVIEW"):
        if operator.poll():
            operator("EXEC_DEFAULT", True, **options)


def layers():
    annotation = effect().scene.annotation
    return list(annotation.layers) if annotation else []


def drawn():
    for layer in layers()[-1:] + random_.choices(layers(), k=1) if layers() else ():
        number = random_.randint(1, FRAMES)
        known = next((drawing for drawing in layer.frames if drawing.frame_number == number), None)
        stroke = (known or layer.frames.new(number)).strokes.new()
        stroke.display_mode = "2DSPACE"
        stroke.points.add(8)
        for point in stroke.points:
            point.co = random_.uniform(-48, 48), random_.uniform(-32, 32), 0


def erased():
    drawings = [drawing for layer in layers() for drawing in layer.frames if drawing.strokes]
    if drawings:
        drawing = random_.choice(drawings)
        drawing.strokes.remove(drawing.strokes[0])


def layer_deleted():
    if layers():
        effect().scene.annotation.layers.remove(random_.choice(layers()))


def region_added():
    region = part("blender.editing.region_edits").add_region(effect(), random_.choice(effect().shutters))
    region.location = random_.uniform(-0.3, 0.3), 0
    drawn()


def region_moved():
    if effect().regions:
        random_.choice(effect().regions).location = random_.uniform(-0.5, 0.5), random_.uniform(-0.5, 0.5)


def chosen():
    effect().active_shutter = random_.randrange(len(effect().shutters))
    effect().active_region = random_.randrange(max(len(effect().regions), 1))


def painted():
    index = random_.randrange(len(effect().shutters))
    weights = [random_.random() for _ in range(effect().window)]
    part("blender.editing.bar_edits").paint(effect(), index, weights, key=random_.random() < 0.5)


def option_changed():
    name = random_.choice(("position", "interpolation", "light", "exposure", "edges", "aggregate"))
    setattr(effect(), name, random_.choice(effect().bl_rna.properties[name].enum_items.keys()))


def switched():
    name = random_.choice(("border", "stop_at_cuts", "use_source_time"))
    setattr(effect(), name, not getattr(effect(), name))


def window_changed():
    effect().window = random_.randint(1, 16)


def time_changed():
    effect().source_time = random_.uniform(1, FRAMES)
    if random_.random() < 0.5:
        effect().keyframe_insert("source_time")


def source_trimmed():
    """The strip lies below the effect's, which hides it."""
    name, value = random_.choice((("left_handle", 5), ("right_handle", FRAMES - 5), ("content_start", 4)))
    if strip("Source"):
        setattr(strip("Source"), name, value)


def files_renamed():
    if strip("Source"):
        strip("Source").elements[random_.randrange(FRAMES)].filename = f"f{random_.randint(1, FRAMES):04d}.png"


def other_deleted():
    """The other effect's strip, or its return as a new one."""
    if strip("Second"):
        edit().sequence_editor.strips.remove(strip("Second"))
        return
    edit().sequence_editor.active_strip = strip("Other")
    with override("SEQUENCER"):
        assert bpy.ops.shutter.add_effect("EXEC_DEFAULT", True) == {"FINISHED"}
    edit().sequence_editor.active_strip.name = "Second"
    edit().sequence_editor.active_strip = strip("Shutter")


def scrubbed():
    with override("SEQUENCER"):
        if bpy.ops.anim.change_frame.poll():
            bpy.ops.anim.change_frame("EXEC_DEFAULT", True, frame=random_.randint(1, FRAMES))


WORK = (
    *(drawn, erased, layer_deleted, region_added, region_moved, chosen, painted, option_changed, switched),
    *(window_changed, time_changed, source_trimmed, files_renamed, other_deleted, scrubbed),
    lambda: do("shutter_add"),
    lambda: do("shutter_duplicate"),
    lambda: do("shutter_remove"),
    lambda: do("shutter_move", direction=random_.choice(("UP", "DOWN"))),
    lambda: do("bars_key"),
    lambda: do("bars_unkey"),
    lambda: do("region_key"),
    lambda: do("region_remove"),
    lambda: do("region_move", direction="UP"),
    lambda: do("draw", new=random_.random() < 0.5),
    lambda: do("preset", preset=random_.choice(("ANGLE_90", "ANGLE_360", "STILL"))),
    lambda: do("recipe_import", filepath=str(OUT / "recipe.json")),
)


def strip_deleted(name):
    """As with Delete in the timeline."""
    edit().sequence_editor.active_strip = strip(name)
    for other in edit().sequence_editor.strips_all:
        other.select = other.name == name
    with override("SEQUENCER"):
        assert bpy.ops.sequencer.delete("EXEC_DEFAULT", True) == {"FINISHED"}
    assert strip(name) is None


# Films


class Film:
    """A film as a job of the window, whose frames wait for a story: each before it begins, and once more when its
    picture is made, before Blender gets it.

    So Blender's own code does not run on the job's thread where data is changed: without the extension as well it
    crashes where strips, keys or scenes are removed while it reads them there."""

    def __init__(self, name):
        self.name, self.ended = name, None
        self.begun = self.asked = 0  # the last frame that began, and of which a picture is asked for
        self._gate = threading.Condition()
        self._free = self._finished = 0  # the last frame that may begin, and that may be finished

    def story(self, steps=(), film=True):
        """steps: generator functions of a film, each while a frame waits; the other frames do not.
        film: or else the picture of the current frame alone."""
        pictures, self._picture = part("blender.rendering.pictures"), part("blender.rendering.pictures").picture
        pictures.picture = self._waiting
        handlers = {
            "render_pre": self._before_frame,
            "render_cancel": partial(self._end, "cancelled"),
            "render_complete": partial(self._end, "complete"),
        }
        for name, function in handlers.items():
            getattr(bpy.app.handlers, name).append(function)
        name = "" if film else f"{edit().frame_current:04d}.png"
        render(f"{self.name}/{name}", animation=film, write_still=not film)
        for number, step in enumerate(steps, start=1):
            yield from self._until(lambda number=number: self.begun == number)
            yield from step(self) or ()
            update()
            self.let(number, number)
        self.let(FRAMES, FRAMES)
        yield from render_ended()
        for name, function in handlers.items():
            getattr(bpy.app.handlers, name).remove(function)
        pictures.picture = self._picture
        saw(film=self.name, ended=self.ended, begun=self.begun)

    def picture_asked(self):
        """Lets the frame that waits begin, until its picture is asked for, or the next one waits, as the sequencer has
        kept its picture; generator: yield from it."""
        number = self.begun
        self.let(number, number - 1)
        yield from self._until(lambda: self.asked == number or self.begun > number)

    def let(self, free: int, finished: int):
        """Lets frames begin, and be finished, up to these."""
        with self._gate:
            self._free, self._finished = free, finished
            self._gate.notify_all()

    def _until(self, condition):
        return until(lambda: condition() or self.ended, "the film goes on", 60, wait=0.01)

    def _before_frame(self, scene, *_):
        if scene.name == "Edit":
            self.begun += 1
            with self._gate:
                self._gate.wait_for(lambda: self._free >= self.begun)

    def _waiting(self, *arguments):
        self.asked = self.begun
        picture = self._picture(*arguments)
        with self._gate:
            self._gate.wait_for(lambda: self._finished >= self.asked)
        return picture

    def _end(self, how, scene, *_):
        if scene.name == "Edit":
            self.ended = how


def worked(film):
    yield from film.picture_asked()
    for _ in range(PER_FRAME):
        random_.choice(WORK)()


def deleted(name, _film):
    strip_deleted(name)


def update():
    """What Blender would do by itself, when it comes to it: it reads what was changed."""
    for scene in (driver.windows()[0].scene, edit()):
        scene.view_layers[0].update()


def scene_deleted(_film):
    bpy.data.scenes.remove(effect().scene)


def effect_added(_film):
    """Another effect on the film's source, which is read as it is shown."""
    edit().sequence_editor.active_strip = strip("Source")
    with override("SEQUENCER"):
        assert bpy.ops.shutter.add_effect("EXEC_DEFAULT", True) == {"FINISHED"}
    edit().sequence_editor.active_strip.channel = 9  # over the other


def undone(film):
    """It ends the render; Blender's main thread waits for that."""
    yield from film.picture_asked()
    film.let(FRAMES, FRAMES)
    undo()


def undone_as_it_asks(film):
    """The main thread waits for the job's, which asks the main one to read an effect."""
    film.let(FRAMES, FRAMES)
    while not asks() and not film.ended:
        time.sleep(0.01)
    undo()


def undo():
    with override("SEQUENCER"):
        bpy.ops.ed.undo()


def asks():
    """Whether another thread waits for this one."""
    for frame in sys._current_frames().values():
        while frame is not None:
            if frame.f_code.co_name == "on_main_thread":
                return True
            frame = frame.f_back
    return False


def steps():
    yield from opened()
    yield from Film("alone").story()
    yield from again()
    yield from Film("stressed").story([*[worked] * STRESSED, partial(deleted, "Shutter")])
    yield from Film("after").story()
    yield from again()
    yield from Film("source").story([worked, partial(deleted, "Source"), worked, worked])
    yield from again()
    edit().frame_set(20)
    yield from Film("picture").story([worked], film=False)
    for name, steps in (
        ("scene", [worked, scene_deleted]),
        ("undone", [worked, undone]),
        ("asking", [effect_added, undone_as_it_asks]),
    ):
        yield from again()
        yield from Film(name).story(steps)
