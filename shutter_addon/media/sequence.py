"""Image sequences and single images: finding their files, and reading the samples in them."""

import itertools
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from functools import lru_cache, partial
from pathlib import Path

import numpy as np
from OpenImageIO import ImageInput, ImageSpec, geterror

from ..core.frames.frame_source import FrameSource
from ..core.messages import MediaError
from .files import FOREIGN, check_file, check_index, check_name, check_size, stamp

# The channels that every picture has, whatever their names in the file.
CHANNELS = {"luminance": slice(0, 3)}
CHANNELS |= {name: slice(k, k + 1) for k, name in enumerate(("red", "green", "blue", "alpha"))}
# In Blender, these are scene linear, even logarithmic DPX. All other formats are sRGB, even float TIFF.
LINEAR_SUFFIXES = frozenset({".exr", ".hdr", ".rgbe", ".dpx", ".cin"})
OTHER_SUFFIXES = ".png .jpg .jpeg .jpe .tif .tiff .tga .bmp .webp .jp2 .j2k .j2c .psd .sgi .rgb .rgba .bw"
IMAGE_SUFFIXES = LINEAR_SUFFIXES.union(OTHER_SUFFIXES.split())
WITHOUT_ALPHA = frozenset({".jpg", ".jpeg", ".jpe", ".hdr", ".rgbe"})
SAMPLES = {"uint8": np.uint8, "uint16": np.uint16, "half": np.float16}  # all others are read as float
BLENDERS_FORMATS = "openexr hdr dpx cineon png jpeg tiff targa bmp webp jpeg2000 psd sgi dds"
ALPHA = 2, 4  # the numbers of channels with alpha: YA, RGBA
COLOURS = ("RGBA", "RGB"), ("XYZA", "XYZ"), ("YA", "Y")  # of an EXR, in order of preference
NO_GREY = frozenset({"X", "BY", "RY"})  # with these, Y is not the whole picture
_VERSION = re.compile(r"(?<![a-z])v[0-9]{1,3}$", re.IGNORECASE)
MISSING = 100  # the most missing numbers in a row; files after a wider gap belong to another sequence
LONGEST = 1_048_574  # Blender's last frame

Window = tuple[int, int, int, int]  # x, y, width, height
_Parts = tuple[str, str, str]  # a file's stem: before a number, its digits, after it
Layer = tuple[ImageSpec, list[int]]  # the spec of a part of an image, and positions of channels in it


