"""The first minutes of an editor, in a real window, by mouse and keys: bars between keys and the extension disabled;
an effect without a mouse; then from an empty Video Editing file to a finished picture. The effect's data and the
preview's picture are kept after every step; then each is undone and redone, and both must be what they were.
"""

import os

import bars_and_disable
import bpy
import driver
import keyboard_story
from driver import edit
from support import write_frames

FOOTAGE = os.environ["SHUTTER_FOOTAGE"]
FRAME, LATER = 50, 90
WIDTH, HEIGHT = 320, 180


def effect():
    return edit().virtual_shutter.effects[0]


def preview():
    return driver.region_of(driver.area_of("SEQUENCE_EDITOR", "PREVIEW"), "PREVIEW")


def curves():
    data = edit().animation_data
    if not (data and data.action and data.action_slot):
        return []
    from bpy_extras.anim_utils import action_get_channelbag_for_slot as bag_of

    bag = bag_of(data.action, data.action_slot)
    found = bag.fcurves if bag else []
    return sorted((c.data_path, [tuple(round(v, 4) for v in key.co) for key in c.keyframe_points]) for c in found)


def facts():
    """All that the steps change, as plain data."""
    strips = sorted((s.name, s.channel, s.left_handle, s.right_handle) for s in edit().sequence_editor.strips_all)
    effects = []
    for e in edit().virtual_shutter.effects:
        layers = e.scene.annotation.layers if e.scene.annotation else []
        drawn = [(l.info, [(f.frame_number, [len(s.points) for s in f.strokes]) for f in l.frames]) for l in layers]
        bars = [(s.name, [round(b.weight, 4) for b in s.bars]) for s in e.shutters]
        regions = [(r.name, r.shutter, [round(v, 4) for v in (*r.location, r.rotation, r.scale)]) for r in e.regions]
        effects.append([e.window, bars, regions, drawn])
    return repr([strips, effects, curves()])


def crop():
    region = preview()
    left, bottom = driver.screen(region, 0, 0)
    return [left, bottom - region.height + 1, region.width, region.height]


def seen(name, **measures):
    """The picture as it is now, and facts, by functions; by default the edit's data."""
    driver.move(preview(), preview().width / 2, preview().height + 12)  # where it highlights nothing
    yield 0.8
    yield from driver.shot_when_shown(name)
    measures = measures or {"facts": facts, "frame": lambda: edit().frame_current}
    driver.saw(step=name, crop=crop(), **{fact: measure() for fact, measure in measures.items()})


def all_viewed():
    with driver.override("PREVIEW"):
        bpy.ops.sequencer.view_all_preview()


def opened(width=1280, height=720):
    yield from driver.video_editing_opened()
    edit().render.resolution_x, edit().render.resolution_y, edit().frame_end = width, height, 132
    yield 0.5
    bpy.ops.ed.undo_push(message="Start")


def pictures_opened(pictures, frame):
    """A saved edit of a strip of these pictures under a new effect, without moments, at a frame."""
    height, width = pictures[0].shape[:2]
    yield from opened(width, height)
    edit().frame_end = len(pictures)
    driver.strip_added("Film", write_frames(driver.OUT / "film", pictures))
    bpy.ops.wm.save_as_mainfile(filepath=str(driver.OUT / "film.blend"))
    with driver.override("SEQUENCER"):
        bpy.ops.shutter.add_effect("INVOKE_DEFAULT", True)
    yield 1.0
    edit().frame_set(frame)
    effect().inbetween = "1"


def movie_added():
    with driver.override("SEQUENCER"):
        bpy.ops.sequencer.movie_strip_add(
            "EXEC_DEFAULT", True, filepath=FOOTAGE, channel=1, frame_start=1, sound=False, move_strips=False
        )
    yield 0.5
    assert [s.type for s in edit().sequence_editor.strips_all] == ["MOVIE"]
    edit().frame_set(FRAME)
    yield


