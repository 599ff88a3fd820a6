"""A release in one folder, which is a repository that Blender subscribes to as well: the zips, their index, notes,
checksums, and what is in each zip.

Run by scripts/release. The same commit gives the same bytes, with the same versions of Blender as a library, lief,
cyclonedx-python-lib and zlib: all is built from what is committed, and dated by it.
"""

import argparse
import hashlib
import json
import os
import re
import subprocess
import sys
import tarfile
import tempfile
import time
import zipfile
from pathlib import Path

import build
import sbom

# Of Blenders that distributions built: the zips with wheels are for official ones.
OTHER_PYTHONS = ["3.12", "3.14", "3.15"]
# Those that Blender knows.
SYSTEMS = ("linux-arm64", "linux-x64", "macos-arm64", "macos-x64", "windows-arm64", "windows-x64")


def git(*arguments: str) -> str:
    done = subprocess.run(["git", *arguments], cwd=build.ROOT, capture_output=True, text=True, check=False)
    if done.returncode:
        fail(f"git {arguments[0]}: {done.stderr.strip() or 'it failed'}")
    return done.stdout.strip()


def notes(version: str) -> str:
    text = (build.ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    section = re.search(rf"(?ms)^## {re.escape(version)}$(.*?)(?=^## |\Z)", text)
    if section is None or not section[1].strip():
        fail(f"CHANGELOG.md says nothing of version {version}")
    # Pages that are linked from there are none of the release's files.
    return re.sub(r"\[([^\]]+)\]\((?!https:)[^)]+\)", r"\1", section[1]).strip() + "\n"


def commit() -> str:
    """The commit that is checked out; a checkout with changes is refused."""
    if git("status", "--porcelain"):
        fail("there are changes that are not committed")
    return git("rev-parse", "HEAD")


def committed(commit: str, folder: Path) -> Path:
    """The files of a commit alone, in a folder: a checkout may hold more, which git ignores and a zip would not."""
    packed = folder / "source.tar"
    git("archive", "--format=tar", f"--output={packed}", commit)
    with tarfile.open(packed) as archive:
        archive.extractall(folder / "source", filter="data")
    return folder / "source"


def normalise(path: Path, date: int) -> None:
    """Packs a zip anew: sorted, all files dated alike, in seconds since 1970, with the same modes. Without compression,
    which differs from zlib to zlib; wheels are compressed themselves."""
    with zipfile.ZipFile(path) as packed:
        files = {name: packed.read(name) for name in sorted(packed.namelist())}
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as packed:
        for name, data in files.items():
            file = zipfile.ZipInfo(name, time.gmtime(date)[:6])
            file.create_system, file.external_attr = 3, 0o100644 << 16  # as on Linux
            packed.writestr(file, data)
    build.extension("validate", path)


def write_index(folder: Path, date: int) -> None:
    """The index of the zips in a folder, by Blender; sorted, dated alike, and with the zip without wheels for those
    systems and Pythons alone that have no other: Blender is to be offered one zip. The page offers all to whoever looks
    at it."""
    build.extension("server-generate", "--repo-dir", folder, "--html")
    index, page = folder / "index.json", folder / "index.html"
    listed = json.loads(index.read_text(encoding="utf-8"))
    taken = {system for zipped in listed["data"] for system in zipped.get("platforms", ())}
    for zipped in [zipped for zipped in listed["data"] if "platforms" not in zipped]:
        zipped["platforms"] = [system for system in SYSTEMS if system not in taken]
        listed["data"].append({**zipped, "platforms": sorted(taken), "python_versions": OTHER_PYTHONS})
    listed["data"].sort(key=lambda zipped: (zipped["archive_url"], zipped["platforms"]))
    write(index, json.dumps(listed, indent=2) + "\n")
    head, *rows = re.split(r"(?m)^(?=  <tr>$)", page.read_text(encoding="utf-8"))
    rows[-1], end = re.split(r"(?m)^(?=</table>$)", rows[-1])
    names, *zips = rows
    day = time.strftime("%Y-%m-%d, %H:%M", time.gmtime(date))
    write(page, "".join([head, names, *sorted(zips), re.sub(r"Built [\d-]+, [\d:]+", f"Built {day}", end)]))


def write_checksums(folder: Path) -> None:
    """SHA-256 of all files in a folder, as `sha256sum --check SHA256SUMS` reads it."""
    files = sorted(folder.iterdir())
    lines = [f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.name}\n" for path in files]
    write(folder / "SHA256SUMS", "".join(lines))


def write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8", newline="\n")


def test(released: str) -> None:
    """Has scripts/test pass, with a commit checked out before and after; it installs the zips in a Blender."""
    if not os.environ.get("BLENDER"):
        fail("set BLENDER to the command that runs a Blender in which the zips are tested, or give --no-tests")
    environment = os.environ | {"SHUTTER_BACKENDS": "both"}
    if subprocess.run([build.ROOT / "scripts" / "test", "--all"], env=environment, check=False).returncode:
        fail("the tests fail")
    if commit() != released:
        fail("another commit was checked out while the tests ran")


def make(folder: Path, commit: str, systems: list[str], text: str) -> None:
    """Puts all of a release of a commit into a folder; text: its notes."""
    date = int(git("log", "-1", "--format=%ct", commit))
    with tempfile.TemporaryDirectory() as stage:
        without = build.build_without_wheels(folder, committed(commit, Path(stage)))
        zips = [without, *(build.build_with_wheels(without, folder, system) for system in systems)]
    for path in zips:
        normalise(path, date)
        sbom.write(path, path.with_suffix(".cdx.json"))
    write_index(folder, date)
    write(folder / "release-notes.md", text)
    write_checksums(folder)


def fail(sentence: str) -> None:
    print(f"release: {sentence}", file=sys.stderr)
    sys.exit(2)


def arguments() -> argparse.Namespace:
    about = "Tests, then makes all that belongs to a release in one folder. A relative DIR is in the project's folder."
    parser = argparse.ArgumentParser("scripts/release", description=about)
    parser.add_argument("--output", type=Path, metavar="DIR", help="a new folder; default: dist/VERSION")
    parser.add_argument("--version", metavar="X.Y.Z", help="the version that is meant; another one is refused")
    parser.add_argument("--system", action="append", choices=build.SYSTEMS, help="these alone; may be given again")
    parser.add_argument("--no-tests", action="store_true", help="where they have passed before")
    return parser.parse_args()


def main() -> None:
    options, version = arguments(), build.manifest()["version"]
    output = (options.output or build.ROOT / "dist" / version).resolve()
    if options.version not in (None, version):
        fail(f"this is version {version}, not {options.version}")
    released, text = commit(), notes(version)
    if not (build.ROOT / "tests" / "saved" / version).is_dir():
        fail(f"tests/saved/{version} is missing: run scripts/save_version.py")
    if output.exists():
        fail(f"{output} is there already")
    if not options.no_tests:
        test(released)
    output.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".release-", dir=output.parent) as folder:
        made = Path(folder) / output.name
        made.mkdir()
        make(made, released, options.system or list(build.SYSTEMS), text)
        os.replace(made, output)
    for path in sorted(output.iterdir()):
        print(f"{path.stat().st_size / 1e6:7.2f} MB  {path}")


if __name__ == "__main__":
    main()
