"""Folders of in-between frames: damaged, with other things in the place of their files, among files of strangers."""

import json
import zlib

import numpy as np

from . import hostile, recipes, trial

COUNT, SETTINGS = 4, (2, "quick")
STEPS = ("state", "size", "estimate", "read", "build", "read", "state", "remove", "size")
STRANGERS = ("notes.txt", "99.png", "mine.exr", "123456789.png", "0000000a.same")


def make(random, folder):
    from footage import save_image

    from shutter_addon.media import inbetween, open_source

    hostile.outside(folder)
    (folder / "in").mkdir()
    ending, samples = random.choice((("png", "uint8"), ("exr", "half")))
    y, x = np.mgrid[:24, :40]
    for i in range(COUNT):
        ramp = np.stack([x * 4 + i * 3, y * 6, x + y + i], axis=-1).astype(np.float32) / 255
        save_image(folder / "in" / f"f{i + 1:04d}.{ending}", ramp, samples)
    with open_source(folder / "in" / f"f0001.{ending}") as source:
        inbetween.build(source, folder / "cache", *SETTINGS)
        frames = inbetween.InbetweenSource(source, folder / "cache", *SETTINGS)
        frames = [_hash(frames.read(index)) for index in range(frames.count)]
    cache = next((folder / "cache").iterdir())
    strangers = [cache / name for name in random.sample(STRANGERS, random.choice((0, 0, 1, 3)))]
    for path in strangers:
        if not path.exists():
            path.write_text("mine")
    for _ in range(random.choice((1, 1, 2, 4))):
        random.choice((_damage, _damage, _put_odd, _spoil_manifest, _add_names, _add_twin))(random, cache, folder)
    plan = {
        "file": f"f0001.{ending}",
        "frames": frames,
        "kept": [str(path.relative_to(folder)) for path in strangers if _is_mine(path)],
        "steps": [step for step in random.sample(STEPS, len(STEPS)) if random.random() < 0.6],
        "command": random.random() < 0.3,
    }
    (folder / "plan.json").write_text(json.dumps(plan))


def _is_mine(path) -> bool:
    return path.is_file() and not path.is_symlink() and path.read_bytes() == b"mine"


def _files(cache) -> list:
    """Those in which damage shows: EXR pictures have no checksums."""
    files = (path for path in cache.rglob("*") if path.is_file() and not path.is_symlink() and path.suffix != ".exr")
    return sorted(path for path in files if not _is_mine(path))


def _damage(random, cache, _folder):
    if files := _files(cache):
        path = random.choice(files)
        path.write_bytes(hostile.damaged(random, path.read_bytes()))


def _put_odd(random, cache, folder):
    places = [cache, cache / "manifest.json", cache / "00000001.png", *_files(cache)]
    hostile.put_odd(random, random.choice([path for path in places if path.parent.is_dir()]), folder)


def _spoil_manifest(random, cache, _folder):
    path = cache / "manifest.json"
    try:
        data = json.loads(path.read_bytes()) if path.is_file() else {}
    except ValueError:
        return
    if data:
        path.write_bytes(hostile.as_json(hostile.spoiled(random, data, random.choice((1, 1, 3)))))


def _add_names(random, cache, _folder):
    """Names of ours, of frames and pairs that there are not."""
    if cache.is_dir():
        number = random.choice((COUNT, 99, 99999999))
        (cache / f"{number:08d}.{random.choice(('same', 'cut', 'png', 'exr'))}").touch()


def _add_twin(_random, cache, _folder):
    """A stranger's folder with one of our manifests."""
    twin = cache.with_name("twin")
    if (cache / "manifest.json").is_file() and not twin.exists():
        twin.mkdir()
        (twin / "manifest.json").write_bytes((cache / "manifest.json").read_bytes())
        (twin / "00000001.png").write_text("mine")


def run(folder):
    plan = json.loads((folder / "plan.json").read_text())
    trial.forked(lambda: _take(folder, plan, plan["steps"]))
    if plan["command"]:
        options = "--factor", SETTINGS[0], "--cache", folder / "cache"
        recipes.command(None, "inbetween", folder / "in" / plan["file"], *options)
    trial.forked(lambda: _take(folder, plan, ["whole"]))
    for name in plan["kept"]:
        if not _is_mine(folder / name):
            raise trial.Fault(f"a stranger's file is gone: {name.split('/', 2)[2]}")


def _take(folder, plan, steps):
    from shutter_addon.media import MediaError, inbetween, inbetween_cache, open_source

    def read(must=False):
        """Every frame is the right one, or there is a sentence."""
        frames = inbetween.InbetweenSource(source, place, *SETTINGS)
        for index, expected in enumerate(plan["frames"]):
            try:
                found = _hash(frames.read(index))
            except MediaError as error:
                trial.is_whole(str(error))
                if must:
                    raise trial.Fault(f"frame {index} is missing from what was built: {error}") from None
                continue
            if found != expected:
                raise trial.Fault(f"frame {index} is another one")

    def whole():
        """What is built can be read; where a file is damaged within, after all were removed."""
        ready = inbetween.build(source, place, *SETTINGS).name == "ready"
        try:
            read(must=ready)
        except trial.Fault as fault:
            if "remove in-between frames, and build again" not in str(fault):
                raise
            inbetween_cache.purge(place, source)
            read(must=inbetween.build(source, place, *SETTINGS).name == "ready")

    does = {
        "state": lambda: inbetween_cache.state(source, place, *SETTINGS),
        "size": lambda: inbetween_cache.size(place, source),
        "estimate": lambda: inbetween.estimate(source),
        "read": read,
        "build": lambda: inbetween.build(source, place, *SETTINGS),
        "remove": lambda: inbetween_cache.purge(place, source),
        "whole": whole,
    }
    place = folder / "cache"
    with open_source(folder / "in" / plan["file"]) as source:
        for step in steps:
            with trial.only(MediaError):
                does[step]()


def _hash(frame) -> str:
    return f"{zlib.crc32(frame.tobytes()):08x}"
