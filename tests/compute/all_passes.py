"""All passes, each in the forms that differ in what they bind or compile."""

import importlib.util
import itertools

import pytest

from shutter_addon.compute import (
    composition_passes,
    diffusion_gpu,
    displaying,
    edge_diffusion_gpu,
    laying,
    matting,
    mixing,
    running_sums,
    window,
)
from shutter_addon.compute.composition_passes import (
    LightFormat,
    composition,
    composition_of_moved,
    composition_of_sums,
)
from shutter_addon.core.model.combining import Combine
from shutter_addon.devices.passes import Pass

_WAYS = ("frames", "search", "value")


def _declared():
    for module in (diffusion_gpu, displaying, edge_diffusion_gpu, composition_passes, laying):
        yield from (value for value in vars(module).values() if isinstance(value, Pass))
    for ties in ("LABELS", "LINKS", "STENCIL"):
        yield from diffusion_gpu.operators(ties).values()


def _composing():
    def light(levels, encoded=False, premultiplied=True):
        return LightFormat(1, premultiplied, encoded, levels)

    def moved(quads, packed, at=(False, False), **others):
        given = {"shutters": 3, "mixed": 3, "shortened": packed, "sharp": True} | others
        return {"quads": quads, "packed": packed, "continued": at[0], "unfinished": at[1], **given}

    for way, edges in itertools.product(("pieces", *_WAYS), (1, 2)):
        yield composition(way, 3, "frames", edges, light(edges == 2))
    for way, stored in itertools.product(_WAYS, ("sums", "tiles")):
        yield composition(way, 3, stored, 2, light(stored == "sums"))
    for rows, groups, back, tiled in ((1, 1, False, True), (4, 2, True, False), (32, 4, True, True)):
        yield composition_of_sums(rows, groups, back, tiled, light(back, encoded=True))
    for way, packed in itertools.product(_WAYS, (True, False)):
        for at in ((True, False), (False, True)):
            yield composition_of_moved(way, light(True, premultiplied=False), **moved(1, packed, at))
        others = {"shutters": 5, "mixed": 1, "shortened": False, "sharp": False}
        yield composition_of_moved(
            way, light(packed, encoded=True), **moved(1 if way == "search" else 4, packed, **others)
        )


def _combining():
    for mode, way in (("lightest", "frames"), ("darkest", "search"), ("median", "search"), ("median", "value")):
        has_threshold = mode == "darkest" and {"by_luminance": True, "threshold": 0.5}
        combine = Combine.of(mode, **(has_threshold or {}))
        for edges, kind in ((1, "rgba8"), (2, "rgba16f")):
            light = LightFormat(1, kind != "rgba8", edges == 2, edges == 1, combine=combine, kind=kind)
            yield composition(way, 3, "frames", edges, light)
        if mode != "median":
            for quads, packed, at in ((4, True, (False, False)), (1, False, (True, False)), (1, False, (False, True))):
                moved = {"shutters": 3, "mixed": 3, "packed": packed, "shortened": True, "sharp": True}
                moved |= {"continued": at[0], "unfinished": at[1]}
                for each in (way, "value"):
                    own = quads if each != "search" else 1
                    light = LightFormat(1, False, False, at == (False, False), combine=combine)
                    yield composition_of_moved(each, light, quads=own, **moved)
    yield composition_passes.selection(2, 9)
    for begins, levels in ((True, False), (False, False), (False, True)):
        yield composition_passes.way_sum(begins, levels)


def _layers():
    for cover, stored in ((1, "sums"), (2, "tiles")):
        light = LightFormat(0, False, True, cover == 2, cover)
        yield composition_of_sums(4, 2, cover == 1, cover == 2, light)
        for way in _WAYS:
            yield composition(way, 3, stored, 2, light)
        for sent in ("colours", "planes", "before"):
            yield running_sums.accumulation(1, sent, cover == 1, cover == 2, cover)
    for ends, opaque in itertools.product((True, False), repeat=2):
        yield laying.laying_pass(True, ends, opaque, plain=not opaque, plate=ends, levels=ends)
        yield laying.laying_pass(False, ends, opaque, plain=False, plate=False, levels=opaque)


def _filling():
    for tiled, sent in itertools.product((True, False), ("colours", "numbers", "planes", "before")):
        yield running_sums.accumulation(1, sent, tiled, tiled)
    yield window.packing(1, True)
    yield window.packing(2, False)
    for adds in (False, True):
        yield matting.blend_pass(2, adds)
        yield mixing.mix_pass(adds)


def _unpacking():
    if importlib.util.find_spec("bpy"):
        from shutter_addon.blender.devices import blender_gpu

        for kind, sent in blender_gpu.FORMATS.items():
            if sent is not None:
                yield blender_gpu.unpacking(kind, sent[2])
        yield blender_gpu.LETTING_GO


PASSES = list(dict.fromkeys((*_declared(), *_composing(), *_combining(), *_layers(), *_filling(), *_unpacking())))
each_pass = pytest.mark.parametrize("program", PASSES, ids=lambda program: f"{program.file}-{program.step}".strip("-"))
