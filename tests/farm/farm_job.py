"""The demo's edit, small, shorter, and smooth; and what a farm makes of it."""

import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import av

ROOT = Path(__file__).parents[2]
FARM = ROOT / "farm"
FRAMES = 32
SIZE = 160, 90
RECIPE = json.loads((ROOT / "assets" / "bunny.json").read_text()) | {"version": 2, "inbetween": 2}


@dataclass
class Job:
    """A folder with an edit, its footage, and room for what a farm makes of it."""

    folder: Path

    @property
    def edit(self):
        return self.folder / "edit.blend"

    @property
    def pictures(self):
        return self.folder / "pictures"

    @property
    def movie(self):
        return self.folder / "film.mp4"

    def result(self):
        """The bytes of every picture and of the movie, by name."""
        return {path.name: path.read_bytes() for path in [*sorted(self.pictures.glob("*.png")), self.movie]}

    def check(self, expected):
        """Fails where a result is not the same bits as another's."""
        found, wanted = self.result(), expected.result()
        assert found.keys() == wanted.keys(), sorted(found)
        others = [name for name in wanted if found[name] != wanted[name]]
        assert not others, f"other bits in {', '.join(others)}: {self.folder} and {expected.folder}"


def shutter(*arguments):
    command = [sys.executable, "-m", "shutter_addon", *map(str, arguments)]
    subprocess.run(command, check=True, capture_output=True, timeout=120)


def saved_job(folder, footage, **changes):
    """A job whose edit is saved, of the footage's first frames; changes: of the recipe."""
    job = Job(folder)
    shrink(footage, folder / "footage.mp4")
    (folder / "recipe.json").write_text(json.dumps(RECIPE | changes))
    shutter("render", folder / "footage.mp4", "--recipe", folder / "recipe.json", "--save", job.edit)
    return job


def shrink(source, path):
    """The first frames of a movie and its sound, small."""
    with av.open(str(source)) as movie, av.open(str(path), "w") as out:
        picture, sound = movie.streams.video[0], movie.streams.audio[0]
        small = out.add_stream("libx264", rate=picture.average_rate, options={"crf": "12"})
        small.width, small.height, small.pix_fmt = *SIZE, "yuv420p"
        copied = out.add_stream_from_template(sound)
        length = FRAMES / picture.average_rate
        for packet in movie.demux(sound):
            if packet.dts is not None and packet.pts * packet.time_base < length:
                packet.stream = copied
                out.mux(packet)
        movie.seek(0)
        for index, frame in zip(range(FRAMES), movie.decode(picture), strict=False):
            frame = frame.reformat(*SIZE, format="yuv420p")
            frame.pts, frame.time_base = index, 1 / picture.average_rate
            out.mux(small.encode(frame))
        out.mux(small.encode())
