"""Pictures of effect scenes: one renderer each, all on one device, kept from frame to frame."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import OpenImageIO

from ..compute.errors import NoDeviceError
from ..compute.renderer import Renderer, open_compositor
from ..media import MediaError
from ..media.exr import write_exr
from . import effects, sources, strips, timing

FAULTS = (effects.EffectError, MediaError, NoDeviceError, MemoryError)

device = "auto"
weights_folder: Path | None = None

# Blender renders on the main thread or on another one, and in a window the main one has Blender's own GL context, next
# to which another one cannot always be current (see GLDevice): the device has a thread to itself.
_thread = ThreadPoolExecutor(1, "Virtual Shutter")
_compositor = None
_renderers: dict = {}


def picture(scene, scene_frame: float, say=print) -> np.ndarray:
    """The picture (H, W, 4) float32 of an effect scene at one of its frames: scene-linear, premultiplied, top row
    first. One of FAULTS: there is none, in one sentence. say: called with a sentence when the device is a lesser one.
    """
    edit, effect, strip = strips.find_edit(scene)
    frame = strips.timeline_frame(strip, scene_frame)
    source = strips.source_of(edit, effect, strip)
    renderer = _renderer(scene, source, say)
    moment = effects.instant(edit, effect, strip, frame)
    if weights_folder is not None:
        coefficients = _on_thread(renderer.coefficients, moment)
        _write_weights(coefficients, [s.name for s in effect.shutters], frame - strip.left_handle + 1)
    index = timing.source_frame(source, frame, renderer.source, edit.render.fps / edit.render.fps_base)
    return _on_thread(renderer.picture, index, moment, -1 if source.use_reverse_frames else 1)


def _on_thread(function, *arguments):
    return _thread.submit(function, *arguments).result()


def _renderer(scene, source_strip, say) -> Renderer:
    global _compositor
    if _compositor is None:
        _compositor, message = _on_thread(open_compositor, device)
        if message:
            say(message)
    key = sources.media_key(source_strip)
    old_key, renderer = _renderers.get(scene.session_uid, (None, None))
    if old_key != key:
        if renderer is not None:
            _on_thread(renderer.close)
        renderer = Renderer(_compositor, sources.open_media(source_strip))
        _renderers[scene.session_uid] = key, renderer
    return renderer


def forget(*_) -> None:
    """Closes all sources and frees the device: when a file is loaded, and when the extension goes."""
    global _compositor
    for _key, renderer in _renderers.values():
        _on_thread(renderer.close)
    _renderers.clear()
    if _compositor is not None:
        _on_thread(_compositor.release)
        _compositor = None


def resized(picture: np.ndarray, width: int, height: int) -> np.ndarray:
    """The picture at the size the sequencer asks for (it renders previews smaller)."""
    if picture.shape[:2] == (height, width):
        return picture
    small = OpenImageIO.ImageBufAlgo.resize(
        OpenImageIO.ImageBuf(np.ascontiguousarray(picture)), roi=OpenImageIO.ROI(0, width, 0, height)
    )
    return small.get_pixels(OpenImageIO.FLOAT).reshape(height, width, 4)


def _write_weights(coefficients: np.ndarray, names: list[str], frame: float) -> None:
    """Coefficients (N, h, w) as a float EXR, a channel per shutter."""
    write_exr(weights_folder / f"{round(frame):04d}.exr", np.moveaxis(coefficients, 0, -1), names)
