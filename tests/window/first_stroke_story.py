"""From an empty Video Editing file to the first tracked, rendered frame, by mouse and keyboard, actions counted."""

from pathlib import Path

import bpy
import driver
import one_stroke_story
import story
from driver import part
from one_stroke_story import STROKE

FRAME, LATER = 10, 22  # of the footage, which begins with frame 61 of the original
TOOL = "builtin.select_box"
ICON, NEXT = (46, 92), 91  # a file's in the browser, in pixels from the left and from above; and to the next one
ENTRY = 89  # that of the strip's menu, which reaches down to the end of the window, in pixels above that
_actions = []  # what was done, and whether in the tab


def acted(what, in_tab=False):
    _actions.append((what, in_tab))


def timeline():
    return driver.region_of(driver.area_of("SEQUENCE_EDITOR", "SEQUENCER"))


def effect_strip():
    return part("blender.data.strips").effect_strips(driver.edit())[0]


def on_preview(*points):
    annotations = part("blender.data.annotations")
    size = annotations.picture_size(story.effect())
    matrix = annotations.picture_to_region(effect_strip(), size, story.preview())
    return part("core.model.scribbles").mapped(matrix, points).tolist()


def channel():
    """That the preview shows; 0: the result."""
    return driver.area_of("SEQUENCE_EDITOR", "PREVIEW").spaces.active.display_channel


def tool():
    return bpy.context.workspace.tools.from_space_sequencer("PREVIEW", create=False).idname


def footage_chosen():
    area = driver.area_of("FILE_BROWSER")
    bar = driver.region_of(area, "UI")
    driver.click(bar, bar.width * 0.8, bar.height - 28)
    acted("click on the path")
    yield 1.0
    driver.text(Path(story.FOOTAGE).parent)
    acted("the folder is typed")
    yield 1.0
    driver.key("Return")
    acted("Return")
    wanted = Path(story.FOOTAGE).parent
    yield from driver.until(lambda: Path(area.spaces.active.params.directory.decode()) == wanted, "it is the folder")
    yield 2.0


def movie_dragged(number=0, frame=1, channel=1):
    """number: which of the browser's; to a frame and a channel of the timeline."""
    files, (x, y) = driver.region_of(driver.area_of("FILE_BROWSER")), (ICON[0] + number * NEXT, ICON[1])
    to_x, to_y = timeline().view2d.view_to_region(frame, channel + 0.5, clip=False)
    count = len(driver.edit().sequence_editor.strips_all)
    start, end = driver.screen(files, x, files.height - y), driver.screen(timeline(), to_x + 2, to_y)
    driver.move(files, x - 1, files.height - y + 2)  # the browser marks what the pointer comes to
    yield 0.5
    driver.xdotool("click", 1)
    acted("click on the movie")
    yield 1.0
    driver.xdotool("mousemove", *start)
    yield 0.5
    driver.xdotool("mousedown", 1)
    yield 0.5
    for share in (*(step / 100 for step in range(1, 11)), 0.3, 0.5, 0.7, 0.9, 1):
        driver.xdotool("mousemove", *(round(a + share * (b - a)) for a, b in zip(start, end, strict=True)))
        yield 0.1
    yield 0.5
    driver.shot("0_dragged")
    driver.xdotool("mouseup", 1)
    acted("the movie is dragged into the timeline")
    yield from driver.until(lambda: len(driver.edit().sequence_editor.strips_all) > count, "there is a strip")
    yield 1.0


def gone_to(frame):
    """In the ruler; frame: of the movie, 1 is its first."""
    movie = next(strip for strip in driver.edit().sequence_editor.strips_all if strip.type == "MOVIE")
    x, _y = timeline().view2d.view_to_region(movie.content_start + frame - 1, 0, clip=False)
    driver.click(timeline(), x, timeline().height - 12)
    acted("click in the ruler")
    yield 1.0
    apart = driver.edit().frame_current - (movie.content_start + frame - 1)
    assert abs(apart) <= 1, apart
    driver.edit().frame_set(int(movie.content_start) + frame - 1)  # a pixel is less than a frame
    yield 0.5


