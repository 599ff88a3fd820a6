"""The file that says which version of an edit a job's pictures are of."""

from dataclasses import replace

import pytest

from shutter_addon.core.farm import job_file
from shutter_addon.core.farm.job_file import EditVersion

VERSION = EditVersion("0.1.0", "5.2.0", "", "ab" * 32, "cd" * 32)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"extension": "0.2.0"}, "the extension (0.1.0, here 0.2.0)"),
        ({"blender": "5.2.1"}, "Blender (5.2.0, here 5.2.1)"),
        ({"colours": "12" * 32}, f"the OpenColorIO configuration (, here {'12' * 8})"),
        ({"blend": "00" * 32}, "the .blend file ("),
        ({"footage": "00" * 32}, "the footage ("),
    ],
)
def test_another_version_is_refused_and_what_differs_is_named(tmp_path, change, told):
    job_file.guard(tmp_path, VERSION)  # there is none yet
    job_file.write(tmp_path, VERSION)
    job_file.guard(tmp_path, VERSION)
    other = replace(VERSION, **change)
    assert other.key != VERSION.key
    with pytest.raises(job_file.JobError) as error:
        job_file.guard(tmp_path, other)
    assert str(error.value).startswith(f"{tmp_path / job_file.NAME}: the job is of another version of {told}")


@pytest.mark.parametrize("content", ["", "{", "[]", "null", '{"version": 1}', '{"version": 1, "edit": 3}'])
def test_a_damaged_file_is_told(tmp_path, content):
    (tmp_path / job_file.NAME).write_text(content)
    with pytest.raises(job_file.JobError, match="is damaged"):
        job_file.guard(tmp_path, VERSION)


def test_a_pictures_note_is_read_back():
    assert job_file.key_in(job_file.note(VERSION.key)) == VERSION.key
    for text in ("", "mine", "virtual_shutter edit ", f"virtual_shutter edit {VERSION.key}0"):
        assert job_file.key_in(text) is None
