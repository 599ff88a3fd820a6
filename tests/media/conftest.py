"""Footage for the media tests."""

from importlib.util import find_spec
from pathlib import Path

import pytest
from footage import coloured_movies, deinterlaced_movies, ugly_movies


@pytest.fixture(scope="session")
def movies(tmp_path_factory):
    return ugly_movies(tmp_path_factory.mktemp("movies"))


@pytest.fixture(scope="session")
def coloured(tmp_path_factory):
    return dict(coloured_movies(tmp_path_factory.mktemp("coloured")))


@pytest.fixture(scope="session")
def deinterlaced(tmp_path_factory):
    return dict(deinterlaced_movies(tmp_path_factory.mktemp("deinterlaced")))


@pytest.fixture(scope="session")
def blender_config():
    return next(Path(find_spec("bpy").origin).parent.glob("*/datafiles/colormanagement/config.ocio"))
