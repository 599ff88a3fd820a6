"""Compares the product with the reference, one random case after the other:

    .venv/bin/python tests/differential/compare.py SEED … [--ways cpu,gpu,blender,film]
        [--mixed | --smooth] [--output DIR]

A picture may be 0.5/255 off, coefficients 1/255. How far a picture is off is the most of any channel of any pixel: in
scene-linear light, or in the codes that a viewer sees (sRGB), whichever is more, both premultiplied; light above 1 in
proportion. Coefficients are judged by themselves, against exact ones. For pictures the reference has the product's:
their tolerance alone moves a picture by more than its own, where shutters that are far apart in time meet in noise.

--mixed: recipes that have every field with every other. What the reference knows nothing of is compared with NumPy's
picture, see check_mixed. --smooth: frames that are moments, of which some were filmed; films have none. A seed may be a
range: 1000:2000.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import traceback
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from cases import Case, make, make_smooth, write, write_image
from OpenImageIO import ImageBuf
from reference import (
    coefficients,
    has_strokes,
    laid,
    layer_mattes,
    layers_at,
    number_at,
    picture,
    shown,
    solved,
    to_encoded,
)

ROOT = Path(__file__).resolve().parents[2]
PICTURE, COEFFICIENTS = 0.5 / 255, 1 / 255
LAYERS = COEFFICIENTS / 0.2 + 1 / 65535  # their contrast is higher, and they are kept as 16 bits
AMPLIFIED = 64


class DifferenceError(AssertionError):
    """The product differs from the reference; the message says where, by how much, and what repeats it."""


def open_devices(names) -> dict:
    """Compositors by name: "cpu" (NumPy), "gpu" (moderngl), "blender" (its own GPU, without a window). What passes
    leave unwritten is seen."""
    from unwritten import filled

    from shutter_addon.compute.gpu import GPUCompositor
    from shutter_addon.compute.renderer import open_compositor

    devices = {name: open_compositor(name) for name in names if name != "blender"}
    if "blender" in names:
        import gpu

        gpu.init()
        from shutter_addon.blender.devices.blender_gpu import BlenderDevice

        devices["blender"] = GPUCompositor(BlenderDevice())
    for compositor in devices.values():
        if isinstance(compositor, GPUCompositor):
            filled(compositor.device)
    return devices


def check(case: Case, devices: dict, folder: Path) -> dict:
    """How far each device is off, as {device: (picture, coefficients)}. DifferenceError: too far; what differs is left
    in the folder."""
    from shutter_addon.compute.renderer import Renderer
    from shutter_addon.core.frames.frame_source import SourceWrapper
    from shutter_addon.media import open_source
    from shutter_addon.media.matte_values import MatteValues

    recipe, found = json.loads(case.recipe), {}
    with tempfile.TemporaryDirectory() as files, SourceWrapper(open_source(write(case, Path(files)))) as source:
        source.step = recipe.get("inbetween", 1)
        footage, asked = case.footage(samples_of(case, source)), asked_of(case, source, Path(files))
        index, direction = shown(recipe, case.frame, source.count) if "time" in recipe else (case.index, case.direction)
        if (index, direction) != (asked.index, asked.direction):
            raise DifferenceError(f"{told(case)}: another source time")
        exact = exact_coefficients(case, source, footage, index)
        layers = exact_layers(case, source, footage, index, direction)
        for name, device in devices.items():
            renderer = Renderer(device, source, MatteValues(source.width, source.height))
            made, mix = renderer.picture(asked), renderer.coefficients(asked)
            own = {frame: renderer.layer_mattes(asked, frame) for frame in layers}
            with device.current():
                renderer.release()
            right = picture(recipe, case.frame, footage, index, direction, mix, layers=own)
            found[name] = judge(case, name, folder, made, right, mix, exact)
            for frame, values in layers.items():
                ours, right = (np.stack(mattes, axis=-1) for mattes in (own[frame], values))
                within(LAYERS, np.abs(ours - right), case, f"{name}-layers", folder, ours, right)
    return found


def is_referable(case: Case) -> bool:
    """Whether the reference knows all that the recipe has: it has no moments between frames, of which the reference
    knows the weights alone, and no estimate of colors."""
    recipe = json.loads(case.recipe)
    return recipe.get("inbetween", 1) == 1 and not ("plate_reach" in recipe and recipe["decontaminate"])


# Wherever rounding decides: a threshold that is not soft, which of two frames is as light, whether anything is left of
# a shutter, or enough of what lies behind layers. There NumPy's own picture changes by more than half of PICTURE as a
# threshold, bars, coefficients, light and opacities change by what is nothing of them.
NUDGE, NUDGES = 2e-6, 16
THRESHOLD = 2e-5
# What running sums lose of a layer's share, which decides whether what lies behind is looked for; and steps of the
# square root of light that is followed (shaders/include/packed.glsl).
SHARES = 2e-4
PACKED = 1 / 2047, 1 / 2047, 1 / 1023
TIES = 0.05  # of a picture's pixels, at most


def check_mixed(case: Case, devices: dict, folder: Path) -> dict:
    """As `check`, of any recipe, and of levels: a GPU's picture against NumPy's of the same coefficients, and these and
    mattes against NumPy's own. Pixels that tie (NUDGE) are left out, few as they are."""
    from shutter_addon.compute.cpu import CPUCompositor
    from shutter_addon.compute.renderer import Renderer
    from shutter_addon.features.smooth.smooth import steps_for
    from shutter_addon.media import open_source
    from shutter_addon.media.cuts import ShotSource
    from shutter_addon.media.matte_values import MatteValues

    recipe = json.loads(case.recipe)
    with tempfile.TemporaryDirectory() as files, open_source(write(case, Path(files))) as medium:
        # Its frames are as many moments for each filmed one.
        source = ShotSource(medium, steps_for(medium, recipe.get("inbetween", 1), recipe["window"]))
        asked = asked_of(case, source, Path(files))
        # Of packed light the reference would have to know what ties.
        exact_ones = {"cpu": devices["cpu"]} if is_packed(asked, source) and "cpu" in devices else devices
        found = check(case, exact_ones, folder) if is_referable(case) else {}

        @contextmanager
        def rendering(compositor):
            renderer = Renderer(compositor, source, MatteValues(source.width, source.height, source.step))
            try:
                yield renderer
            finally:
                renderer.release()

        with rendering(CPUCompositor()) as host:
            picture, exact = host.picture(asked), np.moveaxis(host.coefficients(asked), 0, -1).copy()
            layers = layers_of(host, asked)
        if not np.isfinite(picture).all():
            raise DifferenceError(f"{told(case)}: NumPy's picture has what is no number")
        for name, device in devices.items():
            if name == "cpu":
                continue
            with rendering(device) as renderer:
                made, mix = renderer.picture(asked), renderer.coefficients(asked).copy()
                levels, own = renderer.picture(replace(asked, levels=True)).copy(), layers_of(renderer, asked)
            right = lent_picture(device, rendering, asked)
            stepped = np.abs(levels.astype(int) - CPUCompositor().over_black(right)).max(axis=-1) > 1
            differs = stepped | ~(light_apart(made, right).max(axis=-1) <= PICTURE)
            doubtful = np.zeros(stepped.shape, bool)
            for seed, other in enumerate(nudged(asked)) if differs.any() else ():
                doubtful |= light_apart(lent_picture(device, rendering, other, seed), right).max(axis=-1) > PICTURE / 2
            doubtful &= differs & np.isfinite(made).all(axis=-1)
            if doubtful.mean() > TIES:
                raise DifferenceError(f"{told(case)}: {name}: {doubtful.mean():.0%} of the pixels tie")
            made, stepped = np.where(doubtful[..., None], right, made), stepped & ~doubtful
            mix = np.moveaxis(mix, 0, -1)
            found[name] = (
                within(PICTURE, light_apart(made, right), case, f"{name}-picture", folder, made, right),
                within(COEFFICIENTS, np.abs(mix - exact), case, f"{name}-coefficients", folder, mix, exact),
            )
            within(0, stepped[..., None].astype(float), case, f"{name}-levels", folder, made, right)
            within(LAYERS, np.abs(own - layers), case, f"{name}-layers", folder, own, layers)
    return found


