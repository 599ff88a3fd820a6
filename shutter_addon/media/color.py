"""Sources in any color space of Blender. And the code values, to the bit, that Blender's sequencer shows for light
(sRGB, view transform Standard).

Blender converts with OpenColorIO, whose powers are polynomials with about 15 bits. So the same conversions are made
here, as often as Blender makes them.
"""

from functools import cache
from pathlib import Path

import numpy as np
from OpenImageIO import FLOAT, ColorConfig, ImageBuf, ImageBufAlgo

from ..core.frames import light
from ..core.frames.frame_source import FrameSource, SourceWrapper
from ..core.messages import MediaError

SCENE_LINEAR = "Linear Rec.709"  # in Blender's configuration
# OpenImageIO caches files of transforms, but would read a configuration for every picture, which takes milliseconds.
_ENCODE, _DECODE = (str(Path(__file__).with_name(f"srgb_{name}.clf")) for name in ("encode", "decode"))
TRANSFERS = {"sRGB": "srgb", SCENE_LINEAR: "linear", "Non-Color": "linear"}


def in_colorspace(source: FrameSource, name: str, config: str | Path | None) -> FrameSource:
    """Return a source whose samples are in a color space: the source itself, or a ColorSource.

    Args:
        source: the footage
        name: Blender's name of the color space
        config: the OpenColorIO configuration, not needed for sRGB and scene linear

    Raises:
        MediaError: the configuration has no such color space
    """
    if name in TRANSFERS:
        source.transfer = TRANSFERS[name]
        return source
    return ColorSource(source, name, config)


@cache
def keeps(name: str, config: str | Path) -> bool:
    """Return whether converting 8-bit colors to a color space and back changes them by less than a level."""
    if name in TRANSFERS:
        return True
    levels = np.linspace(0, 1, 18, dtype=np.float32)
    colours = np.stack(np.meshgrid(levels, levels, levels), axis=-1).reshape(1, -1, 3)
    there = _converted(ImageBuf(light.to_linear(colours)), SCENE_LINEAR, name, config)
    back = _converted(there, name, SCENE_LINEAR, config)
    if back.has_error:  # the space belongs to another configuration
        return True
    return bool(np.abs(light.to_encoded(np.asarray(back.get_pixels(FLOAT))) - colours).max() < 1 / 255)


def _converted(picture: ImageBuf, space: str, other: str, config: str | Path, associated: bool = False) -> ImageBuf:
    return ImageBufAlgo.colorconvert(picture, space, other, associated, colorconfig=str(config))


class ColorSource(SourceWrapper):
    """A source converted to scene linear float32."""

    transfer, dtype = "linear", np.dtype(np.float32)

    def __init__(self, source: FrameSource, name: str, config: str | Path | None) -> None:
        if config is None or name not in ColorConfig(str(config)).getColorSpaceNames():
            raise MediaError(f"{source.path.name}: unknown colour space {name}")
        super().__init__(source)
        self._name, self._config = name, str(config)
        self.options = {**source.options, "colorspace": name}

    def read(self, index: int) -> np.ndarray:
        """Return the source's frame in scene linear light; raise MediaError if it cannot be converted."""
        samples = self._source.read(index)
        scale = np.iinfo(samples.dtype).max if samples.dtype.kind == "u" else 1
        picture = ImageBuf(samples.astype(np.float32) / np.float32(scale))
        associated = self._source.alpha == "premultiplied"
        linear = _converted(picture, self._name, SCENE_LINEAR, self._config, associated)
        converted = linear.get_pixels(FLOAT)
        if linear.has_error or converted is None:
            raise MediaError(f"{self._source.path.name}: no conversion from {self._name} ({linear.geterror()})")
        return converted


def shown(light: np.ndarray) -> np.ndarray:
    """Return the display's code values of light float32 of any shape.

    Raises:
        RuntimeError: this OpenImageIO cannot convert it
    """
    return _transformed(light, (_ENCODE,))


def blended(light: np.ndarray) -> np.ndarray:
    """Return `shown` for light that the sequencer blended: it converts to its own colors and back first."""
    return _transformed(light, (_ENCODE, _DECODE, _ENCODE))


def _transformed(light: np.ndarray, paths: tuple[str, ...]) -> np.ndarray:
    samples = np.zeros(-(-light.size // 3) * 3, np.float32)
    samples[: light.size] = light.ravel()
    buffer = ImageBuf(samples.reshape(1, -1, 3))
    for path in paths:
        buffer = ImageBufAlgo.ociofiletransform(buffer, path, unpremult=False)
        if buffer.has_error:
            raise RuntimeError(buffer.geterror())
    return np.asarray(buffer.get_pixels(FLOAT)).ravel()[: light.size].reshape(light.shape)
