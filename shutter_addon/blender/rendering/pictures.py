"""Make the picture of an effect strip at a timeline frame, as the engine gives it to Blender."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from pathlib import Path

import numpy as np
import OpenImageIO
from bpy.app.translations import pgettext_n as n_
from bpy.app.translations import pgettext_rpt as rpt_

from ...compute.devices.device import MEGABYTE
from ...compute.renderer import Renderer
from ...compute.request import Request
from ...core import stopping
from ...core.pixels.matte_grid import block_means
from ...media import color
from ...media.image_writing import write_exr
from ..data import consistency
from ..data.snapshot import Snapshot
from . import render_job, render_settings
from .effect_source import FULL, Detail
from .session import RenderContext

SLOW_DECODING = n_("a second Blender decodes movies, which is slow: install the zip that is made for your system")


def picture(context: RenderContext, snapshot: Snapshot, frame: float, detail: Detail = FULL) -> np.ndarray:
    """Return the picture of an effect strip at a timeline frame, (H, W, 4), top row first.

    It is scene-linear float32 with premultiplied alpha, or 8-bit display levels if the context asks for them.
    This also writes the file of --weights, if that is wanted, and gives warnings (`shortages`) to context.say, once.

    Args:
        context: The session that makes the picture, and the form that is wanted (RenderContext).

    Raises:
        effect_source.FAULTS: The picture cannot be made, or the file of --weights cannot be written.
        StoppedError: It is no longer wanted.
    """
    stopping.check()
    session, request = context.session, context.request(snapshot, frame, detail)
    renderer = context.renderer(request)  # opened again, if the window has closed it meanwhile
    if (weights := render_job.job.weights) is not None:
        place = weights / f"{round(frame - snapshot.first + 1):04d}.exr"
        _write_weights(place, snapshot, frame, session.run(_weights, renderer, request))
    if renderer.source.by_blender:
        render_job.say_once(rpt_(SLOW_DECODING), context.say)
    made = session.picture(request)
    for sentence in shortages(renderer, snapshot, request):
        render_job.say_once(sentence, context.say)
    return made


def _weights(renderer: Renderer, request: Request) -> list[np.ndarray]:
    """Return the pictures for the option --weights: the share of each shutter, then the matte of each visible layer.

    Each is (h, w), with one pixel for each block of Options.aggregate × Options.aggregate pixels of the picture.
    """
    block = request.state.options.aggregate
    mattes = [block_means(matte, block) for matte in renderer.layer_mattes(request)]
    return [*renderer.coefficients(request), *mattes]


def _write_weights(place: Path, snapshot: Snapshot, frame: float, weights: list[np.ndarray]) -> None:
    """Write the pictures for the option --weights to an EXR file.

    It has a channel for each shutter and, after these, for each layer, with the name of the shutter or region. A name
    that is taken gets a number. A layer that is invisible at this frame is 0 everywhere.

    Args:
        place: The file.
        weights: What _weights returned.
    """
    effect = snapshot.effect
    names = [shutter.name for shutter in effect.shutters]
    there, shown, channels = effect.layers_at(frame), iter(weights[len(names) :]), weights[: len(names)]
    for region in [region for region in effect.regions if region.layer]:
        names.append(consistency.unique(region.name or "Region", names))
        channels.append(next(shown) if region in there else np.zeros_like(weights[0]))
    write_exr(place, np.stack(channels, axis=-1), names)


def shortages(renderer: Renderer, snapshot: Snapshot, request: Request) -> Iterator[str]:
    """Yield warnings about a picture: those of `unread`, and that too little GPU memory makes it slow."""
    yield from unread(snapshot, request)
    if renderer.is_short:
        source = renderer.source
        words = {"width": source.width, "height": source.height, "frames": request.state.options.window}
        words["limit"] = render_settings.memory().limit // MEGABYTE
        sentence = rpt_(
            "{limit} MB of GPU memory are too little for {frames} frames of {width}×{height}: every picture uploads all"
            " of them, which is slow"
        )
        yield sentence.format(**words)


def unread(snapshot: Snapshot, request: Request) -> Iterator[str]:
    """Yield warnings about retiming keys that cannot be read, and about blending that changes colors in Blender."""
    layers = request.state.layers.mattes if request.state.layers else ()
    contents = [matte.content for matte in chain(request.state.mattes, *layers) if matte is not None]
    for timing in (snapshot.timing, *(getattr(content, "timing", None) for content in contents)):
        if timing is not None and timing.keys and not timing.is_known:
            sentence = rpt_(
                'strip "{strip}": its retiming keys cannot be read in this version of Blender, so it is shown at an'
                " even speed; keys of Source Time can take their place"
            )
            yield sentence.format(strip=timing.name)
    if snapshot.blended and not color.keeps(snapshot.blended, snapshot.source.options["config"]):
        sentence = rpt_(
            'In the color space "{space}" Blender\'s sequencer changes colors where it lays strips over others: set the'
            " blend mode of the Shutter strip to Replace"
        )
        yield sentence.format(space=snapshot.blended)


def resized(picture: np.ndarray, width: int, height: int, divisor: int = 1) -> np.ndarray:
    """Return a picture (H, W, 4) at the size that Blender asks for, which is smaller with a resolution below 100 %.

    Args:
        divisor: How many times smaller than the source the picture was composed. Its pixels are repeated that often in
            both directions before it is scaled.
    """
    if divisor > 1:
        picture = picture.repeat(divisor, axis=0).repeat(divisor, axis=1)[:height, :width]
    if picture.shape[:2] == (height, width):
        return picture
    whole = OpenImageIO.ImageBuf(np.ascontiguousarray(picture))
    small = OpenImageIO.ImageBufAlgo.resize(whole, roi=OpenImageIO.ROI(0, width, 0, height))
    return np.asarray(small.get_pixels(OpenImageIO.FLOAT)).reshape(height, width, 4)
