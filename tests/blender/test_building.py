"""In-between frames are built, stopped, found again and removed, by the operators of the panel."""

import itertools
import shutil
import threading
import time
from concurrent.futures import wait
from types import SimpleNamespace
from unittest import mock

import numpy as np
import pytest
from support import remembering, request, write_frames

from shutter_addon.media import flow as optical_flow

FACTOR, COUNT = 4, 6
LATER = itertools.count(10, 10)  # seconds, more with each look at the time


@pytest.fixture
def inbetween_build(bpy):
    from shutter_addon.blender.rendering import inbetween_build

    yield inbetween_build
    inbetween_build.stop()


@pytest.fixture
def flow(monkeypatch):
    """In place of optical flow: a plain blend, and a list of what is called for each pair."""
    calls = []

    def between(first, second, factor, *_):
        for call in calls:
            call()
        weights = np.arange(1, factor) / factor
        return [(first * (1 - weight) + second * weight).astype(first.dtype) for weight in weights]

    monkeypatch.setattr(optical_flow, "between", between)
    return calls


def ramp(number):
    """A picture that drifts, so that no two are equal and none is cut off from the next."""
    y, x = np.mgrid[:24, :40]
    return np.stack([x * 4 + number * 3, y * 6, x + y + number], axis=-1).astype(np.uint8)


@pytest.fixture
def effect(bpy, edit, tmp_path, flow):
    """An effect with a factor, in a saved file beside its footage."""
    effect = made(edit, tmp_path / "film")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "film" / "film.blend"))
    return effect


def made(edit, folder, first=None):
    """An effect on pictures that are written there; first: the file that the strip begins with."""
    from shutter_addon.blender.data import selection
    from shutter_addon.blender.editing import add_effect, shutter_edits

    written = write_frames(folder / "in", [ramp(number) for number in range(COUNT)])
    if first is not None:
        written = written.rename(written.with_name(first))
    source = edit.sequence_editor.strips.new_image(folder.name, str(written), 1, 1)
    for path in sorted(set(written.parent.iterdir()) - {written}):
        source.elements.append(path.name)
    strip, effect = add_effect.add_effect(edit, source)
    shutter_edits.start(effect)
    selection.choose(edit, strip)
    effect.inbetween = str(FACTOR)
    return effect


def look(bpy, inbetween_build):
    """What the panel finds, so long after its last look that it looks again."""
    from shutter_addon.blender.data import selection

    later = SimpleNamespace(monotonic=lambda: time.monotonic() + next(LATER))
    with mock.patch.object(inbetween_build, "time", later):
        return inbetween_build.look(*selection.active(bpy.context))


def shown(bpy, inbetween_build):
    found = look(bpy, inbetween_build).state
    return found.name, found.done, found.total


def pictures(folder):
    return sorted(path.name for path in folder.rglob("*.png") if path.parent.name != "in")


def test_built_shown_and_removed(bpy, inbetween_build, effect, tmp_path, capfd):
    assert shown(bpy, inbetween_build) == ("missing", 0, COUNT - 1)
    assert bpy.ops.shutter.inbetween_build() == {"FINISHED"}
    assert "In-between frames are built" in capfd.readouterr().out
    assert shown(bpy, inbetween_build) == ("ready", COUNT - 1, COUNT - 1)
    assert len(pictures(tmp_path)) == (COUNT - 1) * (FACTOR - 1)
    (cache,) = (tmp_path / "film" / "virtual_shutter_inbetween").iterdir()
    size = sum(path.stat().st_size for path in cache.rglob("*") if path.is_file())
    assert look(bpy, inbetween_build).size == size
    (cache / "notes.txt").write_text("the user's")
    assert bpy.ops.shutter.inbetween_purge() == {"FINISHED"}
    said = capfd.readouterr().out
    assert "Removed" in said
    assert f'Warning: "{cache}": other files stay there (1)' in said
    assert [path.name for path in cache.iterdir()] == ["notes.txt"]
    assert shown(bpy, inbetween_build) == ("missing", 0, COUNT - 1)
    assert look(bpy, inbetween_build).size == 0


def test_a_build_reopens_its_source_once_and_no_other(bpy, inbetween_build, edit, effect, flow, tmp_path, monkeypatch):
    """However often pictures are asked for meanwhile."""
    from shutter_addon.blender.data import selection, strips
    from shutter_addon.blender.rendering import effect_source, invalidation

    bpy.ops.shutter.inbetween_build()
    first = selection.active(bpy.context)[2]
    made(edit, tmp_path / "other", "f0102.png")
    begun = selection.active(bpy.context)
    ready = edit, strips.effect_of(edit, first.scene), first
    opened, asked, go = [], threading.Semaphore(0), threading.Semaphore(0)
    usual = effect_source.SourceKey.open
    monkeypatch.setattr(
        effect_source.SourceKey, "open", lambda key, **how: opened.append(key.scene) or usual(key, **how)
    )

    def draw():
        for shown in (ready, begun):
            request(*shown, 1)
        return invalidation.invalidate_changed(edit)

    draw()
    assert len(opened) == 2
    build = inbetween_build.start(*begun)
    flow += [asked.release, lambda: go.acquire(timeout=5)]
    for _ in range(COUNT - 1):
        assert asked.acquire(timeout=20)
        assert not draw()
        go.release()
    wait([build.future], timeout=20)
    assert not draw()
    assert len(opened) == 2
    inbetween_build.ended()
    assert draw()
    assert not draw()
    assert opened[2:] == [begun[1].scene.session_uid]


