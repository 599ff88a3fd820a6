"""Values that nobody expects, damaged bytes, and what stands where a file should."""

import copy
import json
import os
from pathlib import Path

from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st

NUMBERS = (
    *(0, -0.0, 1, -1, 2, 0.5, 1 / 3, 255, 256, 257, 65536, 100_001, 2**31 - 1, 2**31, 2**32, 2**53 + 1, 2**63),
    *(5e-324, 1e-46, 1e-30, 1e-7, 1e6, 1e7, -1e7, 3e9, 1e12, -1e12, 1e30, 1e39, 1e300, 1.7e308, -1.7e308),
    *(float("nan"), float("inf"), float("-inf")),
)
TEXTS = (
    *("", " ", "\0", "a\0b", "\ud800", "\n\r\t", "\u202e\u0301", "a" * 100_000, "ß漢🎬", "%s%n", "\\", '"', "1"),
    *("true", "../../outside", "/outside/keep.txt", "//outside", "####", "{blend_name}", "S0.001", "Infinity"),
)
DIGITS, DEEP = "@digits@", "@deep@"  # what json.dumps cannot write
_JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
    max_leaves=6,
)


def drawn(strategy, random):
    """A value of a strategy, by that source of chance alone."""
    found = []

    # The first examples are the plainest.
    @settings(max_examples=4, phases=[Phase.generate], database=None, suppress_health_check=list(HealthCheck))
    @seed(random.getrandbits(64))
    @given(strategy)
    def take(value):
        found.append(value)

    take()
    return found[-1]


def value(random):
    """Anything that JSON can hold, and what else as_json can write."""
    kind = random.randrange(8)
    if kind < 3:
        return random.choice((random.choice(NUMBERS), random.uniform(-2, 2), random.lognormvariate(0, 9)))
    if kind < 5:
        return random.choice(TEXTS)
    return drawn(_JSON, random) if kind < 7 else random.choice((DIGITS, DEEP, [], {}, None, True, [[]]))


def spoiled(random, data, times: int):
    """JSON data with so many of its places made wrong."""
    top = {"": data}
    for _ in range(times):
        holder, key = random.choice(list(_places(top)))
        match random.choice(("replace", "replace", "replace", "remove", "more", "swap", "insert")):
            case "replace":
                holder[key] = value(random)
            case "remove":
                del holder[key]
            case "more":
                _multiply(random, holder, key)
            case "swap":
                other, place = random.choice(list(_places(top)))
                holder[key] = copy.deepcopy(other[place])
            case "insert" if isinstance(holder, dict):
                holder[random.choice(TEXTS)] = value(random)
            case "insert":
                holder.insert(key, value(random))
        if not top:
            return value(random)
    return top[""]


def _places(holder):
    for key, inner in list(holder.items() if isinstance(holder, dict) else enumerate(holder)):
        yield holder, key
        if isinstance(inner, (dict, list)):
            yield from _places(inner)


def _multiply(random, holder, key):
    """Many of what there are a few of, with names and frames of their own."""
    if isinstance(holder, dict):
        holder[key] = [holder[key]] * 3
        return
    for count in range(random.choice((2, 30, 20_000 if len(json.dumps(holder[key])) < 300 else 300))):
        another = copy.deepcopy(holder[key])
        if isinstance(another, dict):
            own = {"name": f"{another.get('name')} {count}", "frame": 1000 + count}
            another |= {field: own[field] for field in own if field in another}
        holder.append(another)


def as_json(data) -> bytes:
    text = json.dumps(data).replace(f'"{DIGITS}"', "9" * 5000)
    return text.replace(f'"{DEEP}"', "[" * 100_000 + "]" * 100_000).encode()


def damaged(random, data: bytes) -> bytes:
    """Bits flipped, numbers made extreme, bytes taken out or repeated, the end cut off; often near either end, where
    formats keep what matters."""
    data = bytearray(data)
    for _ in range(random.choice((1, 1, 1, 2, 8, 64))):
        if not data:
            break
        place = random.randrange(random.choice((min(len(data), 64), min(len(data), 512), len(data))))
        place = random.choice((place, place, len(data) - 1 - place))
        length = random.choice((1, 2, 4, 8, 100))
        match random.choice(("flip", "flip", "flip", "number", "number", "fill", "remove", "repeat", "cut")):
            case "flip":
                data[place] ^= 1 << random.randrange(8)
            case "number":
                extreme = random.choice((0, 1, 255, 2**31 - 1, 2**31, 2**32 - 1, random.getrandbits(32)))
                data[place : place + 4] = extreme.to_bytes(4, random.choice(("big", "little")))
            case "fill":
                data[place : place + length] = bytes([random.choice((0, 255, 127, 128))]) * length
            case "remove":
                del data[place : place + length]
            case "repeat":
                data[place:place] = data[place : place + length] * random.choice((1, 3, 1000))
            case "cut":
                del data[place:]
    return bytes(data)


def outside(folder: Path) -> Path:
    """A folder in the input's that nothing may touch, whose names might be taken for the product's."""
    there = folder / "outside"
    (there / "folder").mkdir(parents=True, exist_ok=True)
    for name in ("keep.txt", "00000001.png", "folder/keep.txt", "folder/00000001.exr", "folder/a.sha256"):
        (there / name).write_text("mine")
    return there


def put_odd(random, path: Path, top: Path) -> None:
    """Puts something else in the place of a file or folder; top: the input's folder."""
    if path.is_dir() and not path.is_symlink():
        path.rename(path.with_name(f"{path.name} before"))
    else:
        path.unlink(missing_ok=True)
    there = Path(os.path.relpath(outside(top), path.parent))
    match random.choice(("nothing", "empty", "noise", "folder", "pipe", "file", "new", "elsewhere", "itself")):
        case "empty":
            path.touch()
        case "noise":
            path.write_bytes(random.randbytes(random.choice((10, 1000))))
        case "folder":
            path.mkdir()
            (path / "keep.txt").write_text("mine")
        case "pipe":
            os.mkfifo(path)
        case "file":
            path.symlink_to(there / random.choice(("keep.txt", "00000001.png")))
        case "new":
            path.symlink_to(there / "new")
        case "elsewhere":
            path.symlink_to(there / "folder")
        case "itself":
            path.symlink_to(path.name)
