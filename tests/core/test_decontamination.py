"""Colours of mixed pixels, against those that they were mixed of."""

import numpy as np
import pytest

from shutter_addon.core.pixels.layering import separated

HEIGHT, WIDTH = 90, 120


def smooth(rng, *shape):
    """Colours (H, W, C) that change from place to place by waves."""
    y, x = np.mgrid[: shape[0], : shape[1]][..., None] / 10
    waves = rng.uniform(-1, 1, (2, 1, 1, shape[2])), rng.uniform(0, 6, (1, 1, shape[2]))
    return (0.5 + 0.4 * np.sin(waves[0][0] * x + waves[0][1] * y + waves[1])).astype(np.float32)


def disc(soft, radius=25.0):
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    return np.clip((radius - np.hypot(x - 60, y - 45)) / soft + 0.5, 0, 1).astype(np.float32)


@pytest.mark.parametrize(("soft", "most"), [(1.5, 0.1), (4, 0.25), (8, 0.5)])
def test_both_colours_are_nearer_than_the_mix(soft, most):
    rng, matte = np.random.default_rng(1), disc(soft)
    own, behind = 0.3 * smooth(rng, HEIGHT, WIDTH, 3) + [0.6, 0.1, 0.0], 0.3 * smooth(rng, HEIGHT, WIDTH, 3)
    m = matte[..., None]
    picture = (m * own + (1 - m) * behind).astype(np.float32)
    found = separated(picture, matte)
    for got, expected, weight in zip(found, (own, behind), (m, 1 - m), strict=True):
        mixed = (matte > 0.05) & (matte < 0.95)
        before, after = (np.abs(weight * (each - expected))[mixed].mean() for each in (picture, got))
        assert after < most * before


def test_what_is_not_mixed_stays_to_the_bit():
    rng, matte = np.random.default_rng(2), disc(4)
    picture = rng.random((HEIGHT, WIDTH, 3)).astype(np.float32)
    for got in separated(picture, matte):
        assert np.array_equal(got[(matte == 0) | (matte == 1)], picture[(matte == 0) | (matte == 1)])
        assert (got >= 0).all()


@pytest.mark.parametrize("size", [(1, 1), (2, 300), (37, 3)])
def test_small_pictures(size):
    rng = np.random.default_rng(4)
    picture, matte = rng.random((*size, 3)).astype(np.float32), rng.random(size).astype(np.float32)
    for got in separated(picture, matte):
        assert got.shape == picture.shape
        assert np.isfinite(got).all()


def test_where_the_picture_lies_changes_nothing():
    """What is looked at is a box around the mixed pixels."""
    rng, matte = np.random.default_rng(5), disc(4, radius=8.0)
    picture = rng.random((HEIGHT, WIDTH, 3)).astype(np.float32)
    wide = [np.pad(each, [(0, 0), (40, 60), (0, 0)][: each.ndim], mode="edge") for each in (picture, matte)]
    for got, more in zip(separated(picture, matte), separated(*wide), strict=True):
        assert np.allclose(got, more[:, 40 : 40 + WIDTH], atol=1e-5)
