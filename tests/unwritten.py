"""Devices whose new textures hold what nobody wants to see: a texel that no pass writes, but another reads, shows."""

from contextlib import suppress

import numpy as np

from shutter_addon.compute.devices.gl import FORMATS


def filled(device):
    """The device, which fills its new textures: with NaN, or whole numbers with the highest."""
    make = device.texture

    def texture(width, height, layers, kind):
        made = make(width, height, layers, kind)
        components, _, dtype = FORMATS[kind]
        nothing = np.nan if np.dtype(dtype).kind == "f" else np.iinfo(dtype).max
        with suppress(KeyError):  # Blender's writes no such format
            for layer in range(layers):
                device.write(made, np.full((height, width, components), nothing, dtype), layer)
        return made

    device.texture = texture
    return device
