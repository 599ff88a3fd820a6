"""Vectors that are kept as files: moments have the same bits with them and without, whatever became of the files."""

import os
from unittest import mock

import numpy as np
import pytest
from test_media_flow import pan
from test_media_smooth import Panned

from shutter_addon.core.frames.frame_source import as_rgba
from shutter_addon.features.smooth.smooth import SmoothSource
from shutter_addon.media import MediaError, derived, flow
from shutter_addon.media.derived import StoredVectors


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "vectors"


def read(folder=None, writes=True, **kind):
    """All moments of a film, as a program that begins anew reads them."""
    source = SmoothSource(Panned(3, **kind), 2, folder and StoredVectors(folder, writes))
    return np.stack([as_rgba(source.decoded(index)) for index in range(source.count)])


def files(folder):
    return sorted(path for path in folder.rglob("*") if path.is_file())


@pytest.mark.parametrize("kind", [{}, {"cut": 2}, {"dtype": np.uint16}, {"dtype": np.float16}])
def test_stored_or_not_gives_the_same_bits(folder, monkeypatch, kind):
    wanted = read(**kind)
    np.testing.assert_array_equal(read(folder, **kind), wanted)
    assert len(files(folder)) == 2
    before = [path.stat().st_mtime_ns for path in files(folder)]
    monkeypatch.setattr(flow, "found", None)
    np.testing.assert_array_equal(read(folder, **kind), wanted)
    assert [path.stat().st_mtime_ns for path in files(folder)] == before


def test_who_does_not_write_reads(folder, monkeypatch):
    wanted = read()
    np.testing.assert_array_equal(read(folder, writes=False), wanted)
    assert not folder.exists()
    read(folder)
    monkeypatch.setattr(flow, "found", None)
    np.testing.assert_array_equal(read(folder, writes=False), wanted)


def test_a_damaged_file_is_made_again(folder):
    wanted = read(folder)
    first = files(folder)[0]
    whole = first.read_bytes()
    flipped = bytearray(whole)
    flipped[len(whole) // 2] ^= 0xFF
    for damaged in (whole[:-100], bytes(flipped), np.full((24, 40, 6), np.inf), np.zeros((24, 41, 6))):
        if isinstance(damaged, bytes):
            first.write_bytes(damaged)
        else:
            derived.write_exr(first, damaged.astype(np.float16), derived._CHANNELS)  # with others it is none of ours
        np.testing.assert_array_equal(read(folder), wanted)
        assert first.read_bytes() == whole


@pytest.mark.skipif(os.name != "posix", reason="links need rights elsewhere")
def test_a_link_or_a_file_in_place_of_the_folder_stays(folder, tmp_path):
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    folder.symlink_to(elsewhere)
    wanted = read()
    np.testing.assert_array_equal(read(folder), wanted)
    assert not files(elsewhere)
    folder.unlink()
    folder.write_text("theirs")
    np.testing.assert_array_equal(read(folder), wanted)
    assert folder.read_text() == "theirs"


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), MediaError("could not be written whole")])
def test_where_nothing_can_be_written_nothing_is_kept(folder, monkeypatch, error):
    """It is tried once."""
    full = mock.Mock(side_effect=error)
    monkeypatch.setattr(derived, "write_exr", full)
    np.testing.assert_array_equal(read(folder), read())
    assert full.call_count == 1


def test_what_changes_is_found_anew(folder, monkeypatch):
    """Another frame, the same ones the other way round, and another way to find them."""
    pictures = [flow.luma(pan(x), "srgb", "opaque") for x in (0, 4, 8)]
    vectors = StoredVectors(folder, writes=True)
    for first, second in ((0, 1), (1, 0), (0, 2)):
        found = vectors.found(pictures[first], pictures[second])
        np.testing.assert_array_equal(found, flow.found(pictures[first], pictures[second]))
    assert len(files(folder)) == 3
    monkeypatch.setattr(flow, "VERSION", flow.VERSION + 1)
    vectors.found(pictures[0], pictures[1])
    assert len(files(folder)) == 4
