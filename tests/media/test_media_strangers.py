"""Folders of in-between frames that a stranger has prepared, or a disk has damaged.

What is in them is right or refused, nothing outside is touched, and nothing hangs."""

import json
import os
import random
import shutil
import signal
import socket
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from footage import picture, save_image
from test_media_inbetween import COUNT, FACTOR, blend, build, footage, kept, opened, pictures, state

from shutter_addon.media import MediaError, derived, inbetween_cache, open_source

if os.name != "posix":
    pytest.skip("pipes, sockets and devices by name, alarms: of POSIX systems only", allow_module_level=True)


@pytest.fixture(autouse=True)
def in_time():
    """A hang is a failure."""

    def late(*_):
        raise AssertionError("it hangs")

    handler = signal.signal(signal.SIGALRM, late)
    signal.alarm(60)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, handler)


@pytest.fixture
def source(tmp_path):
    with open_source(footage(tmp_path / "shot")) as source:
        yield source


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "virtual_shutter_inbetween"


@pytest.fixture
def place(source, folder):
    """The folder of what was built."""
    build(source, folder)
    return next(folder.iterdir())


@pytest.fixture
def outside(tmp_path):
    """Someone's own files, with names as ours have them."""
    outside = tmp_path / "outside"
    (outside / "checks").mkdir(parents=True)
    for name in ("00000001.png", "manifest.json", "checks/0123abcd.sha256", "checks/mine.sha256"):
        (outside / name).write_text("someone's own")
    return outside


def listed(folder):
    """{path: what is there} of all in a folder, links as such."""
    found = {}
    for path in sorted(folder.rglob("*")):
        name = str(path.relative_to(folder))
        if path.is_symlink():
            found[name] = os.readlink(path)
        else:
            found[name] = path.read_bytes() if path.is_file() else oct(path.stat().st_mode)
    return found


def purge(folder, source):
    """Bytes freed, and what was left: {name of a folder: count}. Size has to have said so before."""
    left, said = {}, inbetween_cache.size(folder, source)
    freed = inbetween_cache.purge(folder, source, left=lambda path, count: left.update({path.name: count}))
    assert said == freed
    return freed, left


def refusal(function, *arguments):
    """The sentence of a MediaError; None if there was none."""
    try:
        function(*arguments)
    except MediaError as error:
        return str(error)
    return None


def replace(path, new):
    """Puts a link, a FIFO, … in a file's place."""
    path.unlink()
    new(path)


def a_link_to(target):
    return lambda path: path.symlink_to(target)


def a_socket(path):
    """Bound by a relative path: absolute ones may be too long."""
    before = Path.cwd()
    os.chdir(path.parent)
    try:
        socket.socket(socket.AF_UNIX).bind(path.name)
    finally:
        os.chdir(before)


def sparse(path):
    with path.open("wb") as file:
        file.truncate(1 << 42)


# Removal


def test_nothing_is_left_of_a_build_however_it_ended(source, folder):
    build(source, folder, cancelled=lambda: bool(pictures(folder)))
    assert state(source, folder).done == 0
    place = next(folder.iterdir())
    part = place / f".part-{1:016x}"  # a process was killed
    part.mkdir()
    (part / "00000002.png").write_bytes(b"half")
    (place / "checks").mkdir()
    (place / "checks" / "0123abcd.sha256").write_bytes(b"0123abc")  # of the first version, when the disk was full
    freed, left = purge(folder, source)
    assert freed > 0
    assert left == {}
    assert not list(folder.iterdir())


@pytest.mark.parametrize("name", ["00000001.png", "manifest.json"])
def test_no_link_is_followed_when_frames_are_removed(source, folder, place, outside, name):
    before = listed(outside)
    (place / name).rename(folder / "away")
    (place / name).symlink_to(outside / name)
    freed, left = purge(folder, source)
    assert listed(outside) == before
    assert (place / name).is_symlink()
    if name == "manifest.json":
        assert (freed, left) == (0, {})
    else:
        assert freed > 0
        assert left == {place.name: len(list(place.iterdir()))}


def test_a_cache_that_is_a_link_is_another_s(source, folder, place, tmp_path):
    shutil.move(place, tmp_path / place.name)
    place.symlink_to(tmp_path / place.name)
    before = listed(tmp_path / place.name)
    assert state(source, folder) == ("missing", 0, COUNT - 1)
    assert not opened(source, folder).has(1)
    assert purge(folder, source) == (0, {})
    with pytest.raises(MediaError, match="it is a link, and none is followed"):
        build(source, folder)
    assert listed(tmp_path / place.name) == before


