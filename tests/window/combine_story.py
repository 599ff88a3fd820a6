"""The street without those who pass, behind a woman who is sharp: Combine is set to each of its ways, looked at, and
rendered. Run inside Blender, by test_tracked.py."""

# ruff: noqa: E402 (Blender finds the helpers once it knows their folder)
import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent)]

import driver
import one_stroke_story
import story
from one_stroke_story import FRAME

SHOWN = range(40, 101)
WINDOW = 33


def combined():
    effect = story.effect()
    effect.window, effect.position = WINDOW, "CENTER"
    effect.active_shutter = 0
    for bar in effect.shutters[0].bars:
        bar.weight = 1.0
    for bar in effect.shutters[1].bars:
        bar.weight = 0.0
    effect.shutters[1].bars[WINDOW // 2].weight = 1.0
    for number, mode in enumerate(("AVERAGE", "LIGHTEST", "DARKEST", "MEDIAN"), 1):
        story.effect().shutters[0].combine = mode
        yield from story.seen(f"{number}_{mode.lower()}")


def told():
    yield from one_stroke_story.begun(SHOWN)
    yield from combined()
    yield from one_stroke_story.rendered(range(FRAME, FRAME + 1))
    yield from one_stroke_story.looked_at()


if __name__ == "__main__":
    driver.play(told)
