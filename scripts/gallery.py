"""Makes items of the gallery: for each its footage, and a film, an edit and a recipe per recipe, and a still.

python scripts/gallery.py [--output DIR] [--docs] NAME … | all
"""

import argparse
import shutil
import subprocess
import sys
from importlib import import_module
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from gallery import NAMES, stills
from gallery.item import HERE, ROOT, Item, Shot


def main() -> int:
    parser = argparse.ArgumentParser("gallery", description="The paper's figures, made again.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"{', '.join(NAMES)}; or all")
    where = "instead of out/gallery; scripts/gallery takes it from the project's folder"
    parser.add_argument("--output", type=Path, default=ROOT / "out" / "gallery", metavar="DIR", help=where)
    parser.add_argument("--docs", action="store_true", help="renew the manual's pictures, docs/gallery/NAME.jpg")
    arguments = parser.parse_args()
    names = NAMES if arguments.names == ["all"] else arguments.names
    if unknown := [name for name in names if name not in NAMES]:
        print(f"gallery: there is no {unknown[0]}; there are {', '.join(NAMES)}", file=sys.stderr)
        return 2
    if not names:
        for item in map(load, NAMES):
            figure = f"Figure {item.figure}" if item.figure else "new"
            print(f"{item.name:16} {figure + ':':11}{item.title}")
    for item in map(load, names):
        try:
            code = make(item, arguments.output / item.name, arguments.docs)
        except OSError as error:
            print(f"gallery: {error.filename or arguments.output}: {error.strerror or error}", file=sys.stderr)
            return 2
        if code:
            return code
    return 0


def load(name: str) -> Item:
    return import_module(f"gallery.{name}").ITEM


def make(item: Item, folder: Path, docs: bool) -> int:
    """Makes all of an item's files; the exit code of what failed, or 0."""
    folder = folder.resolve()  # the command runs in another
    folder.mkdir(parents=True, exist_ok=True)
    footage = item.footage(folder / "footage")
    shots = []
    for name in item.recipes:
        recipe = Path(shutil.copy(HERE / name, folder))
        film, edit = recipe.with_suffix(".mp4"), recipe.with_suffix(".blend")
        if code := render(footage, recipe, film, item.frames, edit):
            return code
        edit.with_suffix(".blend1").unlink(missing_ok=True)  # Blender keeps the one before
        shots.append(Shot(footage, recipe, film, item.frames[0]))
    still = item.still(*shots)
    stills.save(still, folder / f"{item.name}.png")
    if docs:
        target = ROOT / "docs" / "gallery" / f"{item.name}.jpg"
        target.parent.mkdir(exist_ok=True)
        stills.save(still, target)
    print(f"{folder}: {', '.join(sorted(path.name for path in folder.iterdir()))}")
    return 0


def render(footage: Path, recipe: Path, film: Path, frames: tuple[int, int], edit: Path) -> int:
    """A film and its edit by the extension's own command; its exit code."""
    options = ["--recipe", recipe, "--output", film, "--frames", "{}:{}".format(*frames), "--save", edit]
    command = [sys.executable, "-m", "shutter_addon", "render", footage, *options]
    return subprocess.run(list(map(str, command)), cwd=ROOT, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
