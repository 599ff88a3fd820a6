"""How tests run a story in a Blender with a window.

BLENDER_WINDOW is the command that opens a Blender on a screen and runs a script in it (its argument); BACKEND, opengl
or vulkan, is set for it, and SCREEN. It needs xdotool and ImageMagick's `import` beside that Blender.
"""

import json
import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import av
import numpy as np
import OpenImageIO
import pytest

ROOT = Path(__file__).parents[2]
WINDOW = os.environ.get("BLENDER_WINDOW", "")
BUNNY = ROOT / "assets" / "bigbuckbunny.mp4"
# Even numbers of pixels around the picture, so that its pixels fall on the screen's.
SCREEN = "1600x1001x24"
SMALL = "960x601x24"  # for stories that are not about the interface: drawing it takes a software renderer long

# Not even this machine's own. Who is not root may take it away as the root of a user namespace alone.
NO_NETWORK = ("unshare", *(() if os.geteuid() == 0 else ("--map-root-user",)), "--net")

needs_window = pytest.mark.skipif(
    not WINDOW, reason="NO WINDOW: set BLENDER_WINDOW to the command that runs a script in a Blender with a window"
)


def backends(usual):
    """Those of Blender's backends on which a story of the interface is told, which looks the same on both: one for each
    commit, both for a release."""
    return ["opengl", "vulkan"] if os.environ.get("SHUTTER_BACKENDS") == "both" else [usual]


def built(folder, python, kind):
    """A zip for Blender's Python on Linux: of the kind "linux_x64" or "no_wheels"."""
    build = [sys.executable, ROOT / "scripts" / "build.py", "--output", folder / "dist", "--system", "linux-x64"]
    subprocess.run([*build, "--python", python], check=True, capture_output=True)
    (path,) = (folder / "dist").glob(f"*-{kind}.zip")
    return path


def linked(folder):
    extension = folder / "user" / "extensions" / "user_default" / "virtual_shutter"
    extension.parent.mkdir(parents=True)
    extension.symlink_to(ROOT)
    return folder


def tell(story, backend, folder, *, before=(), screen=SCREEN, **given):
    """Runs a story, a module of this folder, in Blender's window, with user folders of its own in `folder`, where
    `console.txt` has what Blender says; what it noted. before: what its command stands behind, as NO_NETWORK; given:
    what the story finds in its environment as SHUTTER_NAME."""
    environment = {
        "BACKEND": backend,
        "SCREEN": screen,
        "GUI_TIMEOUT": "1500",  # seconds: a long story on two cores, beside others
        "SHUTTER_PICTURES": str(folder),
        # A copy: Blender puts proxies beside a movie.
        "SHUTTER_FOOTAGE": str(shutil.copy(BUNNY, folder)),
        "BLENDER_USER_RESOURCES": str(folder / "user"),
        "SHUTTER_STORY": story,
    } | {f"SHUTTER_{name.upper()}": str(value) for name, value in given.items()}
    done = subprocess.run(
        [*before, *shlex.split(WINDOW), str(Path(__file__).with_name("run_story.py"))],
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=False,
    )
    console = done.stdout + done.stderr
    (folder / "console.txt").write_text(console)
    assert (folder / "result.json").exists(), console[-4000:]
    result = json.loads((folder / "result.json").read_text())
    assert not result["fault"], f"{result['fault']}\nPictures: {folder}"
    assert done.returncode == 0, console[-4000:]
    assert "Traceback" not in console
    return result["seen"]


def steps_of(seen):
    return {entry["step"]: entry for entry in seen if "step" in entry}


def facts_of(seen):
    return {name: value for entry in seen for name, value in entry.items()}


def packages(folder):
    """A new folder in this one, of what tracking needs besides what the Blender of a distribution has."""
    import cv2

    folder = folder / "packages"
    folder.mkdir()
    site = Path(cv2.__file__).parents[1]
    for name in ("cv2", "tqdm", *(p.name for p in site.glob("opencv*.libs"))):
        (folder / name).symlink_to(site / name)
    return folder


def excerpt(movie, frames, to, size):
    """Some frames of a movie, small, without its sound, which would be a strip of its own."""
    with av.open(movie) as read, av.open(to, "w") as written:
        stream = written.add_stream("libx264", rate=24, options={"qp": "10"})
        (stream.width, stream.height), stream.pix_fmt = size, "yuv420p"
        for number, frame in enumerate(read.decode(video=0)):
            if number in frames:
                smaller = frame.to_ndarray(width=size[0], height=size[1], format="rgb24")
                written.mux(stream.encode(av.VideoFrame.from_ndarray(smaller)))
        written.mux(stream.encode())
    return to


def noise(folder, count, size):
    folder = folder / "frames"
    folder.mkdir()
    for number, frame in enumerate(np.random.default_rng(1).integers(0, 256, (count, *size[::-1], 3), dtype=np.uint8)):
        OpenImageIO.ImageBuf(frame).write(str(folder / f"{number + 1:04d}.png"))
    return folder / "0001.png"


def recipe(folder, bars, *strokes, width=0.1, keys=(), **more):
    """The path of a recipe of a line with these bars, where all is exposed by all of the window's frames."""
    strokes = strokes or [[[0.2, 0.2], [0.6, 0.9]]]
    line = {"name": "Line", "shutter": "Sharp", "strokes": strokes, "width": width, "keys": list(keys)}
    shutters = [{"name": "Long", "bars": [1] * len(bars)}, {"name": "Sharp", "bars": bars}]
    data = {"version": 2, "window": len(bars), "border": True, "shutters": shutters, "regions": [line]}
    path = folder / "recipe.json"
    path.write_text(json.dumps(data | more))
    return path


def command_renders(source, recipe, output, *options):
    options = ("--recipe", recipe, "--output", output, "--device", "opengl", *options)
    subprocess.run([sys.executable, "-m", "shutter_addon", "render", source, *options], check=True, cwd=ROOT)
