"""Read recipes from JSON files, check them, and write them."""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from collections.abc import Callable
from dataclasses import is_dataclass
from functools import cache, partial
from pathlib import Path
from types import NoneType, UnionType
from typing import TYPE_CHECKING, Annotated, Any, Literal, Union, get_args, get_origin

from .. import atomic_write
from ..model import effect as model
from ..model import limits, shutters
from ..model.frame_state import EXTREMES
from . import records
from .recipe import CAMERA, RecipeError
from .records import drawn_in

if TYPE_CHECKING:
    from cattrs import Converter


def load(path: str | Path) -> model.Effect:
    """Read the effect from the JSON file of a recipe.

    Raises:
        RecipeError: The file cannot be read, or is not a valid recipe, or the package cattrs is missing. The message
            begins with the path.
    """
    try:
        return parse(_read(Path(path)))
    except OSError as error:
        raise RecipeError(f"{path}: {error.strerror or error}") from None
    except UnicodeDecodeError:
        raise RecipeError(f"{path}: not a text file in UTF-8") from None
    except ValueError as error:  # RecipeError, or a name that no file can have
        raise RecipeError(f"{path}: {error}") from None


def _read(path: Path) -> str:
    """Read a recipe's file and return its text.

    Raises:
        RecipeError: The file is a pipe or a device, or larger than limits.MAX_BYTES.
        OSError: The file cannot be read.
        ValueError: The file is not UTF-8, or no file can have its name.
    """
    if path.exists() and not (path.is_file() or path.is_dir()):
        # Opening a pipe would wait forever, and a device has no end.
        raise RecipeError("a pipe or a device, not a file")
    with path.open("rb") as file:
        data = file.read(limits.MAX_BYTES + 1)
    _check_size(data)
    return data.decode("utf-8")


def _check_size(text: str | bytes) -> None:
    """Raise RecipeError for a text that is too large for a recipe."""
    if len(text) > limits.MAX_BYTES:
        raise RecipeError(f"more than {limits.MAX_BYTES // 1_000_000} MB, which no recipe has")


def parse(text: str) -> model.Effect:
    """Convert the JSON text of a recipe to an effect.

    Raises:
        RecipeError: The text is no valid recipe, or is for a newer version, or the package cattrs is missing. The
            message about a fault begins with the fault's place, like `shutters[1].bars`, if it has one.
    """
    _check_size(text)
    try:
        data = json.loads(text.removeprefix("\ufeff"), object_pairs_hook=_object, parse_int=_whole)
    except json.JSONDecodeError as error:
        raise RecipeError(f"line {error.lineno}, column {error.colno}: not JSON ({error.msg})") from None
    except RecursionError:
        raise RecipeError("recipe: too many lists or objects within each other") from None
    if isinstance(data, dict) and type(version := data.get("version")) is int and version > records.VERSION:
        newer = f"version: {shown(version)} is of a newer version of Virtual Shutter, this one reads {records.VERSION}"
        raise RecipeError(newer)
    if isinstance(data, dict) and data.get("version") == 1:
        data.pop("inbetween_method", None)  # only one method is left
        if data.get("inbetween", 1) != 1:
            data.setdefault("skip_repeats", False)  # the behavior of version 1
    converter = _converter()
    try:
        recipe: Any = converter.structure(data, records.RecipeRecord)
    except Exception as error:
        raise RecipeError(_first_fault(error)) from None
    check(recipe)
    return records.effect_of(recipe)


def dump(effect: model.Effect) -> str:
    """Convert an effect to the JSON text of a recipe, which `parse` reads.

    Fields that do not count are left out, such as the softness of a shutter without a threshold.

    Args:
        effect: An effect whose channels are keyed or constant, such as the result of `parse` or key_fitting.with_keys.
    """
    text = json.dumps(records.recipe_of(effect), indent=1, ensure_ascii=False)
    # People edit these files: keep a list of numbers on one line. The pattern also matches strings, to skip them.
    return re.sub(r'"(?:[^"\\]|\\.)*"|\[[-+.\de,\s]+\]', _on_one_line, text) + "\n"


def _on_one_line(match: re.Match) -> str:
    """Return the matched list of numbers on one line, or the matched string as it is."""
    text = match[0]
    return text if text[0] == '"' else " ".join(text.split()).replace("[ ", "[").replace(" ]", "]")


def save(effect: model.Effect, path: str | Path) -> None:
    """Write an effect to a file as a recipe.

    If an error occurs, a file that was there stays as it was.

    Args:
        effect: An effect whose channels are keyed or constant, as for `dump`.
        path: The file. It is replaced if it exists.

    Raises:
        OSError: The file cannot be written.
    """
    with atomic_write.writing(Path(path)) as part:
        part.write_text(dump(effect), encoding="utf-8")


def _object(pairs: list) -> dict:
    """Return a JSON object's fields as a dict. Raise RecipeError if one is given twice."""
    fields = dict(pairs)
    if len(fields) < len(pairs):
        twice = Counter(name for name, _ in pairs).most_common(1)[0][0]
        raise RecipeError(f"recipe: field {shown(twice)} is given twice")
    return fields


