"""Export an effect of Blender as a recipe: find keys for its sampled channels.

Sampled numbers are float32. A recipe gets the shortest decimals that give the same float32, and points are rounded to a
millionth of the picture. So a recipe's numbers survive a round trip with up to seven digits.

A recipe knows three eases between keys. Where a channel does something else, it gets a key per frame. At every whole
frame, recipe and effect agree within TOLERANCE.
"""

import itertools
import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from decimal import Decimal
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..model import keyframes, limits, motions
from ..model.effect import (
    Camera,
    Drawings,
    Effect,
    FileContent,
    MatteRegion,
    Moves,
    OutlineRegion,
    RampContent,
    Region,
    Shutter,
    Subject,
    SubjectRegion,
)
from ..model.fields import fields_of
from ..model.frame_state import Interpolation
from ..model.keyframes import Bars, Channel, Constant, Ease, Keys, Samples, SourceTime
from ..model.motions import Placement
from . import recipe, recipe_file

# Relative to the largest bar; absolute for fractions of the picture and degrees, relative for keys above 1.
TOLERANCE = 1e-4

_MARKS = "drawings", "nots", "outlines"  # what is drawn in regions
# Frames of keys, each with the ease until the next key.
_Eased = Sequence[tuple[float, Ease]]
_Fits = Callable[[float, float, float, float], bool]


def with_keys(effect: Effect, shown: range, contents: Iterable[FileContent | RampContent] = ()) -> Effect:
    """Convert an effect to the form that recipes have: keys instead of values at every frame.

    The keys give the effect's values at whole frames, within TOLERANCE. Scribbles, outlines and subjects of which
    nothing is drawn are left out, and so are a region's drawings before the first one that has strokes. A shutter that
    follows a region that is left out follows nothing. Properties that recipes cannot key, such as options, become
    constant: they have the value at the first frame.

    Args:
        effect: The effect. Its channels are sampled at all frames in `shown`, and at the frames of keys and drawings.
        shown: The timeline frames at which the effect is shown. The first one becomes the recipe's frame 1.
        contents: The content for each region of the effect that has a matte file or ramp, in the order of regions. It
            replaces the region's own. Outlines and subjects take none.

    Returns:
        The converted effect, which recipe_file.dump can write.

    Raises:
        EffectError: The effect cannot be rendered.
    """
    options = effect.options.at(shown.start)
    names: list[str] = []
    for shutter in effect.shutters:
        names.append(_free(shutter.name, names))  # regions refer to the first of repeated names
    called, given = _region_names(effect), iter(contents)
    made = [_region(region, name, given, shown) for region, name in zip(effect.regions, called, strict=True)]
    camera = Camera(moves=_moves(effect.camera, {}, shown), **_said(effect.camera, shown))
    # Without strokes, a region does not move anything.
    followed = {id(old): new for old, new in zip(effect.regions, made, strict=True)} | {id(effect.camera): camera}
    shutters = [
        _shutter(effect, index, name, followed.get(id(effect.shutters[index].follow)), options.interpolation, shown)
        for index, name in enumerate(names)
    ]
    sampled = Effect(
        shutters=tuple(shutters),
        regions=tuple(region for region in made if region),
        options=Constant(options),
        time=_time(effect.time, shown) if effect.time else None,
        camera=camera,
        **_said(effect, shown),
    )
    return recipe_file.parse(recipe_file.dump(sampled))


def _free(name: str, taken: Collection[str]) -> str:
    """Return the name if it is not in `taken`, else the name with a number, from 2, that makes it differ from those."""
    ends = itertools.chain([""], (f" {number}" for number in itertools.count(2)))
    numbered = (name[: limits.MAX_NAME - len(end)] + end for end in ends)
    return next(each for each in numbered if each not in taken)


def _region_names(effect: Effect) -> list[str]:
    """Name an effect's regions so that a recipe can say by name what a shutter follows.

    A region that a shutter follows gets a unique name other than "camera": "Region" if it has none, and a number at the
    end if needed. A region called "camera" is renamed, too, if a shutter follows the camera. Others keep their names.

    Returns:
        A name for each region, in order.
    """
    followed = [shutter.follow for shutter in effect.shutters if shutter.follow]
    names = [region.name for region in effect.regions]
    for i, region in enumerate(effect.regions):
        mistaken = region.name == recipe.CAMERA and effect.camera in followed
        if mistaken or any(region is other for other in followed):
            names[i] = _free(region.name or "Region", {recipe.CAMERA, *names[:i], *names[i + 1 :]})
    return names


