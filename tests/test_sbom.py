"""Bills of materials, beside what the zips hold; and that the modified wheel works."""

import base64
import csv
import hashlib
import io
import json
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import lief
import pytest
from cyclonedx.schema import SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "scripts"))

import build  # noqa: E402
import sbom  # noqa: E402 - scripts are no package
import without_openssl  # noqa: E402

LINUX = "linux-x64"


@pytest.fixture(scope="module")
def without(tmp_path_factory):
    return build.build_without_wheels(tmp_path_factory.mktemp("without"))


@pytest.fixture(scope="module")
def zips(without):
    return {system: build.build_with_wheels(without, without.parent, system) for system in build.SYSTEMS}


@pytest.fixture(scope="module")
def bills(zips):
    for path in zips.values():
        sbom.write(path, path.with_suffix(".cdx.json"))
    return {system: path.with_suffix(".cdx.json").read_text(encoding="utf-8") for system, path in zips.items()}


@pytest.fixture(scope="module")
def opencv(zips, tmp_path_factory):
    with zipfile.ZipFile(zips[LINUX]) as packed:
        (name,) = (name for name in packed.namelist() if name.startswith("wheels/opencv"))
        return Path(packed.extract(name, tmp_path_factory.mktemp("opencv")))


def files_of(text):
    """What a bill of materials says of files: SHA-256 by path."""
    listed = [each for each in json.loads(text)["components"] if each["type"] == "file"]
    hashes = {each["name"]: each["hashes"][0]["content"] for each in listed}
    assert len(hashes) == len(listed)
    return hashes


def files_in(path):
    """A zip's files and those of its wheels, unpacked here in a way of our own: SHA-256 by path."""
    found = {}
    with zipfile.ZipFile(path) as packed:
        for name in packed.namelist():
            if name.endswith("/"):
                continue
            content = packed.read(name)
            found[name] = hashlib.sha256(content).hexdigest()
            if name.endswith(".whl"):
                found |= {f"{name}!/{inner}": digest for inner, digest in files_in(io.BytesIO(content)).items()}
    return found


@pytest.mark.parametrize("system", build.SYSTEMS)
def test_a_bill_is_valid_and_lists_what_the_zip_holds_file_by_file(system, zips, bills):
    assert JsonStrictValidator(SchemaVersion.V1_6).validate_str(bills[system]) is None
    listed = files_of(bills[system])
    assert listed == files_in(zips[system])
    assert any(re.search(r"!/cv2/cv2\.(abi3\.so|pyd)$", name) for name in listed)


@pytest.mark.parametrize("system", build.SYSTEMS)
def test_a_bill_lists_wheels_and_what_they_bundle(system, zips, bills):
    listed = json.loads(bills[system])
    with zipfile.ZipFile(zips[system]) as packed:
        wheels = {name: packed.read(name) for name in packed.namelist() if name.endswith(".whl")}
    by_reference = {each["bom-ref"]: each for each in listed["components"]}
    for name, content in wheels.items():
        assert by_reference[name]["hashes"][0]["content"] == hashlib.sha256(content).hexdigest()
        assert by_reference[name]["purl"].startswith(f"pkg:pypi/{by_reference[name]['name']}@")
        assert ("?file_name=" in by_reference[name]["purl"]) == (without_openssl.TAG not in name)
        assert by_reference[name]["copyright"]
    files = files_of(bills[system])
    libraries = {each["value"] for part in by_reference.values() for each in part.get("properties", [])
                 if each["name"] == "virtual_shutter:file"}  # fmt: skip
    assert libraries < set(files)
    assert {name for name in files if re.search(r"\.(dy)?libs/|/opencv_videoio_ffmpeg", name)} == libraries
    (own,) = listed["metadata"]["component"]["hashes"]
    assert own["content"] == hashlib.sha256(zips[system].read_bytes()).hexdigest()
    depends = {each["ref"]: each.get("dependsOn", []) for each in listed["dependencies"]}
    assert set(depends["virtual_shutter"]) == {*wheels, "models/u2netp.onnx"}
    assert by_reference["models/u2netp.onnx"]["licenses"]
    assert {reference.split("!/")[1] for name in wheels for reference in depends[name]} >= {"FFmpeg", "x264", "x265"}


def test_the_same_zip_gives_the_same_bytes_in_another_process(without, tmp_path):
    sbom.write(without, tmp_path / "here.json")
    command = [sys.executable, ROOT / "scripts" / "sbom.py", without, tmp_path / "there.json"]
    subprocess.run(command, check=True, env={"TZ": "Asia/Tokyo", "PYTHONHASHSEED": "7"})
    assert (tmp_path / "here.json").read_bytes() == (tmp_path / "there.json").read_bytes()
    assert files_of((tmp_path / "here.json").read_text(encoding="utf-8")) == files_in(without)


