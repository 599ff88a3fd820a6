"""Checks of a recipe beyond its types: ranges, references, and the order of keys."""

from __future__ import annotations

import json
from itertools import pairwise
from typing import Any

from ..model import effect as model
from ..model import limits, shutters
from ..model.fields import Field, fields_of
from ..model.frame_state import Options
from .recipe import CAMERA, RecipeError
from .records import MatteRecord, MoveKey, OutlineRecord, RampRecord, RegionRecord, Stroke, drawings_of

_COMBINED = "lightest", "darkest"


def shown(value: Any) -> str:
    """Return a value as JSON, cut to 40 characters without formatting the rest."""
    text = ""
    for part in json.JSONEncoder(ensure_ascii=False).iterencode(value):
        text += part
        if len(text) > 40:
            break
    return cut(text)


def cut(text: str) -> str:
    return text if len(text) <= 40 else text[:37] + "…"


def _plain(number: float) -> str:
    return shown(number) if isinstance(number, int) else f"{number:.10g}"


def _require(condition: object, place: str, message: str) -> None:
    if not condition:
        raise RecipeError(f"{place}: {message}")


def _require_within(value: float, most: float, place: str, least: float | None = None) -> None:
    """Check least ≤ value ≤ most; `least` is −most by default."""
    least = -most if least is None else least
    _require(least <= value <= most, place, f"{_plain(value)} is not {_plain(least)} to {_plain(most)}")


def check(recipe: Any) -> None:
    """Check the record of a recipe.

    Raises:
        RecipeError: It does not describe a valid effect.
    """
    for kind in (Options, model.Effect, model.Camera):
        _check_fields(kind, recipe, "")
    _require(recipe.version > 1 or recipe.inbetween != "auto", "inbetween", 'recipes have "auto" from version 2 on')
    _require(recipe.shutters, "shutters", "empty: the first shutter is the default")
    _check_count(recipe.shutters, limits.MAX_SHUTTERS, "shutters")
    _check_count(recipe.regions, limits.MAX_REGIONS, "regions")
    _check_keys(recipe.time, "time")
    for k, key in enumerate(recipe.time):
        _require_within(key.value, limits.MAX_FRAME, f"time[{k}].value")
    _check_moves(recipe.camera, "camera")
    places: dict[str, int] = {}
    for i, shutter in enumerate(recipe.shutters):
        place = f"shutters[{i}]"
        _check_fields(model.Shutter, shutter, f"{place}.")
        taken = places.setdefault(shutter.name, i)
        _require(taken == i, f"{place}.name", f"{shown(shutter.name)} is taken by shutters[{taken}]")
        _check_bars(shutter, recipe.window, place)
        _check_follow(shutter.follow, recipe.regions, f"{place}.follow")
        _check_exposure(shutter, place)
    for i, region in enumerate(recipe.regions):
        there_is_none = f"there is no shutter {shown(region.shutter)}"
        _require(region.shutter in places, f"regions[{i}].shutter", there_is_none)
        _check_region(region, f"regions[{i}]")
    drawn = [drawings_of(region) for region in recipe.regions if isinstance(region, RegionRecord | OutlineRecord)]
    # Each region counts with its largest drawing.
    points = sum(max(sum(map(len, strokes)) for _, strokes in drawings) for drawings in drawn)
    _require(points <= limits.MAX_POINTS, "regions", f"{points} points at once, the most are {limits.MAX_POINTS}")


def _check_fields(kind: type, record: Any, place: str) -> None:
    """Check the fields of a class against their ranges."""
    for each in fields_of(kind).values():
        if each.recipe:
            _check_field(each, getattr(record, each.recipe), f"{place}{each.recipe}")


def _check_field(each: Field, value: Any, place: str) -> None:
    """Check a value, or the keys of a number."""
    if each.choices or isinstance(value, bool):
        return
    if isinstance(value, str):
        _check_name(value, place, round(each.most))
    elif isinstance(value, tuple):
        _require(all(0 <= c <= 1 for c in value), place, "not three numbers from 0 to 1")
    elif not isinstance(value, list):
        _require_within(value, each.most, place, each.least)
    else:
        _require(value, place, "empty: there is no key")
        _check_keys(value, place)
        for k, key in enumerate(value):
            _require_within(key.value, each.most, f"{place}[{k}].value", each.least)


def _check_bars(shutter: Any, window: int, place: str) -> None:
    _require((shutter.bars is None) != (not shutter.keys), place, "either bars or keys, one of the two")
    _check_keys(shutter.keys, f"{place}.keys")
    said = {f"{place}.keys[{k}].bars": key.bars for k, key in enumerate(shutter.keys)}
    for where, bars in (said or {f"{place}.bars": shutter.bars}).items():
        _require(len(bars) == window, where, f"{len(bars)} values, window is {window}")
        try:
            shutters.check_bars(bars)
        except shutters.ShutterError as error:
            raise RecipeError(f"{where}: {error}") from None


