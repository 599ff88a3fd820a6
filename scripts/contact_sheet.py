"""A contact sheet of a film made with a recipe: a column each for source, scribbles, coefficients and result.

python scripts/contact_sheet.py SOURCE RECIPE RESULT SHEET.png [FRAME ...]
"""

import sys
from pathlib import Path

import numpy as np
import OpenImageIO

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from shutter_addon.compute.renderer import Renderer, open_compositor
from shutter_addon.core import recipe, scribbles
from shutter_addon.media import open_source

SMALLER = 2
GAP = 8


def main(source_path, recipe_path, result_path, sheet_path, *frames):
    source, result, effect = open_source(source_path), open_source(result_path), recipe.load(recipe_path)
    colors = np.array([shutter.color for shutter in effect.shutters])
    compositor, _ = open_compositor()
    renderer = Renderer(compositor, source)
    frames = [int(frame) for frame in frames] or np.linspace(1, result.count, 5).astype(int)
    rows = []
    for frame in frames:
        moment = effect.at(frame, source.width / source.height)
        picture = source.read(frame - 1)[..., :3] / 255
        labels = scribbles.rasterise(moment.shapes, source.width, source.height, border=moment.options.border)
        drawn = picture * 0.4
        drawn[labels > 0] = colors[labels[labels > 0] - 1]
        block = moment.options.aggregate
        mixed = np.tensordot(renderer.coefficients(moment), colors, axes=(0, 0)).repeat(block, 0).repeat(block, 1)
        mixed = mixed[: source.height, : source.width]
        rows.append(row(picture, drawn, mixed, result.read(frame - 1)[..., :3] / 255))
    sheet = np.concatenate(rows)
    OpenImageIO.ImageBuf(np.ascontiguousarray((sheet * 255 + 0.5).astype(np.uint8))).write(str(sheet_path))


def row(*pictures):
    """The pictures side by side, smaller, with a gap to the right and below."""
    return np.concatenate(
        [np.pad(smaller(p), ((0, GAP), (0, GAP), (0, 0)), constant_values=1) for p in pictures], axis=1
    )


def smaller(picture):
    height, width = (n // SMALLER * SMALLER for n in picture.shape[:2])
    return picture[:height, :width].reshape(height // SMALLER, SMALLER, width // SMALLER, SMALLER, 3).mean(axis=(1, 3))


if __name__ == "__main__":
    main(*sys.argv[1:])
