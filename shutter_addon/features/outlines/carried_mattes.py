"""Make, keep and read the mattes of an outline that is drawn at some frames and tracked through the others.

A matte is made by tracking ("carrying") the drawings through the footage when somebody asks for it, and kept as a file.
The file's name has a hash of everything that the matte is made of. So after a drawing changes, files that do not depend
on it are still used.
"""

from __future__ import annotations

import math
import os
import tempfile
import time
from collections.abc import Collection, Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import replace
from functools import cache, cached_property
from pathlib import Path
from threading import Lock

import numpy as np
from OpenImageIO import ImageSpec

from ...core import stopping
from ...core.farm.claims import Claims
from ...core.frames.frame_source import FrameSource, SourceWrapper
from ...core.messages import MediaError
from ...core.model import outlines, scribbles
from ...media import derived, flow
from ...media.cuts import ShotSource
from ...media.image_writing import write_levels
from ...media.outlining import traced
from . import carrying

CONFIDENCE = "confidence "  # what a file's description says (carrying.Carried)
VERSION = 5  # raise it when mattes of the same drawings change
TRUSTED = 0.2  # confidence below which a lone drawing's mattes fade out
FADE = 4  # frames that this takes
BLOCK = 20  # frames beyond a drawing that are carried together
# Seconds between two looks at what another process carries, after which that counts as killed, and from one sign of its
# life to the next: somebody waits for what is carried, and to carry it twice does no harm.
_PAUSE, _PATIENCE, _BEAT = 0.5, 20.0, 4.0


Drawings = tuple[tuple[int, outlines.Curves], ...]  # source frames with the curves drawn there


