"""Count cuts that are found wrongly, and missed: in films that move hard, and where pieces of films are joined.

    .venv/bin/python scripts/cut_quality.py [--rounds 10] [--seed 0]

The footage is that of assets/. With --seed 1, no cut is found in 800 clips without one, and none of 250 is missed;
besides, 12 of 40 around shots of 1 and 2 frames. The rule was chosen on the seeds 2 to 4.
"""

import argparse
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from shutter_addon.media import open_source  # noqa: E402
from shutter_addon.media.cuts import NEIGHBOURS, is_cut, signature  # noqa: E402

WIDTH, HEIGHT, COUNT = 320, 180, 24
FILMS = "bigbuckbunny.mp4", "pedestrians.avi", "walkers.mp4"
Case = tuple[str, np.ndarray, list[int]]


def films() -> list[np.ndarray]:
    """Every frame of the films, (count, 240, 428, 3) uint8: a third more than is shown of them."""
    found = []
    for name in FILMS:
        with open_source(ROOT / "assets" / name) as source:
            frames = (source.read(i)[..., :3] for i in range(source.count))
            found.append(np.stack([cv2.resize(frame, (428, 240), interpolation=cv2.INTER_AREA) for frame in frames]))
    return found


def seen(frames, x=0.0, y=0.0, zoom=1.0, turn=0.0) -> np.ndarray:
    """Frames (n, 180, 320, 3) through a camera that stands at x, y, in widths and heights of its picture, and is turned
    by degrees; one number each, or one for every frame."""
    moves = np.broadcast_arrays(np.zeros(len(frames)), x, y, zoom, turn)[1:]
    found = []
    for frame, right, up, scale, angle in zip(frames, *moves, strict=True):
        height, width = frame.shape[:2]
        matrix = cv2.getRotationMatrix2D((width / 2, height / 2), angle, scale)
        matrix[:, 2] -= (width - WIDTH) / 2 + right * WIDTH, (height - HEIGHT) / 2 + up * HEIGHT
        found.append(cv2.warpAffine(frame, matrix, (WIDTH, HEIGHT), borderMode=cv2.BORDER_REFLECT))
    return np.stack(found)


def lit(frames, gain=1.0, more=0.0) -> np.ndarray:
    return np.clip(frames * gain + more, 0, 255).astype(np.uint8)


def without_cuts(films, rng) -> Iterator[tuple[str, np.ndarray]]:
    """Kinds of footage that moves hard, and frames of it."""
    time = np.arange(COUNT)

    def piece(count=COUNT):
        film = films[rng.integers(len(films))]
        first = rng.integers(len(film) - count + 1)
        return film[first : first + count, :, :: rng.choice([1, -1])]

    def dropped(items, count):
        first = rng.integers(3, COUNT - 3)
        return np.delete(items, np.s_[first : first + count], axis=0)

    def with_object(lefts, width, height):
        frames, thing = seen(piece()), cv2.resize(piece(1)[0], (int(width * WIDTH), int(height * HEIGHT)))
        for frame, left in zip(frames, (np.asarray(lefts) * WIDTH).astype(int), strict=True):
            first, last = max(left, 0), min(left + thing.shape[1], WIDTH)
            if first < last:
                frame[HEIGHT - len(thing) :, first:last] = thing[:, first - left : last - left]
        return frames

    for size in (0.02, 0.05, 0.1):
        yield "shake", seen(piece(), *rng.normal(0, size, (2, COUNT)))
        yield "hand-held", seen(piece(), *rng.normal(0, size / 2, (2, COUNT)).cumsum(1))
    for pace in (0.02, 0.05, 0.1, 0.2):
        yield "pan", seen(piece(), pace * time)
        for times in (2, 3):
            yield "pan on twos and threes", seen(piece(), pace * time).repeat(times, 0)[:COUNT]
        stroke = np.zeros(COUNT)
        stroke[8:15] = pace * np.sin(np.pi * np.arange(1, 8) / 8)
        yield "whip pan", seen(piece(), stroke.cumsum())
    for count in (1, 2, 3):
        yield "dropped frames", seen(dropped(piece(COUNT + count), count))
        path = 0.02 * np.arange(COUNT + count)
        yield "dropped frames in a pan", seen(piece(), dropped(path, count))
        path = rng.normal(0, 0.02, (COUNT + count, 2)).cumsum(0)
        yield "dropped frames, hand-held", seen(piece(), *dropped(path, count).T)
    for count in (1, 2, 3):
        for more in (60, 120, 255):
            frames, first = seen(piece(), *rng.normal(0, 0.005, (2, COUNT))), rng.integers(2, COUNT - 4)
            frames[first : first + count] = lit(frames[first : first + count].astype(int), more=more)
            yield "flash", frames
    yield "light that goes on", lit(seen(piece()), np.where(time < 12, 0.5, 1)[:, None, None, None])
    yield "flicker", lit(seen(piece()), (1 + 0.3 * np.sin(2.1 * time))[:, None, None, None])
    for width in (0.4, 0.8, 1.2):
        for pace in (0.1, 0.25):
            yield "object that passes", with_object(pace * (time - 4) - width, width, 1)
    for width in (0.25, 0.4):
        for count in (1, 2, 3):
            yield "object that leaves", with_object(0.1 - (time - 9).clip(0) * (width + 0.1) / count, width, 0.7)
        yield "object that jumps", with_object(0.1 + 0.01 * time + np.where(time < 12, 0, 0.2), width, 0.6)
    frames = seen(piece())
    for frame in frames[12:]:
        for line in (130, 160):
            cv2.putText(frame, "A title that appears", (20, line), cv2.FONT_HERSHEY_DUPLEX, 0.8, (255, 255, 255), 2)
    yield "title that appears", frames
    for pace in (1.02, 1.05, 1.1):
        yield "zoom", seen(piece(), zoom=pace**time)
    for pace in (2, 5, 10):
        yield "roll", seen(piece(), turn=pace * time)
    for count in (3, 6, 12):
        share = np.clip((time - 6) / count, 0, 1)[:, None, None, None]
        for end in (0, 255):
            yield "fade", lit(seen(piece()) * (1 - share) + end * share)
            yield "fade", lit(seen(piece()) * share + end * (1 - share))
        yield "dissolve", lit(seen(films[0][:COUNT]) * (1 - share) + seen(films[1][:COUNT]) * share)
    yield "noise", lit(seen(piece()), more=rng.normal(0, 25, (COUNT, HEIGHT, WIDTH, 3)))
    yield "noise in the dark", lit(seen(piece()), 0.1, rng.normal(0, 4, (COUNT, HEIGHT, WIDTH, 3)))


