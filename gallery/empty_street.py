"""Median and darkest: a street without those who walk on it, and all of them at once."""

from . import stills
from .item import Item, walkers
from .stills import Panel

FRAME = 50


def still(shot):
    return stills.sheet(
        stills.row(
            Panel(shot.source(FRAME), "A frame of the footage"),
            Panel(shot.everywhere(FRAME, "Average"), "The average of 81 frames: all leave a mist"),
        ),
        stills.row(
            Panel(shot.result(FRAME), "Their median: the street, without those who pass"),
            Panel(shot.everywhere(FRAME, "Darkest"), "The darkest: where they have been"),
        ),
        caption="Footage: vtest.avi of OpenCV's samples, Apache-2.0",
    )


ITEM = Item(
    name="empty_street",
    title="the median is the street without those who pass",
    footage=walkers,
    recipes=("empty_street.json",),
    frames=(45, 54),
    still=still,
)
