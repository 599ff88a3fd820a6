"""Planes of luma and chroma: NumPy and the device make of them the bits that libswscale makes."""

import itertools

import av
import numpy as np
import pytest

from shutter_addon.compute.devices.device import NoDeviceError
from shutter_addon.compute.renderer import open_gl
from shutter_addon.compute.running_sums import Sums
from shutter_addon.core.frames.frame_source import Planes
from shutter_addon.core.model.frame_state import Options
from shutter_addon.media import open_source
from shutter_addon.media.cuts import signature

ALL = slice(None), slice(None)
SIZES = (64, 48), (65, 47), (37, 33), (322, 181), (17, 16)
BT709, UNNAMED, BT470, BT601, BT2020 = 1, 2, 5, 6, 9
LIMITED, FULL = 1, 2
KINDS = [*itertools.product((BT709, UNNAMED, BT470, BT601), (LIMITED, FULL))]


@pytest.fixture(scope="module")
def gl():
    try:
        device = open_gl()
    except NoDeviceError as error:
        pytest.skip(str(error))
    yield device
    device.release()


def film(path, size, space, range_, pixels="yuv420p", count=3):
    """A lossless movie of noise, with many samples at the ends of their range."""
    rng = np.random.default_rng(3)
    with av.open(str(path), "w") as container:
        stream = container.add_stream("ffv1", rate=25, options={"strict": "-2"})
        stream.width, stream.height, stream.pix_fmt = *size, pixels
        stream.codec_context.colorspace, stream.codec_context.color_range = space, range_
        for _ in range(count):
            frame = av.VideoFrame(*size, pixels)
            frame.colorspace, frame.color_range = space, range_
            for plane in frame.planes:
                noise = rng.integers(-64, 320, plane.buffer_size).clip(0, 255).astype(np.uint8)
                plane.update(noise.tobytes())
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    return path


@pytest.mark.parametrize("size", SIZES, ids="{0[0]}x{0[1]}".format)
@pytest.mark.parametrize(("space", "range_"), KINDS)
def test_numpy_makes_the_bits_of_libswscale(tmp_path, size, space, range_):
    with open_source(film(tmp_path / "noise.mkv", size, space, range_)) as source:
        whole, planes = source.read(1), source.decoded(1)
        assert isinstance(planes, Planes)
        assert np.array_equal(planes.samples(*ALL), whole[..., :3])
        assert np.array_equal(planes.rgba(), whole)
        for chosen in itertools.product((slice(1, None, 3), slice(1, 4, 2), slice(0, 1), slice(2, 2)), repeat=2):
            assert np.array_equal(planes.samples(*chosen), whole[chosen][..., :3])


@pytest.mark.parametrize("size", SIZES, ids="{0[0]}x{0[1]}".format)
@pytest.mark.parametrize(("space", "range_"), [(BT709, LIMITED), (BT601, FULL)])
@pytest.mark.parametrize("light", ["linear", "encoded"])
def test_a_device_makes_the_bits_of_libswscale(gl, tmp_path, monkeypatch, size, space, range_, light):
    found, make = [], gl.texture
    with open_source(film(tmp_path / "noise.mkv", size, space, range_)) as source, gl.current():
        for planar in (True, False):
            kinds = []
            monkeypatch.setattr(gl, "texture", lambda *given, kinds=kinds: kinds.append(given[-1]) or make(*given))
            monkeypatch.setattr(gl, "takes_planes", planar, raising=False)
            window = Sums(gl, source, 3)
            try:
                window.load(np.arange(3), Options(window=3, light=light), range(source.count))
                assert ("r32ui" in kinds) == planar  # of luma and chroma
                sums = np.concatenate([gl.read(texture).ravel() for _part, texture in window.stored()])
                found.append(sums.copy())
            finally:
                window.release()
    assert found[0].any()
    assert np.array_equal(*found)


@pytest.mark.parametrize(
    ("pixels", "space", "given"),
    [("yuv422p", BT709, {}), ("yuv420p", BT2020, {}), ("yuv420p10le", BT709, {}), ("yuva420p", BT709, {})]
    + [("yuv420p", BT709, given) for given in ({"deinterlace": True}, {"divisor": 2})],
)
def test_other_frames_are_as_they_are_read(tmp_path, pixels, space, given):
    path = film(tmp_path / "noise.mkv", (64, 48), space, LIMITED, pixels)
    with open_source(path, **given) as source:
        assert np.array_equal(source.decoded(1), source.read(1))


def test_a_signature_of_planes_is_that_of_the_frame(bunny):
    with open_source(bunny) as source:
        assert np.array_equal(signature(source.decoded(3), "srgb"), signature(source.read(3), "srgb"))
