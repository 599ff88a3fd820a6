"""Frames of an image sequence, or of one image: the samples that the files hold, whatever their format."""

import itertools
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache, partial
from pathlib import Path

import numpy as np
from OpenImageIO import ImageInput, ImageSpec, geterror

from ..core.frames.frame_source import FrameSource
from .errors import MediaError
from .files import FOREIGN, check_file, check_index, check_name, check_size, stamp

# Those that every picture has, whatever its file calls them.
CHANNELS = {
    "luminance": slice(0, 3),
    "red": slice(0, 1),
    "green": slice(1, 2),
    "blue": slice(2, 3),
    "alpha": slice(3, 4),
}
_TOLD = 6  # channels of a file that a sentence names
# Blender takes these for scene linear, even logarithmic DPX, and every other format for sRGB, even float TIFF.
LINEAR_SUFFIXES = frozenset({".exr", ".hdr", ".rgbe", ".dpx", ".cin"})
OTHER_SUFFIXES = ".png .jpg .jpeg .jpe .tif .tiff .tga .bmp .webp .jp2 .j2k .j2c .psd .sgi .rgb .rgba .bw"
IMAGE_SUFFIXES = LINEAR_SUFFIXES.union(OTHER_SUFFIXES.split())
WITHOUT_ALPHA = frozenset({".jpg", ".jpeg", ".jpe", ".hdr", ".rgbe"})
SAMPLES = {"uint8": np.uint8, "uint16": np.uint16, "half": np.float16}  # all others are read as float
BLENDERS_FORMATS = "openexr hdr dpx cineon png jpeg tiff targa bmp webp jpeg2000 psd sgi dds"
ALPHA = 2, 4  # channels of colours with alpha: YA, RGBA
COLOURS = ("RGBA", "RGB"), ("XYZA", "XYZ"), ("YA", "Y")  # in an EXR; those before go before
NO_GREY = frozenset({"X", "BY", "RY"})  # beside these, Y is not all of the picture
_VERSION = re.compile(r"(?<![a-z])v[0-9]{1,3}$", re.IGNORECASE)
MISSING = 100  # numbers in a row; what lies beyond a wider gap is another sequence, or a stray number
LONGEST = 1_048_574  # Blender's last frame

Window = tuple[int, int, int, int]  # x, y, width, height
_Parts = tuple[str, str, str]  # of a file's stem: what is before a number, its digits, what is behind it
Layer = tuple[ImageSpec, list[int]]  # what describes a part of an image, and the positions of channels in it


class _Sequence(FrameSource):
    """The files of an image sequence, as frames.

    Found beside its first file, frame i is the file whose number is i above the first's; where a number is missing,
    the file before it holds. Where more than MISSING in a row are, the sequence ends, and `left_out` says so. With
    `files` (an image strip's list) frame i is files[i].
    """

    fps = None

    def __init__(self, path: str | Path, files: Sequence[str | Path] | None) -> None:
        """MediaError: there is no first file, or its folder cannot be listed."""
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

    def _file(self, index: int) -> Path:
        """MediaError: it is missing. IndexError: there is no such frame."""
        check_index(self, index)
        return check_file(self.files[index])

    def _check_size(self, path: Path, size: tuple[int, int], window: str = "") -> None:
        """MediaError unless it is the first one's."""
        if size != (self.width, self.height):
            first = f"{self.path.name} is {self.width}×{self.height}"
            raise MediaError(f"{path.name}: is {size[0]}×{size[1]}{window}, but {first}")


class SequenceSource(_Sequence):
    """Images as frames: see _Sequence for which file is which frame.

    Samples are as stored: straight alpha stays straight, EXIF orientation is left alone, and of an EXR the data window
    is the picture, wherever its display window lies; all as in Blender. All frames must have the first one's size and
    sample type; one with alpha among them, and the source has alpha.
    """

    def __init__(
        self, path: str | Path, *, files: Sequence[str | Path] | None = None, alpha: str | None = None
    ) -> None:
        super().__init__(path, files)
        with _opened(self.path) as (image, spec, layer):
            self.file_kind = f"{image.format_name()}, {spec.nchannels} channels of {spec.format}"
            self.width, self.height = spec.width, spec.height
            self.dtype = _dtype(spec)
        self.transfer = "linear" if self.path.suffix.lower() in LINEAR_SUFFIXES else "srgb"
        has_alpha = len(layer) in ALPHA or any(map(_has_alpha, dict.fromkeys(self.files)))
        self.alpha = (alpha or self._usual_alpha()) if has_alpha else "opaque"
        self.options = {}

    def read(self, index: int) -> np.ndarray:
        """MediaError: the file is missing, damaged or unlike the first."""
        path = self._file(index)
        with _opened(path) as (image, spec, layer):
            size, dtype = (spec.width, spec.height), _dtype(spec)
            whole = size == (spec.full_width, spec.full_height)
            self._check_size(path, size, "" if whole else " (its data window)")
            if dtype != self.dtype:
                raise MediaError(f"{path.name}: has {dtype} samples, but {self.path.name} has {self.dtype}")
            return expanded(_samples(image, spec, layer, path))

    def _usual_alpha(self) -> str:
        """What Blender assumes, whatever a TIFF says of itself."""
        deep_tiff = self.path.suffix.lower() in (".tif", ".tiff") and self.dtype == np.uint16
        return "premultiplied" if self.transfer == "linear" or deep_tiff else "straight"


