"""Where the probe's box lies."""

from hypothesis import given
from hypothesis import strategies as st

from shutter_addon.blender.interface import probe_gizmo


@given(st.floats(0, 1), st.floats(0, 1), st.integers(1, 8), st.floats(0.5, 2))
def test_the_box_lies_in_the_region_and_beside_the_point(bpy, x, y, count, unit):
    size = 1600, 1000
    point = x * size[0], y * size[1]
    frame, bars, lines = probe_gizmo.layout(point, size, count, unit)
    left, bottom, right, top = frame
    assert 0 <= left < bars[0] < bars[2] < right <= size[0]
    assert 0 <= bottom < lines[-1] <= lines[0] < bars[1] < bars[3] < top <= size[1]
    assert len(lines) == count
    assert not (left < point[0] < right and bottom < point[1] < top)