def _whole(digits: str) -> int | float:
    # Longer numbers are read as floats, since parsing huge integers takes long. No count needs as many digits.
    return int(digits) if len(digits) <= 300 else float(digits)


def _number(value: Any, _kind: Any) -> float:
    """Return a value of the JSON as a float. Raise ValueError if it is not a finite number."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f"{shown(value)} is not a number")
    if not math.isfinite(value):
        raise ValueError(f"{value} is not a finite number")
    return float(value)


def _within(converter: Converter, value: Any, kind: Any) -> Any:
    """Convert a value of the JSON to a type that has a range, and check the range. This is a hook of cattrs.

    Args:
        converter: The converter that calls this hook.
        value: The number, text or list. For texts and lists, the range is that of the length.
        kind: The type, Annotated[type without the range, records.Within].

    Returns:
        The converted value.

    Raises:
        ValueError: The number or length is out of the range, or a text has characters that names cannot have.
    """
    inner, (least, most, empty) = get_args(kind)
    made = converter.structure(value, inner)
    if isinstance(made, str | list):
        if len(made) > most or len(made) < least:
            many = f"{len(made)}{' characters' * isinstance(made, str)}, the most are {most}"
            raise ValueError(many if made else empty)
        wrong = next((c for c in made if c == "\0" or "\ud800" <= c <= "\udfff"), "") if isinstance(made, str) else ""
        if wrong:
            raise ValueError(f"U+{ord(wrong):04X} is not allowed in a name")
    elif not least <= made <= most:
        raise ValueError(f"{plain(made)} is not {plain(least)} to {plain(most)}")
    return made


def _union(converter: Converter, value: Any, kind: Any) -> Any:
    """Convert a value of the JSON to one of the types of a union, such as `X | Y`. This is a hook of cattrs.

    The type is chosen as follows: for a region, by its field `kind`; for null, None if the union has it; for a number
    that can have keys, and for strokes of a subject at several frames, the type of keys if the JSON has a list of them;
    otherwise the first type of the union.

    Args:
        converter: The converter that calls this hook.
        value: The value of the JSON.
        kind: The union.
    """
    first, *others = get_args(kind)
    if kind == records.AnyRegionRecord:
        word = value.get("kind", "line") if isinstance(value, dict) else "line"
        if not isinstance(word, str) or word not in records.KINDS:
            raise _of_field("kind", f"{shown(word)} is none of {', '.join(records.KINDS)}")
        return converter.structure(value, records.KINDS[word])
    if value is None and others[-1] is NoneType:
        return None
    is_keyed = isinstance(value, list) and (kind != records.Strokes or (value and isinstance(value[0], dict)))
    if others[0] is NoneType or not is_keyed:
        return converter.structure(value, first)
    return converter.structure(value, others[0])


def _exactly(wanted: type, name: str) -> Callable[[Any, Any], Any]:
    """Return a hook of cattrs that accepts values of exactly this type. `name` is the type's name in errors."""

    def structure(value: Any, _kind: Any) -> Any:
        if type(value) is not wanted:
            raise ValueError(f"{shown(value)} is not {name}")
        return value

    return structure


def _choice(value: Any, kind: Any) -> Any:
    """Return a value of the JSON if its type allows it, else raise ValueError. This is a hook of cattrs."""
    allowed = get_args(kind)
    if not any(type(value) is type(option) and value == option for option in allowed):
        raise ValueError(f"{shown(value)} is none of {', '.join(map(str, allowed))}")
    return value


def _items(converter: Converter, value: Any, kind: Any) -> list | tuple:
    """Convert a list of the JSON to a list or a tuple, and stop at the first fault. This is a hook of cattrs.

    Args:
        converter: The converter that calls this hook.
        value: The value of the JSON.
        kind: A type such as list[X], or tuple[X, X, …] whose items all have one type X. The number of items of a tuple
            has to match.

    Raises:
        ValueError: The value is no list, or has the wrong number of items for a tuple.
        cattrs.errors.IterableValidationError: An item is invalid, or keys are not in ascending order of their frames.
    """
    inner = get_args(kind)
    if not isinstance(value, list):
        raise ValueError(f"{shown(value)} is not a list")
    if get_origin(kind) is tuple and len(value) != len(inner):
        raise ValueError(f"{len(value)} values, not {len(inner)}")
    hook = converter.get_structure_hook(inner[0])
    structured: list[Any] = []
    try:
        for each in value:
            made = hook(each, inner[0])
            if structured and hasattr(made, "frame") and made.frame <= structured[-1].frame:
                raise _of_field("frame", f"{plain(made.frame)} does not follow {plain(structured[-1].frame)}")
            structured.append(made)
    except Exception as error:  # stop at the first fault; cattrs would collect millions
        from cattrs.errors import IterableValidationError, IterableValidationNote

        index = len(structured)
        error.add_note(IterableValidationNote(f"index {index}", index, inner[0]))
        raise IterableValidationError("in a list", [error], kind) from None
    return get_origin(kind)(structured)