class CarriedMattes(SourceWrapper):
    """A source of mattes, one for each frame of the footage. They are made when they are first read, and kept as files.

    It implements core.model.mattes.MatteSource. Close it after use.
    """

    step = 1

    def __init__(self, source: FrameSource, drawings: Drawings, folder: Path | None = None) -> None:
        """Prepare to make and read the mattes of an outline.

        Args:
            source: The footage.
            drawings: The outline's drawings: pairs of a frame of the footage, from 0, and the curves drawn there.
                Frames outside the footage are ignored.
            folder: The folder in which a folder with this footage's mattes is made. If it is None or cannot be written
                to, they are kept in a temporary folder.
        """
        super().__init__(source)
        self._shots = source if isinstance(source, ShotSource) else ShotSource(source)
        self._drawings = {frame: curves for frame, curves in drawings if 0 <= frame < self.count}
        # of the names of files, for which previews ask again and again
        self._keys = {frame: derived.key({"frame": frame, "curves": it}) for frame, it in self._drawings.items()}
        self._parent = folder
        self._spec = ImageSpec(self.width, self.height, 1, "uint8")

    def read(self, index: int) -> np.ndarray:
        """Return a frame's matte, (height, width) float32, 0 to 1. Without a drawing near enough, it is empty.

        If no file keeps the matte yet, this makes it and all mattes that are made together with it (`_span`).

        Args:
            index: The frame of the footage, from 0. Beyond the ends, the first or last frame counts.

        Raises:
            MediaError: A frame cannot be read, or the folder cannot be written to.
        """
        index = min(max(index, 0), self.count - 1)
        near = self._near(index)
        if near == (None, None):
            return self._nothing()
        path = self._path(index, *near)
        if (matte := self._kept(path)) is None:
            with self._claimed(index, *near) as kept:
                matte = kept if kept is not None else self._carried(index, *near)
        return self._nothing() if matte is None else matte / np.float32(255)

    def has(self, index: int) -> bool:
        """Tell whether a frame's matte is ready: its file exists, or no drawing is near enough, so that it is empty."""
        near = self._near(index)
        return near == (None, None) or derived.size_of(self._path(index, *near)) is not None

    def confidence(self, index: int) -> float | None:
        """Return how sure a frame's matte is, 0 to 1; None: it is not kept, or no drawing is near enough."""
        near = self._near(index)
        return None if near == (None, None) else self._described(self._path(index, *near))

    def _described(self, path: Path) -> float | None:
        """Read the confidence from a matte's file, 0 to 1, or subject_mattes.GONE; None: it is missing or foreign."""
        if (image := derived.opened(path, self._spec)) is None:
            return None
        with closing(image):
            said = image.spec().get_string_attribute("ImageDescription")
        try:
            return float(said.removeprefix(CONFIDENCE))
        except ValueError:
            return None

    def curves(self, index: int) -> outlines.Curves:
        """Return the outline's curves at a frame of the footage, for example to draw them in a preview.

        Returns:
            Closed curves, each of points (x, y) in fractions of the picture, y up. If the frame has a drawing, its
            curves. Otherwise the contours of the frame's matte or, if no file keeps that yet, curves interpolated
            linearly between the nearest drawings, or those of the only drawing near enough.

        Raises:
            MediaError: OpenCV is missing, or the matte cannot be read.
        """
        if index in self._drawings:
            return self._drawings[index]
        return traced(self.read(index)) if self.has(index) else outlines.curves(self._straight(index))

    def straight(self, index: int) -> np.ndarray:
        """Return a quick stand-in for `read`: the matte of an outline that moves straight between drawings."""
        return outlines.coverage(self._straight(index), self.width, self.height)

    def _straight(self, index: int) -> list[np.ndarray]:
        """Return the strokes of an outline that moves straight between drawings, at a frame; []: no drawing is near."""
        near = nearest(index, self._drawings, carrying.FARTHEST)
        ends = [frame for frame in near if frame is not None]
        if not ends:
            return []
        share = (index - ends[0]) / (ends[-1] - ends[0]) if ends[0] != ends[-1] else 0.0
        before, behind = (self._drawings[frame] for frame in (ends[0], ends[-1]))
        return scribbles.between_strokes(before, behind, share, self.width / self.height)

    def _carried(self, index: int, first: int | None, last: int | None) -> np.ndarray | None:
        """Make a frame's matte and those that are made together with it (`_span`), and write each to a file.

        Args:
            index: The frame of the footage.
            first: The nearest frame with a drawing at or before it; None: there is none near enough.
            last: The nearest one at or after it; None: there is none near enough.

        Returns:
            The frame's matte, (H, W) uint8; None: it was not among those made.
        """
        matte = None
        for made in self._made(index, *self._in_shot(index, first, last)):
            write_levels(self._path(made.frame, first, last), made.matte, f"{CONFIDENCE}{made.confidence:.3f}")
            if made.frame == index:
                matte = made.matte
        return matte

    @contextmanager
    def _claimed(self, index: int, first: int | None, last: int | None) -> Iterator[np.ndarray | None]:
        """Keep other processes from making the same mattes, within a `with` block.

        If another process is making mattes from the same drawings, this first waits until it ends, or until it has made
        the matte of this frame. A process without a sign of life for _PATIENCE seconds counts as ended.

        Args:
            index: The frame whose matte is wanted.
            first, last: The frames with the drawings or strokes that the matte is made from; None: there is only the
                other.

        Yields:
            The frame's matte, (H, W) uint8, if a file keeps it by now, else None: then the block has to make it.

        Raises:
            MediaError: The folder cannot be written to.
        """
        name, path = derived.key({"drawn": self._drawn(first, last)}), self._path(index, first, last)
        with Claims(path.parent, _PATIENCE, _BEAT) as claims:
            try:
                derived.own_folder(path.parent)
                while not claims.take(name) and derived.size_of(path) is None:
                    stopping.check()
                    time.sleep(_PAUSE)
            except OSError as error:
                reason = error.strerror or error
                raise MediaError(f"{path.parent}: mattes cannot be written there ({reason})") from None
            yield self._kept(path)

    def close(self) -> None:
        """Close the footage. A later read opens it again."""
        self._shots.close()

    def _near(self, index: int) -> tuple[int | None, int | None]:
        """Return the nearest frames with drawings before and after a frame, within carrying.FARTHEST (`nearest`)."""
        return nearest(index, self._drawings, carrying.FARTHEST)

    def _in_shot(self, index: int, first: int | None, last: int | None) -> tuple[int | None, int | None]:
        """Return the frames `first` and `last`, each None if a cut lies between it and the frame `index`."""
        if first == last:
            return first, last
        shot = self._shots.around(index, *(index if end is None else end for end in (first, last)))
        self._shots.release()
        return (first if first in shot else None), (last if last in shot else None)

    def _made(self, index: int, first: int | None, last: int | None) -> Iterator[carrying.Carried]:
        """Make the matte of a frame and those made together with it (`_span`), and yield them.

        They are in order of time or, before the only drawing, in the opposite order. A frame with a drawing is made
        alone, and so is the empty matte of a frame whose shot has no drawing near enough.

        Args:
            index: The frame of the footage.
            first: The nearest frame with a drawing at or before it, in the same shot; None: there is none.
            last: The nearest frame with a drawing at or after it, in the same shot; None: there is none.
        """
        if first is None and last is None:  # kept as well: else it would be lacking again and again
            yield carrying.Carried(index, np.zeros((self.height, self.width), np.uint8), confidence=1.0)
            return
        if first == last and first is not None:
            matte = carrying.drawn(self._picture(first), self._drawing(first).cover)
            yield carrying.Carried(first, matte, confidence=1.0)
            return
        before, behind = (None if frame is None else self._drawing(frame) for frame in (first, last))
        carried = carrying.carried(self._picture, before, behind, self._span(index, first, last))
        if before and behind:
            yield from carried
        else:
            yield from self._fading(list(carried) if before else list(carried)[::-1])

    def _span(self, index: int, first: int | None, last: int | None) -> range:
        """Return the frames whose mattes are made together with a frame's matte.

        Between two drawings, these are all frames between them. With a drawing on one side only, they begin next to the
        drawing and go on as far as the frame, rounded up to a multiple of BLOCK frames. They end early after
        carrying.FARTHEST frames, at a cut, or at an end of the footage.

        Args:
            index: The frame, which has no drawing itself.
            first: The nearest frame before it with a drawing, in the same shot; None: there is none.
            last: The nearest frame after it with a drawing, in the same shot; None: there is none, but then there is
                `first`.
        """
        if first is not None and last is not None:
            return range(first + 1, last)
        if first is not None:
            end = min(first + min(-(-(index - first) // BLOCK) * BLOCK, carrying.FARTHEST), self.count - 1)
            return range(first + 1, min(end + 1, self._shots.around(index, first, end).stop))
        assert last is not None
        start = max(last - min(-(-(last - index) // BLOCK) * BLOCK, carrying.FARTHEST), 0)
        return range(max(start, self._shots.around(index, start, last).start), last)

    def _fading(self, carried: list[carrying.Carried]) -> Iterator[carrying.Carried]:
        """Yield the mattes on one side of a lone drawing, faded out where tracking is no longer sure.

        At the first matte with a confidence below TRUSTED, the fade begins. It takes FADE frames; all later mattes are
        empty.

        Args:
            carried: The mattes, the nearest to the drawing first.
        """
        share = 1.0
        for each in carried:
            if share < 1 or each.confidence < TRUSTED:
                share = max(share - 1 / FADE, 0.0)
            yield each if share == 1 else replace(each, matte=np.rint(each.matte * share).astype(np.uint8))

    def _picture(self, frame: int) -> np.ndarray:
        return displayed_frame(self._shots, frame)

    def _drawing(self, frame: int) -> carrying.Drawing:
        size = carrying.working_size(self.width, self.height)
        return carrying.Drawing(frame, outlines.coverage(self._drawings[frame], *size))

    def _nothing(self) -> np.ndarray:
        return np.zeros((self.height, self.width), np.float32)

    def _path(self, index: int, first: int | None, last: int | None) -> Path:
        """Return the path of the file for a frame's matte that is made from the drawings at `first` and `last`."""
        key = derived.key({"version": VERSION, "frame": index, "drawn": self._drawn(first, last)})
        name = f"{index:08d}-{key}.png"
        if self._parent and derived.size_of(kept := self._parent / self._folder / name) is not None:
            return kept
        return _writable(self._parent, self._folder) / name

    def _drawn(self, first: int | None, last: int | None) -> list[str]:
        return [self._keys[frame] for frame in (first, last) if frame is not None]

    @cached_property
    def _folder(self) -> str:
        """The name of the folder with this footage's mattes."""
        return f"{self.path.stem[:40]}-{derived.key(derived.identity(self._source))}"

    def _kept(self, path: Path) -> np.ndarray | None:
        """Read the matte (H, W) uint8 in a file; None: the file is missing, damaged or not written by this program."""
        samples = derived.read(path, self._spec, CONFIDENCE)
        return None if samples is None else samples[..., 0]


def displayed_frame(source: FrameSource, frame: int) -> np.ndarray:
    """Read a frame as it is displayed, (H, W, 3) uint8."""
    return flow.displayed(source.read(frame), source.transfer, source.alpha)


@cache
def _writable(parent: Path | None, name: str) -> Path:
    """Return the path of a folder for mattes, which need not exist yet. The answer is cached.

    Args:
        parent: The folder that shall contain it. If it is None or cannot be written to, a temporary folder does.
        name: The name of the folder for mattes.

    Raises:
        MediaError: A temporary folder is needed and cannot be made.
    """
    if parent is not None:
        folder = parent / name
        there = next(filter(os.path.lexists, (folder, *folder.parents)), folder)
        with suppress(OSError):
            if not (folder.is_symlink() and folder.is_dir()):  # derived.own_folder refuses a link
                tempfile.TemporaryFile(dir=there).close()
            return folder
    with _MAKING:
        return Path(_temporary().name, name)


_MAKING = Lock()  # or two threads would each make a folder


@cache
def _temporary() -> tempfile.TemporaryDirectory:
    """Return a temporary folder that is removed when this program ends.

    Raises:
        MediaError: It cannot be made.
    """
    try:
        return tempfile.TemporaryDirectory(prefix=derived.MATTES, ignore_cleanup_errors=True)
    except OSError as error:
        raise MediaError(f"mattes cannot be written anywhere ({error.strerror or error})") from None


def nearest(index: int, frames: Collection[int], reach: float = math.inf) -> tuple[int | None, int | None]:
    """Return the nearest of `frames` before and after `index`, each None if there is none within `reach` frames.

    If `index` is one of `frames`, both are `index`.
    """
    before = max((frame for frame in frames if index - reach <= frame <= index), default=None)
    return before, min((frame for frame in frames if index <= frame <= index + reach), default=None)