def drawing_begun(finds_subject=False):
    """finds_subject: whether the stroke may become a subject; else it stays a scribble, which is tracked"""
    movie = driver.edit().sequence_editor.strips_all[0]
    x, y = timeline().view2d.view_to_region(driver.edit().frame_current + 5, movie.channel + 0.5, clip=False)
    driver.move(timeline(), x, y)
    yield
    driver.xdotool("click", 3)
    acted("right click on the strip")
    yield 1.0
    driver.shot("0_menu")
    across, _down = driver.screen(timeline(), x, y)
    driver.xdotool("mousemove", across + 20, driver.windows()[0].height - ENTRY)
    yield 0.5
    driver.xdotool("click", 1)
    acted("click on Draw Shutter")
    yield from driver.until(lambda: driver.edit().virtual_shutter.effects, "the strip has an effect")
    sidebar = one_stroke_story.sidebar()
    yield from driver.until(lambda: sidebar.active_panel_category == "Shutter", "the Shutter tab opens")
    assert len(story.effect().regions) == 1
    assert channel() == 1
    story.effect().regions[0].finds_subject = finds_subject
    story.effect().aggregate = "4"  # edges take a software renderer long


def stroke_drawn():
    yield from story.seen("1_sharp")
    yield from driver.drag(story.preview(), on_preview(*STROKE))
    acted("the stroke is drawn")
    yield from driver.until(lambda: channel() == 0, "the stroke gives the result back")
    assert story.effect().edge_aware == 1
    yield from driver.until(lambda: tool() == TOOL, "the tool of before is back")
    yield 1.0
    driver.shot("2_handles")  # the pointer has not moved
    yield from story.seen("2_result")


def pressed_again():
    """Of a second stroke, by Blender's own key for the pen, over a handle: none of those that are counted, and taken
    back."""
    with driver.override("PREVIEW"):
        point = part("blender.interface.region_gizmo").place(bpy.context).centre
    driver.move(story.preview(), *point)
    yield
    driver.xdotool("keydown", "d", "mousedown", 1, "keyup", "d")
    yield from driver.until(lambda: channel() == 1, "the pen shows the sharp frame again")
    yield from driver.shot_when_shown("3_pressed")
    driver.saw(step="3_pressed", crop=story.crop())
    driver.xdotool("mouseup", 1)
    yield from driver.until(lambda: channel() == 0, "and gives it back")
    assert tool() == TOOL
    driver.key("ctrl+z")
    yield 1.0


def boxed():
    """Where others walk: left, top, right, bottom in the preview's region."""
    (left, low), (right, high) = on_preview((0.6, 0.45), (0.8, 0.65))
    height = story.preview().height
    driver.saw(box=[round(left), round(height - high), round(right), round(height - low)])


def plain_seen():
    effect_strip().mute = True
    yield from story.seen("5_plain")
    effect_strip().mute = False
    yield 1.0


def picture_rendered():
    """By F12, into final.png."""
    done = []
    # The preview's pictures of the effect are renders of its own scene.
    bpy.app.handlers.render_complete.append(lambda scene, *_: scene.name == "Edit" and done.append(True))
    driver.move(story.preview(), 100, story.preview().height - 60)
    yield
    driver.key("F12")
    acted("F12")
    yield from driver.until(lambda: done and not driver.rendering(), "the render ends", 60)
    bpy.data.images["Render Result"].save_render(str(driver.OUT / "final.png"), scene=driver.edit())


def rendered():
    yield from picture_rendered()
    driver.saw(actions=_actions, stroke=one_stroke_story.stroke_at(driver.edit().frame_current))


def edit_opened(width, height):
    """An empty edit of the footage's size, whose renders can be compared with that."""
    yield from driver.video_editing_opened()
    driver.edit().render.resolution_x, driver.edit().render.resolution_y = width, height


def steps():
    yield from edit_opened(384, 288)
    yield from footage_chosen()
    yield from movie_dragged()
    yield from gone_to(FRAME)
    yield from drawing_begun()
    yield from stroke_drawn()
    boxed()
    yield from pressed_again()
    yield from one_stroke_story.tracked()
    acted("click on Track", in_tab=True)
    yield from one_stroke_story.ended()
    yield from story.seen("4_tracked")
    yield from plain_seen()
    yield from gone_to(LATER)
    yield from rendered()
