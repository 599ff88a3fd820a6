"""Regions that become subjects."""

from contextlib import closing

from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import PropertyGroup, Scene, Strip

from ...core.messages import EffectError
from ..data import annotations, snapshot
from . import outline_drawings


def find(scene: Scene, effect: PropertyGroup, strip: Strip, index: int) -> bool:
    """Make a region a subject if the model finds one under the strokes that are nearest to the current frame; an
    outline becomes one by its drawings, which stay.

    Returns:
        Whether it has found one.

    Raises:
        EffectError: There are no strokes.
        MediaError: There is no picture or no model.
    """
    region, before = effect.regions[index], effect.regions[index].kind
    if before == "OUTLINE":
        region.kind, region.layer, region.outline_layer = "SUBJECT", "", region.layer
        return True
    frame = outline_drawings.nearest(effect, index, scene.frame_current)
    if not snapshot.strokes_at(scene, effect, strip, index, frame):
        raise EffectError(rpt_("The region has no strokes at the current frame"))
    region.kind, is_found = "SUBJECT", False
    try:
        file, shown = snapshot.carried_outline(scene, effect, strip, index, (frame,))
        with closing(file.open()) as mattes:  # its first matte is kept, and shown at once
            mattes.read(shown[frame])
            is_found = bool(mattes.confidence(shown[frame]))
    finally:
        if not is_found:
            region.kind = before
    if is_found:
        region.motion = "LOCATION"
    return is_found


def is_first_stroke(effect: PropertyGroup, region: PropertyGroup) -> bool:
    """Return whether a region has its first stroke, which may make it a subject."""
    layer = annotations.layer_of(effect, region)
    drawn = sum(len(drawing.strokes) for drawing in layer.frames) if layer else 0
    return region.finds_subject and region.kind == "LINE" and drawn == 1