class SequenceSource(FrameSource):
    """An image sequence or image as a source: all colors of its files, or one channel of them.

    With `files` (an image strip's list), frame i is files[i]. Else files are found beside the first one, and frame i is
    the file whose number is i higher. If a number is missing, the file before it is repeated. If more than MISSING are
    missing in a row, the sequence ends, and `left_out` tells so.

    As in Blender, samples are not changed: straight alpha stays straight, EXIF orientation is ignored, and the picture
    of an EXR is its data window. All frames must have the first one's size and sample type. The source has alpha if any
    frame has.

    The frames of a channel are its stored samples (height, width, n) of any type: n is 3 (RGB) for the luminance of
    colors, 0 for the alpha of an opaque image, else 1. An EXR's picture is then its display window, 0 outside its data
    window, because mattes are often cropped to what they cover. If the data window is larger on all sides, it is the
    picture, as in Blender.
    """

    fps = None

    def __init__(
        self,
        path: str | Path,
        *,
        files: Sequence[str | Path] | None = None,
        alpha: str | None = None,
        channel: str | None = None,
    ) -> None:
        """Find the files, and read the first one's header.

        Args:
            path: The first file.
            files: An image strip's list of file names. None: files are found beside `path`.
            alpha: As for opening.open_source.
            channel: A key of CHANNELS, or a channel's name in the files. None: all colors.

        Raises:
            MediaError: The first file cannot be read or has no such channel, or its folder cannot be listed.
        """
        path = Path(path)
        if files is None:
            self.path = check_file(path)
            by_frame, beyond = _numbered(path)
            ends = [*by_frame, max(by_frame) + 1][1:]
            held = zip(by_frame.items(), ends, strict=True)
            self.files = [file for (frame, file), end in held for _ in range(frame, end)]
            if beyond:
                last = self.files[-1].name
                self.left_out = f"{path.name}: the sequence ends with {last}; too many numbers lie before {beyond.name}"
        else:
            folder = path if path.is_dir() else path.parent
            self.files = [folder / file for file in files]
            if not self.files:
                raise MediaError(f"{path.name}: an image sequence without files")
            self.path = check_file(self.files[0])
        self.count = len(self.files)
        self._channel = channel
        self._layer_of = partial(_channel_named, channel) if channel else _first_colours
        with _opened(self.path, self._layer_of) as (image, spec, layer):
            self.file_kind = f"{image.format_name()}, {spec.nchannels} channels of {spec.format}"
            _, _, self.width, self.height = self._window(image, spec, self.path)
            self.dtype = _dtype(spec)
        self.transfer = "linear" if self.path.suffix.lower() in LINEAR_SUFFIXES else "srgb"
        has_alpha = not channel and (len(layer) in ALPHA or any(map(_has_alpha, dict.fromkeys(self.files))))
        self.alpha = (alpha or self._usual_alpha()) if has_alpha else "opaque"
        self.options = {}

    def read(self, index: int) -> np.ndarray:
        """Return a frame as RGBA (height, width, 4), or the samples (height, width, n) of the channel.

        Raises:
            MediaError: The file is missing, damaged or unlike the first.
            IndexError: There is no such frame.
        """
        check_index(self, index)
        path = check_file(self.files[index])
        with _opened(path, self._layer_of) as (image, spec, layer):
            window = self._window(image, spec, path)
            size, dtype, first = window[2:], _dtype(spec), self.path.name
            if size != (self.width, self.height):
                is_cropped = size != (spec.full_width, spec.full_height)
                told = f"{size[0]}×{size[1]}{' (its data window)' if is_cropped else ''}"
                raise MediaError(f"{path.name}: is {told}, but {first} is {self.width}×{self.height}")
            if not self._channel and dtype != self.dtype:
                raise MediaError(f"{path.name}: has {dtype} samples, but {first} has {self.dtype}")
            if not layer:
                return np.empty((self.height, self.width, 0), np.uint8)
            samples = _in_window(_samples(image, spec, layer, path), spec, window)
            return samples if self._channel else expanded(samples)

    def _window(self, image: ImageInput, spec: ImageSpec, path: Path) -> Window:
        """Return the window of an opened image that is the picture: its data window or its display window."""
        if not self._channel or image.format_name() != "openexr" or spec.roi.contains(spec.roi_full):
            return spec.x, spec.y, spec.width, spec.height
        check_size(path.name, spec.full_width, spec.full_height)
        return spec.full_x, spec.full_y, spec.full_width, spec.full_height

    def _usual_alpha(self) -> str:
        """Return the alpha mode that Blender assumes for such files. It ignores what a TIFF's header tells."""
        deep_tiff = self.path.suffix.lower() in (".tif", ".tiff") and self.dtype == np.uint16
        return "premultiplied" if self.transfer == "linear" or deep_tiff else "straight"


def expanded(samples: np.ndarray) -> np.ndarray:
    """Return samples (height, width, n) of grey, grey with alpha, RGB or RGBA as RGBA, in new memory."""
    height, width, channels = samples.shape
    picture = np.empty((height, width, 4), samples.dtype)
    picture[..., :3] = samples[..., : 1 if channels < 3 else 3]
    opaque = np.iinfo(samples.dtype).max if samples.dtype.kind == "u" else 1
    picture[..., 3] = samples[..., -1] if channels in ALPHA else opaque
    return picture


