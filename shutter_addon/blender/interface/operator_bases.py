"""What operators of an effect, a shutter or a region have in common."""

from collections.abc import Callable, Iterable

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import EnumProperty
from bpy.types import Context, Event, Operator, PropertyGroup

from ...core import told
from ...core.messages import UserError
from ...core.recipes import recipe
from ..data import selection, strips
from ..editing import collection_edits
from ..rendering.effect_source import FAULTS

Mixin: Operator = object  # for what is mixed into Blender's classes: mypy takes it to have what these have
UNDOABLE = {"REGISTER", "UNDO"}


def redraw(context: Context) -> None:
    """Sequencer and properties show the effect's data, of whose changes Blender does not know."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in {"SEQUENCE_EDITOR", "PROPERTIES", "DOPESHEET_EDITOR", "GRAPH_EDITOR"}:
                area.tag_redraw()


def soon(timer: Callable[[], float | None], seconds: float = 0.0) -> None:
    """Has Blender call a timer, unless it is going to."""
    if not bpy.app.timers.is_registered(timer):
        bpy.app.timers.register(timer, first_interval=seconds)


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


def is_escape(event: Event) -> bool:
    return event.type == "ESC" and event.value == "PRESS"


def own_classes(module: dict[str, object]) -> tuple:
    """The classes of a module that Blender gets, in their order; module: its globals."""
    own = [each for name, each in module.items() if name.startswith("SHUTTER_")]
    return tuple(each for each in own if getattr(each, "__module__", "") == module["__name__"])


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

    edit, effect_strip: the scene and the strip of the effect, while it is changed"""

    bl_options = UNDOABLE
    only_seen = False  # it does something in the picture

    @classmethod
    def refusal(cls, context: Context) -> str | None:
        if (active := selection.active(context)) is None:
            return rpt_("Select a Shutter strip or its source strip")
        scene, effect, strip = active
        if not scene.is_editable:
            return rpt_("The edit is linked from another file")
        if cls.only_seen and selection.in_picture(context) is None:
            return selection.why_unseen(scene, strip)
        return cls.why_not(effect)

    @classmethod
    def why_not(cls, effect: PropertyGroup) -> str | None:
        """As `refusal`, of an effect that can be changed."""
        return None

    def execute(self, context: Context) -> set[str]:
        self.edit, effect, self.effect_strip = selection.active(context)
        result = self.tried(self.change, context, effect)
        redraw(context)
        return result


class OfShutter(OfEffect):
    """Works on the active shutter."""

    @classmethod
    def why_not(cls, effect: PropertyGroup) -> str | None:
        return None if selection.active_shutter(effect) is not None else rpt_("The effect has no shutter: add one")


class OfRegion(OfEffect):
    """Works on the active region."""

    @classmethod
    def why_not(cls, effect: PropertyGroup) -> str | None:
        return None if selection.active_region(effect) is not None else rpt_("The shutter has no region: draw one")


class OfStrokes(OfRegion):
    """Works on the active region, which is one of strokes."""

    @classmethod
    def why_not(cls, effect: PropertyGroup) -> str | None:
        if sentence := super().why_not(effect):
            return sentence
        if selection.active_region(effect).kind in strips.MATTES:
            return rpt_("The region is a matte or a ramp, and has no strokes")
        return None


class Adds(OfShutter):
    """Adds to what the active shutter has. more: how many "shutters" and "regions" it takes room for."""

    more: dict[str, int] = {"regions": 1}

    @classmethod
    def why_not(cls, effect: PropertyGroup) -> str | None:
        return super().why_not(effect) or collection_edits.why_full(effect, **cls.more)


class Beside(Named):
    """Goes on beside Blender, which calls its `modal` at least with every tick of a timer."""

    def go_on(self, context: Context, seconds: float) -> set[str]:
        """seconds: from tick to tick"""
        self._timer = context.window_manager.event_timer_add(seconds, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def cancel(self, context: Context) -> None:
        """It has ended, or its window was closed."""
        context.window_manager.event_timer_remove(self._timer)
        context.workspace.status_text_set(None)


class Move:
    direction: EnumProperty(name="Direction", items=(("UP", "Up", ""), ("DOWN", "Down", "")), options={"SKIP_SAVE"})

    def target(self, places: list[int], index: int) -> int:
        """The place after or before `index` in the list, among the places that it shows."""
        step = places.index(index) + (1 if self.direction == "DOWN" else -1)
        return places[min(max(step, 0), len(places) - 1)]


def chosen_file(operator: Operator) -> str:
    """The path that an operator got. RecipeError: it got none."""
    if not operator.filepath:
        raise recipe.RecipeError(rpt_("Choose a file"))
    return operator.filepath
