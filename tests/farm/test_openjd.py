"""The job description in Open Job Description's format, checked and run by its own command."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from farm_job import FARM, FRAMES

TEMPLATE = FARM / "virtual_shutter.openjd.yaml"


@pytest.fixture(scope="module")
def openjd():
    """Runs openjd-cli."""
    program = shutil.which("openjd", path=Path(sys.executable).parent) or shutil.which("openjd")
    if not program:
        pytest.skip("NO OPEN JOB DESCRIPTION: install openjd-cli")

    def run(command, *arguments, **options):
        call = [program, command, TEMPLATE, *map(str, arguments)]
        return subprocess.run(call, capture_output=True, text=True, timeout=300, **options)

    return run


def test_the_template_is_valid(openjd):
    done = openjd("check")
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture
def run_job(openjd, blender_program, job):
    def run():
        values = {
            "Edit": job.edit,
            "Frames": f"1-{FRAMES}",
            "ChunkSize": FRAMES // 2,
            "Output": job.pictures,
            "Movie": job.movie,
            "Blender": blender_program,
        }
        options = [option for name, value in values.items() for option in ("-p", f"{name}={value}")]
        return openjd("run", "--step", "Join", "--run-dependencies", *options)

    return run


def test_the_job_gives_the_bits_of_one_process(run_job, job, single):
    done = run_job()
    assert done.returncode == 0, done.stdout + done.stderr
    job.check(single)
