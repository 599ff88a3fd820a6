"""Footage for the media tests."""

from importlib.util import find_spec
from pathlib import Path

import av
import pytest
from footage import coloured_movies, deinterlaced_movies, ugly_movies


@pytest.fixture(scope="session")
def bunny():
    """Big Buck Bunny, 132 frames of 1280×720 (c) 2008 Blender Foundation, www.bigbuckbunny.org, CC BY 3.0."""
    return Path(__file__).parents[2] / "assets" / "bigbuckbunny.mp4"


@pytest.fixture(scope="session")
def movies(tmp_path_factory):
    """{name: (path, numbers)} of footage.ugly_movies."""
    return ugly_movies(tmp_path_factory.mktemp("movies"))


@pytest.fixture(scope="session")
def coloured(tmp_path_factory):
    """{name: path} of footage.coloured_movies."""
    return dict(coloured_movies(tmp_path_factory.mktemp("coloured")))


@pytest.fixture(scope="session")
def deinterlaced(tmp_path_factory):
    """{name: path} of footage.deinterlaced_movies."""
    return dict(deinterlaced_movies(tmp_path_factory.mktemp("deinterlaced")))


@pytest.fixture(scope="session")
def blender_config():
    """Blender's OpenColorIO configuration."""
    return next(Path(find_spec("bpy").origin).parent.glob("*/datafiles/colormanagement/config.ocio"))


class Read:
    """A movie that PyAV has opened. packets: the positions of its video packets, as they are read; seeks: how often it
    seeks."""

    def __init__(self, container):
        self.container, self.packets, self.seeks = container, [], 0

    def __getattr__(self, name):
        return getattr(self.container, name)

    def demux(self):
        for packet in self.container.demux():
            if packet.size and packet.stream.type == "video":
                self.packets.append(packet.pos)
            yield packet

    def seek(self, *given, **options):
        self.seeks += 1
        self.container.seek(*given, **options)


@pytest.fixture
def read_through(monkeypatch):
    """Checks that the one movie that was opened to be read was read from its start without a seek, and no further than
    a decoder has to see for so many frames; so none was decoded twice."""
    movies, opens = [], av.open

    def opened(path, *mode, **options):
        if mode:
            return opens(path, *mode, **options)
        movies.append(Read(opens(path)))
        return movies[-1]

    def check(frames):
        (movie,) = movies
        assert movie.seeks == 0
        assert len(set(movie.packets)) == len(movie.packets)
        ahead = 2 + 16 + 16  # the shown one and the next one, those out of order, and those of a decoder's threads
        assert frames <= len(movie.packets) <= frames + ahead

    monkeypatch.setattr(av, "open", opened)
    return check
