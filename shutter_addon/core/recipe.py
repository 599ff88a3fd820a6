"""Recipes: the whole effect but the footage, as a JSON file, version 1.

Frames are timeline frames, 1 = the strip's first. Points are fractions of the picture, y up.
"""

from __future__ import annotations

import json
import math
import re
from dataclasses import dataclass, field, is_dataclass, replace
from functools import cache, partial
from itertools import pairwise
from pathlib import Path
from typing import Literal, get_args, get_origin

import numpy as np

from . import keyframes, scribbles, shutters, whole
from .instant import Edges, Exposure, Instant, Interpolation, Light, Options, Position

Point = tuple[float, float]
Stroke = list[Point]
Ease = Literal["linear", "bezier", "constant"]
Factor = Literal[1, 2, 4, 8, 16]


class RecipeError(ValueError):
    """A recipe that breaks the format; the message is one sentence that names the place."""


@dataclass(frozen=True)
class ShutterKey:
    frame: float
    bars: list[float]
    ease: Ease = "linear"


@dataclass(frozen=True)
class Shutter:
    """Bars, or keys of bars."""

    name: str
    color: tuple[float, float, float] = (0.8, 0.8, 0.8)
    bars: list[float] | None = None
    keys: list[ShutterKey] = field(default_factory=list)

    def at(self, frame: float, interpolation: Interpolation = "displacement") -> np.ndarray:
        """Bars (L,) at a frame; between keys by `interpolation`."""
        if not self.keys:
            return np.asarray(self.bars, dtype=np.float64)
        a, b, u = keyframes.span([key.frame for key in self.keys], frame)
        u = keyframes.eased(u, self.keys[a].ease)
        return keyframes.between_bars(self.keys[a].bars, self.keys[b].bars, u, interpolation)


@dataclass(frozen=True)
class RegionKey:
    """Location in fractions of the picture, rotation in degrees counter-clockwise, perhaps a redrawn shape."""

    frame: float
    location: Point = (0.0, 0.0)
    rotation: float = 0.0
    scale: float = 1.0
    strokes: list[Stroke] | None = None
    ease: Ease = "linear"


@dataclass(frozen=True)
class Region:
    """A scribble of a shutter. Redrawn shapes follow one another between the keys that carry strokes; a first key
    without any carries the region's own."""

    shutter: str
    name: str = ""
    kind: Literal["line", "lasso"] = "line"
    width: float = 0.02
    strokes: list[Stroke] = field(default_factory=list)
    keys: list[RegionKey] = field(default_factory=list)

    def drawings(self) -> list[tuple[RegionKey | None, list[Stroke]]]:
        """The key that starts each drawing, and its strokes, in time."""
        drawn = [(key, key.strokes) for key in self.keys if key.strokes is not None]
        if not drawn or self.keys[0].strokes is None:
            drawn.insert(0, (self.keys[0] if self.keys else None, self.strokes))
        return drawn

    def at(self, frame: float, aspect: float) -> tuple[np.ndarray, ...]:
        """Moved strokes (n, 2) at a frame, for a picture of width / height = aspect."""
        if not self.keys:
            return scribbles.transform(self.strokes, (0, 0), 0, 1, aspect)
        drawn = self.drawings()
        a, b, u = keyframes.span([key.frame for key, _ in drawn], frame)
        u = keyframes.eased(u, drawn[a][0].ease)
        strokes = scribbles.between_strokes(drawn[a][1], drawn[b][1], u, aspect)
        a, b, u = keyframes.span([key.frame for key in self.keys], frame)
        first, second, u = self.keys[a], self.keys[b], keyframes.eased(u, self.keys[a].ease)
        location, rotation, scale = (
            (1 - u) * np.asarray(getattr(first, name)) + u * np.asarray(getattr(second, name))
            for name in ("location", "rotation", "scale")
        )
        return scribbles.transform(strokes, location, rotation, scale, aspect)


@dataclass(frozen=True)
class TimeKey:
    """Which source frame is shown at a frame; 1 is the source's first."""

    frame: float
    value: float
    ease: Ease = "linear"


