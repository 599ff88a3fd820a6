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
    """An image sequence or a single image as a source: the colors of its files or, with `channel`, one channel of them.

    With `files` (an image strip's list), frame i is files[i]. Otherwise files are found beside the first one: frame i
    is the file whose number is i higher. If that is missing, the file with the next lower number is repeated. The
    sequence ends before a gap of more than MISSING numbers, and has at most LONGEST frames. `left_out` tells of files
    beyond its end.

    As in Blender, samples are not converted: straight alpha stays straight, and EXIF orientation is ignored. The
    picture of an EXR is its data window. All frames must have the size and sample type of the first one. The source has
    alpha if any frame has it.

    With `channel`, frames are stored samples (height, width, n), of a type that may differ from frame to frame. n is 3
    (RGB) for the luminance of colors, 0 for the alpha of an opaque image, else 1. The picture of an EXR is then its
    display window, with 0 outside its data window, because mattes are often cropped to what they cover. If the data
    window contains the display window, it is the picture instead.
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
        """Find the files, and read the header of the first one.

        Args:
            path: The first file. With `files`, it may be their folder.
            files: An image strip's list of file names, in the folder of `path`. None: files are found beside `path`.
            alpha: The alpha mode of files that have alpha, "straight" or "premultiplied". None: what Blender assumes.
            channel: A key of CHANNELS, or the name of a channel in EXR files. None: all colors.

        Raises:
            MediaError: The first file cannot be read or has no such channel, its folder cannot be listed, or `files` is
                empty.
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
        """Return a frame as RGBA (height, width, 4), or the samples (height, width, n) of `channel` if one was chosen.

        Raises:
            MediaError: The file is missing, damaged or without the channel, or its size (without `channel` also its
                sample type) is not the first's.
            IndexError: There is no such frame.
        """
        check_index(self, index)
        path = check_file(self.files[index])
        with _opened(path, self._layer_of) as (image, spec, layer):
            window = self._window(image, spec, path)
            size, dtype, first = window[2:], _dtype(spec), self.path.name
            if size != (self.width, self.height):
                is_cropped = size != (spec.full_width, spec.full_height)
                size_text = f"{size[0]}×{size[1]}{' (its data window)' if is_cropped else ''}"
                raise MediaError(f"{path.name}: is {size_text}, but {first} is {self.width}×{self.height}")
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
    """Cut an image's samples (height, width, n) to a window, with 0 wherever the window extends beyond the image.

    Args:
        samples: The samples of the image's data window.
        spec: The image's header, which tells where that window lies.
        window: x, y, width and height of the window in the image's coordinates. If it is the data window, `samples` is
            returned itself.
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
    """Find the files of the image sequence that starts with a file, by the numbers in their names.

    The sequence ends before a gap of more than MISSING numbers, and has at most LONGEST frames.

    Returns:
        {difference of a file's number from the first one's: file}, ascending, beginning with 0. And the first file
        beyond the sequence's end, or None if there is no such file.

    Raises:
        MediaError: The folder cannot be listed.
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
    """Return the files of a folder whose names differ from a file's at most in the frame number, sorted.

    The file is included if it exists. A name without a number gives just the file.

    Raises:
        MediaError: The folder cannot be listed.
    """
    return _frame_number(path)[1]


def _frame_number(path: Path) -> tuple[_Parts | None, list[Path]]:
    """Find out which number in a file's name is that of the frame.

    It is the last number in which files of the folder differ. A version (such as v3) is taken only if they differ in no
    other number. If they differ in none, it is the last number.

    Returns:
        The stem before the number, the number's digits, and the stem after them; None: the name has no number. And the
        files of the folder whose names differ only in this number, the file itself included if it exists.

    Raises:
        MediaError: The folder cannot be listed.
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
    """Return a function of i that returns the path of the file whose number is i higher, whether or not it exists.

    The number has at least as many digits as that of `path`. Return None if the name of `path` has no number.

    Args:
        path: A file of the sequence.
        listed: Whether to find the number of the frame by comparing the folder's files (`_frame_number`). False: it is
            the last number in the name, as in Blender's movie clips.

    Raises:
        MediaError: The folder cannot be listed (`listed` only).
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
    """Find the channels of an image that Blender shows.

    Args:
        image: The opened file. It is left at the part that has these channels.
        path: The file, for messages.

    Returns:
        The header of the part (an EXR may have several), and the channels' positions in it: colors, then any alpha.

    Raises:
        MediaError: The image has no channels of colors, or an EXR's parts have different data windows.
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
    exactly this name, that one is meant: the extension's own EXRs name channels after shutters, and one of them may be
    "red".

    Args:
        channel: A key of CHANNELS, or the name of a channel in an EXR file.
        image: The opened file. It is left at the part that has these channels.
        path: The file, for messages.

    Returns:
        The header of that part, and the positions of the channels in it.

    Raises:
        MediaError: The image has no such channel. Or as for `_first_colours`.
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
    """Return which channels of a part of an EXR Blender shows, as positions, in the order RGB, XYZ or Y, then alpha.

    Channels of RGB are preferred to XYZ, and these to grey (COLOURS). Among several of one kind, those of the first
    layer win, and in it those without a pass or of the pass "Combined". If there are no such channels, the list is
    empty.

    Args:
        names: The names of all its channels, such as "layer.pass.R".
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
    """Open an image, find the channels that are wanted, and close the image at the end of the context.

    Args:
        path: The file.
        layer_of: Returns the wanted channels of the opened image: the header of their part, and their positions in it.

    Yields:
        The opened image, the header of the part, and the channels' positions: [] for the alpha of an opaque image.

    Raises:
        MediaError: The image cannot be read.
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
    """Read some channels of an opened image, as samples (height, width, channels).

    Args:
        image: The image, with the wanted part selected (seek_subimage).
        spec: The header of that part.
        layer: The positions of the channels, in the order wanted.
        path: The file, for messages.

    Raises:
        MediaError: The samples cannot be decoded.
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