def _shutter(
    effect: Effect, index: int, name: str, follow: Subject | None, interpolation: Interpolation, shown: range
) -> Shutter:
    """Convert one shutter of an effect to the form that recipes have, with keys.

    Args:
        index: The shutter's index in the effect.
        name: Its name in the recipe.
        follow: The converted region or camera that it follows; None: it follows nothing.
        interpolation: Options.interpolation: how bars change between keys.
        shown: As for `with_keys`.
    """
    shutter = effect.shutters[index]
    said = _said(shutter, shown)
    red, green, blue = (_short(component) for component in shutter.color)
    said |= {"name": name, "color": (red, green, blue), "follow": follow}
    return Shutter(bars=_bars(effect, index, interpolation, shown), **said)


def _said(part: Any, shown: range) -> dict[str, Any]:
    """Convert the properties of a part of an effect to the form that recipes have: {attribute's name: value}.

    These are the properties that the model declares as fields. A sampled number that recipes can key gets keys; any
    other value over time becomes the constant value that it has at the first shown frame.

    Args:
        part: The Effect, or one of its shutters or regions, or its camera.
        shown: As for `with_keys`.
    """
    said: dict[str, Any] = {}
    for name, each in fields_of(part.__class__).items():
        value = getattr(part, name)
        if each.is_channel:
            is_keyed = each.keyed_in_recipe and isinstance(value, Samples)
            value = _number_keys(value.at, value, shown) if is_keyed else Constant(_short(value.at(shown.start)))
        said[name] = value
    return said


def _bars(effect: Effect, index: int, interpolation: Interpolation, shown: range) -> Bars:
    """Return the bars of the shutter with an index as a recipe has them: with keys, or constant."""
    sampled = effect.shutters[index].bars

    @cache
    def bars(frame: float) -> np.ndarray:
        return effect.checked(index, frame, sampled.at(frame, interpolation))

    def short(frame: float) -> np.ndarray:
        return np.array([_short(weight) for weight in bars(frame)])

    if not isinstance(sampled.channel, Samples):
        return Bars(Constant(short(shown.start)))

    def fits(first: float, second: float, frame: float, share: float) -> bool:
        ends = np.array([bars(first), bars(second)])
        if interpolation == "value" or sampled.share is None:  # every bar has its own ease
            apart = np.abs(bars(frame) - keyframes.between_bars(ends[0], ends[1], share, "value")).max()
        else:
            apart = abs(sampled.share.at(frame) - share) * np.ptp(ends, axis=0).max()
        return bool(apart <= TOLERANCE * ends.max())

    eased = _keys(fits, dict(sampled.keys), {}, shown)
    return Bars(_keyed(eased, short, shown))


def _keyed(eased: _Eased, value: Callable[[float], Any], shown: range) -> Keys:
    """Make a channel with keys at some frames, with values that a function returns.

    Args:
        eased: The timeline frame of each key, and the ease until the next key.
        value: Returns the value at a timeline frame.
        shown: As for `with_keys`.

    Returns:
        The channel, with frames counted as in a recipe.
    """
    frames, eases = zip(*eased, strict=True)
    return Keys(tuple(_frame(frame, shown) for frame in frames), tuple(map(value, frames)), eases)


def _time(time: Channel, shown: range) -> SourceTime:
    """Return the channel of source time as a recipe has it, with keys."""
    keys = _number_keys(lambda frame: time.at(frame)[0], time, shown)
    return SourceTime(keys, tuple(zip(keys.frames, keys.eases, strict=True)))


def _number_keys(at: Callable[[float], float], channel: Channel, shown: range) -> Keys:
    """Find keys that reproduce a number which changes over time.

    Args:
        at: Returns the number at a timeline frame.
        channel: The effect's channel of the number. If it is sampled, the search begins with the frames and eases of
            its own keys. Otherwise the result has one key, at the first shown frame.
        shown: As for `with_keys`.

    Returns:
        The channel with keys, with frames counted as in a recipe.
    """
    # float32 has no more digits for large numbers.
    fits = _straight(lambda frame: np.array(at(frame)), lambda largest: max(TOLERANCE, 2e-6 * float(largest)))
    keys: _Eased = [(shown.start, "linear")]
    if isinstance(channel, Samples):
        keys = _keys(fits, dict(channel.keys), {}, shown)
    return _keyed(keys, lambda frame: _short(at(frame)), shown)