@dataclass(frozen=True)
class Recipe:
    version: Literal[1]
    window: int
    shutters: list[Shutter]
    regions: list[Region] = field(default_factory=list)
    position: Position = "start"
    interpolation: Interpolation = "displacement"
    light: Light = "linear"
    exposure: Exposure = "normalized"
    edges: Edges = "hold"
    aggregate: Literal[1, 2, 4] = 1
    border: bool = False
    stop_at_cuts: bool = True
    inbetween: Factor = 1
    inbetween_method: Literal["quick", "good"] = "quick"
    time: list[TimeKey] = field(default_factory=list)

    @property
    def options(self) -> Options:
        names = Options.__dataclass_fields__.keys() - {"step"}
        return Options(**{name: getattr(self, name) for name in names}, step=self.inbetween)

    def at(self, frame: float, aspect: float) -> Instant:
        """The effect at a timeline frame (1 = the strip's first), for a picture of width / height = aspect."""
        order = [shutter.name for shutter in self.shutters]
        return Instant(
            self.options,
            np.stack([shutter.at(frame, self.interpolation) for shutter in self.shutters]),
            tuple(
                scribbles.Shape(order.index(region.shutter), region.kind, region.width, region.at(frame, aspect))
                for region in self.regions
            ),
        )

    def time_at(self, frame: float) -> float | None:
        """The source frame that is shown at a timeline frame, 1 is the first; None: the strip's timing says that."""
        if not self.time:
            return None
        a, b, u = keyframes.span([key.frame for key in self.time], frame)
        u = keyframes.eased(u, self.time[a].ease)
        return (1 - u) * self.time[a].value + u * self.time[b].value


