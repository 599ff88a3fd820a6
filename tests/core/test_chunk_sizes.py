"""How many frames of a film a farm's task should render."""

import pytest

from shutter_addon.core.farm import chunks


@pytest.mark.parametrize(("window", "step"), [(1, 1), (4, 1), (16, 1), (256, 1), (64, 8), (128, 16)])
def test_a_chunk_reads_little_that_is_not_its_own(window, step):
    size = chunks.chunk_size(window, step)
    share = [1 - n * step / chunks.decoded(n, window, step) for n in (size, size - 1)]
    assert share[0] <= 1 / chunks.ONE_IN
    assert size == chunks.LEAST or share[1] > 1 / chunks.ONE_IN
