"""Which compute pass composes a picture fastest, and the tables of shutters that passes read.

A piece is a stretch on which the quantiles of all shutters are linear (core.model.shutters.knots).
"""

from functools import lru_cache

import numpy as np

from ..core.model import shutters
from ..core.model.frame_state import FrameState
from .devices.llvmpipe import MOST_ITERATIONS, frames_iterations
from .devices.passes import Pass, read_pass
from .running_sums import Sums
from .window import BLOCK, Window

# Rows of pixels that one invocation of compose_sums composes.
PAIR = 2

MODES = {"average": 0, "lightest": 1, "darkest": 2, "median": 3}
EDGES = {"hold": 0, "mirror": 1, "shorten": 2}
LEVELS = read_pass("display", "OVER_BLACK")
# Rows of pixels that one invocation composes: {way: rows}; BLOCK for all others.
_LINES = {"sums": PAIR, "search": 4}
# The numbers of pieces for which compose_sums is compiled. Tables are filled up with empty pieces.
_ROWS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32)


def composition(way: str, groups: int, **macros: int | str) -> Pass:
    """Return a compute pass that composes pictures: compose_<way> of shaders/.

    Args:
        way: A name from `way_of` or `moved_way`.
        groups: The number of groups of four shutters.
        macros: More macros of the shader. They replace those that this function sets.
    """
    lines = lines_of(way, is_median=macros.get("COMBINE") == MODES["median"])
    given: dict[str, int | str] = {"GROUPS": groups, "VALUE": int(way == "value"), "QUADS": lines // 4}
    return read_pass(f"compose_{way}", **(given | macros))


def lines_of(way: str, *, is_median: bool) -> int:
    """Return how many rows of pixels one shader invocation of a composition pass composes.

    Args:
        way: The pass, a name from `way_of`.
        is_median: Whether the pass makes a median of frames.
    """
    return 4 if is_median else _LINES.get(way, BLOCK)


def way_of(window: Window, state: FrameState, values: np.ndarray, shortened: bool) -> str:
    """Return the fastest way to compose a picture: the name of a pass in shaders/, without compose_.

    The limits come from times at 1080p, for 2 to 8 shutters and windows of 16 to 64 frames. With running sums, in
    multiples of a plain average of 16 frames: "sums" takes 0.3 + 0.23 · pieces, "frames" 1 + 0.1 · frames. With frames,
    in multiples of a plain average of the window: "pieces" takes 1.5 + 1.4 · pieces / frames, "frames" 2.1 to 2.8.

    Args:
        window: The window, which holds running sums or frames.
        state: The effect, with shutters that combine frames in one way.
        values: The table of shutters, from `table`.
        shortened: Whether exposed frames are missing (edges "shorten").
    """
    if state.options.interpolation == "value":
        return "value"
    (combine,), span = state.groups, state.open_span
    rows, frames = len(values) - 1, span[1] - span[0]
    if combine.mode == "median":
        return "search"
    if combine.mode != "average":
        return "frames" if frames_iterations(values, span) <= MOST_ITERATIONS else "search"
    if isinstance(window, Sums) and not shortened and filled_rows(rows) <= 2 + 0.45 * frames:
        return "sums"
    if not isinstance(window, Sums) and 3 * rows < 2 * frames:
        return "pieces"
    return "frames" if frames_iterations(values, span) <= MOST_ITERATIONS else "search"


def moved_way(state: FrameState, values: np.ndarray, motions: int, mixed: int, quads: int) -> tuple[str, int]:
    """Choose the pass that composes a picture whose shutters follow a motion, within the limit of loop iterations.

    Args:
        state: The effect.
        values: The table of shutters from moved_tables, without the rows of motions.
        motions: The number of motions for each frame.
        mixed: How many motions a pixel mixes: MIXED of shaders/include/moved.glsl.
        quads: The most groups of four pixels that one shader invocation may compose.

    Returns:
        The name of the pass without compose_, and how many groups an invocation composes: `quads`, or 1 if those take
        too many iterations.
    """
    span = state.open_span
    frames = span[1] - span[0]
    mixing = frames * motions * (mixed if mixed > 1 else 0)
    if state.options.interpolation == "value":
        return "value", quads if frames * (1 + motions) + quads * mixing <= MOST_ITERATIONS else 1
    loops = frames_iterations(values, span) + frames
    if loops + mixing > MOST_ITERATIONS:
        return "search", 1
    return "frames", quads if loops + quads * mixing <= MOST_ITERATIONS else 1


def filled_rows(rows: int) -> float:
    """Return the smallest number of pieces, at least `rows`, for which the pass compose_sums is compiled.

    It is infinity if there is none.
    """
    return next((filled for filled in _ROWS if filled >= rows), np.inf)


def knots(values: np.ndarray) -> np.ndarray:
    """Convert the table of shutters from `table` to the table of knots that shaders/compose_sums.glsl reads.

    Row 0 has the gains. Each other row is a knot: the end of a piece, or a start that differs from the end before it.
    """
    groups = values.shape[1] // 2
    rows = np.zeros((len(values), 2, groups + 1, 4), np.float32)
    rows[:, 0, :groups], rows[:, 1] = values[:, :groups], values[:, groups:]
    rows[0, 1] = rows[0, 0]  # the gains
    chosen = np.ones((len(values), 2), bool)
    chosen[0, 0], chosen[2:, 0] = False, (rows[2:, 0] != rows[1:-1, 1])[:, :groups].any(axis=(1, 2))
    return rows[chosen]


def padded(values: np.ndarray) -> np.ndarray:
    """Return values (…, N) of N shutters as texels (…, G, 4): four shutters to a texel, zeros after the last."""
    whole = np.pad(values, [(0, 0)] * (values.ndim - 1) + [(0, -values.shape[-1] % 4)])
    return whole.reshape(*values.shape[:-1], -1, 4)


def table(state: FrameState) -> np.ndarray:
    """Return the table of shutters (1 + rows, columns, 4) float32 that passes read (shaders/include/compose.glsl).

    Row 0 has the gains. For lightest and darkest, they scale the highest weight to 1 (core.pixels.compositor); by
    value, they are the shutters' mean times. By displacement, there is a row for each piece of the quantiles: starts,
    ends, then dz, the most by which the shutters' times differ at either, and z, the
    fraction of the exposure (0 to 1), at its start. By value, there is a row of weights for each frame of the open
    span.
    """
    by_pieces, bars = state.options.interpolation == "displacement", state.bars
    rows = _pieces(bars.tobytes(), bars.dtype, bars.shape) if by_pieces else _bars(state)
    result = np.zeros((1 + len(rows), rows.shape[1], 4), dtype=np.float32)
    gains = padded(_gains(state))
    result[0, : len(gains)] = gains
    result[1:] = rows
    return result


@lru_cache(16)
def _pieces(content: bytes, dtype: np.dtype, shape: tuple[int, ...]) -> np.ndarray:
    """Return the rows of `table` for the pieces of shutters, whose bars are given as bytes, dtype and shape.

    They are cached, because bars seldom change from frame to frame.
    """
    knots = shutters.knots(np.frombuffer(content, dtype).reshape(shape))
    start, end = padded(knots.start), padded(knots.end)
    last = np.zeros((len(start), 1, 4))
    last[:, 0, 0] = np.diff(knots.z)
    last[:, 0, 1] = np.maximum(np.ptp(knots.start, axis=1), np.ptp(knots.end, axis=1))
    last[:, 0, 2] = knots.z[:-1]
    return np.concatenate([start, end, last], axis=1)


def _gains(state: FrameState) -> np.ndarray:
    """Return the gains (N,) in row 0 of `table`."""
    (combine,) = state.groups
    if combine.mode not in ("lightest", "darkest"):
        return state.gains
    exposures = state.bars.sum(axis=1)
    if state.options.interpolation == "value":
        return state.bars @ (np.arange(state.bars.shape[1]) + 0.5) / exposures
    return exposures / state.bars.max(axis=1)


def _bars(state: FrameState) -> np.ndarray:
    """Return the rows of `table` by value: the weight of each frame of the open span, for each shutter.

    A shutter's weights sum to 1; for lightest and darkest, the highest is 1 instead.
    """
    (combine,) = state.groups
    whole = state.bars.max(axis=1) if combine.mode in ("lightest", "darkest") else state.bars.sum(axis=1)
    return padded((state.bars / whole[:, None]).T[slice(*state.open_span)])


def moved_tables(state: FrameState, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the table of shutters and that of motions for a picture whose shutters follow something.

    Passes read them as in shaders/include/moved.glsl; the caller adds in which layer of a texture each frame is. By
    displacement there is one motion, which mixes those of the shutters. By value there is one for all shutters that
    move alike, and the table of shutters has a row for each frame and motion. A row for each motion follows: 1 for its
    shutters.

    Args:
        state: The effect.
        frames: The window's source frames (L,), −1 where one is missing.

    Returns:
        The table of shutters, and the motions (L · motions, 1 + N, 4) float32; by value (L · motions, 2, 4).
    """
    assert state.following is not None
    turns, shifts = state.following.at(frames)
    numbers = np.stack([turns.real - 1, turns.imag, shifts.real, shifts.imag], axis=1)  # (L, 4, N)
    values = table(state)
    own = np.ones((1, len(state.bars)))
    if state.options.interpolation == "value":
        kinds, kind = np.unique(numbers.reshape(-1, len(state.bars)), axis=1, return_inverse=True)
        own = np.eye(kinds.shape[1])[:, kind]
        numbers = kinds.reshape(*numbers.shape[:2], -1).swapaxes(1, 2).reshape(-1, 4, 1)
        bars = _bars(state)
        values = np.concatenate([values[:1], (bars[:, None] * padded(own)).reshape(-1, *bars.shape[1:])])
    parts = np.zeros((len(own), *values.shape[1:]), np.float32)
    grouped = padded(own)
    parts[:, : grouped.shape[1]] = grouped
    moves = np.zeros((len(numbers), 1 + numbers.shape[2], 4), np.float32)
    moves[:, 1:] = numbers.swapaxes(1, 2)
    moves[:, 0, 1] = (frames >= 0).repeat(len(own))
    return np.concatenate([values, parts]).astype(np.float32), moves
