import copy
import json
import os

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_recipes import comes_back, is_same, key, made

from gallery.matte_contents import with_contents
from shutter_addon.core.model import limits, mattes, motions, scribbles, shutters, windows
from shutter_addon.core.model.clip import Clip
from shutter_addon.core.model.keyframes import between_bars, eased_span
from shutter_addon.core.model.state_at import state_at
from shutter_addon.core.recipes import recipe, recipe_file

BARS = [{"frame": 1, "bars": [1] + [0] * 7}, {"frame": 40, "bars": [0] * 7 + [1], "ease": "linear"}]
LINE = {"name": "pendulum", "shutter": "Sharp", "kind": "line", "width": 0.02, "strokes": [[[0.1, 0.5], [0.4, 0.6]]]}
EXAMPLE = {
    "version": 2,
    "window": 8,
    "shutters": [
        {"name": "Long", "color": [0.2, 0.5, 1.0], "bars": [1] * 8},
        {"name": "Sharp", "color": [1.0, 0.3, 0.2], "keys": BARS},
    ],
    "regions": [LINE | {"keys": [key(1), key(40, [0.2, 0], 30, 1.5)]}],
}
EXAMPLE |= {"position": "start", "interpolation": "displacement", "light": "linear", "exposure": "normalized"}
EXAMPLE |= {"edges": "hold", "aggregate": 1, "border": False, "stop_at_cuts": True}
MATTE = {"shutter": "Sharp", "kind": "matte", "path": "mattes/0001.png"}
RAMP = {"shutter": "Sharp", "kind": "ramp", "ramp": "linear"}


def test_mattes_and_ramps():
    keyed = {"opacity": [{"frame": 1, "value": 0}, {"frame": 3, "value": 1}], "blend": "add", "invert": True}
    regions = [MATTE | keyed, MATTE | {"timing": "timeline", "offset": 4, "width": 0.1}, *EXAMPLE["regions"]]
    regions += [RAMP | {"keys": [{"frame": 1}, {"frame": 5, "location": [0.2, 0], "rotation": 90, "scale": 2}]}]
    regions += [RAMP | {"ramp": "luminance"}]
    parsed = recipe_file.parse(json.dumps(EXAMPLE | {"regions": regions}))
    assert comes_back(parsed)
    moment = with_contents(parsed.for_picture(1), lambda region: type(region.content).__name__).at(3)
    assert len(moment.shapes) == 1
    of_source, of_timeline, ramp, luminance = moment.mattes
    assert of_source == mattes.Matte(1, mattes.FileFrame("FileContent"), "add", invert=True)
    assert of_timeline == mattes.Matte(1, mattes.FileFrame("FileContent", 4, 2), feather=0.1)
    assert ramp.content == mattes.Ramp("linear", motions.Placement((0.1, 0), 45, 1.5))
    assert luminance.content == mattes.FileFrame("RampContent")
    first = with_contents(parsed.for_picture(1)).at(1)
    assert len(first.mattes) == 3  # one of no opacity is none


