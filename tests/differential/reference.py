"""A reference of its own for pictures and coefficients: what a recipe means, in float64, by NumPy and SciPy alone.

It is written from the paper and the manual, shares no code with the product, and finds most results in another way: a
pixel's shutter by the paper's bisection, brought to its end, in place of a table of knots; coefficients by a direct
solve; lassos by the angles that their points run through; eases by de Casteljau. It is made to be read, for small
pictures.

What neither the paper nor the manual says is taken from the product; these are decisions, not results:
- a line is never thinner than √2 pixels; so is the outline of a lasso that encloses no pixel's center;
- halfway between two filmed frames, the lightest and the darkest count the mean of both bars; in reverse a window's
  first moments are those behind its first filmed frame;
- with `aggregate` scribbles are drawn into the grid of blocks as if it was the picture;
- what is mirrored shows the clip's first and last frame once;
- of a shutter that "shorten" leaves nothing of, the frame is shown that is nearest to the middle of its exposure, and
  of two that are as near the window's earlier one;
- a line's width does not grow with its region;
- frames are seen between pixels by Catmull and Rom's cubic, kept between the four pixels around, if they are opaque,
  and linearly otherwise;
- a frame that is never shown within four windows lies as the nearest of those that the window may show, the earlier of
  two; of two times that are as near, the later counts;
- a trail's length is that of the fastest corner of what is followed; a bar has half of the ways to the frames beside;
- three tenths of a scribble's coefficients are nothing of a layer's matte, half is all of it; the sums of layers
  are laid over one another in linear light; weighted frames are seen linearly between pixels; where no layer is in the
  way, all is as without them;
- where the camera has keys that move, what layers cover of opaque footage is, in each exposed frame, that of the
  nearest frame which shows nine tenths of it, the earlier of two, and counts by a 64th less than what is seen; both
  together count by a 1024th less than a frame in whose way no layer is, so that it is taken however little it is;
- what an outline covers of a pixel is told by eight lines across it, each to its exact places;
- mattes lie over what scribbles give, whichever comes first in the list; a ramp at rest runs from one corner of the
  picture to the opposite one; a feather is a Gaussian of a quarter of its width, of which a pixel has what it covers;
- of shutters that combine alike, the lightest and darkest frames are weighted by the displaced bars over the mixed
  peak of theirs; a median at exactly half of all weights is the mean of both its neighbors;
- a premultiplied color without cover (alpha 0) is light that is added to what lies below (as in Blender), and to a
  threshold as light as a layer has of it. What it is among encoded values, nothing says; there this is no reference.

A recipe is its JSON as a dictionary. Pictures are (H, W, 4) float64 with the top row first, scene-linear and
premultiplied; coefficients are (N, h, w), of the pixels or of the blocks that share a shutter.
"""

from collections import namedtuple
from itertools import pairwise

import numpy as np
from scipy.sparse import diags_array, eye_array, kron
from scipy.sparse.linalg import spsolve
from scipy.special import erf

# samples: (count, H, W, 4) float64, 0 … 1 for whole numbers, the top row first; transfer: "srgb" | "linear"; alpha:
# "opaque" | "straight" | "premultiplied"; levels: into how many steps samples are rounded, None: these are no whole
# numbers.
Footage = namedtuple("Footage", "samples transfer alpha levels", defaults=[None])
# doubtful: (H, W) bool, where float32 cannot tell whether anything is left of a shutter, or which frame is the nearest.
Result = namedtuple("Result", "picture doubtful")

DEFAULTS = {"position": "start", "interpolation": "displacement", "light": "linear", "exposure": "normalized"}
DEFAULTS |= {"edges": "hold", "aggregate": 1, "border": False, "plate_reach": 48, "inbetween": 1}
LEAST_RADIUS = 0.7072
NOTHING = 1e-6  # less of an exposure than this is nothing
EARLIER = 1e-3  # by so much of a frame an earlier one is preferred
CLEAR = 1 / 16  # less than this of what lies behind layers is too little
UNCOVERED = 1 - 2e-5  # where more of it is seen, no layer is in the way
SEEN, BORROWED = 0.9, 63 / 64  # what another frame has to show to be taken, and how much that counts
MOST = 1 - 1 / 1024  # of what a frame and another one show together
ROUNDING = 1e-5  # in float32, of weights and times
HALFWAY = 2e-4  # of a level: so near the middle of two, float32 cannot tell which is the nearest
HALVINGS = 44  # of the bisection: what is left is far below what float32 holds


def option(recipe, name):
    return recipe.get(name, DEFAULTS[name])


# Keys


def progress(u, ease):
    """How far a span has come after its share u. "bezier": handles of a third, flat."""
    if ease == "constant":
        return 0.0
    if ease == "linear":
        return u
    values = [0.0, 0.0, 1.0, 1.0]  # of the curve's points; their times are 0, 1/3, 2/3, 1, so that u is its parameter
    while len(values) > 1:
        values = [(1 - u) * a + u * b for a, b in pairwise(values)]
    return values[0]


def between(keys, frame):
    """The keys around a frame and how far the way from one to the other has come."""
    before = [key for key in keys if key["frame"] <= frame]
    after = [key for key in keys if key["frame"] > frame]
    if not before:
        return after[0], after[0], 0.0
    if not after:
        return before[-1], before[-1], 0.0
    a, b = before[-1], after[0]
    return a, b, progress((frame - a["frame"]) / (b["frame"] - a["frame"]), a.get("ease", "linear"))


def time_at(recipe, frame):
    """The source frame that its time keys show, 1 is the first; None: it has none."""
    if not recipe.get("time"):
        return None
    a, b, u = between(recipe["time"], frame)
    return (1 - u) * a["value"] + u * b["value"]


def shown(recipe, frame, count):
    """The source frame that is shown at a timeline frame, 0 is the first, and the direction that time runs in there:
    −1 where it runs backward, or stands still after it did. A jump of a constant ease is no way."""
    time = time_at(recipe, frame)
    if time is None:
        return int(frame) - 1, 1
    index = int(np.floor(time - 1 + 0.5))
    ways = [
        (a["frame"], np.sign(b["value"] - a["value"]))
        for a, b in pairwise(recipe["time"])
        if a.get("ease", "linear") != "constant" and a["frame"] <= frame
    ]
    moving = [way for _, way in ways if way]
    return min(max(index, 0), count - 1), -1 if moving and moving[-1] < 0 else 1


def bars_at(shutter, frame, interpolation, spread=lambda bars: bars):
    """A shutter's bars (L,) at a frame. spread: gives those of moments, which is what times are displaced among."""
    if "keys" not in shutter:
        return spread(np.array(shutter["bars"], float))
    a, b, u = between(shutter["keys"], frame)
    both = np.array([a["bars"], b["bars"]], float)
    if interpolation == "value":
        return spread((1 - u) * both[0] + u * both[1])
    both, mix = np.array([spread(bars) for bars in both]), np.array([1 - u, u])
    return displaced(both, mix[:, None])[:, 0] * (mix @ both.sum(axis=1))


