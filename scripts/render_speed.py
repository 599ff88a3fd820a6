"""How quick a whole render is, from movie to movie, and what its processor time goes into, beside three references.

    python scripts/render_speed.py [FOOTAGE …] [--window 64] [--rounds 3] [--json FILE]
    blender -b --factory-startup --python scripts/render_speed.py -- …

Needs Blender as a library (bpy), or a Blender that has the extension's packages. Ways, interleaved in one run:
ours: FOOTAGE under an effect of three shutters, scribbled, through the sequencer;
saved: the same edit as Blender renders it by itself, from a file by `blender -b -a`, with dither and all;
plain: the movie strip alone, through the sequencer, to the same output;
echo: the edit of ours, but its engine gives the source's own frames, decoded and made scene-linear ahead by a thread;
tmix: `ffmpeg -vf tmix` of as many frames, with the codec settings of Blender's output. It takes ffmpeg from PATH. Its
film is blurred all over, which costs the encoder less: it is told, not judged.
Films are silent: sound is encoded on Blender's own thread, where it could not be told from the rest. Each begins with
nothing decoded and nothing compiled. All figures are medians. The films are checked: their length, what they show, and
ours against the NumPy compositor.

Processor time is that of the whole process, or of ffmpeg's, divided by the film's frames. On Linux it is split by what
/proc says of each thread, looked at every 20 ms:
encoder: the threads that are begun when the movie is opened for writing, x264's;
composition: those that OpenGL began with the device, a software renderer's, and on the thread that calls its passes
and the making of its textures, which a software renderer clears;
decoding: FFmpeg's, and the thread of ours that decodes ahead;
device: the rest of the thread that calls the device: what is read back, and what a picture needs in Python;
engine: our Python on Blender's main thread, and what it hands over;
blender: all else, which is Blender's.
outside: all but encoder and composition, to be compared with that of plain.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from contextlib import ExitStack, contextmanager, suppress
from functools import cache
from pathlib import Path

import av
import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from shutter_addon import blender
from shutter_addon.blender.data import snapshot, strips
from shutter_addon.blender.editing import new_edit
from shutter_addon.blender.output import edit_feed, film_output
from shutter_addon.blender.rendering import sessions
from shutter_addon.blender.rendering.engine import VirtualShutterEngine
from shutter_addon.compute.cpu import CPUCompositor
from shutter_addon.compute.renderer import Renderer
from shutter_addon.compute.request import Request
from shutter_addon.core.frames import light
from shutter_addon.core.frames.source_wrapper import SourceWrapper
from shutter_addon.core.model import presets
from shutter_addon.core.model.effect import Effect
from shutter_addon.core.recipes import recipe_file
from shutter_addon.devices.device import NoDeviceError
from shutter_addon.devices.gl import GLDevice
from shutter_addon.media import MediaError, open_source
from shutter_addon.media.cuts import ShotSource
from shutter_addon.media.prefetch import PrefetchSource

ROOT = Path(__file__).resolve().parents[1]
FOOTAGE = [ROOT / "assets" / name for name in ("bigbuckbunny.mp4", "pedestrians.avi")]
WAYS = ("ours", "saved", "plain", "echo", "tmix")
PARTS = ("encoder", "composition", "decoding", "device", "engine", "blender")
# Levels of 255, on average, that the codec may take means of 8 × 8 pixels away from what was given to it.
LOSSY = 1.5
# What Blender's settings are to x264.
_RATES, _PRESETS = {"HIGH": 20}, {"GOOD": "medium"}
_AHEAD = 4  # frames that echo decodes ahead
OURS = "Virtual Shutter"  # how Python names the thread that decodes ahead; that of the device begins so
_TICK = os.sysconf("SC_CLK_TCK") if hasattr(os, "sysconf") else 1
_THREADS = Path("/proc/self/task")  # only on Linux
_LOOK = 0.02  # seconds between two looks at the threads


def effect_recipe(window: int) -> Effect:
    """Three shutters on two lines and the border."""
    bars = {"Long": "ANGLE_360", "Sharp": "STILL", "Twice": "TWO_CUTS"}
    lines = {"Sharp": [[0.3, 0.2], [0.5, 0.8]], "Twice": [[0.7, 0.2], [0.7, 0.8]]}
    data = {
        "version": 1,
        "window": window,
        "border": True,
        "shutters": [{"name": name, "bars": presets.bars(preset, window).tolist()} for name, preset in bars.items()],
        "regions": [{"shutter": n, "kind": "line", "width": 0.02, "strokes": [points]} for n, points in lines.items()],
    }
    return recipe_file.parse(json.dumps(data))


class ProcessorTime:
    """Processor time of this process while it renders, in seconds: `total`, and `parts` by name of PARTS; none where
    the system does not tell it by thread."""

    def __init__(self):
        self.total, self.parts = 0.0, {}
        self._device = _device_threads()
        self._before = self._seen = _threads()
        self._pythons: dict[int, str] = {}  # Python's threads, and how it names them
        self._encoders: set[int] = set()
        self._passes = self._engine = 0.0

    @contextmanager
    def of_render(self):
        """Measures the film that is rendered inside."""
        done, started = threading.Event(), time.process_time()
        watch = threading.Thread(target=self._watch, args=(done,))
        watch.start()
        try:
            with self._timing(), self._noting_encoders():
                yield
        finally:
            done.set()
            watch.join()
        own = self._seen.pop(watch.native_id, ("", 0.0))[1]
        self.total = time.process_time() - started - own
        if self._before:
            self.parts = self._split()

    def _watch(self, done: threading.Event) -> None:
        while not done.wait(_LOOK):
            self._seen = self._seen | _threads()
            self._pythons |= {thread.native_id: thread.name for thread in threading.enumerate()}

    @contextmanager
    def _timing(self):
        """Inside, what is timed on the thread that calls it."""
        with ExitStack() as kept:
            kept.enter_context(self._timed(GLDevice, "run", "_passes"))
            kept.enter_context(self._timed(GLDevice, "texture", "_passes"))
            kept.enter_context(self._timed(edit_feed, "_feed", "_engine"))  # what a frame costs has no other name
            kept.enter_context(self._timed(VirtualShutterEngine, "render", "_engine"))
            yield

    @contextmanager
    def _timed(self, owner, name: str, total: str):
        """Inside, the calling thread's time in a function of an owner is added to an attribute."""
        function = getattr(owner, name)

        def timed(*given, **named):
            start = time.thread_time()
            try:
                return function(*given, **named)
            finally:
                setattr(self, total, getattr(self, total) + time.thread_time() - start)

        def of_engine(engine, depsgraph):  # Blender counts an engine's arguments
            timed(engine, depsgraph)

        setattr(owner, name, of_engine if owner is VirtualShutterEngine else timed)
        try:
            yield
        finally:
            setattr(owner, name, function)

    @contextmanager
    def _noting_encoders(self):
        """Blender opens the movie after render_init, and before the first frame's render_pre."""
        handlers, before = bpy.app.handlers, []

        def begun(*_):
            before.append(_threads().keys())

        def opened(*_):
            self._encoders = self._encoders or _threads().keys() - before[0]

        # They change nothing: without this, effects would be read at each frame (render_job.scripts_act).
        begun.__module__ = opened.__module__ = blender.__name__
        handlers.render_init.append(begun)
        handlers.render_pre.insert(0, opened)  # before ours, which may begin threads
        try:
            yield
        finally:
            handlers.render_init.remove(begun)
            handlers.render_pre.remove(opened)

    def _split(self) -> dict[str, float]:
        def of(wanted) -> float:
            return sum(
                spent - self._before.get(number, ("", 0.0))[1]
                for number, (name, spent) in self._seen.items()
                if wanted(number, name)
            )

        def is_ours(number: int, name: str = "") -> bool:
            return self._pythons.get(number, "").startswith(OURS)

        found = {
            "encoder": of(lambda number, _: number in self._encoders),
            "composition": of(lambda number, _: number in self._device) + self._passes,
            "decoding": of(lambda number, name: name.startswith("av:") or self._pythons.get(number) == OURS),
            "device": of(lambda number, _: is_ours(number) and self._pythons[number] != OURS) - self._passes,
            "engine": self._engine,
        }
        return found | {"blender": self.total - sum(found.values())}


