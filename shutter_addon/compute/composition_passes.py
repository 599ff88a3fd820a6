"""The passes that compose: one for each way to go through a window, compiled for what is composed; and which way is
the fastest. And what they need to know of shutters, once per frame: gains, knots or bars, as float32 tables."""

from functools import lru_cache

import numpy as np

from ..core.model import shutters
from ..core.model.frame_state import FrameState
from ..devices.llvmpipe import MOST_ITERATIONS, frames_iterations
from ..devices.passes import Pass, read_pass
from .running_sums import Sums
from .window import BLOCK, Window

# Rows of pixels that one invocation of compose_sums composes.
PAIR = 2

MODES = {"average": 0, "lightest": 1, "darkest": 2, "median": 3}
EDGES = {"hold": 0, "mirror": 1, "shorten": 2}
# What a picture is stored as, by whether it is levels.
PICTURE = {False: "rgba32f", True: "rgba8"}
LEVELS = read_pass("display", "OVER_BLACK")
# Rows of pixels that one invocation composes, by the pass; BLOCK for all others.
_LINES = {"sums": PAIR, "search": 4}
# The numbers of pieces for which compose_sums is compiled. A table with another number is filled up with empty pieces.
_ROWS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32)


def composition(way: str, groups: int, **macros: int | str) -> Pass:
    """The pass compose_<way>, for `groups` of four shutters. macros: others of shaders/include/compose.glsl and
    moved.glsl, or of compose_sums, as far as they are not 0."""
    lines = lines_of(way, is_median=macros.get("COMBINE") == MODES["median"])
    given: dict[str, int | str] = {"GROUPS": groups, "VALUE": int(way == "value"), "QUADS": lines // 4}
    return read_pass(f"compose_{way}", **(given | macros))


def lines_of(way: str, *, is_median: bool) -> int:
    """The rows of pixels that one invocation of a way's pass composes."""
    return 4 if is_median else _LINES.get(way, BLOCK)


def way_of(window: Window, state: FrameState, values: np.ndarray, shortened: bool) -> str:
    """The fastest way to compose: the name of a pass, without compose_.

    values: the table of `table`, a row of gains and a row per piece
    shortened: whether frames that a shutter exposes are left out (edges "shorten")

    The bounds come from times at 1080p, for 2 to 8 shutters and windows of 16 to 64 frames. From running sums, in
    multiples of the time of a plain average of 16 frames: "sums" 0.3 + 0.23 · pieces, "frames" 1 + 0.1 · frames. From
    frames, in multiples of the time of the window's own plain average: "pieces" 1.5 + 1.4 · pieces / frames, "frames"
    2.1 to 2.8.
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
    """The way to compose where shutters follow something, and how many quads of pixels, `quads` at most, an invocation
    can compose by it; arguments as for way_of and composition_of_moved.

    motions: those that a frame is seen by"""
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
    """The number of pieces that compose_sums is compiled for, if there are `rows`; infinite: there are too many."""
    return next((filled for filled in _ROWS if filled >= rows), np.inf)


def selection(groups: int, shutters: int) -> Pass:
    """The pass that gathers the coefficients of some shutters, in so many groups of four, out of those of all."""
    return read_pass("ways", "SELECT", GROUPS=groups, ALL=shutters)


def way_sum(begins: bool, levels: bool) -> Pass:
    """The pass that adds a picture of some shutters to those of the others."""
    return read_pass("ways", BEGINS=int(begins), LEVELS=int(levels))


def padded(values: np.ndarray) -> np.ndarray:
    """(…, N) as (…, G, 4): four shutters to a texel, zeros behind the last."""
    groups = -(-values.shape[-1] // 4)
    result = np.zeros((*values.shape[:-1], groups * 4))
    result[..., : values.shape[-1]] = values
    return result.reshape(*values.shape[:-1], groups, 4)


def table(state: FrameState) -> np.ndarray:
    """The table (1 + rows, columns, 4) float32 that shaders/include/compose.glsl describes.

    Row 0: the gains; of the lightest and the darkest what makes the highest weight 1 (core.pixels.combined), by value
    the middle of the shutters' times.
    Displacement: a row per piece of the quantiles: starts, ends, then dz, the time by which the shutters differ at most
    at either, and z at its start. Value: a row per frame of the shutters' open span, how much it counts.
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
    """Bars seldom change from frame to frame."""
    knots = shutters.knots(np.frombuffer(content, dtype).reshape(shape))
    start, end = padded(knots.start), padded(knots.end)
    last = np.zeros((len(start), 1, 4))
    last[:, 0, 0] = np.diff(knots.z)
    last[:, 0, 1] = np.maximum(np.ptp(knots.start, axis=1), np.ptp(knots.end, axis=1))
    last[:, 0, 2] = knots.z[:-1]
    return np.concatenate([start, end, last], axis=1)


def _gains(state: FrameState) -> np.ndarray:
    (combine,) = state.groups
    if combine.mode not in ("lightest", "darkest"):
        return state.gains
    exposures = state.bars.sum(axis=1)
    if state.options.interpolation == "value":
        return state.bars @ (np.arange(state.bars.shape[1]) + 0.5) / exposures
    return exposures / state.bars.max(axis=1)


def _bars(state: FrameState) -> np.ndarray:
    """How much each frame of the open span counts."""
    (combine,) = state.groups
    whole = state.bars.max(axis=1) if combine.mode in ("lightest", "darkest") else state.bars.sum(axis=1)
    return padded((state.bars / whole[:, None]).T[slice(*state.open_span)])


def moved_tables(state: FrameState, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The table of `table` and that of the moves (L · motions, 1 + N, 4) float32, by value (L · motions, 2, 4), which
    shaders/include/moved.glsl describes, its first number of each row 0.

    By displacement there is one motion, in which the shutters' own are mixed; by value one for all shutters that move
    alike: the table has a row for each frame and motion. Behind these it has one for each motion, 1 for its shutters.
    frames: the source frames (L,) of the window; −1: none. ValueError: nothing is followed"""
    if state.following is None:
        raise ValueError("nothing is followed")
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
