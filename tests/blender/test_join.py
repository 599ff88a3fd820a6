"""The command `join`: frames and the edit's sound become the film that the edit itself renders."""

import shutil
from pathlib import Path

import av
import numpy as np
import OpenImageIO
import pytest
from support import flip_bit, noise, noise_film, refused, write_tone

from shutter_addon.blender import command

FRAMES = 8


@pytest.fixture(scope="module")
def saved(bpy, tmp_path_factory):
    """Builds an edit of noise and a tone once, under a view that changes colors, saves it with a lossless movie as
    its output, and renders it: to that movie, and to folders of frames. A folder with all of these."""
    folder = tmp_path_factory.mktemp("saved")
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    edit = bpy.context.scene
    edit.sequence_editor_create()
    noise_film(edit, noise(FRAMES, 48, 64, 3), folder)
    write_tone(folder / "tone.wav", 8000 * np.sin(np.arange(48000) * 0.05 * (1 + np.arange(48000) / 48000)))
    edit.sequence_editor.strips.new_sound("tone", str(folder / "tone.wav"), 4, -2)
    edit.view_settings.view_transform = "AgX"
    edit.view_settings.exposure = 0.5
    edit.render.resolution_percentage, edit.render.dither_intensity = 100, 0
    edit.render.fps, edit.render.fps_base = 30, 1.001
    _render(bpy, edit, folder / "png", "PNG", "16")
    _render(bpy, edit, folder / "eight", "PNG", "8")
    _render(bpy, edit, folder / "exr", "OPEN_EXR", "32")
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "pictures.blend"), copy=True)
    edit.render.image_settings.media_type = "VIDEO"
    edit.render.image_settings.color_mode = "RGB"
    edit.render.use_file_extension = False
    edit.render.ffmpeg.format, edit.render.ffmpeg.codec, edit.render.ffmpeg.audio_codec = "MKV", "FFV1", "FLAC"
    edit.render.filepath = str(folder / "film.mkv")
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "edit.blend"), copy=True)
    bpy.ops.render.render(animation=True, scene=edit.name)
    assert command.main(["render", str(folder / "edit.blend"), "--output", str(folder / "ours")]) == 0
    return folder


def _render(bpy, edit, folder, file_format, depth):
    settings = edit.render.image_settings
    settings.file_format, settings.color_depth, settings.color_mode = file_format, depth, "RGB"
    edit.render.filepath = f"{folder}/"
    bpy.ops.render.render(animation=True, scene=edit.name)


@pytest.fixture
def join(saved, tmp_path, capsys):
    """Runs the command on an edit of `saved`, in this process; the exit code, what it said, and where the film is."""

    def run(folder, *options, edit="edit", ending=".mkv"):
        capsys.readouterr()
        output = tmp_path / f"joined{ending}"
        arguments = ["join", folder, "--edit", saved / f"{edit}.blend", "--output", output, *options]
        code = command.main([str(argument) for argument in arguments])
        return code, capsys.readouterr().err, output

    return run


def _read(path):
    """Its pictures, samples of its sound (n, 2), and its rate."""
    with av.open(str(path)) as container:
        pictures = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
        container.seek(0)
        sound = [frame.to_ndarray().reshape(-1, 2) for frame in container.decode(audio=0)]
        return np.stack(pictures).astype(int), np.concatenate(sound), container.streams.video[0].average_rate


@pytest.mark.parametrize(
    ("folder", "levels", "share"), [("png", 1, 0.01), ("ours", 1, 0.01), ("eight", 0, 0), ("exr", 0, 0)]
)
def test_the_film_is_the_one_that_the_edit_renders(saved, join, folder, levels, share):
    """Of 16 bits 8 are made twice, which rounds otherwise where a value lies between two levels."""
    code, said, output = join(saved / folder)
    assert (code, said) == (0, "")
    (pictures, sound, rate), (own, own_sound, own_rate) = _read(output), _read(saved / "film.mkv")
    assert np.abs(pictures - own).max() <= levels
    assert (pictures != own).mean() <= share
    assert np.array_equal(sound, own_sound)
    assert rate == own_rate


def test_some_frames_with_their_sound(saved, join):
    code, said, output = join(saved / "exr", "--frames", "3:6")
    assert (code, said) == (0, "")
    (pictures, sound, _), (own, own_sound, _) = _read(output), _read(saved / "film.mkv")
    assert np.array_equal(pictures, own[2:6])
    start = round(2 * 48000 * 1.001 / 30)
    assert np.array_equal(sound[:4000], own_sound[start : start + 4000])


