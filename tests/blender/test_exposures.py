"""Exposures that follow keys, and so keep sharp what moves; lightest, darkest and median; and Follow Edges."""

import json
from dataclasses import replace

import cv2
import exact_diffusion
import numpy as np
import pytest
from support import effect_of, image_strip, noise, picture_of, recipe, request, write_frames

from shutter_addon.blender.data import recipe_import, snapshot
from shutter_addon.blender.editing import bar_edits, region_edits
from shutter_addon.blender.rendering import previews, sessions
from shutter_addon.compute.guide import Guides, guiding
from shutter_addon.core.frames import light
from shutter_addon.core.model import scribbles
from shutter_addon.core.recipes import recipe_file
from shutter_addon.core.recipes.recipe import RecipeError
from shutter_addon.media import open_source

COUNT, WIDTH, HEIGHT, WINDOW = 24, 120, 72, 6
INSIDE = np.s_[20:-20, 20:-20]  # where no window reaches beyond the picture


def codes(index, velocity):
    """What frame `index` shows (H, W, 3) uint8: a pattern that moves by so many pixels a frame, x right and y down."""
    y, x = np.indices((HEIGHT, WIDTH))
    x, y = x - velocity[0] * index, y - velocity[1] * index
    waves = [np.sin(x / 3 + y / 7), np.sin(x / 5 - y / 2.5), np.sin(x / 4 + 2 * np.sin(y / 6))]
    return np.rint(127.5 + 110 * np.stack(waves, axis=-1)).astype(np.uint8)


def place(index, velocity):
    return velocity[0] * index / WIDTH, -velocity[1] * index / HEIGHT


def following(keys, follow="car", **options):
    """The recipe of a stroke that lies still but for its keys, {timeline frame: location}, and of what follows."""
    keys = [{"frame": frame, "location": list(location)} for frame, location in keys.items()]
    car = {"name": "car", "shutter": "S0", "strokes": [[[0.4, 0.4], [0.6, 0.6]]], "keys": keys}
    data = recipe(WINDOW, [1] * WINDOW, regions=[car], **options)
    data["shutters"][0]["follow"] = follow
    return data


@pytest.fixture
def shown(bpy, edit, tmp_path):
    """Edit, effect, strip, and the request of a picture at a timeline frame, for footage of a velocity."""

    def show(data, velocity, frame, film=codes):
        first = write_frames(tmp_path / "in", [film(index, velocity) for index in range(COUNT)])
        strip, effect = effect_of(edit, image_strip(edit, first), data)
        return edit, effect, strip, request(edit, effect, strip, frame)

    yield show
    sessions.forget()


def levels(request):
    return 255 * light.to_encoded(request.picture()[..., :3].astype(float))


def levels_off(request, velocity, film=codes):
    """How far a picture is at most from the shown frame as it is, in 8-bit levels."""
    return np.abs(levels(request) - film(request.index, velocity))[INSIDE].max()


# Whole pixels are exact, and between pixels the cubic is nearly so.
VELOCITIES = pytest.mark.parametrize(("velocity", "most"), [((2, -1), 0.6), ((1.3, 0.6), 3)])


@VELOCITIES
def test_what_moves_by_keys_stays_sharp(shown, velocity, most):
    keys = {frame: place(frame - 1, velocity) for frame in (1, COUNT)}
    *_, found = shown(following(keys), velocity, 9)
    assert levels_off(found, velocity) <= most
    assert levels_off(found.with_state(replace(found.state, following=None)), velocity) > 30


CUT = 12


def two_shots(index, velocity):
    """The second of them upside down, and half as bright."""
    return codes(index, velocity) if index < CUT else codes(index, velocity)[::-1] // 2


@pytest.mark.parametrize("position", ["start", "center", "end"])
def test_the_exposure_ends_at_a_cut(shown, position):
    """Frames that are held in place of those beyond lie where they are themselves, whatever the keys say there."""
    velocity, upward = (2, -1), (2, 1)
    keys = {1: place(0, velocity), CUT: place(CUT - 1, velocity), CUT + 1: place(CUT, upward)}
    data = following(keys | {COUNT: place(COUNT - 1, upward)}, position=position)
    for frame in (CUT - 1, CUT, CUT + 1, CUT + 2):
        *_, found = shown(data, velocity, frame, film=two_shots)
        assert levels_off(found, velocity, two_shots) <= 0.6
    options = replace(found.state.options, stop_at_cuts=False, position="center")
    assert levels_off(found.with_state(replace(found.state, options=options)), velocity, two_shots) > 30