def test_what_is_no_zip_is_one_sentence(tmp_path):
    (tmp_path / "no.zip").write_text("no zip")
    command = [sys.executable, ROOT / "scripts" / "sbom.py", tmp_path / "no.zip", tmp_path / "bill.json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr == f"sbom: {tmp_path / 'no.zip'}: no bill of materials: File is not a zip file\n"
    assert not (tmp_path / "bill.json").exists()


def test_a_wheel_without_openssl_says_what_it_holds(opencv):
    """Its RECORD is right, its tag is a wheel's, and nothing in it asks for OpenSSL."""
    assert opencv.name.split("-")[2] == without_openssl.TAG
    with zipfile.ZipFile(opencv) as packed:
        files = {name: packed.read(name) for name in packed.namelist()}
    (about,) = (content for name, content in files.items() if name.endswith(".dist-info/WHEEL"))
    assert f"\nBuild: {without_openssl.TAG}\n" in about.decode()
    (record,) = (name for name in files if name.endswith(".dist-info/RECORD"))
    rows = {name: (digest, size) for name, digest, size in csv.reader(io.StringIO(files[record].decode()))}
    assert rows.keys() == files.keys()
    for name, content in files.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
        assert rows[name] == ((f"sha256={digest}", str(len(content))) if name != record else ("", ""))
        if ".libs/" in name:
            library = lief.ELF.parse(io.BytesIO(content))
            needs = [each for need in library.symbols_version_requirement for each in need.get_auxiliary_symbols()]
            assert not any(each.name.startswith("OPENSSL") for each in needs), name
            assert not any(each.startswith(("libssl", "libcrypto")) for each in (Path(name).name, *library.libraries))


def test_the_same_wheel_gives_the_same_without_openssl(tmp_path):
    """Of OpenCV's wheel, cut down to what is changed and some that is not."""
    (wheel,) = (path for path in build.download(LINUX, build.BLENDERS_PYTHON) if path.name.startswith("opencv"))
    small = tmp_path / wheel.name
    parts = ("/libavutil-", "/libdrm-", "/libssl-", "/libcrypto-", ".dist-info/")
    with zipfile.ZipFile(wheel) as packed, zipfile.ZipFile(small, "w") as new:
        for member in packed.infolist():
            if any(part in member.filename for part in parts):
                new.writestr(member, packed.read(member))
    assert without_openssl.has_openssl(small)
    made = []
    for folder in (tmp_path / "one", tmp_path / "two"):
        folder.mkdir()
        made.append(without_openssl.take_out(small, folder))
    assert made[0].read_bytes() == made[1].read_bytes()
    assert not without_openssl.has_openssl(made[0])


def test_the_zip_says_first_that_the_wheel_is_modified(zips, opencv):
    """And what in it: all of it, and nothing else."""
    said = {}
    for system, path in zips.items():
        with zipfile.ZipFile(path) as packed:
            said[system] = packed.read("licenses/README.txt").decode()
    assert [system for system, text in said.items() if "modified" in text.lower()] == [LINUX]
    (original,) = (path for path in build.download(LINUX, build.BLENDERS_PYTHON) if path.name.startswith("opencv"))
    (paragraph,) = (each for each in said[LINUX].split("\n\n")[:2] if each.startswith("MODIFIED: "))
    assert paragraph.startswith(f"MODIFIED: {opencv.name} is not the wheel")
    for words in (original.name, "scripts/without_openssl.py", "The Virtual Shutter developers changed it on 20"):
        assert words in paragraph
    before, after = files_in(original), files_in(opencv)
    changed = {Path(name).name for name in before.keys() | after.keys() if before.get(name) != after.get(name)}
    parts = {re.split(r"-[0-9a-f]{8}\.", name)[0] for name in changed}
    assert parts == {"libssl", "libcrypto", "libavformat", "libavutil", "auditwheel.cdx.json", "WHEEL", "RECORD"}
    assert all(part in paragraph for part in parts)


def test_no_bill_of_materials_in_a_wheel_names_openssl(opencv):
    with zipfile.ZipFile(opencv) as packed:
        bills = {name: packed.read(name).decode() for name in packed.namelist() if name.endswith(".json")}
    (listed,) = (json.loads(text) for text in bills.values())
    assert not any("openssl" in text.lower() for text in bills.values())
    assert {"libgfortran", "libdrm"} < {each["name"] for each in listed["components"]}
    references = {each["bom-ref"] for each in listed["components"]}
    assert {each["ref"] for each in listed["dependencies"]} == references
    assert {needed for each in listed["dependencies"] for needed in each.get("dependsOn", [])} < references


@pytest.mark.skipif(sys.platform != "linux", reason="the wheel is Linux's")
def test_opencv_works_without_its_openssl(opencv, bunny, tmp_path):
    """Flow is found and films are read; an encrypted address is not opened, and ends nothing."""
    with zipfile.ZipFile(opencv) as packed:
        packed.extractall(tmp_path)
    code = f"""
import sys; sys.path.insert(0, {str(tmp_path)!r})
import socket, cv2, numpy
assert cv2.__file__.startswith({str(tmp_path)!r})
assert cv2.ximgproc  # of the contributed modules
noise = numpy.random.default_rng(0).integers(0, 256, (64, 64), numpy.uint8)
print(cv2.DISOpticalFlow_create().calc(noise, noise, None).shape)
print(cv2.VideoCapture({str(bunny)!r}, cv2.CAP_FFMPEG).read()[1].shape)
with socket.create_server(("127.0.0.1", 0)) as server:
    for scheme in ("https", "rtmps", "tls"):
        address = f"{{scheme}}://127.0.0.1:{{server.getsockname()[1]}}/film.mp4"
        print(cv2.VideoCapture(address, cv2.CAP_FFMPEG).isOpened())
print("libssl" in open("/proc/self/maps").read())
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split("\n")[:-1] == ["(64, 64, 2)", "(720, 1280, 3)", "False", "False", "False", "False"]
