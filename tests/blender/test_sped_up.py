"""Length: Timeline in Blender: footage that is sped up, slowed down, frozen and reversed, beside a camera's."""

import numpy as np
import pytest
from support import effect_of, image_strip, recipe, request, write_frames

from shutter_addon.blender.editing import bar_edits
from shutter_addon.blender.rendering import sessions
from shutter_addon.core.frames import light

WIDTH, HEIGHT, COUNT, WINDOW = 120, 24, 60, 16
SPOT, STEP = 6, 1.5  # pixels: its width, and its way from frame to frame


def frame(index):
    """A bright spot that goes to the right, its edges exact."""
    left = 4 + STEP * index
    x = np.arange(WIDTH)
    covered = np.clip(np.minimum(x + 1, left + SPOT) - np.maximum(x, left), 0, 1)
    level = 255 * light.to_encoded(0.02 + 0.9 * covered)
    return np.repeat(np.repeat(np.rint(level)[None, :, None], HEIGHT, 0), 3, 2).astype(np.uint8)


@pytest.fixture
def edited(bpy, edit, tmp_path):
    """Makes an effect of a half open shutter whose length is the timeline's: its strip and the effect."""

    def make(change=lambda source: None, **options):
        source = image_strip(edit, write_frames(tmp_path / "in", [frame(i) for i in range(COUNT)]))
        change(source)
        said = recipe(WINDOW, [1] * (WINDOW // 2) + [0] * (WINDOW // 2), **options)
        said["shutters"][0]["length"] = "timeline"
        return effect_of(edit, source, said)

    yield make
    sessions.forget()


def linear(strip, effect, at):
    return request(strip.id_data, effect, strip, at).picture()[12, :, 0]


def filmed(first, last):
    """A camera's exposure from one source frame to another, of 200 moments."""
    moments = np.linspace(first, last, 200, endpoint=False)
    return np.mean([light.to_linear(frame(moment)[12, :, 0] / 255.0) for moment in moments], axis=0)


def speed(*keys):
    return [{"frame": at, "value": value} for at, value in keys]


def test_eight_times_as_fast(edited):
    """Open for four source frames; the streak is as long as a camera's."""
    strip, effect = edited(time=speed((1, 1), (7, 49)))
    strip.id_data.frame_set(3)
    assert (
        bar_edits.current_summary(strip.id_data, effect, strip, bar_edits.bars_now(effect, 0))
        == "Open for 4 of 16 frames here"
    )
    for at in (2, 4):
        index = 8 * (at - 1)
        found = linear(strip, effect, at)
        expected = np.mean([light.to_linear(frame(index + k)[12, :, 0] / 255.0) for k in range(4)], axis=0)
        assert np.abs(255 * light.to_encoded(found) - 255 * light.to_encoded(expected)).max() <= 1
        # The light's second moment is that of the spot and the way.
        assert spread(found) == pytest.approx(spread(filmed(index, index + 4)), rel=0.02)


def spread(line):
    x = np.arange(WIDTH)
    weight = line - line.min()
    middle = (weight * x).sum() / weight.sum()
    return np.sqrt((weight * (x - middle) ** 2).sum() / weight.sum())


def test_a_ramp_and_a_freeze(edited):
    """From one to eight times the speed; where it stands still, the frame is sharp."""
    strip, effect = edited(time=speed((1, 1), (5, 5), (9, 37), (20, 37)), position="center")
    frames = [light.to_linear(frame(i)[12, :, 0] / 255.0) for i in range(COUNT)]
    np.testing.assert_allclose(linear(strip, effect, 3), frames[2], atol=2e-3)
    np.testing.assert_allclose(linear(strip, effect, 15), frames[36], atol=2e-3)
    slow, fast = (spread(linear(strip, effect, at)) for at in (3, 7))
    assert fast > slow + 0.5
    assert effect.shutters[0].length == "TIMELINE"


def test_a_strip_that_blender_retimes_and_reverses(edited):
    def change(source):
        source.use_reverse_frames = True

    strip, effect = edited(change)
    found = linear(strip, effect, 11)
    np.testing.assert_allclose(found, light.to_linear(frame(COUNT - 11)[12, :, 0] / 255.0), atol=2e-3)


def test_the_last_frame_is_blurred_as_those_before(edited):
    strip, effect = edited(time=speed((1, 1), (8, 57)), position="end")
    assert spread(linear(strip, effect, 8)) == pytest.approx(spread(linear(strip, effect, 5)), rel=0.02)
