"""One stroke, tracked, with Follow Edges: a woman stays sharp as she walks, and no halo of the street with her.

The stroke was drawn at frame 22; the recipe has the keys that Track made of it:
`shutter track walkers.mp4 --recipe R.json --region woman --frame 22 --frames 1:36 --output one_stroke.json`
"""

from . import stills
from .item import ASSETS, Item
from .stills import Panel

FRAMES = 8, 15, 22, 29
STREET = slice(190, 370), slice(500, 768)


def footage(_folder):
    return ASSETS / "walkers.mp4"


def still(shots):
    (shot,) = shots
    rows = [
        ("Footage, frame {}", shot.source),
        ("One stroke, drawn at frame 22", shot.scribbles),
        ("How much of each shutter", shot.coefficients),
        ("She is sharp, all else is 12 frames", shot.result),
    ]
    return stills.sheet(
        *(stills.row(*(Panel(shown(frame)[STREET], words.format(frame)) for frame in FRAMES)) for words, shown in rows)
    )


ITEM = Item(
    name="one_stroke",
    figure=None,
    title="one stroke, tracked, finds the edges of a woman who walks",
    footage=footage,
    recipes=("one_stroke.json",),
    frames=(1, 34),
    still=still,
    caption="Footage: vtest.avi of OpenCV's samples, Apache-2.0",
)
