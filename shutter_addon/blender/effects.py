"""The effect at a frame, from Blender's data to core's; and recipes into Blender's data."""

import bpy
import numpy as np
from bpy.app.translations import pgettext_data as data_
from bpy.app.translations import pgettext_rpt as rpt_

from ..core import keyframes, limits, recipe, scribbles, shutters
from . import animation, geometry, values
from .values import EffectError

# Pixels of a strip's side on the image, below which nobody sees where its scribbles are.
_SMALLEST = 4
OPTIONS = ("position", "interpolation", "light", "exposure", "edges")


def instant(edit, effect, strip, frame: float) -> recipe.FrameState:
    """The effect at a timeline frame of its edit; strip: the effect strip that shows it. EffectError: no shutter
    at all, one that never opens, or a value that no effect can have."""
    check_counts(effect)
    curves, path = animation.Curves(edit), effect.path_from_id()
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
            raise EffectError(sentence.format(place=values.place(effect), count=len(items), most=most))


def source_time(edit, effect, frame: float) -> tuple[float, bool]:
    """The source frame that an effect's source time tells for a timeline frame, 1 is the first; and whether it runs
    backward from there, or where it stands still, whether it came to that backward."""
    curves, path = animation.Curves(edit), effect.path_from_id()
    time, later = (curves.value(effect, path, "source_time", frame + apart) for apart in (0, 0.5))
    if later == time and (curve := curves.find(f"{path}.source_time")):
        return time, _came_backward(curve, frame)
    return time, later < time