def _straight(at: Callable[[float], np.ndarray], allowed: Callable[[np.ndarray], ArrayLike]) -> _Fits:
    """Make the test that `_keys` needs for numbers that are interpolated linearly between two keys.

    Args:
        at: Returns the exact numbers at a timeline frame.
        allowed: Returns the largest allowed error of each number, given the larger of its absolute values at the two
            keys.

    Returns:
        fits(first, second, frame, share): whether the mix (1 − share) · at(first) + share · at(second) of the numbers
        at two keys is right at `frame`, within the allowed error.
    """

    def fits(first: float, second: float, frame: float, share: float) -> bool:
        ends = np.array([at(first), at(second)])
        apart = np.abs((1 - share) * ends[0] + share * ends[1] - at(frame))
        return bool(np.all(apart <= allowed(np.abs(ends).max(axis=0))))

    return fits


def _region(
    region: Region | MatteRegion, name: str, contents: Iterator[FileContent | RampContent], shown: range
) -> Region | MatteRegion | None:
    """Convert a region to the form that recipes have, with keys.

    Args:
        name: Its name in the recipe.
        contents: Yields the contents that are left of `with_keys`. A region with a matte file or ramp takes the next
            one; others take none.
        shown: As for `with_keys`.

    Returns:
        The converted region. None: it is drawn, but has no strokes; or it is a subject with neither strokes on it nor
        outlines.
    """
    said = _said(region, shown) | {"name": name}
    if isinstance(region, MatteRegion) and not isinstance(region, OutlineRegion | SubjectRegion):
        return replace(region, content=next(contents), moves=_moves(region, {}, shown), **said)
    is_subject = isinstance(region, SubjectRegion)
    marks = {each: _drawings(getattr(region, each), shown.start) for each in _MARKS if hasattr(region, each)}
    drawn = marks["outlines" if is_subject else "drawings"]
    if not (marks["drawings"] or drawn):
        return None
    fixed: dict[float, Ease] = {}
    if is_subject and region.moves.are_keyed:
        fixed = dict.fromkeys(drawn, "linear")
    elif len(drawn) > 1 and not is_subject:
        # A drawing's ease to the next is independent of the region's keys.
        eases = dict(zip(region.drawings.frames, region.drawings.eases, strict=True))
        fixed = {number: eases[number] for number in drawn}
    for each, drawings in marks.items():
        kept = {number: strokes for number, strokes in drawings.items() if strokes or not is_subject}
        frames, eased = (_frame(number, shown) for number in kept), (fixed.get(number, "linear") for number in kept)
        said[each] = Drawings(name, tuple(frames), tuple(kept.values()), tuple(eased), 1.0)
    return replace(region, moves=_moves(region, fixed, shown), **said)


def _moves(moving: Subject, fixed: Mapping[float, Ease], shown: range) -> Moves:
    """Convert the placement of a region or camera over time to the form that recipes have, with keys.

    Args:
        moving: The region or camera.
        fixed: Timeline frames that must be keys, with the ease that each must have.
        shown: As for `with_keys`.

    Returns:
        The placement, with frames counted as in a recipe. It has no keys if it is constant and moves nothing, and
        `fixed` is empty.
    """
    keys = []
    for frame, ease in _move_keys(moving, fixed, shown):
        there = moving.placement(frame)
        x, y = map(_short, there.location)
        placed = Placement((x, y), _short_degrees(there.rotation), _short(there.scale))
        keys.append((_frame(frame, shown), placed, ease))
    return Moves.keyed(keys)


