"""The workflows for GitHub Actions and GitLab CI: their commands, with nothing downloaded or installed."""

import os
import subprocess
import tarfile

import pytest
from farm_job import FARM

yaml = pytest.importorskip("yaml", reason="NO WORKFLOWS: install PyYAML")


def github():
    """Its commands in their order, and their environment."""
    workflow = yaml.safe_load((FARM / "github-workflow.yml").read_text())
    steps = workflow["jobs"]["film"]["steps"]
    return [line for step in steps for line in step.get("run", "").splitlines()], workflow["env"]


def gitlab():
    job = yaml.safe_load((FARM / "gitlab-ci.yml").read_text())["film"]
    return job["before_script"] + job["script"], job["variables"]


def program(path, text):
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)


def test_both_run_the_same_commands():
    lines, environment = github()
    assert ([line.removeprefix("sudo ") for line in lines], environment) == gitlab()


def test_the_commands_give_the_film_of_one_process(job, single, blender_program, tmp_path):
    lines, environment = gitlab()
    packed, programs = tmp_path / "blender.tar.xz", tmp_path / "programs"
    program(tmp_path / "blender", f'[ "$2" = extension ] || exec {blender_program} "$@"\ntest -f "$7"')
    with tarfile.open(packed, "w:xz") as archive:
        archive.add(tmp_path / "blender", "blender-5.2.3-linux-x64/blender")
    programs.mkdir()
    program(programs / "apt-get", "")
    program(programs / "curl", f'case "$5" in https://download.blender.org/*) cp {packed} "$4";; *) touch "$4";; esac')
    environment = os.environ | environment | {"PATH": f"{programs}:{os.environ['PATH']}"}
    done = subprocess.run(
        ["bash", "-e"], input="\n".join(lines), env=environment, cwd=job.folder, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    job.check(single)
