"""Limits of llvmpipe, Mesa's software renderer.

Two more things exist only for it: the pass compose_search, where another would take too many iterations, and TILED in
shaders/include/sums.glsl, since it stores textures row by row.
"""

import numpy as np

# Loop iterations of an invocation. It ends loops after 65,535 in all, without an error.
MOST_ITERATIONS = 60_000
# Bytes of a texture array. It reads wrong values from arrays over 2 GiB, without an error.
MOST_BYTES = 1 << 30


def is_llvmpipe(renderer: str) -> bool:
    """Return whether a renderer's name, as the driver tells it, is that of llvmpipe.

    It uses the machine's memory, and stores textures row by row.
    """
    return "llvmpipe" in renderer


def frames_iterations(values: np.ndarray, span: tuple[int, int]) -> int:
    """Return the most loop iterations that an invocation of the pass compose_frames can take, for any coefficients.

    llvmpipe ends loops after 65,535 without an error. Each piece (a row of the table) counts for every frame from the
    one in which it may begin to the one in which it and all before it have ended.

    Args:
        values: The table of shutters (composition_passes.table).
        span: FrameState.open_span.
    """
    groups = values.shape[1] // 2
    start, end, apart = values[1:, :groups], values[1:, groups:-1], values[1:, -1, 1]
    until = np.maximum.accumulate(end.max(axis=(1, 2)) + apart)
    from_ = start.max(axis=(1, 2)) - 2 * apart  # the earliest start of a shutter, less the difference again
    frames = np.clip(np.ceil(until), *span) - np.clip(np.floor(from_), *span) + 1
    return int(frames.sum()) + len(start) + span[1] - span[0]


def median_iterations(rows: int, frames: int, kind: str) -> int:
    """Return how many loop iterations the pass compose_search takes for a median, in an invocation.

    shaders/include/combine.glsl has the loops.

    Args:
        rows: The number of pieces in the table of shutters.
        frames: The number of frames.
        kind: The format of the frames' textures.
    """
    scans = 5 if kind == "rgba8" else 10
    return scans * frames * (1 + 4 * (1 + rows.bit_length()))
