"""Random recipes over tiny footage of many kinds, each from a seed alone; knows nothing of the product."""

import json
from dataclasses import dataclass, replace
from fractions import Fraction

import av
import numpy as np
from OpenImageIO import ImageOutput, ImageSpec
from reference import Footage, time_at

SIZES = (48, 27), (23, 17), (31, 20), (37, 23), (9, 33), (40, 7), (2, 2)
# What a movie has is even: Blender's codecs want it.
EVEN = (48, 28), (24, 18), (10, 34)


@dataclass(frozen=True)
class Kind:
    """How footage is stored, and what the manual says of such files."""

    name: str
    samples: str  # NumPy's type
    transfer: str = "srgb"
    alpha: str = "opaque"
    codec: str | None = None  # of a movie, and the format of its pixels
    pixels: str = ""

    @property
    def is_lossy(self) -> bool:
        return self.codec == "prores_ks"


KINDS = (
    Kind("rgb8.png", "uint8"),
    Kind("rgba8.png", "uint8", alpha="straight"),
    Kind("rgba16.png", "uint16", alpha="straight"),
    Kind("soft16.tif", "uint16", alpha="premultiplied"),
    Kind("float.tif", "float32", alpha="straight"),
    Kind("half.exr", "float16", "linear", "premultiplied"),
    Kind("float.exr", "float32", "linear", "premultiplied"),
    Kind("opaque.exr", "float16", "linear"),
    Kind("ffv1.mkv", "uint8", codec="ffv1", pixels="bgr0"),
    Kind("deep.mkv", "uint16", codec="ffv1", pixels="rgb48le"),
    Kind("alpha.mov", "uint8", alpha="straight", codec="png", pixels="rgba"),
    Kind("soft.mov", "uint16", alpha="premultiplied", codec="png", pixels="rgba64be"),
    Kind("prores.mov", "uint16", alpha="premultiplied", codec="prores_ks", pixels="yuva444p10le"),
)


@dataclass(frozen=True)
class Case:
    """A recipe (JSON), the timeline frame to be shown, and footage: arrays (count, H, W, 4) as they are stored.

    mattes: those that the recipe reads, by path, as the footage
    index, direction: the source frame where the recipe has no time keys, and whether the source runs backward
    again: what compare.py has to be told beside the seed to make the case"""

    seed: int
    recipe: str
    frame: int
    kind: Kind
    stored: np.ndarray
    index: int
    direction: int
    mattes: dict[str, np.ndarray]
    again: str = ""

    def footage(self, stored=None) -> Footage:
        """As the reference has it."""
        stored = self.stored if stored is None else stored
        scale = np.iinfo(stored.dtype).max if stored.dtype.kind == "u" else 1
        levels = scale if stored.dtype.kind == "u" else None
        return Footage(stored.astype(float) / scale, self.kind.transfer, self.kind.alpha, levels)

    def matte_samples(self) -> dict[str, np.ndarray]:
        """As the reference has them: 0 … 1."""
        scales = {path: np.iinfo(m.dtype).max if m.dtype.kind == "u" else 1 for path, m in self.mattes.items()}
        return {path: matte.astype(float) / scales[path] for path, matte in self.mattes.items()}


