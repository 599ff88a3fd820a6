"""What kind of file footage is in, for a report of an error, which must not name it."""

from pathlib import Path

from . import decoding_child
from .errors import MediaError


def file_kind(path: Path, stream: int = 0) -> str:
    """Format, codec and samples of a movie or a picture, as the libraries call them. MediaError: it cannot be read."""
    try:
        return _image_kind(path) or _movie_kind(path, stream)
    except ImportError:
        return "a movie, read by a second Blender" if decoding_child.is_lent() else "a movie, which takes PyAV to read"
    except (OSError, ValueError, IndexError, RuntimeError):  # av.error.FFmpegError is one of them, whatever it is
        raise MediaError("the footage cannot be read") from None


def _image_kind(path: Path) -> str | None:
    import OpenImageIO

    from .sequence import IMAGE_SUFFIXES

    if path.suffix.lower() not in IMAGE_SUFFIXES:
        return None
    if (image := OpenImageIO.ImageInput.open(str(path))) is None:
        OpenImageIO.geterror()  # which is of this file, and nobody else's
        raise MediaError("the footage cannot be read")
    spec = image.spec()
    kind = f"{image.format_name()}, {spec.nchannels} channels of {spec.format}"
    image.close()
    return kind


def _movie_kind(path: Path, stream: int) -> str:
    import av

    with av.open(str(path)) as container:
        video = container.streams.video[stream]
        codec = video.codec_context
        profile = f" ({codec.profile})" if codec.profile else ""
        return f"{container.format.name}, {codec.name}{profile}, {codec.pix_fmt}"
