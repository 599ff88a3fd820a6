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
    """Return a compute pass that composes pictures: the shader compose_<way> with the macros that it needs.

    Args:
        way: A name from `way_of` or `moved_way`.
        groups: The number of groups of four shutters: ⌈shutters / 4⌉.
        macros: {name: value} of further macros of the shader. They replace those that this function sets: GROUPS, VALUE
            and QUADS.
    """
    lines = lines_of(way, is_median=macros.get("COMBINE") == MODES["median"])
    given: dict[str, int | str] = {"GROUPS": groups, "VALUE": int(way == "value"), "QUADS": lines // 4}
    return read_pass(f"compose_{way}", **(given | macros))


def lines_of(way: str, *, is_median: bool) -> int:
    """Return how many rows of pixels one invocation of a composition shader composes, if no exposure follows a motion.

    Args:
        way: The shader's name without compose_, from `way_of`.
        is_median: Whether it makes a median of frames.
    """
    return 4 if is_median else _LINES.get(way, BLOCK)


def way_of(window: Window, state: FrameState, values: np.ndarray, shortened: bool) -> str:
    """Return the fastest way to compose a picture without motions: the name of a shader, without compose_.

    The thresholds come from times at 1080p, for 2 to 8 shutters and windows of 16 to 64 frames. With running sums, in
    multiples of a plain average of 16 frames: "sums" takes 0.3 + 0.23 · pieces, "frames" 1 + 0.1 · frames. With frames,
    in multiples of a plain average of the window: "pieces" takes 1.5 + 1.4 · pieces / frames, "frames" 2.1 to 2.8. (A
    piece is a row of the table, see the module.)

    Args:
        window: Where the source frames are stored. An instance of Sums has running sums, any other has frames.
        state: The effect. All its shutters combine frames in the same way (FrameState.groups has one entry).
        values: The table of shutters, from `table`.
        shortened: Whether edges are "shorten" and shutters expose frames beyond the shot's ends, which are then left
            out.

    Returns:
        "value" for value interpolation. Otherwise "sums" (few pieces, from running sums), "pieces" (few pieces, from
        frames), "frames" (many pieces, or lightest and darkest) or "search" (medians, and where "frames" would take too
        many loop iterations for llvmpipe).
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
    """Choose the shader that composes a picture whose shutters follow a motion.

    llvmpipe limits the loop iterations of an invocation (MOST_ITERATIONS). The choice is the same on every device. "By
    displacement" and "by value" are the two ways to interpolate shutters (Options.interpolation).

    Args:
        state: The effect.
        values: The table of shutters from moved_tables, without its last `motions` rows, which tell the shutters of
            each motion.
        motions: How many motions there are for each frame. By displacement 1; by value the number M of different
            motions (moved_tables).
        mixed: Of how many motions that one is the mean. By displacement the number N of shutters; by value 1.
        quads: How many groups of pixels an invocation should compose. A group is four pixels of a column.

    Returns:
        The shader's name without compose_: "value" by value; by displacement "frames", or "search" if "frames" takes
        too many iterations. And how many groups an invocation composes: `quads`, or 1 for "search" and if `quads` take
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
    """Return to how many pieces a table must be filled up: compose_sums is compiled only for some numbers of pieces.

    Args:
        rows: The number of pieces that the table has, or half the number of its knots, rounded up.

    Returns:
        The smallest number in _ROWS that is at least `rows`; infinity if `rows` is larger than all.
    """
    return next((filled for filled in _ROWS if filled >= rows), np.inf)


def knots(values: np.ndarray) -> np.ndarray:
    """Convert a table of shutters by displacement to the table of knots that shaders/compose_sums.glsl reads.

    Knots are the times between which the quantiles are linear: the start of each piece, unless it is the end of the
    piece before, and its end.

    Args:
        values: From `table`: (1 + pieces, 2 G + 1, 4), for G groups of four shutters.

    Returns:
        (1 + knots, G + 1, 4) float32. Row 0: the gains in G texels. Each other row is a knot: its time for each shutter
        in G texels; then for an end, the last texel of its piece (`table`), for a start zeros.
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
    """Return the table of shutters as float32 texels, which shaders/include/compose.glsl reads.

    A texel has the numbers of four shutters; N shutters have G = ⌈N / 4⌉ texels. Times are in frames of the window.

    Args:
        state: The effect. All its shutters combine frames in the same way.

    Returns:
        By displacement (1 + pieces, 2 G + 1, 4), by value (1 + frames, G, 4).
        Row 0 has a number for each shutter. It is the factor of its brightness (FrameState.gains) for averages and
            medians. For lightest and darkest it is, by displacement, the factor that scales the shutter's highest
            weight to 1 (core.pixels.compositor), and by value the shutter's mean time.
        By displacement, each further row is a piece of the quantiles: G texels of start times, G texels of end times,
            and the texel (dz, apart, z, 0). z is the share of the exposure (0 to 1) at the piece's start, dz the
            piece's own share, and apart the largest difference between shutters in their start times or in their end
            times.
        By value, each further row is a frame of FrameState.open_span, with the shutters' weights (`_bars`).
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
    """Return the rows of `table` by displacement: (pieces, 2 G + 1, 4), as described there.

    The last results are kept, because bars seldom change from frame to frame. Arguments are hashable for that.

    Args:
        content, dtype, shape: FrameState.bars, an array (N, L), as its bytes, type and shape.
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
    """Return the rows of `table` by value: how much each frame counts for each shutter.

    Returns:
        (frames, G, 4): a row for each frame of FrameState.open_span, four shutters to a texel. A shutter's weights sum
        to 1; for lightest and darkest, its highest is 1 instead.
    """
    (combine,) = state.groups
    whole = state.bars.max(axis=1) if combine.mode in ("lightest", "darkest") else state.bars.sum(axis=1)
    return padded((state.bars / whole[:, None]).T[slice(*state.open_span)])


def moved_tables(state: FrameState, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the tables of shutters and of motions, for a picture whose shutters follow a motion.

    shaders/include/moved.glsl reads them. By displacement, a pixel averages the motions of its N shutters: it is one
    motion per frame. By value, shutters that move alike share a motion: M motions per frame, each with weights for its
    own shutters.

    Args:
        state: The effect. Its `following` is not None.
        frames: The source frame (L,) at each place of the window; −1 where one is left out.

    Returns:
        The table of shutters: that from `table`, by value with M rows for each frame of the open span; then a row for
            each motion, 1 for the shutters that have it and 0 for the others.
        The motions: float32 (L, 1 + N, 4) by displacement, (L · M, 2, 4) by value; a row for each frame and motion, all
            motions of a frame together. The first texel has the frame's layer, which the caller sets, then 1 if the
            frame is there, else 0. Further texels: (turn − 1) and shift (Following), both as real and imaginary part,
            of each shutter, or by value of the motion.
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
