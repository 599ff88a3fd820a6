"""Recipes: valid ones of all features, and of every field with every other, with values, structure and bytes made
wrong; rendered, and composed by both devices."""

import json
import sys
from dataclasses import replace

import numpy as np

from . import hostile, trial

SIZE = 20, 12
REFERABLE = 300  # bars of all shutters, up to which the reference takes no minutes
CHANNELS = "luminance", "red", "green", "blue", "alpha"  # of all its footage
OPENEXR = b"\x76\x2f\x31\x01"  # what its files begin with
FOOTAGE = (
    {"dtype": "uint8"},
    {"dtype": "uint8", "alpha": "straight"},
    {"dtype": "uint16", "alpha": "premultiplied"},
    {"dtype": "float16", "alpha": "premultiplied", "transfer": "linear"},
    {"dtype": "float32", "alpha": "straight"},
)


def make(random, folder):
    import cases
    from support import write_frames

    write_frames(folder / "in", np.random.default_rng(0).integers(0, 256, (4, *SIZE[::-1], 3), dtype=np.uint8))
    hostile.outside(folder)
    plan = {"footage": random.choice(FOOTAGE), "direction": random.choice((1, -1))}
    seed, mixed = random.getrandbits(31), random.random() < 0.5
    case = cases.make(seed, mixed=mixed)
    cases.write_mattes(case, folder)
    if mixed:
        plan["seed"] = seed
    data = json.loads(case.recipe)
    text = hostile.as_json(hostile.spoiled(random, data, random.choice((0, 0, 1, 1, 1, 2, 5))))
    (folder / "recipe.json").write_bytes(hostile.damaged(random, text) if random.random() < 0.1 else text)
    (folder / "plan.json").write_text(json.dumps(plan))


def run(folder):
    from made_recipes import comes_back

    from shutter_addon.core.model.effect import FileContent
    from shutter_addon.core.recipes import recipe, recipe_file

    with trial.only(recipe.RecipeError):
        found = recipe_file.load(folder / "recipe.json")
        if not comes_back(found):
            raise trial.Fault("a recipe does not come back as it was")
        contents = [getattr(region, "content", None) for region in found.regions]
        if any(isinstance(content, FileContent) and content.channel not in CHANNELS for content in contents):
            render(folder, 2)  # no such channel
            return
        render(folder, 0)
        plan = json.loads((folder / "plan.json").read_text())
        compose(found, plan, folder)
        if "seed" in plan:
            compose_mixed(found, plan["seed"], folder / "out")
        return
    render(folder, 2)


def render(folder, expected: int):
    options = ["--recipe", folder / "recipe.json", "--frames", "1:2", "--weights", folder / "out" / "weights"]
    for output in ("a", "b"):
        command(expected, "render", folder / "in" / "f0001.png", *options, "--output", folder / "out" / output)
    same_pictures(folder / "out" / "a", folder / "out" / "b")


def command(expected: int | None, task: str, source, *options) -> int:
    """Runs the extension's command, and gives its exit code. Fault: it was not the expected one."""
    arguments = [task, *map(str, (source, *options))]
    is_exr = any(path.is_file() and path.open("rb").read(4) == OPENEXR for path in source.parent.iterdir())
    code, said = trial.forked(lambda: trial.anew("-m", "shutter_addon", *arguments) if is_exr else _main(arguments))
    if code == 2:
        trial.is_refusal(said)
    if expected not in (None, code):
        raise trial.Fault(f"ended with {code} instead of {expected}: {said.strip()[-300:]}")
    return code


def _main(arguments) -> int:
    from shutter_addon.__main__ import main

    sys.argv = ["shutter", *arguments]
    return main()


def same_pictures(first, second):
    """Fault, unless two folders hold the same pictures."""
    from OpenImageIO import ImageBuf

    names, others = (sorted(path.name for path in folder.glob("*")) for folder in (first, second))
    if names != others:
        raise trial.Fault(f"other files from the same input: {names}, {others}")
    for name in names:
        if not np.array_equal(*(ImageBuf(str(folder / name)).get_pixels() for folder in (first, second))):
            raise trial.Fault(f"another picture from the same input: {name}")


def _composed(device, source, moment, index, direction, mattes):
    from shutter_addon.compute.renderer import Renderer
    from shutter_addon.compute.request import Request

    return [Renderer(device, source, mattes).picture(Request(index, moment, direction))]


def compose(found, plan: dict, folder):
    """The effect at some frames on both devices: against the reference, and their coefficients against each other.
    folder: of the recipe."""
    from test_composition import check, footage

    from gallery.matte_contents import with_contents
    from shutter_addon.compute.renderer import Renderer, open_compositor
    from shutter_addon.compute.request import Request
    from shutter_addon.core.model.effect import FileContent
    from shutter_addon.core.model.keyframes import Keys
    from shutter_addon.media.matte_values import MatteValues
    from shutter_addon.media.opening import MatteFile

    def file(region):
        if not isinstance(region.content, FileContent):
            return MatteFile(folder / "in" / "f0001.png")
        return MatteFile(folder / region.content.path, region.content.channel)

    values = MatteValues(*SIZE)

    source = footage(np.random.default_rng(1), 8, SIZE, **plan["footage"])
    devices = {device: open_compositor(device) for device in ("cpu", "gpu")}
    channels = [shutter.bars.channel for shutter in found.shutters] + [each.moves.location for each in found.regions]
    keys = [frame for channel in channels if isinstance(channel, Keys) for frame in channel.frames]
    for frame in (1, 2.5, *keys[:2]):
        moment = with_contents(found.for_picture(SIZE[0] / SIZE[1]), file).at(frame)
        moment = replace(moment, options=replace(moment.options, step=1))  # footage of filmed frames alone
        renderers = [Renderer(device, source, values) for device in devices.values()]
        first, second = (renderer.coefficients(Request(3, moment)).astype(float) for renderer in renderers)
        if not (apart := np.abs(first - second).max()) <= 1 / 255:
            raise trial.Fault(f"coefficients are {255 * apart:.3g}/255 apart at frame {frame:g}")
        for name, device in devices.items():
            try:
                made = check if moment.bars.size <= REFERABLE else _composed
                once, again = (made(device, source, moment, 3, plan["direction"], mattes=values)[0] for _ in range(2))
            except AssertionError:
                raise trial.Fault(f"{name} differs from the reference: {plan['footage']}, frame {frame:g}") from None
            if not np.array_equal(once, again):
                raise trial.Fault(f"{name} gives another picture for the same recipe at frame {frame:g}")


def compose_mixed(found, seed: int, folder):
    """A recipe of every field with every other, unless values are others now, with all that a render makes of it."""
    import cases
    import compare
    from made_recipes import is_same

    from shutter_addon.core.recipes import recipe_file

    case = cases.make(seed, mixed=True)
    if not is_same(found, recipe_file.parse(case.recipe)):
        return
    try:
        compare.check_mixed(case, compare.open_devices(["cpu", "gpu"]), folder)
    except compare.DifferenceError as error:
        raise trial.Fault(str(error)) from None
