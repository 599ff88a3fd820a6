"""Wrappers of sources hand on all that a source has."""

import numpy as np

from shutter_addon.core.frames.frame_source import FrameSource
from shutter_addon.features.smooth.smooth import SmoothSource
from shutter_addon.media import PrefetchSource, open_source
from shutter_addon.media.cuts import ShotSource


def test_through_all_wrappers(bunny):
    movie = open_source(bunny)
    source = ShotSource(PrefetchSource(SmoothSource(movie, 2)), 2)
    with source:
        assert (source.count, source.fps) == (2 * movie.count - 1, 2 * movie.fps)
        assert source.options == {**movie.options, "inbetween": 2}
        for name in FrameSource.__annotations__.keys() - {"count", "fps", "options", "shots", "step"}:
            assert getattr(source, name) == getattr(movie, name), name
        assert source.files == [bunny]
        assert source.has_audio
        assert (source.step, movie.step) == (2, 1)
        assert source.shots is source
        assert movie.shots is None
        source.want([6, 7])
        with open_source(bunny) as other:  # the thread that decodes ahead has the first one
            assert np.array_equal(source.read(6), other.read(3))
            assert np.array_equal(source.read(7), SmoothSource(other, 2).read(7))