def layers_of(renderer, asked) -> np.ndarray:
    """The mattes (H, W, n) of the layers in the shown frame; none: black."""
    mattes = renderer.layer_mattes(asked)
    return np.stack(mattes, axis=-1) if mattes else np.zeros((1, 1, 1))


def lent_picture(device, rendering, asked, nudge: int | None = None) -> np.ndarray:
    """NumPy's picture of the coefficients that another device has for the same labels; nudge: from a seed, a little."""
    from shutter_addon.compute import cpu

    random = None if nudge is None else np.random.default_rng(nudge)

    class Window(cpu.HostWindow):
        def seen(self, *given):
            frames, moved = super().seen(*given)
            if random is not None:
                frames = [nudged_light(frame, asked, self.source, random) for frame in frames]
            return frames, moved

    class Lent(cpu.CPUCompositor):
        def __init__(self):
            self._own = device.stages()

        def window(self, source, *_size):
            return Window(source)

        def stages(self):
            return Lent()

        def solve(self, labels, count, *guide, **_how):
            with device.current():
                found = np.array(device.coefficients(self._own.solve(labels, count, *guide), count))
            if random is not None:
                found += random.random(found.shape, np.float32) * NUDGE
            return found

        def release(self):
            with device.freeing():
                self._own.release()

    with rendering(Lent()) as renderer:
        return renderer.picture(asked)


