"""An effect as a recipe, where its channels were sampled: the inverse of Recipe.effect.

Numbers are float32 where they come from: a recipe gets the shortest decimals that give the same ones back, and points
to a millionth of the picture. So a recipe's numbers come back as they were written, up to seven digits.
Between two keys a recipe knows three eases. Where a channel does something else there is a key per frame: at every
whole frame, recipe and effect agree within TOLERANCE.
"""

import itertools
import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import asdict, replace
from decimal import Decimal
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np

from ..model import keyframes, limits
from ..model.effect import Effect, MatteRegion, OutlineRegion, Region, Shutter, Subject
from ..model.frame_state import Interpolation
from ..model.keyframes import Channel, Ease, Samples
from . import recipe, recipe_file

# Of the largest bar, of fractions of the picture, of degrees; of the larger key's value where that is above 1.
TOLERANCE = 1e-4

# Frames of keys, each with the ease of the span that it begins.
_Eased = Sequence[tuple[float, Ease]]


def baked(
    effect: Effect,
    shown: range,
    inbetween_method: recipe.Method,
    mattes: Iterable[recipe.MatteRegion | recipe.RampRegion] = (),
) -> recipe.Recipe:
    """The recipe of an effect that is shown at these frames, of which the first is the recipe's frame 1. Its channels
    are sampled there, at their keys and at its drawings. EffectError: it cannot be rendered as it stands.

    mattes: of each matte region what a recipe says of it besides its name, shutter and numbers, as a region of one

    Left out are regions without strokes, drawings before the first that has strokes, and keys of widths and of options,
    which are as at the first frame."""
    options = effect.options.at(shown.start)
    names = _different([shutter.name for shutter in effect.shutters])
    called = _region_names(effect)
    words = iter(mattes)
    regions = [
        _drawn(region, name, names[region.shutter], shown)
        if isinstance(region, Region | OutlineRegion)
        else _matte(region, next(words), name, names[region.shutter], shown)
        for region, name in zip(effect.regions, called, strict=True)
    ]
    # A region without strokes says nothing of how anything moves.
    known = {region.name for region in regions if region} | {recipe.CAMERA}
    follows = [name if name in known else None for name in _follows(effect, called)]
    sampled = recipe.Recipe(
        version=1,
        shutters=[
            _whole(effect.shutters[i], _shutter(effect, i, name, options.interpolation, shown), follows[i], shown)
            for i, name in enumerate(names)
        ],
        regions=[region for region in regions if region],
        inbetween=options.step,
        inbetween_method=inbetween_method,
        edge_aware=_number(effect.edge_aware, shown),
        time=_time(effect.time, shown) if effect.time else [],
        camera=_camera(effect.camera, shown),
        camera_influence=_number(effect.camera.influence, shown),
        **{name: value for name, value in asdict(options).items() if name not in ("step", "slid", "edge_aware")},
    )
    return recipe_file.parse(recipe_file.dump(sampled))


def _different(names: list[str]) -> list[str]:
    """The names, those that occur again with a number: regions mean the first."""
    result = []
    for name in names:
        number = 1
        while (new := _numbered(name, number)) in result:
            number += 1
        result.append(new)
    return result


def _numbered(name: str, number: int) -> str:
    end = "" if number == 1 else f" {number}"
    return name[: limits.MAX_NAME - len(end)] + end


def _region_names(effect: Effect) -> list[str]:
    """The regions' names; those that shutters follow are as no other's, and not the camera's."""
    followed = [shutter.follow for shutter in effect.shutters if shutter.follow]
    names = [region.name for region in effect.regions]
    for i, region in enumerate(effect.regions):
        mistaken = region.name == recipe.CAMERA and effect.camera in followed
        if mistaken or any(region is other for other in followed):
            taken = {recipe.CAMERA, *names[:i], *names[i + 1 :]}
            numbered = (_numbered(region.name or "Region", number) for number in itertools.count(1))
            names[i] = next(name for name in numbered if name not in taken)
    return names


def _follows(effect: Effect, names: list[str]) -> list[str | None]:
    """What each shutter follows, in a recipe's words."""
    words = {id(region): name for region, name in zip(effect.regions, names, strict=True)}
    words[id(effect.camera)] = recipe.CAMERA
    return [words.get(id(shutter.follow)) for shutter in effect.shutters]


def _whole(shutter: Shutter, said: recipe.Shutter, follow: str | None, shown: range) -> recipe.Shutter:
    """A recipe's shutter with what it makes of frames, what it follows, and how far."""
    if shutter.timeline:
        said = replace(said, length="timeline")
    if shutter.combine != "average":
        said = replace(said, combine=shutter.combine)
    if shutter.combine in ("lightest", "darkest"):
        said = replace(said, by_luminance=shutter.by_luminance)
        if shutter.threshold is not None:
            threshold, softness = _number(shutter.threshold, shown), _number(shutter.softness, shown)
            said = replace(said, threshold=threshold, softness=softness)
    if not follow:
        return said
    trail = _number(shutter.trail, shown) if shutter.trail else None
    return replace(said, follow=follow, trail=trail, follow_motion=shutter.motion, follow_smooth=shutter.smooth)


