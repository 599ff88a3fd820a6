"""Pictures that are broken off between two passes, at any of them: those that come after are the right ones."""

import dataclasses

import numpy as np
import pytest
from test_composition import SHAPES, few_pieces, footage, state
from test_matting import Values, mattes
from test_moved import following

from shutter_addon.compute import window
from shutter_addon.compute.renderer import Renderer
from shutter_addon.compute.request import Request
from shutter_addon.core import stopping
from shutter_addon.core.model.frame_state import FrameState, Layers, Options
from shutter_addon.core.model.scribbles import Shape

FIRST, SECOND = 3, 21  # their windows have no frame in common
OTHER = (*SHAPES[1:], Shape(1, "line", 0.1, (np.array([[0.2, 0.7], [0.9, 0.1]]),)))


def plain(rng, _source, shapes):
    return few_pieces(rng, 6, shapes=shapes)


def along_edges(rng, _source, shapes):
    return few_pieces(rng, 6, shapes=shapes, edge_aware=1.0)


def followed(rng, source, shapes):
    return following(rng, source, state(rng, 6, shapes))


def with_mattes(rng, _source, shapes):
    moment = state(rng, 6, shapes)
    return type(moment)(moment.options, moment.bars, moment.shapes, mattes=mattes(np.random.default_rng(5), 2))


def layered(rng, source, shapes):
    """Its mattes are solved for in every source frame, and there are holes."""
    moment = few_pieces(rng, 6, shapes=shapes[1:])
    drawn = FrameState(Options(6), np.ones((2, 6)), (dataclasses.replace(shapes[0], shutter=1),))
    frames = {"first": 0, "scribbles": (drawn,) * source.count, "mattes": ((None,),) * source.count}
    return dataclasses.replace(moment, layers=Layers(shutters=(1,), opacities=(0.99,), **frames))


def counted(most=None):
    """What stops after so many looks, and the looks that it had."""
    looks = []

    def stopped():
        looks.append(None)
        return most is not None and len(looks) > most

    return stopped, looks


KINDS = [(kind, np.uint8) for kind in (plain, along_edges, followed, layered)]
KINDS += [(kind, np.float16) for kind in (plain, followed, with_mattes)]


@pytest.mark.parametrize(("kind", "dtype"), KINDS)
def test_what_comes_after_is_whole(device, kind, dtype, monkeypatch):
    monkeypatch.setattr(window, "BAND_BYTES", 60_000)  # pictures take several passes
    source = footage(np.random.default_rng(50), count=40, dtype=dtype, size=(61, 47))
    moments = [kind(np.random.default_rng(seed), source, shapes) for seed, shapes in ((51, SHAPES), (52, OTHER))]
    values = Values(source)
    asked = list(zip((FIRST, SECOND), moments, strict=True))
    expected = [Renderer(device, source, values).picture(Request(*one)) for one in asked]
    renderer = Renderer(device, source, values)
    stopped, looks = counted()
    for one in (*asked, asked[0]):  # mattes of layers are kept: they are solved for once
        renderer.picture(Request(*one))
    with stopping.once(stopped):
        renderer.picture(Request(*asked[1]))
    assert len(looks) > 2
    for most in sorted({int(share * len(looks)) for share in np.linspace(0, 1, 4, endpoint=False)} | {len(looks) - 1}):
        renderer.picture(Request(*asked[0]))
        stopped, had = counted(most)
        with stopping.once(stopped), pytest.raises(stopping.StoppedError):
            renderer.picture(Request(*asked[1]))
        assert len(had) == most + 1  # not another step
        for one, right in zip(asked, expected, strict=True):
            assert np.array_equal(renderer.picture(Request(*one)), right), most
    renderer.close()


def test_a_quick_picture_starts_from_nothing_half_made(gpu_device):
    """Its diffusion may start from the last one's: not from one that was broken off."""
    from shutter_addon.compute.gpu import GPUCompositor

    compositor = GPUCompositor(gpu_device)
    source = footage(np.random.default_rng(53), count=12, size=(61, 47))
    before, after = (plain(np.random.default_rng(54), source, shapes) for shapes in (SHAPES, OTHER))
    renderer = Renderer(compositor, source)
    right = renderer.coefficients(Request(0, after))
    for most in range(0, 60, 4):
        renderer.coefficients(Request(0, before))
        stopped, _ = counted(most)
        with gpu_device.current(), stopping.once(stopped), pytest.raises(stopping.StoppedError):
            renderer.drawn_coefficients(Request(0, after))
        assert np.abs(renderer.coefficients(Request(0, after)) - right).max() < 1e-6
    renderer.close()