def effect_added():
    yield from driver.effect_added()
    assert [shutter.name for shutter in effect().shutters] == ["Long", "Sharp"]
    yield from driver.until(lambda: sidebar().active_panel_category == "Shutter", "the Shutter tab opens")
    all_viewed()
    yield 0.5


def scribbled():
    effect().edge_aware = 0.0  # or Draw would set it, and what is drawn over the preview be a draft
    with driver.override("PREVIEW"):
        bpy.ops.shutter.draw("INVOKE_DEFAULT", True)
    yield 0.5
    region = preview()
    w, h = region.width, region.height
    yield from driver.drag(region, [(w * x, h * y) for x, y in ((0.4, 0.5), (0.45, 0.6), (0.5, 0.6), (0.55, 0.5))])
    layer = effect().scene.annotation.layers[effect().regions[0].layer]
    assert [len(frame.strokes) for frame in layer.frames] == [1]
    driver.pen_left()
    region.tag_redraw()  # its handles are back, which else come with the pointer
    yield


def preset_chosen():
    effect().active_shutter = 1
    region = preview()
    driver.move(region, region.width / 2, region.height / 2)
    yield
    with driver.override("PREVIEW"):
        bpy.ops.wm.call_menu(name="SHUTTER_MT_presets")
    yield 0.5
    driver.shot("presets")
    driver.text("90")  # types to search, or goes to the entry that begins so
    yield 0.3
    driver.key("Return")
    yield 0.5


def sidebar():
    return driver.region_of(driver.area_of("SEQUENCE_EDITOR", "PREVIEW"), "UI")


def chosen_beside_draw(entry, below=168):
    """The first of an entry's own menu, in the menu of regions; the sidebar is as high as it needs. below: where the
    menu is, in pixels below the sidebar's upper edge."""
    driver.click(sidebar(), sidebar().width * 0.87, sidebar().height - below)
    yield 0.8
    driver.key(*["Down"] * entry)
    yield 0.3
    driver.key("Right")
    yield 0.5
    driver.shot("menu")
    driver.key("Return")


def bars():
    return [round(bar.weight, 4) for bar in effect().shutters[1].bars]


def bars_dragged(points, hold=()):
    before = bars()
    yield from driver.drag(preview(), points, hold)
    assert bars() != before, "the bars did not change"


def keyed():
    driver.move(preview(), 60, 60)
    yield 0.4
    driver.key("i")
    yield 0.5
    frame = edit().frame_current
    found = [path for path, keys in curves() if any(key[0] == frame for key in keys)]
    assert len(found) == effect().window, f"{len(found)} bars have a key at {frame}"


def moved_to(frame):
    area = driver.area_of("SEQUENCE_EDITOR", "SEQUENCER")
    window = driver.region_of(area, "WINDOW")
    x, _ = window.view2d.view_to_region(frame, 0, clip=False)
    start, _ = window.view2d.view_to_region(edit().frame_current, 0, clip=False)
    top = window.height - 10
    yield from driver.drag(window, [(start, top), ((start + x) / 2, top), (x, top)])
    assert abs(edit().frame_current - frame) <= 2, f"scrubbed to {edit().frame_current}"
    edit().frame_set(frame)
    yield


STEPS = {
    "1_movie": movie_added,
    "2_effect": effect_added,
    "3_scribble": scribbled,
    "4_preset": preset_chosen,
    "5_bars": lambda: bars_dragged([(50, 90), (90, 60), (140, 40)]),
    "6_key": keyed,
    "7_later": lambda: bars_dragged([(150, 50), (190, 90)]),
    "8_key_later": keyed,
}


def undone_and_redone():
    """Every step, back to the movie alone and forth again; frame changes are no steps of their own."""
    names = list(STEPS)
    region = preview()
    states = {entry["step"]: entry for entry in driver.noted if "step" in entry}
    for direction, keys, order in (("undo", "ctrl+z", names[-2::-1]), ("redo", "ctrl+shift+z", names[1:])):
        for name in order:
            wanted = states[name]
            for _ in range(4):  # a step may be two for Blender: a stroke, and the tool that drew it
                driver.move(preview(), region.width / 2, region.height / 2)
                yield 0.2
                driver.key(keys)
                yield 0.5
                if facts() == wanted["facts"]:
                    break
            assert facts() == wanted["facts"], f"{direction} to {name}:\n{facts()}\n{wanted['facts']}"
            if edit().frame_current != wanted["frame"]:  # it would take back what is not keyed yet
                edit().frame_set(wanted["frame"])
            yield from seen(f"{name}_{direction}")


