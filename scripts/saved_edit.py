"""An edit that has a value for everything that the extension stores in a .blend file, and recipes that have every kind
of part: what save_version.py keeps of each version."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np
from support import write_frames

from shutter_addon.blender.data import matte_content, recipe_import, strips
from shutter_addon.blender.editing import add_effect
from shutter_addon.core.recipes import recipe_file
from shutter_addon.features.bake.blender import bake_operators, baked_film
from shutter_addon.media.image_writing import write_exr

WIDTH, HEIGHT, COUNT = 64, 36, 12
BAKED = 5  # frames of the source whose effect is baked
SHOWN = (3, 8, 15, 20, 27)  # timeline frames whose pictures are kept: of each effect but the last
RECIPES = {"regions": 6, "combined": 5}  # and a frame of each recipe's film
EASED = {"ease": "bezier"}

_SQUARE = [[0.3, 0.2], [0.7, 0.2], [0.7, 0.8], [0.3, 0.8]]
_SHIFTED = [[x + 0.1, y] for x, y in _SQUARE]
_MOVES: list = [{"frame": 1, "scale": 0.9}, {"frame": 12, "location": [0.1, -0.05], "rotation": 20, **EASED}]


def _values(first: float, last: float) -> list[dict]:
    return [{"frame": 1, "value": first, **EASED}, {"frame": 12, "value": last}]


def regions() -> dict:
    """A recipe with all kinds of regions."""
    following = {"follow": "walker", "follow_motion": "location", "follow_smooth": 1}
    shutters = [
        {"name": "Long", "color": [0.2, 0.5, 1.0], "bars": [1, 1, 0.5, 1]},
        {"name": "Keyed", "keys": [{"frame": 1, "bars": [1, 0, 0, 0], **EASED}, {"frame": 12, "bars": [0, 0.5, 1, 0]}]},
        {"name": "Panned", "bars": [1, 1, 1, 1], "trail": _values(0.1, 0.3), **following},
        {"name": "Steady", "bars": [1, 1, 1, 1], "follow": "camera"},
    ]
    matte = {"path": "footage/matte.exr", "channel": "subject", "invert": True, "offset": 1, "timing": "timeline"}
    parts = [
        {
            "name": "walker",
            "shutter": "Panned",
            "width": 0.1,
            "strokes": [[[0.2, 0.3], [0.3, 0.6]]],
            "keys": [*_MOVES[:1], {"frame": 6, "strokes": [[[0.3, 0.3], [0.35, 0.6]]]}, *_MOVES[1:]],
        },
        {"name": "lasso", "shutter": "Keyed", "kind": "lasso", "strokes": [_SHIFTED], "opacity": _values(1, 0.4)},
        {
            "name": "outline",
            "shutter": "Steady",
            "kind": "outline",
            "between": "straight",
            "strokes": [_SQUARE],
            "width": _values(0.05, 0.1),
            "keys": [{"frame": 1, "strokes": [_SQUARE]}, {"frame": 9, "strokes": [_SHIFTED]}],
        },
        {"name": "matte", "shutter": "Keyed", "kind": "matte", "blend": "add", "opacity": 0.5, **matte},
        {"name": "ramp", "shutter": "Keyed", "kind": "ramp", "ramp": "radial", "opacity": 0.4, "keys": _MOVES},
    ]
    keyed = {"edge_aware": _values(0.2, 0.8), "camera": _MOVES, "camera_influence": _values(1, 0.5)}
    return {"version": 2, "window": 4, "position": "center", "shutters": shutters, "regions": parts} | keyed


def combined() -> dict:
    """A recipe with frames that are combined, layers, a time map, and other options."""
    shutters = [
        {"name": "Median", "bars": [1] * 6, "combine": "median", "length": "timeline"},
        {"name": "Lights", "bars": [1] * 6, "combine": "lightest", "threshold": _values(0.2, 0.6), "softness": 0.2},
        {"name": "Shades", "bars": [1, 0.5, 1, 1, 1, 1], "combine": "darkest", "by_luminance": True},
    ]
    parts = [
        {"name": "light", "shutter": "Lights", "kind": "lasso", "strokes": [_SQUARE], "layer": True},
        {"name": "bright", "shutter": "Shades", "kind": "ramp", "ramp": "luminance", "opacity": 0.5},
    ]
    words = {"position": "end", "interpolation": "value", "light": "encoded", "exposure": "weighted", "edges": "mirror"}
    flags = {"border": True, "stop_at_cuts": False, "decontaminate": False}
    numbers = {"version": 2, "window": 6, "aggregate": 2, "plate_reach": 3, "time": _values(1, 9)}
    return {"shutters": shutters, "regions": parts} | words | flags | numbers


def _carried() -> dict:
    """A recipe of what needs optical flow, whose pictures differ from machine to machine by more than a level."""
    outline = {"name": "carried", "shutter": "Long", "kind": "outline", "strokes": [_SQUARE]}
    subject = {"name": "subject", "shutter": "Long", "kind": "subject", "strokes": [_SQUARE], "not_strokes": [_SQUARE]}
    subject["keys"] = [{"frame": 2, "strokes": [_SQUARE]}]
    shutters = [{"name": "Long", "bars": [1, 1, 1, 1]}, {"name": "Sharp", "bars": [1, 0, 0, 0]}]
    return {"version": 2, "window": 4, "inbetween": 2, "shutters": shutters, "regions": [outline, subject]}


def write_footage(folder: Path) -> None:
    """A disc and a bright bar that walk over a ground of soft colors, 12 frames; five that are transparent in part;
    and a matte."""
    y, x = np.indices((HEIGHT, WIDTH))
    frames = np.empty((COUNT, HEIGHT, WIDTH, 4), np.uint8)
    for i, frame in enumerate(frames):
        frame[:] = np.stack([60 + x, 40 + 3 * y, 150 - x, np.full_like(x, 255)], axis=-1)
        frame[np.hypot(x - 12 - 3 * i, y - 16) < 8, :3] = 230, 90, 40
        frame[24:30, 50 - 3 * i : 54 - 3 * i, :3] = 250
    write_frames(folder, frames[..., :3])
    frames[..., 3] = np.where(y > 24, 128, 255)
    write_frames(folder, frames[:BAKED], "clear")
    matte = np.clip(1.5 - np.hypot(x - 40, y - 18) / 12, 0, 1)
    write_exr(folder / "matte.exr", np.stack([matte, 1 - matte], axis=-1), ["subject", "ground"])


def make(path: Path) -> None:
    """The edit, saved at a path; its footage is in the folder beside."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    scene.name = "Edit"
    scene.sequence_editor_create()
    render = scene.render
    render.fps, render.resolution_x, render.resolution_y, render.dither_intensity = 25, WIDTH, HEIGHT, 0
    scene.view_settings.view_transform = "Standard"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    footage, first = path.parent / "footage", 1
    for name, data in (("regions", regions()), ("combined", combined()), ("baked", None), ("carried", _carried())):
        count = COUNT if data else BAKED
        source = _source(scene, footage, name, count, first, "f" if data else "clear")
        strip, effect = add_effect.add_effect(scene, source)
        strip.name = f"{name} effect"
        recipe = recipe_file.parse(recipe_file.json.dumps(data or combined() | {"time": [], "edges": "shorten"}))
        recipe_import.apply(scene, effect, strip, recipe, path.parent)
        first += count
    effect.regions[-1].finds_subject = True
    scene.frame_start, scene.frame_end = 1, first - 1
    _bake(scene, scene.sequence_editor.strips["baked effect"])
    _add_other_regions(scene, scene.virtual_shutter.effects[3], footage)
    bpy.ops.file.make_paths_relative()
    for space in (space for screen in bpy.data.screens for area in screen.areas for space in area.spaces):
        if space.type == "FILE_BROWSER" and space.params:
            space.params.directory = b"//"  # else it is this machine's home
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True)


