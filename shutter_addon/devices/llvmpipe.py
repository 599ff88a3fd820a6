"""Mesa's software renderer, llvmpipe, and what is as it is because of this one alone. Beside it there are the pass
compose_search, for what takes more iterations, and TILED in shaders/include/sums.glsl, as it stores rows."""

import numpy as np

# Loop iterations of an invocation: it ends loops after 65,535 in all, without an error.
MOST_ITERATIONS = 60_000
# Bytes of a texture array: from one over 2 GiB it reads wrong values, without an error.
MOST_BYTES = 1 << 30


def is_llvmpipe(renderer: str) -> bool:
    """Whether a renderer, as it calls itself, is llvmpipe. Its memory is the machine's, and it keeps textures there row
    by row, where a GPU keeps tiles."""
    return "llvmpipe" in renderer


def frames_iterations(values: np.ndarray, span: tuple[int, int]) -> int:
    """An upper bound of the loop iterations of an invocation of compose_frames, for any coefficients.

    For each frame it goes through the pieces that may have begun and have not all ended. So each piece counts once for
    every frame from that in which it may begin to that in which it and all before it have ended."""
    groups = values.shape[1] // 2
    start, end, apart = values[1:, :groups], values[1:, groups:-1], values[1:, -1, 1]
    until = np.maximum.accumulate(end.max(axis=(1, 2)) + apart)
    from_ = start.max(axis=(1, 2)) - 2 * apart  # the earliest start of a shutter, and once more the difference
    frames = np.clip(np.ceil(until), *span) - np.clip(np.floor(from_), *span) + 1
    return int(frames.sum()) + len(start) + span[1] - span[0]


def median_iterations(rows: int, frames: int, kind: str) -> int:
    """As frames_iterations, of compose_search for a median (include/combine.glsl), with `rows` pieces, of frames in
    textures of a kind."""
    scans = 5 if kind == "rgba8" else 10
    return scans * frames * (1 + 4 * (1 + rows.bit_length()))