def is_packed(asked, source) -> bool:
    """Whether GPUs keep the square root of the light that follows something, in 10 or 11 bits."""
    is_plain = source.dtype == np.uint8 and source.alpha == "opaque"
    return asked.state.following is not None and is_plain and asked.state.options.light == "linear"


def nudged_light(frame, asked, source, random):
    """A frame (H, W, 4) of linear light, with what a device may lose of it."""
    noise = random.uniform(-1, 1, frame[..., :3].shape)
    found, nudged_ = frame.copy(), frame[..., :3] * (1 + NUDGE * noise)
    if is_packed(asked, source):
        nudged_ = (np.sqrt(np.maximum(nudged_, 0)) + noise * PACKED) ** 2
    found[..., :3] = nudged_
    return found


def nudged(asked):
    for seed in range(NUDGES):
        state, way = asked.state, (-1) ** seed
        bars = state.bars * (1 + NUDGE * np.random.default_rng(seed).normal(size=state.bars.shape))
        combines = tuple(
            each if each.threshold is None else replace(each, threshold=each.threshold + way * THRESHOLD)
            for each in state.combines
        )
        layers = state.layers
        if layers is not None:
            layers = replace(layers, opacities=tuple(opacity * (1 + way * SHARES) for opacity in layers.opacities))
        yield replace(asked, state=replace(state, bars=bars, combines=combines, layers=layers))


def asked_of(case: Case, source, folder: Path):
    """The Request for the case's frame, as a render session makes it."""
    from gallery.matte_contents import with_contents
    from shutter_addon.compute.request import Request
    from shutter_addon.core.frames.retiming import StripTiming
    from shutter_addon.core.model.clip import Clip
    from shutter_addon.core.model.state_at import state_at
    from shutter_addon.core.recipes import recipe_file

    recipe = recipe_file.parse(case.recipe)
    effect = with_contents(recipe.for_picture(source.width / source.height), partial(matte_file, folder, source))
    way = case.direction * case.index / source.step
    # Where it plays backward, its content ends there.
    content = {"content_start": case.frame - way, "content_end": case.frame - way + 1}
    trimmed = {"content_trim_start": 0, "content_trim_end": 0, "left_handle": 1}
    common = {"name": "Footage", "first": 0, "scene_fps": 24.0, "strobe": 1.0}
    timing = StripTiming(use_reverse_frames=case.direction < 0, **content, **trimmed, **common)
    clip = Clip(width=source.width, height=source.height, count=source.count, step=source.step, timing=timing)
    return Request(*state_at(effect, clip, case.frame))


def solving(case: Case, source):
    """A function that gives the exact coefficients of labels in a source frame at a time; along edges the core's own,
    of the guide that the product has, as that is no matter of precision."""
    import exact_diffusion

    from shutter_addon.compute.guide import Guides, guiding

    recipe = json.loads(case.recipe)

    def solve(labels, count, frame, time):
        strength = number_at(recipe.get("edge_aware", 0), time)
        if not strength:
            return solved(labels, count)
        guide = Guides(source).guide(guiding(frame, 1, range(source.count)), recipe["aggregate"])
        return exact_diffusion.solve(labels + 1, count, guide, strength)

    return solve


