"""The way of a rendered frame: the page that tells it, and how often it comes back to a room."""

import json
import re
from pathlib import Path

import frame_trace
import numpy as np
from support import write_movie

from shutter_addon.blender.commands import render_command
from shutter_addon.blender.rendering import sessions
from shutter_addon.core.recipes import recipe_file
from shutter_addon.media import open_source

ROOT = Path(__file__).parents[2]

RECIPE = {
    "version": 2,
    "window": 8,
    "border": True,
    "shutters": [{"name": "Long", "bars": [1] * 8}, {"name": "Sharp", "bars": [1] + [0] * 7}],
    "regions": [{"shutter": "Sharp", "kind": "line", "width": 0.02, "strokes": [[[0.3, 0.2], [0.5, 0.8]]]}],
}


def film(path):
    noise = np.random.default_rng(0).integers(0, 256, (90, 160, 3), np.uint8)
    return write_movie(path, [np.roll(noise, index, axis=1) for index in range(45)], "libx264", "yuv420p", 25)


def ways(bpy, footage, frames, tmp_path):
    """The stops of each of these frames, rendered one after the other."""
    import shutter_addon

    sessions.forget()
    with open_source(footage) as medium:
        scene = render_command.make_edit(footage, medium, recipe_file.parse(json.dumps(RECIPE)), tmp_path)
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "PNG", "16"
    door = "VirtualShutterEngine.render"
    for frame in frames:
        scene.frame_set(frame)
        scene.render.filepath = str(tmp_path / f"{frame}.png")
        with frame_trace.traced(Path(shutter_addon.__file__).parent, door, door) as stops:
            bpy.ops.render.render(write_still=True, scene=scene.name)
        yield stops


def test_a_rendered_frame_goes_the_way_of_the_page(bpy, tmp_path):
    first, second = ways(bpy, film(tmp_path / "film.mp4"), (30, 31), tmp_path)
    page = (ROOT / "docs" / "developers.md").read_text(encoding="utf-8").partition("\n## How a frame is made\n")[2]
    told = re.findall(r"(?m)^\| `(.+?)` \| `(.+?)` \|", page.split("| File | Function |")[1])
    made = [(stop.path, stop.function) for stop in first]
    assert [stop for stop in made if stop in told] == told
    back = frame_trace.returns(second)
    assert len(back) <= 6, [stop[:2] for stop in back]
