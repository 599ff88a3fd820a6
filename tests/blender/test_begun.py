"""Pictures that are begun before Blender asks for them, used only where they are right; and the way of each."""

import json
import re
import threading
from pathlib import Path
from queue import Queue

import frame_trace
import numpy as np
import pytest
from support import ROOT, noise, noise_film, picture_of, recipe, write_movie

from shutter_addon.blender.commands import render_command
from shutter_addon.blender.data import snapshot
from shutter_addon.blender.devices import available
from shutter_addon.blender.rendering import effect_source, job_snapshots, session, sessions
from shutter_addon.blender.rendering.session import RenderContext
from shutter_addon.compute.renderer import Renderer
from shutter_addon.core.recipes import recipe_file
from shutter_addon.core.stopping import StoppedError
from shutter_addon.media import open_source


@pytest.fixture
def film(bpy, edit, tmp_path):
    """An edit of twelve frames of noise under an effect of two shutters and a line; its source, effect and strip."""
    return edit, *noise_film(edit, noise(12, 24, 40, 3), tmp_path)


@pytest.fixture
def composed(monkeypatch):
    """The source frames of which pictures were made, in order."""
    made, picture = [], Renderer.picture

    def noted(self, request):
        made.append(request.index)
        return picture(self, request)

    monkeypatch.setattr(Renderer, "picture", noted)
    return made


@pytest.mark.parametrize("frames", [range(1, 13), [5, 2, 9]], ids=["film", "single"])
def test_each_picture_is_made_once_and_no_other(film, render, composed, frames):
    render(film[0], frames)
    sessions.forget()  # which waits for what was begun
    assert composed == [frame - 1 for frame in frames]


CHANGES = {
    "weigh": lambda source, effect: setattr(effect.shutters[0].bars[3], "weight", 0.1),
    "move": lambda source, effect: setattr(effect.regions[0], "location", (0.4, 0.0)),
    "slip": lambda source, effect: setattr(source, "content_start", -1),
    "widen": lambda source, effect: setattr(effect, "window", 6),
    "replace": lambda source, effect: setattr(source.elements[0], "filename", "f0007.png"),
}


@pytest.mark.parametrize("change", CHANGES)
def test_a_change_leaves_no_trace(film, render, change):
    """Frame 4 is begun when 2 and 3 are rendered; what is shown after a change is what a fresh start shows."""
    edit, source, effect, _strip = film
    before = render(edit, [2, 3, 4], "16")[4]
    render(edit, [2, 3], "16")
    CHANGES[change](source, effect)
    shown = render(edit, [4], "16")[4]
    sessions.forget()
    # Blender keeps the frame that it made last, whatever its settings: another one comes first.
    assert np.array_equal(shown, render(edit, [9, 4], "16")[4])
    assert change == "replace" or not np.array_equal(shown, before)


def test_a_frame_that_cannot_be_read_fails_only_when_it_is_shown(film, render, tmp_path):
    edit = film[0]
    (tmp_path / "in" / "f0008.png").write_bytes(b"no picture")
    render(edit, [3, 4])  # begins 5, whose window holds the eighth
    with pytest.raises(AssertionError):  # of the fixture, that there was no fault
        render(edit, [5])


@pytest.mark.parametrize("look", range(3))
def test_what_a_job_takes_away_meanwhile_is_not_missed(film, monkeypatch, look):
    """Scenes that are gone are forgotten on the main thread; a render job may take up what was begun for them between
    the look at what is known and its removal, which is where this one does: at one of the looks."""
    edit, _source, effect, strip = film
    found, looks, closed, close = (
        session.RenderSession(lambda: ("cpu", None), None),
        iter(range(9)),
        Queue(),
        Renderer.close,
    )

    def note(renderer):
        # On its thread, the other session may still close what tests before had.
        if renderer.compositor.name == "NumPy":
            closed.put(renderer)
        close(renderer)

    monkeypatch.setattr(Renderer, "close", note)

    def looked():
        if next(looks) == look:
            found.forget()

    class RecentValues(set):
        def __rsub__(self, known):
            looked()
            return known

        def __contains__(self, scene):
            looked()
            return False

    taken = snapshot.take(edit, effect, strip, (1, 2, 3))
    for frame in (1, 2):
        found.begin_next(taken, frame, RenderContext(found))
    found.keep(RecentValues())
    assert next(looks) > look
    assert closed.get(timeout=30)  # on the session's thread, for which nobody waits
    assert closed.empty()


