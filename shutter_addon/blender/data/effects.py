"""The effect at a frame, from Blender's data to core's; and recipes into Blender's data."""

import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_

from ...core import keyframes, limits, recipe, scribbles, shutters
from . import fcurves, validation
from .annotations import image_to_picture, layer_of, picture_size, points
from .validation import EffectError

OPTIONS = ("position", "interpolation", "light", "exposure", "edges")


def instant(edit, effect, strip, frame: float) -> recipe.FrameState:
    """The effect at a timeline frame of its edit; strip: the effect strip that shows it. EffectError: no shutter
    at all, one that never opens, or a value that no effect can have."""
    check_counts(effect)
    curves, path = fcurves.Curves(edit), effect.path_from_id()
    chosen = options(effect, curves, frame)
    bars = [
        checked(shutter.name, bars_at(curves, f"{path}.shutters[{i}]", shutter, chosen, frame), frame)
        for i, shutter in enumerate(effect.shutters)
    ]
    return recipe.FrameState(chosen, np.stack(bars), tuple(_shapes_at(edit, effect, strip, curves, frame)))


def check_counts(effect) -> None:
    """EffectError: there are no shutters, or more of anything than an effect has."""
    if not effect.shutters:
        raise EffectError(rpt_('"{effect}" has no shutter').format(effect=effect.name))
    for sentence, items, most in (
        (rpt_("{place}: {count} shutters, {most} are the most"), effect.shutters, limits.MAX_SHUTTERS),
        (rpt_("{place}: {count} regions, {most} are the most"), effect.regions, limits.MAX_REGIONS),
    ):
        if len(items) > most:
            raise EffectError(sentence.format(place=validation.place(effect), count=len(items), most=most))


def source_time(edit, effect, frame: float) -> tuple[float, bool]:
    """The source frame that an effect's source time tells for a timeline frame, 1 is the first; and whether it runs
    backward from there, or where it stands still, whether it came to that backward."""
    curves, path = fcurves.Curves(edit), effect.path_from_id()
    time, later = (curves.value(effect, path, "source_time", frame + apart) for apart in (0, 0.5))
    if later == time and (curve := curves.find(f"{path}.source_time")):
        return time, _came_backward(curve, frame)
    return time, later < time


def _came_backward(curve, frame: float) -> bool:
    """Whether a curve fell towards the last of its keys up to a frame that it did not stand still before. A jump is no
    way."""
    for key in reversed(fcurves.key_frames([curve])):
        if key <= frame:
            earlier, later = curve.evaluate(key - 0.5), curve.evaluate(key - 0.25)
            if earlier != later:
                return later < earlier
    return False


def checked(name: str, bars: np.ndarray, frame: float) -> np.ndarray:
    """The bars of a shutter at a frame. EffectError: no picture can be made of them."""
    try:
        shutters.check_bars(bars)
    except shutters.ShutterError as error:
        sentence = rpt_('shutter "{name}" at frame {frame}: {fault}')
        raise EffectError(sentence.format(name=name, frame=f"{frame:g}", fault=rpt_(str(error)))) from None
    return bars


def options(effect, curves=None, frame: float = 0.0) -> recipe.Options:
    """The effect's options in the recipe's words: at a frame of the edit, given its curves; otherwise as they stand.
    EffectError: one that no effect can have."""
    path = effect.path_from_id()

    def at(name):
        curve = curves.find(f"{path}.{name}") if curves else None
        value = None if curve is None else curve.evaluate(frame)
        if effect.bl_rna.properties[name].type == "ENUM":
            return validation.word(effect, name, value)
        return getattr(effect, name) if value is None else value >= 0.5

    words = {name: at(name).lower() for name in OPTIONS}
    return recipe.Options(
        validation.number(effect, "window"),
        **words,
        aggregate=int(at("aggregate")),
        border=at("border"),
        stop_at_cuts=at("stop_at_cuts"),
        step=int(validation.word(effect, "inbetween")),
    )


