"""Makes the pictures that a listing of the extension needs, docs/listing: the featured one and the icon.

python scripts/listing.py
Both are of the gallery's pendulum, in the sizes that extensions.blender.org asks for: 1920 × 1080, and 256 × 256.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np

from gallery import pendulum, scenes, stills
from gallery.item import HERE, ROOT, Shot
from scripts.gallery import render

SIZE, ICON = (1920, 1080), 256
FRAME, EXPOSED = 40, range(27, 54)  # of the footage, which is exposed around that frame
# The pendulum's disc in the frame, in fractions of its height: its middle from the left and the top, and its radius.
DISC = (0.94, 0.575, 0.262)


def main() -> int:
    folder, recipe = ROOT / "out" / "listing", HERE / pendulum.ITEM.recipes[0]
    scenes.SIZE = SIZE
    _blacken_unseen(folder / "footage")
    footage, film = pendulum.footage(folder / "footage"), folder / "film.mp4"
    if code := render(footage, recipe, film, (FRAME, FRAME), folder / "edit.blend"):
        return code
    picture = Shot(footage, recipe, film, first=FRAME).result(FRAME)
    docs = ROOT / "docs" / "listing"
    docs.mkdir(exist_ok=True)
    stills.save(picture, docs / "featured.jpg")
    x, y, radius = (round(each * SIZE[1]) for each in DISC)
    disc = picture[y - radius : y + radius, x - radius : x + radius]
    stills.save(stills.scaled(disc, ICON), docs / "icon.png")
    return 0


def _blacken_unseen(folder: Path) -> None:
    """Writes the frames that the picture does not show, which else take Cycles as long as those that it does."""
    folder.mkdir(parents=True, exist_ok=True)
    for frame in set(range(1, pendulum.COUNT + 1)) - set(EXPOSED):
        stills.save(np.zeros((*SIZE[::-1], 3), np.float32), folder / f"{frame:04}.png")


if __name__ == "__main__":
    sys.exit(main())
