"""Pictures of recipes without Blender: the values of mattes, which a recipe only names."""

from dataclasses import replace

from shutter_addon.core.model import mattes
from shutter_addon.core.model.effect import (
    FileContent,
    MatteRegion,
    OutlineRegion,
    RampContent,
    drawn_outlines,
    placed_ramp,
)


def with_contents(effect, files=lambda _region: None):
    """Return a recipe's effect with mattes whose values can be read.

    `files` gives the file of a matte, the source's luminance for a ramp, and the mattes of an outline or a subject.
    """
    return effect.with_regions([_with_content(region, files) for region in effect.regions])


def _with_content(region, files):
    if not isinstance(region, MatteRegion):
        return region
    if isinstance(region, OutlineRegion) and region.between == "straight":
        return replace(region, content=drawn_outlines(region.drawings))
    content = region.content
    if isinstance(content, RampContent) and content.ramp != "luminance":
        return replace(region, content=placed_ramp(content.ramp, region.moves))
    frames = mattes.FileFrames(file=files(region))
    if isinstance(content, FileContent):
        frames = replace(frames, offset=content.offset, first=None if content.timing == "source" else 1)
    return replace(region, content=frames)