def _move_keys(moving: Subject, fixed: Mapping[float, Ease], shown: range) -> _Eased:
    """Return the frames and eases of the keys of `_moves`, which has the same arguments."""
    moves = moving.moves.location, moving.moves.rotation, moving.moves.scale
    eases: dict[float, Ease] = {}
    sampled = [channel for channel in moves if isinstance(channel, Samples)]
    for channel in sampled:
        eases = dict(channel.keys) | eases

    @cache
    def place(frame: float) -> np.ndarray:
        return motions.as_array([moving.placement(frame)])[0]

    if not (eases or fixed) and tuple(place(shown.start)) != (0, 0, 0, 1):
        eases = {shown.start: "linear"}
    fits = _straight(place, lambda largest: TOLERANCE * np.maximum(1, largest))
    return _keys(fits, eases, fixed, shown) if eases or fixed or sampled else []


def _drawings(drawings: Drawings, frame: float) -> dict[float, list[np.ndarray]]:
    """Return a region's drawings in fractions of the picture, without those before the first one that has strokes.

    Args:
        frame: The timeline frame whose picture the fractions refer to: a strip's transform can move strokes over time.

    Returns:
        {timeline frame of a drawing: its strokes, (n, 2) each}. Keys of the region do not move them yet.
    """
    result: dict[float, list[np.ndarray]] = {}
    for index, number in enumerate(drawings.frames):
        strokes = drawings.drawing(index, frame)
        if strokes or result:
            result[number] = [np.round(points, 6) for points in strokes]
    return result


def _keys(fits: _Fits, eases: Mapping[float, Ease], fixed: Mapping[float, Ease], shown: range) -> _Eased:
    """Choose keys so that interpolation between them gives the effect's values at every whole frame shown.

    It keeps the effect's own keys, and tries for each the three eases until one fits. Where none does, and outside the
    keys where the value changes, it adds a linear key at each frame. Without `eases` and `fixed`, every frame is a key.

    Args:
        fits: fits(first, second, frame, share) tells whether a value interpolated between keys at the frames `first`
            and `second` is right at `frame`. `share`, 0 to 1, is the share of the way between the two keys' values.
        eases: The effect's own keys: {timeline frame: ease until the next key}. That ease is tried first.
        fixed: Frames that must be keys, such as those of drawings: {timeline frame: the only ease that is tried}.
        shown: As for `with_keys`.

    Returns:
        The keys' timeline frames, ascending, with the ease from each key to the next. Frames may lie outside `shown`.
    """
    if not (frames := sorted(eases.keys() | fixed.keys())):
        return [(frame, "linear") for frame in shown]

    def per_frame(outside: range, held: float) -> list[tuple[float, Ease]]:
        """Return a linear key for each frame of `outside`, or none if the value at `held` is right for all."""
        return [] if all(fits(held, held, frame, 0) for frame in outside) else [(frame, "linear") for frame in outside]

    kept = per_frame(range(shown.start, min(math.ceil(frames[0]), shown.stop)), frames[0])
    for first, second in pairwise(frames):
        # Keys may lie a million frames outside the strip.
        between = range(max(math.floor(first) + 1, shown.start), min(math.ceil(second), shown.stop))
        shares = {frame: (frame - first) / (second - first) for frame in between}
        candidates = (fixed[first],) if first in fixed else (eases.get(first, "linear"), *keyframes.EASES)
        for word in candidates:
            if all(fits(first, second, frame, keyframes.eased(share, word)) for frame, share in shares.items()):
                kept.append((first, word))
                break
        else:
            kept.append((first, candidates[0]))
            kept += [(frame, "linear") for frame in shares]
    last = frames[-1]
    kept.append((last, fixed.get(last) or eases.get(last, "linear")))
    return kept + per_frame(range(max(math.floor(last) + 1, shown.start), shown.stop), last)


def _short(value: float) -> float:
    """Return the shortest decimal number that is the same float32 as `value`."""
    return float(str(np.float32(value)))


def _short_degrees(degrees: float) -> float:
    """Return the shortest decimal number of degrees whose radians have the same float32."""
    wanted = np.float32(math.radians(degrees))
    numbers = (float(f"{degrees:.{digits}g}") for digits in range(1, 17))
    return next((number for number in numbers if np.float32(np.radians(number)) == wanted), degrees)


def _frame(frame: float, shown: range) -> float:
    """Convert a timeline frame to one of the recipe, where the first of `shown` is 1, without rounding errors."""
    return float(Decimal(str(np.float32(frame))) - (shown.start - 1))
