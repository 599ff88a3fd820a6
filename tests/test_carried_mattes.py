"""Mattes carried between outlines that are ten frames apart, beside flow alone and the true alpha: the scenes of
scripts/outline_scenes.py, the beginning of each."""

import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parents[1] / "scripts"))
import carried_mattes
import outline_scenes

SCENES = {scene.name: scene for scene in outline_scenes.SCENES}


@pytest.mark.parametrize(("name", "most"), [("walking", 6), ("moving camera", 6), ("blurred", 10), ("occluded", 8)])
def test_between_outlines(name, most, monkeypatch):
    monkeypatch.setattr(outline_scenes, "COUNT", 11)
    frames, alphas = map(list, zip(*outline_scenes.frames(SCENES[name]), strict=True))
    alone, found, levels, _seconds = carried_mattes.measured(frames, alphas, 10)
    assert found >= alone + 0.05
    assert levels <= most
