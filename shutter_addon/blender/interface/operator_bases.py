"""Base classes and helpers of operators: why they are greyed out, errors, and operators that run for some time."""

from collections.abc import Callable, Iterable
from typing import Any

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import EnumProperty
from bpy.types import Context, Event, Operator, PropertyGroup

from ...core import recent_errors
from ...core.messages import UserError
from ...core.recipes import recipe
from ..data import selection
from ..rendering.effect_source import FAULTS

Mixin: Operator = object  # for mix-ins of Blender's classes: mypy then knows their attributes
UNDOABLE = {"REGISTER", "UNDO"}
Need = Callable[[PropertyGroup], str | None]  # why an effect does not fit, in the user's language; None: it fits
Change = Callable[[Operator, Context, PropertyGroup], set[str] | None]  # changes an effect; None: finished


def redraw(context: Context) -> None:
    """Redraw the editors that show effects or their keys, because Blender does not know that their data changed."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in {"SEQUENCE_EDITOR", "DOPESHEET_EDITOR", "GRAPH_EDITOR"}:
                area.tag_redraw()


def report(operator: Operator, sentence: str, kind: str = "WARNING") -> set[str]:
    """Show a translated sentence as an operator's warning or error.

    *Copy Report* gets the line of code that called this instead of the sentence, which may contain the user's names.

    Args:
        kind: "WARNING" or "ERROR".

    Returns:
        {"CANCELLED"}, the result of an operator that has changed nothing.
    """
    recent_errors.record(level=2)
    operator.report({kind}, sentence)
    return {"CANCELLED"}


def given(kind: Callable, name: str, description: str, **more: Any) -> Any:
    """Make a property of an operator that gets its value from each button, and otherwise has its default.

    Blender does not use the value of the last call again (SKIP_SAVE).

    Args:
        kind: A function of bpy.props, such as StringProperty.
        more: Further arguments of that function.
    """
    return kind(name=name, description=description, options={"SKIP_SAVE"}, **more)


def kept(items: Callable[[Context], Iterable[tuple]]) -> Callable[[object, Context], list[tuple]]:
    """Turn a function of the context into a function for the `items` of an EnumProperty.

    The new function keeps its last list in memory, because Blender reads the strings in it later.
    """
    last: list[tuple] = []

    def given(_self: object, context: Context) -> list[tuple]:
        last[:] = items(context)
        return last

    return given


class Named(Mixin):
    """An operator that gets its bl_idname from its class name: SHUTTER_OT_draw becomes shutter.draw.

    Attributes:
        icon: Shown beside it in menus (panel_parts.draw_operators).
        choices: Name of its enum property whose items menus show as a submenu; "": none.
    """

    icon = "NONE"
    choices = ""

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        cls.bl_idname = "shutter." + cls.__name__.removeprefix("SHUTTER_OT_")

    @classmethod
    def poll(cls, context: Context) -> bool:
        """Tell Blender whether the operator can be used; if not, its tooltip gives the reason from `refusal`."""
        if sentence := cls.refusal(context):
            cls.poll_message_set(sentence)
        return not sentence

    @classmethod
    def refusal(cls, context: Context) -> str | None:
        """Return why the operator cannot be used, in the user's language; None: it can be."""
        return None

    def tried(self, step: Callable[..., set[str] | None], *arguments: object) -> set[str]:
        """Call a step of the operator, and show expected errors (FAULTS, UserError). Others are raised.

        Args:
            step: The function to call.
            arguments: Its arguments.

        Returns:
            The step's result, {"FINISHED"} if that is None, or {"CANCELLED"} after an error that was shown.
        """
        try:
            return step(*arguments) or {"FINISHED"}
        except (*FAULTS, UserError) as error:
            return report(self, str(error), "ERROR")


class OfEffect(Named):
    """An operator that changes the active effect: usually that of the active strip (selection.active).

    Subclasses have `change(context, effect)`, which does the work and returns the operator's result; None: finished.

    Attributes:
        needs: Conditions: functions that take the effect and return why it does not fit, or None. The operator is
            greyed out if one returns a reason, and its tooltip shows the first.
        only_seen: Whether the effect also has to be visible in the preview.
        edit: Scene that has the effect, set before `change` is called.
        effect_strip: The effect strip, set before `change` is called.
    """

    bl_options = UNDOABLE
    only_seen = False
    needs: tuple[Need, ...] = ()

    @classmethod
    def refusal(cls, context: Context) -> str | None:
        if (active := selection.active(context)) is None:
            return rpt_("Select a Shutter strip or its source strip")
        scene, effect, strip = active
        if not scene.is_editable:
            return rpt_("The edit is linked from another file")
        if cls.only_seen and selection.in_picture(context) is None:
            return selection.why_unseen(scene, strip)
        return next(filter(None, (need(effect) for need in cls.needs)), None)

    def execute(self, context: Context) -> set[str]:
        self.edit, effect, self.effect_strip = selection.active(context)
        result = self.tried(self.change, context, effect)
        redraw(context)
        return result


