"""The workflows for GitHub's runners: their commands, with nothing downloaded or installed, for each of the systems."""

import os
import re
import runpy
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

yaml = pytest.importorskip("yaml", reason="NO WORKFLOWS: install PyYAML")
ROOT = Path(__file__).parents[1]
WORKFLOWS = {path.stem: yaml.safe_load(path.read_text()) for path in (ROOT / ".github" / "workflows").glob("*.yml")}
JOBS = {f"{name}-{job}": jobs for name, flow in WORKFLOWS.items() for job, jobs in flow["jobs"].items()}
SYSTEMS = JOBS["test-installed"]["strategy"]["matrix"]["include"]
# Linux's renders with the library, which takes its time.
LIBRARY = '[ "$SYSTEM" != linux-x64 ] || { shift 2; exec "$PYTHON_IS" -m shutter_addon "$@"; }'
STAND_INS = {
    "sudo": "true",
    "curl": 'touch "$4"',  # --fail --location --output FILE
    "hdiutil": 'mkdir -p "$3/Blender.app/Contents/MacOS"; cp "$BLENDER_IS" "$3/Blender.app/Contents/MacOS/Blender"',
    "unzip": 'mkdir -p "$4/blender"; cp "$BLENDER_IS" "$4/blender/blender.exe"',  # -q FILE -d FOLDER
    "tar": 'cp "$BLENDER_IS" "$7/blender"',  # --extract --file FILE --strip-components 1 --directory FOLDER
    "python": 'echo "python $*" >>"$TOLD"; [ "$1" = -m ] || exec "$PYTHON_IS" "$@"',
    "blender": f'echo "blender $*" >>"$TOLD"; if [ "$2" = shutter ]; then {LIBRARY}; else test -f "$7"; fi',
    "gh": 'echo "gh $*" >>"$TOLD"',
    "jq": "echo https://cdn.example.org/blender.tar.xz",
}


RUNNERS = ("GITHUB_ENV", "GITHUB_REF_NAME", "GITHUB_WORKSPACE", "RUNNER_TEMP")
# In place of scripts/build.py.
BUILD = """
import pathlib, sys
assert sys.argv[1] == "--system"
pathlib.Path("dist").mkdir()
pathlib.Path(f"dist/virtual_shutter-0.1.0-{sys.argv[2].replace('-', '_')}.zip").touch()
"""
# What a step writes for those after it.
GIVEN_ON = '\nset -a; . "$GITHUB_ENV"; set +a\n'


def commands(job):
    return "".join(step["run"] + GIVEN_ON for step in job["steps"] if "run" in step)


