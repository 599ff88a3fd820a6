"""The zips, as users get them: what is in them, installed in a Blender of their own, updated and removed."""

import importlib
import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import OpenImageIO
import pytest
from fresh import INSTALL, PACKAGES

ROOT = Path(__file__).parents[1]
NAME = "bl_ext.user_default.virtual_shutter"
MAKE_EDIT = ROOT / "tests" / "blender" / "installed.py"
LACKING = ROOT / "tests" / "blender" / "lacking.py"
SYSTEM = {"linux": "linux-x64", "win32": "windows-x64", "darwin": "macos-arm64"}[sys.platform]
WHEELS = {"av", "glcontext", "moderngl", "opencv_contrib_python_headless", "tqdm"}
RECIPE = {
    "version": 1,
    "window": 4,
    "shutters": [{"name": "Long", "bars": [1, 1, 1, 1]}, {"name": "Sharp", "bars": [1, 0, 0, 0]}],
    "regions": [
        {"name": "R", "shutter": "Long", "strokes": [[[0.1, 0.1], [0.1, 0.9]]]},
        {"shutter": "Sharp", "kind": "lasso", "strokes": [[[0.4, 0.3], [0.6, 0.3], [0.5, 0.7]]]},
    ],
}
PURE = {("py3", "none"), ("py2.py3", "none")}
SPDX = re.compile(" (?:AND|OR|WITH) ")
# What Blender says by itself, on the real one's screenless machine.
BLENDERS_OWN = ("EGL Error", "system.path")
# Runs a command (after a folder) that sees the folder read-only; nobody else does, and nothing stays mounted.
READ_ONLY = ("unshare", "--mount", "sh", "-c", 'mount --bind "$0" "$0" && mount -o remount,bind,ro "$0" && exec "$@"')
SIZE = 320, 180
NO_OPENGL = {"LIBGL_DRIVERS_PATH": "/nowhere", "__EGL_VENDOR_LIBRARY_DIRS": "/nowhere"}


