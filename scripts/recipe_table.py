"""Write the tables of properties from the fields of the model: in docs/command.md those of a recipe, in docs/manual.md
those of Blender's panels.

python scripts/recipe_table.py
"""

import re
import sys
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from shutter_addon.core.model import effect
from shutter_addon.core.model.fields import MISSING, Field, fields_of
from shutter_addon.core.model.frame_state import Options

DOCS = Path(__file__).resolve().parents[1] / "docs"
COMMAND, MANUAL = DOCS / "command.md", DOCS / "manual.md"
RECIPE_HEAD = "| Field | Of | In Blender | Values | Default |\n|---|---|---|---|---|\n"
PANEL_HEAD = "| Property | Of | Values | Keys |\n|---|---|---|---|\n"
PARTS = {
    "the effect": (Options, effect.Effect, effect.Camera),
    "a shutter": (effect.Shutter,),
    "a region": (effect.AnyRegion,),
    "a line, a lasso": (effect.Region,),
    "a matte, a ramp, an outline, a subject": (effect.MatteRegion,),
    "an outline": (effect.OutlineRegion,),
    "a matte": (effect.FileContent,),
    "a ramp": (effect.RampContent,),
}


def own_fields() -> Iterator[tuple[str, Field]]:
    """Give each field once, with the first part that has it."""
    known: set[tuple[str, str]] = set()
    for part, kinds in PARTS.items():
        if part == "a region":  # its name is not a shutter's
            known.clear()
        for name, field in fields_of(*kinds).items():
            if (name, field.recipe) not in known:
                known.add((name, field.recipe))
                yield part, field


def recipe_table() -> str:
    """Make the table of a recipe's fields as Markdown."""
    rows = []
    for part, field in own_fields():
        if field.recipe:
            default = "required" if field.absent is MISSING else _shown(field.absent)
            rows.append(f"| `{field.recipe}` | {part} | *{field.label}* | {_values(field)} | {default} |")
    return RECIPE_HEAD + "\n".join(rows) + "\n"


def panel_table() -> str:
    """Make the table of what Blender's panels show as Markdown."""
    rows = []
    for part, field in own_fields():
        if field.label not in ("Name", "Color"):  # they explain themselves
            keys = " •" if field.keyed else ""
            rows.append(f"| *{field.label}* | {part} | {_choices(field)} |{keys} |")
    return PANEL_HEAD + "\n".join(rows) + "\n"


def _choices(field: Field) -> str:
    """What one can set in Blender."""
    if field.choices:
        return "; ".join(label for _word, label, _description in field.choices)
    if isinstance(field.default, bool):
        return "on, off"
    return f"{field.least:,.10g} to {field.most:,.10g}"


def _values(field: Field) -> str:
    if field.choices:
        return ", ".join(f"`{word}`" for word in field.words.values())
    if isinstance(field.default, bool):
        return "`true`, `false`"
    if isinstance(field.default, str):
        return f"text, at most {field.most:g} characters"
    if isinstance(field.default, tuple):
        return "red, green, blue: 0 to 1"
    number = "a whole number" if isinstance(field.default, int) else "a number"
    keys = ", or keys of it" if field.keyed_in_recipe else ""
    return f"{number}, {field.least:,.10g} to {field.most:,.10g}{keys}"


def _shown(value) -> str:
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    return f"`{list(value)}`" if isinstance(value, tuple) else f"`{value}`" if value != "" else "empty"


def written(page: str, head: str, table: str) -> str:
    """Put a table into a page, in place of the one with the same head."""
    return re.sub(re.escape(head) + r"(\|.*\n)*", lambda _match: table, page)


def pages() -> Iterator[tuple[Path, str]]:
    """Give each page with a table, and its text as it should be."""
    for page, head, table in ((COMMAND, RECIPE_HEAD, recipe_table()), (MANUAL, PANEL_HEAD, panel_table())):
        yield page, written(page.read_text(encoding="utf-8"), head, table)


if __name__ == "__main__":
    for path, text in pages():
        path.write_text(text, encoding="utf-8")
