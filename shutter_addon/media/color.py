"""Footage in any color space of Blender, and the code values that Blender's sequencer shows for light, to the bit.

The latter are for sRGB displays and the view transform Standard. Blender converts with OpenColorIO, whose powers are
polynomials with about 15 bits. So the same conversions are made here, as often as Blender makes them.
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
    """Interpret a source's samples in a color space.

    Args:
        source: The footage.
        name: Blender's name of the color space.
        config: The OpenColorIO configuration; not needed for sRGB, Linear Rec.709 and Non-Color.

    Returns:
        For these three, the source itself with its `transfer` set. Otherwise a ColorSource that converts its frames.

    Raises:
        MediaError: There is no configuration, or it has no such color space.
    """
    if name in TRANSFERS:
        source.transfer = TRANSFERS[name]
        return source
    return ColorSource(source, name, config)


@cache
def keeps(name: str, config: str | Path) -> bool:
    """Return whether 8-bit sRGB colors survive a conversion to a color space and back, with an error below 1 / 255.

    Blender's sequencer converts strips like this to blend them, which may change colors. If the configuration cannot
    convert to the color space and back, return True.

    Args:
        name: Blender's name of the color space.
        config: The OpenColorIO configuration.
    """
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
    """A source whose frames are converted from a color space to scene-linear float32.

    Arguments and errors as for `in_colorspace`.
    """

    transfer, dtype = "linear", np.dtype(np.float32)

    def __init__(self, source: FrameSource, name: str, config: str | Path | None) -> None:
        if config is None or name not in ColorConfig(str(config)).getColorSpaceNames():
            raise MediaError(f"{source.path.name}: unknown colour space {name}")
        super().__init__(source)
        self._name, self._config = name, str(config)
        self.options = {**source.options, "colorspace": name}

    def read(self, index: int) -> np.ndarray:
        """Return the source's frame (height, width, 4) in scene-linear light.

        Raises:
            MediaError: It cannot be read or converted.
        """
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
    """Encode scene-linear light as code values for an sRGB display, as Blender does; both float32 of any shape.

    Raises:
        RuntimeError: This version of OpenImageIO cannot convert it.
    """
    return _transformed(light, (_ENCODE,))


def blended(light: np.ndarray) -> np.ndarray:
    """Encode light like `shown`, but with the rounding of strips that Blender's sequencer blends.

    The sequencer encodes their light, decodes it and encodes it again.
    """
    return _transformed(light, (_ENCODE, _DECODE, _ENCODE))


def _transformed(light: np.ndarray, paths: tuple[str, ...]) -> np.ndarray:
    """Convert values, float32 of any shape, by OpenColorIO with the transform files in `paths`, one after another."""
    samples = np.zeros(-(-light.size // 3) * 3, np.float32)
    samples[: light.size] = light.ravel()
    buffer = ImageBuf(samples.reshape(1, -1, 3))
    for path in paths:
        buffer = ImageBufAlgo.ociofiletransform(buffer, path, unpremult=False)
        if buffer.has_error:
            raise RuntimeError(buffer.geterror())
    return np.asarray(buffer.get_pixels(FLOAT)).ravel()[: light.size].reshape(light.shape)
