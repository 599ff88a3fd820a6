"""Renders from the window, and Blender's GPU beside them: each a story in a real window."""

import numpy as np
import pytest
from fresh import PACKAGES
from screens import TOLERANCE, apart_on_screen, assert_alike, pixels
from telling import BUNNY, SMALL, command_renders, excerpt, linked, needs_window, noise, recipe, tell

from shutter_addon.media.rendered_pictures import whole_pictures

pytestmark = needs_window


def console(folder):
    return (folder / "console.txt").read_text()


def test_without_wheels(tmp_path):
    """The preview and a render's thread are on Blender's own GPU, and a movie is shown; it says why each is slow."""
    (seen,) = tell("without_wheels", "opengl", linked(tmp_path), hidden=" ".join(PACKAGES))
    said, decoded = seen["said"]
    assert decoded.startswith("a second Blender decodes movies")
    assert "moderngl" in said
    assert "composing on Blender's own GPU" in said
    assert said in console(tmp_path)


def test_preview_and_film_take_turns_where_the_gpu_is_small(tmp_path):
    """Each has room for the running sums of its window, and both have not."""
    size, megabytes = (480, 270), 34
    given = {"footage": noise(tmp_path, 20, size), "recipe": recipe(tmp_path, [1] + [0] * 15)}
    *seen, told = tell("memory_story", "opengl", linked(tmp_path), **given, megabytes=megabytes)
    assert f"{megabytes // 4} MB of GPU memory are too little for 16 frames" in told["said"][-1]
    command_renders(*given.values(), tmp_path / "expected", "--frames", "1:4")
    sums = 17 * 8 * size[0] * size[1]
    assert [found["device"] for found in seen] == ["GLDevice", "RelayedDevice"]
    for found, folder in zip(seen, ("OPENGL", "BLENDER"), strict=True):
        assert found["before"][0] > sums
        assert found["before"][1] == found["job"][1] == found["after"][1] == "Sums"
        assert found["freed"][1] is None
        assert found["kept"][1] is None
        assert found["most"] <= found["limit"] == megabytes << 20
        for name in ("0001.png", "0002.png", "0003.png", "0004.png"):
            apart = np.abs(pixels(tmp_path / folder / name) - pixels(tmp_path / "expected" / name))
            assert apart.max() <= 1, (folder, name)


def test_films_on_blenders_own_gpu(tmp_path):
    """In a job of the window, moderngl hidden: as moderngl renders them without a window; ten in a row, and their
    textures take what the first one's took."""
    keys = {"frame": 1}, {"frame": 30, "location": [0.3, 0.1]}
    given = {"footage": noise(tmp_path, 30, (96, 54)), "recipe": recipe(tmp_path, [0, 0, 1, 0, 0, 0], keys=keys)}
    seen = tell("own_gpu_story", "vulkan", linked(tmp_path), screen=SMALL, **given, hidden="moderngl")
    assert console(tmp_path).count("composing on Blender's own GPU") == 2  # of each file's first film
    reason = "View > Render Sequencer Animation cannot use Blender's own GPU, as Render > Render Animation can"
    assert console(tmp_path).count(f"and {reason}; composing with NumPy, which is slow") == 1
    assert f"{reason}\n" in console(tmp_path)  # where NumPy is not allowed
    assert len(list(tmp_path.glob("refused/*"))) < 4
    held = [found for entry in seen for found in entry.values()]
    assert {tuple(found[:2]) for found in held} == {("RelayedDevice", held[0][1])}
    assert len({used for *_, used in held}) == 1
    command_renders(*given.values(), tmp_path / "expected")
    assert 3 <= len(list((tmp_path / "stopped").iterdir())) < 30
    for folder, count in (("film", 30), ("short", 12), ("waited", 4), ("after", 5)):
        names = sorted(file.name for file in (tmp_path / folder).iterdir())
        assert names == [f"{number:04d}.png" for number in range(1, count + 1)]
        for name in names:
            apart = np.abs(pixels(tmp_path / folder / name) - pixels(tmp_path / "expected" / name))
            assert apart.max() <= 1, (folder, name)