def make(seed: int, mixed: bool = False) -> Case:
    """The case of a seed. mixed: its recipe has every field with every other, of some of which the reference knows
    nothing."""
    rng = np.random.default_rng(seed)
    kind = KINDS[seed % len(KINDS)]
    sizes = EVEN if kind.codec else SIZES
    width, height = sizes[rng.integers(len(sizes))]
    count = int(rng.choice([2, 5, 9, 14])) if kind.codec else int(rng.choice([1, 2, 5, 9, 14]))
    recipe = random_recipe(rng, count)
    if kind.is_lossy:  # which leaves light where there is no cover, and that has no code
        recipe["light"] = "linear"
    frame = int(rng.integers(1, count + 1))
    add_motion(np.random.default_rng([seed, 1]), recipe, count)
    mattes = add_mattes(np.random.default_rng([seed, 2]), recipe, (count, height, width))
    add_layers(np.random.default_rng([seed, 3]), recipe)
    add_outlines(np.random.default_rng([seed, 4]), recipe, count)
    add_combining(np.random.default_rng([seed, 5]), recipe, count, mixed)
    # A trail that is longer than the clip slides after it has its length: of that, this is no reference.
    slides = mixed or not any("trail" in each for each in recipe["shutters"])
    if np.random.default_rng([seed, 6]).random() < 0.25 and slides:
        recipe["edges"] = "slide"
    if mixed:
        add_others(np.random.default_rng([seed, 7]), recipe, count)
    if "time" in recipe:
        # Halfway between two source frames nobody can tell which is shown.
        last = max(count, int(recipe["time"][-1]["frame"]))
        is_clear = {f: abs(time_at(recipe, f) % 1 - 0.5) > 1e-3 for f in range(1 - 5 * 24, last + 5 * 24 + 1)}
        clear = [f for f in range(1, last + 1) if is_clear[f]]
        if follows(recipe) or "plate_reach" in recipe:
            reach = 4 * recipe["window"] + recipe.get("plate_reach", 0)
            clear = [f for f in clear if all(is_clear[g] for g in range(f - reach, f + reach + 1))]
        if clear:
            frame = int(rng.choice(clear))
        else:
            del recipe["time"]
    uncovered = recipe["light"] == "linear"
    stored = random_footage(rng, kind, (count, height, width), uncovered)
    direction = -1 if rng.random() < 0.25 else 1
    if mixed and kind.samples.startswith("uint") and rng.random() < 0.3:
        stored[int(rng.integers(count)) :, ..., :3] //= 8  # a cut
    again = " --mixed" if mixed else ""
    return Case(
        seed, json.dumps(recipe, indent=1), frame, kind, stored, int(rng.integers(count)), direction, mattes, again
    )


def make_smooth(seed: int) -> Case:
    """The case of a seed whose frames are moments, of which some were filmed. Its recipe has nothing that goes by time
    or by place: of these, this is no reference."""
    case, rng = make(seed), np.random.default_rng([seed, 8])
    recipe = json.loads(case.recipe)
    for name in ("time", "camera", "edge_aware", "plate_reach", "decontaminate"):
        recipe.pop(name, None)
    recipe["regions"] = [region for region in recipe["regions"] if region["kind"] in ("line", "lasso", "outline")]
    for each in (*recipe["shutters"], *recipe["regions"]):
        for name in ("follow", "trail", "layer", "combine", "by_luminance", "threshold", "softness"):
            each.pop(name, None)
    recipe["inbetween"] = int(choose(rng, 2, 4, 8)) if recipe["window"] <= 11 else 2
    add_combining(rng, recipe, len(case.stored), mixed=True)
    direction = -1 if rng.random() < 0.4 else 1
    last = (len(case.stored) - 1) // recipe["inbetween"] * recipe["inbetween"]  # the last filmed frame
    own = {"recipe": json.dumps(recipe, indent=1), "stored": case.stored[: last + 1], "index": min(case.index, last)}
    return replace(case, direction=direction, mattes={}, again=" --smooth", **own)


# Recipes


def follows(recipe: dict) -> bool:
    return any("follow" in shutter for shutter in recipe["shutters"])


def add_motion(rng, recipe: dict, count: int) -> None:
    """What shutters follow and how far, in most recipes, and edges of the footage that regions keep to."""
    for i, region in enumerate(recipe["regions"]):
        region["name"] = f"R{i}"
    if rng.random() < 0.2:
        recipe["edge_aware"] = choose(rng, 1.0, round(rng.random(), 3), random_numbers(rng, count, 1))
    if rng.random() < 0.4:
        return
    keyed = sorted({-4, *frames(rng, count, 6), count + 6})  # so that it moves all the time
    recipe["camera"] = [random_camera_key(rng, frame) for frame in keyed]
    moving = ["camera", "camera", *(region["name"] for region in recipe["regions"] if "keys" in region)]
    for shutter in recipe["shutters"]:
        if rng.random() < 0.8:
            shutter["follow"] = choose(rng, *moving)
            if rng.random() < 0.4:
                shutter["trail"] = choose(rng, 0.0, round(rng.uniform(0, 0.5), 4), random_numbers(rng, count, 0.8))


