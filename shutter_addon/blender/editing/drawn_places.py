"""Keep strokes where they were drawn: note the placement that a moving region had for each drawing."""

from contextlib import suppress
from itertools import repeat

import numpy as np
from bpy.types import PropertyGroup, Strip

from ...core.messages import EffectError
from ...core.model.effect import Drawings
from ...core.model.motions import Placement
from ..data import snapshot, strips
from ..data.sampled import Sampling
from . import motion_keys, region_edits


def hold(effect: PropertyGroup, index: int) -> None:
    """Note the placement of a region for its drawings before it is moved. From then on they move with it."""
    region = effect.regions[index]
    if region.kind not in strips.LAID:
        _note(effect, region, _origins(Sampling.of(effect.id_data, effect, None, ()).drawings(index)))


def begin(effect: PropertyGroup, strip: Strip, index: int, *, erases: bool = False) -> None:
    """Prepare the current frame for the pen, so that strokes appear where they are drawn.

    A drawing of this frame is first stored where it appears. The eraser also needs the strokes that another frame's
    drawing shows here, so they are stored at this frame, too.

    Raises:
        EffectError: the region has no placement.
    """
    region, scene = effect.regions[index], effect.id_data
    frame = scene.frame_current
    if region.kind in strips.LAID:
        return
    shown = snapshot.region_at(scene, effect, strip, index, (frame,))
    here, origins = shown.placement(frame), _origins(shown.drawings)
    is_elsewhere = any(origin != here for origin in origins.values())
    if origins.get(frame, here) != here or (erases and is_elsewhere and frame not in origins):
        region_edits.draw_curves(effect, strip, region, shown.at(frame).strokes, frame)
    if motion_keys.MotionKeys(effect, index, region.motion).are_made():
        with suppress(EffectError):  # with locked curves, tracking stops, too
            motion_keys.insert(effect, index)
    _note(effect, region, {**origins, frame: here})


def _origins(drawings: Drawings) -> dict[float, Placement]:
    """Return the placement of the region for each drawing, by frame."""
    return dict(zip(drawings.frames, drawings.origins or repeat(Placement()), strict=False))


def _note(effect: PropertyGroup, region: PropertyGroup, origins: dict[float, Placement]) -> None:
    region.drawn.clear()
    for frame, origin in origins.items():
        noted = region.drawn.add()
        noted.frame, noted.location = frame - effect.start, origin.location
        noted.rotation, noted.scale = np.radians(origin.rotation), origin.scale