def exact_layers(case: Case, source, footage, index: int, direction: int) -> dict:
    """The reference's mattes of layers, by source frame, where there are any."""
    recipe = json.loads(case.recipe)
    if not layers_at(recipe, case.frame):
        return {}
    asked = recipe, case.frame, footage, index, direction, case.matte_samples()
    return layer_mattes(*asked, solving(case, source))


def matte_file(folder: Path, source, region):
    """What the product reads for a matte region of a recipe in that folder, or for the luminance of its source."""
    from shutter_addon.media.opening import MatteFile

    content = region.content
    return MatteFile(folder / content.path, content.channel) if hasattr(content, "path") else MatteFile(source.path)


def exact_coefficients(case: Case, source, footage, index: int) -> np.ndarray:
    recipe, solve = json.loads(case.recipe), solving(case, source)
    size = source.width, source.height
    mix = coefficients(recipe, case.frame, *size, lambda labels, count: solve(labels, count, index, case.frame))
    return laid(recipe, case.frame, index, mix, footage, case.matte_samples())


def check_films(cases: list[Case], folder: Path) -> tuple[dict, list[DifferenceError]]:
    """How far the frames are off that the command renders through Blender's sequencer, from footage that runs forward:
    {seed: (picture, coefficients)}, and what is too far off."""
    from shutter_addon.media import open_source

    found, errors = {}, []
    with tempfile.TemporaryDirectory() as files:
        places = [Path(files) / str(case.seed) for case in cases]
        commands = [film(case, place) for case, place in zip(cases, places, strict=True)]
        render(commands)
        for case, place, (_, footage_path, *_) in zip(cases, places, commands, strict=True):
            recipe, footage = json.loads(case.recipe), case.footage()
            made, mix = (read_image(place / kind / f"{case.frame:04d}.exr") for kind in ("film", "weights"))
            made = np.stack([made.get(name, np.ones_like(made["R"])) for name in "RGBA"], axis=-1)
            mix = np.stack([mix[shutter["name"]] for shutter in recipe["shutters"]])
            index, direction = shown(recipe, case.frame, len(footage.samples))
            right = picture(recipe, case.frame, footage, index, direction, mix, case.matte_samples())
            try:
                with open_source(Path(footage_path)) as source:
                    exact = exact_coefficients(case, source, footage, index)
                found[case.seed] = judge(case, "film", folder, made, right, mix, exact)
            except DifferenceError as error:
                errors.append(error)
    return found, errors


def can_be_a_film(case: Case) -> bool:
    """Blender renders no picture smaller than 4×4. And of lossy footage, what was decoded is not known here, nor the
    mattes that were solved for: layers amplify what they may be off."""
    recipe = json.loads(case.recipe)
    solves = any(has_strokes(region) for region, _ in layers_at(recipe, case.frame))
    return min(case.stored.shape[1:3]) >= 4 and not case.kind.is_lossy and not solves


def film(case: Case, place: Path) -> list[str]:
    place.mkdir()
    # Noise may well look like a cut.
    (place / "recipe.json").write_text(json.dumps(json.loads(case.recipe) | {"stop_at_cuts": False}))
    options = ["--recipe", place / "recipe.json", "--output", place / "film", "--format", "exr"]
    options += ["--weights", place / "weights", "--frames", case.frame]
    return ["render", *map(str, [write(case, place), *options])]


def render(films: list[list[str]]) -> None:
    command = [sys.executable, Path(__file__).with_name("films.py")]
    done = subprocess.run(command, input=json.dumps(films), capture_output=True, text=True, check=False)
    if done.returncode:
        raise DifferenceError(f"films were not rendered: {done.stdout[-2000:]}{done.stderr[-2000:]}")


def read_image(path: Path) -> dict:
    image = ImageBuf(str(path))
    return dict(zip(image.spec().channelnames, np.moveaxis(image.get_pixels(), -1, 0), strict=True))


def samples_of(case: Case, source) -> np.ndarray:
    """The samples that the reference gets: those that were written, but for a movie with loss. DifferenceError: they
    are not read as they were written."""
    read = np.stack([source.read(i) for i in range(source.count)])
    if case.kind.is_lossy:
        return read
    taken_for = source.transfer, source.alpha, str(source.dtype)
    if taken_for != (case.kind.transfer, case.kind.alpha, case.kind.samples) or not np.array_equal(read, case.stored):
        raise DifferenceError(f"{told(case)}: the footage is not read as it was written")
    return case.stored


