"""Ranges of frame numbers, and words for them in messages."""

from collections.abc import Iterable
from itertools import groupby


def runs(frames: Iterable[int]) -> list[tuple[int, int]]:
    """Return the (first, last) frame of each run of consecutive frames, ascending."""
    # Consecutive numbers have the same difference from their index.
    groups = groupby(enumerate(sorted(set(frames))), lambda item: item[1] - item[0])
    members = ([frame for _, frame in group] for _, group in groups)
    return [(run[0], run[-1]) for run in members]


def in_words(frames: Iterable[int]) -> str:
    """Return words for at least one frame, for use in a sentence: "frame 12" or "frames 12, 17 to 20"."""
    ends = runs(frames)
    words = ", ".join(f"{first}" if first == last else f"{first} to {last}" for first, last in ends)
    return f"frame{'s' if len(ends) > 1 or ends[0][0] != ends[0][1] else ''} {words}"


def common(one: range, other: range) -> range:
    """Return the intersection of two ranges with step 1."""
    return range(max(one.start, other.start), min(one.stop, other.stop))
