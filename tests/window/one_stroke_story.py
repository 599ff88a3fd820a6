"""One stroke is enough: drawn, tracked, mended where it is wrong, and rendered, by mouse."""

import bpy
import driver
import numpy as np
import story
from driver import part

# Of the footage's frame 70, in fractions of the picture: down a woman's back.
FRAME, STROKE = 70, ((0.462, 0.65), (0.465, 0.62), (0.467, 0.59), (0.468, 0.565))
MENDED, REDRAWN = 85, 78
SHOWN = range(55, 96)
RENDERED = range(65, 86, 20)
FOLLOW_EDGES, TRACK = 355, 193  # where they stand in the sidebar, in pixels below its upper edge


def region():
    return story.effect().regions[0]


def on_preview(x, y):
    view, render = story.preview().view2d, driver.edit().render
    return view.view_to_region((x - 0.5) * render.resolution_x, (y - 0.5) * render.resolution_y, clip=False)


def kinds():
    """Of the keys of the location by frame."""
    from bpy_extras.anim_utils import action_get_channelbag_for_slot as bag_of

    data = driver.edit().animation_data
    if data is None:
        return {}
    curve = bag_of(data.action, data.action_slot).fcurves.find("virtual_shutter.effects[0].regions[0].location")
    return {int(key.co[0]): key.type for key in curve.keyframe_points}


def drawn():
    with driver.override("PREVIEW"):
        bpy.ops.shutter.draw("INVOKE_DEFAULT", True, new=True)
    yield 0.5
    region().finds_subject = False  # it stays a scribble, which is tracked
    yield from driver.drag(story.preview(), [on_preview(*point) for point in STROKE])
    assert len(story.effect().regions) == 1
    yield


def tracked():
    """By the button in the sidebar."""
    before = kinds()
    driver.click(sidebar(), sidebar().width * 0.45, sidebar().height - TRACK)
    yield from driver.until(lambda: is_tracking() or kinds() != before, "tracking begins")


def sidebar():
    return driver.region_of(driver.area_of("SEQUENCE_EDITOR", "PREVIEW"), "UI")


def is_tracking():
    return "SHUTTER_OT_track" in [operator.bl_idname for operator in bpy.context.window.modal_operators]


def ended():
    yield from driver.until(lambda: not is_tracking(), "tracking ends", 90)


def edges_followed():
    """The slider, which the first stroke has set, is dragged to its start and to its end."""
    region = sidebar()
    height = region.height - FOLLOW_EDGES
    assert story.effect().edge_aware == 1
    for shares in ((0.8, 0.7, 0.6, 0.5, 0.3), (0.45, 0.5, 0.6, 0.7, 0.8, 0.95)):
        yield from driver.drag(region, [(region.width * share, height) for share in shares])
        yield 1.0
        driver.saw(edges=story.effect().edge_aware)
    driver.key("Escape")  # a slider that was not dragged far is a field to type in
    yield 2.0
    driver.saw(edge_aware=story.effect().edge_aware)
    driver.shot("5_edges")
    for view in ("COEFFICIENTS", "RESULT"):
        bpy.context.window_manager.virtual_shutter.view = view
        yield 2.0
        driver.shot(f"5_edges_{view.lower()}")


def mended():
    """The handle is dragged at a frame, which keys the region there by itself; tracking goes through that key."""
    driver.edit().frame_set(MENDED)
    yield 1.0
    with driver.override("PREVIEW"):
        x, y = part("blender.interface.region_gizmo").place(bpy.context).centre
    driver.shot("3_wrong")
    before = tuple(region().location)
    yield from driver.drag(story.preview(), [(x, y), (x + 4, y + 3), (x + 8, y + 6)])
    yield from driver.until(lambda: kinds().get(MENDED) == "KEYFRAME", "the handle keys the region")
    assert tuple(region().location) != before
    yield 1.0
    driver.shot("3_mended")
    keyed = story.curves()
    yield from tracked()
    yield from ended()
    assert [frame for frame, kind in kinds().items() if kind == "KEYFRAME"] == [FRAME, MENDED]
    driver.saw(mended=kinds())
    yield from driver.until(lambda: driver.edit().frame_current == MENDED, "the frame is where it was")
    yield 1.0
    driver.shot("3_tracked_again")
    after = story.curves()
    driver.move(story.preview(), 50, story.preview().height - 50)
    yield
    driver.key("ctrl+z")
    yield from driver.until(lambda: story.curves() == keyed, "one undo takes the second track back")
    driver.key("ctrl+shift+z")
    yield from driver.until(lambda: story.curves() == after, "and redo brings it again")


