"""A still effect is its source, whatever that is: strips drawn at random. SHUTTER_SEEDS (1,2,3) tries others than CI
does."""

import os

import numpy as np
import pytest
import random_strips
from support import effect_of, recipe

SEEDS = [int(seed) for seed in os.environ.get("SHUTTER_SEEDS", "1,4,7,18,21,42").split(",")]
LEVELS = 1


@pytest.mark.parametrize("seed", SEEDS)
def test_still_effects_are_their_sources(bpy, edit, render, tmp_path, seed):
    drawn = random_strips.build(edit, tmp_path / "footage", seed)
    plain = render(edit, drawn.frames)
    effect_of(edit, drawn.strip, recipe(1, [1]))
    bpy.context.view_layer.update()
    drawn.strip.mute = True  # or it would be seen a second time at edges that cover half of a pixel
    shown = render(edit, drawn.frames)
    apart = [np.abs(shown[frame] - plain[frame]) for frame in drawn.frames]
    assert plain[drawn.frames[0]].std() > 5
    assert np.max(apart) <= LEVELS or (drawn.is_told and np.mean(apart) < 5), drawn.words
