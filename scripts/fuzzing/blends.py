"""Odd .blend data: impossible values of an effect, its strips and scenes, and what it needs gone or of another kind.
Then its panels are drawn, it is exported, and a frame is rendered, twice."""

import inspect
import json
import math
import threading
from types import SimpleNamespace

import numpy as np

from . import hostile, recipes, trial

# Of (edit, effect, effect strip, source strip), what may get odd properties; the extension's own oftener than others.
OURS = {
    "effect": lambda edit, effect, strip, source: effect,
    "shutter": lambda edit, effect, strip, source: effect.shutters[0],
    "bar": lambda edit, effect, strip, source: effect.shutters[-1].bars[0],
    "region": lambda edit, effect, strip, source: effect.regions[0],
}
BLENDERS = {
    "strip": lambda edit, effect, strip, source: strip,
    "source": lambda edit, effect, strip, source: source,
    "transform": lambda edit, effect, strip, source: strip.transform,
    "crop": lambda edit, effect, strip, source: strip.crop,
    "edit": lambda edit, effect, strip, source: edit,
    "scene": lambda edit, effect, strip, source: effect.scene,
    "rate": lambda edit, effect, strip, source: edit.render,
    "size": lambda edit, effect, strip, source: effect.scene.render,
    "identity": lambda edit, effect, strip, source: effect.scene.virtual_shutter,
}
LEFT_ALONE = {"filepath", "use_sequencer", "resolution_x", "resolution_y", "resolution_percentage"}
TEXTS = [text for text in hostile.TEXTS if text != "\ud800"]  # which makes Blender itself crash


def make(random, folder):
    from support import write_frames

    hostile.outside(folder)
    write_frames(folder / "in", np.random.default_rng(0).integers(0, 256, (3, 12, 20, 3), dtype=np.uint8))
    changes = []
    for _ in range(random.choice((1, 1, 2, 3, 6))):
        if random.random() < 0.3:
            changes.append([random.choice(sorted(ACTIONS)), None, random.getrandbits(32)])
        else:
            owner = random.choice([*OURS, *OURS, *OURS, *BLENDERS])
            values = [hostile.number(random), random.choice(TEXTS), random.randrange(-3, 9)]
            changes.append([owner, random.getrandbits(32), values])
    data = recipes.plausible(random, 16) | {"inbetween": random.choice((1, 1, 1, 4, "auto"))}
    plan = {"recipe": data, "changes": changes, "reload": random.random() < 0.3, "frame": random.choice((1, 5, 30, 90))}
    (folder / "plan.json").write_text(json.dumps(plan))


