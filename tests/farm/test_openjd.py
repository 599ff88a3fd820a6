"""The job description in Open Job Description's format, run by its own command."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from farm_job import FARM, FRAMES


def test_the_job_gives_the_bits_of_one_process(blender_program, job, single):
    program = shutil.which("openjd", path=Path(sys.executable).parent) or shutil.which("openjd")
    if not program:
        pytest.skip("NO OPEN JOB DESCRIPTION: install openjd-cli")
    values = {
        "Edit": job.edit,
        "Frames": f"1-{FRAMES}",
        "ChunkSize": FRAMES // 2,
        "Output": job.pictures,
        "Movie": job.movie,
        "Blender": blender_program,
    }
    options = [option for name, value in values.items() for option in ("-p", f"{name}={value}")]
    command = [program, "run", FARM / "virtual_shutter.openjd.yaml", "--step", "Join", "--run-dependencies", *options]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    job.check(single)
