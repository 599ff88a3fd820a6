"""Regions that become subjects, and what subjects become in turn: outlines and scribbles."""

from contextlib import closing

from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import PropertyGroup, Scene, Strip

from ...core.messages import EffectError
from ...media.subject import Network, found_under
from ..data import annotations, preferences, snapshot
from . import outline_drawings, region_edits


def find(scene: Scene, effect: PropertyGroup, strip: Strip, index: int) -> bool:
    """Make a region a subject if the model finds one under its last stroke at the current frame.

    Returns:
        Whether it has found one.

    Raises:
        EffectError: There are no strokes.
        MediaError: There is no picture or no model.
    """
    region = effect.regions[index]
    strokes = snapshot.region_at(scene, effect, strip, index, (scene.frame_current,)).at(scene.frame_current).strokes
    if not strokes:
        raise EffectError(rpt_("The region has no strokes at the current frame"))
    network = Network(preferences.model())
    if found_under(network, outline_drawings.picture_now(scene, effect, strip), strokes[-1]) is None:
        return False
    region.kind, region.motion = "SUBJECT", "LOCATION"
    return True


def is_first_stroke(effect: PropertyGroup, region: PropertyGroup) -> bool:
    """Return whether a region has its first stroke, which may make it a subject."""
    layer = annotations.layer_of(effect, region)
    drawn = sum(len(drawing.strokes) for drawing in layer.frames) if layer else 0
    return region.finds_subject and region.kind == "LINE" and drawn == 1


def to_outline(scene: Scene, effect: PropertyGroup, strip: Strip, index: int) -> bool:
    """Make a subject an outline, which is drawn where the subject has strokes or drawings.

    Returns:
        Whether it encloses anything.

    Raises:
        EffectError, MediaError: Its mattes cannot be made.
    """
    region = effect.regions[index]
    layers = [annotations.layer_of(effect, region, name) for name in ("layer", "outline_layer")]
    frames = sorted({drawing.frame_number for layer in layers if layer for drawing in layer.frames})
    file, shown = snapshot.carried_outline(scene, effect, strip, index, frames)
    with closing(file.open()) as mattes:
        for frame in frames:
            mattes.read(shown[frame])
        curves = {frame: mattes.curves(shown[frame]) for frame in frames}
    if not any(curves.values()):
        return False
    region_edits.remove_layers(effect, region)
    region.kind = "OUTLINE"
    for frame, drawn in curves.items():
        outline_drawings.draw(effect, strip, region, drawn, frame)
    return True
