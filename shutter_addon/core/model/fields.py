"""What a property of an effect is: its label, range, choices and name in a recipe.

The classes of the model (effect.py, frame_state.py) define each property once, as a dataclass field that is made here:

    trail: Channel = number("Distance", "How far …", default=0.1, most=MAX_DISTANCE)

Blender's property groups, recipes, the snapshot, import, export, validation, panels and the table of the recipe's
fields come from these. What a field has no Field for, such as bars and strokes, is written next to its subject.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

from .keyframes import Constant

Choice = tuple[str, str, str]  # its word in capitals, label, description


@dataclasses.dataclass(frozen=True)
class Field:
    """A property of an effect, a shutter, a region or the camera.

    default: where Blender begins; absent: what a recipe means that does not say it; MISSING: it has to
    least, most: the range of a number; soft_most: how far a slider goes; of a text, `most` counts its characters
    choices: of a word; the word in the model and in recipes is in small letters
    keyed: whether Blender's F-curves may change it; keyed_in_recipe: whether a recipe's keys may
    is_channel: whether the model has a channel of it (keyframes.Channel), not the value
    blender, recipe: its names there; recipe "": it has none
    shown: whether its panel shows it by itself, below what it draws by hand
    told: whether a recipe says it even where it is as `absent`
    subtype, context: of Blender's property, and of the translation of its label
    since: the version of the extension in which it appeared"""

    label: str
    description: str
    default: Any
    absent: Any
    blender: str
    recipe: str
    least: float = 0.0
    most: float = 1.0
    soft_most: float | None = None
    choices: Sequence[Choice] = ()
    keyed: bool = False
    is_channel: bool = False
    keyed_in_recipe: bool = False
    told: bool = True
    shown: bool = False
    subtype: str = "NONE"
    precision: int = 2
    context: str = "*"
    since: str = "0.1.0"

    @property
    def words(self) -> tuple[Any, ...]:
        """Its choices as the model has them: texts, and whole numbers."""
        return tuple(self.word(word) for word, *_ in self.choices)

    @staticmethod
    def word(choice: str) -> int | str:
        """A choice as the model has it."""
        return int(choice) if choice.isdigit() else choice.lower()


MISSING = dataclasses.MISSING


def number(label: str, description: str, *, default: float, **more: Any) -> Any:
    """Make a number that keys may change; the model has a channel of it."""
    more = {"keyed": True, "is_channel": True, "keyed_in_recipe": True} | more
    return fixed(label, description, default=default, made=lambda: Constant(default), **more)


def switch(label: str, description: str, *, default: bool = False, **more: Any) -> Any:
    """Make a property that is on or off, without keys."""
    return fixed(label, description, default=default, **more)


def choice(label: str, description: str, choices: Sequence[Choice], *, default: str | int, **more: Any) -> Any:
    """Make a choice of one word among several, without keys."""
    return fixed(label, description, default=default, choices=choices, **more)


def color(label: str, description: str, *, default: tuple[float, float, float], **more: Any) -> Any:
    """Make a color: red, green and blue display values, 0 to 1."""
    return fixed(label, description, default=default, **({"subtype": "COLOR_GAMMA"} | more))


def fixed(label: str, description: str, *, default: Any, made: Callable[[], Any] | None = None, **more: Any) -> Any:
    """Make a whole number or a text, without keys; made: makes the model's value, where that is not the default."""
    said = {"absent": default, "blender": "", "recipe": None} | more
    factory = made or (lambda: default)
    return dataclasses.field(default_factory=factory, metadata={"said": (label, description, default, said)})


def fields_of(*kinds: type) -> dict[str, Field]:
    """Give the Fields of classes, by the name of the model's field."""
    return _fields_of(kinds)


@cache
def _fields_of(kinds: tuple[type, ...]) -> dict[str, Field]:
    found: dict[str, Field] = {}
    for kind in kinds:
        for each in dataclasses.fields(kind):
            if "said" in each.metadata:
                label, description, default, said = each.metadata["said"]
                names = {
                    "blender": said["blender"] or each.name,
                    "recipe": each.name if said["recipe"] is None else said["recipe"],
                }
                found[each.name] = Field(label, description, default, **(said | names))
    return found