def held_up(session, until):
    """A thread of which the session's own waits for an event."""
    assert session.threaded
    begun = threading.Event()
    thread = threading.Thread(target=session.run, args=(lambda: begun.set() or until.wait(10),))
    thread.start()
    assert begun.wait(10)
    return thread


def test_who_is_stopped_waits_neither_for_a_device_nor_for_others_to_be_closed(film):
    scene, answer, half = film[2].scene, threading.Event(), effect_source.Detail(2)
    waits = held_up(sessions.SESSIONS.offscreen, answer)
    stops = iter([False])  # and then it is stopped
    with pytest.raises(StoppedError):
        picture_of(scene, 1, stopped=lambda: next(stops, True))
    assert waits.is_alive()
    answer.set()
    context = sessions.of_render()
    first = context.request(*job_snapshots.of(scene, 1), effect_source.FULL)
    answer.clear()
    waits = held_up(sessions.SESSIONS.offscreen, answer)
    second = context.request(*job_snapshots.of(scene, 1), half)
    assert (first.source.detail, second.source.detail) == (effect_source.FULL, half)
    assert waits.is_alive()
    answer.set()
    sessions.forget()


def test_who_asks_for_room_keeps_what_it_uses(film, monkeypatch):
    """The other one may ask it in turn, while it waits for that."""
    asks, opened = [], available.OPEN["cpu"]
    monkeypatch.setitem(available.OPEN, "cpu", lambda memory, ask: asks.append(ask) or opened(memory, ask))
    found = session.RenderSession(lambda: ("cpu", None), lambda: found.free())
    request = RenderContext(found).request(*job_snapshots.of(film[2].scene, 1), effect_source.FULL)
    found.picture(request)
    renderer = found.renderer(request.source)
    assert not renderer.missing(request)
    (ask,) = asks
    ask()
    assert not renderer.missing(request)
    found.free()
    assert renderer.missing(request)
    found.forget()


# The way of a rendered frame: the page that tells it, and how often it comes back to a room

LINE = {"shutter": "S1", "kind": "line", "width": 0.02, "strokes": [[[0.3, 0.2], [0.5, 0.8]]]}
RECIPE = recipe(8, [1] * 8, [1] + [0] * 7, regions=[LINE], border=True)


def ways(bpy, footage, frames, tmp_path):
    """The stops of each of these frames, rendered one after the other."""
    import shutter_addon

    sessions.forget()
    with open_source(footage) as medium:
        scene = render_command.make_edit(footage, medium, recipe_file.parse(json.dumps(RECIPE)), tmp_path)
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "PNG", "16"
    door = "VirtualShutterEngine.render"
    for frame in frames:
        scene.frame_set(frame)
        scene.render.filepath = str(tmp_path / f"{frame}.png")
        with frame_trace.traced(Path(shutter_addon.__file__).parent, door, door) as stops:
            bpy.ops.render.render(write_still=True, scene=scene.name)
        yield stops


def test_a_rendered_frame_goes_the_way_of_the_page(bpy, tmp_path):
    pictures = [np.roll(noise(90, 160, 3), index, axis=1) for index in range(45)]
    film = write_movie(tmp_path / "film.mp4", pictures, "libx264", "yuv420p", 25)
    first, second = ways(bpy, film, (30, 31), tmp_path)
    page = (ROOT / "docs" / "developers.md").read_text(encoding="utf-8").partition("\n## How a frame is made\n")[2]
    told = re.findall(r"(?m)^\| `(.+?)` \| `(.+?)` \|", page.split("| File | Function |")[1])
    made = [(stop.path, stop.function) for stop in first]
    assert [stop for stop in made if stop in told] == told
    back = frame_trace.returns(second)
    assert len(back) <= 8, [stop[:2] for stop in back]
