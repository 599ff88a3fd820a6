"""Values of mattes as pictures get them: which frame, made once, on blocks."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from shutter_addon.core.messages import MediaError
from shutter_addon.core.model.mattes import FileFrame, Matte, Ramp
from shutter_addon.media import matte_values
from shutter_addon.media.matte_values import MatteValues

WIDTH, HEIGHT, COUNT = 11, 6, 5


@dataclass(frozen=True)
class File:
    """A file whose frames are all of one value, a tenth of their number; it notes what is done with it."""

    name: str
    log: list = field(compare=False, default_factory=list)

    def open(self):
        self.log.append("open")
        return Source(self.log)


class Source:
    width, height, count = WIDTH, HEIGHT, COUNT
    fps, step = None, 1

    def __init__(self, log):
        self.log = log

    def read(self, index):
        self.log.append(index)
        return np.full((HEIGHT, WIDTH), index / 10, np.float32)

    def close(self):
        self.log.append("close")


def shown(values, *contents, index=0, block=1, **fields):
    return [array for _, array in values.values(tuple(Matte(1, each, **fields) for each in contents), index, block)]


@pytest.mark.parametrize(
    ("index", "step", "offset", "frame"), [(3, 1, 0, 3), (7, 2, 0, 3), (8, 4, -1, 1), (9, 1, 0, 4), (0, 1, -3, 0)]
)
def test_the_matte_of_a_filmed_frame_holds_until_the_next(index, step, offset, frame):
    (found,) = shown(MatteValues(WIDTH, HEIGHT, step), FileFrame(File("a"), offset), index=index)
    assert found.shape == (HEIGHT, WIDTH)
    assert np.unique(found) == pytest.approx(frame / 10)


def test_what_did_not_change_is_not_made_again(monkeypatch):
    monkeypatch.setattr(matte_values, "MOST_OPEN", 1)
    values, first, second = MatteValues(WIDTH, HEIGHT), File("a"), File("b")
    kept = shown(values, FileFrame(first), Ramp("radial"), index=2)
    again = shown(values, Ramp("radial"), FileFrame(first), FileFrame(second), index=2)
    assert again[0] is kept[1]
    assert again[1] is kept[0]
    assert first.log == ["open", 2]
    shown(values, FileFrame(second), index=3)
    assert first.log == ["open", 2, "close"]
    assert second.log == ["open", 2, 3]
    values.close()
    shown(values, FileFrame(second), index=4)
    assert second.log == ["open", 2, 3, "close", "open", 4]


def test_keys_tell_values_apart():
    values, file = MatteValues(WIDTH, HEIGHT), FileFrame(File("a"))
    plain = Matte(1, file)
    others = [replace(plain, feather=0.1), replace(plain, invert=True), replace(plain, content=FileFrame(File("b")))]
    keys = [key for key, _ in values.values((plain, *others), 2, 1)]
    keys += [key for key, _ in values.values((plain,), 3, 1)] + [key for key, _ in values.values((plain,), 2, 2)]
    assert len(set(keys)) == 6
    alike = values.values((replace(plain, opacity=0.5, blend="add", shutter=2),), 2, 1)
    assert alike[0][0] == keys[0]  # what is laid differs, and not the values


@pytest.mark.parametrize("block", [1, 2, 4])
def test_feathered_then_inverted_then_averaged(block):
    (plain,) = shown(MatteValues(WIDTH, HEIGHT), Ramp("angle"))
    (found,) = shown(MatteValues(WIDTH, HEIGHT), Ramp("angle"), feather=0.5, invert=True, block=block)
    (soft,) = shown(MatteValues(WIDTH, HEIGHT), Ramp("angle"), feather=0.5)
    assert np.abs(soft - plain).max() > 0.05
    blocks = [
        [(1 - soft)[y : y + block, x : x + block].mean() for x in range(0, WIDTH, block)]
        for y in range(0, HEIGHT, block)
    ]
    assert found == pytest.approx(np.array(blocks), abs=1e-6)


def test_a_file_that_cannot_be_read_leaves_the_others():
    class Missing(File):
        def open(self):
            raise MediaError("b: gone")

    values, good = MatteValues(WIDTH, HEIGHT), File("a")
    with pytest.raises(MediaError, match="b: gone"):
        shown(values, FileFrame(good), FileFrame(Missing("b")))
    assert shown(values, FileFrame(good), index=3)[0][0, 0] == pytest.approx(0.3)
