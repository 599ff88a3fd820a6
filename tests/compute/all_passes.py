"""All passes, each in the forms that differ in what they bind or compile."""

import importlib.util
import itertools

from shutter_addon.compute import composition_passes, diffusion_gpu, edge_diffusion_gpu, gpu, running_sums, stages
from shutter_addon.compute.composition_passes import MODES, composition
from shutter_addon.compute.devices.passes import Pass, read_pass
from shutter_addon.core.model.frame_state import AVERAGE, Combine

_WAYS = ("frames", "search", "value")


def _light(decode, premultiplied, encoded, levels, cover=0, combine=AVERAGE, kind="rgba32f"):
    """The macros of light that a window has (compute/gpu.py)."""
    macros = {"DECODE": decode, "PREMULTIPLIED": int(premultiplied), "ENCODED": int(encoded), "LEVELS": int(levels)}
    macros |= {"COVER": cover, "STORED": running_sums.STORED_SUMS[cover], "OPAQUE": 0}
    macros |= {"COMBINE": MODES[combine.mode], "BY_LUMINANCE": int(combine.by_luminance)}
    macros["LEVELS_OF"] = 2 if premultiplied else {"rgba8": 0, "rgba16": 1}.get(kind, 2)
    return macros | {"THRESHOLD": int(combine.threshold is not None)}


def _declared():
    for module in (diffusion_gpu, gpu, edge_diffusion_gpu, composition_passes, stages):
        yield from (value for value in vars(module).values() if isinstance(value, Pass))
    for ties in ("LABELS", "LINKS", "STENCIL"):
        yield from diffusion_gpu.operators(ties).values()


def _composing():
    def light(levels, encoded=False, premultiplied=True):
        return _light(1, premultiplied, encoded, levels)

    for way, edges in itertools.product(("pieces", *_WAYS), (1, 2)):
        yield composition(way, 3, **light(edges == 2), EDGES=edges)
    for way, tiled in itertools.product(_WAYS, (0, 1)):
        yield composition(way, 3, **light(not tiled), EDGES=2, SUMS=1, TILED=tiled)
    for rows, groups, back, tiled in ((2, 1, False, 1), (4, 2, True, 0), (64, 4, True, 8)):
        yield _of_sums(rows, groups, back, tiled, light(back, encoded=True))
    for way, packed in itertools.product(_WAYS, (True, False)):
        for at in ((True, False), (False, True)):
            yield _moved(way, light(True, premultiplied=False), 1, packed, at, EDGES=2 * packed)
        others = {"SHUTTERS": 5, "MIXED": 1, "GROUPS": 2, "SHARP": 0, "SQUARED": 0}
        quads = 1 if way == "search" else 4
        yield _moved(way, light(packed, encoded=True), quads, packed, **others)


def _of_sums(rows, groups, back, tiled, light):
    macros = {"ROWS": rows, "TABLE": (1 + rows) * (groups + 1), "BACK": int(back), "TILED": tiled}
    return composition("sums", groups, **light, **macros)


def _moved(way, light, quads, packed, at=(False, False), **others):
    macros = {"MOVED": 1, "QUADS": quads, "PACKED": int(packed), "SHUTTERS": 3, "MIXED": 3, "SHARP": 1, "SQUARED": 1}
    macros |= {"CONTINUED": int(at[0]), "UNFINISHED": int(at[1]), "SEVERAL": int(any(at))}
    groups = others.pop("GROUPS", 1)
    return composition(way, groups, **(light | macros | others))


def _combining():
    for mode, way in (("lightest", "frames"), ("darkest", "search"), ("median", "search"), ("median", "value")):
        has_threshold = mode == "darkest" and {"by_luminance": True, "threshold": 0.5}
        combine = Combine(mode, **(has_threshold or {}))
        for edges, kind in ((1, "rgba8"), (2, "rgba16f")):
            light = _light(1, kind != "rgba8", edges == 2, edges == 1, combine=combine, kind=kind)
            yield composition(way, 3, **light, EDGES=edges)
        if mode != "median":
            for quads, packed, at in ((4, True, (False, False)), (1, False, (True, False)), (1, False, (False, True))):
                for each in (way, "value"):
                    own = quads if each != "search" else 1
                    light = _light(1, False, False, at == (False, False), combine=combine)
                    yield _moved(each, light, own, packed, at, EDGES=2)
    yield read_pass("ways", "SELECT", GROUPS=2, ALL=9)
    for begins, levels in ((1, 0), (0, 0), (0, 1)):
        yield read_pass("ways", BEGINS=begins, LEVELS=levels)


def _layers():
    for cover, tiled in ((1, 0), (2, 1)):
        light = _light(0, False, True, cover == 2, cover)
        yield _of_sums(4, 2, cover == 1, tiled, light)
        for way in _WAYS:
            yield composition(way, 3, **light, EDGES=2, SUMS=1, TILED=tiled)
        for sent in ("COLOURS", "PLANES", "MOMENT", "AGAIN"):
            for kind in (1, 2, 3) if sent == "MOMENT" else (1,):
                yield running_sums.accumulation(1, sent, cover == 1, tiled, cover, kind)
    for ends, opaque in itertools.product((True, False), repeat=2):
        macros = {"ENDS": int(ends), "OPAQUE": int(opaque)}
        yield read_pass("layer", BEGINS=1, PLAIN=int(not opaque), PLATE=int(ends), LEVELS=int(ends), **macros)
        yield read_pass("layer", LEVELS=int(opaque and ends), **macros)


def _filling():
    for tiled, sent in itertools.product((8, 0), ("COLOURS", "NUMBERS", "PLANES", "MOMENT", "AGAIN")):
        yield running_sums.accumulation(1, sent, bool(tiled), tiled)
    yield read_pass("pack", DECODE=1, SQUARED=1)
    yield read_pass("pack", DECODE=2, SQUARED=0)
    yield read_pass("matte_blend", COUNT=2, MOST=stages.MOST_MATTES)


def _unpacking():
    if importlib.util.find_spec("bpy"):
        from shutter_addon.blender.devices import blender_gpu

        for kind, (_, _, packing) in blender_gpu.FORMATS.items():
            yield read_pass("blender_gpu", "UNPACK", PACKING=packing, FORMAT=kind)
        yield blender_gpu.LETTING_GO


PASSES = list(dict.fromkeys((*_declared(), *_composing(), *_combining(), *_layers(), *_filling(), *_unpacking())))


def told(program: Pass) -> str:
    """A pass in words, for tests that look at all of them: which one fails."""
    return f"{program.file} {program.step} {program.defines}"
