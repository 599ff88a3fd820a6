"""Writes the table of a recipe's fields in docs/command.md, from the fields of the model.

python scripts/recipe_table.py
"""

import re
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from shutter_addon.core.model import effect
from shutter_addon.core.model.fields import MISSING, Field, fields_of
from shutter_addon.core.model.frame_state import Options

PAGE = Path(__file__).resolve().parents[1] / "docs" / "command.md"
HEAD = "| field | of | in Blender | values | default |\n|---|---|---|---|---|\n"
PARTS = {
    "the recipe": (Options, effect.Effect, effect.Camera),
    "a shutter": (effect.Shutter,),
    "a region": (effect.AnyRegion,),
    "a line, a lasso": (effect.Region,),
    "a matte, a ramp, an outline": (effect.MatteRegion,),
    "an outline": (effect.OutlineRegion,),
    "a matte": (effect.FileContent,),
    "a ramp": (effect.RampContent,),
}


def table() -> str:
    """The table as Markdown: each field once, with the first part that has it."""
    rows, known = [], set()
    for part, kinds in PARTS.items():
        if part == "a region":  # its name is not a shutter's
            known.clear()
        for name, field in fields_of(*kinds).items():
            if field.recipe and (name, field.recipe) not in known:
                known.add((name, field.recipe))
                default = "it has to be there" if field.absent is MISSING else _shown(field.absent)
                rows.append(f"| `{field.recipe}` | {part} | *{field.label}* | {_values(field)} | {default} |")
    return HEAD + "\n".join(rows) + "\n"


def _values(field: Field) -> str:
    if field.choices:
        return ", ".join(f"`{word}`" for word in field.words)
    if isinstance(field.default, bool):
        return "`true`, `false`"
    if isinstance(field.default, str):
        return f"a text of {field.most:g} characters at most"
    if isinstance(field.default, tuple):
        return "red, green, blue: 0 to 1"
    number = "a whole number" if isinstance(field.default, int) else "a number"
    keys = ", or keys of it" if field.keyed_in_recipe else ""
    return f"{number}, {field.least:,.10g} to {field.most:,.10g}{keys}"


def _shown(value) -> str:
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    return f"`{list(value)}`" if isinstance(value, tuple) else f"`{value}`" if value != "" else "empty"


def written(page: str) -> str:
    """A page with the table in its place."""
    return re.sub(re.escape(HEAD) + r"(\|.*\n)*", lambda _match: table(), page)


if __name__ == "__main__":
    PAGE.write_text(written(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