def _shutter(effect: Effect, index: int, name: str, interpolation: Interpolation, shown: range) -> recipe.Shutter:
    red, green, blue = (_short(component) for component in effect.shutters[index].color)
    sampled = effect.shutters[index].bars

    @cache
    def bars(frame: float) -> np.ndarray:
        return effect.checked(index, frame, sampled.at(frame, interpolation))

    if not isinstance(sampled.channel, Samples):
        return recipe.Shutter(name=name, color=(red, green, blue), bars=[_short(v) for v in bars(shown.start)])

    def fits(first: float, second: float, frame: float, share: float) -> bool:
        ends = np.array([bars(first), bars(second)])
        if interpolation == "value" or sampled.share is None:  # every bar has an ease of its own
            apart = np.abs(bars(frame) - keyframes.between_bars(ends[0], ends[1], share, "value")).max()
        else:
            apart = abs(sampled.share.at(frame) - share) * np.ptp(ends, axis=0).max()
        return bool(apart <= TOLERANCE * ends.max())

    keys = _keys(fits, lambda *_: True, sampled.keys, [frame for frame, _ in sampled.keys], {}, shown)
    return recipe.Shutter(
        name=name,
        color=(red, green, blue),
        keys=[recipe.ShutterKey(_frame(frame, shown), [_short(v) for v in bars(frame)], ease) for frame, ease in keys],
    )


def _number(channel: Channel, shown: range) -> recipe.Keyable:
    if isinstance(channel, Samples):
        return _value_keys(channel.at, channel, shown)
    return _short(channel.at(shown.start))


def _time(time: Channel, shown: range) -> list[recipe.ValueKey]:
    return _value_keys(lambda frame: time.at(frame)[0], time, shown)


def _value_keys(at: Callable[[float], float], channel: Channel, shown: range) -> list[recipe.ValueKey]:
    """The keys of a number; at: its values, channel: where it was sampled."""

    def fits(first: float, second: float, frame: float, share: float) -> bool:
        ends = np.array([at(first), at(second)])
        apart = abs((1 - share) * ends[0] + share * ends[1] - at(frame))
        return bool(apart <= max(TOLERANCE, 2e-6 * np.abs(ends).max()))  # of large numbers: float32 has no more digits

    keys: _Eased = [(shown.start, "linear")]
    if isinstance(channel, Samples):
        frames = [frame for frame, _ in channel.keys]
        keys = _keys(fits, lambda frame, held: fits(held, held, frame, 0), channel.keys, frames, {}, shown)
    return [recipe.ValueKey(_frame(frame, shown), _short(at(frame)), ease) for frame, ease in keys]


def _drawn(
    region: Region | OutlineRegion, name: str, shutter: str, shown: range
) -> recipe.Region | recipe.OutlineRegion | None:
    drawings = _drawings(region, shown.start)
    if not drawings:
        return None
    # The ease from a drawing to the next is its own.
    words = dict(zip(region.drawings.frames, region.drawings.eases, strict=True)) if len(drawings) > 1 else {}
    words = {number: words[number] for number in drawings if words}
    keys = _move_keys(region, words, shown)
    redrawn = {number: strokes for number, strokes in drawings.items() if words and number != keys[0][0]}
    said: dict[str, Any] = {
        "shutter": shutter,
        "name": name,
        "strokes": drawings[min(drawings)],
        "keys": [
            recipe.RegionKey(strokes=redrawn.get(frame), ease=ease, **_placed(region, frame, shown))
            for frame, ease in keys
        ],
        "opacity": _number(region.opacity, shown),
        "layer": region.layer,
    }
    if isinstance(region, OutlineRegion):
        width = _number(region.feather, shown)
        kinds: dict[str, Any] = {"between": region.between, "invert": region.invert, "blend": region.blend}
        return recipe.OutlineRegion(kind="outline", width=width, **kinds, **said)
    return recipe.Region(kind=region.kind.at(shown.start), width=_short(region.width.at(shown.start)), **said)


def _matte(
    region: MatteRegion, words: recipe.MatteRegion | recipe.RampRegion, name: str, shutter: str, shown: range
) -> recipe.MatteRegion | recipe.RampRegion:
    return replace(
        words,
        name=name,
        shutter=shutter,
        invert=region.invert,
        blend=region.blend,
        keys=_camera(region, shown),
        opacity=_number(region.opacity, shown),
        width=_number(region.feather, shown),
        layer=region.layer,
    )


