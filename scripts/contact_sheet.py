"""A contact sheet of a film made with a recipe: source, scribbles, coefficients and result of some of its frames.

python scripts/contact_sheet.py SOURCE RECIPE RESULT SHEET.png FRAME …
"""

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from gallery import stills
from gallery.item import Shot
from gallery.stills import Panel
from shutter_addon.core.recipes.recipe import RecipeError
from shutter_addon.media import MediaError


def row(shot: Shot, frame: int):
    return stills.row(
        Panel(shot.source(frame), f"Source, frame {frame}"),
        Panel(shot.scribbles(frame, 0.4), "Scribbles"),
        Panel(shot.coefficients(frame), "Mattes"),
        Panel(shot.result(frame), "Result"),
    )


def main() -> int:
    parser = argparse.ArgumentParser("contact_sheet", description="A contact sheet of a film made with a recipe.")
    parser.add_argument("source", type=Path, metavar="SOURCE")
    parser.add_argument("recipe", type=Path, metavar="RECIPE")
    parser.add_argument("result", type=Path, metavar="RESULT", help="the film, from the source's first frame on")
    parser.add_argument("sheet", type=Path, metavar="SHEET", help="what is made: PNG or JPEG, by its ending")
    parser.add_argument("frames", type=int, nargs="+", metavar="FRAME", help="timeline frames; 1 is the first")
    arguments = parser.parse_args()
    shot = Shot(arguments.source, arguments.recipe, arguments.result, first=1)
    try:
        stills.save(stills.sheet(*(row(shot, frame) for frame in arguments.frames)), arguments.sheet)
    except (RecipeError, MediaError, OSError) as error:
        print(f"contact_sheet: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
