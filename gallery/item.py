"""What an item of the gallery is, and the pictures that its still is made of. No bpy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from gallery.matte_contents import with_contents
from shutter_addon.compute.renderer import Renderer, open_compositor
from shutter_addon.compute.request import Request
from shutter_addon.core.frames import light
from shutter_addon.core.model import scribbles
from shutter_addon.core.model.clip import Clip
from shutter_addon.core.model.effect import Effect, FileContent, MatteRegion
from shutter_addon.core.model.state_at import state_at
from shutter_addon.core.recipes import recipe_file
from shutter_addon.media import open_source
from shutter_addon.media.matte_values import MatteValues
from shutter_addon.media.opening import MatteFile

ROOT = Path(__file__).resolve().parents[1]
HERE = ROOT / "gallery"
ASSETS = ROOT / "assets"


def bunny(_folder: Path) -> Path:
    """Footage that comes with the project: Big Buck Bunny."""
    return ASSETS / "bigbuckbunny.mp4"


def walkers(_folder: Path) -> Path:
    return ASSETS / "walkers.mp4"


@dataclass(frozen=True)
class Item:
    """A figure of the paper, or one beyond it.

    footage: gets a folder for what it renders, returns the source: a movie, or the first file of a sequence
    recipes: names of files beside the module; each becomes a film and a .blend of the same name
    frames: the film's first and last timeline frame
    still: makes the still, a picture (h, w, 3) of 0 to 1, of a shot for each recipe
    figure: its number in the paper
    """

    name: str
    title: str
    footage: Callable[[Path], Path]
    recipes: tuple[str, ...]
    frames: tuple[int, int]
    still: Callable[..., np.ndarray]
    figure: int | None = None


@dataclass(frozen=True)
class Shot:
    """Footage, a recipe, and the film that was rendered with them from the frame `first` on.

    Frames are timeline frames, 1 = the clip's first. Pictures are (height, width, 3) float32, code values of 0 to 1.
    """

    footage: Path
    recipe: Path
    film: Path
    first: int

    def source(self, frame: int) -> np.ndarray:
        picture = self._source.read(frame - 1)
        if self._source.transfer == "linear":
            return np.clip(light.to_encoded(picture[..., :3].astype(np.float32)), 0, 1)
        return picture[..., :3] / np.float32(np.iinfo(picture.dtype).max)

    def result(self, frame: int) -> np.ndarray:
        return self._film.read(frame - self.first)[..., :3] / np.float32(255)

    def everywhere(self, frame: int, shutter: str) -> np.ndarray:
        """The picture if one shutter held everywhere, as in a camera."""
        picture = self._renderer.picture(Request(frame - 1, self.effect.at(frame).of([self._index(shutter)])))
        return np.clip(light.to_encoded(picture[..., :3]), 0, 1)

    def scribbles(self, frame: int, dim: float = 0.6) -> np.ndarray:
        """The scribbles in their shutters' colors, a little transparent, over the darkened footage."""
        picture = self.source(frame) * np.float32(dim)
        height, width = picture.shape[:2]
        border = self.contents.options.at(1).border
        labels = scribbles.rasterise(self.effect.drawn_at(frame), width, height, border=border)
        picture[labels > 0] = 0.25 * picture[labels > 0] + 0.75 * self._colors[labels[labels > 0] - 1]
        return picture

    def coefficients(self, frame: int) -> np.ndarray:
        """How much of each shutter a pixel gets, in the shutters' colors."""
        request = Request(*state_at(self.effect, Clip.of(self._source), frame))
        values = self._renderer.coefficients_with_layers(request)
        return np.tensordot(values, self._colors, axes=(0, 0))

    def bars(self, frame: int, shutter: str) -> tuple[np.ndarray, np.ndarray]:
        """A shutter's bars (L,) at a frame, and its color (3,)."""
        index = self._index(shutter)
        return self.effect.at(frame).bars[index], self._colors[index]

    @cached_property
    def contents(self) -> Effect:
        return recipe_file.load(self.recipe)

    @cached_property
    def effect(self) -> Effect:
        return with_contents(self.contents.for_picture(self._source.width / self._source.height), self._matte)

    @cached_property
    def _source(self):
        return open_source(self.footage)

    @cached_property
    def _film(self):
        return open_source(self.film)

    @cached_property
    def _renderer(self) -> Renderer:
        mattes = MatteValues(self._source.width, self._source.height)
        return Renderer(open_compositor(), self._source, mattes)

    @property
    def _colors(self) -> np.ndarray:
        return np.array([shutter.color for shutter in self.contents.shutters], dtype=np.float32)

    def _index(self, shutter: str) -> int:
        return [each.name for each in self.contents.shutters].index(shutter)

    def _matte(self, region: MatteRegion) -> MatteFile:
        """What a matte is read from: its file, or for a ramp of luminance the footage."""
        if isinstance(region.content, FileContent):
            return MatteFile(self.recipe.parent / region.content.path, region.content.channel)
        return MatteFile(self.footage)