def test_nothing_is_left_of_an_empty_folder(bpy, effect, tmp_path):
    bpy.ops.shutter.inbetween_build()
    bpy.ops.shutter.inbetween_purge()
    assert sorted(path.name for path in (tmp_path / "film").iterdir()) == ["film.blend", "in"]


def test_a_stopped_build_keeps_what_it_has_and_goes_on(bpy, inbetween_build, effect, flow, tmp_path, capfd):
    pairs = []
    flow += [lambda: pairs.append(1), lambda: len(pairs) == 4 and inbetween_build.running().stop()]
    assert bpy.ops.shutter.inbetween_build() == {"CANCELLED"}
    assert "Stopped: " in capfd.readouterr().out
    name, done, total = shown(bpy, inbetween_build)
    assert (name, total) == ("partial", COUNT - 1)
    assert 0 < done < total
    flow[:] = [lambda: pairs.append(2)]
    assert bpy.ops.shutter.inbetween_build() == {"FINISHED"}
    assert shown(bpy, inbetween_build) == ("ready", total, total)
    assert pairs.count(2) == total - done


def test_a_build_that_is_stopped_at_once_has_built_nothing(bpy, inbetween_build, effect, flow):
    flow.append(lambda: inbetween_build.running().stop())
    assert bpy.ops.shutter.inbetween_build() == {"CANCELLED"}
    assert shown(bpy, inbetween_build) == ("missing", 0, COUNT - 1)


def test_a_build_ends_at_once_where_a_pair_takes_long(bpy, inbetween_build, effect, flow):
    """OpenCV's flow cannot be broken off: Esc does not wait for it. The next build does."""
    from shutter_addon.blender.data import selection

    begun, answer, found = threading.Event(), threading.Event(), selection.active(bpy.context)
    flow += [begun.set, lambda: answer.wait(30)]
    first = inbetween_build.start(*found)
    assert begun.wait(20)
    first.stop()
    inbetween_build.ended()
    assert first.result() == ("partial", 0, COUNT - 1)
    assert not first.future.done()
    second = inbetween_build.start(*found)
    done, _ = wait([second.future], timeout=0.2)
    assert not done
    answer.set()
    assert second.future.result(30) == ("ready", COUNT - 1, COUNT - 1)
    assert first.result().done == 0
    inbetween_build.ended()


def test_a_second_build_is_refused_and_nothing_is_removed_meanwhile(bpy, inbetween_build, effect, flow, tmp_path):
    from shutter_addon.blender.data import selection

    begun, answer = threading.Semaphore(0), threading.Event()
    flow += [begun.release, lambda: answer.wait(30)]
    build = inbetween_build.start(*selection.active(bpy.context))
    assert begun.acquire(timeout=20)
    for operator in ("inbetween_build", "inbetween_purge"):
        with pytest.raises(RuntimeError, match="In-between frames are being built; Esc stops that"):
            getattr(bpy.ops.shutter, operator)()
    assert inbetween_build.running() is build
    answer.set()
    assert build.future.result(30) == ("ready", COUNT - 1, COUNT - 1)
    assert len(pictures(tmp_path)) == (COUNT - 1) * (FACTOR - 1)


def test_a_changed_source_makes_them_stale(bpy, inbetween_build, effect, tmp_path):
    bpy.ops.shutter.inbetween_build()
    write_frames(tmp_path / "film" / "in", [ramp(number + 9) for number in range(COUNT)])
    assert shown(bpy, inbetween_build) == ("stale", 0, COUNT - 1)
    assert look(bpy, inbetween_build).size > 0
    bpy.ops.shutter.inbetween_purge()
    assert pictures(tmp_path) == []


def test_another_method_has_frames_of_its_own(bpy, inbetween_build, effect):
    bpy.ops.shutter.inbetween_build()
    effect.inbetween_method = "GOOD"
    assert shown(bpy, inbetween_build) == ("missing", 0, COUNT - 1)


def test_the_estimate_comes_when_it_is_known(bpy, inbetween_build, effect):
    wait_until = time.monotonic() + 20
    while (found := look(bpy, inbetween_build)).estimate is None and time.monotonic() < wait_until:
        time.sleep(0.05)
    bpy.ops.shutter.inbetween_build()
    assert found.estimate == pytest.approx(look(bpy, inbetween_build).size, rel=0.5)


