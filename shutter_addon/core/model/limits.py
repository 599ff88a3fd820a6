"""Limits of an effect's numbers, in recipes and in Blender.

They exceed what films need, but keep pictures computable and numbers within the float32 of Blender and GPUs.
"""

from __future__ import annotations

# Frames of the timeline and of a source, positive or negative, as in Blender's own timeline.
MAX_FRAME = 1_048_574
# Coordinates in pictures, positive or negative, and widths in heights of the picture: float32 keeps a pixel there.
MAX_DISTANCE = 1000.0
# Scale, positive or negative, and rotation in degrees, positive or negative: a thousand turns.
MAX_SCALE = 1000.0
MAX_DEGREES = 360_000.0
# Each shutter takes registers for every pixel on a GPU; with more than 40, a software renderer compiles for minutes.
MAX_SHUTTERS = 32
MAX_REGIONS = 1000
# Total of all regions, each with its largest drawing.
MAX_POINTS = 100_000
# Per shutter, per region, and for source time: an hour with a key at every frame.
MAX_KEYS = 100_000
# Frames before and after over which a motion is averaged; the keys of each are read.
MAX_SMOOTH = 250
# Frames before and after the shown one that are searched for the background of layers; each needs mattes.
MAX_PLATE_REACH = 500
# Characters, as in Blender.
MAX_NAME = 63
# Characters of a file's path, as in Blender, and of an EXR channel's name.
MAX_PATH = 1023
MAX_CHANNEL = 255
# The largest bar, and the smallest sum of a shutter's bars. One shutter can be 10¹⁴ times as bright as another.
MAX_BAR = 1e6
MIN_EXPOSURE = 1e-6
# Luminance of a threshold and its softness; white is 1.
MAX_THRESHOLD = 1000.0
# Bytes of a recipe's file.
MAX_BYTES = 32_000_000