def _of_field(name: str, message: str) -> Exception:
    """Return an error about a field of a JSON object, which `_first_fault` turns into a sentence with the place."""
    from cattrs.errors import AttributeValidationNote, ClassValidationError

    error = ValueError(message)
    error.add_note(AttributeValidationNote("in an object", name, str))
    return ClassValidationError("in an object", [error], dict)


def _dataclass(kind: Any, converter: Converter) -> Callable[[Any, Any], Any]:
    """Return a hook of cattrs that converts JSON objects to a record, and refuses fields that it does not know."""
    from cattrs.gen import make_dict_structure_fn

    structure_fields = make_dict_structure_fn(kind, converter, _cattrs_forbid_extra_keys=True)

    def structure(value: Any, kind: Any) -> Any:
        if not isinstance(value, dict):
            raise ValueError(f"{shown(value)} is not an object")
        return structure_fields(value, kind)

    return structure


def _made_of(*origins: Any) -> Callable[[Any], bool]:
    """Return a test for types: whether a type is made with one of `origins`, such as Literal or list."""
    return lambda kind: get_origin(kind) in origins


@cache
def _converter() -> Converter:
    """Make the cattrs converter that turns a recipe's JSON into records (dataclasses). It is made only once.

    Raises:
        RecipeError: cattrs is not installed. It comes with Blender, except with some Linux distributions' packages.
            Only recipes need it: effects in Blender render without it.
    """
    try:
        import cattrs
    except ImportError as error:
        raise RecipeError(
            f"recipes need the Python package cattrs ({error}); install it for Blender's Python"
        ) from None
    converter = cattrs.Converter()
    converter.register_structure_hook(float, _number)
    converter.register_structure_hook(int, _exactly(int, "a whole number"))
    converter.register_structure_hook(str, _exactly(str, "a text"))
    converter.register_structure_hook(bool, _exactly(bool, "true or false"))
    converter.register_structure_hook_func(_made_of(Literal), _choice)
    converter.register_structure_hook_func(_made_of(Annotated), partial(_within, converter))
    converter.register_structure_hook_func(_made_of(Union, UnionType), partial(_union, converter))
    converter.register_structure_hook_func(_made_of(list, tuple), partial(_items, converter))
    converter.register_structure_hook_factory(is_dataclass, _dataclass)
    return converter


def _first_fault(error: Exception) -> str:
    """Return the first fault in an exception of cattrs as a sentence, `place: what is wrong`."""
    import cattrs
    from cattrs.errors import ForbiddenExtraKeysError

    def described(error: BaseException, kind: Any) -> str:
        if isinstance(error, KeyError):
            return "missing"
        if isinstance(error, ForbiddenExtraKeysError):
            names = sorted(error.extra_fields)
            more = f" and {len(names) - 3} more" if len(names) > 3 else ""
            return f"unknown field {', '.join(map(cut, names[:3]))}{more}"
        return str(error)

    message, _, place = cattrs.transform_error(error, "$", described)[0].rpartition(" @ $")
    return f"{place.lstrip('.') or 'recipe'}: {message}"


def shown(value: Any) -> str:
    """Return a value as JSON for a message, cut to 40 characters."""
    text = ""
    for part in json.JSONEncoder(ensure_ascii=False).iterencode(value):
        text += part
        if len(text) > 40:
            break
    return cut(text)


def cut(text: str) -> str:
    """Return a text, cut to 40 characters with an ellipsis."""
    return text if len(text) <= 40 else text[:37] + "…"


def plain(number: float) -> str:
    """Return a number as text for a message, with at most ten digits of a float."""
    return shown(number) if isinstance(number, int) else f"{number:.10g}"


def _require(condition: object, place: str, message: str) -> None:
    """Raise RecipeError with the place and the message unless the condition holds."""
    if not condition:
        raise RecipeError(f"{place}: {message}")


def check(recipe: Any) -> None:
    """Check a recipe's record for faults that its types cannot find, such as names that refer to nothing.

    Args:
        recipe: A records.RecipeRecord.

    Raises:
        RecipeError: The recipe is not valid. The message begins with the place of the fault, like `shutters[1].bars`.
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
    """Check the bars of a shutter: it has either bars or keys, each with `window` valid bars.

    Args:
        shutter: The shutter's record.
        window: The recipe's field `window`: how many bars each shutter must have.
        place: The shutter's place in the recipe, like `shutters[1]`, for messages.

    Raises:
        RecipeError: A check fails.
    """
    _require((shutter.bars is None) != (not shutter.keys), place, "either bars or keys, one of the two")
    said = {f"{place}.keys[{k}].bars": key.bars for k, key in enumerate(shutter.keys)}
    for where, bars in (said or {f"{place}.bars": shutter.bars}).items():
        _require(len(bars) == window, where, f"{len(bars)} values, window is {window}")
        try:
            shutters.check_bars(bars)
        except shutters.ShutterError as error:
            raise RecipeError(f"{where}: {error}") from None


def _check_exposure(shutter: Any, place: str) -> None:
    """Check settings of a shutter's record that need or exclude each other."""
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
    """Check that the name that a shutter follows is that of exactly one region, or of the camera."""
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
    """Check the drawings in a region's record, and return the number of points of the largest."""
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
