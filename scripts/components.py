"""What the zips bring beside the extension's own files, read from third_party/components.toml.

Run as a program it writes docs/licences.md.
"""

import re
import tomllib
import zipfile
from collections.abc import Iterable
from dataclasses import dataclass
from email.message import Message
from email.parser import BytesParser
from pathlib import Path

import without_openssl

ROOT = Path(__file__).resolve().parents[1]
TEXTS = ROOT / "third_party"
PAGE = ROOT / "docs" / "licences.md"
DATA = tomllib.loads((TEXTS / "components.toml").read_text(encoding="utf-8"))
SYSTEMS = {"linux-x64": "Linux", "macos-arm64": "macOS", "windows-x64": "Windows"}
# Shared libraries, but for a wheel's own modules; auditwheel and delvewheel put hashes into their names.
_LIBRARY = re.compile(r"\.(so[.\w]*|dylib|dll)$")
_MODULE = re.compile(r"\.(abi3|cpython-[\w-]+)\.so$")
_HASH = re.compile(r"-([0-9a-f]{32}(?=\.dll$)|[0-9a-f]{8}(?=\.))")
_VERSION = re.compile(r"[-. ]r?([0-9][0-9.]*?)(\.dylib|\.dll|\.so)?$")


@dataclass(frozen=True)
class Part:
    """A component as a wheel for a system holds it: as files, whose names have no hashes, or built into others."""

    name: str
    licence: str
    copyright: tuple[str, ...]
    wheel: str
    system: str
    files: tuple[str, ...]
    built_in: tuple[str, ...]

    def versions(self) -> list[str]:
        """What its names say: of files that is the version of the interface, where its makers count so."""
        found = (version(name) for name in (*self.files, *self.built_in))
        return sorted({each for each in found if each})


def version(name: str) -> str:
    """The version in a library's name, or ""."""
    found = _VERSION.search(name)
    return found[1] if found else ""


def parts(wheel: str, system: str) -> list[Part]:
    """What a wheel, by the name its file begins with, bundles for a system."""
    files, built_in = ({**DATA[kind].get(wheel, {}).get(system, {})} for kind in ("libraries", "built-in"))
    found = []
    for key in sorted({*files.values(), *built_in.values()}, key=str.lower):
        its = DATA["component"][key]
        names = (tuple(name for name, owner in kind.items() if owner == key) for kind in (files, built_in))
        found.append(Part(its.get("name", key), its["licence"], tuple(its["copyright"]), wheel, system, *names))
    return found


def canonical(path: str) -> str:
    return _HASH.sub("", path.rsplit("/", 1)[-1])


def libraries(members: Iterable[str]) -> dict[str, str]:
    """Of a wheel's members its shared libraries, with their names without hashes."""
    return {path: canonical(path) for path in members if _LIBRARY.search(path) and not _MODULE.search(path)}


def metadata(packed: zipfile.ZipFile) -> Message:
    (path,) = (name for name in packed.namelist() if re.fullmatch(r"[^/]+\.dist-info/METADATA", name))
    return BytesParser().parsebytes(packed.read(path))


def wheel_name(path: Path | str) -> str:
    return Path(path).name.split("-")[0]


def identifiers(licence: str) -> list[str]:
    return re.split(" (?:AND|OR|WITH) ", licence)


def why(licence: str) -> str:
    """Whether, and why, a licence goes with GPL-3.0-or-later; of several that are offered, the first."""
    reasons = DATA["licence"] | DATA["incompatible"]
    return "; ".join(dict.fromkeys(reasons[each] for each in identifiers(licence.split(" OR ")[0])))


def copyright_lines(wheels: Iterable[str], system: str) -> list[str]:
    """For a manifest: years, holder and, in brackets, of what."""
    holders = []
    for wheel in sorted(wheels):
        bundled = ((part.name, part.copyright) for part in parts(wheel, system))
        holders += [(DATA["wheel"][wheel]["name"], DATA["wheel"][wheel]["copyright"]), *bundled]
    return list(dict.fromkeys(f"{line} ({name})" for name, lines in holders for line in lines))


def write_texts(folder: Path, wheels: list[Path], system: str) -> None:
    """Fills a zip's folder of licences: what it bundles, the wheels' own texts, and those of their libraries."""
    folder.mkdir()
    entries, needed = [], set()
    for path in sorted(wheels):
        wheel = wheel_name(path)
        its, bundled = DATA["wheel"][wheel], parts(wheel, system)
        needed.update(*(identifiers(each.licence) for each in bundled))
        texts = copy_texts(path, folder / wheel)
        entries.append(f"{its['name']} ({path.name})\n  Licence: {its['licence']}; {', '.join(texts)}")
        entries += [f"  Copyright {line}" for line in its["copyright"]]
        entries.append(f"  Source code: {its['source']}")
        entries += ["", *(line for part in bundled for line in _entry(part))]
    for licence in sorted({_text(each) for each in needed} - {"GPL-3.0"}):
        (folder / f"LICENSE-{licence}.txt").write_bytes((TEXTS / f"LICENSE-{licence}.txt").read_bytes())
    about = "What comes with Virtual Shutter, in the folder wheels. Texts that are named by their SPDX identifier are\n"
    about += "here as LICENSE-*.txt; that of the GPL, version 3, is LICENSE, beside this folder.\n"
    modified = [notice for path in sorted(wheels) if (notice := without_openssl.notice(path.name))]
    (folder / "README.txt").write_text("\n".join([about, *modified, *entries]), encoding="utf-8", newline="\n")


