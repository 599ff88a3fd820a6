"""The ranges of an effect's numbers, in recipes and in Blender: far beyond what films need, and small enough that no
picture takes for ever, and that none of them overflows the float32 that Blender and GPUs count in."""

from __future__ import annotations

# Frames of the timeline and of a source, to either side of 0: as far as Blender's own timeline goes.
MAX_FRAME = 1_048_574
# Points and locations in pictures to either side, widths in heights of the picture: float32 keeps a pixel there.
MAX_DISTANCE = 1000.0
# Scale to either side of 0, and rotation in degrees to either side: a thousand turns.
MAX_SCALE = 1000.0
MAX_DEGREES = 360_000.0
# Each is a part of every pixel's registers on a GPU; for more than 40, a software renderer takes minutes to compile.
MAX_SHUTTERS = 32
MAX_REGIONS = 1000
# Of all regions together, of each one's drawing with the most points.
MAX_POINTS = 100_000
# Of one shutter, of one region, and of the source time: an hour with a key at every frame.
MAX_KEYS = 100_000
# Frames before and after each over which a motion is averaged: each of them is asked for its keys.
MAX_SMOOTH = 250
# Frames before and after the shown one in which what lies behind layers is looked for: each has mattes to be made.
MAX_PLATE_REACH = 500
# In characters: as long as Blender's own, and the channels of an EXR file.
MAX_NAME = 63
# In characters: the path of a file, as long as Blender's own, and the name of a channel in it.
MAX_PATH = 1023
MAX_CHANNEL = 255
# A bar, and what the bars of a shutter add up to at least: of two shutters, one may be 10¹⁴ times as bright.
MAX_BAR = 1e6
MIN_EXPOSURE = 1e-6
# Luminance below which light leaves no trail, and over which that fades: white is 1.
MAX_THRESHOLD = 1000.0
# Of a recipe's file.
MAX_BYTES = 32_000_000
