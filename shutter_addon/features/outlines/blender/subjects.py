"""Regions that become subjects, and what subjects become in turn: outlines and scribbles."""

from contextlib import closing

from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import PropertyGroup, Scene, Strip

from ....blender.data import annotations, snapshot
from ....blender.editing import region_edits
from ....core.messages import EffectError
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


def to_outline(scene: Scene, effect: PropertyGroup, strip: Strip, index: int) -> bool:
    """Turn a subject into an outline, with a drawing at each frame that has strokes or drawings of the subject.

    Returns:
        Whether the outline encloses anything. If not, the subject stays.

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
        region_edits.draw_curves(effect, strip, region, drawn, frame)
    return True
