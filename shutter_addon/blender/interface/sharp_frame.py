"""While the user draws, show the source frame in the previews, by setting them to the channel of the source strip.

It appears with *Draw* until the stroke is finished, and whenever the pen is down, because our draw handler would cover
the stroke. The display channel is saved in files, so it is reset before saving. After the first stroke of a new effect,
a subject is looked for under it.
"""

import bpy
from bpy.types import Context, SpaceSequenceEditor

from ... import features
from ..data import consistency, preview_areas, selection, strips
from ..devices import main_thread
from ..rendering.previews import looking, pen_is_down

_TOOLS = "builtin.annotate"  # prefix of the tools' names


def take_up(context: Context, tool: str) -> bool:
    """Activate an annotation tool in all previews, until a stroke is finished: then the tool active before returns.

    Args:
        tool: Blender's identifier of the tool.

    Returns:
        Whether any preview is open.
    """
    before = context.workspace.tools.from_space_sequencer("PREVIEW", create=False)
    if before is None or not before.idname.startswith(_TOOLS):
        looking.pen.tool = before.idname if before else "builtin.select_box"
    return _choose(context, tool)


def _choose(context: Context, tool: str) -> bool:
    areas = list(preview_areas.previews(context))
    for window, area in areas:
        with preview_areas.within(window, area):
            bpy.ops.wm.tool_set_by_id(name=tool, space_type="SEQUENCE_EDITOR")
        area.tag_redraw()  # otherwise gizmos would appear only when the pointer moves
    return bool(areas)


def show(context: Context) -> None:
    """Show the active effect's source strip in previews, so that the user can draw on a sharp frame.

    This sets *Display Channel* to the channel of the source strip in previews that show all channels and have the
    effect's annotation. Do nothing without an active effect, or if its source is missing, muted, or in another
    meta strip.
    """
    active = selection.active(context)
    source = active and strips.nearest_source(*active)
    if source is None or source.mute or source.parent_meta() != active[2].parent_meta():
        return
    give_back(context)
    looking.pen.channel = source.channel
    for _window, area in preview_areas.previews(context):
        space = area.spaces.active
        if not space.display_channel and space.annotation == active[1].scene.annotation:
            space.display_channel = looking.pen.channel


def give_back(context: Context) -> None:
    """Show the effect's result in the previews again, in place of the source frame."""
    for _window, area in preview_areas.previews(context) if looking.pen.channel else ():
        if area.spaces.active.display_channel == looking.pen.channel:
            area.spaces.active.display_channel = 0
    looking.pen.channel = 0


def forget() -> None:
    """Show the result and forget the tool that was active before, when another file is loaded."""
    give_back(bpy.context)
    looking.pen.tool = ""


def follow_pen() -> None:
    """Show the source strip once the pen is down, and the result once it is up again. Called when a preview is drawn.

    Drawing code must not change data, so a timer makes the change. After the stroke, the timer also restores the tool
    that *Draw* or *Erase* replaced.
    """
    was_down, looking.pen.is_down = looking.pen.is_down, pen_is_down()
    if looking.pen.is_down and not looking.pen.channel:
        main_thread.later(_show)
    elif was_down and not looking.pen.is_down:
        main_thread.later(_lay_down)


def is_shown(space: SpaceSequenceEditor) -> bool:
    """Tell whether a preview shows the source frame for drawing."""
    return bool(looking.pen.channel) and space.display_channel == looking.pen.channel


def _tool_chosen() -> None:
    """Show the result instead of the source strip, if a tool is now active that neither draws nor erases.

    Then no tool is restored after a stroke. Blender calls this when the active tool changes (`listen`).
    """
    tool = bpy.context.workspace.tools.from_space_sequencer("PREVIEW", create=False)
    if tool is not None and not tool.idname.startswith(_TOOLS):
        looking.pen.tool = ""
        give_back(bpy.context)


def _show() -> None:
    if looking.pen.is_down:
        show(bpy.context)


def _lay_down() -> None:
    if not looking.pen.is_down:
        give_back(bpy.context)
        if looking.pen.tool:
            _choose(bpy.context, looking.pen.tool)
        if (seen := selection.in_picture(bpy.context)) and selection.active_region(seen[1]):
            consistency.aim_pen(seen[1])
            features.call("after_stroke", bpy.context, *seen)


_OWNER = object()  # of the message bus subscription


def listen() -> None:
    """Subscribe to changes of the active tool. Call this after each file is loaded, which ends the subscription."""
    tools = bpy.types.WorkSpace, "tools"
    bpy.msgbus.clear_by_owner(_OWNER)
    bpy.msgbus.subscribe_rna(key=tools, owner=_OWNER, args=(), notify=_tool_chosen)


register = listen


def unregister() -> None:
    bpy.msgbus.clear_by_owner(_OWNER)
    give_back(bpy.context)
