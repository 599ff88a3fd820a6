"""From the zip to a finished film: what a new user does, in a Blender that has never seen the extension."""

import json
import subprocess
import sys

import av
import numpy as np
from screens import means
from telling import ROOT, built, needs_window, tell

from shutter_addon.media import open_source

RECIPE = ROOT / "gallery" / "bunny.json"
# What Blender says by itself, of the screen and of the footage.
BLENDERS_OWN = ("system.path", "MESA", "video.proxy", "DROP FILE", "Scene frame rate", "Video append frame")
# Levels of 255 that the codec may take means of 8 × 8 pixels away from what was given to it; the effect takes more.
LOSSY = 10
FRAMES = 40, 55

pytestmark = needs_window


def test_from_the_zip_to_a_finished_film(blenders_python, bunny, tmp_path):
    given = {"zip": built(tmp_path, blenders_python, "linux_x64"), "recipe": RECIPE, "frames": "{}:{}".format(*FRAMES)}
    (noted,) = tell("finished_film", "opengl", tmp_path, **given)
    recipe = json.loads(RECIPE.read_text())
    assert noted["shutters"] == [shutter["name"] for shutter in recipe["shutters"]]
    assert noted["regions"] == [region["name"] for region in recipe["regions"]]
    console = (tmp_path / "console.txt").read_text()
    said = [line for line in console.splitlines() if line and not any(own in line for own in BLENDERS_OWN)]
    assert not said, "\n".join(said)
    options = ["--recipe", RECIPE, "--output", tmp_path / "frames", "--frames", "{}:{}".format(*FRAMES)]
    command = [sys.executable, "-m", "shutter_addon", "render", bunny, *options]
    subprocess.run(list(map(str, command)), cwd=ROOT, check=True, capture_output=True)
    with open_source(tmp_path / "film.mp4") as film, open_source(bunny) as plain:
        first, last = FRAMES
        assert film.count == last - first + 1
        for index in (0, film.count // 2, film.count - 1):
            shown = means(film.read(index)[..., :3])
            with open_source(tmp_path / "frames" / f"{first + index:04d}.png") as frame:
                expected = means(frame.read(0)[..., :3] / 257)
            assert np.abs(shown - expected).max() < LOSSY
            assert np.abs(means(plain.read(first - 1 + index)[..., :3]) - expected).max() > 4 * LOSSY
    with av.open(tmp_path / "film.mp4") as film:
        assert len(film.streams.audio) == 1