def add_mattes(rng, recipe: dict, shape) -> dict[str, np.ndarray]:
    """Mattes and ramps among the regions, in some recipes; what they read, by path."""
    if rng.random() < 0.6:
        return {}
    (count, height, width), found = shape, {}
    for number in range(int(rng.integers(1, 4))):
        region = {"name": f"M{number}", "shutter": choose(rng, *recipe["shutters"])["name"]}
        if rng.random() < 0.5:
            path, found_frames = random_matte(rng, number, (int(choose(rng, 1, 3, count)), height, width))
            region |= {"kind": "matte", "path": path, "channel": choose(rng, "luminance", "red", "blue", "alpha")}
            region |= {"timing": choose(rng, "source", "timeline"), "offset": int(rng.integers(-2, 3))}
            found[path] = found_frames
        else:
            region |= {"kind": "ramp", "ramp": choose(rng, "linear", "radial", "angle", "luminance")}
        if rng.random() < 0.5:
            region["keys"] = [random_camera_key(rng, frame) for frame in frames(rng, count, 3)]
        region |= {"blend": choose(rng, "over", "over", "add"), "invert": choose(rng, False, True)}
        region["opacity"] = choose(rng, 1, round(rng.random(), 3), random_numbers(rng, count, 1))
        region["width"] = choose(rng, 0, 0, round(rng.uniform(0, 0.3), 3), random_numbers(rng, count, 0.2))
        recipe["regions"].insert(int(rng.integers(len(recipe["regions"]) + 1)), region)
        if rng.random() < 0.2:
            choose(rng, *recipe["shutters"]).update(follow=region["name"])
    return found


def add_layers(rng, recipe: dict) -> None:
    """Some regions are exposed by themselves, in two of five recipes."""
    if rng.random() < 0.55 or not recipe["regions"]:  # there may be no region
        return
    for _ in range(int(choose(rng, 1, 1, 2))):
        choose(rng, *recipe["regions"])["layer"] = True
    recipe["plate_reach"] = int(choose(rng, 0, 1, 4))
    recipe["decontaminate"] = False  # an estimate, which has a test of its own


def add_outlines(rng, recipe: dict, count: int) -> None:
    """What curves enclose, which go straight from drawing to drawing, in a quarter of the recipes."""
    if rng.random() < 0.75:
        return
    region = {"name": "O", "shutter": choose(rng, *recipe["shutters"])["name"], "kind": "outline"}
    region |= {"between": "straight", "strokes": random_strokes(rng, "lasso")}
    if rng.random() < 0.6:
        region["keys"] = [random_key(rng, "lasso", frame) for frame in frames(rng, count, 3)]
    region |= {"blend": choose(rng, "over", "add"), "invert": choose(rng, False, True)}
    region["opacity"] = choose(rng, 1, round(rng.random(), 3), random_numbers(rng, count, 1))
    region["width"] = choose(rng, 0, 0, round(rng.uniform(0, 0.3), 3))
    if "plate_reach" in recipe:  # others are layers
        region["layer"] = choose(rng, False, True)
    recipe["regions"].insert(int(rng.integers(len(recipe["regions"]) + 1)), region)
    if rng.random() < 0.2:
        choose(rng, *recipe["shutters"]).update(follow="O")


