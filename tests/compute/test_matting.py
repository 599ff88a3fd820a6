"""Mattes over coefficients, on all devices, against float64 and the formula written out for every pixel."""

from dataclasses import dataclass, replace

import numpy as np
from test_composition import LEVEL, SHAPES, Footage, footage, state

from shutter_addon.compute import stages
from shutter_addon.compute.renderer import Renderer
from shutter_addon.compute.request import Request
from shutter_addon.core.model.mattes import Matte


@dataclass(frozen=True)
class Drawn:
    number: int


class Values:
    """What reads them: values by number, changed by the source's frame; aggregated by means of whole blocks."""

    def __init__(self, source, seed=41):
        self.source, self.rng, self.known = source, np.random.default_rng(seed), {}

    def array(self, number, index):
        made = self.rng.random((self.source.height, self.source.width)).astype(np.float32)
        return self.known.setdefault((number, index), made)

    def values(self, mattes, index, block):
        found = []
        for matte in mattes:
            array = self.array(matte.content.number, index)
            height, width = array.shape
            rows, columns = (np.arange(0, n, block) for n in (height, width))
            sums = np.add.reduceat(np.add.reduceat(array, rows, axis=0), columns, axis=1)
            counts = np.outer(np.diff(np.append(rows, height)), np.diff(np.append(columns, width)))
            found.append(((matte.content.number, index, block), (sums / counts).astype(np.float32)))
        return found

    def another(self):
        return self

    def close(self):
        pass


def mattes(rng, count, shutters=3):
    return tuple(
        Matte(int(rng.integers(shutters)), Drawn(k), ("over", "add")[int(rng.integers(2))], float(rng.random()))
        for k in range(count)
    )


def laid(c, moment, reader, index):
    c = c.astype(np.float64)
    known = reader.values(moment.mattes, index, moment.options.aggregate)
    for matte, (_, values) in zip(moment.mattes, known, strict=True):
        for y, x in np.ndindex(values.shape):
            m = float(values[y, x]) * matte.opacity
            if matte.blend == "over":
                c[:, y, x] *= 1 - m
                c[matte.shutter, y, x] += m
            else:
                taken = min(m, c[0, y, x])
                c[0, y, x] -= taken
                c[matte.shutter, y, x] += taken
    return c


def test_more_mattes_than_one_pass_lays(device):
    rng = np.random.default_rng(42)
    source, moment = footage(rng), state(rng)
    moment = replace(moment, mattes=mattes(rng, stages.MOST_MATTES + 3))
    reader = Values(source)
    plain = Renderer(device, source).coefficients(Request(2, replace(moment, mattes=())))
    found = Renderer(device, source, reader).coefficients(Request(2, moment))
    assert np.abs(found - laid(plain, moment, reader, 2)).max() <= LEVEL / 100


def test_what_changes_is_laid_anew(device):
    rng = np.random.default_rng(46)
    source = footage(rng)
    reader, first = Values(source), replace(state(rng), mattes=mattes(rng, 2))
    renderer = Renderer(device, source, reader)
    fainter = replace(first, mattes=tuple(replace(matte, opacity=matte.opacity / 2) for matte in first.mattes))
    moments = [(2, first), (3, first), (3, fainter), (3, replace(fainter, shapes=SHAPES[1:]))]
    moments += [(3, replace(first, mattes=first.mattes[:1])), (3, replace(first, mattes=())), (2, first)]
    for index, moment in moments:
        found = renderer.coefficients(Request(index, moment))
        plain = Renderer(device, source).coefficients(Request(index, replace(moment, mattes=())))
        assert np.abs(found - laid(plain, moment, reader, index)).max() <= LEVEL / 100


def test_two_renderers_at_once(device):
    """Of two effects in one picture, whose coefficients a compositor makes by turns."""
    rng = np.random.default_rng(47)
    source, moment = footage(rng), state(rng, shapes=())
    readers = [Values(source, seed) for seed in (1, 2)]
    renderers = [Renderer(device, source, reader) for reader in readers]
    moments = [replace(moment, mattes=mattes(rng, 2)) for _ in renderers]
    expected = [renderer.picture(Request(2, moment)) for renderer, moment in zip(renderers, moments, strict=True)]
    for renderer, moment, picture in zip(renderers * 2, moments * 2, expected * 2, strict=True):
        renderer.release()
        assert np.array_equal(renderer.picture(Request(2, moment)), picture)


def test_add_leaves_no_rest_where_mattes_add_up_to_one(device):
    rng = np.random.default_rng(48)
    source = Footage(footage(rng).frames)
    shares = rng.dirichlet([1, 1, 1], (source.height, source.width)).astype(np.float32)
    reader = Values(source)
    reader.known = {(k, 2): shares[..., k] for k in range(3)}
    moment = replace(state(rng, shapes=()), mattes=tuple(Matte(k, Drawn(k), "add") for k in (1, 2)))
    found = Renderer(device, source, reader).coefficients(Request(2, moment))
    assert np.abs(found - np.moveaxis(shares, -1, 0)).max() <= 1e-6