def _threads() -> dict[int, tuple[str, float]]:
    """This process's threads: by number the system's name and seconds of processor time; none without /proc."""
    found = {}
    for place in _THREADS.iterdir() if _THREADS.is_dir() else ():
        with suppress(OSError):  # it has ended
            name, _, numbers = (place / "stat").read_text().partition(" (")[2].rpartition(") ")
            found[int(place.name)] = name, sum(map(int, numbers.split()[11:13])) / _TICK
    return found


@cache
def _device_threads() -> set[int]:
    """The threads that OpenGL begins with a device, and keeps."""
    before = _threads().keys()
    with suppress(NoDeviceError):
        GLDevice().release()
    return _threads().keys() - before


def echo(engine, source, depsgraph) -> None:
    """The least that an engine of source frames can do."""
    index = depsgraph.scene.frame_current - 1
    source.want(range(index, min(index + _AHEAD, source.count)))
    result = engine.begin_result(0, 0, engine.resolution_x, engine.resolution_y)
    result.layers[0].passes["Combined"].rect.foreach_set(source.read(index).ravel())
    engine.end_result(result)


class LinearSource(SourceWrapper):
    """An 8-bit source's frames in scene-linear float32, the bottom row first."""

    _LINEAR = light.to_linear(np.arange(256, dtype=np.float32) / 255)

    def read(self, index):
        return np.take(self._LINEAR, self._source.read(index)[::-1], mode="clip")  # twice as quick as with a check


