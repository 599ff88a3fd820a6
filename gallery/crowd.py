"""Figure 10: keyed regions follow people; one stays sharp in a blurred crowd, then the reverse."""

from . import stills
from .item import Item, walkers
from .stills import Panel

ROAD = slice(155, 440), slice(255, 762)


def still(taken, dissolved):
    return stills.sheet(
        stills.row(
            Panel(scribbles(taken, 26), "Regions follow people; her shutter"),
            Panel(scribbles(taken, 42), "opens to the crowd's long exposure,"),
            Panel(scribbles(taken, 68), "and his closes to a still frame"),
        ),
        stills.row(
            Panel(taken.result(26)[ROAD], "One stays sharp in a blurred crowd,"),
            Panel(taken.result(42)[ROAD], "merges with it,"),
            Panel(taken.result(68)[ROAD], "and another is taken"),
        ),
        stills.row(
            Panel(dissolved.result(6)[ROAD], "The reverse: everyone is sharp,"),
            Panel(dissolved.result(14)[ROAD], "one dissolves"),
            Panel(dissolved.result(26)[ROAD], "in a long exposure"),
        ),
        caption="Footage: vtest.avi of OpenCV's samples, Apache-2.0",
    )


def scribbles(shot, frame):
    """The road with its scribbles, and the bars of the two keyed shutters."""
    graphs = [stills.graph(*shot.bars(frame, name), 110, 68, name, 18) for name in ("Woman", "Man")]
    return stills.inset(shot.scribbles(frame)[ROAD], stills.beside(*graphs, gap=4), "bottom left", margin=8)


ITEM = Item(
    name="crowd",
    figure=10,
    title="one sharp in a blurred crowd, and the reverse",
    footage=walkers,
    recipes=("crowd.json", "crowd-reverse.json"),
    frames=(1, 95),
    still=still,
)
