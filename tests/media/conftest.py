"""Footage for the media tests."""

from importlib.util import find_spec
from pathlib import Path

import pytest
from footage import ugly_movies


@pytest.fixture(scope="session")
def bunny():
    """Big Buck Bunny, 132 frames of 1280×720 (c) 2008 Blender Foundation, www.bigbuckbunny.org, CC BY 3.0."""
    return Path(__file__).parents[2] / "assets" / "bigbuckbunny.mp4"


@pytest.fixture(scope="session")
def movies(tmp_path_factory):
    """{name: (path, numbers)} of footage.ugly_movies."""
    return ugly_movies(tmp_path_factory.mktemp("movies"))


@pytest.fixture(scope="session")
def blender_config():
    """Blender's OpenColorIO configuration."""
    return next(Path(find_spec("bpy").origin).parent.glob("*/datafiles/colormanagement/config.ocio"))
