"""Recipes as files: JSON text that is read into an effect, checked, and written."""

from __future__ import annotations

import json
import re
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

from .. import atomic_write
from ..model import effect as model
from ..model import limits
from ..model.fields import fields_of
from ..model.frame_state import Options
from . import recipe_check, recipe_types, records
from .recipe import RecipeError
from .recipe_types import shown

# Longer numbers are read as floats, which need no time for it; a whole number that counts anything is far shorter.
_MAX_DIGITS = 300


def load(path: str | Path) -> model.Effect:
    """Read the recipe in a JSON file. RecipeError: it cannot be read, or breaks the format."""
    try:
        return parse(_read(Path(path)))
    except OSError as error:
        raise RecipeError(f"{path}: {error.strerror or error}") from None
    except UnicodeDecodeError:
        raise RecipeError(f"{path}: not a text file in UTF-8") from None
    except ValueError as error:  # RecipeError, or a name that no file can have
        raise RecipeError(f"{path}: {error}") from None


def _read(path: Path) -> str:
    """The text of a file, a little more at most than a recipe may have. RecipeError, OSError, ValueError: there is
    none."""
    if path.exists() and not (path.is_file() or path.is_dir()):
        # opening a pipe would wait for ever, and a device has no end
        raise RecipeError("a pipe or a device, not a file")
    with path.open("rb") as file:
        data = file.read(limits.MAX_BYTES + 1)
    _check_size(data)
    return data.decode("utf-8")


def _check_size(text: str | bytes) -> None:
    if len(text) > limits.MAX_BYTES:
        raise RecipeError(f"more than {limits.MAX_BYTES // 1_000_000} MB, which no recipe has")


def parse(text: str) -> model.Effect:
    """Read the recipe in a JSON text. RecipeError: one sentence that names the place, as `shutters[1].bars: …`."""
    _check_size(text)
    try:
        data = json.loads(text.removeprefix("\ufeff"), object_pairs_hook=recipe_types.Object, parse_int=_whole)
    except json.JSONDecodeError as error:
        raise RecipeError(f"line {error.lineno}, column {error.colno}: not JSON ({error.msg})") from None
    except RecursionError:
        raise RecipeError("recipe: lists or objects within one another, too many") from None
    if isinstance(data, dict) and type(version := data.get("version")) is int and version > records.VERSION:
        newer = f"version: {shown(version)} is of a newer version of Virtual Shutter, this one reads {records.VERSION}"
        raise RecipeError(newer)
    try:
        recipe = recipe_types.reader(records.RecipeRecord)(data)
    except recipe_types.FaultError as fault:
        raise RecipeError(f"{fault.place.lstrip('.') or 'recipe'}: {fault}") from None
    recipe_check.check(recipe)
    return records.effect_of(recipe)


def dump(effect: model.Effect) -> str:
    """Write a recipe as JSON text, which `parse` reads. Fields that carry nothing are left out."""
    text = json.dumps(_said(records.recipe_of(effect)), indent=1, ensure_ascii=False)
    # People read and edit these files: a list of numbers stays on one line. Texts are found as well, to be passed over.
    return re.sub(r'"(?:[^"\\]|\\.)*"|\[[-+.\de,\s]+\]', _on_one_line, text) + "\n"


def _on_one_line(match: re.Match) -> str:
    text = match[0]
    return text if text[0] == '"' else " ".join(text.split()).replace("[ ", "[").replace(" ]", "]")


def save(effect: model.Effect, path: str | Path) -> None:
    """Write a recipe whole or not at all. OSError: it cannot be written."""
    with atomic_write.writing(Path(path)) as part:
        part.write_text(dump(effect), encoding="utf-8")


# What few recipes need is said where it says something.
_UNTOLD = {
    each.recipe: each.absent
    for each in fields_of(
        Options, model.Effect, model.Camera, model.Shutter, model.Region, model.OutlineRegion
    ).values()
    if each.recipe and not each.told
} | {"length": "bars", "keys": [], "time": [], "camera": []}


def _said(value: Any) -> Any:
    """Records as JSON has them."""
    if is_dataclass(value):
        columns = {each.name: getattr(value, each.name) for each in fields(value)}
        told = {k: v for k, v in columns.items() if v is not None and (k not in _UNTOLD or v != _UNTOLD[k])}
        return {k: _said(v) for k, v in told.items()}
    return [_said(each) for each in value] if isinstance(value, list | tuple) else value


def _whole(digits: str) -> int | float:
    return int(digits) if len(digits) <= _MAX_DIGITS else float(digits)
