"""What is asked of a renderer, made of a recipe and plain facts of a clip: no file, no device and no session."""

import json

import numpy as np
import pytest
from support import image_strip, recipe, write_frames

from shutter_addon.blender.data import recipe_import, snapshot
from shutter_addon.blender.editing import add_effect
from shutter_addon.blender.rendering import sessions
from shutter_addon.compute.request import Request
from shutter_addon.core.model.clip import Clip
from shutter_addon.core.model.state_at import state_at
from shutter_addon.core.recipes import recipe_file

COUNT, WIDTH, HEIGHT = 24, 64, 32
LINE = {"shutter": "S1", "name": "Car", "strokes": [[[0.25, 0.25], [0.5, 0.75]]], "width": 0.125}
MOVED = LINE | {"keys": [{"frame": 1}, {"frame": 17, "location": [0.5, 0.25]}]}
CAMERA = [{"frame": 1}, {"frame": 17, "location": [-0.25, 0.125]}]


def effect_of(*regions, **options):
    data = recipe(8, [1] * 8, [0, 0, 1, 1, 1, 0, 0, 0], regions=regions, position="center", border=True, **options)
    data["shutters"][1] |= {"follow": "Car", "trail": 0.25}
    return data


def with_shutter(data, **more):
    data["shutters"][0] |= more
    return data


RECIPES = {
    "what is followed, and its trail": effect_of(MOVED),
    "slides": effect_of(MOVED, edges="slide"),
    "layers before a camera that pans": effect_of(MOVED | {"layer": True}, camera=CAMERA, plate_reach=4),
    "the timeline's length": with_shutter(effect_of(MOVED), length="timeline"),
    "source time": effect_of(MOVED, time=[{"frame": 1, "value": 9}, {"frame": 17, "value": 1}]),
    "smooth": effect_of(MOVED, inbetween=2),
}


@pytest.mark.parametrize("name", RECIPES)
def test_it_is_what_the_session_asks_for(bpy, edit, tmp_path, name):
    found = recipe_file.parse(json.dumps(RECIPES[name]))
    clip = Clip(width=WIDTH, height=HEIGHT, count=COUNT).stepped(found.options.at(1).step)
    made = {frame: Request(*state_at(found.for_picture(WIDTH / HEIGHT), clip, frame)) for frame in (1, 8, COUNT)}

    first = write_frames(tmp_path / "in", np.zeros((COUNT, HEIGHT, WIDTH, 3), np.uint8))
    source = image_strip(edit, first)
    strip, effect = add_effect.add_effect(edit, source)
    recipe_import.apply(edit, effect, strip, found)
    for frame, ours in made.items():
        taken = snapshot.take(edit, effect, strip, (frame,))
        asked = sessions.of_drawing().request(taken, frame)
        assert (ours.index, ours.direction) == (asked.index, asked.direction)
        assert ours.state.key == asked.state.key
    sessions.forget()
