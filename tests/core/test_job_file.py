"""The file that says which version of an edit a job's pictures are of."""

from dataclasses import replace

import pytest

from shutter_addon.core.farm import job_file
from shutter_addon.core.farm.job_file import EditVersion, Footage

FOOTAGE = Footage("film.mp4", 1, "cd" * 32), Footage("f0001.png", 9, "ef")
VERSION = EditVersion("ab" * 32, "0.1.0", "5.2.0", "", FOOTAGE)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"extension": "0.2.0"}, "the job is of version 0.1.0 of the extension, this machine has 0.2.0"),
        ({"blender": "5.2.1"}, "the job is of Blender 5.2.0, this machine has 5.2.1"),
        ({"colours": "12" * 32}, "is of the OpenColorIO configuration of Blender, this machine has the OpenColorIO"),
        ({"blend": "00" * 32}, "the job is of another version of the .blend file"),
        (
            {"footage": (VERSION.footage[0], Footage("f0001.png", 9, "12", "f0003.png"))},
            "f0003.png is missing",
        ),
        ({"footage": (Footage("film.mp4", 1, "11"), VERSION.footage[1])}, ": film.mp4 has other content"),
        ({"footage": VERSION.footage[:1]}, "is of other footage"),
    ],
)
def test_another_version_is_refused_and_what_differs_is_named(tmp_path, change, told):
    job_file.write(tmp_path, VERSION)
    assert job_file.read(tmp_path) == VERSION
    job_file.guard(tmp_path, VERSION)
    other = replace(VERSION, **change)
    assert other.key != VERSION.key
    with pytest.raises(job_file.JobError) as error:
        job_file.guard(tmp_path, other)
    assert str(error.value).startswith(f"{tmp_path / job_file.NAME}: the job is of ")
    assert told in str(error.value)


def test_copies_are_the_same_version():
    renamed = tuple(replace(one, name=f"copy of {one.name}") for one in VERSION.footage)
    assert replace(VERSION, footage=renamed).key == VERSION.key


def test_footage_in_another_order_is_another_version():
    assert replace(VERSION, footage=VERSION.footage[::-1]).key != VERSION.key


def test_a_folder_without_a_job_takes_all(tmp_path):
    job_file.guard(tmp_path, VERSION)
    assert job_file.read(tmp_path) is None


@pytest.mark.parametrize("content", ["", "{", "[]", "null", '{"version": 1}', '{"version": 1, "edit": 3}'])
def test_a_damaged_file_is_told(tmp_path, content):
    (tmp_path / job_file.NAME).write_text(content)
    with pytest.raises(job_file.JobError, match="is damaged"):
        job_file.read(tmp_path)


def test_a_pictures_note_is_read_back():
    assert job_file.key_in(job_file.note(VERSION.key)) == VERSION.key
    for text in ("", "mine", "virtual_shutter edit ", f"virtual_shutter edit {VERSION.key}0"):
        assert job_file.key_in(text) is None


def test_a_job_of_a_newer_version_is_told(tmp_path):
    (tmp_path / job_file.NAME).write_text('{"version": 2, "edit": {"glow": 1}, "glow": [1]}')
    with pytest.raises(job_file.JobError, match=r"is of a newer version of the extension$"):
        job_file.read(tmp_path)
