"""Properties of an effect: label, range, choices and name in a recipe.

The classes of the model (effect.py, frame_state.py) declare each property once, as a dataclass field:

    trail: Channel = Labelled("Distance", "How far …").number(default=0.1, most=MAX_DISTANCE)

Blender's property groups, recipes, the snapshot, import, export, validation, panels and the documentation's tables are
derived from these. Bars, strokes and mattes have no Field; the code next to their subject handles them.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from functools import cache, cached_property
from typing import Any

from .keyframes import Constant

Choice = tuple[str, str, str]  # identifier, label, description


@dataclasses.dataclass(frozen=True)
class Field:
    """The declaration of a property of an effect, a shutter, a region or the camera.

    Blender's properties, recipes, panels and documentation are derived from it.

    Attributes:
        label, description: The name and the tooltip that users see.
        default: The value in the model and in a new effect in Blender.
        absent: The value if a recipe lacks the field. MISSING: a recipe without the field is invalid.
        least, most: The range of a number. For a text, `most` is the largest number of characters.
        soft_most: The upper end of the slider in Blender; larger values, up to `most`, can be typed. None: `most`.
        choices: The allowed values of a choice; empty for other properties. The model and recipes write their
            identifiers in small letters, or as numbers (see `words`).
        keyed: Whether it can be animated in Blender, by F-curves.
        is_channel: Whether the model holds a keyframes.Channel instead of a plain value.
        keyed_in_recipe: Whether a recipe can have a list of keys in place of the value.
        blender: The name of the property in Blender.
        recipe: The name of the field in recipes. "": the generic code leaves it out, and other code may write it.
        shown: Whether the generic code of the shutter's panel shows it.
        always_written: Whether recipes are written with the field even if its value equals `absent`.
        subtype, precision: As for Blender's property: how the value is shown, and its number of decimals.
        context: The translation context of the label.
    """

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
    always_written: bool = True
    shown: bool = False
    subtype: str = "NONE"
    precision: int = 2
    context: str = "*"

    @cached_property
    def words(self) -> dict[str, int | str]:
        """The model's values of `choices` by identifier: "over" for "OVER", the number 2 for "2"."""
        return {name: int(name) if name.isdigit() else name.lower() for name, *_ in self.choices}


MISSING = dataclasses.MISSING


@dataclasses.dataclass(frozen=True)
class Labelled:
    """The label and the description of a property. Each method declares that property as a field of a dataclass.

    The methods return a dataclasses.field. Its metadata has the attributes of Field, from which `fields_of` makes one.
    """

    label: str
    description: str

    def number(self, *, default: float, **more: Any) -> Any:
        """Declare a number that keys can change. The model holds a channel, by default a Constant of `default`.

        Args:
            default: Field.default, and Field.absent unless `more` has that.
            more: Other attributes of Field.
        """
        more = {"keyed": True, "is_channel": True, "keyed_in_recipe": True} | more
        return self.fixed(default=default, made=lambda: Constant(default), **more)

    def switch(self, *, default: bool = False, **more: Any) -> Any:
        """Declare a boolean without keys. `more`: other attributes of Field."""
        return self.fixed(default=default, **more)

    def choice(self, choices: Sequence[Choice], *, default: str | int, **more: Any) -> Any:
        """Declare a choice of one word, without keys. `more`: other attributes of Field."""
        return self.fixed(default=default, choices=choices, **more)

    def fixed(self, *, default: Any, made: Callable[[], Any] | None = None, **more: Any) -> Any:
        """Declare a whole number, a text or a color, which keys cannot change unless `more` says so.

        Args:
            default: Field.default, and Field.absent unless `more` has that.
            made: A function that makes the value of a new object of the model, if that differs from `default`. None:
                the value is `default`.
            more: Other attributes of Field.
        """
        said = {"label": self.label, "description": self.description, "default": default, "absent": default} | more
        return dataclasses.field(default_factory=made or (lambda: default), metadata=said)


@cache
def fields_of(*kinds: type) -> dict[str, Field]:
    """Return the properties that dataclasses of the model declare, by attribute name."""
    said = {each.name: each.metadata for kind in kinds for each in dataclasses.fields(kind) if each.metadata}
    names: dict[str, dict[str, Any]] = {name: {"blender": name, "recipe": name} for name in said}
    return {name: Field(**names[name] | said[name]) for name in said}