@pytest.mark.parametrize(("ending", "codec"), [(".mp4", "h264"), (".webm", "vp9")])
def test_an_edit_that_renders_pictures_becomes_a_film_by_its_ending(saved, join, ending, codec):
    code, said, output = join(saved / "png", edit="pictures", ending=ending)
    assert (code, said) == (0, "")
    with av.open(str(output)) as container:
        assert codec in container.streams.video[0].codec_context.name
        assert len(container.streams.audio) == 1


def _cut(path):
    path.write_bytes(path.read_bytes()[:-20])


def _write(path, width=64, channels=3, kind=np.uint16, shades=0):
    pixels = np.full(48 * width * channels, shades, kind).reshape(48, width, channels)
    OpenImageIO.ImageBuf(pixels).write(str(path))


def _flip_smooth(path):
    """Of noise, which no codec makes smaller, EXR keeps the pixels as they are, without checksums."""
    _write(path, kind=np.float32, shades=np.linspace(0, 1, 64 * 48 * 3, dtype=np.float32))
    flip_bit(path)


def _changed(change, names="0003.*", **options):
    return lambda folder: [change(path, **options) for path in folder.glob(names)]


@pytest.mark.parametrize(
    ("name", "plant", "sentence"),
    [
        ("png", _changed(Path.unlink, "000[2567].png"), "lacks frames 2, 5 to 7"),
        ("png", _changed(Path.unlink, "*"), "lacks frames 1 to 8"),
        ("png", shutil.rmtree, "No such file or directory"),
        ("png", _changed(flip_bit), "0003.png: is damaged or cut off"),
        ("png", _changed(_cut), "0003.png: is damaged or cut off"),
        ("exr", _changed(_cut), "0003.exr: is damaged or cut off"),
        ("exr", _changed(_flip_smooth), "0003.exr: is damaged or cut off"),
        ("png", _changed(_write, width=60), "0003.png: 60×48, "),
        ("png", _changed(_write, channels=4), "0003.png: 64×48, 4 channels of uint16, "),
        ("png", _changed(_write, kind=np.uint8), "unlike 0001.png: 64×48, 3 channels of uint16, "),
        ("png", _changed(_write, "*", width=32), "unlike the edit: 64×48"),
        (
            "png",
            _changed(_write, "*", channels=4),
            "0001.png: is transparent, which a film shows otherwise under this view",
        ),
        (
            "png",
            lambda folder: _write(folder / "0003.exr", kind=np.float32),
            "0003.exr and 0003.png are the same frame",
        ),
        ("png", lambda folder: _write(folder / "00003.png"), "00003.png and 0003.png are the same"),
    ],
)
def test_faults_are_told_by_name(saved, tmp_path, join, name, plant, sentence):
    folder = shutil.copytree(saved / name, tmp_path / "frames")
    plant(folder)
    code, said, output = join(folder)
    refused((code, said), f"Virtual Shutter: {folder}", sentence)
    assert not output.exists()


def test_what_is_no_frame_of_the_edit_is_left_out(saved, tmp_path, join):
    frames = shutil.copytree(saved / "png", tmp_path / "frames")
    for name in ("0009.png", "0012.png", "0010.png"):
        shutil.copy(saved / "png" / "0001.png", frames / name)
    (frames / "preview.png").write_bytes(b"another's")
    code, _said, output = join(frames)
    assert code == 0
    assert len(_read(output)[0]) == FRAMES


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (Path.unlink, "tone.wav: no such file"),
        (lambda tone: tone.write_bytes(b"no sound"), "tone.wav: has no sound, or cannot be read"),
    ],
)
def test_sound_that_cannot_be_had(saved, join, change, words):
    tone = saved / "tone.wav"
    content = tone.read_bytes()
    change(tone)
    code, said, output = join(saved / "png")
    tone.write_bytes(content)
    refused((code, said), f'strip "tone": {words}')
    assert not output.exists()


def test_frames_of_another_version_of_the_edit(saved, join):
    code, said, output = join(saved / "ours", edit="pictures")
    refused((code, said), "unlike the edit: 64×48, version ")
    assert not output.exists()
