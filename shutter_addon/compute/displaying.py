"""Levels as Blender makes them of a picture (core.pixels.shown_levels), on a device.

A device cannot be trusted with powers to the bit. So it takes parabolas, which only add and multiply, and says where
these are too near to where a level ends; the few such pixels, one in some hundred, are asked of the display itself.
"""

import numpy as np

from ..core.memo import Memo
from ..core.pixels.shown_levels import Display
from ..devices.device import Device, NamedTextures, Texture
from ..devices.passes import read_pass

_OCTAVES, _LOWEST = 10, -9  # from here on, to 2; below, the display is linear
_SHIFT = 18  # of a float's bits, for a piece of 1/32 of an octave
_FIRST = (127 + _LOWEST) << (23 - _SHIFT)
_PIECES = _OCTAVES << (23 - _SHIFT)
_PROBED = 128  # values of each piece, of which the parabola is made
# How far off a device's own arithmetic may be, in levels; and how much worse than at the probed values it may be.
_ROUNDING, _DOUBT = 1.2e-4, 2.0
_AT_ONCE = 256, 64  # pixels that are asked for, columns and rows

_LIMITS = {"FIRST": f"{_FIRST}u", "LOWEST": repr(2.0**_LOWEST), "HIGHEST": repr(2.0 - 2**-23)}
SHOW = read_pass("display", "SHOW", **_LIMITS)
PICK = read_pass("display", "PICK")


class Displaying:
    """Makes levels of pictures on a device."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._textures = NamedTextures(device)
        self._sent: Memo[tuple[dict[str, Texture], float]] = Memo()  # of a display

    def levels(self, picture: Texture, display: Display) -> np.ndarray:
        """The levels (H, W, 4) uint8 of an opaque picture of GPUCompositor.draw, top row first."""
        width, height, _ = picture.size
        noise, levels = display.noise(width, height), self._textures.of("levels", (width, height, 1), "rgba8")
        images = {"picture": picture, "levels": levels}
        own, slope = self._sent.get((display, width, height), lambda: self._send(display, noise))
        images |= own
        self._device.run(SHOW, (width, height), images=images, size=(width, height), slope=slope)
        made = self._device.read(levels)[0]
        whole = made.view("<u4")  # the alpha lies in its highest bits
        unsure = np.flatnonzero(whole < 1 << 24)
        rows, columns = np.divmod(unsure, width)
        rows = height - 1 - rows  # in pictures, from the bottom
        if unsure.size:
            light = self._picked(picture, rows * width + columns)
            found = np.full((unsure.size, 4), 255, np.uint8)
            found[:, :3] = display.levels(light, noise[rows, columns])
            whole.reshape(-1)[unsure] = found.view("<u4")[:, 0]
        return made

    def _picked(self, picture: Texture, places: np.ndarray) -> np.ndarray:
        """The light (n, 3) of pixels, by their numbers."""
        columns, most = _AT_ONCE
        found = []
        for start in range(0, len(places), columns * most):
            part = places[start : start + columns * most]
            rows = -(-len(part) // columns)
            numbers = np.zeros((rows, columns, 1), np.uint32)
            numbers.ravel()[: len(part)] = part
            sent = self._textures.of("places", (*_AT_ONCE, 1), "r32ui")
            picked = self._textures.of("picked", (*_AT_ONCE, 1), "rgba32f")
            self._device.write(sent, numbers)
            images, size = {"picture": picture, "places": sent, "picked": picked}, (columns, rows)
            self._device.run(PICK, size, images=images, size=size, width=picture.size[0])
            found.append(self._device.read(picked)[0].reshape(-1, 4)[: len(part), :3])
        return np.concatenate(found)

    def _send(self, display: Display, noise: np.ndarray) -> tuple[dict[str, Texture], float]:
        """The textures of the noise and the curve; and OpenColorIO's slope below that, which is no 12.92."""
        slope = 255 * float(display.transfer(np.array([2.0**_LOWEST], np.float32))[0]) / 2.0**_LOWEST
        grain = self._textures.filled("grain", [noise], "r32f")
        return {"grain": grain, "curve": self._textures.filled("curve", [_curve(display)])}, slope

    def release(self) -> None:
        """Frees what it has on the device, inside Device.freeing."""
        self._textures.release()
        self._sent.clear()


def _curve(display: Display) -> np.ndarray:
    """The pieces (1, n, 4) float32 of the curve: as in shaders/display.glsl."""
    starts = np.arange(_FIRST, _FIRST + _PIECES, dtype=np.uint32) << np.uint32(_SHIFT)
    steps = np.linspace(0, (1 << _SHIFT) - 1, _PROBED).astype(np.uint32)
    values = display.transfer((starts[:, None] + steps).view(np.float32)).astype(np.float64) * 255
    powers = np.vander(steps / (1 << _SHIFT) - 0.5, 3)
    found = np.linalg.lstsq(powers, values.T, rcond=None)[0]
    off = np.abs(powers @ found - values.T).max(axis=0)
    pieces = np.concatenate([found, _DOUBT * off[None] + _ROUNDING]).T
    return np.ascontiguousarray(pieces[None], np.float32)
