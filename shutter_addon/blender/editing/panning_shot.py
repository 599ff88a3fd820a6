"""Whether a panning shot (layer_presets.py) can be made: like a camera's that pans with its subject, which is sharp
while all that stands still streaks."""

from bpy.app.translations import pgettext_rpt as rpt_

from ...core.messages import EffectError
from ..data import snapshot
from .motion_keys import MotionKeys


def is_ready(scene, effect, strip, index: int) -> bool:
    """Whether a region has keys of motion, and those that were tracked reach the current frame; without, it has to be
    tracked first. EffectError: it has keys, and no strokes that could be followed."""
    if not MotionKeys(effect, index, "SCALE").reach(scene.frame_current):
        return False
    if not snapshot.strokes_at(scene, effect, strip, index, scene.frame_current):
        raise EffectError(rpt_("the region has no strokes to follow"))
    return True
