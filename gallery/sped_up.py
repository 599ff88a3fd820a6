"""Footage that plays eight times as fast: sharp frames jump, and Length: Timeline gives them the blur of a camera."""

from . import panning, stills
from .item import Item
from .stills import Panel

SPEED, FRAME = 8, 3


def still(plain, blurred):
    return stills.sheet(
        stills.row(
            Panel(plain.result(FRAME), f"{SPEED} times as fast: every {SPEED}th frame, sharp"),
            Panel(blurred.result(FRAME), "Length: Timeline, half open: as filmed at that speed"),
        )
    )


ITEM = Item(
    name="sped_up",
    title="footage that is sped up gets a camera's blur",
    footage=panning.footage,
    recipes=("sped_up-plain.json", "sped_up.json"),
    frames=(2, 4),
    still=still,
)
