"""The command, end to end: from footage and a recipe to files, through Blender's sequencer."""

import numpy as np
import OpenImageIO
import pytest
from support import noise, read_picture, recipe, write_frames, write_movie

from shutter_addon.blender.commands import command_line
from shutter_addon.core.frames import light
from shutter_addon.media import open_source

STILL = recipe(4, [1, 0, 0, 0])


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    """Twelve frames of random pixels: folder's first file, frames (12, 48, 64, 3) uint8."""
    frames = noise(12, 48, 64, 3)
    return write_frames(tmp_path_factory.mktemp("noise"), frames), frames


def linear(frames):
    return light.to_linear(np.asarray(frames, dtype=np.float64) / 255)


def levels(values):
    return light.to_encoded(values) * 255


def test_a_still_frame_gives_the_sequence_back(command, film, tmp_path, same_pixels):
    first, frames = film
    command(first, "--output", tmp_path / "out", recipe=STILL)
    names = sorted(p.name for p in (tmp_path / "out").iterdir())
    assert names == [f"{i:04d}.png" for i in range(1, 13)]
    for i, name in enumerate(names):
        same_pixels(read_picture(tmp_path / "out" / name), frames[i], 1)


def test_a_window_stops_at_a_cut(command_here, tmp_path, same_pixels):
    """In chunks as in one go, and not where the recipe says so."""
    shots = [noise(6, 8, 3, seed=seed).repeat(8, 0).repeat(8, 1) for seed in range(2)]
    frames = np.stack([np.roll(shots[k // 6], k, axis=1) for k in range(12)])
    first = write_frames(tmp_path / "film", frames)
    data = recipe(4, np.ones(4))
    command_here(first, "--output", tmp_path / "whole", recipe=data)
    for chunk in ("1:4", "5:5", "6:12"):
        command_here(first, "--output", tmp_path / "chunks", "--frames", chunk, recipe=data)
    for k in range(12):
        window = np.minimum(np.arange(k, k + 4), 5 if k < 6 else 11)
        whole, part = (read_picture(tmp_path / way / f"{k + 1:04d}.png") for way in ("whole", "chunks"))
        same_pixels(whole, levels(linear(frames[window]).mean(axis=0)), 1)
        assert np.array_equal(whole, part)
    command_here(first, "--output", tmp_path / "off", "--frames", "5", recipe=data | {"stop_at_cuts": False})
    same_pixels(read_picture(tmp_path / "off" / "0005.png"), levels(linear(frames[4:8]).mean(axis=0)), 1)


def test_weights_have_a_channel_for_each_layer(command_here, film, tmp_path):
    ramp = {"kind": "ramp", "ramp": "linear", "shutter": "S1", "layer": True}
    ends = [{"frame": 1, "value": 0.5, "ease": "constant"}, {"frame": 3, "value": 0}]
    regions = [ramp | {"name": "S0"}, ramp | {"name": "Gone", "opacity": ends}]
    data = recipe(4, [1] * 4, [1, 0, 0, 0], aggregate=2, regions=regions)
    options = "--output", tmp_path / "out", "--weights", tmp_path / "w", "--frames", "2:3"
    command_here(film[0], *options, recipe=data)
    images = [OpenImageIO.ImageBuf(str(tmp_path / "w" / f"000{frame}.exr")) for frame in (2, 3)]
    names, pixels = images[0].spec().channelnames, [np.moveaxis(image.get_pixels(), -1, 0) for image in images]
    assert images[1].spec().channelnames == names
    there, gone = (dict(zip(names, found, strict=True)) for found in pixels)
    assert there.keys() == {"S0", "S1", "S0.001", "Gone"}
    expected = np.broadcast_to((np.arange(32) * 2 + 1) / 64, (24, 32))
    assert np.abs(there["S0.001"] - expected).max() < 1e-4
    assert np.abs(there["Gone"] - expected / 2).max() < 1e-4
    assert np.array_equal(gone["S0.001"], there["S0.001"])
    assert not gone["Gone"].any()
    assert (there["S0"] == 1).all()


def test_chunks_and_order_change_no_bit(command_here, film, tmp_path):
    first, _ = film
    moving = {"shutter": "S1", "strokes": [[[0.2, 0.2], [0.4, 0.6]]], "width": 0.1, "layer": True}
    moving["keys"] = [{"frame": 1}, {"frame": 12, "location": [0.4, 0.1], "rotation": 40}]
    still = {"shutter": "S0", "strokes": [[[0.9, 0.1], [0.9, 0.9]]]}
    edges = {"edge_aware": 1.0, "border": True, "aggregate": 4}
    data = recipe(6, *np.random.default_rng(2).random((2, 6)), regions=[still, moving], **edges)
    command_here(first, "--output", tmp_path / "whole", "--frames", "2:8", recipe=data)
    for chunk in ("6:8", "4"):
        command_here(first, "--output", tmp_path / "parts", "--frames", chunk, recipe=data)
    for frame in (4, 6, 7, 8):
        whole, part = (tmp_path / f / f"{frame:04d}.png" for f in ("whole", "parts"))
        assert np.array_equal(read_picture(whole), read_picture(part))


def test_exr_is_scene_linear(command_here, film, tmp_path):
    first, frames = film
    command_here(first, "--output", tmp_path / "out", "--format", "exr", "--frames", "1", recipe=recipe(4, np.ones(4)))
    picture = read_picture(tmp_path / "out" / "0001.exr")
    assert np.abs(picture - linear(frames[:4]).mean(axis=0)).max() < 1e-3


@pytest.fixture(scope="module")
def with_sound(tmp_path_factory):
    """Ten frames of 160×90 that become brighter, at 25 a second, with a tone."""
    ramp = np.add.outer(np.arange(90), np.arange(160)) // 2
    pictures = np.stack([np.repeat((ramp + 12 * index)[..., None], 3, -1) for index in range(10)]).astype(np.uint8)
    path = tmp_path_factory.mktemp("sound") / "film.mkv"
    return write_movie(path, pictures, rate=25, tone=8000 * np.sin(np.arange(19200) * 0.05))


@pytest.mark.parametrize("ending", [".mp4", ".mov", ".mkv", ".webm", ".avi"])
def test_movies(command_here, with_sound, tmp_path, ending):
    output = tmp_path / f"film{ending}"
    command_here(with_sound, "--output", output, "--frames", "3:8", recipe=STILL)
    assert [p.name for p in tmp_path.iterdir() if p.name.startswith((".", "film"))] == [output.name]
    with open_source(output) as film, open_source(with_sound) as source:
        late = ending == ".avi"  # Blender's AVI shows the first frame twice
        assert (film.width, film.height, film.fps) == (160, 90, 25)
        assert film.count in (6, 7)  # containers that give the sound's length alone may end a frame later
        assert film.has_audio
        assert np.abs(film.read(3 + late).astype(float) - source.read(5)).mean() < 4


def test_source_time_up_to_the_last_frame_of_the_timeline(command_here, film, tmp_path, same_pixels):
    """A freeze of more than an hour, a way on behind it, and the last frame that Blender has."""
    first, frames = film
    keys = {1: 2, 100_100: 2, 100_104: 6, 1_048_574: 12}
    data = recipe(1, [1], time=[{"frame": frame, "value": value} for frame, value in keys.items()])
    for chunk in ("100100:100104", "1048574"):
        command_here(first, "--output", tmp_path / "out", "--frames", chunk, recipe=data)
    shown = {100_100: 2, 100_101: 3, 100_102: 4, 100_103: 5, 100_104: 6, 1_048_574: 12}
    assert len(list((tmp_path / "out").iterdir())) == len(shown)
    for frame, number in shown.items():
        same_pixels(read_picture(tmp_path / "out" / f"{frame:04d}.png"), frames[number - 1], 1)


def test_alpha_is_carried(command_here, tmp_path, same_pixels):
    frames = noise(4, 16, 20, 4)
    frames[:, :8, :, 3] = 255
    frames[:, 12:, :, 3] = 0
    first = write_frames(tmp_path / "in", frames)
    command_here(first, "--output", tmp_path / "out", "--frames", "1", recipe=recipe(2, [1, 1]))
    picture = read_picture(tmp_path / "out" / "0001.png")
    alpha = frames[:2, ..., 3:].astype(float) / 255
    total = (linear(frames[:2, ..., :3]) * alpha).mean(axis=0)
    mean = alpha.mean(axis=0)
    same_pixels(picture[..., 3:], mean * 255, 1)
    expected = levels(total / np.maximum(mean, 1e-6))
    assert np.abs(picture[..., :3] - expected)[mean[..., 0] > 0.1].max() <= 1.5


@pytest.mark.parametrize("suffix", [".png", ".jp2"])
def test_files_that_a_gap_would_show_are_the_sources_own(film, tmp_path, suffix):
    """The number in a suffix is none of theirs."""
    for path in sorted(write_frames(tmp_path, film[1][:4]).parent.iterdir()):
        path.rename(path.with_suffix(suffix))
    (tmp_path / f"f0003{suffix}").unlink()
    with open_source(tmp_path / f"f0001{suffix}") as source:
        assert tmp_path / f"f0003{suffix}" in command_line.files(source)