def operator(
    label: str, *needs: Need, icon: str = "NONE", options: set[str] = UNDOABLE, only_seen: bool = False, **own: Any
) -> Callable[[Change], type[Operator]]:
    """Return a decorator that makes an operator class (OfEffect) from a function that changes an effect.

    The function takes the operator, the context and the effect. It returns the operator's result; None: finished. Its
    name becomes the operator's bl_idname, after "shutter.", and its docstring the tooltip.

    Args:
        label: The operator's name for users.
        needs: Conditions that the effect has to meet, as in OfEffect.
        icon: Icon in menus.
        options: bl_options.
        only_seen: Whether the effect has to be visible in the preview.
        own: The operator's properties by name. Menus show the items of the first EnumProperty as a submenu.
    """

    def made(change: Change) -> type[Operator]:
        content = {
            "__doc__": change.__doc__,
            "__module__": change.__module__,
            "__annotations__": own,
            "bl_label": label,
            "icon": icon,
            "choices": next((name for name, made in own.items() if made.function is EnumProperty), ""),
            "bl_options": options,
            "only_seen": only_seen,
            "needs": needs,
            "change": change,
        }
        return type(f"SHUTTER_OT_{change.__name__}", (OfEffect, Operator), content)

    return made


class Beside(Named):
    """An operator that works in steps while Blender stays usable, but all at once in the background and in scripts.

    Subclasses have these methods; `tried` shows errors of `begin` and `end`:

    - `begin(context, waits)` does all the work if `waits`. Otherwise it prepares the work and returns
      `go_on(context)`, unless nothing is left to do.
    - `goes_on(context)` does a step, and returns whether there are more.
    - `end(context, is_stopped)` is called after the last step or, with `is_stopped`, after the user has pressed Esc.

    Attributes:
        tick: Seconds between steps.
        blocks: Whether Blender ignores other input between the steps.
        timers: Timers of all running operators of all subclasses.
    """

    tick = 0.1
    blocks = False
    timers: list = []  # of all running operators

    def leave(self, context: Context) -> None:
        """Stop the operator's timer, and remove its text from the status bar."""
        if self._timer in self.timers:
            self.timers.remove(self._timer)
            context.window_manager.event_timer_remove(self._timer)
            show_status(None)

    def invoke(self, context: Context, _event: Event) -> set[str]:
        return self.tried(self.begin, context, bpy.app.background)

    def execute(self, context: Context) -> set[str]:
        return self.tried(self.begin, context, True)

    def go_on(self, context: Context) -> set[str]:
        self._timer = context.window_manager.event_timer_add(self.tick, window=context.window)
        self.timers.append(self._timer)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: Context, event: Event) -> set[str]:
        is_stopped = event.type == "ESC" and event.value == "PRESS"
        is_over = is_stopped or self._timer not in self.timers
        try:
            is_over = is_over or (event.type == "TIMER" and not self.goes_on(context))
        except Exception:  # Blender then ends the operator without calling `cancel`
            self.leave(context)
            raise
        if not is_over:
            return {"RUNNING_MODAL"} if self.blocks else {"PASS_THROUGH"}
        self.leave(context)
        return self.tried(self.end, context, is_stopped)

    def cancel(self, context: Context) -> None:
        """Stop the operator. Blender calls this when it ends the operator, such as when its window is closed."""
        self.leave(context)


def show_status(words: str | None) -> None:
    """Show a text in the status bar of all windows; None: what Blender shows there."""
    for workspace in bpy.data.workspaces:
        workspace.status_text_set(words)


def end_all() -> None:
    """End all running operators that work in steps (Beside), before another file is loaded."""
    while Beside.timers:  # Blender crashes if the status text changes while it quits
        bpy.context.window_manager.event_timer_remove(Beside.timers.pop())
        show_status(None)


def chosen_file(operator: Operator) -> str:
    """Return the path of the file that the user chose for an operator.

    Raises:
        RecipeError: No file was chosen.
    """
    if not operator.filepath:
        raise recipe.RecipeError(rpt_("Choose a file"))
    return operator.filepath
