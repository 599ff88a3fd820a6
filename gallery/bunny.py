"""Figure 5: scribbles and bar graphs; what swings gets a long exposure, the character a short one."""

from . import stills
from .item import Item, bunny
from .stills import Panel

FRAME = 45


def still(shot):
    return stills.sheet(
        stills.row(
            Panel(with_bars(shot), "Scribbles, and the bars of their shutters"),
            Panel(shot.result(FRAME), "Result: the arms swing, the character is sharp"),
        ),
        stills.row(
            Panel(shot.source(FRAME), "Source"),
            Panel(shot.coefficients(FRAME), "Mattes"),
            Panel(shot.everywhere(FRAME, "Long"), "The long exposure alone"),
        ),
        caption="Big Buck Bunny, © 2008 Blender Foundation, www.bigbuckbunny.org, CC BY 3.0",
    )


def with_bars(shot):
    """The scribbles, with each shutter's bars over them, as in the bar editor."""
    graphs = [stills.graph(*shot.bars(FRAME, name), 340, 130, name) for name in ("Long", "Short")]
    return stills.inset(shot.scribbles(FRAME, 0.8), stills.below(*graphs))


ITEM = Item(
    name="bunny",
    figure=5,
    title="scribbles and bar graphs",
    footage=bunny,
    recipes=("bunny.json",),
    frames=(33, 64),
    still=still,
)
