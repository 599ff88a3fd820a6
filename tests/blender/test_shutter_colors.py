"""New shutters have colors that color-blind eyes tell apart."""

import numpy as np
import pytest
from skimage import color

from shutter_addon.blender.editing import shutter_edits

# What is left of linear light for eyes that lack a kind of cones: Machado, Oliveira and Fernandes, "A Physiologically-
# based Model for Simulation of Color Vision Deficiency", 2009, severity 1.
EYES = {
    "all cones": np.eye(3),
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.01182, 0.04294, 0.968881]],
    "tritanopia": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.3039]],
}
APART = 10.0  # of CIEDE2000: about 1 is just seen with both side by side
ON_FOOTAGE = 8.0
FOOTAGE = (0.0, 0.0, 0.0), (0.5, 0.5, 0.5), (1.0, 1.0, 1.0)


def seen(colors, eyes) -> np.ndarray:
    """Display code values (n, 3) as those eyes see them: CIELAB (n, 3)."""
    colors = np.asarray(colors, dtype=np.float64)
    linear = np.where(colors <= 0.04045, colors / 12.92, ((colors + 0.055) / 1.055) ** 2.4)
    linear = np.clip(linear @ np.transpose(EYES[eyes]), 0, 1)
    return color.rgb2lab(np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055))


def closest(first, second) -> float:
    return color.deltaE_ciede2000(first[:, None], second[None]).min()


@pytest.mark.parametrize("eyes", EYES)
def test_colours_are_told_apart_and_from_black_grey_and_white_of_footage(bpy, eyes):
    lab = seen(shutter_edits.COLORS, eyes)
    assert all(closest(lab[[i]], lab[:i]) >= APART for i in range(1, len(lab)))
    assert closest(lab, seen(FOOTAGE, eyes)) >= ON_FOOTAGE