def bars_at(curves, path: str, shutter, chosen: recipe.Options, frame: float) -> np.ndarray:
    """Bars (window,) of a shutter at a frame; between keys by displacement with the ease of the F-curves, or as the
    F-curves are, if that is the interpolation. path: the shutter's, from the scene; chosen: the effect's options.
    EffectError: they are not as many, or one cannot be."""
    window = chosen.window
    check_bar_count(shutter, window)
    stored = np.array([bar.weight for bar in shutter.bars])
    keyed = {i: curve for i in range(window) if (curve := curves.find(f"{path}.bars[{i}].weight"))}

    def at(time):
        bars = stored.copy()
        # No bar is below 0, a curve may be. In this order "not a number" stays what it is.
        bars[list(keyed)] = [min(max(curve.evaluate(time), 0.0), limits.MAX_BAR) for curve in keyed.values()]
        validation.check(shutter.bars, "weight", bars)
        return bars

    if not keyed:
        return at(frame)
    frames = curves.key_frames(path, keyed.values())
    if not frames:  # curves of samples or of modifiers alone
        return at(frame)
    before, after, _ = keyframes.span(frames, frame)
    if before == after:
        return at(frames[before])
    first, second = at(frames[before]), at(frames[after])
    # The way to a closed shutter is no displacement.
    if chosen.interpolation == "value" or not (first.any() and second.any()):
        return at(frame)
    return keyframes.between_bars(first, second, fcurves.progress(keyed.values(), frames[before], frames[after], frame))


def check_bar_count(shutter, window: int) -> None:
    """EffectError: a shutter has not as many bars as the window is long."""
    if len(shutter.bars) != window:
        sentence = rpt_("{place}: {count} bars, the window is {window}")
        raise EffectError(sentence.format(place=validation.place(shutter), count=len(shutter.bars), window=window))


def drawn_regions(effect) -> list:
    """The regions that have a shutter, in order: those that an instant has shapes of."""
    names = {shutter.name for shutter in effect.shutters}
    return [region for region in effect.regions if region.shutter in names]


def _shapes_at(edit, effect, strip, curves, frame: float):
    names = [shutter.name for shutter in effect.shutters]
    width, height = picture_size(effect)
    room = limits.MAX_POINTS
    for i, region in enumerate(effect.regions):
        path = f"{effect.path_from_id()}.regions[{i}]"
        if region.shutter not in names:
            continue
        strokes = strokes_at(edit, effect, strip, i, frame, curves)
        room -= sum(map(len, strokes))
        if room < 0:
            sentence = rpt_("{place}: more than {most} points with those before it")
            raise EffectError(sentence.format(place=validation.place(region), most=limits.MAX_POINTS))
        location = curves.value(region, path, "location", frame)
        rotation = np.degrees(curves.value(region, path, "rotation", frame))
        scale = curves.value(region, path, "scale", frame)
        yield scribbles.Shape(
            names.index(region.shutter),
            validation.word(region, "kind").lower(),
            curves.value(region, path, "width", frame),
            scribbles.transform(strokes, location, rotation, scale, width / height),
        )


def strokes_at(edit, effect, strip, index: int, frame: float, curves=None) -> list[np.ndarray]:
    """A region's strokes (n, 2) on the picture at a frame, not moved yet; between two drawings with the ease of its
    location's keys. None where nobody sees the strip. EffectError: they lie nowhere."""
    region, (width, height) = effect.regions[index], picture_size(effect)
    layer, to_picture = layer_of(effect, region), image_to_picture(effect, strip)
    if layer is None or not layer.frames or to_picture is None:
        return []
    drawings = sorted(layer.frames, key=lambda drawing: drawing.frame_number)
    numbers = [drawing.frame_number for drawing in drawings]
    before, after, u = keyframes.span(numbers, frame)
    timing = (curves or fcurves.Curves(edit)).find(f"{effect.path_from_id()}.regions[{index}].location")
    u = keyframes.eased(u, fcurves.ease_at(timing, numbers[before]))
    first, second = (points(region, drawings[i], to_picture) for i in (before, after))
    return scribbles.between_strokes(first, second, u, width / height)
