"""The extension's zips, made by Blender's own builder, and a repository of them.

Run by scripts/build. The manifest in the source tree has no wheels: so Blender builds, validates and links the checkout
as it is, without a download. The zip made of it is unpacked, gets wheels and the lines that list them, and is packed
again for each system; what belongs into a zip is said once, in the manifest.
"""

import argparse
import importlib.util
import shutil
import subprocess
import sys
import tempfile
import tomllib
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
# What Blender 5.2 lacks; it brings NumPy, OpenImageIO and cattrs with attrs and typing_extensions. Nothing that it
# brings may be in here: an extension's wheels come before Blender's own modules, for all of Blender.
WHEELS = (
    "av==19.0.2",
    "glcontext==3.1.0",
    "moderngl==5.13.0",
    "opencv-contrib-python-headless==5.0.0.93",
    "scenedetect==0.6.7.1",  # without click and platformdirs, which its command alone needs
    "tqdm==4.70.1",
)
# By Blender's name of a system, the one that pip looks for: as old as PyAV's wheels allow.
SYSTEMS = {"linux-x64": "manylinux_2_28_x86_64", "windows-x64": "win_amd64", "macos-arm64": "macosx_14_0_arm64"}
BLENDERS_PYTHON = "3.13"  # of official builds of 5.2


def manifest() -> dict:
    return tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))


def name(suffix: str) -> str:
    """A zip's file name; Blender's builder puts the system before the dot."""
    return f"{manifest()['id']}-{manifest()['version']}{suffix}.zip"


def build_without_wheels(output: Path) -> Path:
    """Makes the zip that works with what Blender brings."""
    path = output / name("-no_wheels")
    extension("build", "--source-dir", ROOT, "--output-filepath", path)
    extension("validate", path)
    return path


def build_with_wheels(without: Path, output: Path, systems: list[str], python: str) -> list[Path]:
    """Makes a zip for each system, with wheels for a Python version, from the zip without."""
    path = output / name("" if python == BLENDERS_PYTHON else f"-python{python}")
    with tempfile.TemporaryDirectory() as folder:
        stage = Path(folder)
        with zipfile.ZipFile(without) as packed:
            packed.extractall(stage)
        (stage / "wheels").mkdir()
        for system in systems:
            for wheel in download(system, python):
                shutil.copy(wheel, stage / "wheels")
        list_wheels(stage, systems)
        extension("build", "--source-dir", stage, "--output-filepath", path, "--split-platforms")
    made = [path.with_stem(f"{path.stem}-{system.replace('-', '_')}") for system in systems]
    for zip_path in made:
        extension("validate", zip_path)
    return made


def download(system: str, python: str) -> list[Path]:
    """The wheels for a system, unmodified from PyPI; kept in build/wheels."""
    folder = ROOT / "build" / "wheels" / f"{SYSTEMS[system]}-{python}"
    found = [list(folder.glob(f"{_file(wheel)}-*.whl")) for wheel in WHEELS]
    if all(found):
        return [wheel for (wheel,) in found]
    shutil.rmtree(folder, ignore_errors=True)
    options = ["--only-binary=:all:", "--no-deps", "--implementation=cp", f"--python-version={python}"]
    pip = [sys.executable, "-m", "pip", "download", "-qq", "--disable-pip-version-check"]
    pip += [*options, f"--platform={SYSTEMS[system]}", f"--dest={folder}", *WHEELS]
    if subprocess.run(pip, capture_output=True, check=False).returncode:
        fail(f"no wheels for Python {python} on {system}, or PyPI is not reached")
    return sorted(folder.glob("*.whl"))


def _file(wheel: str) -> str:
    """How a wheel's file name begins."""
    name, version = wheel.split("==")
    return f"{name.replace('-', '_')}-{version}"


def list_wheels(stage: Path, systems: list[str]) -> None:
    """Lists the wheels and the systems in the manifest, before its first table."""
    path = stage / "blender_manifest.toml"
    head, tables = path.read_text(encoding="utf-8").split("\n[", 1)
    wheels = sorted(f"./wheels/{wheel.name}" for wheel in (stage / "wheels").iterdir())
    lines = [f"platforms = {systems}", "wheels = [", *(f'  "{wheel}",' for wheel in wheels), "]", ""]
    path.write_text("\n".join([head, *lines, f"[{tables}"]), encoding="utf-8")


def make_repository(folder: Path, zips: list[Path]) -> None:
    """Puts zips into a repository: a folder that Blender subscribes to, as it is or on any web server."""
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.glob(f"{manifest()['id']}-*.zip"):
        old.unlink()  # a repository offers one version, for one Python
    for path in zips:
        shutil.copy(path, folder)
    extension("server-generate", "--repo-dir", folder, "--html")


def extension(*arguments) -> None:
    """Runs `blender --command extension …`, of the bpy wheel; it needs no Blender that runs."""
    (blender,) = importlib.util.find_spec("bpy").submodule_search_locations
    (command,) = Path(blender).glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py")
    done = subprocess.run([sys.executable, command, *map(str, arguments)], capture_output=True, text=True, check=False)
    if done.returncode:
        fail(f"extension {arguments[0]} failed\n{done.stdout}{done.stderr}")


def fail(sentence: str) -> None:
    print(f"build: {sentence}", file=sys.stderr)
    sys.exit(2)


def main() -> None:
    about = "Makes the extension's zips. scripts/build takes a relative DIR from the project's folder."
    parser = argparse.ArgumentParser("scripts/build", description=about)
    parser.add_argument("--output", type=Path, default=ROOT / "dist", metavar="DIR", help="default: dist")
    parser.add_argument("--python", default=BLENDERS_PYTHON, metavar="X.Y", help="Blender's Python (%(default)s)")
    parser.add_argument("--system", action="append", choices=SYSTEMS, help="these systems only; may be given again")
    parser.add_argument(
        "--repository", type=Path, metavar="DIR", help="also put the zips with wheels into a repository"
    )
    options = parser.parse_args()
    if options.repository and options.repository.resolve() == options.output.resolve():
        parser.error("--repository: it needs a folder of its own")
    options.output.mkdir(parents=True, exist_ok=True)
    without = build_without_wheels(options.output.resolve())
    zips = build_with_wheels(without, options.output.resolve(), options.system or list(SYSTEMS), options.python)
    if options.repository:
        make_repository(options.repository.resolve(), zips)
    for path in (*zips, without):
        print(f"{path.stat().st_size / 1e6:5.1f} MB  {path}")


if __name__ == "__main__":
    main()