def follow_one_of_two(name):
    def change(data):
        data["shutters"][0]["follow"] = name
        data["regions"] = [LINE | {"name": name}] * 2

    return change


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda d: d["regions"][0].update(bar=1), r"regions[0]: unknown field bar"),
        (lambda d: d.update(version=3), "version: 3 is of a newer version of Virtual Shutter, this one reads 2"),
        (lambda d: d.update(version=0), "version: 0 is none of 1, 2"),
        (lambda d: d.update(version=1, inbetween="auto"), 'inbetween: recipes have "auto" from version 2 on'),
        (lambda d: d.update(shutters=[]), "shutters: empty"),
        (lambda d: d.update(shutters="Long"), 'shutters: "Long" is not a list'),
        (lambda d: d["shutters"].append(7), "shutters[2]: 7 is not an object"),
        (lambda d: d["shutters"][0].update(bars=[1] * 7), "shutters[0].bars: 7 values, window is 8"),
        (lambda d: d["shutters"][0].update(bars=[0] * 8), "shutters[0].bars: all bars are zero"),
        (lambda d: d["shutters"][0]["bars"].__setitem__(3, float("nan")), "shutters[0].bars[3]: nan is not"),
        (lambda d: d["shutters"][0].update(name="Sharp"), 'shutters[1].name: "Sharp" is taken by shutters[0]'),
        (lambda d: d["shutters"][0].pop("bars"), "shutters[0]: either bars or keys"),
        (lambda d: d["shutters"][1]["keys"][1].update(frame=1), "shutters[1].keys[1].frame: 1 does not follow 1"),
        (lambda d: d["shutters"][1]["keys"][0].update(bars=[1]), "shutters[1].keys[0].bars: 1 values"),
        (lambda d: d["shutters"][1]["keys"][0].update(ease="in"), 'shutters[1].keys[0].ease: "in" is none of'),
        (lambda d: d["regions"][0].update(shutter="X"), 'regions[0].shutter: there is no shutter "X"'),
        (lambda d: d["regions"].append(MATTE | {"path": ""}), "regions[1].path: empty"),
        (lambda d: d["regions"].append(MATTE | {"opacity": []}), "regions[1].opacity: empty: there is no key"),
        (lambda d: d["regions"][0].update(strokes=[]), "regions[0].strokes: empty"),
        (lambda d: d["regions"][0].update(strokes=[[]]), "regions[0].strokes[0]: empty"),
        (lambda d: d["regions"][0].update(strokes=[[[1, 2, 3]]]), "regions[0].strokes[0][0]: 3 values, not 2"),
        (lambda d: d["regions"][0]["keys"][1].update(frame=2.5, strokes=[[[0, 0]]]), "regions[0]: 2.5 is not a whole"),
        (lambda d: d.update({"x" * 5000: 1}), "recipe: unknown field xxxxxxxx"),
        (lambda d: d.update({f"x{i}": 1 for i in range(99)}), "recipe: unknown field x0, x1, x10 and 96 more"),
        (lambda d: d.update(shutters=[[[7] * 1000] * 100]), "shutters[0]: [[7, 7"),
        (lambda d: d["shutters"][0].update(bars=["1"] * 1_000_000), 'shutters[0].bars[0]: "1" is not a number'),
        (lambda d: d["regions"][0].update(name="\udcff"), "regions[0].name: U+DCFF is not allowed"),
        (lambda d: d.update(regions=[d["regions"][0]] * 1001), "regions: 1001, the most are 1000"),
        (lambda d: d["regions"].append(LINE | {"strokes": [[[0, 0]] * 50_000] * 2}), "regions: 100002 points at once"),
        (lambda d: d["regions"][0].update(strokes=[[[0, 0], [1e39, 0]]]), "regions[0].strokes[0][1][0]: 1e+39 is not"),
        (lambda d: d.update(time=[{"frame": 1048575, "value": 1}]), "time[0].frame: 1048575 is not -1048574 to 10"),
        (lambda d: d["shutters"][0].update(follow="X"), 'shutters[0].follow: there is no region "X"'),
        (lambda d: d["shutters"][0].update(follow=""), 'shutters[0].follow: empty: it names a region, or is "camera"'),
        (follow_one_of_two("twice"), 'shutters[0].follow: "twice" is the name of regions[0] and regions[1]'),
        (follow_one_of_two("camera"), 'shutters[0].follow: "camera" is the camera, and regions[0] as well'),
        (lambda d: d["shutters"][0].update(trail=0.1), "shutters[0].trail: the shutter follows nothing that moves"),
        (lambda d: d.update(camera=[{"frame": 1, "strokes": []}]), "camera[0]: unknown field strokes"),
        (lambda d: d.update(time=[{"frame": k, "value": 1} for k in range(100_001)]), "time: 100001, the most are 100"),
    ],
)
def test_one_sentence_that_names_the_place(change, sentence):
    data = copy.deepcopy(EXAMPLE)
    change(data)
    refused(json.dumps(data), sentence)


def refused(text, sentence):
    with pytest.raises(recipe.RecipeError) as fault:
        recipe_file.parse(text)
    assert str(fault.value).startswith(sentence)
    assert is_a_sentence(str(fault.value))


def is_a_sentence(text):
    return text.isprintable() and 0 < len(text) <= 300


DEEP = 10_000
ONE = '{"version": 2, "window": 1, "shutters": [{"name": "A", "bars": [1]}], '


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "line 1, column 1: not JSON"),
        ("{", "line 1, column 2: not JSON"),
        ('{"version": 2,\n "window": }', "line 2, column 12: not JSON"),
        ("[]", "recipe: [] is not an object"),
        ("null", "recipe: null is not an object"),
        ("[" * DEEP, "recipe: too many lists or objects within each other"),
        ('{"a":' * DEEP, "recipe: too many lists or objects within each other"),
        ('{"version": 2, "window": ' + "9" * 5000 + "}", "window: Infinity is not a whole number"),
        (ONE + '"regions": [{"shutter": "A", "width": -' + "9" * 5000 + "}]}", "regions[0].width: -inf is not"),
        ('{"version": 2, "window": 1, "window": 2}', 'recipe: field "window" is given twice'),
        (ONE + '"time": [{"frame": 1, "value": 1, "frame": 2}]}', 'recipe: field "frame" is given twice'),
        # The reader and the writer of JSON may go to different depths.
        ('{"version": 2, "window": 1, "shutters": [' + "[" * 900 + "]" * 900 + "]}", "shutters[0]: [[["),
    ],
    ids=lambda value: value[:20],
)
def test_no_recipe_at_all(text, sentence):
    refused(text, sentence)


