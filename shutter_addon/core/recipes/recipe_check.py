"""Checks of a recipe beyond its types and ranges: references, and fields that depend on each other."""

from __future__ import annotations

import json
from typing import Any

from ..model import limits, shutters
from ..model.frame_state import EXTREMES
from .recipe import CAMERA, RecipeError
from .records import drawn_in


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


def plain(number: float) -> str:
    return shown(number) if isinstance(number, int) else f"{number:.10g}"


def _require(condition: object, place: str, message: str) -> None:
    if not condition:
        raise RecipeError(f"{place}: {message}")


def check(recipe: Any) -> None:
    """Check the record of a recipe.

    Raises:
        RecipeError: It does not describe a valid effect.
    """
    _require(recipe.version > 1 or recipe.inbetween != "auto", "inbetween", 'recipes have "auto" from version 2 on')
    places: dict[str, int] = {}
    for i, shutter in enumerate(recipe.shutters):
        place = f"shutters[{i}]"
        taken = places.setdefault(shutter.name, i)
        _require(taken == i, f"{place}.name", f"{shown(shutter.name)} is taken by shutters[{taken}]")
        _check_bars(shutter, recipe.window, place)
        _check_follow(shutter.follow, recipe.regions, f"{place}.follow")
        _check_exposure(shutter, place)
    points = 0
    for i, region in enumerate(recipe.regions):
        _require(region.shutter in places, f"regions[{i}].shutter", f"there is no shutter {shown(region.shutter)}")
        points += _check_drawn(region, f"regions[{i}]")
    _require(points <= limits.MAX_POINTS, "regions", f"{points} points at once, the most are {limits.MAX_POINTS}")


def _check_bars(shutter: Any, window: int, place: str) -> None:
    _require((shutter.bars is None) != (not shutter.keys), place, "either bars or keys, one of the two")
    said = {f"{place}.keys[{k}].bars": key.bars for k, key in enumerate(shutter.keys)}
    for where, bars in (said or {f"{place}.bars": shutter.bars}).items():
        _require(len(bars) == window, where, f"{len(bars)} values, window is {window}")
        try:
            shutters.check_bars(bars)
        except shutters.ShutterError as error:
            raise RecipeError(f"{where}: {error}") from None


def _check_exposure(shutter: Any, place: str) -> None:
    """Check settings of a shutter that depend on each other."""
    if shutter.trail is not None:
        _require(shutter.follow, f"{place}.trail", "the shutter follows nothing that moves")
        _require(shutter.length == "bars", f"{place}.trail", "a shutter has one length")
    chooses = shutter.combine in EXTREMES
    has_threshold = shutter.threshold is not None
    _require(chooses or not has_threshold, f"{place}.threshold", "only lightest and darkest have a threshold")
    is_soft = isinstance(shutter.softness, list) or shutter.softness != 0
    _require(has_threshold or not is_soft, f"{place}.softness", "it has no threshold")
    _require(chooses or not shutter.by_luminance, f"{place}.by_luminance", "only lightest and darkest use it")


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


def _check_drawn(region: Any, place: str) -> int:
    """Check a region's drawings, and return the points of the largest."""
    drawn = drawn_in(region)
    if not drawn:
        return 0
    shapes = [strokes for name in ("drawings", "outlines") for _, strokes, _ in drawn.get(name, ())]
    _require(any(shapes) if len(drawn) > 1 else shapes and shapes[0], f"{place}.strokes", "empty: nothing is drawn")
    every = [each for drawings in drawn.values() for each in drawings]
    if len(drawn) > 1 or any(key.strokes is not None for key in region.keys):
        for frame, *_ in every:
            _require(frame == int(frame), place, f"{plain(frame)} is not a whole frame, but has strokes")
    return max(sum(map(len, strokes)) for _, strokes, _ in every)
