"""The code values that light is shown as by Blender's sequencer, to the bit: sRGB, view transform Standard.

OpenColorIO, which Blender asks as well, raises to powers by polynomials of some 15 bits. So its own rounding counts, as
often as Blender asks it.
"""

from pathlib import Path

import numpy as np
import OpenImageIO

# A configuration would be read anew for every picture, which takes milliseconds; files of transforms are kept.
_ENCODE, _DECODE = (str(Path(__file__).with_name(f"srgb_{name}.clf")) for name in ("encode", "decode"))


def shown(light: np.ndarray) -> np.ndarray:
    """The code values of light float32 of any shape, as the display has it. RuntimeError: this OpenImageIO cannot make
    them."""
    return _transformed(light, (_ENCODE,))


def blended(light: np.ndarray) -> np.ndarray:
    """As `shown`, of light that was blended over something: to the sequencer's colours, and back, first."""
    return _transformed(light, (_ENCODE, _DECODE, _ENCODE))


def _transformed(light: np.ndarray, paths: tuple[str, ...]) -> np.ndarray:
    samples = np.zeros(-(-light.size // 3) * 3, np.float32)
    samples[: light.size] = light.ravel()
    buffer = OpenImageIO.ImageBuf(samples.reshape(1, -1, 3))
    for path in paths:
        buffer = OpenImageIO.ImageBufAlgo.ociofiletransform(buffer, path, unpremult=False)
        if buffer.has_error:
            raise RuntimeError(buffer.geterror())
    return np.asarray(buffer.get_pixels(OpenImageIO.FLOAT)).ravel()[: light.size].reshape(light.shape)