def _camera(moving: Subject, shown: range) -> list[recipe.CameraKey]:
    keys = _move_keys(moving, {}, shown)
    return [recipe.CameraKey(ease=ease, **_placed(moving, frame, shown)) for frame, ease in keys]


def _move_keys(moving: Subject, words: Mapping[float, Ease], shown: range) -> _Eased:
    """Frames and eases of the keys of location, rotation and scale; words: see _keys."""
    moves = moving.moves.location, moving.moves.rotation, moving.moves.scale
    sampled = [channel for channel in moves if isinstance(channel, Samples)]
    eases: dict[float, Ease] = {}
    for channel in sampled:
        eases = dict(channel.keys) | eases
    frames = eases.keys() | words.keys()

    @cache
    def place(frame: float) -> np.ndarray:
        return _place(moving, frame)

    if not frames and tuple(place(shown.start)) != (0, 0, 0, 1):
        frames = {shown.start}

    def fits(first: float, second: float, frame: float, share: float) -> bool:
        ends = np.array([place(first), place(second)])
        apart = np.abs((1 - share) * ends[0] + share * ends[1] - place(frame))
        return bool(np.all(apart <= TOLERANCE * np.maximum(1, np.abs(ends).max(axis=0))))

    def still(frame: float, held: float) -> bool:
        return fits(held, held, frame, 0)

    return _keys(fits, still, eases.items(), sorted(frames), words, shown) if frames or sampled else []


def _place(moving: Subject, frame: float) -> np.ndarray:
    placed = moving.placement(frame)
    return np.array([*placed.location, placed.rotation, placed.scale])


def _placed(moving: Subject, frame: float, shown: range) -> dict[str, Any]:
    """The frame, location, rotation and scale of a key, as a recipe has them."""
    x, y, rotation, scale = _place(moving, frame)
    location, degrees = (_short(x), _short(y)), _short_degrees(rotation)
    return {"frame": _frame(frame, shown), "location": location, "rotation": degrees, "scale": _short(scale)}


def _drawings(region: Region | OutlineRegion, frame: float) -> dict[float, list[recipe.Stroke]]:
    """A region's strokes by the frames they were drawn at, from the first that has any, as they lie at a frame."""
    result: dict[float, list[recipe.Stroke]] = {}
    for index, number in enumerate(region.drawings.frames):
        strokes = region.drawings.drawing(index, frame)
        if strokes or result:
            result[number] = [[(x, y) for x, y in np.round(points, 6).tolist()] for points in strokes]
    return result


def _keys(
    fits: Callable[[float, float, float, float], bool],
    still: Callable[[float, float], bool],
    keys: Collection[tuple[float, Ease]],
    frames: Sequence[float],
    words: Mapping[float, Ease],
    shown: range,
) -> _Eased:
    """Frames and eases of the keys that give the effect at every whole frame of the strip.

    fits: whether at a frame a share is right between two keys; still: whether a frame shows what another does;
    keys: those of the channels; frames: where there has to be a key; words: the ease that a key has to have."""
    if not frames:
        return [(frame, "linear") for frame in shown]

    def baked(outside: list[int], held: float) -> list[tuple[float, Ease]]:
        return [] if all(still(frame, held) for frame in outside) else [(frame, "linear") for frame in outside]

    eases = dict(keys)
    kept = baked([frame for frame in shown if frame < frames[0]], frames[0])
    for first, second in pairwise(frames):
        # Keys may lie a million frames outside.
        between = range(max(math.floor(first) + 1, shown.start), min(math.ceil(second), shown.stop))
        shares = {frame: (frame - first) / (second - first) for frame in between}
        candidates = (words[first],) if first in words else (eases.get(first, "linear"), *keyframes.EASES)
        for word in candidates:
            if all(fits(first, second, frame, keyframes.eased(share, word)) for frame, share in shares.items()):
                kept.append((first, word))
                break
        else:
            kept.append((first, candidates[0]))
            kept += [(frame, "linear") for frame in shares]
    last = frames[-1]
    kept.append((last, words.get(last) or eases.get(last, "linear")))
    return kept + baked([frame for frame in shown if frame > last], last)


def _short(value: float) -> float:
    """The shortest decimal that is the same float32."""
    return float(str(np.float32(value)))


def _short_degrees(degrees: float) -> float:
    """The shortest decimal that is the same float32 in radians."""
    wanted = np.float32(math.radians(degrees))
    numbers = (float(f"{degrees:.{digits}g}") for digits in range(1, 17))
    return next((number for number in numbers if np.float32(np.radians(number)) == wanted), degrees)


def _frame(frame: float, shown: range) -> float:
    """A frame as the recipe counts; in decimals, where 31.1 less 30 is 1.1."""
    return float(Decimal(str(np.float32(frame))) - (shown.start - 1))
