"""From an empty Video Editing file to a rendered Sharp Subject, by mouse and keyboard, in eight actions: one stroke
finds the subject. Then it becomes an outline and a scribble."""

import os
from pathlib import Path

import bpy
import driver
import first_stroke_story as first
import story
from driver import part
from one_stroke_story import region
from story import sidebar

# Of the footage's frame 6, in fractions of the picture: down the bunny.
FRAME, STROKE = 6, ((0.37, 0.78), (0.372, 0.65), (0.378, 0.5), (0.385, 0.38))
SHARP = 0.2, 219  # the button: a share of the sidebar's width, pixels below its upper edge


def folder_shown():
    """The file browser opens where it was last."""
    area = driver.area_of("FILE_BROWSER")
    area.spaces.active.params.directory = os.fsencode(Path(story.FOOTAGE).parent)
    yield 2.0


def is_carrying():
    return part("features.outlines.blender.outline_carrying").progress() is not None


def curves():
    with driver.override("PREVIEW"):
        scene, effect, strip = part("blender.data.selection").active(bpy.context)
        operators = part("features.outlines.blender.outline_operators")
        return operators.shown_curves(scene, effect, strip, effect.active_region)


def stroke_drawn():
    yield from story.seen("1_sharp")
    yield from driver.drag(story.preview(), first.on_preview(*STROKE))
    first.acted("the stroke is drawn")
    yield from driver.until(lambda: region().kind == "SUBJECT", "the stroke finds a subject", 60, wait=0.05)
    yield from driver.until(lambda: curves(), "its outline is shown", 60, wait=0.05)
    yield from story.seen("2_found")


def made_sharp():
    story.effect().inbetween = "1"  # layers of moments take a software renderer minutes
    bar = sidebar()
    driver.shot("3_tab")
    driver.click(bar, bar.width * SHARP[0], bar.height - SHARP[1])
    first.acted("click on Sharp Subject", in_tab=True)
    yield from driver.until(lambda: region().is_layer, "it is a layer")
    yield 1.0
    yield from driver.until(lambda: not is_carrying(), "its mattes are there", 120)
    yield from story.seen("4_result")


def turned():
    """By the operators of the buttons, and undone."""
    for name, kind in (("subject_outline", "OUTLINE"), ("subject_scribble", "LINE")):
        story.effect().edge_aware = 0.0  # edges take a software renderer long
        with driver.override("PREVIEW"):
            getattr(bpy.ops.shutter, name)("INVOKE_DEFAULT", True)
        yield from driver.until(lambda kind=kind: region().kind == kind, f"it is of the kind {kind}")
        yield from story.seen(f"5_{kind.lower()}")
        driver.key("ctrl+z")
        yield from driver.until(lambda: region().kind == "SUBJECT", "it is a subject again")
        yield 1.0


def steps():
    yield from first.edit_opened(320, 180)
    yield from folder_shown()
    yield from first.movie_dragged()
    yield from first.gone_to(FRAME)
    yield from first.drawing_begun(finds_subject=True)
    yield from stroke_drawn()
    yield from made_sharp()
    yield from first.picture_rendered()
    driver.saw(actions=first._actions)  # private: the story counts them as the other one does
    yield from turned()