def test_a_folder_that_is_a_link_serves_but_nothing_is_removed_behind_it(source, folder, tmp_path):
    """To a larger disk, say; but whose frames lie there, who can know?"""
    (tmp_path / "disk").mkdir()
    folder.symlink_to(tmp_path / "disk")
    build(source, folder)
    assert state(source, folder).name == "ready"
    assert len(pictures(tmp_path / "disk")) == (COUNT - 1) * (FACTOR - 1)
    before = listed(tmp_path / "disk")
    assert inbetween_cache.size(folder, source) == 0
    with pytest.raises(MediaError, match=r"virtual_shutter_inbetween: cannot be removed \(it is a link"):
        inbetween_cache.purge(folder, source)
    assert listed(tmp_path / "disk") == before
    assert purge(tmp_path / "disk", source)[0] > 0


def test_others_files_stay(source, folder, place):
    """Beside ours, and in the place of ours."""
    built = {path.name for path in pictures(folder)}
    others = {"notes.txt", "123456789.exr", "00000001.jpg", ".00000001-0123abcd.part.png", "checks"}
    for name in others - {"checks"}:
        (place / name).write_text("someone's own")
    (place / "checks").mkdir()
    for name in ("film.sha256", "89ab.sha256"):
        (place / "checks" / name).write_text("0" * 64 + "  /home/me/film.mov\n")
    (place / f".part-{7:016x}").mkdir()
    (place / f".part-{7:016x}" / "film.png").write_text("someone's own")
    (place / f".part-{8:016x}").write_text("someone's own")
    (place / "00000003.png").unlink()
    (place / "00000003.png").mkdir()
    size = sum((place / name).stat().st_size for name in built - {"00000003.png"})
    left = {}
    freed = inbetween_cache.purge(folder, source, lambda path, count: left.update({path.name: count}))
    assert size < freed < size + 9999
    assert {path.name for path in place.iterdir()} == {
        *others,
        *("00000003.png", f".part-{7:016x}", f".part-{8:016x}"),
    }
    assert {path.name for path in (place / "checks").iterdir()} == {"film.sha256", "89ab.sha256"}
    assert (place / f".part-{7:016x}" / "film.png").exists()
    assert left == {place.name: 8}
    assert inbetween_cache.size(folder, source) == 0


def test_a_hard_link_goes_by_its_name_alone(source, folder, place, tmp_path):
    os.link(place / "00000001.png", tmp_path / "mine.png")
    content = (tmp_path / "mine.png").read_bytes()
    assert purge(folder, source)[1] == {}
    assert (tmp_path / "mine.png").read_bytes() == content


@pytest.mark.parametrize("key", ["maker", "version", "source", "settings", "more"])
def test_a_manifest_that_does_not_fit_its_folder_is_another_s(source, folder, place, key):
    manifest = json.loads((place / "manifest.json").read_text())
    (place / "manifest.json").write_text(json.dumps(manifest | {key: 0}))
    before = listed(folder)
    assert purge(folder, source) == (0, {})
    assert listed(folder) == before


def test_a_manifest_of_another_folder_is_another_s(source, folder, place):
    place.rename(folder / "mine")
    assert purge(folder, source) == (0, {})


# Writing


def test_nothing_is_built_behind_a_link(source, folder, place, outside):
    before = listed(outside)
    shutil.rmtree(place)
    place.symlink_to(outside)
    with pytest.raises(MediaError, match="it is a link, and none is followed") as raised:
        build(source, folder)
    assert str(raised.value).startswith(str(place))
    assert listed(outside) == before


def test_nothing_is_written_through_links_in_the_place_of_files(source, folder, place, outside):
    whole_folder, before = kept(folder), listed(outside)
    for number, path in enumerate([*pictures(folder), place / "manifest.json"]):
        path.unlink()
        path.symlink_to(outside / ("00000001.png" if number % 2 else f"new{number}"))
    build(source, folder)
    assert listed(outside) == before
    assert kept(folder) == whole_folder
    assert not any(path.is_symlink() for path in place.rglob("*"))


def test_nothing_is_noted_through_links(source, folder, place, outside):
    before = listed(outside)
    (place / "00000001.same").symlink_to(outside / "00000001.png")
    inbetween_cache.InbetweenCache(source, folder, FACTOR, "quick").note(1, "same")
    assert listed(outside) == before
    assert not (place / "00000001.same").is_symlink()


# What is read