def make_edit(way: str, footage: Path, window: int, film: Path):
    """The silent edit that a way renders, alone in Blender, to a movie; its scene."""
    with open_source(footage) as medium:
        if way == "plain":
            edit = new_edit.make_source(footage, medium).id_data
            edit.frame_start, edit.frame_end = 1, medium.count
        else:
            edit = new_edit.make_edit(footage, medium, effect_recipe(window), footage.parent)
    editor = edit.sequence_editor
    for strip in [strip for strip in editor.strips_all if strip.type == "SOUND"]:
        editor.strips.remove(strip)
    film_output.set_output(edit, film, "png", alpha=False)
    return edit


@contextmanager
def engine_of(way: str, footage: Path):
    """Inside, effects are rendered as a way does."""
    if way != "echo":
        yield
        return
    # Another engine would make it another strip, and the effect would go with it.
    kept, begin = VirtualShutterEngine.render, edit_feed.begin
    with open_source(footage) as medium, PrefetchSource(LinearSource(medium)) as source:
        VirtualShutterEngine.render = lambda engine, depsgraph: echo(engine, source, depsgraph)
        edit_feed.begin = lambda _scene: None
        try:
            yield
        finally:
            VirtualShutterEngine.render, edit_feed.begin = kept, begin


def tmix_command(edit, footage: Path, window: int, film: Path) -> list[str]:
    to = edit.render.ffmpeg
    video = f"-c:v libx264 -preset {_PRESETS[to.ffmpeg_preset]} -crf {_RATES[to.constant_rate_factor]}"
    video += f" -g {to.gopsize} -bf {to.max_b_frames if to.use_max_b_frames else 0} -pix_fmt yuv420p"
    given = ["ffmpeg", "-v", "error", "-y", "-i", str(footage), "-vf", f"tmix=frames={window}"]
    return [*given, *video.split(), "-an", str(film)]