def test_the_camera_and_nothing_left_behind(shown):
    """What the camera sees is followed by its keys, and a recipe without them puts them back."""
    velocity = 2, -1
    camera = [{"frame": frame, "location": place(frame - 1, velocity)} for frame in (1, COUNT)]
    edit, effect, strip, found = shown(following({}, "camera", camera=camera), velocity, 9)
    assert levels_off(found, velocity) <= 0.6
    recipe_import.apply(edit, effect, strip, recipe_file.parse(json.dumps(following({}, "camera"))))
    assert tuple(effect.camera.location) == (0, 0)
    assert request(edit, effect, strip, 9).state.following is None


def test_a_region_that_is_renamed_or_removed(shown):
    velocity = 2, -1
    edit, effect, strip, _ = shown(following({frame: place(frame, velocity) for frame in (0, COUNT)}), velocity, 9)
    effect.regions[0].name = "truck"
    assert effect.shutters[0].follow_region == "truck"
    assert request(edit, effect, strip, 9).state.following is not None
    effect.shutters[0].follow_region = "ship"
    with pytest.raises(snapshot.EffectError, match='shutter "S0": there is no region "ship" to follow'):
        request(edit, effect, strip, 9)
    effect.shutters[0].follow_region = "truck"
    region_edits.remove_region(effect, 0)
    assert effect.shutters[0].follow == "NOTHING"
    assert request(edit, effect, strip, 9).state.following is None


def test_the_trails_length_is_keyed(shown):
    velocity, keys = (3, 0), {frame: place((frame - 1) ** 2 / COUNT, (3, 0)) for frame in range(1, COUNT + 1)}
    data = following(keys, position="center")
    data["shutters"][0]["trail"] = [{"frame": 5, "value": 0.05}, {"frame": 15, "value": 0.3}]
    edit, effect, strip, _found = shown(data, velocity, 10)
    for frame in (10, 12):
        (bars,) = request(edit, effect, strip, frame).state.bars
        open_for = np.count_nonzero(bars > 1e-9 * bars.sum())
        assert 1 < bars.sum() / bars.max() < WINDOW
        edit.frame_set(frame)
        assert bar_edits.current_summary(edit, effect, strip, bars) == f"Open for {open_for} of {WINDOW} frames here"
    edit.frame_set(COUNT + 1)
    assert "Open for" not in bar_edits.current_summary(edit, effect, strip, bars), "nothing is shown there"
    effect.shutters[0].length = "FRAMES"
    assert np.array_equal(request(edit, effect, strip, 10).state.bars, np.ones((1, WINDOW)))


# Lightest, darkest and median


def street():
    """Empty, of noise that stands still."""
    return 60 + noise(HEIGHT, WIDTH, 3) // 2


def crossing(index, _velocity=None):
    """Two walkers, one bright and one dark, cross it in opposite directions."""
    picture = street()
    picture[12:28, 6 * index : 6 * index + 8] = 250
    picture[36:52, WIDTH - 8 - 6 * index : WIDTH - 6 * index] = 5
    return picture


def combining(*regions, **shutter):
    data = recipe(9, [1] * 9, [1] + [0] * 8, regions=regions, position="center")
    data["shutters"][0] |= shutter
    return data


def test_a_median_is_the_empty_street(shown):
    """Each pixel is clear for more than half of the window."""
    *_, found = shown(combining(combine="median"), None, 8, crossing)
    assert 10 * np.log10(255**2 / np.mean((levels(found) - street()) ** 2)) >= 38


def test_a_threshold_is_keyed(shown):
    """From where on the bright walker alone leaves a trail; behind it the shown frame stays."""
    keys = [{"frame": 4, "value": 2.0, "ease": "constant"}, {"frame": 8, "value": 0.8}]
    data = combining(combine="lightest", threshold=keys, softness=0.01)
    edit, effect, strip, found = shown(data, None, 6, crossing)
    assert np.abs(levels(found) - crossing(5)).max() <= 1, "nothing is as light as that"
    found = levels(request(edit, effect, strip, 8))
    trail = np.stack([crossing(7 + k) for k in range(-4, 5)]).max(axis=0)
    assert np.abs(found[12:28] - np.where(trail[12:28] == 250, 250, crossing(7)[12:28])).max() <= 1
    assert np.abs(found[36:] - crossing(7)[36:]).max() <= 1, "the dark one stays where it is"


