"""A release: what is in its folder, that a commit gives the same bytes everywhere, and what is refused."""

import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from fresh import installed

ROOT = Path(__file__).parents[1]
SYSTEM = {"linux": "linux-x64", "win32": "windows-x64", "darwin": "macos-arm64"}[sys.platform]
VERSION = "0.0.7"
NOTES = "The first.\n\n- It is *small*.\n"
CHANGELOG = f"# Changelog\n\n## 0.1.0\n\n- Later.\n\n## {VERSION}\n\n{NOTES}\n## 0.0.6\n\n- Old.\n"
AUTHOR = {f"GIT_{who}_{what}": "a@b.c" for who in ("AUTHOR", "COMMITTER") for what in ("NAME", "EMAIL")}
NEEDLESS = shutil.ignore_patterns(".*", "assets", "build", "dist", "docs", "out", "tests", "gallery", "__pycache__")
# What a release costs without: wheels of other systems, and tests of the project.
FAST = ("--no-tests", "--system", SYSTEM)


def git(folder, *arguments):
    command = ["git", "-C", folder, *arguments]
    return subprocess.run(command, env=os.environ | AUTHOR, check=True, capture_output=True, text=True).stdout


def commit(folder):
    git(folder, "add", "--all")
    git(folder, "commit", "--message", "All of it")


def with_wheels(folder):
    (folder / "build").mkdir()
    (ROOT / "build" / "wheels").mkdir(parents=True, exist_ok=True)
    (folder / "build" / "wheels").symlink_to(ROOT / "build" / "wheels", target_is_directory=True)
    return folder


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    """A project of its own, committed: this one as it is now, without what no release needs, of another version."""
    folder = tmp_path_factory.mktemp("release") / "project"
    shutil.copytree(ROOT, folder, ignore=NEEDLESS)
    for name in (".gitattributes", ".gitignore"):
        shutil.copy(ROOT / name, folder)
    manifest = folder / "blender_manifest.toml"
    version, text = manifest.read_text().partition('\nversion = "')[::2]
    manifest.write_text(f'{version}\nversion = "{VERSION}"{text.partition(chr(34))[2]}')
    (folder / "CHANGELOG.md").write_text(CHANGELOG)
    saved = folder / "tests" / "saved" / VERSION / "edit.blend"
    saved.parent.mkdir(parents=True)
    saved.write_bytes(b"what the version saves")
    git(folder.parent, "init", folder)
    commit(folder)
    return with_wheels(folder)


@pytest.fixture
def copy(project, tmp_path):
    git(project, "clone", project, tmp_path / "copy")
    return with_wheels(tmp_path / "copy")


def run(folder, *arguments, **options):
    command = [sys.executable, folder / "scripts" / "release.py", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, cwd=folder, **options)


def refused(folder, sentence, *arguments):
    done = run(folder, *arguments)
    assert (done.returncode, done.stderr) == (2, f"release: {sentence}\n")
    assert not list((folder / "dist").glob("*"))
    assert not list((folder / "dist").glob(".*"))


@pytest.fixture(scope="module")
def released(project):
    done = run(project, *FAST)
    assert done.returncode == 0, done.stderr
    (folder,) = (project / "dist").iterdir()
    assert folder.name == VERSION
    return folder


def module(path):
    spec = importlib.util.spec_from_file_location(f"{path.stem}_by_path", path)
    loaded = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(loaded)
    return loaded


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_all_that_belongs_to_a_release(released):
    zips = [f"virtual_shutter-{VERSION}-{system}" for system in (SYSTEM.replace("-", "_"), "no_wheels")]
    files = {"SHA256SUMS", "index.html", "index.json", "release-notes.md"}
    assert set(contents(released)) == files | {f"{name}{end}" for name in zips for end in (".zip", ".cdx.json")}
    assert (released / "release-notes.md").read_text() == NOTES
    subprocess.run(["sha256sum", "--check", "--strict", "SHA256SUMS"], cwd=released, check=True, capture_output=True)
    assert (released / "SHA256SUMS").read_text().count("\n") == len(contents(released)) - 1
    for name in zips:
        assert json.loads((released / f"{name}.cdx.json").read_text())["bomFormat"] == "CycloneDX"


def test_the_same_commit_gives_the_same_bytes(released, copy, tmp_path):
    """Another folder, umask, time zone, order and time of files, ends of lines; and what a checkout has besides."""
    git(copy, "config", "core.autocrlf", "true")
    for folder in ("shaders", "third_party"):
        shutil.rmtree(copy / folder)
        git(copy, "checkout", folder)
    (copy / "shutter_addon" / "old.blend1").touch()
    for number, path in enumerate(sorted(copy.rglob("*.py"))):
        os.utime(path, (number * 1e6, number * 1e6))
        path.chmod(0o700)
    git(copy, "config", "core.fileMode", "false")
    output = tmp_path / "elsewhere"
    other = os.environ | {"TZ": "Asia/Tokyo", "PYTHONHASHSEED": "7", "LC_ALL": "C"}
    done = run(copy, *FAST, "--output", output, umask=0o077, env=other)
    assert done.returncode == 0, done.stderr
    ours, theirs = contents(released), contents(output)
    assert set(ours) == set(theirs)
    assert [name for name in ours if ours[name] != theirs[name]] == []


def test_a_zip_is_in_its_normal_form(released):
    for path in released.glob("*.zip"):
        with zipfile.ZipFile(path) as packed:
            files = packed.infolist()
        assert [file.filename for file in files] == sorted(file.filename for file in files)
        assert len({file.date_time for file in files}) == 1
        assert {(file.external_attr, file.compress_type) for file in files} == {(0o100644 << 16, zipfile.ZIP_STORED)}


