"""What masks cover, against distances and angles found pixel by pixel."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shutter_addon.core.model import masks
from shutter_addon.core.model.masks import MaskLayer, MaskShape, MaskSpline

SIZES = [(96, 54), (54, 96), (61, 61)]
RECTANGLE = ((0.25, 0.35), (0.25, 0.65), (0.75, 0.65), (0.75, 0.35))


def straight(corners, weight=0.0, **options):
    """A spline of straight lines; clockwise ones have their feather outside."""
    corners, ends = np.asarray(corners, float), (np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0))
    points = np.stack([corners + (ends[0] - corners) / 3, corners, corners + (ends[1] - corners) / 3], axis=1)
    weights = (weight,) * len(corners)
    points = tuple(tuple(map(tuple, point)) for point in points.tolist())
    return MaskSpline(points, weights, ((),) * len(corners), **options)


def covered(splines, size, **layer):
    return MaskShape((MaskLayer(tuple(splines), **layer),)).values(*size)


def places(size):
    """Pixel centres (H, W, 2) in mask space."""
    width, height = size
    x, y = np.meshgrid(np.arange(width) + 0.5, height - 0.5 - np.arange(height))
    larger = max(size)
    return np.stack([(x - width / 2) / larger + 0.5, (y - height / 2) / larger + 0.5], axis=-1)


def winding(corners, points):
    """How often polygons go around points, by angles."""
    total = np.zeros(points.shape[:2])
    for a, b in zip(corners, [*corners[1:], corners[0]], strict=True):
        (ax, ay), (bx, by) = (np.moveaxis(np.asarray(end) - points, -1, 0) for end in (a, b))
        total += np.arctan2(ax * by - ay * bx, ax * bx + ay * by)
    return np.rint(total / (2 * np.pi)).astype(int)


@pytest.mark.parametrize("size", SIZES)
def test_a_mask_lies_in_a_square_around_the_picture(size):
    x, y = np.moveaxis(places(size), -1, 0)
    inside = (x > 0.25) & (x < 0.75) & (y > 0.35) & (y < 0.65)
    # Counterclockwise ones have their pixel of feather inside, where it is not seen.
    assert np.array_equal(covered([straight(RECTANGLE[::-1])], size), inside.astype(np.float32))


def test_edges_are_one_pixel_wide_beyond_the_spline():
    value = covered([straight(RECTANGLE)], (100, 100), falloff="LINEAR")
    x = places((100, 100))[50, :, 0]
    # The border's pixels lie half a pixel beyond it.
    assert value[50] == pytest.approx(np.clip(1 - np.maximum(0.25 - x, x - 0.75) / 0.01, 0, 1), abs=1e-3)


@pytest.mark.parametrize("falloff", ["SMOOTH", "SPHERE", "ROOT", "INVERSE_SQUARE", "SHARP", "LINEAR"])
def test_a_feather_falls_from_the_spline_to_its_width(falloff):
    size = 160, 90
    value = covered([straight(RECTANGLE, 0.1)], size, falloff=falloff)
    x = places(size)[45, :, 0]
    near = np.clip(1 - np.maximum(0.25 - x, x - 0.75) / 0.1, 0, 1)
    expected = {
        "SMOOTH": near**2 * (3 - 2 * near),
        "SPHERE": np.sqrt(1 - (1 - near) ** 2),
        "ROOT": near**0.5,
        "INVERSE_SQUARE": 1 - (1 - near) ** 2,
        "SHARP": near**2,
        "LINEAR": near,
    }[falloff]
    assert np.abs(value[45] - expected).max() < 0.02


def test_a_circle_and_its_feather_are_round():
    size = 200, 120
    angles = -np.arange(12) * np.pi / 6
    turn = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    along = np.stack([np.sin(angles), -np.cos(angles)], axis=1) * (4 / 3 * np.tan(np.pi / 24))
    points = 0.5 + 0.15 * np.stack([turn - along, turn, turn + along], axis=1)
    spline = MaskSpline(tuple(tuple(map(tuple, p)) for p in points.tolist()), (0.08,) * 12, ((),) * 12)
    radius = np.linalg.norm(places(size) - 0.5, axis=-1)
    value = covered([spline], size, falloff="LINEAR")
    assert np.abs(value - np.clip(1 - (radius - 0.15) / 0.08, 0, 1)).max() < 0.02


def test_an_open_spline_that_is_not_filled_has_round_ends():
    size = 120, 80
    spline = straight([(0.3, 0.5), (0.7, 0.5)], 0.1, cyclic=False, fill=False)
    points = places(size)
    nearest = np.stack([np.clip(points[..., 0], 0.3, 0.7), np.full(points.shape[:2], 0.5)], axis=-1)
    expected = np.clip(1 - np.linalg.norm(points - nearest, axis=-1) / 0.1, 0, 1)
    assert np.abs(covered([spline], size, falloff="LINEAR") - expected).max() < 0.03


@pytest.mark.parametrize("interpolation", ["LINEAR", "EASE"])
def test_feather_points_widen_their_segment(interpolation):
    size = 200, 200
    spline = straight(RECTANGLE, 0.05, weight_interpolation=interpolation)
    # The upper edge goes from left to right: a point in its middle, where the feather is thrice as wide.
    spline = replace(spline, feathers=((), ((0.5, 3.0),), (), ()))
    value = covered([spline], size, falloff="LINEAR")
    x, y = np.moveaxis(places(size), -1, 0)
    share = np.clip(1 - np.abs(x - 0.5) / 0.25, 0, 1)
    share = share if interpolation == "LINEAR" else share**2 * (3 - 2 * share)
    expected = np.clip(1 - (y - 0.65) / (0.05 + 0.1 * share), 0, 1)
    above = (np.abs(x - 0.5) < 0.23) & (y > 0.65) & (y < 0.8)
    # Between the normals of two points of the outline, values bend a little.
    assert np.abs(value - expected)[above].mean() < 0.004


def test_quads_that_are_twisted_are_two_triangles():
    quads = np.array(
        [[(0.2, 0.2), (0.8, 0.8), (0.8, 0.2), (0.2, 0.8)], [(0.1, 0.9), (0.5, 0.92), (0.9, 0.9), (0.5, 0.95)]]
    )
    value = np.zeros((100, 100), np.float32)
    masks.feather(value, quads, np.ones_like)
    points = places((100, 100))[::-1]
    triangles = [quad[list(corners)] for quad in quads for corners in ((0, 1, 2), (0, 2, 3))]
    inside = np.any([winding(list(triangle), points) != 0 for triangle in triangles], axis=0)
    assert np.count_nonzero(value.astype(bool) != inside) < 100


CROSSED = {
    "star": [[(0.5 + 0.4 * np.sin(k * 0.8 * np.pi), 0.5 + 0.4 * np.cos(k * 0.8 * np.pi)) for k in range(5)]],
    "eight": [[(0.2, 0.3), (0.8, 0.7), (0.83, 0.31), (0.21, 0.72)]],
    "ring": [
        [
            *((0.1, 0.2), (0.9, 0.2), (0.9, 0.7), (0.4, 0.7), (0.4, 0.6), (0.8, 0.6)),
            *((0.8, 0.4), (0.2, 0.4), (0.2, 0.55), (0.6, 0.55), (0.6, 0.8), (0.1, 0.8)),
        ]
    ],
    "apart": [[(0.1, 0.1), (0.4, 0.1), (0.3, 0.4)], [(0.6, 0.5), (0.9, 0.6), (0.6, 0.9)]],
    "two": [[(0.1, 0.2), (0.5, 0.2), (0.5, 0.6), (0.1, 0.6)], [(0.3, 0.4), (0.3, 0.9), (0.9, 0.9), (0.9, 0.4)]],
}


@pytest.mark.parametrize("name", CROSSED)
@pytest.mark.parametrize("holes", [False, True])
def test_what_splines_fill_together(name, holes):
    size = 120, 120
    points = places(size)
    around = [winding(corners, points) for corners in CROSSED[name]]
    expected = sum(around) != 0 if holes else np.any(around, axis=0)
    value = covered([straight(corners) for corners in CROSSED[name]], size, holes=holes)
    # Borders have a feather of a pixel, on one side.
    beside = [np.roll(expected, shift, axis) != expected for shift in (-2, -1, 1, 2) for axis in (0, 1)]
    lines = [covered([straight(corners, 0.015, fill=False)], size) > 0 for corners in CROSSED[name]]
    border = np.any(beside + lines, axis=0)
    assert border.mean() < 0.35
    assert expected[~border].any()
    assert np.array_equal(value[~border], expected[~border].astype(np.float32))


@pytest.mark.parametrize("holes", [False, True])
def test_the_sweep_line_fills_each_or_what_an_odd_number_covers(holes):
    size = 100, 100
    around = [winding(corners, places(size)) != 0 for corners in CROSSED["two"]]
    expected = around[0] ^ around[1] if holes else around[0] | around[1]
    splines = [straight(corners[::-1] if k == 0 else corners) for k, corners in enumerate(CROSSED["two"])]
    value = covered(splines, size, fill_solver="SWEEP_LINE", holes=holes)
    assert np.abs(value - expected).mean() < 0.03


EVERYWHERE = straight([(-1, -1), (2, -1), (2, 2), (-1, 2)])


@pytest.mark.parametrize(
    ("blend", "value"),
    [
        *(("MERGE_ADD", 0.7), ("MERGE_SUBTRACT", 0.3), ("ADD", 0.9), ("SUBTRACT", 0.1), ("LIGHTEN", 0.5)),
        *(("DARKEN", 0.4), ("MUL", 0.2), ("DIFFERENCE", 0.1), ("REPLACE", 0.7)),
    ],
)
def test_layers_are_blended(blend, value):
    below, above = MaskLayer((EVERYWHERE,), alpha=0.5), MaskLayer((EVERYWHERE,), alpha=0.4, blend=blend)
    assert MaskShape((below, above)).values(5, 4) == pytest.approx(np.full((4, 5), value), abs=1e-6)


def test_an_inverted_layer_covers_what_it_did_not():
    plain, inverted = (covered([straight(RECTANGLE, 0.05)], (40, 30), invert=invert) for invert in (False, True))
    assert plain.min() == 0
    assert plain.max() == 1
    assert inverted == pytest.approx(1 - plain)


def test_sums_stay_between_0_and_1():
    layers = tuple(MaskLayer((EVERYWHERE,), blend=blend) for blend in ("ADD", "ADD", "SUBTRACT"))
    assert np.array_equal(MaskShape(layers[:2]).values(3, 2), np.ones((2, 3)))
    assert np.array_equal(MaskShape(layers).values(3, 2), np.zeros((2, 3)))


@pytest.mark.parametrize("count", [0, 1, 2])
def test_too_few_points_cover_nothing(count):
    spline = straight(RECTANGLE[:count], cyclic=False) if count else MaskSpline((), (), ())
    value = covered([spline], (32, 18))
    assert value.dtype == np.float32
    assert value.shape == (18, 32)
    assert value.max(initial=0) < 1


@pytest.mark.parametrize("far", [1e4, 1e-9])
def test_sizes_that_no_picture_has(far):
    corners = np.array([(0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0)]) * far - far / 3
    value = covered([straight(corners, far / 10)], (32, 18))
    assert np.isfinite(value).all()
    assert value.min() >= 0
    assert value.max() <= 1


# On a coarse grid points coincide, lines lie on one another and cross in corners.
grid = st.tuples(st.integers(-1, 5), st.integers(-1, 5)).map(lambda place: (place[0] / 4, place[1] / 4))


@settings(max_examples=60)
@given(st.lists(st.lists(grid, min_size=1, max_size=6), min_size=1, max_size=3), st.data())
def test_no_mask_is_too_odd(polygons, data):
    splines = [
        straight(
            corners,
            data.draw(st.sampled_from([0, 0.1, -0.1, 2])),
            cyclic=data.draw(st.booleans()),
            fill=data.draw(st.booleans()),
        )
        for corners in polygons
    ]
    options = {name: data.draw(st.booleans()) for name in ("holes", "invert")}
    value = covered(splines, (16, 12), fill_solver=data.draw(st.sampled_from(["CDT", "SWEEP_LINE"])), **options)
    assert value.min() >= 0
    assert value.max() <= 1


def test_masks_are_keys():
    mask = MaskShape((MaskLayer((straight(RECTANGLE, 0.05),)),))
    same, other = (MaskShape((MaskLayer((straight(RECTANGLE, weight),)),)) for weight in (0.05, 0.06))
    assert mask == same
    assert hash(mask) == hash(same)
    assert mask != other
