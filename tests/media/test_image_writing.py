"""Float EXR files: whole or not at all, by several at once."""

import numpy as np
import pytest

from shutter_addon.media import MediaError
from shutter_addon.media.image_writing import write_exr

VALUES = np.random.default_rng(1).random((40, 60, 2), np.float32)


@pytest.mark.parametrize("planted", [".0001.part.exr", "0001.exr"])
def test_nothing_is_written_through_a_link(tmp_path, planted):
    (tmp_path / "others").write_text("others'")
    (tmp_path / planted).symlink_to("others")
    write_exr(tmp_path / "0001.exr", VALUES, ["S1", "S2"])
    assert (tmp_path / "others").read_text() == "others'"
    assert not (tmp_path / "0001.exr").is_symlink()


@pytest.mark.parametrize("place", ["none/0001.exr", "file/0001.exr", "folder.exr"])
def test_what_cannot_be_written_is_one_sentence(tmp_path, place):
    (tmp_path / "file").write_text("in the way")
    (tmp_path / "folder.exr").mkdir()
    with pytest.raises(MediaError, match="cannot be written") as raised:
        write_exr(tmp_path / place, VALUES, ["S1", "S2"])
    assert str(raised.value).startswith(str(tmp_path / place))
    assert {path.name for path in tmp_path.iterdir()} == {"file", "folder.exr"}