def strokes_at(region, frame, aspect):
    """A region's strokes as complex numbers at a frame: fractions of the picture's height, the origin lower left."""
    strokes = drawn_at(region, frame, aspect)
    if not region.get("keys"):
        return strokes
    centre, (x, y, rotation, scale) = middle(strokes), placement(region["keys"], frame)
    turn, away = scale * np.exp(1j * np.radians(rotation)), x * aspect + 1j * y
    return [centre + turn * (stroke - centre) + away for stroke in strokes]


def drawn_at(region, frame, aspect):
    """A region's strokes before they are moved."""
    keys = region.get("keys", [])
    drawings = [key for key in keys if "strokes" in key]
    if not keys or "strokes" not in keys[0]:
        first = keys[0] if keys else {"frame": 0}
        drawings.insert(0, {"frame": first["frame"], **region, "ease": first.get("ease", "linear")})
    a, b, u = between(drawings, frame)
    strokes = [as_complex(stroke, aspect) for stroke in a["strokes"]]
    if u > 0:
        others = [as_complex(stroke, aspect) for stroke in b["strokes"]]
        strokes = [moved(s, others[i], u) if i < len(others) else s for i, s in enumerate(strokes)]
    return strokes


def middle(strokes):
    """The center of the box around strokes."""
    points = np.concatenate(strokes)
    return complex(points.real.min() + points.real.max(), points.imag.min() + points.imag.max()) / 2


def placement(keys, frame):
    """Location x and y, rotation and scale at a frame."""
    a, b, u = between(keys, frame)
    ways = [[*key.get("location", (0, 0)), key.get("rotation", 0), key.get("scale", 1)] for key in (a, b)]
    return np.array([1 - u, u]) @ np.array(ways, float)


def as_complex(points, aspect):
    x, y = np.array(points, float).T
    return x * aspect + 1j * y


def moved(a, b, u):
    """Between two strokes, point by point; of different numbers of points, by the shares of their lengths."""
    if len(a) != len(b):
        a, b = (at_equal_lengths(stroke, max(len(a), len(b))) for stroke in (a, b))
    return (1 - u) * a + u * b


def at_equal_lengths(stroke, count):
    lengths = np.concatenate([[0], np.cumsum(np.abs(np.diff(stroke)))])
    return np.interp(np.arange(count) / (count - 1) * lengths[-1], lengths, stroke)


# Scribbles and coefficients


def label_layers(recipe, frame, width, height):
    """(share, labels) of which coefficients are the mean: of each share, what is at least that opaque holds."""
    regions = [region for region in recipe.get("regions", []) if has_strokes(region) and not region.get("layer")]
    steps = sorted({0.0, 1.0, *(number_at(region.get("opacity", 1), frame) for region in regions)})
    return [(high - low, labels_at(recipe, frame, width, height, high)) for low, high in pairwise(steps)]


def labels_at(recipe, frame, width, height, least=0.0):
    """Labels (h, w) of the pixels, or of the blocks that share a shutter: −1 free, otherwise the shutter's number, of
    regions that are at least so opaque."""
    names = [shutter["name"] for shutter in recipe["shutters"]]
    regions = [region for region in recipe.get("regions", []) if has_strokes(region) and not region.get("layer")]
    regions = [region for region in regions if number_at(region.get("opacity", 1), frame) >= least]
    drawn = [(region, strokes_at(region, frame, width / height), names.index(region["shutter"])) for region in regions]
    return painted(recipe, drawn, width, height)


