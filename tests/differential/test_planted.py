"""Whether the differential test finds faults: each that is planted here makes a picture wrong. A long check, which runs
when the files of this folder change."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cases import make_smooth
from compare import open_devices
from test_differential import MIXED, each_difference

from shutter_addon.compute import cpu, gpu, layer_frames
from shutter_addon.compute.devices import gl
from shutter_addon.core.frames import light
from shutter_addon.core.model import keyframes, mattes, scribbles, shutters, state_at, windows
from shutter_addon.core.pixels import compositor, layering
from shutter_addon.media import matte_values

FAULTS = {
    "an ease": (keyframes, "eased", lambda u, ease: u),
    "a jump too early": (keyframes, "eased", lambda u, ease: 1.0 if ease == "constant" else eased(u, ease)),
    "redrawn strokes": (scribbles, "between_strokes", lambda first, second, u, aspect: [*map(np.array, first)]),
    "lassos left empty": (
        scribbles,
        "rasterise",
        lambda shapes, *size, **how: rasterise(outlines(shapes), *size, **how),
    ),
    "no displacement": (shutters, "displace", shutters.mix),
    "another curve": (light, "to_linear", lambda code: np.sign(code) * np.abs(code) ** 2.2),
    "an edge twice": (windows, "source_frames", lambda *given: twice(*given)),
    "nothing followed": (state_at, "followed", lambda effect, state, *_: state),
    "a dull filter": (compositor, "seen", lambda frame, places, sharp: seen(frame, places, sharp=False)),
    "trails of no length": (state_at, "with_length", lambda bars, *_: bars),
    "edges passed over": (
        cpu.CPUCompositor,
        "solve",
        lambda solver, labels, count, *_, warm: solve(solver, labels, count),
    ),
    "mattes in another order": (mattes, "blended", lambda c, shown, values: blended(c, shown[::-1], values[::-1])),
    "hard mattes": (matte_values, "feathered", lambda values, width: values),
    "outlines of hard edges": (mattes, "coverage", lambda *given: np.round(coverage(*given))),
    "a straight ramp": (mattes.Ramp, "values", lambda ramp, *size: ramp_values(mattes.Ramp(ramp.kind), *size)),
    "ghosts": (layering, "behind", lambda values: np.ones_like(values[0])),
    "what a camera pans over": (layer_frames, "uncovered", lambda colors, seen, *_: (colors, seen)),
    "the mean for the median": (compositor, "weighted_median", lambda values, weights: mean(values, weights)),
    "thresholds that let all pass": (compositor, "passes", lambda combine, luminance: np.ones_like(luminance)),
    "soft scribbles": (layering, "matte_of", lambda values: values),
    "nothing slides": (windows, "slid", lambda state, *_, **__: state),
    "not normalised": (windows, "source_frames", lambda options, places, shot: places.clip(0, shot.stop - 1)),
}
eased, source_frames, solve = keyframes.eased, windows.source_frames, cpu.CPUCompositor.solve
blended, ramp_values, coverage = mattes.blended, mattes.Ramp.values, mattes.coverage
rasterise, seen = scribbles.rasterise, compositor.seen


def mean(values, weights):
    return (values * weights).sum(axis=0) / np.maximum(weights.sum(axis=0), 1e-30)


def outlines(shapes):
    return [replace(shape, kind="line", width=0.0) if shape.kind == "lasso" else shape for shape in shapes]


def twice(options, positions, shot):
    if options.edges != "mirror":
        return source_frames(options, positions, shot)
    folded = np.mod(positions, 2 * len(shot))
    return np.minimum(folded, 2 * len(shot) - 1 - folded)


@pytest.mark.parametrize("fault", FAULTS)
def test_planted_faults_are_found(monkeypatch, fault, tmp_path):
    """Each makes some pictures wrong, which is told, with what repeats it, and left to be seen."""
    monkeypatch.setattr(*FAULTS[fault])
    found = each_difference(range(40), open_devices(["cpu"]), tmp_path)
    told, again = next(error for error in found if "/255 off" in error).splitlines()
    place = Path(told.partition("pictures in ")[2])
    names = sorted(path.name for path in place.iterdir())
    assert names == ["difference-x64.png", "made.exr", "recipe.json", "right.exr"]
    assert again.endswith(f"tests/differential/compare.py {place.name.partition('-')[0]} --ways cpu")


SMOOTH_FAULTS = {
    "bars that last until the next frame": lambda bars, steps, **_: shutters.held(bars, steps),
    "frames alone": lambda bars, steps, backward=False, **_: np.insert(
        np.zeros((len(bars), steps - 1)), (steps - 1) * backward, bars, axis=1
    ).ravel(),
    "nothing in reverse": lambda bars, steps, level=False, **_: smoothed(bars, steps, level=level),
    "trails of half the light": lambda bars, steps, backward=False, **_: smoothed(bars, steps, backward=backward),
}
smoothed = shutters.smoothed


@pytest.mark.parametrize("fault", SMOOTH_FAULTS)
def test_planted_faults_of_moments_are_found(monkeypatch, fault, tmp_path):
    monkeypatch.setattr(shutters, "smoothed", SMOOTH_FAULTS[fault])
    found = each_difference(range(40), open_devices(["cpu"]), tmp_path, of=make_smooth)
    assert any("/255 off" in error for error in found)


MIXED_FAULTS = {
    "groups that are black": (gpu, "_in_window", lambda state, chosen: state.of(chosen)),  # where that fault was
    "levels that are not drawn": (gpu, "read_pass", lambda *names, **given: without_levels(*names, **given)),
}
run, read_pass = gl.GLDevice.run, gpu.read_pass


def without_levels(*names, **given):
    return read_pass(*names, **given | dict.fromkeys(given.keys() & {"LEVELS"}, 0))


def test_a_texel_that_no_pass_writes_is_seen(monkeypatch, tmp_path):
    def half(device, program, extent, **given):
        rows = max(extent[1] // 2, 1) if program.file.startswith("compose_") else extent[1]
        run(device, program, (extent[0], rows, *extent[2:]), **given)

    monkeypatch.setattr(gl.GLDevice, "run", half)
    found = each_difference(MIXED[:4], open_devices(["gpu"]), tmp_path, mixed=True)
    assert any("nan instead of" in error for error in found)


@pytest.mark.parametrize("fault", MIXED_FAULTS)
def test_planted_faults_of_a_gpu_are_found(monkeypatch, fault, tmp_path):
    monkeypatch.setattr(*MIXED_FAULTS[fault])
    assert any(each_difference(range(60), open_devices(["gpu"]), tmp_path, mixed=True))