def judge(case: Case, way: str, folder: Path, made, right, mix, exact) -> tuple[float, float]:
    """How far a picture is off from the reference's Result, and coefficients from exact ones."""
    made = np.where(right.doubtful[..., None], right.picture, made)
    mix, exact = np.moveaxis(mix, 0, -1), np.moveaxis(exact, 0, -1)
    return (
        within(PICTURE, light_apart(made, right.picture), case, f"{way}-picture", folder, made, right.picture),
        within(COEFFICIENTS, np.abs(mix - exact), case, f"{way}-coefficients", folder, mix, exact),
    )


def light_apart(made, right) -> np.ndarray:
    """How far pictures (H, W, 4) are apart, as codes where that is more."""
    codes = [to_encoded(values[..., :3].astype(float)) for values in (made, right)]
    apart = np.abs(made - right)
    apart[..., :3] = np.maximum(apart[..., :3], np.abs(codes[0] - codes[1]))
    return apart / np.maximum(1, np.abs(right))


def within(tolerance: float, apart, case: Case, what: str, folder: Path, made, right) -> float:
    """The most that arrays (H, W, channels) are apart."""
    most = float(apart.max())  # NaN, where anything is
    if most <= tolerance:
        return most
    place = folder / f"{case.seed}-{what}"
    place.mkdir(parents=True, exist_ok=True)
    write_image(place / "made.exr", made.astype(np.float32))
    write_image(place / "right.exr", right.astype(np.float32))
    amplified = np.rint(np.clip(np.nan_to_num(apart[..., :3], nan=1) * AMPLIFIED, 0, 1) * 255).astype(np.uint8)
    write_image(place / f"difference-x{AMPLIFIED}.png", amplified.repeat(8, 0).repeat(8, 1))
    (place / "recipe.json").write_text(case.recipe, encoding="utf-8")
    y, x, channel = np.unravel_index(np.nan_to_num(apart, nan=np.inf).argmax(), apart.shape)
    raise DifferenceError(
        f"{told(case)}: {what} {255 * most:.3g}/255 off at row {y}, column {x}, channel {channel}: "
        f"{made[y, x, channel]:.6g} instead of {right[y, x, channel]:.6g}; pictures in {place}\n    "
        f".venv/bin/python {Path(__file__).relative_to(ROOT)} {case.seed} --ways {what.partition('-')[0]}{case.again}"
    )


def told(case: Case) -> str:
    return f"seed {case.seed}, frame {case.frame}, {case.kind.name}"


def seeds_of(text: str) -> range:
    first, _, stop = text.partition(":")
    return range(int(first), int(stop) if stop else int(first) + 1)


def main() -> int:
    parser = argparse.ArgumentParser(description="Compares pictures and coefficients of random recipes.")
    parser.add_argument("seeds", type=seeds_of, nargs="+", metavar="SEED")
    kinds = parser.add_mutually_exclusive_group()
    kinds.add_argument("--mixed", action="store_true", help="recipes that have every field with every other")
    kinds.add_argument("--smooth", action="store_true", help="frames that are moments, of which some were filmed")
    parser.add_argument("--ways", default="cpu,gpu", help="of cpu, gpu, blender, film (default: cpu,gpu)")
    output = ROOT / "out" / "differential"
    parser.add_argument("--output", type=Path, default=output, metavar="DIR", help="for pictures")
    arguments = parser.parse_args()
    ways = arguments.ways.split(",")
    devices, failed = open_devices([way for way in ways if way != "film"]), False
    made = make_smooth if arguments.smooth else partial(make, mixed=arguments.mixed)
    for case in (made(seed) for seeds in arguments.seeds for seed in seeds):
        try:
            found = (check_mixed if arguments.mixed else check)(case, devices, arguments.output)
            if "film" in ways and not arguments.smooth and can_be_a_film(case):
                films, errors = check_films([case], arguments.output)
                found["film"] = films.get(case.seed)
                for error in errors:
                    raise error
            print(f"{told(case)}:", *(f"{way} {255 * p:.3f} {255 * c:.3f}" for way, (p, c) in found.items()))
        except DifferenceError as error:
            print(error, flush=True)
            failed = True
        except Exception:
            print(f"{told(case)}: {traceback.format_exc()}", flush=True)
            failed = True
    return failed


if __name__ == "__main__":
    sys.path[:0] = str(ROOT), str(ROOT / "tests")
    sys.exit(main())
