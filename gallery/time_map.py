"""Time maps: every pixel shows its own moment of 33 frames, as a ramp says; the slit-scan classics."""

from . import stills
from .item import Item, bunny
from .stills import Panel

FRAME = 31  # that is shown
CROP = slice(0, 720), slice(40, 940)


def still(linear, angle):
    last = FRAME + linear.contents.options.at(1).window - 1
    return stills.sheet(
        stills.row(
            Panel(linear.result(FRAME)[CROP], "Time runs down, 1.3 seconds from top to bottom"),
            Panel(angle.result(FRAME)[CROP], "Time runs around, clockwise from the top"),
        ),
        stills.row(
            Panel(linear.coefficients(FRAME)[CROP], "A linear ramp"),
            Panel(linear.source(FRAME)[CROP], "First frame"),
            Panel(linear.source(last)[CROP], "Last of 33"),
            Panel(angle.coefficients(FRAME)[CROP], "By the angle"),
        ),
        caption="Big Buck Bunny, © 2008 Blender Foundation, www.bigbuckbunny.org, CC BY 3.0",
    )


ITEM = Item(
    name="time_map",
    title="every pixel shows its own moment, as a ramp says",
    footage=bunny,
    recipes=("time_map.json", "time_map-angle.json"),
    frames=(1, 100),
    still=still,
)
