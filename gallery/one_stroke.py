"""One stroke, tracked, with Follow Edges: a woman stays sharp as she walks, as a layer, and beside that without it.

The stroke was drawn at frame 22; the recipe has the keys that Track made of it:
`shutter track walkers.mp4 --recipe R.json --region woman --frame 22 --frames 1:36 --output one_stroke.json`
"""

from itertools import zip_longest

from . import stills
from .item import Item, walkers
from .stills import Panel

FRAMES = 8, 15, 22, 29
STREET = slice(190, 370), slice(500, 768)


def still(shot, plain):
    return stills.sheet(
        row(shot.source, *(f"Frame {frame}" for frame in FRAMES)),
        row(plain.scribbles, "One stroke, tracked"),
        row(plain.coefficients, "How much of each shutter"),
        row(plain.result, "Twelve frames"),
        row(shot.result, "The same, she is a layer"),
        caption="Footage: vtest.avi of OpenCV's samples, Apache-2.0",
    )


def row(shown, *words):
    """What is shown at each of the moments, with words below."""
    panels = zip_longest((shown(frame)[STREET] for frame in FRAMES), words, fillvalue="")
    return stills.row(*(Panel(picture, word) for picture, word in panels))


ITEM = Item(
    name="one_stroke",
    title="one stroke, tracked, finds the edges of a woman who walks, and as a layer she leaves no ghost",
    footage=walkers,
    recipes=("one_stroke.json", "one_stroke-plain.json"),
    frames=(1, 34),
    still=still,
)
