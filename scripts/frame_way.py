"""Draws the ways of a frame through the rooms, docs/*_frame.svg, from the tables of docs/developers.md.

python scripts/frame_way.py
"""

import re
from pathlib import Path
from typing import NamedTuple
from xml.sax.saxutils import escape

DOCS = Path(__file__).resolve().parents[1] / "docs"
NAMES = "rendered_frame", "preview_frame"
# From the interface down to what is computed, left to right.
_ROOMS = ("blender/interface", "blender/rendering", "blender/data", "media", "core", "compute")
_LANE, _ROW, _TOP, _LEFT, _WIDTH = 92, 22, 46, 60, 1180  # pixels


class Stop(NamedTuple):
    """path: of the file, below shutter_addon; function: its qualified name; what: happens there"""

    path: str
    function: str
    what: str

    @property
    def room(self) -> str:
        return next(room for room in _ROOMS if self.path.startswith(room + "/"))

    @property
    def label(self) -> str:
        return self.function if "." in self.function else f"{Path(self.path).stem}.{self.function}"


def ways() -> dict[str, list[Stop]]:
    """The stops of the page's tables, by the picture's name."""
    page = (DOCS / "developers.md").read_text(encoding="utf-8")
    section = page.partition("\n## How a frame is made\n")[2].partition("\n## ")[0]
    tables = section.split("| File | Function |")[1:]
    rows = (re.findall(r"(?m)^\| `(.+?)` \| `(.+?)` \| (.*)\|$", table) for table in tables)
    return {name: [Stop(p, f, what.strip()) for p, f, what in row] for name, row in zip(NAMES, rows, strict=True)}


def drawn(stops: list[Stop]) -> str:
    """An SVG: a lane for each room, and the way from stop to stop down through them."""
    rooms = [room for room in _ROOMS if any(stop.room == room for stop in stops)]
    places = [(_LEFT + _LANE * rooms.index(stop.room), _TOP + _ROW * row) for row, stop in enumerate(stops)]
    text, height = _LEFT + _LANE * len(rooms) - 30, _TOP + _ROW * len(stops)
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {height}"',
        ' font-family="sans-serif" font-size="12">',
        f'<rect width="{_WIDTH}" height="{height}" fill="#fff"/>',
    ]
    for lane, room in enumerate(rooms):
        x = _LEFT + _LANE * lane
        lines.append(f'<line x1="{x}" y1="{_TOP - 16}" x2="{x}" y2="{height - 8}" stroke="#ddd" stroke-width="2"/>')
        for row, part in enumerate(room.split("/")):
            lines.append(f'<text x="{x}" y="{14 + 13 * row}" text-anchor="middle" fill="#555">{part}</text>')
    way = " ".join(f"{x},{y}" for x, y in places)
    lines.append(f'<polyline points="{way}" fill="none" stroke="#2a6fb0" stroke-width="1.5"/>')
    for (x, y), stop in zip(places, stops, strict=True):
        lines.append(f'<circle cx="{x}" cy="{y}" r="4" fill="#2a6fb0"/>')
        what = re.sub(r"`", "", stop.what)
        lines.append(
            f'<text x="{text}" y="{y + 4}"><tspan font-family="monospace">{escape(stop.label)}</tspan>'
            f'<tspan fill="#777" dx="8">{escape(what)}</tspan></text>'
        )
    return "\n".join([*lines, "</svg>", ""])


if __name__ == "__main__":
    for name, stops in ways().items():
        (DOCS / f"{name}.svg").write_text(drawn(stops), encoding="utf-8")
