"""Little pictures of the presets' bars, for menus."""

import bpy.utils.previews
import numpy as np

from ...core.model import presets

_SIZE, _WINDOW = 32, 8
_collections: dict = {}  # of Blender's icons, by name


def of(preset: str) -> int:
    """The icon of a preset; 0, which is none, in the background."""
    icons = _collections.get("presets", {})
    return icons[preset].icon_id if preset in icons else 0


def _drawn(bars) -> np.ndarray:
    """Bars as a picture (size, size, 4), bottom row first."""
    picture = np.zeros((_SIZE, _SIZE, 4), dtype=np.float32)
    width = _SIZE // len(bars)
    picture[1, :] = 0.5
    for k, weight in enumerate(bars):
        picture[2 : 2 + round(weight * (_SIZE - 4)), k * width : (k + 1) * width - 1] = (0.9, 0.9, 0.9, 1.0)
    return picture


def register():
    icons = _collections["presets"] = bpy.utils.previews.new()
    for name in presets.PRESETS:
        icon = icons.new(name)
        icon.icon_size = icon.image_size = (_SIZE, _SIZE)
        pixels = _drawn(presets.bars(name, _WINDOW)).ravel()
        icon.icon_pixels_float = icon.image_pixels_float = pixels


def unregister():
    bpy.utils.previews.remove(_collections.pop("presets"))