def with_cuts(films, rng) -> Iterator[Case]:
    """Kinds of joined pieces, their frames, and those that begin a shot."""
    bunny, _, walkers = films

    def shot(film, count):
        first = rng.integers(len(film) - count + 1)
        x = rng.choice([0, 0.01, 0.03]) * np.arange(count) if rng.random() < 0.5 else rng.normal(0, 0.01, count)
        return seen(film[first : first + count], x)

    def joined(*counts):
        order = [bunny, films[rng.integers(1, 3)]]
        shots = [shot(order[(k + len(counts)) % 2][..., :: 1 - 2 * (k > 1), :], n) for k, n in enumerate(counts)]
        return np.concatenate(shots), np.cumsum(counts)[:-1].tolist()

    for counts in ((12, 12), (12, 8), (8, 12)):
        yield "two films", *joined(*counts)
    for count in (1, 2, 3):
        yield "at the clip's start", *joined(count, 12)
        yield "at the clip's end", *joined(12, count)
    for count in (3, 4, 5, 8):
        yield "shots of 3 to 8 frames", *joined(8, count, 8)
    for count in (1, 2):
        yield "shots of 1 and 2 frames", *joined(8, count, 8)
    first = rng.integers(0, 5)
    parts = bunny[first : first + 10], bunny[-12 - first : -2 - first]
    yield "distant parts of one film", seen(np.concatenate(parts)), [10]
    for film in films:
        first = rng.integers(len(film) - 20)
        frames = seen(film[first : first + 20])
        frames[10:] = frames[10:, :, ::-1]
        yield "the mirrored film", frames, [10]
    frames, cuts = joined(10, 10)
    for gain in (0.07, 0.15, 0.3):
        yield "in the dark", lit(frames, gain, rng.normal(0, 1.5, frames.shape)), cuts
    yield "in grey", lit(frames.mean(3, keepdims=True).repeat(3, 3)), cuts
    for times in (2, 3):
        yield "on twos and threes", frames[::times].repeat(times, 0), [-(-10 // times) * times]
    for pace in (0.05, 0.1):
        parts = [seen(film[:10], pace * np.arange(10)) for film in (bunny, walkers)]
        yield "between pans", np.concatenate(parts), [10]


def found(frames) -> list[int]:
    """The frames that begin a shot, as they are found."""
    pictures = [signature(frame, "srgb") for frame in frames]
    sides = ((i, pictures[max(i - NEIGHBOURS, 0) : i], pictures[i : i + NEIGHBOURS]) for i in range(1, len(pictures)))
    return [i for i, before, after in sides if is_cut(before, after)]


def measure(rounds: int, seed: int) -> dict[str, tuple[int, int, int]]:
    """By kind of footage: clips, cuts that are none, and cuts that were missed."""
    material, rng = films(), np.random.default_rng(seed)
    clips, false, missed = Counter(), Counter(), Counter()
    for _ in range(rounds):
        plain = ((kind, frames, []) for kind, frames in without_cuts(material, rng))
        for kind, frames, cuts in (*plain, *with_cuts(material, rng)):
            got = {*found(frames)}
            name = "cut: " * bool(cuts) + kind
            clips[name] += 1
            false[name] += len(got.difference(cuts))
            missed[name] += len({*cuts} - got)
    return {kind: (clips[kind], false[kind], missed[kind]) for kind in clips}


def main() -> None:
    parser = argparse.ArgumentParser("cut_quality", description=__doc__.split("\n")[0])
    parser.add_argument("--rounds", type=int, default=10, help="clips of every kind (%(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="of what is drawn by chance (%(default)s)")
    options = parser.parse_args()
    print(f"{'':34}{'clips':>7}{'false':>7}{'missed':>7}")
    for kind, numbers in measure(options.rounds, options.seed).items():
        print(f"{kind:34}" + "".join(f"{number:7}" for number in numbers))


if __name__ == "__main__":
    main()