def expanded(samples: np.ndarray) -> np.ndarray:
    """Y, YA, RGB or RGBA samples (height, width, n) as RGBA, of new memory."""
    height, width, channels = samples.shape
    picture = np.empty((height, width, 4), samples.dtype)
    picture[..., :3] = samples[..., : 1 if channels < 3 else 3]
    opaque = np.iinfo(samples.dtype).max if samples.dtype.kind == "u" else 1
    picture[..., 3] = samples[..., -1] if channels in ALPHA else opaque
    return picture


class SequenceChannel(_Sequence):
    """One channel of the images of a sequence: see _Sequence for which file is which frame.

    Samples are as stored, of any type. All frames must have the first one's size. An EXR's picture is its display
    window, since mattes are often cropped to what they cover: what its data window leaves out is 0. Where that is
    larger all around, it is the picture, as in Blender.
    """

    def __init__(self, path: str | Path, channel: str, *, files: Sequence[str | Path] | None = None) -> None:
        """channel: one of CHANNELS, or the name of one of the files' own. MediaError: they have none of that name."""
        super().__init__(path, files)
        self._layer_of = partial(_channel_named, channel)
        with _opened(self.path, self._layer_of) as (image, spec, _positions):
            _, _, self.width, self.height = _picture_window(image, spec, self.path)

    def read(self, index: int) -> np.ndarray:
        """The samples (height, width, n) that the channel is made of, top row first: n is 3, RGB, for the luminance of
        colours, 0 for the alpha of an opaque image, 1 otherwise.

        Raises MediaError for a file that is missing, damaged or unlike the first, IndexError outside 0 … count-1."""
        path = self._file(index)
        with _opened(path, self._layer_of) as (image, spec, positions):
            window = _picture_window(image, spec, path)
            self._check_size(path, window[2:])
            if not positions:
                return np.empty((self.height, self.width, 0), np.uint8)
            return _in_window(_samples(image, spec, positions, path), spec, window)


def _picture_window(image: ImageInput, spec: ImageSpec, path: Path) -> Window:
    """(x, y, width, height) of what a SequenceChannel shows of an image."""
    if image.format_name() != "openexr" or spec.roi.contains(spec.roi_full):
        return spec.x, spec.y, spec.width, spec.height
    check_size(path.name, spec.full_width, spec.full_height)
    return spec.full_x, spec.full_y, spec.full_width, spec.full_height


def _in_window(samples: np.ndarray, spec: ImageSpec, window: Window) -> np.ndarray:
    """An image's samples in a window (x, y, width, height), 0 beside them."""
    x, y, width, height = window
    if window == (spec.x, spec.y, spec.width, spec.height):
        return samples
    rows, columns = np.arange(height) + y - spec.y, np.arange(width) + x - spec.x
    down, across = (rows >= 0) & (rows < spec.height), (columns >= 0) & (columns < spec.width)
    picture = np.zeros((height, width, samples.shape[2]), samples.dtype)
    picture[np.ix_(down, across)] = samples[np.ix_(rows[down], columns[across])]
    return picture


def sequence_files(path: Path) -> list[Path]:
    """The files of the sequence that starts with a file. MediaError: there is no such file, or its folder cannot be
    listed."""
    return [*_numbered(check_file(path))[0].values()]


def _numbered(path: Path) -> tuple[dict[int, Path], Path | None]:
    """The files by frame from that file on, which is frame 0: those that differ in the frame number only; and the file
    beyond too wide a gap, or None."""
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
    """The files in a file's folder, in order, whose name differs from its own in the frame number only, if at all.
    MediaError: the folder cannot be listed."""
    return _frame_number(path)[1]


def _frame_number(path: Path) -> tuple[_Parts | None, list[Path]]:
    """Where a file's name has its frame number, and the files in its folder that differ there only: the last number
    that varies between them, though a version (v3) only where no other does; where none does, the last."""
    numbers = _numbers(path.stem)
    if not numbers:
        return None, [path] if path.exists() else []
    files, found = sorted(_listed(path.parent)), []
    for before, digits, behind in numbers:
        name = re.compile(re.escape(before) + r"\d+" + re.escape(behind + path.suffix))
        alike = [file for file in files if name.fullmatch(file.name)]
        found.append(((before, digits, behind), alike))
        if len(alike) > 1 and not _VERSION.search(before + digits):
            return found[-1]
    return next((each for each in found if len(each[1]) > 1), found[0])


def _numbers(stem: str) -> list[_Parts]:
    """The numbers in a file's stem, the last one first."""
    found = [(stem[: n.start()], n[0], stem[n.end() :]) for n in re.finditer(r"[0-9]+", stem)]
    return found[::-1]


