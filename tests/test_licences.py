"""Licences: what the zips' wheels hold and require, beside third_party/components.toml; who holds what is in a zip."""

import re
import sys
import zipfile
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "scripts"))

import build  # noqa: E402
import components  # noqa: E402 - scripts are no package
import without_openssl  # noqa: E402

DATA = components.DATA
OPENCV = "opencv_contrib_python_headless"
# What markers of requirements ask of each system's Python.
NAMES = "platform_system", "sys_platform", "os_name", "platform_machine"
MARKERS = {
    "linux-x64": dict(zip(NAMES, ("Linux", "linux", "posix", "x86_64"), strict=True)),
    "windows-x64": dict(zip(NAMES, ("Windows", "win32", "nt", "AMD64"), strict=True)),
    "macos-arm64": dict(zip(NAMES, ("Darwin", "darwin", "posix", "arm64"), strict=True)),
}
MARKERS = {system: MARKERS[system] | {"python_version": build.BLENDERS_PYTHON, "extra": ""} for system in build.SYSTEMS}


@pytest.fixture(scope="module", params=build.SYSTEMS)
def system(request):
    return request.param


@pytest.fixture(scope="module")
def wheels(system):
    paths = build.download(system, build.BLENDERS_PYTHON)
    packed = {components.wheel_name(path): zipfile.ZipFile(path) for path in paths}
    yield packed
    for each in packed.values():
        each.close()


@pytest.fixture(scope="module")
def third_party(wheels):
    """The names of what OpenCV's wheel says that OpenCV's packages bring."""
    text = wheels[OPENCV].read("cv2/LICENSE-3RD-PARTY.txt").decode()
    named = re.findall(r"(?m)^(.+?)(?: library)?(?: and it's dependnecies)? (?:is|are) redistributed within", text)
    return {name.lower() for name in named}


def member(packed, pattern):
    (path,) = (name for name in packed.namelist() if re.search(pattern, name))
    return packed.read(path).decode("latin-1")


def test_each_library_in_a_wheel_is_of_one_component(wheels, system):
    for wheel, packed in wheels.items():
        held = [name for name in packed.namelist() if not without_openssl.is_openssl(name)]
        names = sorted(components.libraries(held).values())
        assert names == sorted(DATA["libraries"].get(wheel, {}).get(system, {})), wheel


def test_openssl_is_taken_out_wherever_it_is_of_the_old_licence(wheels):
    old = re.compile(r"lib(ssl|crypto)\b.*\.(1\.[01])", re.IGNORECASE)
    for packed in wheels.values():
        assert all(without_openssl.is_openssl(name) for name in packed.namelist() if old.search(name))


def test_what_is_built_into_opencv_is_what_its_build_says(wheels, system):
    """OpenCV's modules hold the summary of their build."""
    summary = member(wheels[OPENCV], r"^cv2/cv2\.(abi3\.so|pyd)$")
    (said,) = re.findall(r"3rdparty dependencies: +([^\n]+)", summary)
    built_in = DATA["built-in"][OPENCV][system]
    names = {name.split(" ")[0] for name in built_in}
    assert set(said.split()) <= names
    for name in built_in:
        _, _, version = name.partition(" ")
        assert version in summary, name
    assert ("ippicv" in names) == ("Intel IPP:" in summary)


def test_what_ffmpeg_was_built_with_is_known(wheels, system):
    """FFmpeg's libraries hold the options of their build."""
    systems_own = {"libxml2"} if system == "macos-arm64" else set()
    spelled = {"libopenjpeg": "libopenjp2"}
    for wheel in ("av", OPENCV):
        library = r"(avcodec[-.][^/]*(\.so[.\d]*|\.dylib|\.dll)|videoio_ffmpeg\w+\.dll)$"
        enabled = set(re.findall(r"--enable-(lib\w[\w-]*)", member(wheels[wheel], library)))
        assert "libvpx" in enabled
        held = [*DATA["libraries"][wheel][system], *DATA["built-in"][wheel][system]]
        names = [re.sub("^(lib)?", "lib", name.lower()) for name in held]
        for option in enabled - systems_own:
            assert any(name.startswith(spelled.get(option, option)) for name in names), (wheel, option)