def add_combining(rng, recipe: dict, count: int, mixed: bool) -> None:
    """Shutters that make something else than an average of their frames, where none follows and there are no layers, or
    in mixed recipes."""
    if (not mixed and (follows(recipe) or "plate_reach" in recipe)) or rng.random() < (0.35 if mixed else 0.1):
        return
    for shutter in recipe["shutters"]:
        if (way := choose(rng, "average", "lightest", "darkest", "median")) == "average":
            continue
        shutter["combine"] = way
        if way == "median":
            continue
        if rng.random() < 0.5:
            shutter["by_luminance"] = True
        if rng.random() < 0.8:
            shutter["threshold"] = choose(rng, round(rng.random(), 3), random_numbers(rng, count, 1))
            shutter["softness"] = choose(rng, 0.0, round(rng.uniform(0.05, 0.5), 3), 0.2)


def add_others(rng, recipe: dict, count: int) -> None:
    """What the reference knows nothing of: how motion is followed, lengths on the timeline, opacities of scribbles,
    equal names, moments between frames, colors of edges."""

    def share():
        return choose(rng, 1, 0, round(rng.random(), 3), random_numbers(rng, count, 1))

    for shutter in recipe["shutters"]:
        if "follow" in shutter:
            shutter["follow_motion"] = choose(rng, "location", "rotation", "scale")
            shutter["follow_smooth"] = int(choose(rng, 0, 0, 1, 3))
        if "trail" not in shutter:
            shutter["length"] = choose(rng, "bars", "bars", "timeline")
    if "camera" in recipe:
        recipe["camera_influence"] = share()
    followed = {shutter.get("follow") for shutter in recipe["shutters"]}
    for region in recipe["regions"]:
        if region["kind"] in ("line", "lasso"):
            region["opacity"] = share()
        if region["name"] not in followed and rng.random() < 0.5:
            region["name"] = choose(rng, "", "same")
    recipe["inbetween"] = choose(rng, 1, 1, 1, 2, 4, "auto")
    if "decontaminate" in recipe:
        recipe["decontaminate"] = choose(rng, False, True)


def random_matte(rng, number: int, shape) -> tuple[str, np.ndarray]:
    """A matte's path, and its frames (count, H, W, 4) as they are stored."""
    ending, kind = choose(rng, ("png", np.uint8), ("png", np.uint16), ("exr", np.float16))
    values = rng.random((*shape, 4)) * 1.2 - 0.1
    if kind != np.float16:
        values = np.rint(values.clip(0, 1) * np.iinfo(kind).max)
    return f"mattes/{number}/0001.{ending}", values.astype(kind)


def random_numbers(rng, count: int, most: float) -> list[dict]:
    return [{"frame": f, "value": round(rng.uniform(0, most), 4), **ease(rng)} for f in frames(rng, count, 3)]


def random_camera_key(rng, frame: int) -> dict:
    key = {"frame": frame, "location": rounded(rng.normal(0, 0.15, 2)), **ease(rng)}
    if rng.random() < 0.5:
        key |= {"rotation": round(rng.normal(0, 20), 3), "scale": round(rng.uniform(0.7, 1.4), 4)}
    return key


def choose(rng, *options):
    return options[rng.integers(len(options))]


def rounded(values):
    return np.round(values, 5).tolist()


OPTIONS = {"position": ("start", "center", "end"), "interpolation": ("displacement", "displacement", "value")}
OPTIONS |= {
    "light": ("linear", "encoded"),
    "exposure": ("normalized", "weighted"),
    "edges": ("hold", "mirror", "shorten"),
}
OPTIONS |= {"aggregate": (1, 1, 2, 4), "border": (False, True), "stop_at_cuts": (False, True)}


def random_recipe(rng, count: int) -> dict:
    window = int(choose(rng, 1, 2, 3, 4, 6, 8, 8, 11, 16, 24))
    names = ["Default", "B", "ü", "D d", "E", "F"][: choose(rng, 1, 2, 2, 3, 3, 4, 5, 6)]
    scale = choose(rng, 1, 1, 0.01, 50)
    recipe = {"version": 2, "window": window} | {name: choose(rng, *each) for name, each in OPTIONS.items()}
    recipe["shutters"] = [random_shutter(rng, name, window, count, scale) for name in names]
    recipe["regions"] = [random_region(rng, names, count) for _ in range(rng.integers(0, 7))]
    if rng.random() < 0.4:
        recipe["time"] = random_time(rng, count)
    return recipe