def with_inbetween(source: Recipe, factor: int) -> Recipe:
    """The same effect over another number of in-between frames: its bars stand for the same times.

    RecipeError: they would be too many."""

    def changed(bars):
        return bars and shutters.multiplied(bars, source.inbetween, factor, source.position).tolist()

    try:
        found = [
            replace(shutter, bars=changed(shutter.bars), keys=[replace(k, bars=changed(k.bars)) for k in shutter.keys])
            for shutter in source.shutters
        ]
    except shutters.ShutterError:
        window = source.window * factor // source.inbetween
        raise RecipeError(
            f"window: {window} bars for {factor}× in-between frames, the most are {shutters.MAX_WINDOW}"
        ) from None
    window = -(-source.window * factor // source.inbetween)
    return replace(source, window=window, shutters=found, inbetween=factor)


def load(path: str | Path) -> Recipe:
    """The recipe in a JSON file. RecipeError: it cannot be read, or breaks the format."""
    try:
        return parse(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise RecipeError(f"{path}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise RecipeError(f"{path}: not a text file") from None
    except RecipeError as error:
        raise RecipeError(f"{path}: {error}") from None


def parse(text: str) -> Recipe:
    """The recipe in a JSON text. RecipeError: one sentence that names the place, as `shutters[1].bars: …`."""
    try:
        data = json.loads(text)
    except (json.JSONDecodeError, RecursionError) as error:
        raise RecipeError(f"not JSON: {error}") from None
    converter = _converter()
    try:
        recipe = converter.structure(data, Recipe)
    except Exception as error:
        raise RecipeError(_first_fault(error)) from None
    _check(recipe)
    return recipe


def dump(recipe: Recipe) -> str:
    """The recipe as JSON text; `parse(dump(r)) == r`. Fields that carry nothing are left out."""
    text = json.dumps(_compact(_converter().unstructure(recipe)), indent=1, ensure_ascii=False)
    # People read and edit these files: a list of numbers stays on one line.
    return (
        re.sub(
            r"\[[-+.\de,\s]+\]",
            lambda numbers: " ".join(numbers[0].split()).replace("[ ", "[").replace(" ]", "]"),
            text,
        )
        + "\n"
    )


def save(recipe: Recipe, path: str | Path) -> None:
    """Writes a recipe whole or not at all. OSError: it cannot be written."""
    with whole.writing(Path(path)) as part:
        part.write_text(dump(recipe), encoding="utf-8")


def _compact(value):
    if isinstance(value, dict):
        return {k: _compact(v) for k, v in value.items() if v is not None and (v or k not in ("keys", "time"))}
    return [_compact(v) for v in value] if isinstance(value, (list, tuple)) else value


# Reading: the converter checks the structure, _check what no type can say.


def _number(value, _kind) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f"{_shown(value)} is not a number")
    if not math.isfinite(value):
        raise ValueError(f"{value} is not a finite number")
    return float(value)


def _exactly(wanted: type, name: str):
    def structure(value, _kind):
        if type(value) is not wanted:
            raise ValueError(f"{_shown(value)} is not {name}")
        return value

    return structure


def _choice(value, kind):
    allowed = get_args(kind)
    if not any(type(value) is type(option) and value == option for option in allowed):
        raise ValueError(f"{_shown(value)} is none of {', '.join(map(str, allowed))}")
    return value


def _tuple(kind, converter):
    inner = get_args(kind)

    def structure(value, _kind):
        if not isinstance(value, list):
            raise ValueError(f"{_shown(value)} is not a list")
        if len(value) != len(inner):
            raise ValueError(f"{len(value)} values, not {len(inner)}")
        return tuple(converter.structure(v, t) for v, t in zip(value, inner, strict=True))

    return structure


def _after_check(factory, wanted: type, name: str):
    """A hook factory whose hooks take JSON's `wanted` only: Python walks through texts and objects as well."""

    def make(kind, converter):
        structure = factory(kind, converter)

        def checked(value, kind):
            if not isinstance(value, wanted):
                raise ValueError(f"{_shown(value)} is not {name}")
            return structure(value, kind)

        return checked

    return make


@cache
def _converter():
    """RecipeError: cattrs is missing. Blender brings it; a Linux distribution's Blender may not, and effects render
    without it."""
    try:
        import cattrs
        from cattrs.cols import list_structure_factory
        from cattrs.gen import make_dict_structure_fn
    except ImportError as error:
        raise RecipeError(
            f"recipes need the Python package cattrs ({error}); install it for Blender's Python"
        ) from None
    converter = cattrs.Converter()
    converter.register_structure_hook(float, _number)
    converter.register_structure_hook(int, _exactly(int, "a whole number"))
    converter.register_structure_hook(str, _exactly(str, "a text"))
    converter.register_structure_hook(bool, _exactly(bool, "true or false"))
    converter.register_structure_hook_func(lambda kind: get_origin(kind) is Literal, _choice)
    converter.register_structure_hook_factory(lambda kind: get_origin(kind) is tuple, _tuple)
    converter.register_structure_hook_factory(
        lambda kind: get_origin(kind) is list, _after_check(list_structure_factory, list, "a list")
    )
    strict = partial(make_dict_structure_fn, _cattrs_forbid_extra_keys=True)
    converter.register_structure_hook_factory(is_dataclass, _after_check(strict, dict, "an object"))
    return converter


def _shown(value) -> str:
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 40 else text[:37] + "…"


def _first_fault(error: Exception) -> str:
    """`place: what is wrong`, of the first fault."""
    import cattrs
    from cattrs.errors import ForbiddenExtraKeysError

    def sentence(error, kind):
        if isinstance(error, KeyError):
            return "missing"
        if isinstance(error, ForbiddenExtraKeysError):
            return f"unknown field {', '.join(sorted(error.extra_fields))}"
        return str(error)

    message, _, place = cattrs.transform_error(error, "$", sentence)[0].rpartition(" @ $")
    return f"{place.lstrip('.') or 'recipe'}: {message}"


def _check(recipe: Recipe) -> None:
    def require(condition, place, message):
        if not condition:
            raise RecipeError(f"{place}: {message}")

    require(
        1 <= recipe.window <= shutters.MAX_WINDOW,
        "window",
        f"{recipe.window} is not 1 to {shutters.MAX_WINDOW}",
    )
    require(recipe.shutters, "shutters", "there is none; the first is the default")
    names = [shutter.name for shutter in recipe.shutters]
    for i, shutter in enumerate(recipe.shutters):
        place = f"shutters[{i}]"
        require(
            names.index(shutter.name) == i,
            f"{place}.name",
            f'"{shutter.name}" is taken by shutters[{names.index(shutter.name)}]',
        )
        require((shutter.bars is None) != (not shutter.keys), place, "either bars or keys, one of the two")
        require(all(0 <= c <= 1 for c in shutter.color), f"{place}.color", "not three numbers from 0 to 1")
        _check_frames(shutter.keys, f"{place}.keys", require)
        for where, bars in (
            [(f"{place}.bars", shutter.bars)]
            if shutter.bars is not None
            else [(f"{place}.keys[{k}].bars", key.bars) for k, key in enumerate(shutter.keys)]
        ):
            require(len(bars) == recipe.window, where, f"{len(bars)} values, window is {recipe.window}")
            try:
                shutters.check_bars(bars)
            except shutters.ShutterError as error:
                raise RecipeError(f"{where}: {error}") from None
    _check_frames(recipe.time, "time", require)
    for i, region in enumerate(recipe.regions):
        place = f"regions[{i}]"
        require(region.shutter in names, f"{place}.shutter", f'there is no shutter "{region.shutter}"')
        require(region.width >= 0, f"{place}.width", f"{region.width} is negative")
        require(region.drawings()[0][1], f"{place}.strokes", "empty: nothing is drawn")
        _check_frames(region.keys, f"{place}.keys", require)
        redrawn = any(key.strokes is not None for key in region.keys)
        for k, key in enumerate(region.keys):
            whole = not (redrawn if k == 0 else key.strokes is not None) or key.frame == int(key.frame)
            require(whole, f"{place}.keys[{k}].frame", f"{key.frame:g} is no whole frame, but redrawn")
        for where, strokes in [(place, region.strokes)] + [
            (f"{place}.keys[{k}]", key.strokes) for k, key in enumerate(region.keys) if key.strokes is not None
        ]:
            for j, stroke in enumerate(strokes):
                require(stroke, f"{where}.strokes[{j}]", "empty: a stroke has at least one point")


def _check_frames(keys, place, require) -> None:
    for k, (first, second) in enumerate(pairwise(keys)):
        require(
            first.frame < second.frame,
            f"{place}[{k + 1}].frame",
            f"{second.frame:g} does not follow {first.frame:g}",
        )