def check(way: str, film: Path, edit, footage: Path) -> float | None:
    """How far the film's pictures are from what they should be, in levels; of tmix no more is asked than that it has
    pictures. AssertionError: the film is not what was timed."""
    with open_source(footage) as source, open_source(film) as made:
        with av.open(str(film)) as container:
            count = sum(packet.size > 0 for packet in container.demux(video=0))
        assert count == source.count, f"{way}: {count} frames instead of {source.count}"
        chosen = sorted({0, source.count // 2, source.count - 1})
        shown = {index: made.read(index)[..., :3] for index in chosen}
        if way == "tmix":
            assert all(picture.std() > 5 for picture in shown.values()), f"{way}: pictures without content"
            return None
        if way in ("ours", "saved"):
            expected = _composed(edit, source, chosen)
        else:
            expected = {index: source.read(index)[..., :3] for index in chosen}
    error = max(float(np.abs(_means(shown[index]) - _means(expected[index])).mean()) for index in chosen)
    assert error < LOSSY, f"{way}: {error:.2f} levels off"
    return error


def _means(picture: np.ndarray) -> np.ndarray:
    """Means of 8 × 8 pixels, which a codec hardly touches."""
    height, width = (n // 8 * 8 for n in picture.shape[:2])
    return picture[:height, :width].reshape(height // 8, 8, width // 8, 8, 3).mean(axis=(1, 3), dtype=np.float32)


def _composed(edit, source, indices) -> dict[int, np.ndarray]:
    """What the effect shows of source frames, in levels; composed by NumPy."""
    strip = strips.effect_strips(edit)[0]
    effect = strips.effect_of(edit, strip.scene)
    shown = snapshot.read(edit, effect, strip, [index + 1 for index in indices])
    renderer = Renderer(CPUCompositor(), ShotSource(source))
    return {
        index: 255 * light.to_encoded(renderer.picture(Request(index, shown.at(index + 1))))[..., :3]
        for index in indices
    }


def run(way: str, footage: Path, window: int, film: Path, *, checked: bool) -> dict:
    """Renders a film once: seconds of the clock and of the processor, whole and by part, and its error, if checked."""
    edit = make_edit(way, footage, window, film)
    sessions.forget()
    start, before = time.perf_counter(), os.times()
    if way == "tmix":
        subprocess.run(tmix_command(edit, footage, window, film), check=True)
        after = os.times()
        spent = after.children_user + after.children_system - before.children_user - before.children_system
        found = {"cpu": spent}
    else:
        measured = ProcessorTime()
        with engine_of(way, footage), measured.of_render():
            if way == "saved":
                edit.render.dither_intensity, edit.render.filepath = 1, film_output.for_blender(str(film))
                with film_output.quiet():
                    bpy.ops.render.render(animation=True, scene=edit.name)
            else:
                film_output.film(edit, film)
        found = {"cpu": measured.total} | measured.parts
    found["clock"] = time.perf_counter() - start
    return found | {"error": check(way, film, edit, footage) if checked else None}


def measure(footage: Path, window: int, rounds: int) -> list[dict]:
    """A row for each way."""
    with open_source(footage) as medium:
        common = {"film": footage.name, "width": medium.width, "height": medium.height}
        common |= {"window": window, "frames": medium.count}
    found = {way: [] for way in WAYS if way != "tmix" or shutil.which("ffmpeg")}
    with tempfile.TemporaryDirectory() as folder:
        for number in range(rounds):
            for way, runs in found.items():
                film = Path(folder, f"{way}.mp4")
                runs.append(run(way, footage, window, film, checked=number == 0))
    return [{"way": way} | common | _row(runs, common["frames"]) for way, runs in found.items()]


def _row(runs: list[dict], frames: int) -> dict:
    """The medians of a way's runs: frames per second, and milliseconds of processor time a frame."""

    def median(name: str) -> float:
        return statistics.median(run[name] for run in runs) / frames * 1000

    row = {"fps": statistics.median(frames / run["clock"] for run in runs), "error": runs[0]["error"]}
    row |= {f"{part}_ms": median(part) for part in ("cpu", *PARTS) if part in runs[0]}
    if "encoder" in runs[0]:
        outside = [{"outside": run["cpu"] - run["encoder"] - run["composition"]} for run in runs]
        row["outside_ms"] = statistics.median(found["outside"] for found in outside) / frames * 1000
    return row


def report(rows: list[dict]) -> str:
    """The rows of a film as a table, and what ours takes beside plain."""
    first, found = rows[0], {row["way"]: row for row in rows}
    names = [name for name in ("fps", "cpu_ms", *(f"{part}_ms" for part in PARTS), "outside_ms") if name in first]
    lines = [f"{first['film']}, {first['width']}×{first['height']}, window {first['window']}, {first['frames']} frames"]
    lines.append(" " * 6 + "".join(f"{name:>16s}" for name in names))
    for row in rows:
        lines.append(f"{row['way']:6s}" + "".join(f"{row[name]:16.2f}" if name in row else " " * 16 for name in names))
    for name, what in (("cpu_ms", "processor time"), ("outside_ms", "of it outside of composition and encoder")):
        if name in first:
            ratios = ", ".join(f"{first[name] / row[name]:.2f} of {way}" for way, row in found.items() if name in row)
            lines.append(f"{what}: ours is {ratios}")
    return "\n".join(lines)


def parse(arguments=None):
    parser = argparse.ArgumentParser("render_speed.py", description=__doc__.partition("\n")[0])
    add = parser.add_argument
    add("footage", type=Path, nargs="*", default=FOOTAGE, metavar="FOOTAGE")
    add("--window", type=int, default=64)
    add("--rounds", type=int, default=3)
    add("--json", type=Path, help="where the rows are written")
    return parser.parse_args(arguments)


def main(arguments=None) -> int:
    args = parse(arguments)
    blender.register()
    if shutil.which("ffmpeg") is None:
        print("There is no ffmpeg on the PATH: the way “tmix” is left out.", file=sys.stderr, flush=True)
    rows = []
    try:
        for footage in args.footage:
            rows += (found := measure(footage.resolve(), args.window, args.rounds))
            print(report(found), flush=True)
    except MediaError as error:
        print(f"render_speed: {error}", file=sys.stderr)
        return 2
    if args.json:
        args.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    # Inside Blender, what comes before "--" is Blender's own.
    sys.exit(main(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else None))
