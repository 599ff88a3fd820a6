"""What scripts share that compare pictures: the extension's command, pictures in 8 bits, measures, and files of rows.

Needs no bpy.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from skimage.metrics import structural_similarity

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from gallery import stills  # noqa: E402
from shutter_addon.core.frames import light  # noqa: E402
from shutter_addon.core.model.effect import Effect  # noqa: E402
from shutter_addon.core.recipes import recipe_file  # noqa: E402
from shutter_addon.media import open_source  # noqa: E402


def similarity(picture: np.ndarray, other: np.ndarray, where: np.ndarray | None = None) -> float:
    """Return the structural similarity (Wang et al. 2004, Gaussian weights) of two 8-bit pictures (H, W, 3): the mean
    over their colors, 1 for equal ones. where: (H, W) bool, the mean over these pixels alone."""
    how = {"gaussian_weights": True, "sigma": 1.5, "use_sample_covariance": False}
    mean, each = structural_similarity(picture, other, channel_axis=2, data_range=255, full=True, **how)
    return float(mean if where is None else each[where].mean())


def psnr(picture: np.ndarray, other: np.ndarray) -> float:
    """Return the peak signal-to-noise ratio of two 8-bit pictures, in decibels."""
    error = np.mean((picture.astype(np.float64) - other) ** 2)
    return float(10 * np.log10(255**2 / max(error, 1e-6)))


def codes(picture: np.ndarray) -> np.ndarray:
    """Encode a scene-linear picture as 8-bit sRGB, as the view transform Standard does."""
    return np.rint(np.clip(light.to_encoded(picture), 0, 1) * 255).astype(np.uint8)


def read(first: Path, index: int = 0) -> np.ndarray:
    """Read a frame (H, W, 3) as it is stored. first: a movie, or the first file of a sequence"""
    with open_source(first) as source:
        return source.read(index)[..., :3]


def read_codes(first: Path, index: int = 0) -> np.ndarray:
    """Read a frame of whole numbers as 8-bit levels."""
    picture = read(first, index)
    return np.rint(picture * (255 / np.iinfo(picture.dtype).max)).astype(np.uint8)


def run(*arguments: object) -> None:
    """Run the extension's command. What it says ends the script."""
    command = [sys.executable, "-m", "shutter_addon", *map(str, arguments)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode:
        fail(done.stderr.strip())


def rendered(
    footage: Path, recipe: dict | Effect, frames: Sequence[int], folder: Path, file_format: str = "exr"
) -> list[Path]:
    """Render frames of the timeline by the command, and return their files."""
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / "recipe.json"
    file.write_text(json.dumps(recipe) if isinstance(recipe, dict) else recipe_file.dump(recipe), encoding="utf-8")
    for frame in frames:
        output = "--output", folder, "--format", file_format
        run("render", footage, "--recipe", file, *output, "--frames", frame)
    return [folder / f"{frame:04d}.{file_format}" for frame in frames]


def labelled(pictures: Sequence[np.ndarray], texts: Sequence[str]) -> np.ndarray:
    return stills.beside(*(stills.labelled(p / np.float32(255), text) for p, text in zip(pictures, texts, strict=True)))


def write_rows(path: Path | None, rows: object) -> None:
    """Write what was measured as JSON, whole or not at all; None: nowhere."""
    if path:
        part = path.with_name(f".part-{path.name}")
        part.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
        part.replace(path)


def fail(sentence: str) -> None:
    print(sentence, file=sys.stderr)
    sys.exit(2)


def listed(of: type) -> object:
    """Return what reads an option of values with commas between."""
    return lambda text: [of(part) for part in text.split(",")]


def parser_of(about: str, name: str, size: tuple[int, int], samples: int) -> argparse.ArgumentParser:
    """Return the options of scripts that render what they compare with. name: of the sheet that they write"""

    def size_in(text: str) -> tuple[int, ...]:
        match = re.fullmatch(r"(\d+)x(\d+)", text)
        if not match or min(map(int, match.groups())) < 16:
            raise argparse.ArgumentTypeError(f"{text!r} is not WIDTHxHEIGHT of 16 or more")
        return tuple(map(int, match.groups()))

    parser = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("--output", type=Path, default=ROOT / "out" / name, metavar="DIR", help=f"where {name}.png is written")
    add("--json", type=Path, metavar="FILE", help="where the rows are written")
    add("--size", type=size_in, default=size, metavar="WIDTHxHEIGHT")
    add("--samples", type=int, default=samples, help="for each pixel of Cycles' pictures")
    return parser


def measured(name: str, parser: argparse.ArgumentParser, args: argparse.Namespace, head: str, measure) -> np.ndarray:
    """Print a table of what is measured, and write rows and pictures to where the options of `parser_of` say.

    Args:
        measure: is given the options and a folder; returns the rows and a sheet of pictures.
    """
    try:
        for folder in (args.output, *([args.json.parent] if args.json else [])):
            folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        parser.error(f"{error.filename}: {error.strerror}")
    print(head, flush=True)
    with tempfile.TemporaryDirectory() as folder:
        rows, sheet = measure(args, Path(folder))
    stills.save(sheet, args.output / f"{name}.png")
    write_rows(args.json, rows)
    return sheet
