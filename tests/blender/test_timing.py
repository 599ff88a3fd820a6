"""Retiming keys out of Blender's memory: what they cannot be is refused."""

import math
import time
from types import SimpleNamespace

import numpy as np
import pytest
from support import Like, write_frames

GOOD = [(0.0, 0.0), (29.0, 0.3725), (51.0, 1.0)]


def keys_of(bpy, pairs):
    from shutter_addon.core.frames.retiming import RetimingKey

    return [RetimingKey(index, 0, factor) for index, factor in pairs]


@pytest.mark.parametrize("pairs", [[], [(0.0, 0.0)], GOOD, [(0.0, 0.0), (7.2, 0.5), (7.2, 0.5), (19.6, 1.0)]])
def test_good_keys(bpy, pairs):
    from shutter_addon.core.frames.retiming import are_retiming_keys

    assert are_retiming_keys(keys_of(bpy, pairs), [round(index) for index, _ in pairs])


@pytest.mark.parametrize(
    "pairs",
    [
        [(0.0, 0.0), (29.0, 1.5), (51.0, 1.0)],
        [(0.0, 0.0), (29.0, -0.1), (51.0, 1.0)],
        [(0.0, 0.0), (29.0, math.nan), (51.0, 1.0)],
        [(0.0, 0.0), (math.nan, 0.5), (51.0, 1.0)],
        [(0.0, 0.0), (1e300, 0.5), (51.0, 1.0)],
        [(0.0, 0.0), (31.0, 0.5), (51.0, 1.0)],  # not where Python sees it
        [(0.0, 0.3), (29.0, 0.5), (51.0, 1.0)],
        [(0.0, 0.0), (29.0, 0.5), (51.0, 0.9)],
        [(0.0, 0.0), (51.0, 1.0)],
        [],
    ],
)
def test_keys_that_cannot_be(bpy, pairs):
    from shutter_addon.core.frames.retiming import are_retiming_keys

    assert not are_retiming_keys(keys_of(bpy, pairs), [0, 29, 51])


def test_keys_out_of_order(bpy):
    from shutter_addon.core.frames.retiming import are_retiming_keys

    assert not are_retiming_keys(keys_of(bpy, [(0.0, 0.0), (30.0, 0.6), (29.0, 0.5), (51.0, 1.0)]), [0, 30, 29, 51])


@pytest.mark.parametrize("keys", [2, 3])
def test_another_layout(bpy, edit, tmp_path, monkeypatch, keys):
    """One that is not known, where what the first and the last key show is known all the same; and one by which the
    numbers are others than Python has, as if they lay four bytes farther on."""
    from shutter_addon.blender.data import strip_timing, struct_dna
    from shutter_addon.core.messages import EffectError

    first = write_frames(tmp_path / "in", np.zeros((20, 8, 8, 3), dtype=np.uint8))
    source = edit.sequence_editor.strips.new_image("images", str(first), 1, 1)
    for file in sorted(first.parent.iterdir())[1:]:
        source.elements.append(file.name)
    source.right_handle = 21
    for frame in (1, 11)[: keys - 1]:
        source.retiming_keys.add(timeline_frame=frame)
    source.retiming_keys[-1].timeline_frame = 52
    known = strip_timing.timing_of(source)
    assert [key.index for key in known.keys] == {2: [0, 51], 3: [0, 10, 51]}[keys]
    moved = [Like(key, as_pointer=lambda key=key: key.as_pointer() + 4) for key in source.retiming_keys]
    other = Like(source, retiming_keys=moved)
    with pytest.raises(EffectError, match='strip "images": its retiming keys cannot be read'):
        strip_timing.timing_of(other)

    def unknown(*_):
        raise struct_dna.LayoutError

    monkeypatch.setattr(strip_timing, "record", unknown)
    if keys == 2:
        assert strip_timing.timing_of(source) == known
        return
    with pytest.raises(EffectError, match='strip "images": its retiming keys cannot be read'):
        strip_timing.timing_of(source)


def test_a_still_of_a_million_frames_takes_no_time(bpy, edit, tmp_path):
    """Blender shows one frame of it all along; where that began is not sought frame by frame."""
    from shutter_addon.blender.data import strip_timing
    from shutter_addon.core.frames import retiming

    first = write_frames(tmp_path / "in", np.zeros((1, 8, 8, 3), dtype=np.uint8))
    source = edit.sequence_editor.strips.new_image("images", str(first), 1, 1)
    source.right_handle = 1_000_000
    start = time.perf_counter()
    medium = SimpleNamespace(filmed=1, step=1, fps=None)
    assert retiming.source_frame(strip_timing.timing_of(source), 999_999, medium) == 0
    assert time.perf_counter() - start < 1
