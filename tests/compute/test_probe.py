"""What a point of the picture shows, read from Blender's own GPU, against core."""

import numpy as np
import pytest
from test_composition import SHAPES, footage, state

from shutter_addon.compute.gpu import GPUCompositor
from shutter_addon.compute.renderer import Renderer
from shutter_addon.compute.request import Request
from shutter_addon.core.model import shutters

POINTS = [(0.001, 0.001), (0.999, 0.001), (0.31, 0.74), (0.65, 0.22), (0.5, 0.5)]


@pytest.fixture
def renderer(blender_device):
    return Renderer(GPUCompositor(blender_device), footage(np.random.default_rng(3)))


@pytest.mark.parametrize("interpolation", ["displacement", "value"])
@pytest.mark.parametrize("aggregate", [1, 2, 4])
@pytest.mark.parametrize("count", [2, 6])
def test_a_point_shows_its_pixels_coefficients_and_shutter(renderer, interpolation, aggregate, count):
    from shutter_addon.blender.interface.probe_gizmo import probed_at

    options = {"shapes": SHAPES if count > 2 else SHAPES[::2], "interpolation": interpolation, "aggregate": aggregate}
    request, source = Request(4, state(np.random.default_rng(count), count=count, **options)), renderer.source
    values = renderer.coefficients(request)
    for x, y in POINTS:
        row, column = int((1 - y) * source.height) // aggregate, int(x * source.width) // aggregate
        coefficients, bars = probed_at(renderer, request, (x, y))
        assert np.abs(coefficients - values[:, row, column]).max() < 1e-3
        assert coefficients.sum() == pytest.approx(1)
        between = shutters.INTERPOLATIONS[interpolation]
        assert bars == pytest.approx(between(request.state.bars, coefficients))

    for point in ((-1, -1), (1.0, 0.5), (0.5, 0.0), (0.5, 1.01)):  # beside the picture
        assert probed_at(renderer, request, point) is None
