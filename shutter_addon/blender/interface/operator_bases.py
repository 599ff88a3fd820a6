"""What operators of an effect, a shutter or a region have in common."""

from typing import Any

from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import EnumProperty

from ...core import told
from ...core.recipes import recipe
from ..data import selection, strips
from ..editing import collection_edits
from ..rendering.effect_source import FAULTS

Mixin: Any = object  # for what is mixed into Blender's classes: mypy takes it to have what these have
UNDOABLE = {"REGISTER", "UNDO"}


def refused(cls, sentence: str) -> bool:
    """For poll(): greys the operator out, and says why."""
    cls.poll_message_set(sentence)
    return False


def redraw(context) -> None:
    """Sequencer and properties show the effect's data, of whose changes Blender does not know."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in {"SEQUENCE_EDITOR", "PROPERTIES", "DOPESHEET_EDITOR", "GRAPH_EDITOR"}:
                area.tag_redraw()


def report_error(operator, sentence: str) -> None:
    """Reports a sentence that is already translated; Copy Report has it, without what it names."""
    told.record(sentence)
    operator.report({"ERROR"}, sentence)


def report_warning(operator, sentence: str) -> None:
    """As report_error, of what has been done in part or otherwise."""
    told.record(sentence)
    operator.report({"WARNING"}, sentence)


class OfEffect(Mixin):
    """Works on the effect that is seen, or where none is, on that of the active strip; reports what `change` raises of
    FAULTS."""

    bl_options = UNDOABLE
    only_seen = False  # it does something in the picture

    @classmethod
    def poll(cls, context):
        active = selection.active(context)
        if active is None:
            return refused(cls, rpt_("Select a Shutter strip or its source strip"))
        if not active[0].is_editable:
            return refused(cls, rpt_("The edit is linked from another file"))
        if cls.only_seen and selection.in_picture(context) is None:
            return refused(cls, selection.why_unseen(active[0], active[2]))
        return cls.possible(active[1])

    @classmethod
    def possible(cls, effect):
        return True

    def execute(self, context):
        try:
            result = self.change(context, selection.active(context)[1])
        except FAULTS as error:
            report_error(self, str(error))
            result = {"CANCELLED"}
        redraw(context)
        return result or {"FINISHED"}


class OfShutter(OfEffect):
    """Works on the active shutter."""

    @classmethod
    def possible(cls, effect):
        return selection.active_shutter(effect) is not None or refused(cls, rpt_("The effect has no shutter: add one"))


class OfRegion(OfEffect):
    """Works on the active region."""

    @classmethod
    def possible(cls, effect):
        return selection.active_region(effect) is not None or refused(cls, rpt_("The shutter has no region: draw one"))


class OfStrokes(OfRegion):
    """Works on the active region, which is one of strokes."""

    @classmethod
    def possible(cls, effect):
        if not super().possible(effect):
            return False
        has_strokes = selection.active_region(effect).kind not in strips.MATTES
        return has_strokes or refused(cls, rpt_("The region is a matte or a ramp, and has no strokes"))


def has_room(cls, effect, collection: str, more: int = 1) -> bool:
    """For poll(): whether the effect can have so many more of its "shutters" or "regions"."""
    sentence = collection_edits.why_full(effect, collection, more)
    return sentence is None or refused(cls, sentence)


class Move:
    direction: EnumProperty(name="Direction", items=(("UP", "Up", ""), ("DOWN", "Down", "")), options={"SKIP_SAVE"})

    def target(self, places: list[int], index: int) -> int:
        """The place after or before `index` in the list, among the places that it shows."""
        step = places.index(index) + (1 if self.direction == "DOWN" else -1)
        return places[min(max(step, 0), len(places) - 1)]


def chosen_file(operator) -> str:
    """The path that an operator got. RecipeError: it got none."""
    if not operator.filepath:
        raise recipe.RecipeError(rpt_("Choose a file"))
    return operator.filepath
