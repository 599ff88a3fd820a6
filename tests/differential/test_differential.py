"""The product against a reference of its own: random recipes over footage of many kinds, on every device."""

import ast
import gc
import itertools
import json
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cases import KINDS, make, make_smooth
from compare import PICTURE, DifferenceError, can_be_a_film, check, check_films, check_mixed, open_devices, within
from reference import DEFAULTS, layers_at, picture, shown

from shutter_addon.compute import cpu, gpu, plates
from shutter_addon.core.frames import light
from shutter_addon.core.model import following, keyframes, mattes, scribbles, shutters, trails, windows
from shutter_addon.core.pixels import combined, compositor, layering
from shutter_addon.devices import gl
from shutter_addon.devices.passes import SHADERS
from shutter_addon.media import matte_values

SEEDS = range(120)
BATCH = 20
IN_BLENDER = SEEDS[::8]  # which goes around the kinds of footage
# All passes that compose are run for these. In the last ones a threshold leaves pixels without light, time stands
# still, and all that a shutter exposes is left out.
MIXED = *range(13, 30), 10269, 20264, 20279, 51655, 51908, 52493, 52835


@pytest.fixture(scope="module")
def devices():
    found = open_devices(["cpu", "gpu"])
    yield found
    for device in found.values():
        device.release()


@pytest.fixture
def blenders_devices():
    """Blender's GPU alone. What it made goes while its context is current: freed in another one, by the garbage
    collector at any later time, it would take what has the same numbers there."""
    pytest.importorskip("bpy")
    found = open_devices(["blender"])
    yield found
    found.pop("blender").release()
    gc.collect()


def each_difference(seeds, devices, folder, mixed=False, of=make):
    for seed in seeds:
        try:
            (check_mixed if mixed else check)(make(seed, mixed) if mixed else of(seed), devices, folder)
        except DifferenceError as error:
            yield str(error)


def differences(*given, **options) -> list[str]:
    return list(each_difference(*given, **options))


@pytest.mark.parametrize("first", SEEDS[::BATCH])
def test_pictures_and_coefficients(devices, first, tmp_path):
    errors = differences(range(first, first + BATCH), devices, tmp_path)
    assert not errors, "\n".join(errors)


@pytest.mark.parametrize("first", SEEDS[::BATCH])
def test_pictures_of_moments(devices, first, tmp_path):
    """Bars count filmed frames, and what lies between two that are open counts as well."""
    errors = differences(range(first, first + BATCH), devices, tmp_path, of=make_smooth)
    assert not errors, "\n".join(errors)


def test_on_blenders_gpu(blenders_devices, tmp_path):
    errors = differences(IN_BLENDER, blenders_devices, tmp_path)
    assert not errors, "\n".join(errors)


def test_every_field_with_every_other(devices, monkeypatch, tmp_path):
    """And all passes that compose are among them, each of which leaves no texel unwritten."""
    seen = set()

    def noted(device, program, *given, **more):
        seen.add(program.file)
        run(device, program, *given, **more)

    monkeypatch.setattr(gl.GLDevice, "run", noted)
    errors = differences(MIXED, devices, tmp_path, mixed=True)
    assert not errors, "\n".join(errors)
    composing = {path.stem for path in SHADERS.glob("*.glsl") if path.stem.startswith("compose_")}
    assert seen >= composing | {"accumulate", "pack", "ways", "layer", "matte_blend", "diffusion"}


def test_every_field_with_every_other_on_blenders_gpu(blenders_devices, tmp_path):
    errors = differences(MIXED[::5], blenders_devices, tmp_path, mixed=True)
    assert not errors, "\n".join(errors)


@pytest.mark.parametrize("first", SEEDS[::40])
def test_films(first, tmp_path):
    """The command, from files to files: F-curves, annotations, source times and Blender's sequencer between them."""
    pytest.importorskip("bpy")
    found, errors = check_films(
        [case for case in map(make, SEEDS[first : first + 40]) if can_be_a_film(case)], tmp_path
    )
    assert not errors, "\n".join(map(str, errors))
    assert len(found) > 15


