"""What an effect's properties can be chosen from: identifier, name, description, icon, number."""

# Of labels that Blender translates in another sense ("Frames" is one on the screen). Operators have a context anyway.
CONTEXT = "Virtual Shutter"


# Enum identifiers are the recipe's words in capitals.
POSITIONS = (
    ("START", "Start", "The shown frame is the first of them"),
    ("CENTER", "Center", "The shown frame lies in their middle"),
    ("END", "End", "The shown frame is the last of them"),
)


INTERPOLATIONS = (
    ("DISPLACEMENT", "Displacement", "Move times between shutters and between keyframes"),
    ("VALUE", "Value", "Cross-fade pictures between shutters, and fade every bar by itself between keyframes"),
)


LIGHTS = (
    ("LINEAR", "Linear", "Sum light as a camera does, so that bright streaks stay bright"),
    ("ENCODED", "Encoded", "Sum the values that the footage is encoded with, which dims bright streaks"),
)


EXPOSURES = (
    ("NORMALIZED", "Normalized", "Every shutter gives the same brightness"),
    (
        "WEIGHTED",
        "Weighted",
        "A shutter that is open for less time than the default is darker, in linear light whatever is summed",
    ),
)


EDGES = (
    ("HOLD", "Hold", "Repeat the first or last frame beyond the clip's ends"),
    ("MIRROR", "Mirror", "Play the clip backward beyond its ends"),
    ("SHORTEN", "Shorten", "Leave out what lies beyond the clip's ends"),
    ("SLIDE", "Slide", "Move an exposure into the clip, by as many frames as it reaches beyond its ends"),
)


AGGREGATES = (
    ("1", "Full", "Every pixel has its own shutter"),
    ("2", "Half", "Blocks of 2×2 pixels share a shutter"),
    ("4", "Quarter", "Blocks of 4×4 pixels share a shutter"),
)


# Files keep the number of an item: the first five are those of format 1.
SMOOTH = (
    ("1", "Off", "Expose filmed frames alone"),
    ("2", "2×", "2 moments from a filmed frame to the next"),
    ("4", "4×", "4 moments from a filmed frame to the next"),
    ("8", "8×", "8 moments from a filmed frame to the next"),
    ("16", "16×", "16 moments from a filmed frame to the next"),
    ("AUTO", "Automatic", "As many moments as the fastest motion in the footage needs, 16 at most"),
)


STROKES = (
    ("LINE", "Line", "The strokes themselves, as wide as the region's width"),
    ("LASSO", "Lasso", "All that the strokes enclose"),
)


DRAWN = (
    *STROKES,
    ("OUTLINE", "Outline", "What closed curves enclose, to the pixel: a matte that is drawn"),
    ("SUBJECT", "Subject", "What a model finds under strokes, and follows: outlines that are drawn overrule it"),
)


# Files keep the number of an item.
KINDS = (
    *DRAWN[:-1],
    ("MATTE", "Matte", "What a file, a strip or a mask says for every pixel"),
    ("RAMP", "Ramp", "From none of the shutter to all of it, across the picture"),
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
    ("SOURCE", "Footage", "The matte's frames belong to those of the footage, however that is trimmed and retimed"),
    ("TIMELINE", "Timeline", "The matte plays along the timeline, from where the Shutter strip starts untrimmed"),
)


BLENDS = (
    ("OVER", "Over", "What is beneath shares what the matte leaves"),
    ("ADD", "Add", "What the matte takes comes from the default shutter alone, so that mattes stand side by side"),
)


RAMPS = (
    ("LINEAR", "Linear", "From the left to the right; its rotation turns it"),
    ("RADIAL", "Radial", "From the center to the farthest corner"),
    ("ANGLE", "Angle", "Once around the center, clockwise from the top"),
    ("LUMINANCE", "Luminance", "How bright the shown frame is"),
)


MOTIONS = (
    ("LOCATION", "Location", "It is moved"),
    ("ROTATION", "Location, Rotation", "It is moved and turned"),
    ("SCALE", "Location, Rotation, Scale", "It is moved, turned and scaled"),
)


FOLLOWED = (
    ("TRACK", "Track", "A single track, which moves the region and does not turn it"),
    ("PLANE", "Plane Track", "The corners of a plane track"),
    ("OBJECT", "Object", "All tracks of an object, or of the camera"),
)


FOLLOWS = (
    ("NOTHING", "Nothing", "The exposure stays where it is in the picture"),
    ("REGION", "Region", "The exposure moves with a region: what the region moves with stays sharp"),
    ("CAMERA", "Camera", "The exposure moves with what the camera sees, as if the camera had stood still"),
)


COMBINES = (
    ("AVERAGE", "Average", "The average of the frames, as a camera makes it"),
    ("LIGHTEST", "Lightest", "What is lightest in any of them: a trail of light, as bright however long it is"),
    ("DARKEST", "Darkest", "What is darkest in any of them"),
    ("MEDIAN", "Median", "What most of them show: who passes by is gone"),
)

LENGTHS = (
    ("FRAMES", "Frames", "The bars say for how many frames the shutter is open"),
    ("TIMELINE", "Timeline", "The bars are the exposure of one frame of the timeline, however fast the footage runs"),
    ("MOTION", "Distance", "The shutter is open while what it follows moves by a set distance; the bars are the shape"),
)

SIDES = (
    ("TOP", "Top", "Rows are read downward, as most cameras do"),
    ("BOTTOM", "Bottom", "Rows are read upward, as by a camera that hung upside down"),
    ("LEFT", "Left", "Columns are read, from the left, as by a camera that was turned"),
    ("RIGHT", "Right", "Columns are read, from the right, as by a camera that was turned"),
)


READS = (
    ("ROWS", "Rows", "Upright lines lean as they move sideways"),
    ("COLUMNS", "Columns", "Level lines lean as they move up and down: of a camera that was turned"),
)


READOUT_UNITS = (
    ("PERCENT", "Percent", "Of the time from a filmed frame to the next"),
    ("MILLISECONDS", "Milliseconds", "A time, as tables of cameras have it"),
)


# The renderer asks the F-curves itself: keys on these would show, and not render.
UNKEYED: set[str] = set()