@pytest.mark.usefixtures("effect")  # which is no more once the file is closed
def test_a_moved_file_finds_its_frames(bpy, inbetween_build, tmp_path):
    bpy.ops.file.make_paths_relative()
    bpy.ops.wm.save_mainfile()
    bpy.ops.shutter.inbetween_build()
    shutil.move(tmp_path / "film", tmp_path / "elsewhere")
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "elsewhere" / "film.blend"))
    assert shown(bpy, inbetween_build) == ("ready", COUNT - 1, COUNT - 1)


def test_an_unsaved_file_has_no_place_for_them(bpy, inbetween_build, edit, tmp_path, flow):
    from shutter_addon.blender.data import validation

    made(edit, tmp_path)
    with pytest.raises(validation.EffectError, match="save it first"):
        look(bpy, inbetween_build)
    for operator in ("inbetween_build", "inbetween_purge"):
        with pytest.raises(RuntimeError, match="save it first"):
            getattr(bpy.ops.shutter, operator)()


def test_a_checkout_that_is_not_installed_has_no_folder_of_its_own(bpy, inbetween_build, effect):
    effect.inbetween_place = "USER"
    with pytest.raises(RuntimeError, match="only an installed extension has a folder of its own"):
        bpy.ops.shutter.inbetween_build()


def test_without_a_factor_there_is_nothing_to_build(bpy, effect):
    effect.inbetween = "1"
    with pytest.raises(RuntimeError, match="Choose a factor first"):
        bpy.ops.shutter.inbetween_build()


def test_a_folder_that_cannot_be_written_is_one_sentence(bpy, inbetween_build, effect, tmp_path):
    (tmp_path / "film" / "virtual_shutter_inbetween").write_text("a file in the way")
    with pytest.raises(RuntimeError, match="in-between frames cannot be written there") as raised:
        bpy.ops.shutter.inbetween_build()
    assert "Traceback" not in str(raised.value)
    assert inbetween_build.running() is None


def test_a_folder_that_is_a_link_is_one_sentence_when_it_is_to_be_emptied(bpy, inbetween_build, effect, tmp_path):
    (tmp_path / "disk").mkdir()
    (tmp_path / "film" / "virtual_shutter_inbetween").symlink_to(tmp_path / "disk")
    assert bpy.ops.shutter.inbetween_build() == {"FINISHED"}
    built = pictures(tmp_path / "disk")
    with pytest.raises(RuntimeError, match=r"virtual_shutter_inbetween: cannot be removed \(it is a link, and"):
        bpy.ops.shutter.inbetween_purge()
    assert pictures(tmp_path / "disk") == built != []
    assert shown(bpy, inbetween_build) == ("ready", COUNT - 1, COUNT - 1)


@pytest.mark.usefixtures("effect")
def test_what_is_known_is_forgotten_with_the_file(bpy, inbetween_build, tmp_path):
    from shutter_addon.blender.rendering import invalidation
    from shutter_addon.media import derived, inbetween_cache

    scene = bpy.context.scene.virtual_shutter.effects[0].scene.session_uid
    bpy.ops.shutter.inbetween_build()
    look(bpy, inbetween_build)
    invalidation.invalidate_changed(bpy.context.scene)
    assert remembering(tmp_path) >= {"inbetween_build", "inbetween_settings"}
    assert "invalidation" in remembering(scene)
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    assert remembering(tmp_path) == remembering(scene) == set()
    remembered = derived.content_hash, inbetween_cache._listing, inbetween_cache._size  # of sources and folders
    assert [each.cache_info().currsize for each in remembered] == [0, 0, 0]


def test_footage_that_is_gone_is_one_sentence(bpy, effect, tmp_path):
    shutil.rmtree(tmp_path / "film" / "in")
    with pytest.raises(RuntimeError, match="no such file"):
        bpy.ops.shutter.inbetween_build()


@pytest.mark.usefixtures("effect")
def test_a_file_is_closed_in_the_midst_of_a_build(bpy, inbetween_build, flow):
    """What a window does: the build runs on while Blender handles events."""
    from shutter_addon.blender.data import selection

    flow.append(lambda: time.sleep(0.05))
    build = inbetween_build.start(*selection.active(bpy.context))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    assert inbetween_build.running() is None
    assert build.future.done()
    assert build.future.result().name == "partial"


def test_a_look_costs_a_redraw_next_to_nothing(bpy, inbetween_build, effect):
    from shutter_addon.blender.data import selection

    bpy.ops.shutter.inbetween_build()
    found = selection.active(bpy.context)
    inbetween_build.look(*found)
    start = time.perf_counter()
    for _ in range(100):
        inbetween_build.look(*found)
    assert (time.perf_counter() - start) / 100 < 2e-3