ANYTHING = st.one_of(
    st.sampled_from([None, True, -1, 0, 10**400, 1e-46, 1e39, float("nan"), float("inf"), "", "\ud800", [], {}]),
    st.floats(),
    st.integers(),
    st.text(max_size=80),
    st.recursive(st.floats() | st.just([0.5, 0.5]), lambda inner: st.lists(inner, max_size=4), max_leaves=20),
)


def places(value, path=()):
    """All places in JSON, by keys and indices."""
    yield path
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for place, inner in items:
        yield from places(inner, (*path, place))


@settings(deadline=5000)
@given(
    st.lists(st.tuples(st.sampled_from(list(places(EXAMPLE))[1:]), ANYTHING), min_size=1, max_size=3),
    st.one_of(st.integers(-50, 50), st.floats(-2e6, 2e6)),
)
def test_a_hostile_recipe_is_refused_in_a_sentence_or_soon_drawn(changes, frame):
    data = copy.deepcopy(EXAMPLE)
    for path, value in changes:
        inner = data
        try:
            for key in path[:-1]:
                inner = inner[key]
            inner[path[-1]] = value
        except (TypeError, LookupError):  # an earlier change has taken it away
            continue
    fault = None
    try:
        found = recipe_file.parse(json.dumps(data))
    except recipe.RecipeError as error:
        fault = str(error)
    if fault is not None:
        assert is_a_sentence(fault)
        return
    assert comes_back(found)
    moment = found.for_picture(16 / 9).at(frame)
    assert np.isfinite(moment.bars).all()
    assert np.isfinite(moment.gains.astype(np.float32)).all()
    assert scribbles.rasterise(moment.shapes, 64, 36).shape == (36, 64)


def test_files(tmp_path):
    parsed = recipe_file.parse(json.dumps(EXAMPLE))
    (tmp_path / "r.json").symlink_to("others")
    recipe_file.save(parsed, tmp_path / "r.json")
    assert is_same(recipe_file.load(tmp_path / "r.json"), parsed)
    assert [p.name for p in tmp_path.iterdir()] == ["r.json"]
    (tmp_path / "mark.json").write_text(json.dumps(EXAMPLE), encoding="utf-8-sig")
    assert is_same(recipe_file.load(tmp_path / "mark.json"), parsed)
    (tmp_path / "b.json").write_bytes(b"\xff\xfe\x00\x80")
    for name, sentence in [("none.json", "No such file"), ("", "directory"), ("b.json", "not a text file")]:
        with pytest.raises(recipe.RecipeError, match=sentence):
            recipe_file.load(tmp_path / name)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes by name")
