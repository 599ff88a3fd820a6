"""What operators of an effect, a shutter or a region have in common."""

from collections.abc import Callable, Iterable

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import Context, Event, Operator, PropertyGroup

from ...core import told
from ...core.messages import UserError
from ...core.recipes import recipe
from ..data import selection
from ..rendering.effect_source import FAULTS

Mixin: Operator = object  # for what is mixed into Blender's classes: mypy takes it to have what these have
UNDOABLE = {"REGISTER", "UNDO"}
Need = Callable[[PropertyGroup], str | None]  # why an effect does not do, in the user's language; None: it does
Change = Callable[[Operator, Context, PropertyGroup], set[str] | None]  # changes an effect; None: it has been done


def redraw(context: Context) -> None:
    """Sequencer and properties show the effect's data, of whose changes Blender does not know."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in {"SEQUENCE_EDITOR", "PROPERTIES", "DOPESHEET_EDITOR", "GRAPH_EDITOR"}:
                area.tag_redraw()


def report_error(operator: Operator, sentence: str) -> None:
    """Reports a sentence that is already translated; Copy Report has it, without what it names."""
    told.record(sentence, level=2)
    operator.report({"ERROR"}, sentence)


def report_warning(operator: Operator, sentence: str) -> None:
    """As report_error, of what has been done in part or otherwise."""
    told.record(sentence, level=2)
    operator.report({"WARNING"}, sentence)


def popup(context: Context, words: str, **looks: str) -> None:
    """Says a sentence that is already translated beside the pointer."""
    show = context.window_manager.popup_menu
    show(lambda menu, _context: menu.layout.label(text=words, translate=False), **looks)


def kept(items: Callable[[Context], Iterable[tuple]]) -> Callable[[object, Context], list[tuple]]:
    """What gives the items of an EnumProperty: Blender needs the list kept that it got last."""
    last: list[tuple] = []

    def given(_self: object, context: Context) -> list[tuple]:
        last[:] = items(context)
        return last

    return given


class Named(Mixin):
    """An operator that is named as its class is."""

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        cls.bl_idname = "shutter." + cls.__name__.removeprefix("SHUTTER_OT_")

    @classmethod
    def poll(cls, context: Context) -> bool:
        """Greys the operator out where there is a reason, and says it."""
        if sentence := cls.refusal(context):
            cls.poll_message_set(sentence)
        return not sentence

    @classmethod
    def refusal(cls, context: Context) -> str | None:
        """Why the operator cannot be used, in the user's language; None: it can."""
        return None

    def tried(self, step: Callable[..., set[str] | None], *arguments: object) -> set[str]:
        """What a step of the operator returns, that it is finished where that is nothing; an error is reported."""
        try:
            return step(*arguments) or {"FINISHED"}
        except (*FAULTS, UserError) as error:
            report_error(self, str(error))
            return {"CANCELLED"}


class OfEffect(Named):
    """Works on the effect that is seen, or where none is, on that of the active strip.

    needs: each may say why an effect that can be changed does not do; the first reason counts
    edit, effect_strip: the scene and the strip of the effect, while it is changed"""

    bl_options = UNDOABLE
    only_seen = False  # it does something in the picture
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
    label: str, *needs: Need, options: set[str] = UNDOABLE, only_seen: bool = False, **properties: object
) -> Callable[[Change], type[Operator]]:
    """Makes an operator of a function that changes an effect, with its name and docstring; the rest as OfEffect has
    it."""

    def made(change: Change) -> type[Operator]:
        content = {
            "__doc__": change.__doc__,
            "__module__": change.__module__,
            "__annotations__": properties,
            "bl_label": label,
            "bl_options": options,
            "only_seen": only_seen,
            "needs": needs,
            "change": change,
        }
        return type(f"SHUTTER_OT_{change.__name__}", (OfEffect, Operator), content)

    return made


class Beside(Named):
    """Goes on beside Blender, step by step; or at once, in the background and for scripts.

    Each has `begin(context, waits)`, which does all of it, or goes on, and has to do all if it `waits`;
    `goes_on(context)`, which does a step, and says whether there are more; and `end(context, is_stopped)`, called once
    all steps are done, or once Esc has stopped them. What `begin` and `end` give is for `tried`.

    tick: seconds from step to step; blocks: whether Blender waits meanwhile"""

    tick = 0.1
    blocks = False

    def leave(self, context: Context) -> None:
        """Lets go of what steps need."""
        if self._timer in _timers:
            _timers.remove(self._timer)
            context.window_manager.event_timer_remove(self._timer)
            show_status(None)

    def invoke(self, context: Context, _event: Event) -> set[str]:
        return self.tried(self.begin, context, bpy.app.background)

    def execute(self, context: Context) -> set[str]:
        return self.tried(self.begin, context, True)

    def go_on(self, context: Context) -> set[str]:
        self._timer = context.window_manager.event_timer_add(self.tick, window=context.window)
        _timers.append(self._timer)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: Context, event: Event) -> set[str]:
        is_stopped = event.type == "ESC" and event.value == "PRESS"
        is_over = is_stopped or self._timer not in _timers
        try:
            is_over = is_over or (event.type == "TIMER" and not self.goes_on(context))
        except Exception:  # Blender ends the operator then, and asks for no `cancel`
            self.leave(context)
            raise
        if not is_over:
            return {"RUNNING_MODAL"} if self.blocks else {"PASS_THROUGH"}
        self.leave(context)
        return self.tried(self.end, context, is_stopped)

    def cancel(self, context: Context) -> None:
        """Its window was closed."""
        self.leave(context)


_timers: list = []  # of what goes on


def show_status(words: str | None) -> None:
    """Says it in the status bar, of whichever workspace; None: what Blender says."""
    for workspace in bpy.data.workspaces:
        workspace.status_text_set(words)


def end_all() -> None:
    """Ends what goes on, before another file is loaded."""
    while _timers:  # Blender crashes where a text is taken from the status bar while it quits
        bpy.context.window_manager.event_timer_remove(_timers.pop())
        show_status(None)


def chosen_file(operator: Operator) -> str:
    """The path that an operator got. RecipeError: it got none."""
    if not operator.filepath:
        raise recipe.RecipeError(rpt_("Choose a file"))
    return operator.filepath
