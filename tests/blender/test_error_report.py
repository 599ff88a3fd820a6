"""Copy Report: what it says is so, and it names nothing, whatever is called by a name and whatever went wrong."""

import ast
import re
import shutil
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from support import ROOT, effect_of, image_strip, recipe, sequencer, write_frames

from shutter_addon.blender import command
from shutter_addon.blender.data import selection
from shutter_addon.blender.devices import available
from shutter_addon.blender.editing import bar_edits
from shutter_addon.blender.output import error_report
from shutter_addon.blender.output.error_report import without_paths
from shutter_addon.core import recent_errors

NAME = "Qanarix"


@pytest.fixture(autouse=True)
def _nothing_told(monkeypatch):
    monkeypatch.setattr(recent_errors, "_lines", [])  # private: what other tests told


@pytest.fixture
def named(bpy, edit, tmp_path, monkeypatch):
    """An edit in which all that can have a name has the same, folders and the user's own included: scene, effect,
    effect strip."""
    home = tmp_path / NAME
    for variable, value in {"HOME": home, "USERPROFILE": home, "USER": NAME, "LOGNAME": NAME, "USERNAME": NAME}.items():
        monkeypatch.setenv(variable, str(value))
    first = write_frames(home / "in", np.zeros((6, 24, 40, 3), dtype=np.uint8), NAME)
    source = image_strip(edit, first, name=NAME)
    edit.render.resolution_x, edit.render.resolution_y, edit.frame_end = 40, 24, 6
    line = {"shutter": "S1", "kind": "line", "width": 0.1, "strokes": [[[0.2, 0.2], [0.3, 0.8]]]}
    ramp = {"shutter": "S0", "kind": "ramp", "ramp": "radial"}
    data = recipe(4, {1: [1, 1, 1, 1], 5: [1, 0, 0, 0]}, [0, 0, 1, 0], regions=[line, line, ramp])
    strip, effect = effect_of(edit, source, data)
    edit.timeline_markers.new(NAME, frame=2)
    edit[NAME] = NAME
    for item in (effect, *effect.shutters, *effect.regions, strip, source, *edit.sequence_editor.channels):
        item.name = NAME
    shutil.copy(first, home / f"{NAME}.png")
    bpy.data.images.load(str(home / f"{NAME}.png"))
    bpy.data.masks.new(NAME)
    for collection in (bpy.data.scenes, bpy.data.annotations, bpy.data.actions, bpy.data.worlds, bpy.data.objects):
        for item in collection:
            item.name = NAME
    for region in list(effect.regions)[:2]:
        layer = effect.scene.annotation.layers[region.layer]
        layer.info = NAME
        region.layer = layer.info
    bpy.ops.wm.save_as_mainfile(filepath=str(home / f"{NAME}.blend"), copy=False, compress=False)
    selection.choose(edit, strip)
    return edit, effect, strip


def report(edit):
    text = error_report.text(edit)
    assert NAME.lower() not in text.lower()
    assert str(Path.home()) not in text
    assert "/" not in re.sub(r"\b\w+(/\w+)+\.py:\d+", "", text.partition("Edit")[2])
    return text


def line(text, start):
    return next(line for line in text.splitlines() if line.strip().startswith(start))


def test_versions_and_device_are_those_that_there_are(bpy, edit):
    import av
    import cv2

    text = report(edit)
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))
    assert line(text, "- Virtual Shutter") == f"- Virtual Shutter: {manifest['version']}"
    assert bpy.app.version_string in line(text, "- Blender:")
    assert bpy.app.build_hash.decode() in line(text, "- Blender:")
    assert ".".join(map(str, sys.version_info[:3])) in line(text, "- System:")
    for package in (np, av, cv2):
        assert f"{package.__name__} {package.__version__}" in line(text, "- Packages:")
    kind, lesser = available.choose("auto")
    assert f"- Renders: {available.name(kind)} ({kind})" in text
    assert (lesser or "") in text


def test_a_package_that_is_missing_and_one_that_is_broken(edit, tmp_path, monkeypatch):
    (tmp_path / "foreign.py").write_text(f"raise ImportError('{NAME}.so: wrong ELF class')")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(error_report, "PACKAGES", ("not_there", "foreign"))
    assert line(report(edit), "- Packages:") == (
        "- Packages: not_there cannot be imported (ModuleNotFoundError), foreign cannot be imported (ImportError)"
    )


