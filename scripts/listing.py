"""Makes the pictures that a listing of the extension needs, docs/listing: the featured one and the icon.

python scripts/listing.py
Both are of the gallery's pendulum, in the sizes that extensions.blender.org asks for: 1920 × 1080, and 256 × 256.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from gallery import pendulum, scenes, stills
from gallery.item import HERE, ROOT, Shot
from scripts.gallery import render

SIZE, ICON = (1920, 1080), 256
FRAME = 40
# The pendulum's disc in the frame, in fractions of its height: its middle from the left and the top, and its radius.
DISC = (0.94, 0.575, 0.262)


def main() -> int:
    folder, recipe = ROOT / "out" / "listing", HERE / pendulum.ITEM.recipes[0]
    scenes.SIZE = SIZE
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


if __name__ == "__main__":
    sys.exit(main())
