"""An edit, rendered by one process: what every farm has to make of it, to the bit."""

import shutil
import sys

import pytest
from farm_job import Job, saved_job, shutter


@pytest.fixture(scope="session")
def single(bunny, tmp_path_factory):
    """The edit, rendered by one process and joined."""
    job = saved_job(tmp_path_factory.mktemp("single"), bunny)
    shutter("render", job.edit, "--output", job.pictures)
    shutter("join", job.pictures, "--edit", job.edit, "--output", job.movie)
    return job


@pytest.fixture
def job(single, tmp_path):
    """The edit and its footage alone."""
    job = Job(tmp_path / "job")
    job.folder.mkdir()
    for path in (single.edit, single.folder / "footage.mp4"):
        shutil.copy(path, job.folder)
    return job


@pytest.fixture(scope="session")
def blender_program(tmp_path_factory):
    """A program that does `blender -c shutter …` by the library. What another has claimed and left, it soon takes."""
    path = tmp_path_factory.mktemp("bin") / "blender"
    code = "import sys; from shutter_addon.core.farm import claims; claims.PATIENCE = 10"
    code += "; from shutter_addon.__main__ import main; sys.exit(main())"
    path.write_text(f'#!/bin/sh\nshift 2\nexec {sys.executable} -c "{code}" "$@"\n')
    path.chmod(0o755)
    return path
