"""Write arrays as pictures: EXR files with any channels, and grey PNG files. Each is complete or not written."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import OpenImageIO

from ..core import atomic_write
from ..core.messages import MediaError
from .files import check_name
from .rendered_pictures import UNKNOWN, why_short

# PNG's compression level, 0 to 9. Mattes take three quarters of the usual time, and get a fourth larger.
_COMPRESSION = 3


def write_exr(path: Path, values: np.ndarray, names: Sequence[str], note: str = "") -> None:
    """Write an EXR file, which appears only when it is complete.

    Args:
        path: The file.
        values: (height, width, channels). float16 is written as half floats; any other type is converted to float32.
        names: The names of the channels, in order.
        note: The text that says which edit the picture belongs to (job_file.note), stored as "Note" in the metadata.
            "": none.

    Raises:
        MediaError: The file cannot be written.
    """
    samples = values if values.dtype == np.float16 else np.asarray(values, np.float32)
    # The date is not the time of writing, so that equal samples make equal files.
    attributes = {"compression": "zip", "DateTime": "1970:01:01 00:00:00", "Note": note}
    _write(path, samples, {name: text for name, text in attributes.items() if text}, names)


def write_grey(path: Path, values: np.ndarray) -> None:
    """Write values (height, width) float32, top row first, as a 16-bit grey PNG. They must be 0 … 1.

    Raises:
        MediaError: It cannot be written.
    """
    _write(path, np.rint(values[..., None] * np.float32(65535)).astype(np.uint16), {})


def write_levels(path: Path, levels: np.ndarray, description: str) -> None:
    """Write grey values (height, width) uint8 as an 8-bit PNG.

    Args:
        path: The file.
        levels: The values, top row first.
        description: A text that is stored as "ImageDescription" in the metadata.

    Raises:
        MediaError: The file cannot be written.
    """
    _write(path, levels[..., None], {"ImageDescription": description, "png:compressionLevel": _COMPRESSION})


def _write(path: Path, samples: np.ndarray, attributes: dict[str, str | int], names: Sequence[str] = ()) -> None:
    """Write samples (height, width, channels) as the picture file that the path's ending names.

    Args:
        path: The file.
        samples: Of any type that the format has.
        attributes: Metadata and the format's settings, by OpenImageIO's names.
        names: Of the channels; empty: the usual ones.

    Raises:
        MediaError: It cannot be written.
    """
    height, width, channels = samples.shape
    kind = {"float16": "half", "float32": "float"}.get(samples.dtype.name, samples.dtype.name)
    spec = OpenImageIO.ImageSpec(width, height, channels, kind)
    spec.channelnames = tuple(names) or spec.channelnames
    for name, value in attributes.items():
        spec[name] = value
    try:
        with atomic_write.writing(path) as part:
            name = check_name(part)
            if (output := OpenImageIO.ImageOutput.create(name)) is None:
                raise MediaError(f"{path}: cannot be written ({OpenImageIO.geterror()})")
            written = output.open(name, spec) and output.write_image(np.ascontiguousarray(samples))
            if not (output.close() and written):
                said, why = output.geterror(), why_short(part.parent)
                raise MediaError(f"{path}: could not be written whole; {said or why if why == UNKNOWN else why}")
    except OSError as error:
        raise MediaError(f"{path}: cannot be written ({error.strerror or error})") from None
