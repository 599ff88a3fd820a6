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
    """Return whether a renderer is llvmpipe, which renders on the CPU, in main memory, with textures stored row by row.

    Args:
        renderer: The renderer's name, as the driver tells it.
    """
    return "llvmpipe" in renderer


def frames_iterations(values: np.ndarray, span: tuple[int, int]) -> int:
    """Return an upper limit of the loop iterations that one invocation of compose_frames takes.

    The limit holds for any coefficients of its pixels. It shows whether the shader can run on llvmpipe, which ends all
    loops of an invocation after 65,535 iterations without an error. Each piece (a row of the table) counts once for
    each frame from the one in which it may begin to the one in which it and all before it have ended, in any pixel.

    Args:
        values: The table of shutters by displacement (composition_passes.table).
        span: FrameState.open_span: the first exposed frame of the window and one past the last.
    """
    groups = values.shape[1] // 2
    start, end, apart = values[1:, :groups], values[1:, groups:-1], values[1:, -1, 1]
    until = np.maximum.accumulate(end.max(axis=(1, 2)) + apart)
    from_ = start.max(axis=(1, 2)) - 2 * apart  # the earliest start of a shutter, less the difference again
    frames = np.clip(np.ceil(until), *span) - np.clip(np.floor(from_), *span) + 1
    return int(frames.sum()) + len(start) + span[1] - span[0]


def median_iterations(rows: int, frames: int, kind: str) -> int:
    """Return the most loop iterations that one invocation of the shader compose_search takes to make a median.

    It shows whether the shader can run on llvmpipe. It scans all frames several times (shaders/include/blocks.glsl).

    Args:
        rows: The number of pieces (rows after row 0) in the table of shutters.
        frames: The length of FrameState.open_span.
        kind: The GLSL format of the textures with the frames.
    """
    scans = 5 if kind == "rgba8" else 10
    return scans * frames * (1 + 4 * (1 + rows.bit_length()))