def test_what_is_no_file(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with (tmp_path / "large").open("wb") as file:
        file.truncate(limits.MAX_BYTES + 1)
    (tmp_path / ("é" * 100 + "\udcff")).touch()
    for path, sentence in [
        (tmp_path / "pipe", "a pipe or a device"),
        ("/dev/zero", "a pipe or a device"),
        (tmp_path / "large", "more than 32 MB"),
        (tmp_path / ("é" * 100 + "\udcff"), "line 1, column 1: not JSON"),
        (tmp_path / ("x" * 300), "too long"),
        (tmp_path / "a\0b", "null"),
        ("/" + "x/" * 1000, "No such file|too long"),
    ]:
        with pytest.raises(recipe.RecipeError, match=sentence) as fault:
            recipe_file.load(path)
        assert str(fault.value).startswith(str(path)[:20])
        assert is_a_sentence(str(fault.value))


# Recipes of version 1, whose bars counted the moments between filmed frames


def first(window, given, **more):
    """The effect of a recipe of version 1."""
    return recipe_file.parse(json.dumps({"version": 1, "window": window, "shutters": given} | more))


def exposes(bars, steps, position, way):
    """{moment from the shown frame: share} of bars that counted moments, as version 1 had them."""
    filmed = -(-len(bars) // steps)
    before = {"start": 0, "center": (filmed - 1) // 2 * steps, "end": len(bars) - steps}[position]
    whole = bars.max() if way == "lightest" else bars.sum()
    return {k - before: weight / whole for k, weight in enumerate(bars) if weight > 1e-9 * whole}


@pytest.mark.parametrize("way", ["average", "lightest"])
@pytest.mark.parametrize("position", ["start", "center", "end"])
@pytest.mark.parametrize("steps", [2, 4, 8, 16])
def test_moments_that_filmed_frames_expose_are_kept(steps, position, way):
    """Of recipes of version 1: what they exposed is within 1/255 of what they do, on keys and between them, and nothing
    is said."""
    rng = np.random.default_rng([steps, len(position), len(way)])
    clip = Clip(width=60, height=40, count=100).stepped(steps)
    for _ in range(4):
        filmed = int(rng.integers(1, min(9, 256 // steps) + 1))
        frames = rng.random((3, filmed)).round(3) * (rng.random((3, filmed)) < 0.6)
        frames[range(3), rng.integers(filmed, size=3)] = 1
        keys = [shutters.smoothed(bars, steps, level=way == "lightest") for bars in frames]
        if position == "end":
            unused = steps - 1 if all(not bars[: steps - 1].any() for bars in keys) else 0
            keys = [bars[unused:] for bars in keys] if filmed > 1 else keys
        else:
            unused = next((k for k in range(steps) if any(bars[len(bars) - 1 - k] for bars in keys)), steps - 1)
            keys = [bars[: len(bars) - unused] for bars in keys]
        eases = [str(each) for each in rng.choice(["linear", "bezier", "constant"], 3)]
        keyed = zip((10, 20, 33), keys, eases, strict=True)
        keyed = [{"frame": frame, "bars": bars.tolist(), "ease": ease} for frame, bars, ease in keyed]
        shutter = {"name": "A", "keys": keyed, "combine": way}
        found = first(len(keys[0]), [shutter], inbetween=steps, position=position)
        assert found.lost is None
        for frame in (5, 10, 13, 20, 26, 31, 40):
            before, after, share = eased_span((10, 20, 33), eases, frame)
            wanted = exposes(between_bars(keys[before], keys[after], share), steps, position, way)
            moment = state_at(found.for_picture(1.5), clip, frame)
            at = windows.positions(moment.state.options, moment.source_frame)
            bars = moment.state.bars[0]
            weights = bars / (bars.max() if way == "lightest" else bars.sum())
            now = {int(place) - moment.source_frame: weight for place, weight in zip(at, weights, strict=True)}
            apart = [abs(wanted.get(k, 0) - now.get(k, 0)) for k in wanted.keys() | now.keys()]
            assert (max if way == "lightest" else sum)(apart) <= 1 / 255


@pytest.mark.parametrize("position", ["start", "center", "end"])
@pytest.mark.parametrize("steps", [2, 4, 8, 16])
def test_moments_that_no_filmed_frame_exposes_are_told(steps, position):
    still = np.eye(3 * steps)[steps].tolist()
    off = np.eye(3 * steps)[steps + 1].tolist()
    told = f"bars {steps + 1} to {2 * steps} of the older file are one filmed frame now"
    fine = {"name": "Fine", "bars": still}
    keys = {"keys": [{"frame": 1, "bars": still}, {"frame": 9, "bars": off}]}
    for shutter in ({"bars": off}, keys, {"bars": [0] * steps + [1] * steps + [0] * steps}):
        found = first(3 * steps, [fine, {"name": "Off"} | shutter], inbetween=steps, position=position)
        assert str(found.lost) == f'shutter "Off": {told}, and expose other moments'
        assert comes_back(found)
    shape = {"name": "Shape", "bars": [1] * steps + [2] * steps + [0] * steps, "length": "timeline"}
    assert first(3 * steps, [fine, shape], inbetween=steps, position=position).lost is None
    fading = {"keys": [{"frame": 1 + k, "bars": np.eye(2 * steps)[k].tolist()} for k in (0, steps)]}
    for interpolation, is_told in (("displacement", False), ("value", True)):
        found = first(2 * steps, [{"name": "A"} | fading], inbetween=steps, interpolation=interpolation)
        assert (found.lost is not None) == is_told


@pytest.mark.parametrize(("version", "smooth", "skips"), [(1, 1, True), (1, 4, False), (2, 4, True)])
def test_frames_of_a_first_recipe_that_repeat_stay(version, smooth, skips):
    for said, wanted in (({}, skips), ({"skip_repeats": True}, True), ({"skip_repeats": False}, False)):
        found = first(4, [{"name": "A", "bars": [1, 1, 1, 1]}], version=version, inbetween=smooth, **said)
        assert found.options.at(1).skip_repeats == wanted
        assert comes_back(found)


def test_what_is_drawn_comes_in_the_order_of_its_regions():
    """Lines and outlines: whoever draws them goes through the regions beside them."""
    strokes = [[[0.1, 0.1], [0.5, 0.1], [0.5, 0.5]]]
    outline = {"shutter": "S1", "kind": "outline", "between": "straight", "strokes": strokes}
    regions = [outline, {"shutter": "S0", "strokes": strokes}, outline | {"shutter": "S0"}]
    content = made(1, [{"name": f"S{i}", "bars": [1]} for i in range(2)], regions)
    drawn = content.for_picture(1.5).drawn_at(1)
    assert [(shape.shutter, shape.kind) for shape in drawn] == [(1, "lasso"), (0, "line"), (0, "lasso")]