def _in_window(samples: np.ndarray, spec: ImageSpec, window: Window) -> np.ndarray:
    """Return an image's samples (height, width, n) in a window, 0 outside the image.

    Args:
        samples: Those of the image's data window.
        spec: The image's header.
        window: x, y, width and height in the image's coordinates.
    """
    x, y, width, height = window
    if window == (spec.x, spec.y, spec.width, spec.height):
        return samples
    rows, columns = np.arange(height) + y - spec.y, np.arange(width) + x - spec.x
    down, across = (rows >= 0) & (rows < spec.height), (columns >= 0) & (columns < spec.width)
    picture = np.zeros((height, width, samples.shape[2]), samples.dtype)
    picture[np.ix_(down, across)] = samples[np.ix_(rows[down], columns[across])]
    return picture


def sequence_files(path: Path) -> list[Path]:
    """Return the files of the image sequence that starts with a file, in order. Missing numbers are left out.

    Raises:
        MediaError: The file is missing, or its folder cannot be listed.
    """
    return [*_numbered(check_file(path))[0].values()]


def _numbered(path: Path) -> tuple[dict[int, Path], Path | None]:
    """Find the files of the image sequence that starts with a file.

    Returns:
        {frame from 0: file}, without missing frames; and the first file after a gap that ends the sequence, or None.
    """
    parts, alike = _frame_number(path)
    if parts is None:
        return {0: path}, None
    prefix, first, suffix = parts
    by_frame: dict[int, Path] = {}
    for file in alike:
        digits = file.stem[len(prefix) : len(file.stem) - len(suffix)]
        number = int(digits) - int(first)
        if number >= 0 and (number not in by_frame or len(digits) == len(first)):
            by_frame[number] = file
    numbers = sorted(by_frame)
    gaps = (i for i, (a, b) in enumerate(itertools.pairwise(numbers), 1) if b - a > MISSING + 1 or b >= LONGEST)
    end = next(gaps, None)
    beyond = None if end is None else by_frame[numbers[end]]
    return {number: by_frame[number] for number in numbers[:end]}, beyond


def numbered_alike(path: Path) -> list[Path]:
    """Return the sorted files of a folder whose names differ from a file's at most in the frame number.

    Raises:
        MediaError: The folder cannot be listed.
    """
    return _frame_number(path)[1]


def _frame_number(path: Path) -> tuple[_Parts | None, list[Path]]:
    """Find the frame number in a file's name.

    It is the last number that varies among the files of the folder; a version (v3) counts only if no other varies. If
    none varies, it is the last number.

    Returns:
        The name's parts around the number, or None without any; and the files of the folder that differ only there.
    """
    numbers = _numbers(path.stem)
    if not numbers:
        return None, [path] if path.exists() else []
    try:
        files, found = sorted(path.parent.iterdir()), []
    except OSError as error:
        raise MediaError(f"{path.parent}: cannot be listed ({error.strerror})") from None
    for before, digits, behind in numbers:
        name = re.compile(re.escape(before) + r"\d+" + re.escape(behind + path.suffix))
        alike = [file for file in files if name.fullmatch(file.name)]
        found.append(((before, digits, behind), alike))
        if len(alike) > 1 and not _VERSION.search(before + digits):
            return found[-1]
    return next((each for each in found if len(each[1]) > 1), found[0])


def _numbers(stem: str) -> list[_Parts]:
    """Return the numbers in a file's stem, the last one first, each with the text before and after it."""
    found = [(stem[: n.start()], n[0], stem[n.end() :]) for n in re.finditer(r"[0-9]+", stem)]
    return found[::-1]


