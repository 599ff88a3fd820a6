"""The recipe of an effect: the inverse of recipe_import.apply.

Blender keeps numbers as float32: a recipe gets the shortest decimals that give the same ones back, and points to a
millionth of the picture. So a recipe's numbers come back as they were written, up to seven digits.
Between two keys a recipe knows three eases. Where Blender's curves do something else, by free handles, channels keyed
apart, modifiers, there is a key per frame: at every whole frame that the strip shows, recipe and effect agree within
TOLERANCE.
"""

import math
from dataclasses import asdict
from decimal import Decimal
from functools import cache, partial
from itertools import pairwise

import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_

from ...core import keyframes, limits, recipe
from . import annotations, effects, fcurves, inbetween_settings, validation

# Of the largest bar, of fractions of the picture, of degrees; of the larger key's value where that is above 1.
TOLERANCE = 1e-4
_CHANNELS = (("location", 0), ("location", 1), ("rotation", 0), ("scale", 0))


def recipe_of(edit, effect, strip) -> recipe.Recipe:
    """The effect as a recipe, whose frame 1 is the strip's first. EffectError: it cannot be rendered as it stands.

    Left out are regions without strokes or shutter, drawings before the first that has strokes, and keys of widths and
    of options, which are as at the strip's first frame."""
    effects.check_counts(effect)
    if not -limits.MAX_FRAME <= strip.left_handle <= strip.right_handle <= limits.MAX_FRAME:
        sentence = rpt_('strip "{strip}" lies at frames {first} to {last}, where no timeline is')
        raise effects.EffectError(
            sentence.format(strip=strip.name, first=strip.left_handle, last=strip.right_handle - 1)
        )
    curves, path = fcurves.Curves(edit), effect.path_from_id()
    chosen = effects.options(effect, curves, strip.left_handle)
    names = _different([shutter.name for shutter in effect.shutters])
    shutters = [
        _shutter(curves, f"{path}.shutters[{i}]", chosen, shutter, names[i], strip)
        for i, shutter in enumerate(effect.shutters)
    ]
    regions = [
        _region(curves, f"{path}.regions[{i}]", region, effect, strip)
        for i, region in enumerate(effect.regions)
        if region.shutter in names
    ]
    found = recipe.Recipe(
        1,
        shutters=shutters,
        regions=[region for region in regions if region],
        inbetween=inbetween_settings.factor(effect),
        inbetween_method=inbetween_settings.method(effect),
        time=_time(curves, path, effect, strip) if effect.use_source_time else [],
        **{name: value for name, value in asdict(chosen).items() if name != "step"},
    )
    return recipe.parse(recipe.dump(found))


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


def _check_name(item) -> None:
    """EffectError: the name is longer than a recipe has it, from a script or a file of another version."""
    if len(item.name) > limits.MAX_NAME:
        sentence = rpt_("{place}: its name has {count} characters, {most} are the most")
        words = {"place": validation.place(item), "count": len(item.name), "most": limits.MAX_NAME}
        raise effects.EffectError(sentence.format(**words))


def _shutter(curves, path: str, chosen, source, name: str, strip) -> recipe.Shutter:
    @cache
    def bars(frame):
        return effects.checked(source.name, effects.bars_at(curves, path, source, chosen, frame), frame)

    _check_name(source)
    color = tuple(_short(validation.number(source, "color", component)) for component in source.color)
    effects.check_bar_count(source, chosen.window)
    keyed = [curve for k in range(chosen.window) if (curve := curves.find(f"{path}.bars[{k}].weight"))]
    if not keyed:
        return recipe.Shutter(name, color, [_short(v) for v in bars(strip.left_handle)])

    def fits(first, second, frame, share):
        ends = np.array([bars(first), bars(second)])
        if chosen.interpolation == "value":  # every curve has an ease of its own
            apart = np.abs(bars(frame) - keyframes.between_bars(*ends, share, "value")).max()
        else:
            apart = abs(fcurves.progress(keyed, first, second, frame) - share) * np.ptp(ends, axis=0).max()
        return apart <= TOLERANCE * ends.max()

    keys = _keys(fits, lambda *_: True, keyed, fcurves.key_frames(keyed), {}, strip)
    return recipe.Shutter(
        name,
        color,
        keys=[recipe.ShutterKey(_frame(frame, strip), [_short(v) for v in bars(frame)], ease) for frame, ease in keys],
    )


def _time(curves, path: str, effect, strip) -> list[recipe.TimeKey]:
    curve = curves.find(f"{path}.source_time")

    @cache
    def at(frame):
        return curves.value(effect, path, "source_time", frame)

    def fits(first, second, frame, share):
        ends = np.array([at(first), at(second)])
        apart = abs((1 - share) * ends[0] + share * ends[1] - at(frame))
        return bool(apart <= max(TOLERANCE, 2e-6 * np.abs(ends).max()))  # of large numbers: Blender counts in float32

    keys = [(strip.left_handle, "linear")]
    if curve is not None:
        frames = fcurves.key_frames([curve])
        keys = _keys(fits, lambda frame, held: fits(held, held, frame, 0), [curve], frames, {}, strip)
    return [recipe.TimeKey(_frame(frame, strip), _short(at(frame)), ease) for frame, ease in keys]