def test_what_the_edit_is_made_of(bpy, named):
    edit, effect, _strip = named
    text = report(edit)
    assert f"- Frames: {edit.frame_start} to 6, at {edit.frame_current}; 40×24 at 100 %" in text
    assert f"- Saved by Blender {'.'.join(map(str, bpy.data.version))}; output PNG" in text
    assert "- Strips: 1 IMAGE, 1 SCENE" in text
    assert line(text, "- Effect:").startswith("- Effect: window 4, ")
    assert "  - footage: png, 3 channels of uint8, 40×24, 6 frames, read as uint8, alpha opaque" in text
    for told in ("2 × shutter, defaults", "2 × region, defaults", "1 × region, kind RAMP, ramp RADIAL"):
        assert f"  - {told}" in text
    assert "cannot be shown" not in text
    effect.shutters[1].combine, effect.regions[0].is_layer = "LIGHTEST", True
    text = report(edit)
    assert "  - 1 × shutter, combine LIGHTEST" in text
    assert "  - 1 × region, is_layer True" in text


def test_after_several_errors_it_names_nothing(bpy, named, tmp_path):
    """Reports of operators, a film that fails, and an error that nobody expected."""
    edit, effect, strip = named
    folder, ops = tmp_path / NAME, bpy.ops.shutter

    def surprised(*_arguments):
        raise KeyError(f"{folder}/{NAME}")

    with sequencer(bpy), pytest.MonkeyPatch.context() as patch:
        fails(ops.recipe_import, filepath=str(folder / "gone.json"))
        fails(ops.bar_set, bar=7)
        effect.scene.camera = None
        fails(ops.recipe_export, filepath=str(folder / NAME / "no" / "folder.json"))
        patch.setattr(bar_edits, "paint", surprised)
        fails(ops.bar_set, bar=1)
        for file in (folder / "in").iterdir():
            file.unlink()
        edit.sequence_editor.active_strip = next(each for each in edit.sequence_editor.strips_all if each != strip)
        for _ in range(2):
            fails(ops.add_effect)
    edit.render.filepath = str(folder / "out")
    bpy.ops.render.render(animation=True, scene=edit.name)
    text = report(edit)
    assert line(text, "- cannot be shown at frame")
    told = text.partition("Last errors and warnings")[2]
    assert "The shutter has {count} bars" in told
    assert "gone" not in told
    assert re.search(r"- \d+ s: KeyError \[blender/interface/operators\.py:\d+ change < .*execute\]", told)
    assert re.search(r"- \d+ s: raise .*\{path.name\}: no such file in .* \[media/files\.py:\d+\]", told)


def test_an_edit_that_is_broken_beyond_all_that_is_foreseen_has_a_report(named, monkeypatch):
    def surprised(*_arguments):
        raise KeyError(NAME)

    monkeypatch.setattr(error_report, "_options", surprised)  # private: whatever of it fails
    text = report(named[0])
    assert "- the rest cannot be told: see the last error" in text
    assert re.search(r"KeyError \[blender/output/error_report\.py:\d+ \S+ < ", text)


def test_paths_are_taken_from_what_drivers_say():
    for told, expected in {
        f"no OpenGL 4.3: /home/Jane {NAME} Doe/lib x/libGL.so is missing": "no OpenGL 4.3: (path) is missing",
        rf"cannot load C:\Users\Jane {NAME}\gl.dll": "cannot load (path)",
        f"see ~/{NAME}": "see (path)",
        "RTX 3080/PCIe/SSE2, 4.6": "RTX 3080/PCIe/SSE2, 4.6",
    }.items():
        assert without_paths(told) == expected


def test_without_a_window_the_button_says_where_the_report_is(bpy, edit):
    with pytest.raises(RuntimeError, match="use the command check with --report"):
        bpy.ops.shutter.copy_report()


@pytest.mark.usefixtures("named")
def test_the_command(tmp_path, capsys):
    """It has the edit's faults as well."""
    next((tmp_path / NAME / "in").iterdir()).unlink()
    recent_errors._lines = []  # private: what other tests told
    blend = tmp_path / NAME / f"{NAME}.blend"
    assert command.main(["check", str(blend), "--device", "cpu", "--report"]) == 2
    text = capsys.readouterr().out.partition("### Virtual Shutter")[2]
    assert NAME not in text
    assert str(tmp_path) not in text
    assert "- Renders: NumPy (cpu); cpu is wanted" in text
    assert "- Strips: 1 IMAGE, 1 SCENE" in text
    assert "{path.name}: no such file in" in text.partition("Last errors")[2]


def test_no_operator_reports_an_error_past_the_report():
    """All go through operator_bases.report."""
    found = []
    package = ROOT / "shutter_addon"
    for path in [*package.glob("blender/interface/*.py"), *package.glob("features/*/blender/*.py")]:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and getattr(node.func, "attr", "") == "report":
                kinds = {each.value for each in ast.walk(node.args[0]) if isinstance(each, ast.Constant)}
                found += [path.name] if kinds != {"INFO"} else []
    assert found == ["operator_bases.py"]


def fails(operator, **given):
    with pytest.raises(RuntimeError):
        operator(**given)