def escaped():
    driver.edit().frame_set(FRAME)
    yield 1.0
    yield from tracked()
    yield from driver.until(lambda: driver.edit().frame_current != FRAME, "the preview goes along", 60, wait=0.02)
    driver.shot("4_escaping")
    driver.key("Escape")
    yield from ended()
    driver.saw(escaped=kinds(), frame=driver.edit().frame_current)


def redrawn():
    """At another frame of what is tracked, a stroke lies where it is drawn; the pen is left, and one drag of the handle
    moves it. Around what is sharp stands a line."""
    driver.edit().frame_set(REDRAWN)
    yield 1.0
    moved, place = np.array(stroke_at(REDRAWN)), part("blender.interface.region_gizmo").place
    points = [np.add(moved, (0.1, y)) for y in (0.05, 0.02, -0.01, -0.04)]
    with driver.override("PREVIEW"):
        bpy.ops.shutter.draw("INVOKE_DEFAULT", True)
    yield 1.0
    driver.shot("6_begun")
    yield from driver.drag(story.preview(), [on_preview(*point) for point in points])
    apart = np.array(stroke_at(REDRAWN)) - np.mean(points, axis=0)
    assert np.abs(apart).max() < 0.01, apart
    assert np.abs(np.array(stroke_at(FRAME)) - np.mean(STROKE, axis=0)).max() < 0.01
    yield 1.0
    driver.shot("6_redrawn")
    with driver.override("PREVIEW"):
        x, y = place(bpy.context).centre
    before = stroke_at(REDRAWN)
    yield from driver.drag(story.preview(), [(x, y), (x + 10, y), (x + 20, y)])
    strokes = story.effect().scene.annotation.layers[region().layer].frames[-1].strokes
    assert len(strokes) == 1, "the drag draws nothing"
    assert stroke_at(REDRAWN)[0] > before[0] + 0.01
    assert kinds()[REDRAWN] == "KEYFRAME"
    bpy.context.window_manager.virtual_shutter.view = "EDGES"
    yield 2.0
    driver.shot("6_edges")


def rendered(frames=RENDERED):
    edit = driver.edit()
    edit.frame_start, edit.frame_end, edit.frame_step = frames.start, frames.stop - 1, frames.step
    driver.render("final_", animation=True)
    yield from driver.render_ended()
    for frame in frames:
        driver.saw(rendered=frame, stroke=stroke_at(frame) if story.effect().regions else None)


def looked_at():
    """The frame as it is rendered, pixel for pixel, with nothing over it."""
    with driver.override("PREVIEW"):
        bpy.ops.shutter.full_quality()
        bpy.ops.sequencer.view_all_preview()
        height = story.preview().height
        bpy.ops.sequencer.view_zoom_ratio(ratio=(height + 1) / height)  # as the operator takes it for one pixel larger
        bpy.context.space_data.show_overlays = bpy.context.space_data.show_gizmo = False
    yield from story.seen("7_full_quality")


def stroke_at(frame):
    """The middle of the region's stroke at a frame, in fractions of the picture."""
    edit, effect, strip = part("blender.data.selection").active(bpy.context)
    (points,) = part("blender.data.snapshot").region_at(edit, effect, strip, 0, (frame,)).at(frame).strokes
    return points.mean(axis=0).tolist()


def begun(shown=SHOWN, draw=drawn, size=(768, 576)):
    """The stroke is drawn, and the sidebar shows its buttons. shown: the frames that the strip is trimmed to; draw: a
    generator, as `drawn`, of what is drawn in its place; size: of the footage."""
    yield from story.opened(*size)
    driver.edit().frame_end = 100
    area = driver.area_of("SEQUENCE_EDITOR", "SEQUENCER")
    yield from driver.edge_moved(area, 0, 200 - area.height)  # a low timeline leaves room for the panel
    yield from story.movie_added()
    movie = driver.edit().sequence_editor.strips_all[0]
    movie.left_handle, movie.right_handle = shown.start, shown.stop
    driver.edit().frame_set(FRAME)
    yield from story.effect_added()
    story.effect().inbetween = "1"  # moments take a software renderer long
    story.effect().active_shutter = 1
    yield from draw()
    driver.shot("1_stroke")


def steps():
    yield from begun()
    yield from tracked()
    yield from ended()
    yield 1.0
    driver.shot("2_tracked")
    driver.saw(tracked=kinds(), frame=driver.edit().frame_current)
    yield from mended()
    yield from escaped()
    yield from edges_followed()
    yield from rendered()
    yield from redrawn()