def _source(scene: Any, footage: Path, name: str, count: int, first: int, files: str) -> Any:
    source = scene.sequence_editor.strips.new_image(name, str(footage / f"{files}0001.png"), 1, first)
    for i in range(2, count + 1):
        source.elements.append(f"{files}{i:04d}.png")
    return source


def _bake(scene: Any, strip: Any) -> None:
    effect = strips.effect_of(scene, strip.scene)
    strip.left_handle += 1
    film = baked_film.film_of(scene, effect, strip, "OPEN_EXR")
    baked_film.render(scene, effect, strip, film, lambda _count: None)
    bake_operators.add_strip(scene, strip, film)


def _add_other_regions(scene: Any, effect: Any, footage: Path) -> None:
    """What no recipe has: mattes of the edit, and what tracking knows."""
    masked, cut, followed = (effect.regions.add() for _ in range(3))
    for region, name in ((masked, "mask"), (cut, "strip"), (followed, "track")):
        region.name, region.shutter, region.kind = name, effect.shutters[0].name, "MATTE"
    masked.matte, masked.mask = "MASK", bpy.data.masks.new("Mask")
    spline = masked.mask.layers.new(name="layer").splines.new()
    spline.points.add(2)
    for point, place in zip(spline.points, ((0.2, 0.3), (0.8, 0.3), (0.5, 0.8)), strict=True):
        point.co = place
    spline.use_cyclic = True
    cut.matte = "STRIP"
    matte_content.choose_strip(cut, "combined")
    followed.kind = "LINE"
    followed.follow_clip = bpy.data.movieclips.load(str(footage / "f0001.png"))
    followed.follow_kind, followed.follow_object, followed.follow_track = "PLANE", "Camera", "Plane Track"
    stop = followed.stops.add()
    stop.frame, stop.forward, stop.fault = 9, True, "it left the picture"
    noted = followed.drawn.add()
    noted.frame, noted.location, noted.rotation, noted.scale = 1, (0.05, 0.1), 0.2, 1.3
    effect.camera.name = "Handheld"
    for moving in (followed, effect.camera):
        moving.confidence, moving.motion, moving.track_until = 87.5, "ROTATION", 34
        moving.track_all_keys, moving.track_ends = True, False
        moving.location, moving.rotation, moving.scale = (0.1, -0.2), 0.3, 1.1
    effect.camera.influence, effect.shutters[0].trail = 0.6, 0.4
    effect.shutters[1].preset, effect.shutters[1].preset_position = "STILL", "START"
    effect.source_time, effect.active_shutter, effect.active_region = 7.5, 1, 2
    effect.camera.stops.add().frame = 4
    effect.name = "Carried"