KINDS = {
    "folder": Path.mkdir,
    "fifo": os.mkfifo,
    "socket": a_socket,
    "device": a_link_to("/dev/zero"),
    "loop": lambda path: path.symlink_to(path.name),
    "sparse": sparse,
    "nested": lambda path: path.write_text("[" * 60_000),
    "deep": lambda path: path.write_text('{"maker": ' + "[" * 9000 + "]" * 9000 + "}"),
    "number": lambda path: path.write_text("1" * 5000),
    "list": lambda path: path.write_text("[]"),
    "null": lambda path: path.write_text("null"),
    "bytes": lambda path: path.write_bytes(bytes(range(256)) * 9),
    "lines": lambda path: path.write_text("\n" * 9999),
    "empty": lambda path: path.write_text(""),
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", ["manifest.json", "00000001.png", ""])
def test_whatever_lies_there_is_ignored_or_refused(source, folder, place, kind, name):
    """And what is built is right afterwards, or there is one sentence."""
    expected, path = kept(folder), place / name
    if path.is_dir():
        shutil.rmtree(path)
    path.unlink(missing_ok=True)
    KINDS[kind](path)
    used(source, folder)
    if refused := refusal(build, source, folder):
        assert "cannot be written there" in refused
        assert kind == "folder" or name == ""
    else:
        assert expected.items() <= kept(folder).items()
        used(source, folder)
    inbetween_cache.size(folder, source)
    assert "cannot be removed" in (refusal(inbetween_cache.purge, folder, source) or "cannot be removed")


def used(source, folder):
    """Asks for all that there is; pictures are right, or refused."""
    assert state(source, folder).done <= COUNT - 1
    assert inbetween_cache.size(folder, source) >= 0
    assert inbetween_cache.stamp(folder, FACTOR, "quick", source.path.stem) is not None
    with opened(source, folder) as between:
        for index in range(between.count):
            with suppress(MediaError):
                assert np.array_equal(between.read(index), right(source, index)), index


def right(source, index):
    pair, step = divmod(index, FACTOR)
    if step == 0:
        return source.read(pair)
    return list(blend(source.read(pair), source.read(pair + 1), FACTOR))[step - 1]


def test_a_folder_that_is_a_file_or_a_pipe(source, folder):
    for make in (os.mkfifo, a_socket, Path.touch, a_link_to("/dev/zero"), a_link_to("nowhere")):
        make(folder)
        used(source, folder)
        with pytest.raises(MediaError, match="in-between frames cannot be written there"):
            build(source, folder)
        if not folder.is_symlink():
            assert purge(folder, source) == (0, {})
        folder.unlink()


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
@pytest.mark.parametrize("name", ["manifest.json", "00000001.png", ""])
def test_another_user_s_files_are_ignored_and_stay_findable(source, folder, place, name):
    before = listed(folder)
    (path,) = place.glob(name) if name else [place]
    mode = path.stat().st_mode
    path.chmod(0)
    used(source, folder)
    for refused in (refusal(build, source, folder), refusal(inbetween_cache.purge, folder, source)):
        assert refused is None or "Permission denied" in refused
    path.exists() and path.chmod(mode)
    assert name in ("manifest.json", "00000001.png") or listed(folder).keys() >= before.keys()


def test_names_of_frames_that_the_source_has_not_say_nothing(source, folder, place):
    for pair in (COUNT - 1, COUNT, 99_999_999):
        (place / f"{pair:08d}.cut").touch()
    for frame in (0, FACTOR, (COUNT - 1) * FACTOR + 1, 99_999_999):
        (place / f"{frame:08d}.png").touch()
    assert state(source, folder) == ("ready", COUNT - 1, COUNT - 1)
    (place / "00000001.png").unlink()
    assert state(source, folder) == ("partial", COUNT - 2, COUNT - 1)


def bomb(path):
    """A tiny file that says it holds many more pixels than the picture has."""
    save_image(path, np.zeros((64, 9999, 3), np.float16), "half", at=(-5000, 0), display=(0, 0, 128, 64))


@pytest.mark.parametrize(
    ("samples", "suffix", "write"),
    [
        ("uint8", ".png", lambda path: save_image(path, picture(3, 64, 64))),
        ("uint8", ".png", lambda path: save_image(path, picture(3, 128, 65))),
        ("uint8", ".png", lambda path: save_image(path, picture(3) / np.float32(255), "uint16")),
        ("uint8", ".png", lambda path: save_image(path, np.dstack([picture(3), picture(3)[..., 0]]))),
        ("uint8", ".png", lambda path: save_image(path, picture(3)[..., :1])),
        ("uint8", ".png", lambda path: path.write_text("no picture")),
        ("half", ".exr", lambda path: save_image(path, picture(3) / np.float32(255), "float")),
        ("half", ".exr", lambda path: save_image(path, picture(3) / np.float32(255), "half", names=tuple("XYZ"))),
        ("half", ".exr", lambda path: save_image(path, picture(3) / np.float32(255), "half", at=(1, 0))),
        ("half", ".exr", bomb),
    ],
)
def test_a_picture_of_another_kind_is_never_shown(tmp_path, folder, samples, suffix, write):
    """And it is built again."""
    with open_source(footage(tmp_path / "shot", 3, samples=samples, suffix=suffix)) as source:
        build(source, folder)
        expected = kept(folder)
        path = pictures(folder)[1]
        write(path)
        with opened(source, folder) as between:
            with pytest.raises(MediaError, match=f"{path.name}: this in-between frame is damaged or gone"):
                between.read(int(path.stem))
            assert build(source, folder).name == "ready"
            assert np.array_equal(between.read(int(path.stem)), right(source, int(path.stem)))
        assert kept(folder) == expected


def test_a_picture_that_cannot_be_decoded_is_one_sentence(source, folder, place):
    path = pictures(folder)[1]
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2] + bytes(len(data) - len(data) // 2 - 12) + data[-12:])
    with opened(source, folder) as between, pytest.raises(MediaError, match="cannot be decoded; remove in-between"):
        between.read(int(path.stem))
    assert purge(folder, source)[1] == {}


def test_a_source_that_became_a_pipe_is_one_sentence(source, folder):
    replace(source.files[2], os.mkfifo)
    for ask in (state, build, opened):
        with pytest.raises(MediaError, match=r"f002\.png: is no file"):
            ask(source, folder)


def test_what_is_known_of_folders_is_forgotten(source, tmp_path, monkeypatch):
    looked, listing = [], inbetween_cache.Folder.files
    monkeypatch.setattr(inbetween_cache.Folder, "files", lambda cache: looked.append(cache.path) or listing(cache))
    monkeypatch.setattr(inbetween_cache, "_RECENT", 0)  # as if the folder were some seconds old

    def looks(ask, *given):
        looked.clear()
        ask(*given)
        return len(looked)

    build(source, tmp_path / "cache")
    for ask in ((state, source, tmp_path / "cache"), (inbetween_cache.size, tmp_path / "cache", source)):
        inbetween_cache.forget()
        assert [looks(*ask) for _ in range(2)] == [1, 0]
    inbetween_cache.forget()
    assert derived.content_hash.cache_info().currsize == 0


# All at once

CHANGES = {
    "flip": lambda path, rng: flip(path, rng),
    "cut": lambda path, rng: path.write_bytes(path.read_bytes()[: rng.randrange(path.stat().st_size + 1)]),
    "twice": lambda path, rng: path.write_bytes(path.read_bytes() * 2),
    "remove": lambda path, rng: path.unlink(),
    "fifo": lambda path, rng: replace(path, os.mkfifo),
    "folder": lambda path, rng: replace(path, Path.mkdir),
    "link": lambda path, rng: replace(path, a_link_to(path.parents[3] / "outside" / "00000001.png")),
}


def flip(path, rng):
    data = bytearray(path.read_bytes())
    for _ in range(rng.randrange(1, 9)):
        data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    path.write_bytes(data)


def test_damage_of_any_kind_is_right_or_refused(tmp_path, folder, outside):
    with open_source(footage(tmp_path / "shot", 4)) as source:
        build(source, tmp_path / "whole")
        before = listed(outside)
        for seed in range(60):
            rng = random.Random(seed)
            shutil.rmtree(folder, ignore_errors=True)
            shutil.copytree(tmp_path / "whole", folder)
            for _ in range(rng.randrange(1, 5)):
                files = sorted(path for path in folder.rglob("*") if path.is_file() and path.stat().st_size)
                path = rng.choice([*files, *folder.glob("*/manifest.json")])
                if path.is_file() and not path.is_symlink():
                    CHANGES[rng.choice(sorted(CHANGES))](path, rng)
            check(source, folder, seed)
            assert listed(outside) == before, seed


def check(source, folder, seed):
    """Pictures are right or refused, now and after a build; and nothing but sentences comes."""
    frames = [right(source, index) for index in range((source.count - 1) * FACTOR + 1)]
    for _ in range(2):
        state(source, folder)
        inbetween_cache.size(folder, source)
        with opened(source, folder) as between:
            for index, frame in enumerate(frames):
                with suppress(MediaError):
                    assert np.array_equal(between.read(index), frame), (seed, index)
        refused = refusal(build, source, folder)
        assert "cannot be written there" in refused if refused else state(source, folder).name == "ready", seed
    assert "cannot be removed" in (refusal(inbetween_cache.purge, folder, source) or "cannot be removed"), seed


def test_what_another_version_has_built_is_left_alone(source, folder, monkeypatch):
    """A newer one, whose frames or folder may be others: it is not shown, and ours are built beside."""
    monkeypatch.setattr(inbetween_cache, "VERSION", inbetween_cache.VERSION + 1)
    build(source, folder)
    newer = listed(folder)
    monkeypatch.undo()
    assert state(source, folder).name == "stale"
    build(source, folder)
    assert state(source, folder).name == "ready"
    assert newer.items() <= listed(folder).items()
