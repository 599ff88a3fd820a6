"""A region ends where its track ends and with its shot; Tripod goes on where the camera's track is broken: by mouse.
Run inside Blender, by test_tracked.py, on a film that it makes: the walkers, who are covered at the end, between two
shots of another film, the second behind some grey frames."""

# ruff: noqa: E402 (Blender finds the helpers once it knows their folder)
import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent)]

import bpy
import driver
import one_stroke_story
import story
from one_stroke_story import part

FRAME, LAST = 50, 110


def curve_of(path):
    """The F-curve of how much something counts, or None."""
    from bpy_extras.anim_utils import action_get_channelbag_for_slot as bag_of

    data = story.edit().animation_data
    return bag_of(data.action, data.action_slot).fcurves.find(f"virtual_shutter.effects[0].{path}")


def ends(path):
    """Frame, value and type of its keys."""
    curve = curve_of(path)
    return [(int(key.co[0]), round(key.co[1], 3), key.type) for key in curve.keyframe_points] if curve else []


def gaps(index):
    found = part("blender.editing.track_region").gaps(story.effect(), index)
    return [[str(gap.first), str(gap.last)] for gap in found]


def looked_at(name, frames):
    for frame in frames:
        story.edit().frame_set(frame)
        yield from story.seen(f"{name}_{frame:03d}")


def ended():
    """Tracked by the button: it counts within its shot alone; one undo takes all of it back."""
    before = story.curves()
    yield from one_stroke_story.tracked()
    yield from one_stroke_story.ended()
    after = story.curves()
    driver.saw(region=ends("regions[0].opacity"), gaps=gaps(0))
    driver.shot("panel")
    driver.move(story.preview(), 50, story.preview().height - 50)
    yield
    driver.key("ctrl+z")
    yield from driver.until(lambda: story.curves() == before, "one undo takes the track and its ends back")
    driver.key("ctrl+shift+z")
    yield from driver.until(lambda: story.curves() == after, "and redo brings them again")
    frames = (20, FRAME, 61, 76)
    yield from looked_at("there", frames)
    curve_of("regions[0].opacity").mute, one_stroke_story.region().opacity = True, 0  # its handles stay
    yield from looked_at("without", frames)
    curve_of("regions[0].opacity").mute = False


def on_a_tripod():
    """Of the default shutter."""
    story.edit().frame_set(FRAME)
    story.effect().active_shutter = 0
    yield 0.5
    with driver.override("PREVIEW"):
        bpy.ops.shutter.tripod("INVOKE_DEFAULT", True)
    yield from driver.until(lambda: story.effect().shutters[0].follow == "CAMERA", "the camera is tracked", 120)
    yield 1.0
    camera = part("blender.editing.motion_keys").MotionKeys(story.effect(), None, "SCALE")
    frames, _confidence = camera.confidence()
    driver.saw(
        camera=ends("camera.influence"), camera_gaps=gaps(None), tracked=[frames.min().item(), frames.max().item()]
    )
    yield from looked_at("tripod", (FRAME, 68, 70, 76, 90))
    driver.shot("tripod_panel")


def told():
    yield from story.opened()
    story.edit().render.resolution_x, story.edit().render.resolution_y, story.edit().frame_end = 768, 576, LAST
    yield from one_stroke_story.roomier()
    yield from story.movie_added()
    story.edit().frame_set(FRAME)
    yield from story.effect_added()
    story.effect().active_shutter = 1
    yield from one_stroke_story.drawn()
    yield from ended()
    yield from on_a_tripod()


if __name__ == "__main__":
    driver.play(told)
