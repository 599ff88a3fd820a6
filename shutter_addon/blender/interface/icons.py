"""Little pictures of the presets' bars, for menus, and of the patterns that mattes show, for lists."""

import bpy.utils.previews
import numpy as np
from bpy.utils.previews import ImagePreviewCollection

from ...core.model import presets
from ...core.pixels import patterns

_SIZE, _WINDOW = 32, 8
_UNITS = 16  # of the interface, along each side of an icon
_LIGHT = (0.8, 0.8, 0.8)
_icons: list[ImagePreviewCollection] = []  # of Blender's: one while the extension is registered


def of(name: str) -> int:
    """The icon of a preset; 0, which is none, in the background."""
    return _icons[0][name].icon_id if _icons and name in _icons[0] else 0


def of_pattern(index: int) -> int:
    """The icon of the pattern that the shutter at an index of the list has; 0, which is none, in the background."""
    return of(str(index % patterns.COUNT))


def _drawn(bars: np.ndarray) -> np.ndarray:
    """Bars as a picture (size, size, 4), bottom row first."""
    picture = np.zeros((_SIZE, _SIZE, 4), dtype=np.float32)
    width = _SIZE // len(bars)
    picture[1, :] = 0.5
    for k, weight in enumerate(bars):
        picture[2 : 2 + round(weight * (_SIZE - 4)), k * width : (k + 1) * width - 1] = (0.9, 0.9, 0.9, 1.0)
    return picture


def _painted(index: int) -> np.ndarray:
    """A pattern as a picture (size, size, 4), bottom row first."""
    y, x = (np.mgrid[:_SIZE, :_SIZE] + 0.5) * _UNITS / _SIZE
    picture = np.ones((_SIZE, _SIZE, 4), dtype=np.float32)
    picture[..., :3] = patterns.painted(_LIGHT, index, x, y)
    return picture


def register() -> None:
    _icons.append(bpy.utils.previews.new())
    pictures = {name: _drawn(presets.bars(name, _WINDOW)) for name in presets.PRESETS}
    pictures |= {str(index): _painted(index) for index in range(patterns.COUNT)}
    for name, picture in pictures.items():
        icon = _icons[0].new(name)
        icon.icon_size = icon.image_size = (_SIZE, _SIZE)
        icon.icon_pixels_float = icon.image_pixels_float = picture.ravel()


def unregister() -> None:
    bpy.utils.previews.remove(_icons.pop())
