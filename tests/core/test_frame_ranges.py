"""Frames in words."""

import pytest

from shutter_addon.core.frames import frame_ranges


@pytest.mark.parametrize(
    ("frames", "words"), [([3], "frame 3"), ([5, 4], "frames 4 to 5"), ([9, 1, 3, 2, 12], "frames 1 to 3, 9, 12")]
)
def test_frames_in_words(frames, words):
    assert frame_ranges.in_words(frames) == words