def random_time(rng, count: int) -> list[dict]:
    """Keys of the source time: forward, backward, in jumps and standing still."""
    places = sorted(rng.choice(np.arange(-1, count + 8), int(rng.integers(1, 5)), replace=False).tolist())
    values = rng.uniform(-1, count + 2, len(places))
    for k in range(1, len(values)):
        if rng.random() < 0.25:
            values[k] = values[k - 1]
    return [{"frame": f, "value": v, **ease(rng)} for f, v in zip(places, rounded(values), strict=True)]


def ease(rng) -> dict:
    found = choose(rng, None, "linear", "bezier", "bezier", "constant")
    return {"ease": found} if found else {}


def frames(rng, count: int, most: int) -> list[int]:
    return sorted(rng.choice(np.arange(-3, count + 6), int(rng.integers(1, most + 1)), replace=False).tolist())


def random_bars(rng, window: int) -> np.ndarray:
    """Bars (window,) that are open for 0.1 frames at least: "weighted", others are then 240 times as bright."""
    bars = choose(rng, rng.random(window), np.ones(window), np.zeros(window), rng.random(window) ** 6)
    bars = bars * (rng.random(window) > choose(rng, 0, 0, 0.5))
    if bars.sum() < 0.1:
        bars[rng.integers(window)] = rng.uniform(0.1, 1)
    return bars


def random_shutter(rng, name: str, window: int, count: int, scale: float) -> dict:
    def bars():
        return rounded(scale * random_bars(rng, window))

    shutter = {"name": name, "color": rounded(rng.random(3))}
    if rng.random() < 0.5:
        return shutter | {"bars": bars()}
    return shutter | {"keys": [{"frame": f, "bars": bars(), **ease(rng)} for f in frames(rng, count, 4)]}


def random_stroke(rng, at_least: int) -> list:
    steps = rng.normal(0, choose(rng, 0.05, 0.2, 0.5), (rng.integers(at_least, 7), 2))
    return rounded(rng.random(2) + np.cumsum(steps, axis=0))


def random_strokes(rng, kind: str) -> list:
    at_least = 3 if kind == "lasso" else choose(rng, 1, 2, 2)
    return [random_stroke(rng, at_least) for _ in range(choose(rng, 1, 1, 2, 3))]


def random_region(rng, names: list[str], count: int) -> dict:
    kind = choose(rng, "line", "lasso")
    region = {"name": "R", "shutter": choose(rng, *names), "kind": kind, "strokes": random_strokes(rng, kind)}
    if rng.random() < 0.8:
        region["width"] = round(float(choose(rng, 0, 0.02, rng.uniform(0, 0.1), rng.uniform(0, 0.5))), 5)
    if rng.random() < 0.5:
        region["keys"] = [random_key(rng, kind, f) for f in frames(rng, count, 4)]
    return region


def random_key(rng, kind: str, frame: int) -> dict:
    key = {"frame": frame, **ease(rng)}
    if rng.random() < 0.6:
        key["location"] = rounded(rng.normal(0, 0.2, 2))
    if rng.random() < 0.6:
        key["rotation"] = round(rng.uniform(-400, 400), 3)
    if rng.random() < 0.6:
        key["scale"] = round(rng.uniform(0.3, 2), 4)
    if rng.random() < 0.4:
        key["strokes"] = random_strokes(rng, kind)
    return key


# Footage