def _check_exposure(shutter: Any, place: str) -> None:
    """Check settings of a shutter that depend on each other."""
    ranges = fields_of(model.Shutter)
    if shutter.trail is not None:
        _require(shutter.follow, f"{place}.trail", "the shutter follows nothing that moves")
        _require(shutter.length == "bars", f"{place}.trail", "a shutter has one length")
        _check_field(ranges["trail"], shutter.trail, f"{place}.trail")
    chooses = shutter.combine in _COMBINED
    if shutter.threshold is not None:
        _require(chooses, f"{place}.threshold", "only lightest and darkest have a threshold")
        _check_field(ranges["threshold"], shutter.threshold, f"{place}.threshold")
    is_soft = isinstance(shutter.softness, list) or shutter.softness != 0
    _require(shutter.threshold is not None or not is_soft, f"{place}.softness", "it has no threshold")
    ways = chooses or not shutter.by_luminance
    _require(ways, f"{place}.by_luminance", "only lightest and darkest use it")


def _check_follow(follow: str | None, regions: list, place: str) -> None:
    """Check that a shutter follows one region, or the camera."""
    if follow is None:
        return
    called = [f"regions[{i}]" for i, region in enumerate(regions) if region.name == follow]
    if follow == CAMERA:
        _require(not called, place, f"{shown(follow)} is the camera, and {', '.join(called[:1])} as well")
        return
    _require(follow, place, "empty: it names a region, or is " + shown(CAMERA))
    _require(called, place, f"there is no region {shown(follow)}")
    _require(len(called) == 1, place, f"{shown(follow)} is the name of {' and '.join(called[:2])}")


def _check_region(region: Any, place: str) -> None:
    _check_fields(region.model, region, f"{place}.")
    _check_moves(region.keys, f"{place}.keys")
    if isinstance(region, MatteRecord):
        _check_fields(model.FileContent, region, f"{place}.")
        for name, most in (("path", limits.MAX_PATH), ("channel", limits.MAX_CHANNEL)):
            _require(getattr(region, name), f"{place}.{name}", "empty")
            _check_name(getattr(region, name), f"{place}.{name}", most)
    elif not isinstance(region, RampRecord):
        _check_drawings(region, place)


def _check_drawings(region: Any, place: str) -> None:
    _require(drawings_of(region)[0][1], f"{place}.strokes", "empty: nothing is drawn")
    redrawn = any(key.strokes is not None for key in region.keys)
    for k, key in enumerate(region.keys):
        where = f"{place}.keys[{k}]"
        whole = not (redrawn if k == 0 else key.strokes is not None) or key.frame == int(key.frame)
        _require(whole, f"{where}.frame", f"{_plain(key.frame)} is not a whole frame, but has strokes")
        if key.strokes is not None:
            _check_strokes(key.strokes, f"{where}.strokes")
    _check_strokes(region.strokes, f"{place}.strokes")


def _check_moves(keys: list[MoveKey], place: str) -> None:
    _check_keys(keys, place)
    for k, key in enumerate(keys):
        for axis, value in enumerate(key.location):
            _require_within(value, limits.MAX_DISTANCE, f"{place}[{k}].location[{axis}]")
        _require_within(key.rotation, limits.MAX_DEGREES, f"{place}[{k}].rotation")
        _require_within(key.scale, limits.MAX_SCALE, f"{place}[{k}].scale")


def _check_strokes(strokes: list[Stroke], place: str) -> None:
    for j, stroke in enumerate(strokes):
        _require(stroke, f"{place}[{j}]", "empty: a stroke has at least one point")
        for n, point in enumerate(stroke):
            for axis, value in enumerate(point):
                if not -limits.MAX_DISTANCE <= value <= limits.MAX_DISTANCE:
                    _require_within(value, limits.MAX_DISTANCE, f"{place}[{j}][{n}][{axis}]")


def _check_count(items: list, most: int, place: str) -> None:
    _require(len(items) <= most, place, f"{len(items)}, the most are {most}")


def _check_name(name: str, place: str, most: int = limits.MAX_NAME) -> None:
    _require(len(name) <= most, place, f"{len(name)} characters, the most are {most}")
    wrong = next((c for c in name if c == "\0" or "\ud800" <= c <= "\udfff"), "")
    _require(not wrong, place, f"U+{ord(wrong or ' '):04X} is not allowed in a name")


def _check_keys(keys: list, place: str) -> None:
    _check_count(keys, limits.MAX_KEYS, place)
    for k, key in enumerate(keys):
        _require_within(key.frame, limits.MAX_FRAME, f"{place}[{k}].frame")
    for k, (first, second) in enumerate(pairwise(keys)):
        follows = f"{_plain(second.frame)} does not follow {_plain(first.frame)}"
        _require(first.frame < second.frame, f"{place}[{k + 1}].frame", follows)
