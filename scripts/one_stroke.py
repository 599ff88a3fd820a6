"""Measure how well one stroke, tracked and with Follow Edges, keeps to a subject whose mask and motion are known.

    python scripts/one_stroke.py [--output DIR] [--json FILE] [--docs] [SCENE ...]

Blender renders the scenes of one_stroke_scenes.py. `shutter track` follows a stroke inside the subject both ways.

Masks: intersection over union of "coefficient > 0.5" and the true mask, and the mean coefficient inside that; the same
without edges, without tracking, and of OpenCV's GrabCut, which gets the tracked stroke and the frame's edge.
Motion: how far the stroke's ends lie from where they belong, in pixels of 640, with every key and with thinned keys.

DIR gets a picture for each scene of masks. Needs Blender as a library (bpy).
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path

import comparing
import cv2
import numpy as np
import one_stroke_scenes as truth

from gallery import stills
from shutter_addon.compute.renderer import Renderer, open_compositor
from shutter_addon.compute.request import Request
from shutter_addon.core.model import scribbles
from shutter_addon.core.model.effect import Effect
from shutter_addon.core.recipes import recipe_file
from shutter_addon.media import open_source

NAME = "subject"
SURE = 0.5
SHOWN = (1, 14, 27, 40)  # frames of the pictures
WAYS = ("one stroke", "without edges", "without tracking", "GrabCut")


def main() -> None:
    names = [scene.name for scene in truth.SCENES]
    about = "One tracked stroke with Follow Edges, beside the truth."
    parser = argparse.ArgumentParser("one_stroke", description=about)
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help=", ".join(names))
    parser.add_argument("--output", type=Path, default=comparing.ROOT / "out" / "one_stroke", metavar="DIR")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures there")
    parser.add_argument("--aggregate", type=int, choices=(1, 2, 4), default=1, help="as in the recipe: 2 is quicker")
    parser.add_argument("--docs", action="store_true", help="renew docs/one_stroke_SCENE.jpg")
    arguments = parser.parse_args()
    chosen = [scene for scene in truth.SCENES if scene.name in (arguments.scenes or names)]
    rows = []
    for scene in chosen:
        folder = arguments.output / scene.name
        truth.render(scene, folder)
        keyed = tracked(scene, folder, arguments.aggregate)
        rows.append({"scene": scene.name, **motion(scene, folder, keyed)})
        if scene.masked:
            masks = Masks(folder, keyed)
            rows[-1] |= {"iou": {way: masks.overlap(way) for way in WAYS}, "inside": masks.inside("one stroke")}
            picture = masks.picture()
            stills.save(picture, folder.with_suffix(".png"))
            if arguments.docs:
                stills.save(picture, comparing.ROOT / "docs" / f"one_stroke_{scene.name}.jpg")
        print(json.dumps(rows[-1]), flush=True)
    comparing.write_rows(arguments.json, rows)


def stroked(scene: truth.Scene, size, window: int = 9, aggregate: int = 1) -> Effect:
    """The effect of a new stroke on the subject at the scene's first frame of tracking, not tracked yet."""
    stroke = truth.on_picture(truth.STROKE, truth.place(scene, scene.start, size), size)
    long, sharp = [1.0] * window, [0.0] * (window // 2) + [1.0] + [0.0] * (window // 2)
    options = {"version": 1, "window": window, "position": "center", "border": True, "edge_aware": 1}
    shutters = [
        {"name": "Long", "color": [0.2, 0.5, 1], "bars": long},
        {"name": "Sharp", "color": [1, 0.5, 0.1], "bars": sharp},
    ]
    region = {"name": NAME, "shutter": "Sharp", "width": 0.02, "strokes": [stroke.tolist()]}
    data = options | {"aggregate": aggregate, "shutters": shutters, "regions": [region]}
    return recipe_file.parse(json.dumps(data))


def tracked(scene: truth.Scene, folder: Path, aggregate: int = 1) -> dict[str, Effect]:
    """The effect with the keys that the command writes: `thinned`, and `all` of them."""
    footage = folder / "footage" / "0001.png"
    with open_source(footage) as source:
        drawn = stroked(scene, (source.width, source.height), aggregate=aggregate)
    (folder / "drawn.json").write_text(recipe_file.dump(drawn), encoding="utf-8")
    options = ["--recipe", folder / "drawn.json", "--region", NAME, "--frame", scene.start]
    found = {"drawn": drawn}
    for name, option in (("thinned", []), ("all", ["--all-keys", "--report", folder / "report.json"])):
        output = folder / f"{name}.json"
        comparing.run("track", footage, *options, "--output", output, *option)
        found[name] = recipe_file.load(output)
    return found


def motion(scene: truth.Scene, folder: Path, keyed: dict[str, Effect]) -> dict:
    """How far the stroke lies from where it belongs, in pixels of 640."""
    with open_source(folder / "footage" / "0001.png") as source:
        size, frames = (source.width, source.height), range(1, source.count + 1)
    report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    sure = {row["frame"]: row["confidence"] for row in report["frames"]}
    whole = [f for f in frames if f in sure and truth.seen(scene, f, size) > 0.999]
    partly = [f for f in frames if f in sure and f not in whole and sure[f] > SURE]

    def error(way, frame):
        stroke = truth.on_picture(truth.STROKE, truth.place(scene, frame, size), size)
        (shape,) = keyed[way].for_picture(size[0] / size[1]).at(frame).shapes
        return float(np.hypot(*((shape.strokes[0] - stroke) * size).T).max() * 640 / size[0])

    def worst(way, chosen):
        return round(max((error(way, frame) for frame in chosen), default=0.0), 2)

    return {
        "tracked": len(sure),
        "seen": len(whole),
        "error": worst("all", whole),
        "error_thinned": worst("thinned", whole),
        "keys": len(keyed["thinned"].regions[0].moves.location.frames),
        "least_confidence": min((sure[f] for f in whole), default=0.0),
        "unseen_but_sure": worst("all", partly),
        "wrong_but_sure": sum(error("all", f) > 2 for f in sure if sure[f] > SURE),
        "stops": [stop["reason"] for stop in report["stops"]],
    }


class Masks:
    """What each way takes for the subject, beside the true masks."""

    def __init__(self, folder: Path, keyed: dict[str, Effect]):
        self._source = open_source(folder / "footage" / "0001.png")
        self._truth = open_source(folder / "mask" / "0001.png")
        self._keyed, self._known = keyed, {}
        self._renderer = Renderer(open_compositor(), self._source)
        self.frames = range(1, self._source.count + 1)

    def overlap(self, way: str) -> dict[str, float]:
        """Intersection over union with the truth: the mean over all frames, and the worst."""
        found = []
        for frame in self.frames:
            taken, true = self.taken(way, frame), self.true(frame)
            found.append((taken & true).sum() / (taken | true).sum())
        return {"mean": round(float(np.mean(found)), 3), "worst": round(float(np.min(found)), 3)}

    def inside(self, way: str) -> float:
        """The mean coefficient inside the true mask."""
        return round(float(np.mean([self.coefficients(way, f)[self.true(f)].mean() for f in self.frames])), 2)

    def true(self, frame: int) -> np.ndarray:
        """Where the subject covers half a pixel or more: a grey of 188 is half of the light."""
        return self._truth.read(frame - 1)[..., 0] >= 188

    def taken(self, way: str, frame: int) -> np.ndarray:
        """The pixels (h, w) bool that a way takes for the subject."""
        if way == "GrabCut":
            return self._grabcut(frame)
        return self.coefficients(way, frame) > 0.5

    def coefficients(self, way: str, frame: int) -> np.ndarray:
        """The subject's coefficient (h, w)."""
        if (way, frame) not in self._known:
            state = self._state("drawn" if way == "without tracking" else "thinned", frame)
            if way == "without edges":
                state = replace(state, options=replace(state.options, edge_aware=0.0))
            share, block = self._renderer.coefficients(Request(frame - 1, state))[1], state.options.aggregate
            share = share.repeat(block, 0).repeat(block, 1)
            self._known[way, frame] = share[: self._source.height, : self._source.width]
        return self._known[way, frame]

    def _grabcut(self, frame: int) -> np.ndarray:
        picture = np.ascontiguousarray(self._source.read(frame - 1)[..., 2::-1])
        labels = self._labels(frame)
        mask = np.choose(labels, (cv2.GC_PR_BGD, cv2.GC_BGD, cv2.GC_FGD)).astype(np.uint8)
        cv2.setRNGSeed(0)
        cv2.grabCut(picture, mask, None, np.zeros((1, 65)), np.zeros((1, 65)), 5, cv2.GC_INIT_WITH_MASK)
        return (mask == cv2.GC_FGD) | (mask == cv2.GC_PR_FGD)

    def _labels(self, frame: int) -> np.ndarray:
        """0 free, 1 the frame's edge, 2 the stroke."""
        size = self._source.width, self._source.height
        return scribbles.rasterise(self._state("thinned", frame).shapes, *size, border=True)

    def _state(self, keys: str, frame: int):
        return self._keyed[keys].for_picture(self._source.width / self._source.height).at(frame)

    def picture(self) -> np.ndarray:
        """A row of each way at four moments: what it takes in colors, the true outline in white."""
        rows = [[(self._shown(frame), f"Frame {frame}") for frame in SHOWN]]
        rows += [[(self._outlined(way, frame), way) for frame in SHOWN] for way in WAYS]
        panels = [stills.row(*(stills.Panel(picture, words) for picture, words in row)) for row in rows]
        return stills.sheet(*panels)

    def _shown(self, frame: int) -> np.ndarray:
        picture = self._source.read(frame - 1)[..., :3] / np.float32(255)
        picture[self._labels(frame) == 2] = 1, 1, 1
        return picture

    def _outlined(self, way: str, frame: int) -> np.ndarray:
        share = self.taken(way, frame) if way == "GrabCut" else self.coefficients(way, frame)
        colors = np.array([shutter.color for shutter in self._keyed["drawn"].shutters], np.float32)
        picture = colors[0] + share[..., None].astype(np.float32) * (colors[1] - colors[0])
        edges, _ = cv2.findContours(self.true(frame).astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        return cv2.drawContours(np.ascontiguousarray(picture), edges, -1, (1.0, 1.0, 1.0), 1)


if __name__ == "__main__":
    main()