def by_number(path: Path, *, listed: bool = False) -> Callable[[int], Path] | None:
    """A function that gives the file i numbers on from that one, in the same folder; None: its stem has no number.

    listed: the files in the folder say which number counts (MediaError: it cannot be listed); else the last one does,
    as in Blender's movie clips"""
    parts = _frame_number(path)[0] if listed else next(iter(_numbers(path.stem)), None)
    if parts is None:
        return None
    before, digits, behind = parts
    return lambda i: path.with_name(f"{before}{int(digits) + i:0{len(digits)}d}{behind}{path.suffix}")


def _listed(folder: Path) -> list[Path]:
    try:
        return list(folder.iterdir())
    except OSError as error:
        raise MediaError(f"{folder}: cannot be listed ({error.strerror})") from None


def _has_alpha(path: Path) -> bool:
    """Whether that file of a sequence has alpha, as far as it can be read; it is opened only if it changed since."""
    if path.suffix.lower() in WITHOUT_ALPHA:
        return False
    try:
        return path.is_file() and _had_alpha(path, stamp(path))
    except (OSError, MediaError):  # who needs the frame is told
        return False


@lru_cache(maxsize=1 << 17)  # a sequence of an hour and a half
def _had_alpha(path: Path, _stamp: tuple[int, int] | None) -> bool:
    with _opened(path) as (_image, _spec, layer):
        return len(layer) in ALPHA


def _parts(image: ImageInput) -> Iterator[ImageSpec]:
    """What describes each part of an image, which is the one that is read then."""
    for part in itertools.count():
        if not image.seek_subimage(part, 0):
            return
        yield image.spec()


def _first_colours(image: ImageInput, path: Path) -> Layer:
    """(spec, positions) of the channels that Blender shows."""
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
    """(spec, positions) of a channel: three for the luminance of colours, none for the alpha of an opaque image.
    What an EXR calls "red" itself is that: coefficients have the names of shutters."""
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
    """Where an EXR keeps the colours that Blender shows: those of its first layer, there plain ones or "Combined"
    before other passes; XYZ for want of colours, and then grey."""
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
    layer, _, name = place.rpartition(".")
    return layer, name not in ("", "Combined"), name


@contextmanager
def _opened(
    path: Path, layer_of: Callable[[ImageInput, Path], Layer] = _first_colours
) -> Iterator[tuple[ImageInput, ImageSpec, list[int]]]:
    """(open image, spec, positions of channels). MediaError: there is no such image.

    layer_of: gives spec and positions; those of the colours are Y, YA, RGB or RGBA"""
    wishes = ImageSpec()
    wishes.attribute("oiio:UnassociatedAlpha", 1)  # no premultiplication on reading
    image = ImageInput.open(check_name(path), wishes)
    if image is None:
        raise MediaError(f"{path.name}: cannot be read as an image ({_told(geterror, path, 'unknown format')})")
    try:
        if image.format_name() not in BLENDERS_FORMATS.split():
            raise MediaError(f"{path.name}: {FOREIGN}")
        spec, layer = layer_of(image, path)
        check_size(path.name, spec.width, spec.height)
        yield image, spec, layer
    except UnicodeDecodeError as error:  # names within a damaged file
        raise MediaError(f"{path.name}: cannot be read as an image ({_as_text(error)})") from None
    finally:
        image.close()


def _dtype(spec: ImageSpec) -> np.dtype:
    return np.dtype(SAMPLES.get(str(spec.format), np.float32))


def _samples(image: ImageInput, spec: ImageSpec, layer: list[int], path: Path) -> np.ndarray:
    """The layer's samples (height, width, channels)."""
    kind = str(spec.format) if str(spec.format) in SAMPLES else "float"
    first, stop = min(layer), max(layer) + 1
    if image.format_name() != "openexr":  # they hold a pixel's channels together: some take longer than all
        first, stop = 0, max(stop, min(spec.nchannels, 4))
    elif str(spec.channelformat(layer[0])) == "uint":
        kind = "uint"  # whole numbers of an EXR stand for themselves
    samples = image.read_image(image.current_subimage(), 0, first, stop, kind)
    if samples is None or image.has_error or samples.size != spec.height * spec.width * (stop - first):
        raise MediaError(f"{path.name}: cannot be decoded ({_told(image.geterror, path, 'its data are damaged')})")
    samples = samples.reshape(spec.height, spec.width, stop - first)[..., [channel - first for channel in layer]]
    return samples.astype(_dtype(spec), copy=False)


def _told(geterror: Callable[[], str], path: Path, otherwise: str) -> str:
    """What OpenImageIO says of an error in a file, for use inside a sentence; it may quote bytes that are no text."""
    try:
        text = geterror()
    except UnicodeDecodeError as error:
        text = _as_text(error)
    return " ".join(text.replace(str(path), path.name).split()).partition(". ")[0] or otherwise


def _as_text(error: UnicodeDecodeError) -> str:
    return error.object.decode(errors="replace")


def no_channel(path: Path, channel: str, names: Iterable[str]) -> MediaError:
    """What is said where a file has no such channel, but others."""
    names = list(names)
    others = len(names) - _TOLD
    told = ", ".join(names[:_TOLD]) + (f" and {others} others" if others > 0 else "")
    return MediaError(f"{path.name}: has no channel {channel}, but {told}")
