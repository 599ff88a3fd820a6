"""Running sums of frames along time on a device, by which a long exposure costs no more than a short one.

The sum of any successive frames is the difference of two running sums. When a window moves by a frame, one sum is made.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator

import numpy as np

from ..core.frames.frame_source import TILE, FrameSource, Moment, Planes, as_rgba, chroma_step
from ..core.model import windows
from ..core.model.frame_state import Light, Options
from ..core.stopping import kept
from .devices import llvmpipe
from .devices.device import Device, Given, Texture
from .devices.passes import Pass, read_pass
from .layer_frames import WeightedFrames
from .window import Part, Window, decoding

_LISTED = 256  # tiles in a row of a list, as in shaders/accumulate.glsl


# What running sums are stored as, by COVER of shaders/include/sums.glsl.
STORED_SUMS = ("rgba16ui", "rgba32ui", "rgba32ui")


def accumulation(decode: int, sent: str, back: bool, tiled: int, cover: int = 0, kind: int = 1) -> Pass:
    """Return the shader pass that computes a running sum from the one beside it.

    The pass adds or subtracts the frame between the two.

    Args:
        decode: How it converts samples, from `decoding`.
        sent: In which form the frame is on the device: "COLOURS" (RGBA), "NUMBERS" (one number per pixel, see
            Device.send), "PLANES" (luma and chroma), or "MOMENT" (a frame that the pass computes from two filmed ones).
            "AGAIN": nothing was sent, since the sums hold this frame at another position; it is the difference of two
            of them.
        back: Whether the frame is subtracted, to move the window back.
        tiled: Sums.tiled.
        cover: Which weights the frames are multiplied by: 0 none, 1 those of a layer, 2 those of the background behind
            layers.
        kind: For "MOMENT", which way of making it the shader uses: the value 1, 2 or 3 of its macro MOMENT, from
            `_by_level`.
    """
    macros = {"DECODE": decode, "BACK": int(back), "TILED": tiled, "COVER": cover, sent: kind}
    return read_pass("accumulate", STORED=STORED_SUMS[cover], **macros)


def _in_fours(plane: np.ndarray) -> np.ndarray:
    """Return samples uint8 (h, w) as uint32 (h, ⌈w/4⌉), each of four samples side by side."""
    if missing := -plane.shape[1] % 4:
        plane = np.pad(plane, ((0, 0), (0, missing)))
    return np.ascontiguousarray(plane).view(np.dtype("<u4"))


def _by_level(moment: Moment, part: Part, given: Given) -> Iterator[tuple[int, tuple[int, int], Given]]:
    """Yield the shader passes that add a computed frame to a part of the window.

    In tiles that move little or are smooth, the frame needs fewer lookups along the motion (Moment.levels). Tiles of
    equal level share a pass. A level without tiles in this part needs none.

    Args:
        moment: The computed frame.
        part: The part of the window.
        given: Arguments of the shader that all passes have.

    Yields:
        The value of the shader's macro MOMENT (1, 2 or 3), the size (width, height) of the pass in invocations, and all
        its arguments: `given` and those of the level.
    """
    (across, down), listed = TILE, 0
    rows = part.top // down, -(-(part.top + part.height) // down)
    for level in range(int(moment.levels.max()) + 1):
        down_to = np.nonzero(moment.levels == level)[0]
        first, last = (listed + np.searchsorted(down_to, rows)).tolist()
        listed += len(down_to)
        if first < last:
            ends = moment.number, moment.number + given["count"] - 1
            keys = ((ends[0] << level) - 1) // moment.steps, -(-(ends[1] << level) // moment.steps)
            kind = 1 if level == 0 else 2 if keys[0] == 0 else 3
            extent = across * min(last - first, _LISTED), down * -(-(last - first) // _LISTED)
            yield kind, extent, given | {"listed": (first, last), "level": level, "keys": keys}


class Sums(Window):
    """A window of running sums of opaque 8-bit frames: any successive frames are the difference of two sums.

    A position is a source frame's number, as if the footage had no ends. The sum at position p is the light of all
    frames before p, counted from an arbitrary frame. So only differences have a meaning: the sum at p + 1 less the sum
    at p is the frame at p. Beyond the shot's ends, Options.edges chooses the frame.

    The sum at position p is in layer p mod `layers` of the window. Textures are rgba16ui: 64 bits for each pixel, of
    which each color has 21. Sums are integers that wrap around, so differences are exact. If the window moves by a
    frame, onwards or back, only one new sum is made.

    Attributes:
        start, stop: The positions of the first and the last sum that it holds.
        whole: The number that stands for white in a frame's light.
        tiled: How pixels lie in the textures, the macro TILED of shaders/include/sums.glsl. 0: as in the picture.
            Otherwise tile by tile, which is faster on the software renderer llvmpipe.
    """

    def __init__(self, device: Device, source: FrameSource, capacity: int, shutters: int = 1) -> None:
        self.layers = capacity + 1
        self.start = self.stop = 0
        self._frames: dict[int, int] = {}  # position: source frame
        self._light: Light | None = None
        self._vectors: np.ndarray | None = None  # those on the device
        self._sent: dict[int, int] = {}  # by layer of `_filmed`: the number of the frame in it
        # White is the largest 2ⁿ − 1 for which the sum of a whole window fits into 21 bits, and n is 16 at most.
        self.whole = (1 << min(16, 21 - (capacity - 1).bit_length())) - 1
        self.kind = STORED_SUMS[self.cover]
        # A workgroup reads all layers of its pixels. In tiles, they are one run of memory.
        across, down = TILE
        fits = across * down * self.layers <= device.max_size and -(-source.height // down) <= device.max_layers
        # Moments are made together, and lie together.
        self.tiled = (8 if source.step > 1 else 1) if llvmpipe.is_llvmpipe(device.name) and fits else 0
        self.layers += -self.layers % max(self.tiled, 1)
        super().__init__(device, source, capacity, shutters)

    @property
    def held(self) -> Collection[int]:
        """The source frames that are summed."""
        return self._frames.values()

    def load(self, positions: np.ndarray, options: Options, shot: range) -> None:
        """Sum the frames at all positions from the lowest to the highest of the given ones.

        Sums that the window holds already are kept where they are of use. A frame that it has summed is not read again.

        Args:
            positions: Frame numbers from core.model.windows.positions, at most `capacity` − 1 apart.
            options: FrameState.options of the picture.
            shot: The source frames of the shot. Beyond it, options.edges chooses the frame
                (core.model.windows.source_frames).
        """
        self.device.use(self.release)
        self.shot = shot
        first, last = int(positions.min()), int(positions.max()) + 1
        frames = windows.source_frames(options, np.arange(first, last), shot).tolist()
        if not self._continues(first, frames, options):
            self._light, self._frames = options.light, {}
            self.start = self.stop = first
        while self.stop < last:
            next_ = self._together(frames[self.stop - first :], decoding(self.source.transfer, options.light))
            self._keep(max(self.start, self.stop + len(next_) - self.capacity), self.stop)
            self.stop += self._add(options.light, next_, self.stop, self.stop + 1)
        while self.start > first:
            self._keep(self.start, min(self.stop, self.start - 1 + self.capacity))
            self._add(options.light, [frames[self.start - 1 - first]], self.start, self.start - 1)
            self.start -= 1

    def _continues(self, first: int, frames: list[int], options: Options) -> bool:
        """Return whether the window's sums can be extended to new positions, or have to be made anew.

        They can if they are of the same light (Options.light), if both ranges of positions touch or overlap, and if
        they show the same frames where they overlap.

        Args:
            first: The first of the new positions.
            frames: The source frames at the new positions, in order.
            options: FrameState.options of the picture.
        """
        last = first + len(frames)
        overlap = range(max(first, self.start), min(last, self.stop))
        return (
            self._light == options.light
            and first <= self.stop
            and self.start <= last
            and all(self._frames[position] == frames[position - first] for position in overlap)
        )

    def _keep(self, start: int, stop: int) -> None:
        """Give up all sums but those from position `start` to `stop`."""
        self.start, self.stop = start, stop
        self._frames = {position: frame for position, frame in self._frames.items() if start <= position < stop}

    def _together(self, frames: list[int], decode: int) -> list[int]:
        """Return the source frames that the next pass adds: the first of those given, and perhaps some after it.

        One pass can add several successive frames that are computed between the same two filmed frames; then also the
        second of these, if `decode` is 1. It adds only one frame if that is filmed, if frames have weights, or if the
        sums hold any of these frames already.

        Args:
            frames: The source frames that are still to be added, in order.
            decode: How the pass converts samples, from `decoding`.
        """
        step, first = self.source.step, frames[0]
        pair = range(first, first - first % step + step + (decode == 1))
        if self.cover or first % step == 0 or any(frame in pair for frame in self.held):
            return frames[:1]
        return [frame for frame, wanted in zip(frames, pair, strict=False) if frame == wanted]

    def _add(self, light: Light, frames: list[int], known: int, next_: int) -> int:
        """Make the sum at a position from the sum beside it and the source frame between the two.

        If several frames are given and computed together, the sums at the positions after it are made, too.

        Args:
            light: Options.light: in which light frames are summed.
            frames: The source frame between the two positions, and the frames that the same pass may add (`_together`).
            known: The position of the sum that is there.
            next_: The position of the sum to make: known + 1, or known − 1 to go back.

        Returns:
            The number of sums that were made.
        """
        frame = frames[0]
        # A position that shows this frame already: it need not be read.
        same = next((position for position, held in self._frames.items() if held == frame), None)
        given: Given = {"known": known % self.layers, "next": next_ % self.layers}
        if same is None:
            sent, arguments = self._send(frames)
            given |= arguments | {"whole": float(self.whole)}
        else:
            sent = "AGAIN"
            given |= {"before": same % self.layers, "after": (same + 1) % self.layers}
        decode, images, moment = decoding(self.source.transfer, light), given.pop("images", {}), given.pop("of", None)
        for part, sums in self.stored():
            size = self.source.width, part.height
            runs = [(1, size, given)] if moment is None else _by_level(moment, part, given)
            for kind, extent, arguments in runs:
                program = accumulation(decode, sent, next_ < known, self.tiled, self.cover, kind)
                self.device.run(program, extent, images=images | {"sums": sums}, size=size, top=part.top, **arguments)
        frames = frames[: given.get("count", 1)]
        self._frames |= dict(enumerate(frames, min(known, next_)))
        kept()
        return len(frames)

    def _size(self, part: Part) -> tuple[int, int, int]:
        if not self.tiled:
            return super()._size(part)
        # A row of texels has all layers of a tile, a layer of texels a row of tiles.
        across, down = TILE
        return across * down * self.layers, -(-self.source.width // across), -(-part.height // down)

    def _send(self, frames: list[int]) -> tuple[str, Given]:
        """Send to the device what the next pass needs of a source frame: the frame, or what it is computed from.

        Args:
            frames: The source frame, then the frames that the same pass may add (`_together`).

        Returns:
            The form in which it was sent (`sent` of `accumulation`), and the pass's arguments for it.
        """
        frame = self.source.decoded(frames[0])
        if isinstance(frame, Planes) and self.device.takes_planes:
            return "PLANES", self._send_planes(frame)
        if isinstance(frame, Moment):
            if frames[-1] % self.source.step == 0:
                self.source.decoded(frames[-1])  # as guides note it, and what was decoded ahead is taken
            return "MOMENT", self._send_moments(frame, len(frames))
        own = self._own("frame", "rgba8")
        sent = self.device.send(own, as_rgba(frame))
        return "COLOURS" if sent is own else "NUMBERS", {"textures": {"frame": sent}}

    def _send_planes(self, frame: Planes) -> Given:
        """Send the planes of a frame, and return the arguments of the pass that adds it."""
        luma = self._extra.filled("luma", [_in_fours(frame.luma)], "r32ui")
        chroma = self._extra.filled("chroma", [_in_fours(plane) for plane in frame.chroma], "r32ui")
        matrix = frame.matrix
        return {
            "images": {"luma": luma, "chroma": chroma},
            "chroma_step": (chroma_step(self.source.width), chroma_step(self.source.height)),
            "luma_of": (matrix.offset, matrix.luma),
            "red_of": matrix.red_of_cr,
            "green_of": (matrix.green_of_cb, matrix.green_of_cr),
            "blue_of": matrix.blue_of_cb,
        }

    def _send_moments(self, first: Moment, count: int) -> Given:
        """Send what computed frames are made from: two filmed frames and the motion between them.

        What is on the device already is not sent again.

        Args:
            first: The first frame to add; the others are computed from the same two filmed frames.
            count: How many successive frames the pass adds.

        Returns:
            The arguments of the pass that computes and adds them.
        """
        layers, height, width, _ = first.vectors.shape
        vectors = self._extra.of("vectors", (width, height, layers), "rgba16")
        rows = -(-first.levels.size // _LISTED)
        tiles = self._extra.of("tiles", (_LISTED, rows, 1), "r32f")
        if self._vectors is not first.vectors:
            for layer, values in enumerate(first.vectors):
                self.device.write(vectors, values, layer)
            order = np.argsort(first.levels, axis=None, kind="stable")
            down, across = np.divmod(order, first.levels.shape[1])
            listed = np.zeros((rows, _LISTED), np.float32)
            listed.flat[: len(order)] = across + 4096 * down
            self.device.write(tiles, listed)
            self._vectors = first.vectors
        filmed, start = self._filmed(first)
        return {
            "of": first,
            "textures": {"tiles": tiles},
            "images": {"filmed": filmed, "vectors": vectors},
            "moment": (first.number, first.steps, layers + 1, start),
            "count": count,
            "layers": self.layers,
        }

    def _filmed(self, moment: Moment) -> tuple[Texture, int]:
        """Send the two filmed frames from which a frame is computed, unless they are on the device already.

        Args:
            moment: The computed frame.

        Returns:
            A texture array with both filmed frames, one per layer, and the layer (0 or 1) of the earlier one.
        """
        texture = self._extra.of("filmed", (self.source.width, self.source.height, 2), "r32ui")
        sent = self._sent
        start = int(sent.get(1) == moment.pair[0] or sent.get(0) == moment.pair[1])
        for layer, number, frame in zip((start, 1 - start), moment.pair, moment.ends, strict=True):
            if sent.get(layer) != number:
                numbers = frame.view("<u4")[..., 0] & 0xFFFFFF  # without the alpha: Blender's device sends floats
                self.device.write(texture, numbers, layer)
                sent[layer] = number
        return texture, start

    def release(self) -> None:
        self._frames, self._light, self._sent, self._vectors = {}, None, {}, None
        super().release()


class WeightedSums(Sums):
    """A window of running sums for a layer or the background: of frames times weights, and of the weights.

    The frames are opaque and 8-bit. Textures are rgba32ui: red, green, blue, and the sum of weights (for the
    background, of 1 − weight), with 32 bits each. Where all weights of the background are 1, its picture is equal to
    that from Sums in every bit.
    """

    def __init__(self, device: Device, source: WeightedFrames, capacity: int, shutters: int = 1) -> None:
        self.cover, self._weight = 2 if source.rest else 1, source.weight
        super().__init__(device, source.base, capacity, shutters)

    def _send(self, frames: list[int]) -> tuple[str, Given]:
        weights = self._extra.filled("weights", [self._weight(frames[0])], "r32f")
        sent, given = super()._send(frames)
        given["textures"] = given.get("textures", {}) | {"weights": weights}
        return sent, given