def saved_and_loaded():
    path = driver.OUT / "edit.blend"
    before = facts()
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.open_mainfile(filepath=str(path))
    yield 1.5
    assert facts() == before
    all_viewed()
    yield from seen("9_loaded")


def in_agreement(frame=70):
    """Live preview, sequencer's picture and final render of one frame, pixel by pixel at full size."""
    edit().frame_set(frame)
    area = driver.area_of("SEQUENCE_EDITOR", "PREVIEW")
    space = area.spaces.active
    space.show_overlays = space.show_gizmo = space.show_region_ui = False
    with driver.override("PREVIEW"):
        bpy.ops.screen.screen_full_area()
    yield 1.0
    area = driver.area_of("SEQUENCE_EDITOR", "PREVIEW")
    area.spaces.active.show_overlays = area.spaces.active.show_gizmo = False
    with driver.override("PREVIEW"):
        bpy.ops.sequencer.view_all_preview()
        # A pixel of the picture to one of the screen: the operator takes the region for one pixel larger.
        bpy.ops.sequencer.view_zoom_ratio(ratio=(preview().height + 1) / preview().height)
    yield 1.0
    for name, live in (("live", True), ("sequencer", False)):
        bpy.context.window_manager.virtual_shutter.live = live
        region = preview()
        driver.move(region, 5, region.height - 5)
        yield 1.5
        yield from driver.shot_when_shown(name)
        left, top = driver.screen(region, region.width / 2 - WIDTH // 2, region.height / 2 + HEIGHT // 2)
        driver.saw(picture=name, box=[left, top + 1, left + WIDTH, top + HEIGHT + 1])
    # Where the sequencer does not render its preview, the draw handler draws the result itself.
    bpy.context.window_manager.virtual_shutter.live = True
    edit().render.sequencer_gl_preview = "SOLID"
    yield 1.5
    yield from driver.shot_when_shown("drawn")
    driver.saw(picture="drawn", box=[left, top + 1, left + WIDTH, top + HEIGHT + 1])
    edit().render.sequencer_gl_preview = "RENDERED"
    with driver.override("PREVIEW"):
        bpy.ops.screen.back_to_previous()
    yield 1.0
    yield from rendered()  # after the preview has filled the sequencer's cache
    yield from sequencer_animation(frame)


def rendered():
    """The current frame, as with F12: a job on another thread."""
    driver.render("final.png", write_still=True)
    yield from driver.render_ended()
    driver.saw(picture="final")


def sequencer_animation(frame):
    """View ▸ Render Sequencer Animation, of two frames, over a preview that needs less than them."""
    edit().frame_start, edit().frame_end = frame, frame + 1
    edit().render.filepath = str(driver.OUT / "animation_")
    for layer in effect().scene.annotation.layers:  # Blender draws them into it
        layer.annotation_hide = True
    driver.area_of("SEQUENCE_EDITOR", "PREVIEW").spaces.active.proxy_render_size = "PROXY_25"
    with driver.override("PREVIEW"):
        bpy.ops.render.opengl("INVOKE_DEFAULT", animation=True, sequencer=True)
    yield from driver.render_ended()
    driver.move(preview(), 20, 20)  # the operator's end is at an event
    yield 0.5


def steps():
    yield from bars_and_disable.steps()
    yield from keyboard_story.steps()
    yield from opened(WIDTH, HEIGHT)
    for name, step in STEPS.items():
        if name == "7_later":
            yield from moved_to(LATER)
        yield from step()
        yield from seen(name)
    yield from undone_and_redone()
    yield from saved_and_loaded()
    yield from in_agreement()