def run(folder):
    plan = json.loads((folder / "plan.json").read_text())
    import bpy

    from shutter_addon import blender

    blender.register()
    parts = _edit(bpy, folder, plan["recipe"])
    for change in plan["changes"]:
        _change(bpy, parts, *change)
    if plan["reload"]:
        (folder / "out").mkdir()
        path = str(folder / "out" / "odd.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.open_mainfile(filepath=path)
    bpy.context.view_layer.update()
    for task in (_draw, _export):  # which use threads
        trial.forked(lambda task=task: _to_its_end(task, bpy, folder / "out"))
    code = {trial.forked(lambda name=name: _render(bpy, folder / "out" / name, plan["frame"]))[0] for name in "ab"}
    if len(code) > 1:
        raise trial.Fault("a frame is rendered once and refused once")
    recipes.same_pictures(folder / "out" / "a", folder / "out" / "b")


def _edit(bpy, folder, data):
    """An edit as a user makes it: an effect on an image strip, from frame 1 to 40. The names of edit and source."""
    from shutter_addon.blender.data import recipe_import, selection
    from shutter_addon.blender.editing import add_effect
    from shutter_addon.core.recipes import recipe_file

    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    edit = bpy.context.scene
    edit.render.resolution_x, edit.render.resolution_y, edit.render.resolution_percentage = 20, 12, 100
    editor = edit.sequence_editor_create()
    source = editor.strips.new_image("images", str(folder / "in" / "f0001.png"), 1, 1)
    for number in (2, 3):
        source.elements.append(f"f{number:04d}.png")
    source.right_handle = 41
    strip, effect = add_effect.add_effect(edit, source)
    recipe_import.apply(edit, effect, strip, recipe_file.parse(json.dumps(data)), folder)
    selection.choose(edit, strip)
    return edit.name, source.name


def _found(bpy, parts):
    """Edit, effect, strip and source. KeyError, IndexError, StopIteration: one of them is gone."""
    edit = bpy.data.scenes[parts[0]]
    effect = edit.virtual_shutter.effects[0]
    strip = next(strip for strip in edit.sequence_editor.strips if strip.type == "SCENE")
    return edit, effect, strip, edit.sequence_editor.strips[parts[1]]


def _change(bpy, parts, what: str, which, value) -> None:
    """Does an action, or sets a property: what Blender keeps of ours unchecked, all else as far as Blender takes it."""
    try:
        found = _found(bpy, parts)
        if which is None:
            ACTIONS[what](bpy, *found, value)
            return
        owner = (OURS | BLENDERS)[what](*found)
        names = [p.identifier for p in owner.bl_rna.properties if not p.is_readonly and p.identifier not in LEFT_ALONE]
    except (KeyError, IndexError, StopIteration, RuntimeError, AttributeError, TypeError, ReferenceError):
        return  # something that it needs was removed before
    prop = owner.bl_rna.properties[sorted(names)[which % len(names)]]
    number, text, item = value
    stored = owner.bl_system_properties_get() if hasattr(owner, "bl_system_properties_get") else None
    kinds = {"INT": _whole(number), "FLOAT": float(number), "STRING": text, "ENUM": item, "BOOLEAN": item}
    new = kinds.get(prop.type)
    if getattr(prop, "array_length", 0):
        new = [new] * prop.array_length
    try:
        if stored is not None and prop.identifier in stored and prop.type != "POINTER":
            stored[prop.identifier] = new
        elif prop.type == "ENUM":
            items = [entry.identifier for entry in prop.enum_items] or [""]
            setattr(owner, prop.identifier, items[item % len(items)])
        else:
            setattr(owner, prop.identifier, new)
    except (TypeError, ValueError, OverflowError, AttributeError, RuntimeError, UnicodeError):
        pass  # Blender does not take it


def _whole(number) -> int:
    return max(-(2**31), min(2**31 - 1, int(number))) if math.isfinite(number) else 0


# What is done to edits: (bpy, edit, effect, strip, source, a number of chance)


def _scribble(bpy, edit, effect, strip, source, chance):
    """Points where there is no picture."""
    numbers = [n for n in hostile.NUMBERS if not math.isfinite(n) or abs(n) < 3e38]
    for layer in effect.scene.annotation.layers:
        for stroke in layer.frames[0].strokes:
            flat = [numbers[(chance + i) % len(numbers)] for i in range(3 * len(stroke.points))]
            stroke.points.foreach_set("co", flat)


def _keys(bpy, edit, effect, strip, source, chance):
    """Keys of impossible values, at impossible frames."""
    names = ("window", "position", "aggregate", "border", "edge_aware", "source_time", "shutters[0].bars[0].weight")
    path = f"{effect.path_from_id()}.{(*names, 'regions[0].location', 'regions[0].scale')[chance % 9]}"
    edit.animation_data_create()
    edit.keyframe_insert(path, frame=5)
    from shutter_addon.blender.data import fcurves

    for curve in fcurves.curves_under(edit, path):
        for key in curve.keyframe_points:
            key.co = [(5, -1), (5, 1e30), (1e9, 5), (-1e9, 1e9), (5, float("nan")), (float("nan"), 1)][chance // 9 % 6]
            key.interpolation = ("BEZIER", "ELASTIC", "CONSTANT")[chance // 54 % 3]


def _another_source(bpy, edit, effect, strip, source, chance):
    """The source's identity on a strip of another kind."""
    new = edit.sequence_editor.strips
    length = {"length": 40} if chance % 2 else {"length": 1}
    kinds = ("COLOR", "TEXT", "ADJUSTMENT", "META", "CLIP", "SCENE")
    match kinds[chance // 2 % 6]:
        case "META":
            made = new.new_meta("other", 7, 1)
        case "CLIP":
            clip = bpy.data.movieclips.load(str(bpy.path.abspath(source.directory) + source.elements[0].filename))
            made = new.new_clip("other", clip, 7, 1)
            bpy.data.movieclips.remove(clip) if chance // 12 % 2 else None
        case "SCENE":
            made = new.new_scene("other", effect.scene if chance // 12 % 2 else edit, 7, 1)
        case kind:
            made = new.new_effect("other", kind, 7, 1, **length)
    made.virtual_shutter_source, source.virtual_shutter_source = source.virtual_shutter_source, ""


def _retime(bpy, edit, effect, strip, source, chance):
    """A speed that changes within the source, or within its effect."""
    chosen = (source, strip)[chance % 2]
    for frame in (chance // 2 % 40, chance // 80 % 60):
        chosen.retiming_keys.add(timeline_frame=frame)


ACTIONS = {
    "scribble": _scribble,
    "keys": _keys,
    "another source": _another_source,
    "retime": _retime,
    "remove camera": lambda bpy, edit, effect, *_: bpy.data.objects.remove(effect.scene.camera),
    "no camera": lambda bpy, edit, effect, *_: setattr(effect.scene, "camera", None),
    "remove scribbles": lambda bpy, edit, effect, *_: bpy.data.annotations.remove(effect.scene.annotation),
    "remove source": lambda bpy, edit, effect, strip, source, _: edit.sequence_editor.strips.remove(source),
    "remove strip": lambda bpy, edit, effect, strip, *_: edit.sequence_editor.strips.remove(strip),
    "remove scene": lambda bpy, edit, effect, *_: bpy.data.scenes.remove(effect.scene),
    "no scene": lambda bpy, edit, effect, *_: setattr(effect, "scene", None),
    "itself": lambda bpy, edit, effect, *_: setattr(effect, "scene", edit),
    "no shutters": lambda bpy, edit, effect, *_: effect.shutters.clear(),
    "no bars": lambda bpy, edit, effect, *_: effect.shutters[0].bars.clear(),
    "no regions": lambda bpy, edit, effect, *_: effect.regions.clear(),
    "no effect": lambda bpy, edit, *_: edit.virtual_shutter.effects.clear(),
    "no files": lambda bpy, edit, effect, strip, source, _: [source.elements.pop(0) for _ in source.elements[1:]],
    "lost files": lambda bpy, edit, effect, strip, source, chance: setattr(
        source.elements[chance % len(source.elements)], "filename", ("gone.png", "", "..", "\n", "a" * 200)[chance % 5]
    ),
    "undo": lambda bpy, *_: (bpy.ops.ed.undo_push(message="x"), bpy.ops.ed.undo()),
    "copy": lambda bpy, edit, *_: edit.copy(),
}


# What is done with them


class _Layout:
    """Stands for Blender's layout, which there is none of without a window: it reads what it is to show."""

    def __getattr__(self, _name):
        return self._shown

    def _shown(self, owner=None, name=None, *_, **__):
        if isinstance(name, str) and hasattr(owner, "bl_rna"):
            getattr(owner, name)
        return _Layout()


def _to_its_end(task, *arguments) -> None:
    """Does a task, and waits for the threads that it has begun."""
    from shutter_addon.blender.rendering import sessions

    task(*arguments)
    sessions.forget()
    for thread in threading.enumerate():
        if thread is not threading.main_thread():
            thread.join(trial.PATIENCE)


def _draw(bpy, _folder):
    """What panels and lists do when they are drawn."""
    from shutter_addon import blender
    from shutter_addon.blender.data import selection, validation
    from shutter_addon.blender.editing import bar_edits
    from shutter_addon.blender.interface import panels

    for panel in blender.classes_of(panels):
        if issubclass(panel, bpy.types.Panel) and panel.poll(bpy.context):
            functions = {name: each for name, each in inspect.getmembers(panel) if inspect.isfunction(each)}
            type("Drawn", (), {**functions, "layout": _Layout()})().draw(bpy.context)
    if found := selection.active(bpy.context):
        effect = found[1]
        for i, shutter in enumerate(effect.shutters):
            panels.SHUTTER_UL_shutters.draw_item(None, None, _Layout(), effect, shutter, 0, effect, "", i)
            with trial.only(validation.EffectError):
                bar_edits.bars_now(effect, i)
        for region in effect.regions:
            panels.SHUTTER_UL_regions.draw_item(None, None, _Layout(), effect, region, 0, effect, "", 0)
        panels.SHUTTER_UL_regions.filter_items(SimpleNamespace(bitflag_filter_item=1), None, effect, "regions")


def _export(bpy, folder):
    from shutter_addon.blender.data import selection, validation
    from shutter_addon.blender.output import matte_export
    from shutter_addon.core.recipes.recipe import RecipeError
    from shutter_addon.media import MediaError

    if found := selection.active(bpy.context):
        folder.mkdir(exist_ok=True)
        with trial.only(validation.EffectError, RecipeError, MediaError):
            matte_export.recipe_for(*found, folder / "r.json")


def _render(bpy, folder, frame: int) -> int:
    """A frame of the edit; the engine may end the process, with 2."""
    folder.mkdir(parents=True)
    edit = bpy.context.scene
    settings = edit.render.image_settings
    settings.media_type = "IMAGE"
    settings.file_format = "PNG"
    edit.frame_set(frame)
    edit.render.filepath = str(folder / "picture.png")
    for scene in bpy.data.scenes:
        scene.render.use_render_cache = False  # OpenEXR writes it by threads that are not there after a fork
    try:
        bpy.ops.render.render(write_still=True, scene=edit.name)
    except RuntimeError as error:
        return 0 if "Virtual Shutter" not in str(error) else 2
    return 0
