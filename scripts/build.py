"""The extension's zips, made by Blender's own builder, and a repository of them.

Run by scripts/build. The manifest in the source tree has no wheels: so Blender builds, validates and links the checkout
as it is, without a download. The zip made of it is unpacked, gets wheels and the lines that list them, and is packed
again for each system; what belongs into a zip is said once, in the manifest. The wheels' holders of copyright and texts
of licences come from third_party/components.toml. All zips contain the model that finds subjects.
"""

import argparse
import hashlib
import importlib.util
import json
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
import zipfile
from pathlib import Path

import components
import fetch_model
import without_openssl

ROOT = Path(__file__).resolve().parents[1]
# What Blender 5.2 lacks; it brings NumPy, OpenImageIO and cattrs with attrs and typing_extensions. Nothing that it
# brings may be in here: an extension's wheels come before Blender's own modules, for all of Blender.
WHEELS = (
    "av==19.0.2",
    "glcontext==3.1.0",
    "moderngl==5.13.0",
    "opencv-contrib-python-headless==5.0.0.93",
    "tqdm==4.70.1",
)
ALSO = {"windows-x64": ("colorama==0.4.6",)}  # tqdm requires it there
# By Blender's name of a system, the one that pip looks for: as old as PyAV's wheels allow.
SYSTEMS = {"linux-x64": "manylinux_2_28_x86_64", "windows-x64": "win_amd64", "macos-arm64": "macosx_14_0_arm64"}
BLENDERS_PYTHON = "3.13"  # of official builds of 5.2
# SHA-256 of each wheel by its file's name: for that Python, and for 3.14, which Blenders of distributions have. A wheel
# for another one gets its line, by `sha256sum`, once somebody has looked at it.
HASHES = dict(line.split()[::-1] for line in (ROOT / "third_party" / "wheels.sha256").read_text().splitlines())


def manifest() -> dict:
    return tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))


def name(suffix: str) -> str:
    """A zip's file name; Blender's builder puts the system before the dot."""
    return f"{manifest()['id']}-{manifest()['version']}{suffix}.zip"


def build_without_wheels(output: Path, source: Path = ROOT) -> Path:
    """Makes the zip that works with what Blender brings."""
    fetch_model.fetch(source / fetch_model.PATH.relative_to(ROOT))
    path = output / name("-no_wheels")
    extension("build", "--source-dir", source, "--output-filepath", path)
    extension("validate", path)
    return path


def build_with_wheels(without: Path, output: Path, system: str, python: str = BLENDERS_PYTHON) -> Path:
    """Makes the zip for a system, with wheels for a Python version, from the zip without."""
    suffix = "" if python == BLENDERS_PYTHON else f"-python{python}"
    path = output / name(f"{suffix}-{system.replace('-', '_')}")
    with tempfile.TemporaryDirectory() as folder:
        stage = Path(folder)
        with zipfile.ZipFile(without) as packed:
            packed.extractall(stage)
        (stage / "wheels").mkdir()
        for wheel in download(system, python):
            shutil.copy(without_openssl.kept(wheel), stage / "wheels")
        wheels = sorted((stage / "wheels").iterdir())
        components.write_texts(stage / "licenses", wheels, system)
        complete_manifest(stage / "blender_manifest.toml", wheels, system)
        extension("build", "--source-dir", stage, "--output-filepath", path)
    extension("validate", path)
    return path


def download(system: str, python: str) -> list[Path]:
    """The wheels for a system, as PyPI has them; kept in build/wheels."""
    folder = ROOT / "build" / "wheels" / f"{SYSTEMS[system]}-{python}"
    wanted = (*WHEELS, *ALSO.get(system, ()))
    if missing := [wheel for wheel in wanted if _kept(folder, wheel) is None]:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder.parent) as half:  # builds beside each other see whole wheels alone
            _fetch(missing, Path(half), system, python)
            folder.mkdir(exist_ok=True)
            for path in Path(half).iterdir():
                path.replace(folder / path.name)
    return [_kept(folder, wheel) for wheel in wanted]


def _kept(folder: Path, wheel: str) -> Path | None:
    """A wheel in a folder; None where it is not there, or is not what is known of it."""
    name, version = wheel.split("==")
    return next(filter(_known, folder.glob(f"{name.replace('-', '_')}-{version}-*.whl")), None)


def _known(path: Path) -> bool:
    return HASHES.get(path.name) == hashlib.sha256(path.read_bytes()).hexdigest()


def _fetch(wheels: list[str], folder: Path, system: str, python: str) -> None:
    """Downloads wheels into a folder, and ends the program where they are not to be had or others than are known."""
    options = ["--only-binary=:all:", "--no-deps", "--implementation=cp", f"--python-version={python}"]
    # Warnings are for who works on pip, and where they are errors it does not start.
    pip = [sys.executable, "-W", "ignore", "-m", "pip", "download", "-qq", "--disable-pip-version-check"]
    pip += [*options, f"--platform={SYSTEMS[system]}", f"--dest={folder}", *wheels]
    if subprocess.run(pip, capture_output=True, check=False).returncode:
        fail(f"no wheels for Python {python} on {system}, or PyPI is not reached")
    if others := [path.name for path in sorted(folder.iterdir()) if not _known(path)]:
        fail(f"third_party/wheels.sha256 does not know {', '.join(others)} as it was downloaded")


def complete_manifest(path: Path, wheels: list[Path], system: str) -> None:
    """Adds the wheels, their system and all holders of copyright to a manifest, before its first table."""
    head, tables = path.read_text(encoding="utf-8").split("\n[", 1)
    holders = [*manifest()["copyright"], *components.copyright_lines(map(components.wheel_name, wheels), system)]
    head = re.sub(r"(?m)^copyright = \[.*\]\n", "", head)
    lines = [f'platforms = ["{system}"]']
    for key, values in (("wheels", [f"./wheels/{wheel.name}" for wheel in wheels]), ("copyright", holders)):
        lines += [f"{key} = [", *(f"  {json.dumps(value, ensure_ascii=False)}," for value in values), "]"]
    path.write_text("\n".join([head, *lines, "", f"[{tables}"]), encoding="utf-8", newline="\n")


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
    about = "also put the zips with wheels into a repository"
    parser.add_argument("--repository", type=Path, metavar="DIR", help=about)
    options = parser.parse_args()
    if options.repository and options.repository.resolve() == options.output.resolve():
        parser.error("--repository: it needs a folder of its own")
    options.output.mkdir(parents=True, exist_ok=True)
    output, systems = options.output.resolve(), options.system or SYSTEMS
    without = build_without_wheels(output)
    zips = [build_with_wheels(without, output, system, options.python) for system in systems]
    if options.repository:
        make_repository(options.repository.resolve(), zips)
    for path in (*zips, without):
        print(f"{path.stat().st_size / 1e6:5.1f} MB  {path}")


if __name__ == "__main__":
    main()