def test_renders_that_end_early(tmp_path):
    """A picture that fails ends the job, as Esc does: the movie is finished up to there, and a menu says why."""
    seen = tell("failing", "opengl", linked(tmp_path))
    ends = {entry["output"]: entry["ended"] for entry in seen if "output" in entry}
    cancelled = {name: ["render_cancel"] for name in ("film.mp4", "folder", "stopped.mp4")}
    assert ends == cancelled | {"after.mp4": ["render_complete"]}
    assert whole_pictures(tmp_path / "film.mp4") == 14
    assert len(list((tmp_path / "folder").iterdir())) == 14
    assert 1 <= whole_pictures(tmp_path / "stopped.mp4") < 185
    assert whole_pictures(tmp_path / "after.mp4") == 5
    assert console(tmp_path).count("Virtual Shutter: f0015.png: no such file") == 2
    (scenes,) = (entry["scenes"] for entry in seen if "scenes" in entry)
    assert len(scenes) == 2
    assert [entry["shown"][0] for entry in seen if "shown" in entry] == [[180, 320, 4]]


@pytest.mark.parametrize("backend", ["opengl", "vulkan"])
def test_blender_lives_where_its_gpu_is_not_current(backend, tmp_path):
    """Whatever lets go of what it holds there, by whoever; and the preview is the same afterwards."""
    given = {"footage": noise(tmp_path, 30, (192, 108)), "recipe": recipe(tmp_path, [1] + [0] * 5)}
    seen = tell("gpu_life_story", backend, linked(tmp_path), screen=SMALL, **given)
    kept = 2 if backend == "opengl" else 0
    assert [entry["lost"] for entry in seen] == [False] * kept + [True] * (len(seen) - kept)
    assert ("Blender's GPU cannot be used until a window is drawn" in console(tmp_path)) == (backend == "opengl")
    assert not (tmp_path / "refused.png").exists()
    pictures = [pixels(tmp_path / f"{name}.png", (300, 54, 900, 380)) for name in ("before", "after")]
    assert_alike(*pictures, tmp_path / "difference.png", tolerance=0)


@pytest.mark.parametrize(("backend", "hidden"), [("opengl", ""), ("vulkan", "moderngl")])
def test_esc_ends_a_render_between_two_passes(backend, hidden, tmp_path):
    """And the render's window shows the frame that was made. What is rendered afterwards is as ever."""
    path = recipe(tmp_path, [1] + [0] * 7, [[0.4, 0.3], [0.45, 0.6]], width=0.02, edge_aware=1, aggregate=4)
    given = {"footage": excerpt(BUNNY, range(70), tmp_path / "bunny.mp4", (320, 180)), "recipe": path}
    seen = tell("stopping_story", backend, linked(tmp_path), screen=SMALL, **given, hidden=hidden)
    (ended,) = seen
    assert ended["whole"] > 300
    assert ended["after"] <= 5
    assert ended["finished_after"] == 0
    screen, written = pixels(tmp_path / "render_window.png"), sorted((tmp_path / "film").iterdir())
    assert min(apart_on_screen(screen, pixels(frame)) for frame in written) <= TOLERANCE
    for frame in (tmp_path / "after").iterdir():
        assert np.array_equal(pixels(frame), pixels(tmp_path / "film" / frame.name))


@pytest.mark.parametrize(("backend", "hidden"), [("opengl", "moderngl"), ("vulkan", "")])
def test_a_film_shows_what_was_when_it_began(backend, hidden, tmp_path):
    """120 changes while a film renders, at the end the strip deleted: no frame is another one before, and then the
    frames are those without it. So with the source deleted, and a single picture. A film ends where the effect's scene
    is deleted, and by undo, even while it waits for Blender's main thread. On OpenGL, and on Blender's own GPU."""
    seen = tell("stress", backend, linked(tmp_path), screen=SMALL, hidden=hidden)
    assert ("composing on Blender's own GPU" in console(tmp_path)) == bool(hidden)
    films = {entry["film"]: entry for entry in seen}
    ended = {name: film["ended"] for name, film in films.items()}
    assert ended == dict.fromkeys(("alone", "stressed", "after", "source", "picture"), "complete") | dict.fromkeys(
        ("scene", "undone", "asking"), "cancelled"
    )
    assert console(tmp_path).count('Virtual Shutter: the scene of "Shutter" was deleted') == 1
    pictures = {name: {p.name: pixels(p) for p in (tmp_path / name).iterdir()} for name in films}
    alone, stressed, after = (pictures[name] for name in ("alone", "stressed", "after"))
    assert len(alone) == len(stressed) == len(after) == 30
    names = sorted(alone)
    assert_same(pictures["source"], alone, names)
    assert_same(pictures["picture"], alone, ["0020.png"])
    assert_same(stressed, alone, names[:20])
    assert_same(stressed, after, names[20:])
    assert not any(np.array_equal(alone[name], after[name]) for name in names)


def assert_same(film, expected, names):
    different = [name for name in names if not np.array_equal(film[name], expected[name])]
    assert not different