def painted(recipe, drawn, width, height):
    """As labels_at, of regions with their strokes and numbers."""
    block = option(recipe, "aggregate")
    w, h = -(-width // block), -(-height // block)
    # A center as a fraction of the grid's height and width, whose pixels need not be square.
    x, y = np.meshgrid((np.arange(w) + 0.5) / w, 1 - (np.arange(h) + 0.5) / h)
    labels = np.full((h, w), -1)
    if option(recipe, "border"):
        inner = np.zeros((h, w), bool)
        inner[1:-1, 1:-1] = True
        labels[~inner] = 0
    for region, strokes, own in drawn:
        lines = region.get("kind", "line") == "line"
        for stroke in strokes:
            points = stroke.real * (height / width) * w + 1j * stroke.imag * h
            centres = x * w + 1j * y * h
            radius = region.get("width", 0.02) * h / 2 if lines else 0
            covered = np.zeros((h, w), bool) if lines else enclosed(centres, points)
            if not covered.any():
                covered = distance(centres, points) <= max(radius, LEAST_RADIUS)
            labels[covered] = own
    return labels


def has_strokes(region):
    """Whether coefficients are diffused from it."""
    return region.get("kind", "line") in ("line", "lasso")


def is_drawn(region):
    return has_strokes(region) or region["kind"] == "outline"


LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
CHANNELS = {"red": 0, "green": 1, "blue": 2, "alpha": 3}


def laid(recipe, frame, index, mix, footage, mattes):
    """Coefficients (N, h, w) with the mattes of a recipe laid over them, at a timeline frame that shows the source
    frame `index`. mattes: {path: samples (count, H, W, 4), 0 … 1}"""
    result, names = mix.astype(float), [shutter["name"] for shutter in recipe["shutters"]]
    for region in recipe["regions"]:
        if has_strokes(region) or region.get("layer"):
            continue
        value = block_means(values_of(region, frame, index, footage, mattes), option(recipe, "aggregate"))
        value = value * number_at(region.get("opacity", 1), frame)
        own = np.zeros((len(names), 1, 1))
        own[names.index(region["shutter"])] = 1
        default = np.arange(len(names))[:, None, None] == 0
        if region.get("blend") == "add":
            value = np.minimum(value, result[0])
            result = result + value * (own - default)
        else:
            result = (1 - value) * result + value * own
    return result


def values_of(region, frame, index, footage, mattes):
    """The values (H, W) of a matte or a ramp, without its opacity; arguments as for `laid`."""
    _, height, width, _ = footage.samples.shape
    if region["kind"] == "ramp" and region["ramp"] != "luminance":
        value = ramp(region, frame, width, height)
    elif region["kind"] == "ramp":
        value = channel_of(footage.samples[index], "luminance")
    elif region["kind"] == "outline":
        value = outlined(drawn_at(region, frame, width / height), width, height)
    else:
        shown_frames, first = mattes[region["path"]], region.get("offset", 0)
        place = first + (frame - 1 if region.get("timing") == "timeline" else index)
        value = channel_of(shown_frames[min(max(place, 0), len(shown_frames) - 1)], region.get("channel", "luminance"))
    value = softened(value, number_at(region.get("width", 0), frame) * height / 4)
    return 1 - value if region.get("invert") else value


def channel_of(samples, channel):
    """A channel (H, W) of samples (H, W, 4), 0 to 1."""
    return np.clip(samples[..., :3] @ LUMINANCE if channel == "luminance" else samples[..., CHANNELS[channel]], 0, 1)


def ramp(region, frame, width, height):
    """The values (H, W) of a ramp at a frame; places are complex, in pixels from its center on, y up."""
    x, y, rotation, scale = placement(region["keys"], frame) if region.get("keys") else STILL
    column, row = np.meshgrid(np.arange(width) + 0.5, height - 0.5 - np.arange(height))
    centre = width * (0.5 + x) + 1j * height * (0.5 + y)
    along = (column + 1j * row - centre) * np.exp(-1j * np.radians(rotation))
    corners = np.array([width + 1j * height, width - 1j * height]) / 2
    if region["ramp"] == "angle":
        return (-np.angle(along / 1j) / (2 * np.pi)) % 1
    if region["ramp"] == "radial":
        return np.clip(np.abs(along) / (scale * np.abs(corners[0])), 0, 1)
    reach = max(np.abs((corners * np.exp(-1j * np.radians(rotation))).real))
    return np.clip((along.real / (scale * reach) + 1) / 2, 0, 1)


def outlined(strokes, width, height):
    """The share (H, W) of each pixel between an odd and the next even crossing of closed curves, on eight lines of each
    row. strokes: complex, in heights of the picture"""
    value = np.zeros((height, width))
    edges = [pair for stroke in strokes for pair in zip(stroke * height, np.roll(stroke, -1) * height, strict=True)]
    for line in range(8 * height):
        y, crossings = height - (line + 0.5) / 8, []
        for a, b in edges:
            if (a.imag > y) != (b.imag > y):
                crossings.append(a.real + (y - a.imag) / (b.imag - a.imag) * (b.real - a.real))
        for start, end in np.sort(crossings).reshape(-1, 2):
            left = np.arange(width)
            value[line // 8] += np.clip(np.minimum(end, left + 1) - np.maximum(start, left), 0, None) / 8
    return value


def softened(values, sigma):
    """Values (H, W) behind a Gaussian; beyond the picture its edge goes on."""
    if sigma == 0:
        return values
    reach = int(np.ceil(6 * sigma)) + 1
    ends = erf((np.arange(-reach, reach + 2) - 0.5) / (sigma * np.sqrt(2)))
    weights = np.diff(ends) / 2
    for axis in (0, 1):
        wide = np.pad(values, [(reach, reach) if a == axis else (0, 0) for a in (0, 1)], mode="edge")
        values = np.apply_along_axis(np.convolve, axis, wide, weights, "valid")
    return values


def block_means(values, block):
    height, width = values.shape
    rows, columns = range(0, height, block), range(0, width, block)
    return np.array([[values[y : y + block, x : x + block].mean() for x in columns] for y in rows])


def distance(places, points):
    """From places to the nearest point of a polyline, or to its only one."""
    best = np.abs(places - points[0])
    for a, b in pairwise(points):
        if a != b:
            along = ((places - a) / (b - a)).real.clip(0, 1)
            best = np.minimum(best, np.abs(places - (a + along * (b - a))))
    return best


def enclosed(places, points):
    """Whether a closed polygon runs around places, however often: by the angle that it runs through."""
    angle = np.zeros(places.shape)
    for a, b in pairwise([*points, points[0]]):
        angle += np.angle((b - places) * np.conj(a - places))
    return np.rint(angle / (2 * np.pi)) != 0


def coefficients(recipe, frame, width, height, solve=None):
    """The exact coefficients at a frame, for a picture of that size: scribbles are fixed, edges are free. solve: in
    place of `solved`"""
    layers = label_layers(recipe, frame, width, height)
    return sum(share * (solve or solved)(labels, len(recipe["shutters"])) for share, labels in layers)


def solved(labels, count):
    """The coefficients (N, h, w) of labels (h, w)."""
    labels = labels.copy()
    if (labels < 0).all():
        labels[:] = 0
    values = (labels.ravel() == np.arange(count)[:, None]).astype(float)
    free = labels.ravel() < 0
    if free.any():
        h, w = labels.shape
        equations = (kron(eye_array(h), differences(w)) + kron(differences(h), eye_array(w))).tocsr()[free]
        right = -(equations[:, ~free] @ values[:, ~free].T)
        values[:, free] = spsolve(equations[:, free].tocsc(), right).reshape(-1, count).T
    return values.reshape(count, *labels.shape)


def differences(n):
    """Each of n cells less its neighbors in a row, whose ends are free: (n, n)."""
    neighbours = np.full(n, 2.0)
    neighbours[0] -= 1
    neighbours[-1] -= 1
    return diags_array([neighbours, -np.ones(n - 1), -np.ones(n - 1)], offsets=[0, 1, -1], shape=(n, n))


# Shutters


def displaced(bars, mix):
    """The normalised bars (L, n) between shutters (N, L), for n mixes (N, n): by displacement, as in the paper's
    appendix A. Q(τ) is the share z of the exposure up to which Σ cᵢ Sᵢ⁻¹(z) lies at τ or before."""
    length = bars.shape[1]
    sums = [np.concatenate([[0], np.cumsum(own)]) / own.sum() for own in bars]
    times = np.arange(1, length)[:, None]
    low, high = (np.full((length - 1, mix.shape[1]), share) for share in (0.0, 1.0))
    for _ in range(HALVINGS):
        z = (low + high) / 2
        is_before = sum(c * inverse(own, z) for c, own in zip(mix, sums, strict=True)) <= times
        low, high = np.where(is_before, z, low), np.where(is_before, high, z)
    edge = np.zeros((1, mix.shape[1]))
    return np.diff(np.concatenate([edge, (low + high) / 2, edge + 1]), axis=0)


def inverse(sums, z):
    """S⁻¹ of 0 < z < 1, where S is given at the frames' boundaries (L + 1,) and linear in between."""
    last = np.searchsorted(sums, z, side="right").clip(1, len(sums) - 1)
    before, after = sums[last - 1], sums[last]
    return last - 1 + (z - before) / np.where(after > before, after - before, 1)


# What exposures follow


def showing(recipe, frame, index, direction, count):
    """Which source frame is shown at other timeline frames, as a function, where at this one it is `index`."""
    if recipe.get("time"):
        return lambda other: shown(recipe, other, count)[0]
    return lambda other: min(max(index + direction * int(other - frame), 0), count - 1)


def shown_times(recipe, frame, index, direction, count, more=0):
    """When the source frames that a window may show, and `more` beside it, are shown, the nearest time to a timeline
    frame: {source: time}."""
    where, reach = positions(recipe, index, direction, count), 4 * recipe["window"] + more
    beyond = more + (recipe["window"] if option(recipe, "edges") == "mirror" else 0)
    wanted = range(max(min(*where, index) - beyond, 0), min(max(*where, index) + beyond, count - 1) + 1)
    shows, found = showing(recipe, frame, index, direction, count), [(0.0, 0.0, index)]
    for start in range(frame - reach, frame + reach):
        a, b = (index if time == frame else shows(time) for time in (start, start + 1))
        for source in range(min(a, b), max(a, b) + 1) if a != b else ():
            time = start + (source - a) / (b - a)
            found.append((abs(time - frame), -time, source))
    times = {source: -time if apart else frame for apart, time, source in sorted(found, reverse=True)}
    times = {source: time for source, time in times.items() if source in wanted}
    return {source: times[min(sorted(times), key=lambda other: abs(other - source))] for source in wanted}


def followed(recipe, shutter):
    """As `subject`, of what a shutter follows: what of its motion counts, averaged over time."""
    tells, smooth = subject(recipe, shutter["follow"]), shutter.get("follow_smooth", 0)
    counts = ["location", "rotation", "scale"].index(shutter.get("follow_motion", "scale"))
    bell = 1 + np.cos(np.pi * np.arange(-smooth, smooth + 1) / (smooth + 1))

    def told(frame, aspect):
        around = [tells(frame + k, aspect) for k in range(-smooth, smooth + 1)]
        centre = sum(share * c for share, (c, _) in zip(bell / bell.sum(), around, strict=True))
        x, y, rotation, scale = sum(share * p for share, (_, p) in zip(bell / bell.sum(), around, strict=True))
        return centre, np.array([x, y, rotation if counts > 0 else 0, scale if counts > 1 else 1])

    return told


def subject(recipe, name):
    """A function of a timeline frame and the aspect that tells of what is followed its center and its placement."""
    region = next((region for region in recipe["regions"] if name != "camera" and region["name"] == name), {})
    keys = recipe.get("camera") if name == "camera" else region.get("keys")

    def told(frame, aspect):
        centre = middle(drawn_at(region, frame, aspect)) if region and is_drawn(region) else aspect / 2 + 0.5j
        return centre, placement(keys, frame) if keys else STILL

    return told


STILL = np.array([0.0, 0, 0, 1])


def motion(tells, frame, time, aspect):
    """(turn, shift) of the points of the picture, in heights of it, from a timeline frame to a time after or before,
    straight between whole frames."""
    low = int(np.floor(time))
    (c0, p0), (c1, p1) = (tells(low + k, aspect) for k in (0, 1))
    share = time - low
    start, end = tells(frame, aspect), ((1 - share) * c0 + share * c1, (1 - share) * p0 + share * p1)
    z0, z1 = (centre + x * aspect + 1j * y for centre, (x, y, _, _) in (start, end))
    turn0, turn1 = (scale * np.exp(1j * np.radians(rotation)) for _, (_, _, rotation, scale) in (start, end))
    return turn1 / turn0, z1 - turn1 / turn0 * z0


def motions(recipe, frame, index, direction, count, aspect):
    """Turns and shifts (N, L), by which each shutter sees the frames of the window; None: none follows anything."""
    if not any("follow" in shutter for shutter in recipe["shutters"]):
        return None
    times = shown_times(recipe, frame, index, direction, count)
    edges = "mirror" if option(recipe, "edges") == "mirror" else "hold"
    seen = [at_edges(edges, place, count) for place in positions(recipe, index, direction, count)]

    def of(shutter):
        if "follow" not in shutter:
            return [(1, 0)] * len(seen)
        tells = followed(recipe, shutter)
        return [motion(tells, frame, times[source], aspect) for source in seen]

    found = [of(shutter) for shutter in recipe["shutters"]]
    return np.moveaxis(np.array(found, complex), -1, 0)


def trailed(recipe, shutter, bars, frame, turns, shifts, shown_time, aspect):
    """A shutter's bars (L,), open while what it follows moves by its trail: in a span that grows until it does."""
    if "trail" not in shutter:
        return bars
    name, length = shutter["follow"], number_at(shutter["trail"], frame)
    region = next((region for region in recipe["regions"] if region["name"] == name), None)
    if region is None or not is_drawn(region):
        corners = np.array([0, aspect, 1j, aspect + 1j])
    else:
        points = np.concatenate(strokes_at(region, frame, aspect))
        sides, heights = ([part.min(), part.max()] for part in (points.real, points.imag))
        corners = np.array([x + 1j * y for x in sides for y in heights])
    places = turns[:, None] * corners + shifts[:, None]
    steps = [max(abs(b - a)) for a, b in pairwise(places)] or [0.0]
    own = [(a + b) / 2 for a, b in pairwise([steps[0], *steps, steps[-1]])][: len(bars)]
    first, last = np.flatnonzero(bars > 1e-9 * bars.sum())[[0, -1]] + (0, 1)
    about = min(max(shown_time, first), last)

    def span(width):
        start = about - (about - first) / (last - first) * width
        start = min(max(start, 0), len(bars) - width)
        return start, start + width

    def way(start, end):
        return sum(overlap(start, end, k, k + 1) * step for k, step in enumerate(own))

    low, high = 0.001, float(len(bars))
    if way(*span(high)) >= length:
        for _ in range(HALVINGS):
            width = (low + high) / 2
            low, high = (width, high) if way(*span(width)) < length else (low, width)
    start, end = span(high)
    return stretched(bars, first, last, start, end)


def overlap(a, b, c, d):
    return max(min(b, d) - max(a, c), 0.0)


def number_at(value, frame):
    """A number at a frame, which may have keys."""
    if not isinstance(value, list):
        return value
    a, b, u = between(value, frame)
    return (1 - u) * a["value"] + u * b["value"]


def sampled(light, places, is_sharp):
    """A frame's light (H, W, 4) at places (H, W), complex in heights of the picture from the lower left corner on."""
    height, width = light.shape[:2]
    x = (places.real * height - 0.5).clip(-9, width + 9)
    y = (height - places.imag * height - 0.5).clip(-9, height + 9)
    column, row = np.floor(x), np.floor(y)

    def pixel(i, j):
        return light[(row + j).clip(0, height - 1).astype(int), (column + i).clip(0, width - 1).astype(int)]

    corners = np.array([pixel(i, j) for i in (0, 1) for j in (0, 1)])
    taps = range(-1, 3) if is_sharp else (0, 1)
    weigh = cubic if is_sharp else linear
    total = sum((weigh(x - column - i) * weigh(y - row - j))[..., None] * pixel(i, j) for i in taps for j in taps)
    return total.clip(corners.min(axis=0), corners.max(axis=0))


def linear(t):
    return 1 - np.abs(t)


def cubic(t):
    """Keys' kernel, with the slopes of Catmull and Rom."""
    t = np.abs(t)
    return np.where(t < 1, 1.5 * t**3 - 2.5 * t**2 + 1, np.where(t < 2, -0.5 * t**3 + 2.5 * t**2 - 4 * t + 2, 0))


# Pictures


def positions(recipe, index, direction, count):
    """Which source frames the window's frames are, were the clip endless."""
    length, steps = recipe["window"], option(recipe, "inbetween")
    before = {"start": 0, "center": (length - 1) // 2, "end": length - 1}[option(recipe, "position")]
    first = index - direction * before * steps + (steps - 1 if direction < 0 else 0)
    places = [first + direction * k for k in range(length * steps)]
    by = into(places, lasting(recipe, count)) if option(recipe, "edges") == "slide" else 0
    return [place + by for place in places]


def lasting(recipe, count):
    """How many moments a clip has whose last filmed frame lasts as long as others."""
    steps = option(recipe, "inbetween")
    return -(-count // steps) * steps


def into(places, count):
    """By how many frames they move until all lie in the clip, or all of the clip among them."""
    low, high = min(places), max(places)
    inside = -low if low < 0 else min(count - 1 - high, 0)
    around = -low if low > 0 else max(count - 1 - high, 0)
    return inside if high - low < count else around


def slid(recipe, bars, places, there, count):
    """Each shutter's bars, moved into the clip by itself. places: of the window; there: of that which has moved"""
    if option(recipe, "edges") != "slide":
        return bars
    moved, steps = np.zeros_like(bars), option(recipe, "inbetween")
    for own, found in zip(bars, moved, strict=True):
        first, *_, last = [k for k in range(len(own)) if own[k] > 1e-9 * own.sum()] * 2  # rounding leaves some
        first, last = first // steps * steps, last // steps * steps + steps - 1  # of whole filmed frames
        by = into([places[first], places[last]], lasting(recipe, count))
        for k in range(first, last + 1):
            found[there.index(places[k] + by)] = own[k]
    return moved


def at_edges(edges, position, count):
    """The frame that is seen there; None: it is left out."""
    if edges == "mirror" and count > 1:
        while not 0 <= position < count:
            position = -position if position < 0 else 2 * (count - 1) - position
        return position
    if edges == "shorten" and not 0 <= position < count:
        return None
    return min(max(position, 0), count - 1)


def to_linear(code):
    return np.where(code <= 0.04045, code / 12.92, ((np.maximum(code, 0.04) + 0.055) / 1.055) ** 2.4)


def to_encoded(light):
    return np.where(light <= 0.0031308, light * 12.92, 1.055 * np.maximum(light, 0.003) ** (1 / 2.4) - 0.055)


def covering(alpha):
    return np.where(alpha > 1e-12, alpha, 1)  # less is what rounding leaves of none


def summed(footage, index, light):
    """A frame's light (H, W, 4) as it is summed: premultiplied, its straight colors linear or encoded."""
    colour, alpha = footage.samples[index][..., :3], footage.samples[index][..., 3:]
    if footage.alpha == "opaque":
        alpha = np.ones_like(alpha)
    cover = alpha
    if footage.alpha == "premultiplied":
        cover = covering(alpha)
        colour = colour / cover
    if (footage.transfer, light) == ("srgb", "linear"):
        colour = to_linear(colour)
    elif (footage.transfer, light) == ("linear", "encoded"):
        colour = to_encoded(colour)
    return np.concatenate([colour * cover, alpha], axis=-1)


def layers_at(recipe, frame):
    """The regions that are layers, and their opacities."""
    opacities = [(region, number_at(region.get("opacity", 1), frame)) for region in recipe.get("regions", [])]
    return [(region, opacity) for region, opacity in opacities if region.get("layer") and opacity > 0]


def layer_mattes(recipe, frame, footage, index, direction, mattes, solve=None):
    """The mattes (H, W) of all layers in each source frame that the window shows, and in those that show what they
    cover: {source: list}.

    mattes: as for `laid`
    solve: gives the coefficients of labels, their number and of a source frame at a time; None: the exact ones."""
    count, height, width, _ = footage.samples.shape
    layers, block = layers_at(recipe, frame), option(recipe, "aggregate")
    times = shown_times(recipe, frame, index, direction, count, option(recipe, "plate_reach"))
    frames = window_frames(recipe, index, direction, count)
    if layers and camera_moves(recipe, frame, times, width / height):
        reach = option(recipe, "plate_reach")
        frames = {other for other in times if min(abs(other - source) for source in frames) <= reach}
    others = [region for region in recipe["regions"] if has_strokes(region) and region not in [r for r, _ in layers]]

    def of(source):
        low = int(np.floor(times[source]))
        share = times[source] - low
        near, values = low + (1 if share > 0.5 else 0), []
        drawn = [(region, 0) for region in others if number_at(region.get("opacity", 1), low) > 0]
        own = [(region, 1 + i) for i, (region, _) in enumerate(layers) if has_strokes(region)]
        drawn += [(region, i) for region, i in own if number_at(region.get("opacity", 1), low) > 0]
        strokes = [(region, strokes_between(region, low, share, width / height), own) for region, own in drawn]
        labels = painted(recipe, strokes, width, height)
        mix = (solve or (lambda *given: solved(*given[:2])))(labels, 1 + len(layers), source, near)
        for i, (region, opacity) in enumerate(layers):
            if has_strokes(region):
                own = mix[1 + i].repeat(block, 0).repeat(block, 1)[:height, :width]
                values.append(opacity * np.clip((own - 0.3) / 0.2, 0, 1))
            else:
                values.append(opacity * values_of(region, near, source, footage, mattes))
        return values

    return {source: of(source) for source in frames}


def window_frames(recipe, index, direction, count):
    """The source frames that the window shows."""
    seen = {at_edges(option(recipe, "edges"), place, count) for place in positions(recipe, index, direction, count)}
    return seen - {None}


def camera_moves(recipe, frame, times, aspect):
    """By which turn and shift source frames show what the picture shows, {source: (turn, shift)}; none: it stands
    still."""
    found = {source: motion(subject(recipe, "camera"), frame, time, aspect) for source, time in times.items()}
    return found if any(abs(turn - 1) + abs(shift) > ROUNDING for turn, shift in found.values()) else {}


def uncovered(recipe, frame, footage, index, direction, layers):
    """Footage whose frames show what lies behind layers; how much it counts, and where that is doubtful, both
    {source: (H, W)}. layers: as of layer_mattes."""
    count, height, width, _ = footage.samples.shape
    clear = {source: np.prod([1 - value for value in values], axis=0) for source, values in layers.items()}
    times = shown_times(recipe, frame, index, direction, count, option(recipe, "plate_reach"))
    moves = camera_moves(recipe, frame, times, width / height)
    doubtful = {source: np.zeros((height, width)) for source in layers}
    if not moves or footage.alpha != "opaque":
        return footage, clear, doubtful
    samples, counts = footage.samples.copy(), dict(clear)
    rows, columns = np.mgrid[:height, :width] + 0.5
    for source in window_frames(recipe, index, direction, count):
        light, lacks = summed(footage, source, "linear"), clear[source] < UNCOVERED
        mixed, share = light.copy(), clear[source].copy()
        near = [other for other in clear if 0 < abs(other - source) <= option(recipe, "plate_reach")]
        for other in sorted(near, key=lambda other: (abs(other - source), other)):
            turn = moves[other][0] / moves[source][0]
            places = turn * (columns + 1j * (height - rows)) / height + moves[other][1] - turn * moves[source][1]
            x, y = places.real * height - 0.5, height - places.imag * height - 0.5
            column, row = np.rint(x).astype(int), np.rint(y).astype(int)
            inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
            shows = clear[other][row.clip(0, height - 1), column.clip(0, width - 1)]
            tie = np.minimum(np.abs(x % 1 - 0.5), np.abs(y % 1 - 0.5)) < 1e-4
            doubtful[source] += lacks & (tie | (np.abs(shows - SEEN) < 1e-4))
            found = lacks & inside & (shows >= SEEN)
            seen = clear[source]
            plate = sampled(summed(footage, other, "linear"), places, False)
            mixed[found] = (seen[..., None] * light + (1 - seen[..., None]) * plate)[found]
            share[found] = np.minimum(seen + (1 - seen) * BORROWED, MOST)[found]
            lacks = lacks & ~found
        colour = to_encoded(mixed[..., :3]) if footage.transfer == "srgb" else mixed[..., :3]
        changed = share != clear[source]
        if footage.levels:
            levels = colour.clip(0, 1) * footage.levels
            doubtful[source] += changed & (np.abs(levels % 1 - 0.5) < HALFWAY).any(axis=-1)
            colour = np.rint(levels) / footage.levels
        samples[source][changed, :3] = colour[changed]
        counts[source] = share
    return footage._replace(samples=samples), counts, doubtful


def strokes_between(region, frame, share, aspect):
    """A region's strokes at a time between two timeline frames."""
    before = strokes_at(region, frame, aspect)
    if not share:
        return before
    after = strokes_at(region, frame + 1, aspect)
    return [moved(stroke, after[i], share) if i < len(after) else stroke for i, stroke in enumerate(before)]


def picture(recipe, frame, footage, index, direction, given=None, mattes=None, layers=None):
    """The picture at a timeline frame that shows the source frame `index`, as a Result. given: coefficients to compose
    with, in place of the exact ones; mattes: as for `laid`; layers: as of layer_mattes, in place of the exact ones.

    Where too little of what lies behind layers is seen, it is doubtful: something else takes its place."""
    _, height, width, _ = footage.samples.shape
    if given is None:
        given = laid(recipe, frame, index, coefficients(recipe, frame, width, height), footage, mattes)
    asked = recipe, frame, footage, index, direction
    plain, own = exposed(*asked, given), layers_at(recipe, frame)
    if not own:
        return Result(plain[0], plain[2])
    layers = layers or layer_mattes(*asked, mattes)
    behind, clear, unsure = uncovered(*asked, layers)
    sums, share, doubtful = exposed(recipe, frame, behind, index, direction, given, clear)
    doubtful = doubtful | (exposed(*asked, given, unsure)[1] > 0)
    result = np.where((share > UNCOVERED)[..., None], plain[0], sums / np.maximum(share, 1e-9)[..., None])
    doubtful = doubtful | plain[2] | (share < CLEAR + ROUNDING) | (np.abs(share - UNCOVERED) < ROUNDING)
    names = [shutter["name"] for shutter in recipe["shutters"]]
    for i, (region, _) in enumerate(own):
        alone = np.zeros_like(given)
        alone[names.index(region["shutter"])] = 1
        colour, cover, unsure = exposed(*asked, alone, {source: values[i] for source, values in layers.items()})
        result = colour + (1 - cover[..., None]) * result
        doubtful = doubtful | unsure
    return Result(result, doubtful)


def exposed(recipe, frame, footage, index, direction, given, weights=None):
    """What coefficients expose (H, W, 4), with frames weighted by weights {source: (H, W)}; the share (H, W) of the
    exposure that these leave; and where it is doubtful."""
    count, height, width, _ = footage.samples.shape
    mix = np.asarray(given, float)
    mix = mix / mix.sum(axis=0)
    blocks = mix.shape[1:]
    mix = mix.reshape(len(mix), -1)
    bars, moves = opened(recipe, frame, index, direction, count, width / height)
    where = positions(recipe, index, direction, count)
    frames = [at_edges(option(recipe, "edges"), place, count) for place in where]
    of = {source: np.ones((height, width)) if weights is None else weights[source] for source in {*frames} - {None}}

    def of_pixels(values):
        block = option(recipe, "aggregate")
        return values.reshape(blocks).repeat(block, 0).repeat(block, 1)[:height, :width]

    total, left = np.zeros((height, width, 4)), np.zeros((height, width))
    doubtful, ways = np.zeros((height, width), bool), [way_of(shutter, frame) for shutter in recipe["shutters"]]
    for way in sorted(set(ways), key=str):
        chosen = [i for i, other in enumerate(ways) if other == way]
        share = mix[chosen].sum(axis=0)
        own = np.where(share > 0, mix[chosen] / np.where(share > 0, share, 1), 1 / len(chosen))
        window = Window(
            own, bars[chosen], bars[0].sum(), None if moves is None else moves[:, chosen], of_pixels,
            footage.alpha == "opaque" and weights is None, where.index(index) if index in where else None,
        )  # fmt: skip
        light = option(recipe, "light")
        lights = [f if f is None else summed(footage, f, light) * of[f][..., None] for f in frames]
        made, unsure = one_way(recipe, way, window, lights)
        cover = made[..., 3]
        if footage.alpha != "opaque":
            plain = recipe | {"light": "linear", "exposure": "normalized"}
            seen = [f if f is None else summed(footage, f, "linear") for f in frames]
            shares = [
                f if f is None else whole(sight * of[f][..., None]) * of[f][..., None]
                for f, sight in zip(frames, seen, strict=True)
            ]
            cover = one_way(plain, way, window, shares)[0][..., 3]
        total += of_pixels(share)[..., None] * made
        left += of_pixels(share) * cover
        doubtful |= unsure & (of_pixels(share) > 0)
    return total, left, doubtful


def whole(light):
    """Light (H, W, 4) as if it covered all of each pixel."""
    return np.concatenate([light[..., :3] / covering(light[..., 3:]), np.ones_like(light[..., 3:])], axis=-1)


def opened(recipe, frame, index, direction, count, aspect):
    """The bars (N, L) of all shutters as they are open, and the turns and shifts (2, N, L), or None, of `motions`."""
    shutters = recipe["shutters"]
    steps, bars = option(recipe, "inbetween"), []
    for shutter in shutters:

        def spread(own, shutter=shutter):
            return in_moments(shutter, own, steps, direction)

        bars.append(bars_at(shutter, frame, option(recipe, "interpolation"), spread))
    bars = np.array(bars)
    for i, shutter in enumerate(shutters):
        if shutter.get("length") == "timeline":
            bars[i] = on_timeline(recipe, bars[i], frame, index, direction, count)
    places = positions(recipe | {"edges": "hold"}, index, direction, count)
    where = positions(recipe, index, direction, count)
    bars, moves = slid(recipe, bars, places, where, count), motions(recipe, frame, index, direction, count, aspect)
    if moves is None:
        return bars, None
    shown_time, turned = np.abs(np.array(where) - index).argmin() + 0.5, np.moveaxis(moves, 1, 0)
    for i, (shutter, move) in enumerate(zip(shutters, turned, strict=True)):
        bars[i] = trailed(recipe, shutter, bars[i], frame, *move, shown_time, aspect)
        share = number_at(recipe.get("camera_influence", 1), frame)
        if shutter.get("follow") == "camera" and share < 1:
            bars[i] = influenced(bars[i], share, shown_time)
    return slid(recipe, bars, where, where, count), moves


def in_moments(shutter, bars, steps, direction):
    """What each moment has of the bars of filmed frames: of its own time, a step long, as much as lies in the half
    intervals between frames whose bars are open, over which these are spread; or of what is lightest or darkest as much
    as the frames count that are nearest."""
    if steps == 1:
        return bars
    if shutter.get("length") == "timeline" or "trail" in shutter:
        return np.repeat(bars / steps, steps)  # the shape of an exposure, which is moved to its moments later
    length, found = len(bars), np.zeros(len(bars) * steps)
    bars = np.where(bars > 1e-9 * bars.sum(), bars, 0)  # rounding leaves some
    frames = np.arange(length) * steps + (steps - 1 if direction < 0 else 0)
    alone = [not any(0 <= j < length and bars[j] > 0 for j in (k - 1, k + 1)) for k in range(length)]
    for moment in range(length * steps):
        for k, frame in enumerate(frames):
            for j in (k - 1, k + 1):
                if not (0 <= j < length and bars[k] > 0 and bars[j] > 0):
                    continue
                half = sorted((frame, (frame + frames[j]) / 2))
                if shutter.get("combine") in ("lightest", "darkest"):
                    is_half = moment == (frame + frames[j]) / 2
                    found[moment] = found[moment] + bars[k] / 2 if is_half else found[moment]
                    found[moment] = bars[k] if half[0] <= moment <= half[1] and not is_half else found[moment]
                    continue
                share = sum(0 <= n < length and bars[n] > 0 for n in (k - 1, k + 1))
                part = overlap(moment - 0.5, moment + 0.5, *half) / (steps / 2)
                found[moment] += bars[k] * part / share
            if alone[k] and moment == frame:
                found[moment] += bars[k]
    return found * (bars.sum() / found.sum())


def on_timeline(recipe, bars, frame, index, direction, count):
    """Bars (L,) that are the shape of an exposure over one frame of the timeline, as those of the source's frames."""
    length, keyed = len(bars), recipe.get("time")

    def place(time):
        return time_at(recipe, time) - 1 if keyed else min(max(index + direction * (time - frame), 0), count - 1)

    times = np.array([-1, -0.5, 0, 0.5, 1])
    ways = np.array([place(frame + time) for time in times]) - place(frame)
    if not keyed and index in (0, count - 1):  # beyond its ends a clip goes on
        if ways[0] == 0:
            ways[:2] = -ways[:2:-1]
        elif ways[4] == 0:
            ways[3:] = -ways[1::-1]
    begin, anchor = {"start": (0, 0), "center": (-0.5, 0.5), "end": (-1, 1)}[option(recipe, "position")]
    before = {"start": 0, "center": (length - 1) // 2, "end": length - 1}[option(recipe, "position")]
    edges = before + anchor + direction * np.interp(begin + np.arange(length + 1) / length, times, ways)
    found = np.zeros(length)
    if edges.max() - edges.min() < NOTHING:
        found[before] = 1
        return found * bars.sum()
    for bar, ends in zip(bars, pairwise(edges), strict=True):
        start, end = sorted(ends)
        if end - start < NOTHING:
            found += bar * (np.arange(length) == np.floor(start + NOTHING))
        else:
            found += bar * np.array([overlap(start, end, k, k + 1) for k in range(length)]) / (end - start)
    if found.sum() <= 1e-9 * bars.sum():
        found[before] = 1
    return found * bars.sum() / found.sum()


def influenced(bars, share, shown_time):
    """Bars (L,) that are open for a share of their time, about the shown frame, which stays."""
    is_open = np.flatnonzero(bars > 1e-9 * bars.sum())
    first, last = is_open[0], is_open[-1] + 1
    own = min(max(shown_time - 0.5, first), last - 1)
    return stretched(bars, first, last, own + share * (first - own), own + 1 + share * (last - own - 1))


def stretched(bars, first, last, start, end):
    """Bars (L,) that were open from `first` to `last`, open from start to end."""
    scale = (end - start) / (last - first)
    spans = list(pairwise(start + (j - first) * scale for j in range(len(bars) + 1)))
    parts = [[bar * overlap(*own, k, k + 1) for bar, own in zip(bars, spans, strict=True)] for k in range(len(bars))]
    return np.array([sum(part) for part in parts]) / scale


# What shutters that combine alike compose with. mix: coefficients (N, n) of the blocks, Σ = 1; bars (N, L); reference:
# the exposure of full brightness; moves: turns and shifts (2, N, L), or None; of_pixels: gives values (H, W) of the
# pixels by those of blocks (n,); sharp: how frames are seen between pixels; before: which of the window is shown
Window = namedtuple("Window", "mix bars reference moves of_pixels sharp before")


def one_way(recipe, way, window, lights):
    """The picture (H, W, 4) of shutters that combine alike, and where it is doubtful. lights: (H, W, 4) of the window's
    frames as they are summed, None: left out"""
    mix, bars, reference, moves, of_pixels, sharp, before = window
    (height, width, _), exposures = next(light for light in lights if light is not None).shape, bars.sum(axis=1)
    normalised, is_moved = bars / exposures[:, None], option(recipe, "interpolation") == "displacement"
    # A picture of each shutter, mixed, or one.
    parts = displaced(bars, mix)[None] if is_moved else normalised[..., None] * mix[:, None]
    kept, lost = shortened(parts, lights, mix)
    y, x = np.mgrid[:height, :width] + 0.5
    here = (x + 1j * (height - y)) / height

    def look(i, k):
        """What is seen of frame k by shutter i, or where positions are mixed."""
        if moves is None:
            return lights[k]
        at = [turn * here + shift for turn, shift in zip(*moves[:, :, k], strict=True)]
        return sampled(
            lights[k], at[i] if not is_moved else sum(of_pixels(c) * p for c, p in zip(mix, at, strict=True)), sharp
        )

    there = [k for k, light in enumerate(lights) if light is not None]
    looks = {k: [look(i, k) for i in range(len(parts))] for k in there}
    averaged = sum(of_pixels(kept[i, k])[..., None] * looks[k][i] for k in there for i in range(len(parts)))
    if way[0] == "average":
        gain = exposures @ mix / reference if option(recipe, "exposure") == "weighted" else np.ones(mix.shape[1])
        scale = of_pixels(gain)[..., None] ** [1, 1, 1, 0]
        return decoded(recipe, averaged) * scale, of_pixels(lost)
    highest = normalised.max(axis=1)
    if way[0] == "median":
        counts = parts
    else:
        counts = parts * (mix / highest[:, None]).sum(axis=0) if is_moved else parts / highest[:, None, None]
    shares = np.ones((1, mix.shape[1])) if is_moved else mix
    seen = []
    for k in there:
        own = [of_pixels(counts[i, k]) for i in range(len(parts))]
        weight, whole = sum(own), sum(of_pixels(c)[..., None] * each for c, each in zip(shares, looks[k], strict=True))
        mean = sum(each[..., None] * sight for each, sight in zip(own, looks[k], strict=True))
        mean = np.where(weight[..., None] > 0, mean / np.where(weight > 0, weight, 1)[..., None], whole)
        seen.append((mean, weight, whole if k == before else None))
    found, unsure, counted = (median if way[0] == "median" else extreme)(way, seen, option(recipe, "light"))
    made = decoded(recipe, np.where((counted > NOTHING)[..., None], found, averaged))
    return made, of_pixels(lost) | unsure | (counted > NOTHING / 100) & (counted < ROUNDING)


def way_of(shutter, frame):
    """How a shutter combines its frames: the way, whether by luminance, its threshold or None, and its softness."""
    way = shutter.get("combine", "average")
    if way in ("average", "median"):
        return way, False, None, 0
    if "threshold" not in shutter:
        return way, shutter.get("by_luminance", False), None, 0
    softness = number_at(shutter.get("softness", 0.1), frame)
    return way, shutter.get("by_luminance", False), number_at(shutter["threshold"], frame), softness


def decoded(recipe, light):
    """Light (H, W, 4) as it was summed, as linear light."""
    if option(recipe, "light") == "linear":
        return light
    alpha = light[..., 3:]
    return np.concatenate([to_linear(light[..., :3] / covering(alpha)) * covering(alpha), alpha], axis=-1)


def extreme(way, seen, light):
    """What is lightest or darkest (H, W, 4) of frames (light, weight, of the shown one its light whatever counts, or
    None), where that is doubtful, and how much counts."""
    mode, by_luminance, threshold, softness = way
    doubtful, offered = np.zeros(seen[0][1].shape, bool), []
    most = np.max([np.ones_like(own) if threshold is not None and w is not None else own for _, own, w in seen], axis=0)
    for colour, weight, whole in seen:
        if threshold is not None:
            straight = colour[..., :3] / covering(colour[..., 3:])
            brightness = (to_linear(straight) if light == "encoded" else straight) @ LUMINANCE
            t = ((brightness - threshold) / max(softness, NOTHING) + 0.5).clip(0, 1)
            passed = 3 * t**2 - 2 * t**3
            doubtful |= (softness < 0.01) & (np.abs(brightness - threshold) < ROUNDING * 10)
            weight = weight * (passed if mode == "lightest" else 1 - passed)
            if whole is not None:
                offered.append((whole, np.ones_like(weight)))
        offered.append((colour, weight))
    colours, weights = (np.array(each) for each in zip(*offered, strict=True))
    counted = sum(own for _, own, _ in seen)
    cover = (weights * colours[..., 3]).max(axis=0) / np.maximum(most, 1e-30)
    there = weights[..., None] > NOTHING / 1000  # less is what the bisection leaves of none
    value = colours[..., :3] if mode == "lightest" else colours[..., 3:] - colours[..., :3]
    value = np.where((mode == "lightest") | (value > 0), weights[..., None] * value, value)
    doubtful |= (there & (weights[..., None] < ROUNDING) & (value < 0)).any(axis=(0, -1))
    if by_luminance:
        rank = np.where(there[..., 0], value @ LUMINANCE, -np.inf)
        order = np.sort(np.concatenate([rank, np.full_like(rank[:1], -np.inf)]), axis=0)
        with np.errstate(invalid="ignore"):
            doubtful |= order[-1] - order[-2] < 1e-4 * np.maximum(1, np.abs(order[-1]))
        best = np.take_along_axis(value, rank.argmax(axis=0)[None, ..., None], axis=0)[0]
    else:
        best = np.where(there, value, -np.inf).max(axis=0)
    best = np.where(there.any(axis=0), best, 0)
    if threshold is not None and any(whole is not None for *_, whole in seen):
        counted = np.ones_like(counted)
    colour = best if mode == "lightest" else cover[..., None] - best
    return np.concatenate([colour, cover[..., None]], axis=-1), doubtful, counted


def median(_way, seen, _light):
    """The weighted median (H, W, 4) of frames, where it is doubtful, and how much counts."""
    colours, weights = np.array([each[0] for each in seen]), np.array([each[1] for each in seen])
    alphas, counted = weights * colours[..., 3], weights.sum(axis=0)
    alphas = np.where(alphas > NOTHING / 1000, alphas, 0)  # less is what the bisection leaves of none
    whole = np.maximum(alphas.sum(axis=0), 1e-30)
    result, doubtful = [], np.zeros(counted.shape, bool)
    for channel in np.moveaxis(colours[..., :3] / np.maximum(colours[..., 3:], 1e-30), -1, 0):
        least = np.full(counted.shape, np.inf)  # that has half of all at it and below
        above = np.full(counted.shape, np.inf)
        for candidate, own in zip(channel, alphas, strict=True):
            below = (alphas * (channel <= candidate)).sum(axis=0) / whole
            doubtful |= (own > 0) & (np.abs(below - 0.5) > 1e-9) & (np.abs(below - 0.5) < 1 / 4096)
            least = np.where((own > 0) & (below >= 0.5 - 1e-9), np.minimum(least, candidate), least)
        share = (alphas * (channel <= least)).sum(axis=0) / whole
        for candidate, own in zip(channel, alphas, strict=True):
            above = np.where((own > 0) & (candidate > least), np.minimum(above, candidate), above)
        is_half = (np.abs(share - 0.5) < 1e-9) & np.isfinite(above)
        least = np.where(np.isfinite(least), least, 0)
        result.append(np.where(is_half, (least + np.where(np.isfinite(above), above, 0)) / 2, least))
    cover = alphas.sum(axis=0) / np.maximum(counted, 1e-30)
    return np.stack([*(each * cover for each in result), cover], axis=-1), doubtful, counted


def shortened(parts, frames, mix):
    """The weights (M, L, n) of M pictures without frames that are left out (None): what remains is normalised, or the
    nearest frame is shown, of several pictures with the weights `mix`. And where that is doubtful (n,)."""
    there = np.array([seen is not None for seen in frames])
    if there.all():
        return parts, np.zeros(parts.shape[-1], bool)
    kept, places = parts * there[:, None], np.flatnonzero(there)
    share = kept.sum(axis=(0, 1))
    is_lost = share <= NOTHING
    middle = (np.arange(len(frames)) + 0.5) @ parts.sum(axis=0) - EARLIER
    apart = np.abs(middle - (places[:, None] + 0.5))
    alone = np.arange(len(frames))[:, None] == places[apart.argmin(axis=0)]
    first, second = np.sort(np.concatenate([apart, np.full_like(apart[:1], np.inf)]), axis=0)[:2]
    doubtful = is_lost & (second - first < ROUNDING) | (share > NOTHING / 100) & (share < ROUNDING)
    shares = mix[:, None] if len(parts) > 1 else 1
    return np.where(is_lost, alone * shares, kept / np.where(is_lost, 1, share)), doubtful
