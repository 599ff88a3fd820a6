"""Float EXR files with channels of any name."""

from pathlib import Path

import numpy as np
import OpenImageIO

from ..core import atomic_write
from .errors import MediaError
from .files import check_name


def write_exr(path: Path, values: np.ndarray, names: list[str]) -> None:
    """Writes values (height, width, channels) float32 with these channel names, whole or not at all.

    MediaError: it cannot be written."""
    height, width, channels = values.shape
    spec = OpenImageIO.ImageSpec(width, height, channels, OpenImageIO.FLOAT)
    spec.channelnames = tuple(names)
    spec["compression"] = "zip"
    spec["DateTime"] = "1970:01:01 00:00:00"  # else the time of writing: equal samples are equal files
    try:
        with atomic_write.writing(path) as part:
            name = check_name(part)
            output = OpenImageIO.ImageOutput.create(name)
            written = output.open(name, spec) and output.write_image(np.ascontiguousarray(values, np.float32))
            if not (output.close() and written):
                raise MediaError(f"{path}: {output.geterror() or 'cannot be written'}")
    except OSError as error:
        raise MediaError(f"{path}: cannot be written ({error.strerror or error})") from None
