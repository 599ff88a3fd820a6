"""What Flamenco's built-in job and its like start: a plain Blender with the extension, on a chunk of a saved edit."""

import re
import shlex

import numpy as np
import OpenImageIO
import pytest
from farm_job import ROOT, saved_job

CHUNKS = (1, 2), (3, 4)


@pytest.fixture(scope="module")
def plain(bunny, tmp_path_factory):
    """A job without Smooth: the Blender of a distribution may lack OpenCV."""
    return saved_job(tmp_path_factory.mktemp("plain"), bunny, inbetween=1)


def task(edit, pictures, first, last):
    """The arguments of a farm's task, as docs/farms.md has them."""
    (line,) = re.findall(r"(?m)^blender (-b .*--render-frame.*)$", (ROOT / "docs" / "farms.md").read_text())
    told = {"FILE.blend": str(edit), "PICTURES/######": f"{pictures}/######", "1..16": f"{first}..{last}"}
    return [told.get(word, word) for word in shlex.split(line, comments=False)]


def levels(path):
    """A picture in 8-bit levels."""
    return np.round(OpenImageIO.ImageBuf(str(path)).get_pixels(OpenImageIO.FLOAT) * 255)


def test_chunks_have_the_pixels_of_the_command(blender, plain):
    for chunk in CHUNKS:
        done = blender(*task(plain.edit, plain.folder / "plain", *chunk))
        assert done.returncode == 0, done.stderr
    done = blender("-c", "shutter", "render", plain.edit, "--output", plain.pictures, "--frames", "1:4")
    assert done.returncode == 0, done.stderr
    for frame in range(1, 5):
        found = levels(plain.folder / "plain" / f"{frame:06d}.png")
        assert np.array_equal(found, levels(plain.pictures / f"{frame:04d}.png")), frame


def test_missing_footage_fails_the_task(blender, plain):
    (plain.folder / "footage.mp4").unlink()
    pictures = plain.folder / "missing"
    done = blender(*task(plain.edit, pictures, 1, 4))
    assert done.returncode == 2
    assert "Virtual Shutter: footage.mp4: no such file" in done.stderr
    assert not pictures.exists()
