"""Follow Edges in Blender: keys, retimed strips, drafts, and moments between frames."""

import cv2
import exact_diffusion
import numpy as np
import pytest
from support import effect_of, image_strip, picture_of, recipe, request, write_frames

from shutter_addon.blender.rendering import previews
from shutter_addon.compute.guide import Guides, guiding
from shutter_addon.core.model import scribbles
from shutter_addon.media import open_source

SIZE, COUNT = (96, 54), 9
STROKE = {"name": "Belly", "shutter": "S1", "width": 0.03, "strokes": [[[0.36, 0.6], [0.36, 0.3]]]}


@pytest.fixture(scope="module")
def film(tmp_path_factory, bunny):
    """A real film, small, and every tenth frame of it: the first file."""
    with open_source(bunny) as source:
        frames = [source.read(10 + 10 * k)[..., :3] for k in range(COUNT)]
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
    still = picture_of(effect.scene, COUNT - 3)
    forward = request(edit, effect, strip, 3)
    edit.sequence_editor.strips["film"].use_reverse_frames = True
    back = request(edit, effect, strip, COUNT - 2)
    assert (forward.index, back.index, back.direction) == (2, 2, -1)
    assert np.array_equal(forward.coefficients(), back.coefficients())
    assert not np.array_equal(picture_of(effect.scene, COUNT - 3), still)


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