def run(lines, folder, environment):
    """Runs a job's commands as its shell does; what they told of Python and Blender."""
    programs, told = folder / "programs", folder / "told"
    programs.mkdir()
    for name, text in STAND_INS.items():
        (programs / name).write_text(f"#!/bin/sh\n{text}\n")
        (programs / name).chmod(0o755)
    (folder / "given").touch()
    own = {"PATH": f"{programs}:{os.environ['PATH']}", "TOLD": str(told), "PYTHON_IS": sys.executable}
    own |= {"GITHUB_ENV": str(folder / "given"), "GITHUB_WORKSPACE": str(folder)}
    environment = os.environ | {"BLENDER": ""} | environment | own | {"BLENDER_IS": str(programs / "blender")}
    shell = ["bash", "--noprofile", "--norc", "-e", "-o", "pipefail"]
    done = subprocess.run(shell, input=lines, env=environment, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return [shlex.split(line) for line in told.read_text().splitlines()]


@pytest.fixture
def checkout(tmp_path):
    """The project without what commands write; they leave nothing in this one."""
    folder = tmp_path / "checkout"
    folder.mkdir()
    for path in ROOT.iterdir():
        if path.name not in (".git", "build", "dist", "out", "scripts"):
            (folder / path.name).symlink_to(path)
    (folder / "scripts").mkdir()
    (folder / "scripts" / "build.py").write_text(BUILD)
    return folder


@pytest.mark.parametrize("system", SYSTEMS, ids=lambda system: system["system"])
def test_the_commands_of_a_system(checkout, system):
    environment = {name: system[name.lower()] for name in ("SYSTEM", "ARCHIVE", "PROGRAM")}
    told = run(commands(JOBS["test-installed"]), checkout, environment)
    install, render = (words for words in told if words[0] == "blender")
    assert install[1:4] == ["--command", "extension", "install-file"]
    assert install[-1] == f"dist/virtual_shutter-0.1.0-{system['system'].replace('-', '_')}.zip"
    assert render[1:4] == ["--command", "shutter", "render"]
    assert system["system"] != "linux-x64" or len(list((checkout / render[-1]).iterdir())) == 3
    assert [words[2] for words in told if words[:2] == ["python", "-m"]] == ["pip", *["pytest"] * 3]
    assert_blender_is_given(checkout)


def assert_blender_is_given(folder):
    """By a path from which tests run it wherever they do, and which has no Windows's backslashes in it."""
    path = (folder / "given").read_text().removeprefix("BLENDER=").rstrip("\n")
    assert path.startswith("/")
    assert os.access(path, os.X_OK)


def test_the_commands_of_the_daily_build(checkout):
    told = run(commands(JOBS["test-daily"]), checkout, JOBS["test-daily"]["env"])
    assert [words[2] for words in told] == ["pip", "pip", "pytest", "pytest"]
    assert_blender_is_given(checkout)


def test_windows_path_to_blender_is_one_for_a_posix_shell(tmp_path):
    (line,) = (line for line in lines_with("echo ") if "$PROGRAM" in line)
    environment = {"GITHUB_WORKSPACE": "D:\\a\\b", "PROGRAM": "blender.exe", "GITHUB_ENV": str(tmp_path / "given")}
    subprocess.run(["bash", "-c", line], env=environment, check=True)
    assert (tmp_path / "given").read_text() == "BLENDER=D:/a/b/blender.exe\n"


def test_the_commands_of_a_release(checkout, tmp_path):
    """It has a Blender, and the checkout is as clean as a release asks for."""
    script = checkout / "scripts" / "release"
    script.write_text('#!/bin/sh\necho "release $*" >>"$TOLD"; ls -A >"$RUNNER_TEMP/files"\n')
    script.chmod(0o755)
    (tmp_path / "temporary").mkdir()
    before, job = {path.name for path in checkout.iterdir()}, JOBS["release-release"]
    environment = {"GITHUB_REF_NAME": "v0.1.0", "RUNNER_TEMP": str(tmp_path / "temporary"), "ARCHIVE": "blender.tar.xz"}
    release, publish = run(commands(job), checkout, environment)
    assert release == ["release", "--version", "0.1.0", "--output", "dist/release"]
    assert publish[:4] == ["gh", "release", "create", "v0.1.0"]
    assert_blender_is_given(checkout)
    files = set((tmp_path / "temporary" / "files").read_text().split("\n")) - {"", "programs", "given", "told"}
    assert files == before


# Blender's own parser of an extension's commands.
EXTENSION = """
import argparse, sys, bpy
from bl_pkg import bl_extension_cli
parser = argparse.ArgumentParser()
bl_extension_cli.cli_extension_args_install_file(parser.add_subparsers())
assert parser.parse_args(sys.argv[1:]).file
"""


def test_what_blender_and_the_builder_are_given_is_understood(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "scripts")
    (line,) = lines_with('"$BLENDER" --command extension')
    subprocess.run([sys.executable, "-c", EXTENSION, *shlex.split(line)[3:]], check=True)
    known = runpy.run_path(str(ROOT / "scripts" / "build.py"))["SYSTEMS"]
    assert [system["system"] for system in SYSTEMS] == ["linux-x64", "macos-arm64", "windows-x64"] == sorted(known)


def lines_with(word):
    lines = [line.strip() for job in JOBS.values() for line in commands(job).splitlines()]
    return [line for line in lines if line.startswith(word)]


def test_the_tests_that_are_asked_for_are_there():
    for line in lines_with("python -m pytest"):
        words = shlex.split(line)[3:]
        assert all((ROOT / word).exists() for word in words if word.startswith("tests/")), line
    name = re.search(r"-k (\w+)", "\n".join(lines_with("python -m pytest")))[1]
    assert f"def {name}(" in (ROOT / "tests" / "test_package.py").read_text()


def test_actions_and_variables_are_known():
    for name, job in JOBS.items():
        uses = {step["uses"] for step in job["steps"] if "uses" in step}
        assert uses <= {"actions/checkout@v4", "actions/setup-python@v5", "actions/upload-artifact@v4"}, name
        text = commands(job)
        later = re.findall(r'echo "(\w+)=.*" >>"\$GITHUB_ENV"', text)
        given = {*WORKFLOWS[name.partition("-")[0]].get("env", {}), *job.get("env", {}), "url", *RUNNERS, *later}
        assert set(re.findall(r"\$\{?([A-Za-z_]\w*)", text)) <= given, name
        assert "${{" not in text
        assert job["timeout-minutes"] <= 360
    assert WORKFLOWS["release"]["permissions"] == {"contents": "write"}
    assert WORKFLOWS["test"]["permissions"] == {"contents": "read"}
