"""All passes, each in the forms that differ in what they bind or compile."""

import importlib.util
import itertools

from shutter_addon.compute import diffusion_gpu, edge_diffusion_gpu, gpu, matting, mixing, window
from shutter_addon.devices.passes import Pass

_WAYS = ("frames", "search", "value")


def _declared():
    for module in (diffusion_gpu, edge_diffusion_gpu, gpu):
        yield from (value for value in vars(module).values() if isinstance(value, Pass))


def _composing():
    for way, edges in itertools.product(("pieces", *_WAYS), (1, 2)):
        yield gpu.composition(way, 3, "frames", 1, edges, True, False, edges == 2)
    for way, stored in itertools.product(_WAYS, ("sums", "tiles")):
        yield gpu.composition(way, 3, stored, 1, 2, True, False, stored == "sums")
    for rows, groups, back, tiled in ((1, 1, False, True), (4, 2, True, False), (32, 4, True, True)):
        yield gpu.composition_of_sums(rows, groups, back, tiled, True, back)
    for way, packed in itertools.product(_WAYS, (True, False)):
        for at in ((True, False), (False, True)):
            yield gpu.composition_of_moved(way, 1, 3, 3, packed, 1, packed, False, False, True, at, True)
        quads = 1 if way == "search" else 4
        yield gpu.composition_of_moved(way, quads, 5, 1, packed, 1, False, True, True, False, (False, False), packed)


def _filling():
    for tiled, sent in itertools.product((True, False), ("colours", "numbers", "planes", "before")):
        yield window.accumulation(1, sent, tiled, tiled)
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


PASSES = list(dict.fromkeys((*_declared(), *_composing(), *_filling(), *_unpacking())))
