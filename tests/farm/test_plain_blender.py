"""What Flamenco's built-in job and its like start: a plain Blender with the extension, on a chunk of a saved edit."""

import json
import os
import re
import shlex
import subprocess

import numpy as np
import OpenImageIO
import pytest
from farm_job import RECIPE, ROOT, Job, shrink, shutter

EXTENSION = "bl_ext.user_default.virtual_shutter"
CHUNKS = (1, 2), (3, 4)


@pytest.fixture(scope="module")
def blender(real_blender, tmp_path_factory):
    """Runs a real Blender that has the checkout for an extension."""
    extensions = tmp_path_factory.mktemp("user") / "extensions" / "user_default"
    extensions.mkdir(parents=True)
    (extensions / "virtual_shutter").symlink_to(ROOT)
    resources = {"BLENDER_USER_RESOURCES": str(extensions.parents[1])}

    def run(*arguments):
        command = [*real_blender, "--factory-startup", "--addons", EXTENSION, *map(str, arguments)]
        return subprocess.run(command, env=os.environ | resources, capture_output=True, text=True, timeout=240)

    return run


@pytest.fixture(scope="module")
def plain(bunny, tmp_path_factory):
    """A job without Smooth: the Blender of a distribution may lack OpenCV."""
    job = Job(tmp_path_factory.mktemp("plain"))
    footage, recipe = job.folder / "footage.mp4", job.folder / "recipe.json"
    shrink(bunny, footage)
    recipe.write_text(json.dumps(RECIPE | {"inbetween": 1}))
    shutter("render", footage, "--recipe", recipe, "--save", job.edit)
    return job


def task(edit, pictures, first, last):
    """The arguments of a farm's task, as docs/farms.md has them."""
    (line,) = re.findall(r"(?m)^blender (-b .*--render-frame.*)$", (ROOT / "docs" / "farms.md").read_text())
    told = {"FILE.blend": str(edit), "PICTURES/######": f"{pictures}/######", "1..16": f"{first}..{last}"}
    return [told.get(word, word) for word in shlex.split(line, comments=False)]


def levels(path):
    """A picture in 8-bit levels."""
    image = OpenImageIO.ImageBuf(str(path))
    return np.round(image.get_pixels(OpenImageIO.FLOAT) * 255)


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