def random_footage(rng, kind: Kind, shape, uncovered: bool) -> np.ndarray:
    """Frames (count, H, W, 4) as they are stored: half noise and half gradients that move, with black, white and, where
    the type holds it, more than white, less than black, and colors above their alpha.

    uncovered: with light where premultiplied alpha is 0."""
    count, height, width = shape
    n, y, x = np.meshgrid(np.arange(count), np.arange(height), np.arange(width), indexing="ij")
    waves = 0.5 + 0.5 * np.sin(rng.uniform(0.2, 0.6) * x + rng.uniform(0.2, 0.6) * y + rng.uniform(0.3, 2) * n)
    values = np.where(x < width // 2, rng.random((4, *shape)), waves + 0.1 * rng.normal(size=(4, *shape)))
    values = np.moveaxis(values, 0, -1)
    colour, alpha = values[..., :3], values[..., 3:].clip(0, 1)
    colour[rng.random(shape) < 0.05] = 0
    colour[rng.random(shape) < 0.05] = 1
    is_float = kind.samples.startswith("float")
    if is_float:
        colour = (1.2 * colour) ** 3 - 0.02
        # Codes of 4 are a light of 30.
        colour[rng.random(shape) < 0.02] *= choose(rng, 4, 20) if kind.transfer == "linear" else 2
    else:
        colour = colour.clip(0, 1)
    alpha[rng.random(shape) < 0.1] = 0
    alpha[rng.random(shape) < 0.2] = 1
    if kind.alpha == "opaque":
        alpha = np.ones_like(alpha)
    elif kind.alpha == "premultiplied":
        # Soft edges: straight colors of up to 6; below, nobody paints.
        alpha = np.where(alpha < 0.04, 0, alpha)
        colour = np.clip(colour, -6 * alpha, np.where(alpha > 0, 6 * alpha, 0.5) if uncovered else 6 * alpha)
        alpha = alpha if is_float else np.round(alpha * 65535) / 65535
    stored = np.concatenate([colour, alpha], axis=-1)
    if is_float:
        return stored.astype(kind.samples)
    return np.rint(stored.clip(0, 1) * np.iinfo(kind.samples).max).astype(kind.samples)


def write_mattes(case: Case, folder):
    for path, matte in case.mattes.items():
        first = folder / path
        first.parent.mkdir(parents=True)
        for i, frame in enumerate(matte, start=1):
            write_image(first.with_stem(f"{i:04d}"), frame)


def write(case: Case, folder):
    """Writes the case's footage and mattes into a folder; the movie, or the first file of the images."""
    write_mattes(case, folder)
    if case.kind.codec:
        return write_movie(case, folder / case.kind.name)
    for i, frame in enumerate(case.stored, start=1):
        path = folder / f"{i:04d}{case.kind.name[case.kind.name.rindex('.') :]}"
        write_image(path, frame[..., :3] if case.kind.alpha == "opaque" else frame)
    return path.with_stem("0001")


def write_image(path, array):
    height, width, channels = array.shape
    names = {"float16": "half", "float32": "float"}
    spec = ImageSpec(width, height, channels, names.get(str(array.dtype), str(array.dtype)))
    spec.attribute("oiio:UnassociatedAlpha", int(path.suffix != ".exr"))  # the samples as they are
    output = ImageOutput.create(str(path))
    assert output.open(str(path), spec), output.geterror()
    assert output.write_image(np.ascontiguousarray(array)), output.geterror()
    output.close()


def write_movie(case: Case, path):
    whole = {"uint8": "rgba", "uint16": "rgba64le"}[case.kind.samples]
    with av.open(str(path), "w") as out:
        stream = out.add_stream(case.kind.codec, rate=25)
        stream.height, stream.width = case.stored.shape[1:3]
        stream.pix_fmt = case.kind.pixels
        for time, array in enumerate(case.stored):
            frame = av.VideoFrame.from_ndarray(array, format=whole)
            frame.pts, frame.time_base = time, Fraction(1, 25)
            out.mux(stream.encode(frame.reformat(format=case.kind.pixels, threads=1)))
        out.mux(stream.encode())
    return path