def test_the_reference_shares_nothing_with_the_product():
    for name in ("reference", "cases"):
        tree = ast.parse(Path(__file__).with_name(f"{name}.py").read_text(encoding="utf-8"))
        imported = {name.name for node in ast.walk(tree) if isinstance(node, ast.Import) for name in node.names}
        imported |= {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
        roots = {module.partition(".")[0] for module in imported}
        allowed = {"collections", "itertools", "numpy", "scipy"}
        assert roots <= (allowed if name == "reference" else allowed | CASES)


CASES = {"json", "dataclasses", "fractions", "av", "OpenImageIO", "reference"}


def test_recipes_have_all_that_a_recipe_may_have():
    seen, doubtful = Counter(), ([], [])
    for case in map(make, SEEDS):
        recipe = json.loads(case.recipe)
        keys = [key for owner in recipe["shutters"] + recipe["regions"] for key in owner.get("keys", [])]
        seen.update((name, recipe.get(name, DEFAULTS[name])) for name in DEFAULTS)
        seen.update({("ease", key.get("ease")) for key in keys} | {("redrawn", "strokes" in key) for key in keys})
        for name in ("kind", "ramp", "blend", "timing", "channel"):
            seen.update({(name, region[name]) for region in recipe["regions"] if name in region})
        way = shown(recipe, case.frame, len(case.stored))[1]
        seen.update([("shutters", len(recipe["shutters"])), ("time", way), ("direction", case.direction)])
        seen.update([("footage", case.kind)])
        seen.update(("follow", shutter["follow"] == "camera") for shutter in recipe["shutters"] if "follow" in shutter)
        seen.update(("trail", type(shutter["trail"])) for shutter in recipe["shutters"] if "trail" in shutter)
        seen.update([("edge_aware", type(recipe.get("edge_aware")))])
        for name, about in (("combine", str), ("by_luminance", str), ("threshold", type)):
            seen.update((name, about(shutter[name])) for shutter in recipe["shutters"] if name in shutter)
        found = picture(recipe, case.frame, case.footage(), case.index, case.direction, mattes=case.matte_samples())
        is_layered = bool(layers_at(recipe, case.frame))
        seen.update([("layer", is_layered)])
        doubtful[is_layered].append(found.doubtful.mean())
    values = {"position": 3, "interpolation": 2, "light": 2, "exposure": 2, "edges": 4, "aggregate": 3, "border": 2}
    values |= {"ease": 4, "redrawn": 2, "kind": 5, "shutters": 6, "time": 2, "direction": 2, "footage": len(KINDS)}
    values |= {"ramp": 4, "blend": 2, "timing": 2, "channel": 4}
    values |= {"combine": 3, "by_luminance": 1, "threshold": 2}
    values |= {"follow": 2, "trail": 2, "edge_aware": 3, "layer": 2, "plate_reach": 4, "inbetween": 1}
    assert Counter(name for name, _ in seen) == values
    assert min(seen.values()) >= 5
    assert seen["layer", True] >= 0.4 * len(SEEDS)
    assert np.mean(doubtful[0]) < 0.02
    assert np.mean(doubtful[1]) < 0.35  # nothing is seen behind layers that cover all


def test_mixed_recipes_have_every_field_with_every_other():
    single = "position", "interpolation", "light", "exposure", "edges", "inbetween"

    def fields(recipe):
        shutters_, regions = recipe["shutters"], recipe["regions"]
        found = {
            (name, recipe[name]) for name in ("position", "interpolation", "light", "exposure", "edges", "inbetween")
        }
        found |= {name for name in ("time", "camera", "border", "edge_aware", "stop_at_cuts") if recipe.get(name)}
        found |= {(name, each[name]) for each in shutters_ for name in ("combine", "length") if name in each}
        found |= {
            name for each in shutters_ for name in ("follow", "trail", "threshold", "by_luminance") if name in each
        }
        found |= {(each["follow_motion"], bool(each["follow_smooth"])) for each in shutters_ if "follow" in each}
        found |= {each["kind"] for each in regions} | {"layer" for each in regions if each.get("layer")}
        found |= {("opacity", isinstance(each["opacity"], list)) for each in regions if each["opacity"] != 1}
        found |= {"influence"} if recipe.get("camera_influence", 1) != 1 else set()
        found |= {"aggregate"} if recipe["aggregate"] > 1 else set()
        names = [each["name"] for each in regions]
        return found | ({"equal names"} if len(set(names)) < len(names) else set())

    pairs, every = set(), set()
    for recipe in (json.loads(make(seed, mixed=True).recipe) for seed in range(500)):
        found = fields(recipe)
        every |= found
        pairs |= {frozenset(pair) for pair in itertools.combinations(found, 2)}
    lacking = [
        (a, b)
        for a, b in itertools.combinations(every, 2)
        if frozenset((a, b)) not in pairs and not (a[0] == b[0] and a[0] in single)
    ]
    assert len(every) == 48
    assert not lacking


FAULTS = {
    "an ease": (keyframes, "eased", lambda u, ease: u),
    "a jump too early": (keyframes, "eased", lambda u, ease: 1.0 if ease == "constant" else eased(u, ease)),
    "redrawn strokes": (scribbles, "between_strokes", lambda first, second, u, aspect: [*map(np.array, first)]),
    "lassos left empty": (
        scribbles,
        "rasterise",
        lambda shapes, *size, border: rasterise(outlines(shapes), *size, border=border),
    ),
    "no displacement": (shutters, "displace", shutters.mix),
    "another curve": (light, "to_linear", lambda code: np.sign(code) * np.abs(code) ** 2.2),
    "an edge twice": (windows, "source_frames", lambda *given: twice(*given)),
    "nothing followed": (following, "followed", lambda effect, state, *_: state),
    "a dull filter": (compositor, "seen", lambda frame, places, sharp: seen(frame, places, sharp=False)),
    "trails of no length": (trails, "with_length", lambda bars, *_: bars),
    "edges passed over": (
        cpu.CPUCompositor,
        "solve",
        lambda solver, labels, count, *_, warm: solve(solver, labels, count),
    ),
    "mattes in another order": (mattes, "blended", lambda c, shown, values: blended(c, shown[::-1], values[::-1])),
    "hard mattes": (matte_values, "feathered", lambda values, width: values),
    "outlines of hard edges": (mattes, "coverage", lambda *given: np.round(coverage(*given))),
    "a ramp that is not turned": (
        mattes.Ramp,
        "values",
        lambda ramp, *size: ramp_values(replace(ramp, rotation=0), *size),
    ),
    "ghosts": (layering, "behind", lambda values: np.ones_like(values[0])),
    "what a camera pans over": (plates, "uncovered", lambda colors, seen, *_: (colors, seen)),
    "the mean for the median": (combined, "weighted_median", lambda values, weights: mean(values, weights)),
    "thresholds that let all pass": (combined, "passes", lambda combine, luminance: np.ones_like(luminance)),
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
    """Lassos as the thinnest lines."""
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
    "levels that are not drawn": (gpu, "way_sum", lambda begins, levels: way_sum(begins, False)),
}
run, way_sum = gl.GLDevice.run, gpu.way_sum


def test_a_texel_that_no_pass_writes_is_seen(monkeypatch, devices, tmp_path):
    def half(device, program, extent, **given):
        rows = max(extent[1] // 2, 1) if program.file.startswith("compose_") else extent[1]
        run(device, program, (extent[0], rows, *extent[2:]), **given)

    monkeypatch.setattr(gl.GLDevice, "run", half)
    found = each_difference(MIXED[:4], {"gpu": devices["gpu"]}, tmp_path, mixed=True)
    assert any("nan instead of" in error for error in found)


@pytest.mark.parametrize("fault", MIXED_FAULTS)
def test_planted_faults_of_a_gpu_are_found(monkeypatch, devices, fault, tmp_path):
    monkeypatch.setattr(*MIXED_FAULTS[fault])
    assert any(each_difference(range(60), {"gpu": devices["gpu"]}, tmp_path, mixed=True))


@pytest.mark.parametrize("value", [np.nan, np.inf, 0.6 / 255])
def test_no_value_passes_for_a_picture_that_is_none(value, tmp_path):
    right = np.zeros((4, 4, 4))
    made = right.copy()
    made[2, 1, 3] = value
    with np.errstate(invalid="ignore"), pytest.raises(DifferenceError, match="row 2, column 1, channel 3"):
        within(PICTURE, np.abs(made - right), make(0), "cpu-picture", tmp_path, made, right)
