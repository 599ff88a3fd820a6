"""Media: movies in several codecs and containers and image sequences of all sample types, damaged, or not what they are
called; read onwards and in disorder, and rendered."""

import json

import numpy as np

from . import hostile, recipes, trial

COUNT = 6
H264 = "libx264", {"options": {"bf": "2", "g": "4"}}
MOVIES = {  # name: what the tests' make_movie is given
    "h264.mp4": H264,
    "h264.mkv": H264,
    "h264.ts": H264,
    "hevc.mp4": ("libx265", {"options": {"x265-params": "pools=none:frame-threads=1:log-level=none:keyint=4"}}),
    "mpeg4.avi": ("mpeg4", {"options": {"bf": "1", "g": "3"}}),
    "mpeg2.mpg": ("mpeg2video", {"options": {"g": "3"}}),
    "vp9.webm": ("libvpx-vp9", {"options": {"g": "3", "cpu-used": "8"}}),
    "alpha.webm": ("libvpx-vp9", {"pix_fmt": "yuva420p", "options": {"g": "3", "cpu-used": "8"}}),
    "prores.mov": ("prores_ks", {"pix_fmt": "yuva444p10le"}),
    "ffv1.mkv": ("ffv1", {"pix_fmt": "bgr0"}),
    "deep.mkv": ("ffv1", {"pix_fmt": "gbrp16le"}),
    "mjpeg.avi": ("mjpeg", {"pix_fmt": "yuvj420p"}),
    "png.mov": ("png", {"pix_fmt": "rgba"}),
    "animation.gif": ("gif", {"pix_fmt": "rgb8"}),
    "sound.mkv": ("libx264", {"seconds": 1}),
}
IMAGES = (  # ending, sample type, channels
    *(("png", "uint8", 3), ("png", "uint8", 4), ("png", "uint16", 4), ("png", "uint8", 1), ("png", "uint16", 2)),
    *(("jpg", "uint8", 3), ("jpg", "uint8", 1), ("bmp", "uint8", 3), ("tga", "uint8", 4), ("sgi", "uint8", 4)),
    *(("tif", "uint8", 3), ("tif", "uint16", 4), ("tif", "float", 4), ("tif", "half", 3), ("webp", "uint8", 4)),
    *(("exr", "half", 3), ("exr", "half", 4), ("exr", "float", 4), ("exr", "float", 1), ("jp2", "uint8", 3)),
    *(("dpx", "uint16", 3), ("dpx", "uint8", 4), ("hdr", "float", 3), ("ppm", "uint8", 3)),
)
NAMES = ("f20261121", "f2147483648", "f" + "9" * 60, "f1", "F0001", "f0001 (1)", "f-1", "f0002\udcff", "f٣")


def make(random, folder):
    hostile.outside(folder)
    (folder / "in").mkdir()
    file = _movie(random, folder / "in") if random.random() < 0.45 else _sequence(random, folder)
    order = [random.randrange(COUNT) for _ in range(COUNT)]
    (folder / "plan.json").write_text(json.dumps({"file": file.name, "order": order, "render": random.random() < 0.4}))


def _movie(random, folder):
    from footage import make_movie

    name = random.choice(sorted(MOVIES))
    codec, more = MOVIES[name]
    options = {"threads": "1", **more.get("options", {})}
    path = make_movie(folder / name, codec, COUNT, **more | {"size": (64, 32), "options": options})
    path.write_bytes(hostile.damaged(random, path.read_bytes()))
    if random.random() < 0.05:
        path = path.rename(path.with_suffix(random.choice((".png", ".exr", ".mp4", ".txt", ""))))
    return path


def _sequence(random, folder):
    kind, count = random.choice(IMAGES), random.choice((1, 3, 3, COUNT))
    files = [_picture(random, folder / "in" / f"f{i + 1:04d}", kind) for i in range(count)]
    for file in random.sample(files, random.choice((0, 1, 1, count))):
        file.write_bytes(hostile.damaged(random, file.read_bytes()))
    if random.random() < 0.2:
        hostile.put_odd(random, random.choice(files), folder)
    if random.random() < 0.2:
        other = _picture(random, folder / "in" / "other", random.choice(IMAGES), random.choice(((20, 12), (64, 32))))
        other.replace(random.choice([file for file in files[1:] if not file.is_dir()] or [other]))
    if random.random() < 0.2:
        _picture(random, folder / "in" / random.choice(NAMES), kind)
    return files[0]


def _picture(random, stem, kind, size=(20, 12)):
    from footage import save_image

    ending, samples, channels = kind
    pixels = np.random.default_rng(random.getrandbits(32)).random((*size[::-1], channels), np.float32)
    path = save_image(stem.parent / f"new.{ending}", pixels, samples)
    return path.rename(stem.with_name(f"{stem.name}.{ending}"))


def run(folder):
    plan = json.loads((folder / "plan.json").read_text())
    path = folder / "in" / plan["file"]
    trial.forked(lambda: _read(path, plan["order"]))
    if plan["render"]:
        _render(folder, path)


def _read(path, order):
    onwards, again, jumping = _frames(path, range(COUNT)), _frames(path, range(COUNT)), _frames(path, order)
    if _is_movie(path) or path.suffix == ".tif":  # libtiff leaves memory as it was where compressed data end early
        return
    if onwards != again:
        raise trial.Fault(f"other frames from the same file: {onwards}, {again}")
    for index, found in jumping.items():
        if found != onwards[index]:
            what = "is found" if "nothing" in (found, onwards[index]) else "differs"
            raise trial.Fault(f"frame {index} {what} in another order: {order}")


def _is_movie(path) -> bool:
    """Whether its frames may differ from decode to decode: what FFmpeg makes of damaged data, without a word."""
    return path.stem in {name.partition(".")[0] for name in MOVIES}


def _frames(path, order) -> dict:
    """A hash of each frame in that order, or that there is nothing."""
    from shutter_addon.media import MediaError, open_source

    found = {}
    with trial.only(MediaError), open_source(path) as source:
        for index in (index for index in order if index < source.count):
            found[index] = "nothing"
            with trial.only(MediaError):
                frame = source.read(index)
                found[index] = hash(frame.tobytes())
                if frame.shape != (source.height, source.width, 4) or frame.dtype != source.dtype:
                    raise trial.Fault(f"a frame of {frame.shape} {frame.dtype}")
    return found


def _render(folder, path):
    (folder / "out").mkdir()
    shutters = [{"name": "A", "bars": [1, 1, 0]}, {"name": "B", "bars": [0, 0, 1]}]
    regions = [{"shutter": "B", "strokes": [[[0.1, 0.1], [0.6, 0.7]]]}]
    recipe = folder / "out" / "recipe.json"
    said = {"version": 2, "window": 3, "inbetween": 2, "shutters": shutters, "regions": regions}
    recipe.write_text(json.dumps(said))
    for output in ("a", "b"):
        recipes.command(None, "render", path, "--recipe", recipe, "--output", folder / "out" / output)
    if not _is_movie(path):
        recipes.same_pictures(folder / "out" / "a", folder / "out" / "b")
