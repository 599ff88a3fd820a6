"""The demo's contact sheet: source, scribbles, coefficients and result of frames."""

import subprocess
import sys

import numpy as np
from OpenImageIO import ImageBuf

from gallery import stills
from gallery.item import ASSETS, ROOT

RECIPE = ASSETS / "bunny.json"
LONG = 0.2, 0.5, 1.0  # its colour there


def test_a_sheet_of_two_frames(bunny, tmp_path):
    """The source stands for the result as well: so the first and the last picture of a row are alike."""
    arguments = bunny, RECIPE, bunny, tmp_path / "sheet.png", 6, 45
    command = [sys.executable, ROOT / "scripts" / "contact_sheet.py", *map(str, arguments)]
    subprocess.run(command, cwd=ROOT, check=True)
    assert [path.name for path in tmp_path.iterdir()] == ["sheet.png"]
    sheet = ImageBuf(str(tmp_path / "sheet.png")).get_pixels()
    height = (sheet.shape[0] - stills.GAP) // 2
    for top in (stills.GAP, stills.GAP + height):
        row = sheet[top : top + 200, stills.GAP :]
        source, scribbles, coefficients, result = (part[:, :380] for part in np.split(row, 4, axis=1))
        np.testing.assert_allclose(result.mean(axis=(0, 1)), source.mean(axis=(0, 1)), atol=0.01)
        assert np.abs(scribbles - source).mean() > 0.1
        np.testing.assert_allclose(coefficients[100, 10], LONG, atol=0.02)
        assert np.ptp(coefficients, axis=(0, 1)).max() > 0.5, "the face has another shutter"
