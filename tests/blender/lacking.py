"""What needs a package that is missing says so, in one sentence, and leaves nothing behind; run inside Blender by
test_package.py, with an edit of a movie, where none of the wheels can be loaded.

Arguments: a folder for recipes and the extension's id."""

import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import bpy
from support import sequencer

folder, name = Path(sys.argv[-2]), sys.argv[-1]
ops, edit = bpy.ops.shutter, bpy.context.scene
TRACKING = "tracking needs the Python package opencv-contrib-python-headless; install the zip"
OUTLINE = "the Python package opencv-contrib-python-headless; install the zip"
MOMENTS = "moments between frames need the Python package"
BAKE = "the Python package av is missing, which movies need: bake to OpenEXR"
# Operators by the kind of region that they work on, their options, and what they say.
LACKING = [
    ("line", "track", {}, TRACKING),
    ("line", "track_camera", {}, TRACKING),
    ("line", "tripod", {}, TRACKING),
    ("line", "panning_shot", {}, TRACKING),
    ("line", "find_readout", {}, f"the readout is found by {OUTLINE}"),
    ("line", "rolling_shutter", {}, MOMENTS),
    ("line", "outline_it", {}, f"outlines are proposed by {OUTLINE}"),
    ("line", "subject_find", {}, f"subjects are found by {OUTLINE}"),
    ("line", "bake", {"file_format": "MOVIE"}, BAKE),
    ("outline", "track", {}, TRACKING),
    ("outline", "outline_needed", {}, f"outlines are tracked by {OUTLINE}"),
    ("outline", "outline_draw", {}, f"outlines are tracked by {OUTLINE}"),
]
KINDS = {
    "line": {"strokes": [[[0.2, 0.2], [0.6, 0.9]]]},
    "outline": {
        "keys": [
            {"frame": frame, "strokes": [[[0.2, 0.2], [0.6, 0.2], [0.5, 0.8]]], "ease": "linear"} for frame in (2, 9)
        ],
        "strokes": [[[0.2, 0.2], [0.6, 0.2], [0.5, 0.8]]],
    },
}


def prepared(kind):
    """One region of that kind, at a frame between an outline's drawings."""
    region = {"name": "R", "shutter": "Sharp", "kind": kind, **KINDS[kind]}
    shutters = [{"name": "Long", "bars": [1, 1, 1, 1]}, {"name": "Sharp", "bars": [1, 0, 0, 0]}]
    path = folder / "lacking.json"
    path.write_text(json.dumps({"version": 2, "window": 4, "shutters": shutters, "regions": [region]}))
    assert ops.recipe_import(filepath=str(path)) == {"FINISHED"}
    edit.virtual_shutter.effects[0].active_shutter = 1
    edit.virtual_shutter.effects[0].active_region = 0
    edit.frame_set(5)


def state():
    """The effect as a recipe, and what Blender has."""
    path = folder / "state.json"
    assert ops.recipe_export(filepath=str(path)) == {"FINISHED"}
    datablocks = {kind: len(getattr(bpy.data, kind)) for kind in ("scenes", "masks", "images", "actions", "textures")}
    strips = [(strip.name, strip.channel, strip.left_handle) for strip in edit.sequence_editor.strips_all]
    return path.read_text(), datablocks, strips, sorted(path.name for path in Path(bpy.data.filepath).parent.iterdir())


def refusal(operator, options):
    try:
        done = getattr(ops, operator)(**options)
    except RuntimeError as error:
        return str(error).strip()
    return f"says nothing: {done}"


assert name in bpy.context.preferences.addons
faults = []
with sequencer(bpy):
    edit.sequence_editor.active_strip = next(s for s in edit.sequence_editor.strips_all if s.type == "SCENE")
    for kind, operator, options, sentence in LACKING:
        prepared(kind)
        before = state()
        said = refusal(operator, options)
        if sentence not in said or "\n" in said:
            faults.append(f"{kind} {operator}: {said}")
        left = [pair for pair in zip(before, state(), strict=True) if pair[0] != pair[1]]
        if left:
            faults.append(f"{kind} {operator} left: {left}")
assert not faults, "\n".join(faults)
print("ALL SAY SO")
