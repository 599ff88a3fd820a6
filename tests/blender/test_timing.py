"""Retiming keys out of Blender's memory: where they cannot be read, a film is rendered all the same."""

import math
import time

import numpy as np
import pytest
from support import Like, image_strip, picture_of, started, write_frames

from shutter_addon.blender.data import source_media, struct_dna
from shutter_addon.blender.output import edit_check
from shutter_addon.blender.rendering import render_job
from shutter_addon.core.frames.retiming import RetimingKey
from shutter_addon.core.model.clip import Clip


@pytest.fixture
def source(edit, tmp_path):
    """A strip of twenty images."""
    return image_strip(edit, write_frames(tmp_path / "in", np.zeros((20, 8, 8, 3), dtype=np.uint8)))


@pytest.mark.parametrize("pair", [(29.0, math.nan), (math.nan, 0.5), (math.inf, 0.5), (1e300, 0.5), (-1.0, 0.5)])
def test_keys_that_cannot_be(bpy, pair):
    good = [(0.0, 0.0), (7.2, 0.5), (7.2, 0.5), (51.0, 1.0)]
    assert source_media.are_retiming_keys([RetimingKey(index, 0, factor) for index, factor in good])
    assert not source_media.are_retiming_keys(
        [RetimingKey(index, 0, factor) for index, factor in (*good[:1], pair, *good[1:])]
    )


@pytest.mark.parametrize("keys", [2, 3])
def test_what_cannot_be_read_is_shown_at_an_even_speed(edit, source, monkeypatch, keys):
    """In a version of Blender whose layout is not known: the film is rendered, and that is said once."""
    for frame in (1, 11)[: keys - 1]:
        source.retiming_keys.add(timeline_frame=frame)
    source.retiming_keys[-1].timeline_frame = 52
    known = source_media.timing_of(source)
    assert [key.index for key in known.keys] == {2: [0, 51], 3: [0, 10, 51]}[keys]

    def unknown(*_):
        raise struct_dna.LayoutError

    told: list[str] = []
    monkeypatch.setattr(render_job.job, "said", set())  # by which a sentence is told once: as a new Blender has it
    monkeypatch.setattr(source_media, "record", unknown)
    assert source_media.timing_of(source).keys == (known.keys[0], known.keys[-1])
    strip, _effect = started(edit, source)
    for frame in (2, 3):
        picture_of(strip.scene, frame, told.append)
    said = 'strip "images": its retiming keys cannot be read'
    assert sum(said in sentence for sentence in told) == 1
    faults, notes, _folders = edit_check.effects(edit, range(1, 52))
    assert not faults
    assert any(said in note for note in notes)


def test_other_memory_than_the_strips(source):
    """As if its record lay elsewhere than Blender says: no address in it is followed."""
    assert source_media.retiming_keys(source) == ()
    moved = Like(source, as_pointer=lambda: source.as_pointer() + 8)
    assert source_media.retiming_keys(moved) is None


def test_a_still_of_a_million_frames_takes_no_time(source):
    """Blender shows one frame of it all along; where that began is not sought frame by frame."""
    source.right_handle = 1_000_000
    start = time.perf_counter()
    assert Clip(width=8, height=8, count=20, timing=source_media.timing_of(source)).shown(999_999).source_frame == 19
    assert time.perf_counter() - start < 1