def built(*arguments):
    command = [sys.executable, ROOT / "scripts" / "build.py", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def build(*arguments):
    done = built(*arguments)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def dist(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dist")
    return folder, build("--output", folder)


def members(path):
    with zipfile.ZipFile(path) as packed:
        return set(packed.namelist()), tomllib.loads(packed.read("blender_manifest.toml").decode())


def sources():
    """What every zip has to hold: the extension's own files, and no other."""
    package = ROOT / "shutter_addon"
    code = [*package.rglob("*.py"), *package.rglob("*.clf"), *(ROOT / "shaders").rglob("*.glsl")]
    files = {"blender_manifest.toml", "__init__.py", "LICENSE", *(path.relative_to(ROOT).as_posix() for path in code)}
    return files | {f"models/{name}" for name in ("u2netp.onnx", "README.txt", "LICENSE-Apache-2.0.txt")}


def test_a_zip_for_each_system_and_one_without_wheels(dist):
    folder, said = dist
    version = tomllib.loads((ROOT / "blender_manifest.toml").read_text())["version"]
    suffixes = ("linux_x64", "macos_arm64", "no_wheels", "windows_x64")
    names = [f"virtual_shutter-{version}-{suffix}.zip" for suffix in suffixes]
    assert sorted(path.name for path in folder.iterdir()) == names
    for name in names:
        assert f"{(folder / name).stat().st_size / 1e6:.1f} MB" in said


def test_the_zip_without_wheels_holds_the_extension_alone(dist):
    (path,) = dist[0].glob("*-no_wheels.zip")
    names, manifest = members(path)
    assert names == sources()
    assert "wheels" not in manifest
    assert "platforms" not in manifest
    assert len(manifest["copyright"]) == 2  # ours, and the model's


TAGS = {"linux_x64": "x86_64", "windows_x64": "win_amd64", "macos_arm64": "arm64"}


@pytest.mark.parametrize("system", TAGS)
def test_a_zip_with_wheels_holds_those_of_its_system(dist, system):
    (path,) = dist[0].glob(f"*-{system}.zip")
    names, manifest = members(path)
    wheels = {name for name in names if name.startswith("wheels/")}
    licences = {name for name in names if name.startswith("licenses/")}
    assert names - wheels - licences == sources()
    own = {"colorama"} if system == "windows_x64" else set()
    assert {name.split("/")[1].split("-")[0] for name in wheels} == WHEELS | own
    for name in wheels:
        python, abi, platform = name.removesuffix(".whl").split("-")[-3:]
        assert platform == "any" or platform.endswith(TAGS[system])
        assert (python, abi) in {("cp313", "cp313"), ("cp312", "abi3"), ("cp37", "abi3"), *PURE}
    assert manifest["platforms"] == [system.replace("_", "-")]
    assert {wheel.removeprefix("./") for wheel in manifest["wheels"]} == wheels


SOME = {"linux_x64": ["libxcb", "OpenBLAS", "Intel IPP"], "windows_x64": ["OpenH264", "Colorama", "Intel IPP"]}
SOME |= {"macos_arm64": ["OpenSSL", "Rubber Band", "KleidiCV"]}


@pytest.mark.parametrize("system", SOME)
def test_a_zip_names_the_holders_and_has_the_texts_of_what_it_bundles(dist, system):
    (path,) = dist[0].glob(f"*-{system}.zip")
    names, manifest = members(path)
    with zipfile.ZipFile(path) as packed:
        listed = packed.read("licenses/README.txt").decode()
    for name in ("PyAV", "OpenCV", "FFmpeg", "x264", "x265", "tqdm", *SOME[system]):
        assert any(line.endswith(f"({name})") for line in manifest["copyright"]), name
        assert re.search(rf"^ *{re.escape(name)}\b", listed, re.MULTILINE), name
    assert manifest["copyright"][0].endswith("Virtual Shutter developers")
    texts = {name.removeprefix("licenses/") for name in names if name.startswith("licenses/")}
    for wheel in manifest["wheels"]:
        assert any(text.startswith(f"{Path(wheel).name.split('-')[0]}/LICEN") for text in texts), wheel
    identifiers = {each for line in re.findall(r"^    Licence: (.+)$", listed, re.M) for each in SPDX.split(line)}
    bare = {re.sub("-(only|or-later)$", "", each) for each in identifiers}
    assert bare == {text[8:-4] for text in texts if text.startswith("LICENSE-")} | {"GPL-3.0"}
    assert "LICENSE" in names  # the GPL, version 3


def test_what_cannot_be_built_is_one_sentence(tmp_path):
    done = built("--output", tmp_path, "--repository", tmp_path)
    assert (done.returncode, list(tmp_path.iterdir())) == (2, [])
    assert done.stderr.endswith("--repository: it needs a folder of its own\n")
    done = built("--output", tmp_path, "--python", "3.x", "--system", SYSTEM)
    assert done.returncode == 2
    assert done.stderr == f"build: no wheels for Python 3.x on {SYSTEM}, or PyPI is not reached\n"


# Of two small wheels.
DOWNLOAD = """
import sys, build
build.WHEELS = [each for each in build.WHEELS if each.startswith(("moderngl=", "tqdm="))]
build.ALSO = {}
print(*build.download(sys.argv[1], build.BLENDERS_PYTHON), sep="\\n")
"""


def downloading(root, offered):
    environment = os.environ | {"PIP_NO_INDEX": "1", "PIP_FIND_LINKS": str(offered)}
    command, pipe = [sys.executable, "-c", DOWNLOAD, SYSTEM], subprocess.PIPE
    return subprocess.Popen(command, env=environment, cwd=root / "scripts", stdout=pipe, stderr=pipe, text=True)


def test_downloaded_wheels_are_whole_and_known(dist, tmp_path):
    """Also where two download at once, or a copy was interrupted."""
    offered, bare = tmp_path / "offered", tmp_path / "bare"
    offered.mkdir()
    with downloading(ROOT, "none") as process:
        for path in map(Path, process.stdout.read().split()):
            shutil.copy(path, offered)
    for name in ("scripts", "third_party"):
        shutil.copytree(ROOT / name, bare / name)
    shutil.copy(ROOT / "blender_manifest.toml", bare)
    wheels = {path.name: path.read_bytes() for path in offered.iterdir()}
    for process in [downloading(bare, offered), downloading(bare, offered)]:
        said, _ = process.communicate()
        assert process.returncode == 0
        assert {path.name: path.read_bytes() for path in map(Path, said.split())} == wheels
    kept = next((bare / "build" / "wheels").rglob("tqdm-*.whl"))
    kept.write_bytes(wheels[kept.name][:1000])
    with downloading(bare, offered) as process:
        assert kept.name in process.stdout.read()
    assert kept.read_bytes() == wheels[kept.name]
    kept.unlink()
    with zipfile.ZipFile(offered / kept.name, "a") as packed:
        packed.writestr("tqdm/more.py", "")
    with downloading(bare, offered) as process:
        said = process.stderr.read()
    assert said == f"build: third_party/wheels.sha256 does not know {kept.name} as it was downloaded\n"
    assert process.returncode == 2
    assert not kept.exists()
    assert len(list((bare / "build" / "wheels").iterdir())) == 1


def test_the_version_is_the_same_everywhere():
    version = tomllib.loads((ROOT / "blender_manifest.toml").read_text())["version"]
    assert tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"] == version
    assert re.search(r"^## (\d\S*)", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)[1] == version
    for page in ("README.md", "docs/farms.md"):
        assert set(re.findall(r"virtual_shutter-([\d.]+)-", (ROOT / page).read_text())) == {version}


def test_the_wheels_are_what_the_code_needs_and_blender_lacks():
    """Of the requirements, all but what Blender brings."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    needed = {requirement.split(">")[0].replace("-", "_") for requirement in project["dependencies"]}
    assert needed - {"numpy", "OpenImageIO", "cattrs"} == WHEELS - {"glcontext"}  # moderngl's own requirement


WITHOUT = """
import sys
sys.modules |= dict.fromkeys(("av", "cattrs", "moderngl"))
from shutter_addon.compute.renderer import open_compositor
from shutter_addon.core.recipes import recipe_file
from shutter_addon.media import MediaError, open_source

assert open_compositor("cpu").name == "NumPy"
recipe = '{"version": 1, "window": 1, "shutters": [{"name": "S", "bars": [1]}]}'
for function, argument in ((open_source, "none.mp4"), (recipe_file.parse, recipe)):
    try:
        function(argument)
    except (MediaError, recipe_file.RecipeError) as error:
        print(error)
"""


def test_what_needs_a_package_that_is_missing_is_one_sentence():
    command = [sys.executable, "-c", WITHOUT]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    none, recipe = done.stdout.splitlines()
    assert none.startswith("none.mp4: no such file")
    assert "recipes need the Python package cattrs" in recipe


class Installation:
    def __init__(self, command, folder):
        self.command = command
        self.user = folder / "Größe und Maß" / "ユーザー"
        self.user.mkdir(parents=True)
        self.extension = self.user / "extensions" / "user_default" / "virtual_shutter"

    def run(self, *arguments, code=0, says=(), environment=()):
        """Runs Blender; what it printed. Nothing may stand on stderr but the sentences that are expected."""
        command = [*self.command, *map(str, arguments)]
        environment = os.environ | {"BLENDER_USER_RESOURCES": str(self.user)} | dict(environment)
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False, cwd=ROOT)
        assert done.returncode == code, done.stdout + done.stderr
        said = [line for line in done.stderr.splitlines() if line and not any(own in line for own in BLENDERS_OWN)]
        assert len(said) == len(says), done.stderr
        assert all(sentence in done.stderr for sentence in says)
        assert "Traceback" not in done.stdout
        return done.stdout

    def install(self, path):
        self.run(*INSTALL, path)
        assert self.files() == {*members(path)[0]}

    def files(self):
        """The extension's files as they lie there, without Python's cache."""
        found = (path for path in self.extension.rglob("*") if path.is_file() and path.suffix != ".pyc")
        return {path.relative_to(self.extension).as_posix() for path in found}

    @contextmanager
    def read_only(self):
        """Nothing can be written to the extension's folder. Root minds no modes, but a mount of Blender's own. Windows
        knows no such folders: there all can be written as before."""
        folders = [self.extension, *(path for path in self.extension.rglob("*") if path.is_dir())]
        command = self.command
        for folder in folders:
            folder.chmod(0o555)
        if os.name == "posix" and os.geteuid() == 0:
            self.command = [*READ_ONLY, str(self.extension), *command]
        yield
        self.command = command
        for folder in folders:
            folder.chmod(0o755)

    def remove(self):
        disable = f"import addon_utils; addon_utils.disable('{NAME}', default_set=True)"
        self.run("-b", "--python-exit-code", "1", "--python-expr", disable)
        self.run("--command", "extension", "remove", "virtual_shutter")
        assert not self.extension.exists()
        left = {path.name for path in self.user.glob("extensions/.local/lib/*/site-packages/*")}
        assert left <= {"__pycache__"}  # which Blender leaves


@pytest.fixture
def blender(real_blender, tmp_path):
    return Installation(real_blender, tmp_path)


@pytest.fixture
def recipe(tmp_path):
    path = tmp_path / "a recipe.json"
    path.write_text(json.dumps(RECIPE))
    return path


@pytest.fixture(scope="module")
def film(bunny, tmp_path_factory):
    path = tmp_path_factory.mktemp("film") / "bunny.mp4"
    with av.open(str(bunny)) as movie, av.open(str(path), "w") as out:
        small = out.add_stream("libx264", rate=25, options={"crf": "12"})
        small.width, small.height, small.pix_fmt = *SIZE, "yuv420p"
        for index, frame in zip(range(12), movie.decode(video=0), strict=False):
            frame = frame.reformat(*SIZE, format="yuv420p")
            frame.pts, frame.time_base = index, Fraction(1, 25)
            out.mux(small.encode(frame))
        out.mux(small.encode())
    return path


def checkout_renders(footage, recipe, output, frames):
    options = ["--recipe", recipe, "--output", output, "--frames", frames]
    command = [sys.executable, "-m", "shutter_addon", "render", footage, *options]
    subprocess.run(list(map(str, command)), cwd=ROOT, check=True, capture_output=True)


def assert_alike(folder, expected, count):
    """The same frames, within a level of 8 bits: another FFmpeg, another driver."""
    names = sorted(path.name for path in expected.glob("*.png"))
    assert sorted(path.name for path in folder.glob("*.png")) == names
    assert len(names) == count
    for name in names:
        ours, real = (OpenImageIO.ImageBuf(str(place / name)).get_pixels()[..., :3] for place in (expected, folder))
        assert np.abs(ours - real).max() <= 1.001 / 255, name


@pytest.fixture(scope="module")
def repository(blenders_python, tmp_path_factory):
    folder, place = tmp_path_factory.mktemp("dist"), tmp_path_factory.mktemp("repository")
    build("--output", folder, "--python", blenders_python, "--system", SYSTEM, "--repository", place)
    (path,) = folder.glob(f"*-{SYSTEM.replace('-', '_')}.zip")
    return place, path


def test_installed_with_wheels(blender, repository, film, recipe, tmp_path):
    blender.install(repository[1])
    files = blender.files()
    edit = tmp_path / "edit.blend"
    write = f"try: open({str(blender.extension / 'written')!r}, 'w')\nexcept OSError: print('CANNOT BE WRITTEN')"
    make = ("--python-expr", write, "--python", MAKE_EDIT, "--", film, recipe, edit, NAME, *PACKAGES)
    with blender.read_only():
        said = blender.run("-b", "--python-exit-code", 1, *make)
        assert "CANNOT BE WRITTEN" in said or os.name != "posix"
        blender.run("-b", edit, "-o", tmp_path / "real" / "####", "-s", 3, "-e", 5, "-a")
    checkout_renders(film, recipe, tmp_path / "ours", "3:5")
    assert_alike(tmp_path / "real", tmp_path / "ours", 3)
    assert blender.files() == files
    blender.remove()


def test_installed_without_wheels(blender, dist, film, recipe, tmp_path):
    """Pictures and a movie on Blender's own GPU or with NumPy, with a sentence of what is slow; and sentences, and
    nothing else, of what needs a package."""
    hidden = blender.user / "scripts" / "startup" / "hidden.py"
    hidden.parent.mkdir(parents=True)
    hidden.write_text(f"import sys\nsys.modules |= dict.fromkeys({PACKAGES})\ndef register(): pass\n")
    (path,) = dist[0].glob("*-no_wheels.zip")
    blender.install(path)
    frames, edit = tmp_path / "frames", tmp_path / "edit.blend"
    checkout_renders(film, recipe, frames, "1:4")
    borrowed, decoded = "composing on Blender's own GPU", "Virtual Shutter: a second Blender decodes movies"
    make, render = ("-b", "--python-exit-code", 1, "--python", MAKE_EDIT), ("-s", 1, "-e", 2, "-a")
    pictures, real = tmp_path / "real_pictures", tmp_path / "real"
    of_pictures = (frames / "0001.png", recipe, tmp_path / "pictures.blend", NAME)
    blender.run(*make, "-o", pictures / "####", *render, "--", *of_pictures, says=[borrowed])
    checkout_renders(frames / "0001.png", recipe, tmp_path / "ours", "1:2")
    assert_alike(pictures, tmp_path / "ours", 2)
    blender.run(*make, "--", film, recipe, edit, NAME)
    blender.run("-b", edit, "-o", real / "####", *render, says=[borrowed, decoded])
    assert "ALL SAY SO" in blender.run("-b", edit, "--python-exit-code", 1, "--python", LACKING, "--", tmp_path, NAME)
    command, options = ("--command", "shutter", "render"), (film, "--recipe", recipe, "--output", real)
    blender.run(*command, *options, "--frames", 3, "--device", "gpu", says=[decoded])
    numpy = "composing with NumPy, which is slow"
    blender.run(*command, *options, "--frames", 4, says=[numpy, decoded], environment=NO_OPENGL)
    assert_alike(real, frames, 4)
    track = ("track", film, "--recipe", recipe, "--region", "R", "--frame", 2, "--output", tmp_path / "out")
    blender.run("--command", "shutter", *track, code=2, says=["tracking needs the Python package opencv"])
    assert not (tmp_path / "out").exists()
    smooth_recipe = tmp_path / "smooth.json"
    smooth_recipe.write_text(json.dumps(RECIPE | {"version": 2, "inbetween": 2}))
    smooth = (*command, frames / "0001.png", "--recipe", smooth_recipe, "--output", tmp_path / "out", "--device", "gpu")
    lacking = "moments between frames need the Python package opencv"
    blender.run(*smooth, "--frames", 2, code=2, says=[lacking])
    assert not list(tmp_path.glob("out/*.png"))
    blender.remove()


def test_a_repository_updates(blender, repository, monkeypatch, tmp_path):
    """Blender subscribes to a folder, installs from it, and gets the next version."""
    place = shutil.copytree(repository[0], tmp_path / "repository")
    extension = ("--command", "extension")
    blender.run(*extension, "repo-add", "--url", f"{(place / 'index.json').as_uri()}", "ours")
    blender.run("--online-mode", *extension, "install", "--sync", "-e", "virtual_shutter")
    following = tmp_path / "virtual_shutter-9.9.9-linux_x64.zip"
    with zipfile.ZipFile(repository[1]) as packed, zipfile.ZipFile(following, "w") as changed:
        for name in packed.namelist():
            content = packed.read(name)
            if name == "blender_manifest.toml":
                content = re.sub(rb'(?m)^version = ".*"', b'version = "9.9.9"', content)
            changed.writestr(name, content)
    shutil.copy(following, place / "virtual_shutter-9.9.9-python3.12-linux_x64.zip")
    monkeypatch.syspath_prepend(ROOT / "scripts")
    importlib.import_module("build").make_repository(place, [following])
    assert [path.name for path in place.glob("*.zip")] == [following.name]
    blender.run("--online-mode", *extension, "update", "--sync")
    installed = blender.user / "extensions" / "ours" / "virtual_shutter" / "blender_manifest.toml"
    assert 'version = "9.9.9"' in installed.read_text()
    assert "WHEELS" in blender.run(
        "-b", "--python-expr", "import av; print('WHEELS' if '.local' in av.__file__ else 0)"
    )
