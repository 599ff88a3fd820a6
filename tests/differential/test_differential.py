"""The product against a reference of its own: random recipes over footage of many kinds, on every device."""

import ast
import gc
import json
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from cases import KINDS, make, make_smooth
from compare import DifferenceError, can_be_a_film, check, check_films, check_mixed, open_devices
from reference import DEFAULTS, layers_at, picture, shown

from shutter_addon.compute.devices import gl
from shutter_addon.compute.devices.passes import SHADERS

SEEDS = range(78)  # six for each kind of footage
BATCH = 13
IN_BLENDER = range(0, 104, 8)  # one of each kind
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


def assert_no_difference(*given, **options):
    errors = list(each_difference(*given, **options))
    assert not errors, "\n".join(errors)


@pytest.mark.parametrize("first", SEEDS[::BATCH])
def test_pictures_and_coefficients(devices, first, tmp_path):
    assert_no_difference(range(first, first + BATCH), devices, tmp_path)


def test_pictures_of_moments(devices, tmp_path):
    """Bars count filmed frames, and what lies between two that are open counts as well."""
    assert_no_difference(SEEDS[: 3 * BATCH], devices, tmp_path, of=make_smooth)


def test_on_blenders_gpu(blenders_devices, tmp_path):
    assert_no_difference(IN_BLENDER, blenders_devices, tmp_path)
    assert_no_difference(MIXED[::5], blenders_devices, tmp_path, mixed=True)


def test_every_field_with_every_other(devices, monkeypatch, tmp_path):
    """And all passes that compose are among them, each of which leaves no texel unwritten."""
    seen = set()

    run = gl.GLDevice.run

    def noted(device, program, *given, **more):
        seen.add(program.file)
        run(device, program, *given, **more)

    monkeypatch.setattr(gl.GLDevice, "run", noted)
    assert_no_difference(MIXED, devices, tmp_path, mixed=True)
    composing = {path.stem for path in SHADERS.glob("*.glsl") if path.stem.startswith("compose_")}
    assert seen >= composing | {"accumulate", "pack", "ways", "layer", "matte_blend", "diffusion"}


def test_films(tmp_path):
    """The command, from files to files: F-curves, annotations, source times and Blender's sequencer between them."""
    pytest.importorskip("bpy")
    found, errors = check_films([case for case in map(make, SEEDS[: 4 * BATCH]) if can_be_a_film(case)], tmp_path)
    assert not errors, "\n".join(map(str, errors))
    assert len(found) > 20


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
        is_layered = bool(layers_at(recipe, case.frame))
        seen.update([("layer", is_layered)])
        if case.seed < 2 * BATCH:
            given = case.index, case.direction
            found = picture(recipe, case.frame, case.footage(), *given, mattes=case.matte_samples())
            doubtful[is_layered].append(found.doubtful.mean())
    values = {"position": 3, "interpolation": 2, "light": 2, "exposure": 2, "edges": 4, "aggregate": 3, "border": 2}
    values |= {"ease": 4, "redrawn": 2, "kind": 5, "shutters": 6, "time": 2, "direction": 2, "footage": len(KINDS)}
    values |= {"ramp": 4, "blend": 2, "timing": 2, "channel": 4}
    values |= {"combine": 3, "by_luminance": 1, "threshold": 2}
    values |= {"follow": 2, "trail": 2, "edge_aware": 3, "layer": 2, "plate_reach": 4, "inbetween": 1}
    assert Counter(name for name, _ in seen) == values
    assert min(seen.values()) >= 3
    assert seen["layer", True] >= 0.4 * len(SEEDS)
    assert np.mean(doubtful[0]) < 0.05
    assert np.mean(doubtful[1]) < 0.35  # nothing is seen behind layers that cover all
