"""What tests of all layers share."""

import os
import re
import shlex
import shutil
import subprocess
from pathlib import Path

import hypothesis
import long_checks
import numpy as np
import pytest

# A slow machine is no fault of the mathematics.
hypothesis.settings.register_profile("shutter", deadline=None)
hypothesis.settings.load_profile("shutter")

# What is deprecated fails programs that tests start, too: Pythons by this, Blenders with the option of real_blender.
os.environ["PYTHONWARNINGS"] = "error::DeprecationWarning,error::PendingDeprecationWarning"
os.environ["PYTHONNOUSERSITE"] = "1"  # which that option would let in, too

ROOT = Path(__file__).parents[1]
LONG = "window", "farm", "differential", "tests"


def pytest_addoption(parser):
    parser.addoption("--all", action="store_true", help="run the long checks whose files have not changed, too")


def pytest_report_header(config):
    groups = set() if config.option.all else long_checks.unchanged()
    return [f"long checks left out, since their files have not changed: {', '.join(sorted(groups))}"] if groups else []


def pytest_collection_modifyitems(config, items):
    """The folders of the longest files come first, so that no process is left alone with one at the end."""
    left = set() if config.option.all else long_checks.left_out([item.nodeid for item in items])
    config.hook.pytest_deselected(items=[item for item in items if item.nodeid in left])
    items[:] = [item for item in items if item.nodeid not in left]
    items.sort(key=lambda item: item.path.parent.name not in LONG)


OUTCOMES = {}  # by the name of a test: what its steps came to


def pytest_runtest_logreport(report):
    OUTCOMES.setdefault(report.nodeid, set()).add(report.outcome)


def pytest_sessionfinish(session):
    options = session.config.option
    is_part = options.keyword or any("::" in argument for argument in session.config.args)
    if options.all and not is_part and not hasattr(session.config, "workerinput"):
        long_checks.note(OUTCOMES)


@pytest.fixture(scope="session")
def bunny():
    """Big Buck Bunny: 132 frames, 1280×720, 25 fps, H.264, with sound."""
    return ROOT / "assets" / "bigbuckbunny.mp4"


@pytest.fixture(scope="session")
def real_blender():
    if not os.environ.get("BLENDER"):
        pytest.skip("NO REAL BLENDER: set BLENDER to the command that runs one")
    return [*shlex.split(os.environ["BLENDER"]), "--python-use-system-env"]


@pytest.fixture(scope="session")
def blenders_python(real_blender):
    code = "import sys; print('PYTHON', '%d.%d' % sys.version_info[:2])"
    command = [*real_blender, "-b", "--factory-startup", "--python-expr", code]
    return re.search(r"PYTHON (.+)", subprocess.run(command, capture_output=True, text=True, check=True).stdout)[1]


@pytest.fixture(scope="session")
def user_folder(tmp_path_factory):
    """A Blender user folder with the checkout as an installed extension."""
    folder = tmp_path_factory.mktemp("user") / "resources"
    (folder / "extensions" / "user_default").mkdir(parents=True)
    (folder / "extensions" / "user_default" / "virtual_shutter").symlink_to(ROOT)
    return folder


@pytest.fixture
def blender(real_blender, user_folder):
    """Runs the real Blender that the environment names, with the extension enabled."""

    def run(*arguments):
        command = [*real_blender, "-b", "--factory-startup", "--addons", "bl_ext.user_default.virtual_shutter"]
        return subprocess.run(
            [*command, *map(str, arguments)],
            env=os.environ | {"BLENDER_USER_RESOURCES": str(user_folder)},
            capture_output=True,
            text=True,
            check=False,
            cwd=ROOT,
        )

    return run


@pytest.fixture
def same_pixels(tmp_path):
    """Compares two pictures (H, W, C) in 8-bit levels; on failure both and their amplified difference are kept."""

    def compare(picture, expected, levels, name="picture"):
        assert picture.shape == expected.shape
        difference = np.abs(picture.astype(np.float64) - expected.astype(np.float64))
        if difference.max() <= levels:
            return
        import OpenImageIO

        for kind, values in [("is", picture), ("expected", expected), ("difference", difference * 16)]:
            pixels = np.ascontiguousarray(np.clip(values, 0, 255).astype(np.uint8))
            OpenImageIO.ImageBuf(pixels).write(str(tmp_path / f"{name}-{kind}.png"))
        place = np.unravel_index(difference.argmax(), difference.shape)
        pytest.fail(f"{difference.max():.3f} levels apart at {place}, {levels} allowed; pictures in {tmp_path}")

    return compare


@pytest.fixture(scope="session")
def to_metal(tmp_path_factory):
    """Translates GLSL for Vulkan to the Metal Shading Language, by way of SPIR-V; stage: vert, frag or comp."""
    if not all(map(shutil.which, ("glslangValidator", "spirv-cross"))):
        pytest.skip("NO TRANSLATION TO METAL: install Debian's glslang-tools and spirv-cross")
    folder = tmp_path_factory.mktemp("metal")
    binary, metal = folder / "shader.spv", folder / "shader.metal"

    def translated(source: str, stage: str) -> str:
        compile_ = ["glslangValidator", "-V", "--target-env", "vulkan1.2", "--stdin", "-S", stage, "-o", binary]
        for command in (compile_, ["spirv-cross", binary, "--msl", "--msl-version", "20200", "--output", metal]):
            done = subprocess.run(command, input=source, capture_output=True, text=True)
            assert done.returncode == 0, done.stdout + done.stderr
        return metal.read_text()

    return translated
