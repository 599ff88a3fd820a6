"""How tests run a story in a Blender with a window.

BLENDER_WINDOW is the command that opens a Blender on a screen and runs a script in it (its argument); BACKEND, opengl
or vulkan, is set for it, and SCREEN. It needs xdotool and ImageMagick's `import` beside that Blender.
"""

import json
import os
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
WINDOW = os.environ.get("BLENDER_WINDOW", "")
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


def linked(folder):
    """The folder, whose Blender has the checkout for an extension."""
    extension = folder / "user" / "extensions" / "user_default" / "virtual_shutter"
    extension.parent.mkdir(parents=True)
    extension.symlink_to(ROOT)
    return folder


def tell(story, backend, folder, *, before=(), screen=SCREEN, **given):
    """Runs a story in Blender's window, with user folders of its own in `folder`; what it noted, and what Blender said
    on the console. before: what its command stands behind, as NO_NETWORK; given: what the story finds in its
    environment as SHUTTER_NAME."""
    environment = {
        "BACKEND": backend,
        "SCREEN": screen,
        "GUI_TIMEOUT": "1500",  # seconds: a long story on two cores, beside others
        "SHUTTER_PICTURES": str(folder),
        # A copy: Blender puts proxies beside a movie.
        "SHUTTER_FOOTAGE": str(shutil.copy(ROOT / "assets" / "bigbuckbunny.mp4", folder)),
        "BLENDER_USER_RESOURCES": str(folder / "user"),
    } | {f"SHUTTER_{name.upper()}": str(value) for name, value in given.items()}
    done = subprocess.run(
        [*before, *shlex.split(WINDOW), str(Path(__file__).with_name(story))],
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
    return result["seen"], console


def packages(folder):
    """A folder of what tracking needs besides what the Blender of a distribution has."""
    import cv2

    folder.mkdir()
    site = Path(cv2.__file__).parents[1]
    for name in ("cv2", "tqdm", *(p.name for p in site.glob("opencv*.libs"))):
        (folder / name).symlink_to(site / name)
    return folder
