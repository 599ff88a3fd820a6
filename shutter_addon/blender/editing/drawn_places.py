"""What is drawn is seen where it is drawn, however its region moves: where that was as a drawing was made is noted."""

from contextlib import suppress
from itertools import repeat

import numpy as np
from bpy.types import PropertyGroup, Strip

from ...core.messages import EffectError
from ...core.model.effect import Drawings
from ...core.model.motions import Placement
from ..data import snapshot, strips
from ..data.sampled import Sampling
from . import outline_drawings, region_edits
from .motion_keys import MotionKeys


def hold(effect: PropertyGroup, index: int) -> None:
    """Notes where a region was as its drawings were made, before it is moved: from then on they move with it."""
    region = effect.regions[index]
    if region.kind not in strips.LAID:
        _note(effect, region, _origins(Sampling.of(effect.id_data, effect, None, ()).drawings(index)))


def begin(effect: PropertyGroup, strip: Strip, index: int, *, erases: bool = False) -> None:
    """Makes the current frame ready for the pen: what it draws is seen there. What is drawn at that frame already is
    stored where it is seen; for the eraser, so is all of the region that is seen elsewhere than it is stored.
    EffectError: the region lies nowhere."""
    region, scene = effect.regions[index], effect.id_data
    frame = scene.frame_current
    if region.kind in strips.LAID:
        return
    shown = snapshot.region_at(scene, effect, strip, index, (frame,))
    here, origins = shown.placement(frame), _origins(shown.drawings)
    is_elsewhere = any(origin != here for origin in origins.values())
    if origins.get(frame, here) != here or (erases and is_elsewhere and frame not in origins):
        outline_drawings.draw(effect, strip, region, shown.at(frame).strokes, frame)
    if MotionKeys(effect, index, region.motion).are_made():
        with suppress(EffectError):  # where curves are locked, Track does not come either
            region_edits.key_region(effect, index)
    _note(effect, region, {**origins, frame: here})


def _origins(drawings: Drawings) -> dict[float, Placement]:
    """By frame, where the region was as it was drawn."""
    return dict(zip(drawings.frames, drawings.origins or repeat(Placement()), strict=False))


def _note(effect: PropertyGroup, region: PropertyGroup, origins: dict[float, Placement]) -> None:
    region.drawn.clear()
    for frame, origin in origins.items():
        noted = region.drawn.add()
        noted.frame, noted.location = frame - effect.start, origin.location
        noted.rotation, noted.scale = np.radians(origin.rotation), origin.scale