def test_a_layer_leaves_its_trail_before_a_sharp_street(shown):
    """A matte of the bright walker's row: what is behind it is the second shutter's, a single frame."""
    mask = [[[0, 1 - 28 / HEIGHT], [1, 1 - 28 / HEIGHT], [1, 1 - 12 / HEIGHT], [0, 1 - 12 / HEIGHT]]]
    row = {"shutter": "S0", "kind": "outline", "between": "straight", "layer": True, "strokes": mask}
    frames = np.stack([crossing(7 + k) for k in range(-4, 5)])
    for mode, function in (("lightest", np.max), ("darkest", np.min), ("median", np.median)):
        *_, found = shown(combining(row, combine=mode), None, 8, crossing)
        assert np.abs(levels(found) - function(frames, axis=0)).max() <= 1, mode


def test_an_average_has_no_threshold():
    with pytest.raises(RecipeError, match="only lightest and darkest have a threshold"):
        recipe_file.parse(json.dumps(combining(threshold=0.5)))


# Follow Edges

SIZE, SHOTS = (96, 54), 9
STROKE = {"name": "Belly", "shutter": "S1", "width": 0.03, "strokes": [[[0.36, 0.6], [0.36, 0.3]]]}


@pytest.fixture(scope="module")
def film(tmp_path_factory, bunny):
    """A real film, small, and every tenth frame of it: the first file."""
    with open_source(bunny) as source:
        frames = [source.read(10 + 10 * k)[..., :3] for k in range(SHOTS)]
    small = [cv2.resize(frame, SIZE, interpolation=cv2.INTER_AREA) for frame in frames]
    return write_frames(tmp_path_factory.mktemp("film"), small)


@pytest.fixture
def add(edit, film):
    """Puts an effect of a recipe on the film; gives edit, effect and strip."""

    def added(**options):
        edit.render.resolution_x, edit.render.resolution_y = SIZE
        data = recipe(3, [1, 1, 1], [1, 0, 0], regions=[STROKE], border=True, **options)
        strip, effect = effect_of(edit, image_strip(edit, film, name="film"), data)
        return edit, effect, strip

    return added


def test_reversed_and_retimed_strips_follow_the_shown_frame(add):
    edit, effect, strip = add(edge_aware=1, aggregate=2)
    still = picture_of(effect.scene, SHOTS - 3)
    forward = request(edit, effect, strip, 3)
    edit.sequence_editor.strips["film"].use_reverse_frames = True
    back = request(edit, effect, strip, SHOTS - 2)
    assert (forward.index, back.index, back.direction) == (2, 2, -1)
    assert np.array_equal(forward.coefficients(), back.coefficients())
    assert not np.array_equal(picture_of(effect.scene, SHOTS - 3), still)


def test_moments_that_are_shown_guide_it(add):
    """Where the window does not show them: the shutters are open after the shown moment alone."""
    shutters = [{"name": "S0", "bars": [0, 1, 0]}, {"name": "S1", "bars": [0, 0, 0.5]}]
    time = [{"frame": 1, "value": 3.5}]
    edit, effect, strip = add(inbetween=2, time=time, edge_aware=1, aggregate=2, shutters=shutters)
    wanted = request(edit, effect, strip, 1)
    assert wanted.index == 5
    moment = wanted.state
    labels = scribbles.rasterise(moment.shapes, SIZE[0] // 2, SIZE[1] // 2, border=True)
    seen = Guides(wanted.renderer.source).guide(guiding(5, 2, range(wanted.renderer.source.count)), 2)
    expected = exact_diffusion.solve(labels, 2, seen, 1.0)
    assert np.abs(wanted.coefficients() - expected).max() <= 1 / 255
    effect.use_source_time = False
    assert np.abs(request(edit, effect, strip, 4).coefficients() - expected).max() > 0.01


def test_a_draft_has_larger_blocks_where_edges_are_followed(add, monkeypatch):
    """Coefficients of a draft are those of the blocks; films and what has no edges to follow are never drafts."""
    monkeypatch.setattr(previews, "DRAFT_ROWS", SIZE[1] // 3)
    edit, effect, strip = add(edge_aware=1)
    exact = request(edit, effect, strip, 3)
    draft = previews.draft(exact.request, exact.renderer.source)
    assert (exact.state.options.aggregate, draft.state.options.aggregate) == (1, 4)
    assert exact.session.run(exact.renderer.coefficients, draft).shape[1:] == (-(-SIZE[1] // 4), -(-SIZE[0] // 4))
    effect.edge_aware = 0
    plain = request(edit, effect, strip, 3)
    assert previews.draft(plain.request, plain.renderer.source) is plain.request
