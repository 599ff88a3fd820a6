"""The source's own frame in the previews, sharp, while somebody draws on it: Blender's own, of the source's channel.

From *Draw* on until a stroke is finished, and again for as long as the pen is down: what our handler draws would hide
the stroke. It is a setting of the previews, which files keep: before one is saved, the result is given back.
"""

from dataclasses import dataclass

import bpy
from bpy.types import Context, SpaceSequenceEditor

from ..data import preview_areas, selection, strips
from ..devices import main_thread
from ..rendering.previews import pen_is_down
from . import subject_operators

_TOOLS = "builtin.annotate"  # how the tools' names begin


@dataclass
class _Pen:
    """channel: that the previews show, 0: they show the result; is_down: when a preview was drawn last
    tool: that Draw or Erase has taken the place of, which comes back with the stroke; "": they have not"""

    channel: int = 0
    tool: str = ""
    is_down: bool = False


_pen = _Pen()  # Blender draws with it, and tells of no stroke


def take_up(context: Context, tool: str) -> bool:
    """Makes a pen the tool of the previews, until a stroke is finished; whether there is a preview."""
    before = context.workspace.tools.from_space_sequencer("PREVIEW", create=False)
    if before is None or not before.idname.startswith(_TOOLS):
        _pen.tool = before.idname if before else "builtin.select_box"
    return _choose(context, tool)


def _choose(context: Context, tool: str) -> bool:
    areas = list(preview_areas.previews(context))
    for window, area in areas:
        with preview_areas.within(window, area):
            bpy.ops.wm.tool_set_by_id(name=tool, space_type="SEQUENCE_EDITOR")
        area.tag_redraw()  # or handles would come with the pointer alone
    return bool(areas)


def show(context: Context) -> None:
    """Shows the source of the active effect, if that is beside it and not muted, where the pen draws for the effect."""
    active = selection.active(context)
    source = active and strips.nearest_source(*active)
    if source is None or source.mute or source.parent_meta() != active[2].parent_meta():
        return
    give_back(context)
    _pen.channel = source.channel
    for _window, area in preview_areas.previews(context):
        space = area.spaces.active
        if not space.display_channel and space.annotation == active[1].scene.annotation:
            space.display_channel = _pen.channel


def give_back(context: Context) -> None:
    """The previews show the result again."""
    for _window, area in preview_areas.previews(context) if _pen.channel else ():
        if area.spaces.active.display_channel == _pen.channel:
            area.spaces.active.display_channel = 0
    _pen.channel = 0


def forget() -> None:
    """Lets go of the pen, before another file is loaded."""
    give_back(bpy.context)
    _pen.tool = ""


def follow_pen() -> None:
    """For what draws a preview, which may change nothing: what the pen asks for comes right after."""
    was_down, _pen.is_down = _pen.is_down, pen_is_down()
    if _pen.is_down and not _pen.channel:
        main_thread.later(_show)
    elif was_down and not _pen.is_down:
        main_thread.later(_lay_down)


def is_shown(space: SpaceSequenceEditor) -> bool:
    """Whether a preview shows the sharp frame for the pen."""
    return bool(_pen.channel) and space.display_channel == _pen.channel


def _tool_chosen() -> None:
    """Who takes another tool draws no more. A new tool draws no preview again."""
    tool = bpy.context.workspace.tools.from_space_sequencer("PREVIEW", create=False)
    if tool is not None and not tool.idname.startswith(_TOOLS):
        _pen.tool = ""
        give_back(bpy.context)


def _show() -> None:
    if _pen.is_down:
        show(bpy.context)


def _lay_down() -> None:
    if not _pen.is_down:
        give_back(bpy.context)
        if _pen.tool:
            _choose(bpy.context, _pen.tool)
        subject_operators.pen_is_up(bpy.context)


_OWNER = object()  # of what Blender tells of tools


def listen() -> None:
    """Asks Blender to tell of tools; it forgets that with every file that is opened."""
    tools = bpy.types.WorkSpace, "tools"
    bpy.msgbus.clear_by_owner(_OWNER)
    bpy.msgbus.subscribe_rna(key=tools, owner=_OWNER, args=(), notify=_tool_chosen)


register = listen


def unregister() -> None:
    bpy.msgbus.clear_by_owner(_OWNER)
    give_back(bpy.context)