def by_number(path: Path, *, listed: bool = False) -> Callable[[int], Path] | None:
    """Return a function of i that gives the path whose number is i higher than that of a file. None: it has no number.

    Args:
        path: The file.
        listed: Whether the other files of the folder decide which number is that of the frame (MediaError: it cannot be
            listed). Otherwise it is the last one, as in Blender's movie clips.
    """
    parts = _frame_number(path)[0] if listed else next(iter(_numbers(path.stem)), None)
    if parts is None:
        return None
    before, digits, behind = parts
    return lambda i: path.with_name(f"{before}{int(digits) + i:0{len(digits)}d}{behind}{path.suffix}")


def _has_alpha(path: Path) -> bool:
    """Return whether an image file has alpha; False if it cannot be read. It is opened again only if it has changed."""
    if path.suffix.lower() in WITHOUT_ALPHA:
        return False
    try:
        return path.is_file() and _had_alpha(path, stamp(path))
    except (OSError, MediaError):  # reading the frame raises it
        return False


@lru_cache(maxsize=1 << 17)  # a sequence of an hour and a half
def _had_alpha(path: Path, _stamp: tuple[int, int] | None) -> bool:
    """Return whether an image file has alpha. The result is cached until its stamp (time and size) changes."""
    with _opened(path) as (_image, _spec, layer):
        return len(layer) in ALPHA


def _parts(image: ImageInput) -> Iterator[ImageSpec]:
    """Yield the header of each part of an image, and make it the part that is read."""
    for part in itertools.count():
        if not image.seek_subimage(part, 0):
            return
        yield image.spec()


def _first_colours(image: ImageInput, path: Path) -> Layer:
    """Return the channels of an image that Blender shows: their part and positions.

    Raises:
        MediaError: It has no colors.
    """
    spec = whole = image.spec()
    if image.format_name() != "openexr":
        return spec, [*range(min(spec.nchannels, 4))]
    names: list[str] = []
    for spec in _parts(image):
        layer = _colour_channels(spec.channelnames)
        if layer and not spec.deep:
            if (spec.width, spec.height) != (whole.width, whole.height):
                raise MediaError(f"{path.name}: its parts have different data windows")
            return spec, layer
        names += [f"deep {name}" for name in spec.channelnames] if spec.deep else spec.channelnames
    raise MediaError(f"{path.name}: no colour channels, only {', '.join(names)}")


def _channel_named(channel: str, image: ImageInput, path: Path) -> Layer:
    """Find the channels of an image that a channel's name stands for.

    "luminance" stands for all colors, and "alpha" for no channel if the image is opaque. If an EXR has a channel of
    exactly this name, only that one counts: files of coefficients name channels after shutters, which may be "red".

    Args:
        channel: A key of CHANNELS, or the name of a channel in the file.
        image: The opened file.
        path: The file, for messages.

    Returns:
        The part of the file that has the channels, and their positions there.

    Raises:
        MediaError: The image has no such channel.
    """
    names: list[str] = []
    is_exr = image.format_name() == "openexr"
    for spec in _parts(image) if is_exr or channel not in CHANNELS else ():
        if channel in spec.channelnames and not spec.deep:
            return spec, [spec.channelnames.index(channel)]
        names += [] if spec.deep else spec.channelnames
    if channel not in CHANNELS:
        raise no_channel(path, channel, names if is_exr else CHANNELS)
    spec, layer = _first_colours(image, path)
    colours, alpha = (layer[:-1], layer[-1:]) if len(layer) in ALPHA else (layer, [])
    if channel == "alpha":
        return spec, alpha
    return spec, colours if channel == "luminance" else (3 * colours)[CHANNELS[channel]]


def _colour_channels(names: Iterable[str]) -> list[int]:
    """Return the positions of the channels that Blender shows of an EXR, by the names of all its channels.

    They belong to the first layer, and there to no pass or to "Combined" rather than to other passes. RGB comes before
    XYZ, and XYZ before grey.
    """
    passes: dict[str, dict[str, int]] = {}
    for position, name in enumerate(names):
        place, _, channel = name.rpartition(".")
        passes.setdefault(place, {})[channel.upper()] = position
    order = sorted(passes, key=_rank)
    for kinds in COLOURS:
        for channels in map(passes.__getitem__, order):
            for wanted in kinds:
                if channels.keys() >= set(wanted) and not ("Y" in kinds and channels.keys() & NO_GREY):
                    return [channels[channel] for channel in wanted]
    return []


