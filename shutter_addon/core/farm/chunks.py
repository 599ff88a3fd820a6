"""How many frames of a film a task of a farm should render."""

# Of the frames that a chunk decodes, one in so many is also decoded by a neighbour, at most.
ONE_IN = 10
# Frames of a chunk, at least: before the first one a process has to start, and to open the edit and its footage.
LEAST = 24


def decoded(frames: int, window: int, step: int = 1) -> int:
    """Count the frames and moments of a source that a chunk of so many timeline frames reads.

    Args:
        window: frames that a shutter can expose, moments included.
        step: how many of these the source moves on by from one timeline frame to the next: as many as a filmed frame
            has, unless the source is retimed.
    """
    return (frames - 1) * step + window


def chunk_size(window: int, step: int = 1) -> int:
    """The smallest chunk, in timeline frames and LEAST at least, that decodes few frames which are not its own alone:
    one in ONE_IN. For n frames these are (L − s) of n·s + (L − s), with a window of L frames and s frames from one
    picture to the next, so n = (ONE_IN − 1)·(L − s) / s.

    Longer chunks decode less in all; shorter ones spread better over machines, and cost less to render again."""
    overlap = max(window - step, 0)
    return max(LEAST, -(-(ONE_IN - 1) * overlap // step))
