"""What farm/slurm asks of Slurm, told by programs that only note how they are called."""

import os
import subprocess

import pytest
from farm_job import FARM

SBATCH = """
echo "$*" >>{folder}/submitted
number=$(wc -l <{folder}/submitted)
[ "$number" != "$REFUSED" ] || {{ echo "sbatch: error: QOSMaxSubmitJobPerUserLimit" >&2; exit 7; }}
echo "10$number$CLUSTER"
"""
PROGRAMS = {"sbatch": SBATCH, "scancel": 'echo "$*" >>{folder}/cancelled', "scontrol": "echo MaxArraySize = 1001"}


@pytest.fixture
def submit(tmp_path):
    """Submits an edit. The step of the number `refused` is refused; cluster: what Slurm calls the place of the jobs."""
    for name, text in PROGRAMS.items():
        path = tmp_path / name
        path.write_text(f"#!/bin/sh\n{text.format(folder=tmp_path)}\n")
        path.chmod(0o755)

    def run(*options, refused="", cluster=""):
        environment = os.environ | {"PATH": f"{tmp_path}:{os.environ['PATH']}", "REFUSED": refused, "CLUSTER": cluster}
        command = [FARM / "slurm", "shot 7.blend", "1:8", "4", "pictures", "film.mp4", *options]
        return subprocess.run(command, env=environment, cwd=tmp_path, capture_output=True, text=True)

    return run


def lines(path):
    return path.read_text().splitlines() if path.exists() else []


def test_steps_follow_each_other_and_bear_the_edits_name(submit, tmp_path):
    done = submit("--partition=render")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == "jobs: check 101, frames 102, join 103\n"
    found = lines(tmp_path / "submitted")
    assert len(found) == 3
    for number, (step, line) in enumerate(zip(("check", "frames", "join"), found, strict=True)):
        assert f"--job-name=shot 7-{step} " in line
        assert " --partition=render " in line
        assert (f" --dependency=afterok:{100 + number} " in line) == (number > 0)
    assert not lines(tmp_path / "cancelled")


@pytest.mark.parametrize(("refused", "cancelled"), [("1", []), ("2", ["101"]), ("3", ["101 102"])])
def test_a_refused_step_takes_those_before_it_away(submit, tmp_path, refused, cancelled):
    done = submit(refused=refused)
    assert (done.returncode, done.stdout) == (7, "")
    assert done.stderr == "sbatch: error: QOSMaxSubmitJobPerUserLimit\n"
    assert lines(tmp_path / "cancelled") == [f"--quiet {each}" for each in cancelled]


def test_a_clusters_name_is_no_part_of_a_jobs_number(submit, tmp_path):
    done = submit("--clusters=big", refused="3", cluster=";big")
    assert done.returncode == 7
    found = lines(tmp_path / "submitted")
    assert " --dependency=afterok:101 " in found[1]
    assert " --dependency=afterok:102 " in found[2]
    assert lines(tmp_path / "cancelled") == ["--quiet --clusters=big 101 102"]