def test_the_index_offers_one_zip_to_each_system(released):
    (blender,) = importlib.util.find_spec("bpy").submodule_search_locations
    (path,) = Path(blender).glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py")
    client = module(path)
    index, wheels = json.loads((released / "index.json").read_text()), SYSTEM.replace("-", "_")

    def offered(system, python=(3, 13, 0)):
        options = {"filter_blender_version": (5, 2, 0), "filter_platform": system, "filter_python_version": python}
        skip = lambda each: client.repository_filter_skip(each, **options, skip_message_fn=None, error_fn=print)  # noqa: E731
        return [each["archive_url"] for each in index["data"] if not skip(each)]

    for system in ("linux-arm64", "linux-x64", "macos-arm64", "macos-x64", "windows-arm64", "windows-x64"):
        kind = wheels if system == SYSTEM else "no_wheels"
        assert offered(system) == [f"./virtual_shutter-{VERSION}-{kind}.zip"]
    for python in ((3, 12, 0), (3, 14, 0)):
        assert offered(SYSTEM, python) == [f"./virtual_shutter-{VERSION}-no_wheels.zip"]


def test_the_index_is_the_same_wherever_and_whenever_it_is_made(released, project, monkeypatch, tmp_path):
    """File systems list the zips in orders of their own."""
    monkeypatch.syspath_prepend(ROOT / "scripts")
    release = module(ROOT / "scripts" / "release.py")
    blenders = release.build.extension

    def elsewhere(*arguments):
        blenders(*arguments)
        index, page = tmp_path / "index.json", tmp_path / "index.html"
        listed = json.loads(index.read_text())
        index.write_text(json.dumps(listed | {"data": listed["data"][::-1]}))
        head, first, second = re.split(r"(?m)^(?=  <tr>\n    <td>)", page.read_text())
        second, end = re.split(r"(?m)^(?=</table>)", second)
        page.write_text(head + second + first + re.sub(r"Built .*?<", "Built 1999-01-01, 10:00<", end))

    for path in released.glob("*.zip"):
        shutil.copy(path, tmp_path)
    monkeypatch.setattr(release.build, "extension", elsewhere)
    release.write_index(tmp_path, int(git(project, "log", "-1", "--format=%ct")))
    for name in ("index.json", "index.html"):
        assert (tmp_path / name).read_bytes() == (released / name).read_bytes()


def test_blender_installs_a_zip_in_its_normal_form(released, real_blender, tmp_path):
    (path,) = released.glob("*-no_wheels.zip")
    shutil.copy(path, tmp_path)
    extension = installed(real_blender, tmp_path / path.name, tmp_path / "user")
    with zipfile.ZipFile(path) as packed:
        assert all((extension / name).read_bytes() == packed.read(name) for name in packed.namelist())


def test_what_is_no_release_is_refused(copy, tmp_path):
    (tmp_path / "there").mkdir()
    refused(copy, f"{tmp_path / 'there'} is there already", "--output", tmp_path / "there")
    assert not list((tmp_path / "there").iterdir())
    refused(copy, f"this is version {VERSION}, not 9.9.9", "--version", "9.9.9")
    (copy / "new.py").touch()
    refused(copy, "there are changes that are not committed")
    shutil.rmtree(copy / "tests" / "saved")
    commit(copy)
    refused(copy, f"tests/saved/{VERSION} is missing: run scripts/save_version.py")
    (copy / "CHANGELOG.md").write_text(CHANGELOG.replace(f"## {VERSION}\n", "## 0.0.70\n"))
    commit(copy)
    refused(copy, f"CHANGELOG.md says nothing of version {VERSION}")


@pytest.mark.parametrize("passes", [True, False])
def test_the_tests_are_run_before(copy, monkeypatch, passes):
    monkeypatch.setenv("BLENDER", "blender")  # which these do not run
    (copy / "scripts" / "test").write_text(f"#!/bin/sh\ntest ! -e dist && exit {0 if passes else 1}\n")
    commit(copy)
    if not passes:
        refused(copy, "the tests fail")
        monkeypatch.delenv("BLENDER")
        refused(copy, "set BLENDER to the command that runs a Blender in which the zips are tested, or give --no-tests")
        return
    done = run(copy, "--system", SYSTEM)
    assert done.returncode == 0, done.stderr
    assert (copy / "dist" / VERSION / "SHA256SUMS").is_file()


@pytest.mark.parametrize(
    ("meanwhile", "sentence"),
    [
        ("touch shutter_addon/new.py", "there are changes that are not committed"),
        ("git commit --quiet --allow-empty --message More", "another commit was checked out while the tests ran"),
    ],
)
def test_what_is_released_is_what_was_tested(copy, monkeypatch, meanwhile, sentence):
    for name, value in (AUTHOR | {"BLENDER": "blender"}).items():
        monkeypatch.setenv(name, value)
    (copy / "scripts" / "test").write_text(f"#!/bin/sh\n{meanwhile}\n")
    commit(copy)
    refused(copy, sentence)


def test_a_release_is_whole_or_not_at_all(copy):
    (copy / "scripts" / "sbom.py").write_text("def write(*_):\n    raise OSError('the disk is full')\n")
    commit(copy)
    done = run(copy, *FAST)
    assert done.returncode == 1
    assert not list((copy / "dist").iterdir())