def _region(curves, path: str, source, effect, strip) -> recipe.Region | None:
    drawings = _drawings(effect, source, strip)
    if not drawings:
        return None
    _check_name(source)
    width = _short(curves.value(source, path, "width", strip.left_handle))
    keyed = [curve for name, index in _CHANNELS if (curve := curves.find(f"{path}.{name}", index))]
    timing = curves.find(f"{path}.location")
    place = cache(partial(_place, curves, path, source))
    frames = set(fcurves.key_frames(keyed))
    # The ease from a drawing to the next is that of the key at its frame.
    eases = fcurves.eases([timing] if timing else [])
    words = {number: eases.get(number, "linear") for number in drawings} if len(drawings) > 1 else {}
    frames.update(words)
    if not frames and tuple(place(strip.left_handle)) != (0, 0, 0, 1):
        frames.add(strip.left_handle)

    def fits(first, second, frame, share):
        ends = np.array([place(first), place(second)])
        apart = np.abs((1 - share) * ends[0] + share * ends[1] - place(frame))
        return bool(np.all(apart <= TOLERANCE * np.maximum(1, np.abs(ends).max(axis=0))))

    def still(frame, held):
        return fits(held, held, frame, 0)

    keys = _keys(fits, still, keyed, sorted(frames), words, strip) if frames or keyed else []
    first = min(drawings)
    redrawn = {number: strokes for number, strokes in drawings.items() if words and number != keys[0][0]}
    return recipe.Region(
        source.shutter,
        source.name,
        validation.word(source, "kind").lower(),
        width,
        drawings[first],
        [_region_key(frame, place(frame), redrawn.get(frame), ease, strip) for frame, ease in keys],
    )


def _region_key(frame: float, place, strokes, ease: str, strip) -> recipe.RegionKey:
    x, y, rotation, scale = place
    return recipe.RegionKey(
        _frame(frame, strip), (_short(x), _short(y)), _short_degrees(rotation), _short(scale), strokes, ease
    )


def _place(curves, path: str, source, frame: float) -> np.ndarray:
    """Location, rotation in degrees and scale of a region at a frame."""
    values = (curves.value(source, path, name, frame) for name in ("location", "rotation", "scale"))
    (x, y), rotation, scale = values
    return np.array([x, y, math.degrees(rotation), scale])


def _drawings(effect, source, strip) -> dict[int, list]:
    """A region's strokes by the timeline frames they were drawn at, from the first that has any."""
    layer, to_picture = annotations.layer_of(effect, source), annotations.image_to_picture(effect, strip)
    if to_picture is None:
        raise effects.EffectError(rpt_('strip "{strip}" is too small to find its scribbles').format(strip=strip.name))
    drawings = sorted(layer.frames, key=lambda drawing: drawing.frame_number) if layer else []
    result = {}
    for drawing in drawings:
        strokes = [
            [tuple(point) for point in np.round(points, 6).tolist()]
            for points in annotations.points(source, drawing, to_picture)
        ]
        if strokes or result:
            result[drawing.frame_number] = strokes
    return result


def _keys(fits, still, keyed, frames: list, words: dict, strip) -> list[tuple[float, str]]:
    """Frames and eases of the keys that give the effect at every whole frame of the strip.

    fits: whether at a frame a share is right between two keys; still: whether a frame shows what another does;
    keyed: the F-curves; frames: where there has to be a key; words: the ease that a key has to have."""
    shown = range(strip.left_handle, strip.right_handle)
    if not frames:
        return [(frame, "linear") for frame in shown]

    def baked(outside, held):
        return [] if all(still(frame, held) for frame in outside) else [(frame, "linear") for frame in outside]

    eases = fcurves.eases(keyed)
    keys = baked([frame for frame in shown if frame < frames[0]], frames[0])
    for first, second in pairwise(frames):
        # Keys may lie a million frames outside.
        between = range(max(math.floor(first) + 1, shown.start), min(math.ceil(second), shown.stop))
        shares = {frame: (frame - first) / (second - first) for frame in between}
        candidates = [words[first]] if first in words else [eases.get(first, "linear"), *keyframes.EASES]
        for word in candidates:
            if all(fits(first, second, frame, keyframes.eased(share, word)) for frame, share in shares.items()):
                keys.append((first, word))
                break
        else:
            keys += [(first, candidates[0]), *((frame, "linear") for frame in shares)]
    last = frames[-1]
    keys.append((last, words.get(last) or eases.get(last, "linear")))
    return keys + baked([frame for frame in shown if frame > last], last)


def _short(value: float) -> float:
    """The shortest decimal that is the same float32."""
    return float(str(np.float32(value)))


def _short_degrees(degrees: float) -> float:
    """The shortest decimal that is the same float32 in radians."""
    wanted = np.float32(math.radians(degrees))
    numbers = (float(f"{degrees:.{digits}g}") for digits in range(1, 17))
    return next((number for number in numbers if np.float32(np.radians(number)) == wanted), degrees)


def _frame(frame: float, strip) -> float:
    """A timeline frame as the recipe counts; in decimals, where 31.1 less 30 is 1.1."""
    return float(Decimal(str(np.float32(frame))) - (strip.left_handle - 1))