def _came_backward(curve, frame: float) -> bool:
    """Whether a curve fell towards the last of its keys up to a frame that it did not stand still before. A jump is no
    way."""
    for key in reversed(animation.key_frames([curve])):
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
            return values.word(effect, name, value)
        return getattr(effect, name) if value is None else value >= 0.5

    words = {name: at(name).lower() for name in OPTIONS}
    return recipe.Options(
        values.number(effect, "window"),
        **words,
        aggregate=int(at("aggregate")),
        border=at("border"),
        stop_at_cuts=at("stop_at_cuts"),
        step=int(values.word(effect, "inbetween")),
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
        values.check(shutter.bars, "weight", bars)
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
    return keyframes.between_bars(
        first, second, animation.progress(keyed.values(), frames[before], frames[after], frame)
    )


def check_bar_count(shutter, window: int) -> None:
    """EffectError: a shutter has not as many bars as the window is long."""
    if len(shutter.bars) != window:
        sentence = rpt_("{place}: {count} bars, the window is {window}")
        raise EffectError(sentence.format(place=values.place(shutter), count=len(shutter.bars), window=window))


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
            raise EffectError(sentence.format(place=values.place(region), most=limits.MAX_POINTS))
        location = curves.value(region, path, "location", frame)
        rotation = np.degrees(curves.value(region, path, "rotation", frame))
        scale = curves.value(region, path, "scale", frame)
        yield scribbles.Shape(
            names.index(region.shutter),
            values.word(region, "kind").lower(),
            curves.value(region, path, "width", frame),
            scribbles.transform(strokes, location, rotation, scale, width / height),
        )


def picture_size(effect) -> tuple[int, int]:
    """Width and height of the effect's picture, which are its source's."""
    return effect.scene.render.resolution_x, effect.scene.render.resolution_y


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
    timing = (curves or animation.Curves(edit)).find(f"{effect.path_from_id()}.regions[{index}].location")
    u = keyframes.eased(u, animation.ease_at(timing, numbers[before]))
    first, second = (points(region, drawings[i], to_picture) for i in (before, after))
    return scribbles.between_strokes(first, second, u, width / height)


def image_to_picture(effect, strip) -> np.ndarray | None:
    """Matrix (3, 3) from the sequencer's image to fractions of the strip's picture; None where the strip is scaled to
    nothing that can be seen. EffectError: its transform is none."""
    matrix = geometry.picture_to_image(strip, picture_size(effect))
    if not np.isfinite(matrix).all():
        raise EffectError(rpt_('strip "{strip}": a number of its transform is not finite').format(strip=strip.name))
    if np.hypot(*matrix[:2, :2]).min() < _SMALLEST:
        return None
    return np.linalg.inv(matrix)


def points(region, drawing, to_picture) -> list[np.ndarray]:
    """The strokes (n, 2) of an annotation's frame that belongs to a region, on the picture. EffectError: they lie too
    far from it."""
    result = []
    for stroke in drawing.strokes:
        flat = np.empty(len(stroke.points) * 3, dtype=np.float32)
        stroke.points.foreach_get("co", flat)
        if len(flat):
            result.append(geometry.mapped(to_picture, flat.reshape(-1, 3)[:, :2].astype(np.float64)))
            if not (np.abs(result[-1]) <= limits.MAX_DISTANCE).all():
                raise EffectError(
                    rpt_("{place}: a point of its strokes is nowhere near the picture").format(
                        place=values.place(region)
                    )
                )
    return result


def apply(edit, effect, strip, source: recipe.Recipe) -> None:
    """Replaces the effect's data and keys by a recipe, whose frame 1 is the strip's first. EffectError: its keys cannot
    lie there; nothing has changed."""
    first = strip.left_handle - 1
    _check_keys(source, first)
    clear(edit, effect)
    # Bars per frame before the factor, which else would change the window.
    effect.bars_per_frame, effect.inbetween = source.inbetween, str(source.inbetween)
    effect.inbetween_method = source.inbetween_method.upper()
    effect.window = source.window
    for name in OPTIONS:
        setattr(effect, name, getattr(source, name).upper())
    effect.aggregate, effect.border = str(source.aggregate), source.border
    effect.stop_at_cuts = source.stop_at_cuts
    path = effect.path_from_id()
    effect.use_source_time = bool(source.time)
    if source.time:
        keys = [(key.frame + first, key.value, key.ease) for key in source.time]
        effect.source_time = source.time[0].value
        animation.set_keys(edit, f"{path}.source_time", 0, keys, group=effect.name)
    for i, shutter in enumerate(source.shutters):
        _add_shutter(edit, effect, f"{path}.shutters[{i}]", shutter, first)
    colors = {shutter.name: shutter.color for shutter in source.shutters}
    for i, region in enumerate(source.regions):
        _add_region(edit, effect, strip, f"{path}.regions[{i}]", region, colors[region.shutter], first)


def _check_keys(source: recipe.Recipe, first: float) -> None:
    """EffectError: keys would lie beyond Blender's timeline, or on the same frame, as it counts in float32."""
    for keys in (source.time, *(part.keys for part in (*source.shutters, *source.regions))):
        frames = np.array([key.frame + first for key in keys], dtype=np.float32)
        if (wrong := np.flatnonzero(np.abs(frames) > limits.MAX_FRAME)).size:
            sentence = rpt_("frame {frame} of the recipe: a key cannot lie beyond Blender's timeline")
            raise EffectError(sentence.format(frame=f"{keys[wrong[0]].frame:.10g}"))
        if (wrong := np.flatnonzero(np.diff(frames) == 0)).size:
            sentence = rpt_("frame {frame} of the recipe: so late on the timeline, the next key is on the same frame")
            raise EffectError(sentence.format(frame=f"{keys[wrong[0]].frame:.10g}"))


def clear(edit, effect) -> None:
    """Removes the effect's shutters, regions, scribbles and keys."""
    animation.remove_curves(edit, effect.path_from_id() + ".")
    effect.shutters.clear()
    effect.regions.clear()
    effect.active_shutter = effect.active_region = 0
    if effect.scene.annotation is not None:
        for layer in list(effect.scene.annotation.layers):
            effect.scene.annotation.layers.remove(layer)


def _add_shutter(edit, effect, path: str, source: recipe.Shutter, first: float) -> None:
    shutter = effect.shutters.add()
    shutter.name, shutter.color = source.name, source.color
    for weight in source.bars if source.bars is not None else source.keys[0].bars:
        shutter.bars.add().weight = weight
    if source.keys:
        for k in range(len(shutter.bars)):
            keys = [(key.frame + first, key.bars[k], key.ease) for key in source.keys]
            animation.set_keys(edit, f"{path}.bars[{k}].weight", 0, keys)


def _add_region(edit, effect, strip, path: str, source: recipe.Region, color, first: float) -> None:
    region = effect.regions.add()
    region.name, region.shutter, region.width = source.name, source.shutter, source.width
    region.kind = source.kind.upper()
    region.layer = _draw(effect, strip, source, color, first)
    if not source.keys:
        return
    start = source.keys[0]
    region.location, region.rotation, region.scale = start.location, np.radians(start.rotation), start.scale
    channels = {
        ("location", 0): lambda key: key.location[0],
        ("location", 1): lambda key: key.location[1],
        ("rotation", 0): lambda key: np.radians(key.rotation),
        ("scale", 0): lambda key: key.scale,
    }
    for (name, index), value in channels.items():
        keys = [(key.frame + first, value(key), key.ease) for key in source.keys]
        animation.set_keys(edit, f"{path}.{name}", index, keys)


def layer_of(effect, region):
    """The annotation layer of a region, or None."""
    annotation = effect.scene and effect.scene.annotation
    return annotation.layers.get(region.layer) if annotation else None


def annotation(effect):
    """What the effect's scribbles are drawn on; made where somebody has removed it."""
    if effect.scene.annotation is None:
        effect.scene.annotation = bpy.data.annotations.new(data_("Scribbles {effect}").format(effect=effect.name))
    return effect.scene.annotation


def _draw(effect, strip, source: recipe.Region, color, first: float) -> str:
    """Draws a region's strokes on an annotation layer of its own, a frame per drawing; the layer's name."""
    layer = annotation(effect).layers.new(source.name or data_("Region"), set_active=False)
    layer.color = color
    to_image = geometry.picture_to_image(strip, picture_size(effect))
    for key, strokes in source.drawings():
        drawing = layer.frames.new(int((key.frame if key else 1) + first))
        for points in strokes:
            stroke = drawing.strokes.new()
            stroke.display_mode = "2DSPACE"
            stroke.points.add(len(points))
            image = np.zeros((len(points), 3), dtype=np.float32)
            image[:, :2] = geometry.mapped(to_image, np.asarray(points))
            stroke.points.foreach_set("co", image.ravel())
    return layer.info
