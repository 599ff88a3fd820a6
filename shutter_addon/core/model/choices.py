"""The choices of an effect's properties: (identifier, label, description), as for the enum properties of Blender.

Recipes write identifiers in small letters. Blender shows the label, and the description as its tooltip.
"""

# The translation context of labels that Blender's own catalog translates differently, such as "Frames".
CONTEXT = "Virtual Shutter"


POSITIONS = (
    ("START", "Start", "The shown frame is the first of them"),
    ("CENTER", "Center", "The shown frame is in their middle"),
    ("END", "End", "The shown frame is the last of them"),
)


INTERPOLATIONS = (
    ("DISPLACEMENT", "Displacement", "Move the exposure in time from one shutter or keyframe to the next"),
    ("VALUE", "Value", "Cross-fade pictures between shutters, and fade every bar by itself between keyframes"),
)


LIGHTS = (
    ("LINEAR", "Linear", "Sum light as a camera does, so that bright streaks stay bright"),
    ("ENCODED", "Encoded", "Sum the values that the footage is encoded with, which dims bright streaks"),
)


EXPOSURES = (
    ("NORMALIZED", "Normalized", "Every shutter gives the same brightness"),
    ("WEIGHTED", "Weighted", "A shutter that is open for less time than the default is darker, always in linear light"),
)


EDGES = (
    ("HOLD", "Hold", "Repeat the first or last frame beyond the clip's ends"),
    ("MIRROR", "Mirror", "Play the clip backward beyond its ends"),
    ("SHORTEN", "Shorten", "Leave out what lies beyond the clip's ends"),
    ("SLIDE", "Slide", "Move an exposure that reaches beyond the clip's ends back into the clip"),
)


AGGREGATES = (
    ("1", "Full", "Every pixel has its own shutter"),
    ("2", "Half", "Blocks of 2×2 pixels share a shutter"),
    ("4", "Quarter", "Blocks of 4×4 pixels share a shutter"),
)


# Files store an item by its position: the first five are those of format 1.
SMOOTH = (
    ("1", "Off", "Expose only filmed frames"),
    ("2", "2×", "2 moments per filmed frame"),
    ("4", "4×", "4 moments per filmed frame"),
    ("8", "8×", "8 moments per filmed frame"),
    ("16", "16×", "16 moments per filmed frame"),
    ("AUTO", "Automatic", "As many moments as the fastest motion in the footage needs, at most 16"),
)


DRAWN = (
    ("LINE", "Line", "The strokes themselves, as wide as the region's width"),
    ("LASSO", "Lasso", "Everything that the strokes enclose"),
    ("OUTLINE", "Outline", "A drawn matte: everything inside closed curves, exact to the pixel"),
    ("SUBJECT", "Subject", "What a model finds under strokes and follows; drawn outlines overrule the model"),
)


# Files keep the number of an item.
KINDS = (
    *DRAWN[:-1],
    ("MATTE", "Matte", "A value per pixel from a file, a strip or a mask"),
    ("RAMP", "Ramp", "A gradient across the picture, from none of the shutter to all of it"),
    DRAWN[-1],
)


BETWEEN = (
    ("CARRIED", "Tracked", "The outline follows the footage's own motion from both drawings"),
    ("STRAIGHT", "Linear", "Curves go straight from one drawing to the next"),
)


MATTE_SOURCES = (
    ("IMAGE", "File", "A movie, an image sequence or a picture"),
    ("STRIP", "Strip", "A movie, image or clip strip of the edit, as it is trimmed and retimed, muted or not"),
    ("MASK", "Mask", "A mask, as a Mask strip on the footage shows it"),
)


CHANNELS = (
    ("LUMINANCE", "Luminance", "How bright the matte is"),
    ("RED", "Red", "The matte's red"),
    ("GREEN", "Green", "The matte's green"),
    ("BLUE", "Blue", "The matte's blue"),
    ("ALPHA", "Alpha", "How opaque the matte is"),
    ("NAMED", "Named", "A channel of an EXR file, by its name"),
)


TIMINGS = (
    ("SOURCE", "Footage", "The matte follows the frames of the footage, even if that is trimmed or retimed"),
    ("TIMELINE", "Timeline", "The matte plays along the timeline, from where the untrimmed Shutter strip would start"),
)


BLENDS = (
    ("OVER", "Over", "The matte covers the regions below"),
    ("ADD", "Add", "The matte replaces only the default shutter, so that mattes can be side by side"),
)


RAMPS = (
    ("LINEAR", "Linear", "From the left to the right; its rotation turns it"),
    ("RADIAL", "Radial", "From the center to the farthest corner"),
    ("ANGLE", "Angle", "Once around the center, clockwise from the top"),
    ("LUMINANCE", "Luminance", "How bright the shown frame is"),
)


MOTIONS = (
    ("LOCATION", "Location", "Follow the location"),
    ("ROTATION", "Location, Rotation", "Follow location and rotation"),
    ("SCALE", "Location, Rotation, Scale", "Follow location, rotation and scale"),
)


FOLLOWED = (
    ("TRACK", "Track", "A single track, which moves the region and does not turn it"),
    ("PLANE", "Plane Track", "The corners of a plane track"),
    ("OBJECT", "Object", "All tracks of an object, or of the camera"),
)


FOLLOWS = (
    ("NOTHING", "Nothing", "The exposure stays where it is in the picture"),
    ("REGION", "Region", "The exposure moves with a region, so that what the region covers stays sharp"),
    ("CAMERA", "Camera", "The exposure moves with the camera's view, as if the camera stood still"),
)


COMBINES = (
    ("AVERAGE", "Average", "The average of the frames, like that of a camera"),
    ("LIGHTEST", "Lightest", "The lightest value in any frame: trails of light keep their brightness at any length"),
    ("DARKEST", "Darkest", "The darkest value in any frame"),
    ("MEDIAN", "Median", "What most frames show: people who pass by disappear"),
)

LENGTHS = (
    ("FRAMES", "Frames", "The bars set for how many frames the shutter is open"),
    ("TIMELINE", "Timeline", "The bars are the exposure during one timeline frame, at any speed of the footage"),
    ("MOTION", "Distance", "Open until the followed region or camera has moved by a distance; bars only set the shape"),
)

SIDES = (
    ("TOP", "Top", "Rows are read downward, as most cameras do"),
    ("BOTTOM", "Bottom", "Rows are read upward, like those of a camera upside down"),
    ("LEFT", "Left", "Columns are read from the left, like those of a rotated camera"),
    ("RIGHT", "Right", "Columns are read from the right, like those of a rotated camera"),
)


READS = (
    ("ROWS", "Rows", "Upright lines lean as they move sideways"),
    ("COLUMNS", "Columns", "Level lines lean as they move up and down, with a rotated camera"),
)