def copy_texts(wheel: Path, folder: Path) -> list[str]:
    """Copies what a wheel says of licences and authors; the copies' paths within the folder of licences."""
    with zipfile.ZipFile(wheel) as packed:
        names = [
            name
            for name in sorted(packed.namelist())
            if re.search(r"\.dist-info/(licenses/)?(licen[cs]e|copying|notice|authors)[^/]*$", name, re.IGNORECASE)
            and not name.endswith(".py")
        ]
        folder.mkdir()
        for name in names:
            (folder / Path(name).name).write_bytes(packed.read(name))
    return [f"{folder.name}/{Path(name).name}" for name in names]


def _entry(part: Part) -> list[str]:
    held = ", ".join((*part.files, *(f"{name} (built in)" for name in part.built_in)))
    lines = [f"  {part.name}: {held}", f"    Licence: {part.licence}"]
    return [*lines, *(f"    Copyright {line}" for line in part.copyright), ""]


def _text(identifier: str) -> str:
    """The text's name: one serves for "only" and "or later"."""
    return re.sub("-(only|or-later)$", "", identifier)


def page() -> str:
    """The table of docs/licences.md."""
    rows: dict[tuple[str, str], list[Part]] = {}
    for wheel, its in DATA["wheel"].items():
        for system in its.get("systems", SYSTEMS):
            own = Part(its["name"], its["licence"], tuple(its["copyright"]), wheel, system, (), ())
            for part in (own, *parts(wheel, system)):
                rows.setdefault((part.name, part.licence), []).append(part)
    lines = [_row(*key, found) for key, found in sorted(rows.items(), key=lambda row: (row[0][0].lower(), row[0][1]))]
    for its in DATA["model"].values():
        lines.append(f"| {its['name']} |  | all zips | {its['licence']} | yes: {why(its['licence'])} |")
    return _HEAD + "\n".join(lines) + "\n"


def _row(name: str, licence: str, found: list[Part]) -> str:
    versions = ", ".join(sorted({each for part in found for each in part.versions()}))
    places: dict[str, list[str]] = {}
    for part in found:
        own = name == DATA["wheel"][part.wheel]["name"]
        places.setdefault("a wheel of its own" if own else DATA["wheel"][part.wheel]["name"], []).append(part.system)
    where = "; ".join(_place(place, systems) for place, systems in places.items())
    allowed = "no" if {*identifiers(licence)} & {*DATA["incompatible"]} else "yes"
    return f"| {name} | {versions} | {where} | {licence} | {allowed}: {why(licence)} |"


def _place(place: str, systems: list[str]) -> str:
    return place if len(systems) == len(SYSTEMS) else f"{place} ({', '.join(SYSTEMS[each] for each in systems)})"


_HEAD = """\
# Licences of what the zips contain

Virtual Shutter is under the GNU General Public License, version 3 or later. The zips with wheels also contain what this
page lists. The zip without wheels contains nothing of it but the model that finds subjects, which lies with its licence
in the folder `models`. Each other zip has the texts of the licences in its folder
`licenses`, and the copyright holders in its manifest.

`scripts/components.py` writes this page from `third_party/components.toml`, and a test compares it with the wheels. Do
not edit it by hand.

## What is not resolved

- **Intel IPP** is built into OpenCV for Linux and Windows. Intel's terms allow passing it on, but forbid reverse
  engineering and changes. The GPL does not allow such a restriction. IPP cannot be removed from the modules, and all
  OpenCV packages on PyPI for these systems contain it. A build without it (`WITH_IPP=OFF`) would have to be made and
  published for each system. The zip for macOS and the one without wheels do not contain it.
- **Sources** of the libraries in the wheels are named by the makers of the wheels, without a version for each. If you
  pass the zips on, you have to be able to provide the sources of what is under the GPL and LGPL.

## What is taken out

- **OpenSSL 1.1.1k** comes with OpenCV's wheel for Linux, for the network protocols of that wheel's own FFmpeg. Its old
  licence has an advertising clause, which the GPL does not allow. So `scripts/build` removes it
  (`scripts/without_openssl.py`). The changed wheel has the build tag `1noopenssl`, and its FFmpeg opens no `https`,
  `rtmps` or `rtmpe` addresses. All other wheels are unmodified.

## What is in the zips

Versions come from file names and builds. A version in a file name is often that of the library's interface (ABI). A
component without a system is in the zips for all three. `scripts/build.py` has the versions of the wheels. If a wheel
lacks a library's licence text, its licence and holders come from the project's own pages, and not from the sources of
the wheel.

| component | version | where | licence | may be combined with GPL-3.0-or-later |
|---|---|---|---|---|
"""


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8", newline="\n")