def test_what_opencv_says_of_third_parties_is_known(third_party):
    """It names the same for all systems, and some that are in none of these wheels."""
    held = [*DATA["libraries"][OPENCV].values(), *DATA["built-in"][OPENCV].values()]
    known = {name.lower() for name in ("OpenCV", *DATA["component"], *(name for each in held for name in each))}
    elsewhere = {name.lower() for name in DATA["not-bundled"]}
    single = {name for names in third_party - elsewhere for name in re.split(", | and ", names)}
    assert len(single) > 40
    assert elsewhere <= third_party | single
    unknown = {name for name in single - elsewhere if not any(name.removeprefix("lib") in each for each in known)}
    assert not unknown


def test_each_wheels_own_licence_is_what_is_said_of_it(wheels):
    for wheel, packed in wheels.items():
        says, its = components.metadata(packed), DATA["wheel"][wheel]
        classifiers = [each for each in says.get_all("Classifier", []) if each.startswith("License ::")]
        own = says["License-Expression"] or says["License"] or classifiers[0]
        assert own == its.get("metadata", its["licence"]), wheel


def test_all_that_a_wheel_bundles_is_of_a_wheel(wheels, system):
    for kind in ("libraries", "built-in"):
        assert all(wheel in wheels for wheel, systems in DATA[kind].items() if system in systems)
    assert {wheel for wheel, its in DATA["wheel"].items() if system in its.get("systems", build.SYSTEMS)} == {*wheels}


def blenders():
    """The packages that Blender brings, as its wheel says: it requires them where Blender has them inside."""
    found, new = set(), {"bpy"}
    while new:
        name = canonicalize_name(new.pop())
        found.add(name)
        needed = (Requirement(each) for each in metadata.requires(name) or [])
        new |= {each.name for each in needed if not each.marker or each.marker.evaluate({"extra": ""})} - found
    return found


def test_every_requirement_of_every_wheel_is_met(wheels, system):
    says = {wheel: components.metadata(packed) for wheel, packed in wheels.items()}
    brought = {name: metadata.version(name) for name in blenders()}
    bundled = {canonicalize_name(each["Name"]): each["Version"] for each in says.values()}
    assert not set(brought) & set(bundled), "an extension's wheels come before Blender's own modules"
    for wheel, each in says.items():
        for needed in map(Requirement, each.get_all("Requires-Dist", [])):
            if not needed.marker or needed.marker.evaluate(MARKERS[system]):
                version = (brought | bundled).get(canonicalize_name(needed.name))
                assert version, (wheel, str(needed))
                assert needed.specifier.contains(version), (wheel, str(needed))


def test_every_licence_has_a_text_and_a_reason():
    everything = [*DATA["component"].values(), *DATA["wheel"].values()]
    used = {licence for each in everything for licence in components.identifiers(each["licence"])}
    assert used == DATA["licence"].keys() | DATA["incompatible"].keys()
    bundled = {licence for each in DATA["component"].values() for licence in components.identifiers(each["licence"])}
    texts = {path.stem.removeprefix("LICENSE-") for path in components.TEXTS.glob("LICENSE-*.txt")}
    assert {re.sub("-(only|or-later)$", "", licence) for licence in bundled} == texts | {"GPL-3.0"}


def test_every_component_is_in_a_wheel():
    wheels = [*DATA["libraries"].values(), *DATA["built-in"].values()]
    held = {owner for wheel in wheels for system in wheel.values() for owner in system.values()}
    assert held == set(DATA["component"])


def test_all_that_is_incompatible_is_said_to_be_unresolved():
    page = components.PAGE.read_text(encoding="utf-8")
    unresolved = page.split("## What is not resolved")[1].split("\n## ")[0]
    for key, each in DATA["component"].items():
        if {*components.identifiers(each["licence"])} & {*DATA["incompatible"]}:
            assert f"**{key}**" in unresolved


def test_the_page_is_of_the_data():
    assert components.PAGE.read_text(encoding="utf-8") == components.page(), "run scripts/components.py"