def _rank(place: str) -> tuple[str, bool, str]:
    """Return a key that sorts the layers and passes of an EXR, given as layer.pass, in Blender's order."""
    layer, _, name = place.rpartition(".")
    return layer, name not in ("", "Combined"), name


@contextmanager
def _opened(
    path: Path, layer_of: Callable[[ImageInput, Path], Layer] = _first_colours
) -> Iterator[tuple[ImageInput, ImageSpec, list[int]]]:
    """Open an image, and close it at the end of the context.

    Args:
        path: The file.
        layer_of: Chooses the channels that are wanted, and their part of the image.

    Yields:
        The open image, the header of the part, and the positions of the channels: those of Y, YA, RGB or RGBA, or of a
        single channel.

    Raises:
        MediaError: It cannot be read.
    """
    wishes = ImageSpec()
    wishes.attribute("oiio:UnassociatedAlpha", 1)  # no premultiplication on reading
    try:
        if (image := ImageInput.open(check_name(path), wishes)) is None:
            raise MediaError(f"{path.name}: cannot be read as an image ({_told(geterror(), path, 'unknown format')})")
        with closing(image):
            if image.format_name() not in BLENDERS_FORMATS.split():
                raise MediaError(f"{path.name}: {FOREIGN}")
            spec, layer = layer_of(image, path)
            check_size(path.name, spec.width, spec.height)
            yield image, spec, layer
    except UnicodeDecodeError as error:  # names or messages in a damaged file
        text = error.object.decode(errors="replace")
        raise MediaError(f"{path.name}: cannot be read as an image ({text})") from None


def _dtype(spec: ImageSpec) -> np.dtype:
    """Return the dtype in which the samples of an image with this header are read."""
    return np.dtype(SAMPLES.get(str(spec.format), np.float32))


def _samples(image: ImageInput, spec: ImageSpec, layer: list[int], path: Path) -> np.ndarray:
    """Read the samples (height, width, channels) of some channels of an opened image.

    Args:
        image: The image, at the wanted part.
        spec: The part's header.
        layer: The channels' positions.
        path: The file, for errors.

    Raises:
        MediaError: They cannot be decoded.
    """
    kind = str(spec.format) if str(spec.format) in SAMPLES else "float"
    first, stop = min(layer), max(layer) + 1
    if image.format_name() != "openexr":  # channels are interleaved: reading some takes longer than reading all
        first, stop = 0, max(stop, min(spec.nchannels, 4))
    elif str(spec.channelformat(layer[0])) == "uint":
        kind = "uint"  # whole numbers in an EXR are not scaled
    samples = image.read_image(image.current_subimage(), 0, first, stop, kind)
    if samples is None or image.has_error or samples.size != spec.height * spec.width * (stop - first):
        raise MediaError(f"{path.name}: cannot be decoded ({_told(image.geterror(), path, 'its data are damaged')})")
    samples = samples.reshape(spec.height, spec.width, stop - first)[..., [channel - first for channel in layer]]
    return samples.astype(_dtype(spec), copy=False)


def _told(text: str, path: Path, otherwise: str) -> str:
    """Shorten OpenImageIO's error message for use inside a sentence; return `otherwise` if it is empty."""
    return " ".join(text.replace(str(path), path.name).split()).partition(". ")[0] or otherwise


def no_channel(path: Path, channel: str, names: Iterable[str]) -> MediaError:
    """Return the error for a file that lacks a channel. Its message lists the channels that the file has."""
    return MediaError(f"{path.name}: has no channel {channel}, but {', '.join(names)}")
