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
def request_of(blender_device):
    def made(moment):
        return Renderer(GPUCompositor(blender_device), footage(np.random.default_rng(3))), Request(4, moment)

    return made


@pytest.mark.parametrize("interpolation", ["displacement", "value"])
@pytest.mark.parametrize("aggregate", [1, 2, 4])
@pytest.mark.parametrize("count", [2, 6])
def test_a_point_shows_its_pixels_coefficients_and_shutter(request_of, interpolation, aggregate, count):
    from shutter_addon.blender.interface.probe_gizmo import probed_at

    rng = np.random.default_rng(count)
    shapes = SHAPES if count > 2 else SHAPES[::2]
    renderer, request = request_of(
        state(rng, count=count, shapes=shapes, interpolation=interpolation, aggregate=aggregate)
    )
    values = renderer.coefficients(request)
    source = renderer.source
    for x, y in POINTS:
        row, column = int((1 - y) * source.height) // aggregate, int(x * source.width) // aggregate
        coefficients, bars = probed_at(renderer, request, (x, y))
        assert np.abs(coefficients - values[:, row, column]).max() < 1e-3
        assert coefficients.sum() == pytest.approx(1)
        between = shutters.INTERPOLATIONS[interpolation]
        assert bars == pytest.approx(between(request.state.bars, coefficients))


@pytest.mark.parametrize("point", [(-1, -1), (1.0, 0.5), (0.5, 0.0), (0.5, 1.01)])
def test_beside_the_picture_there_is_nothing(request_of, point):
    from shutter_addon.blender.interface.probe_gizmo import probed_at

    assert probed_at(*request_of(state(np.random.default_rng(0))), point) is None
