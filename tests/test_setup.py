"""Which Python the set-up takes, on machines that are made up, and what it says where none is to be had."""

import hashlib
import importlib.util
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

SCRIPTS = Path(__file__).parents[1] / "scripts"
SPEC = importlib.util.spec_from_file_location("fetch_uv", SCRIPTS / "fetch_uv.py")
fetch_uv = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(fetch_uv)

# A Python of another version, with or without ensurepip: this one, with another face.
OTHER = """#!/bin/sh
exec {python} -c '
import runpy, sys
sys.version_info = {version}
if not {ensurepip}: sys.modules["ensurepip"] = None
sys.argv = sys.argv[1:]
if sys.argv[0] == "-c": exec(sys.argv[1])
else: runpy.run_path(sys.argv[0], run_name="__main__")
' "$@"
"""
# In place of what needs the network: a uv that installs a Python, or fails.
UV = """#!/bin/sh
[ "$2" = install ] || exit 1
mkdir -p .python/cpython-3.13.9-linux/bin && cp "{brings}" .python/cpython-3.13.9-linux/bin/python3.13
"""


class Machine:
    """A folder with a copy of the set-up, a home and a PATH with little in it."""

    def __init__(self, folder):
        self.folder, self.path, self.home = folder, folder / "bin", folder / "home"
        for made in (self.path, self.home, folder / "scripts"):
            made.mkdir()
        for name in ("dirname", "mkdir", "cp"):
            (self.path / name).symlink_to(shutil.which(name))
        shutil.copy(SCRIPTS / "setup", folder / "scripts")
        self.fetch_uv("raise SystemExit('PyPI is not reached')")

    def script(self, path, text, **given):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text.format(**given))
        path.chmod(0o755)
        return path

    def python(self, name, version, ensurepip=True, folder=None):
        given = {"python": sys.executable, "version": version, "ensurepip": ensurepip}
        return self.script((folder or self.path) / name, OTHER, **given)

    def uv(self, path, brings):
        return self.script(path, UV, brings=brings)

    def fetch_uv(self, code):
        (self.folder / "scripts" / "fetch_uv.py").write_text(code)

    def find(self, **environment):
        command = [shutil.which("bash"), "-c", "source scripts/setup; find_python"]
        environment = {"PATH": str(self.path), "HOME": str(self.home)} | environment
        done = subprocess.run(command, cwd=self.folder, env=environment, capture_output=True, text=True, check=False)
        assert bool(done.stdout) == (done.returncode == 0), done.stderr
        return Path(done.stdout.strip()) if done.stdout else None, done.stderr


@pytest.fixture
def machine(tmp_path):
    return Machine(tmp_path)


def test_the_one_that_is_named_goes_before_that_of_the_path(machine):
    machine.python("python3.13", (3, 13))
    named = machine.python("mine", (3, 13), folder=machine.folder)
    assert machine.find(PYTHON=str(named)) == (named, "")


def test_one_that_makes_no_virtual_environment_is_passed_over(machine):
    machine.python("python3.13", (3, 13), ensurepip=False)
    pyenvs = machine.python("python", (3, 13), folder=machine.home / ".pyenv" / "versions" / "3.13.1" / "bin")
    assert machine.find() == (pyenvs, "")


def test_uv_brings_one(machine):
    machine.uv(machine.path / "uv", machine.python("brought", (3, 13), folder=machine.folder))
    assert machine.find()[0] == machine.folder / ".python" / "cpython-3.13.9-linux" / "bin" / "python3.13"


@pytest.mark.parametrize("older", ["python3", "python3.12", "python"])
def test_an_older_one_brings_a_private_one(machine, older):
    machine.python(older, (3, 8), ensurepip=False)
    uv = machine.uv(machine.folder / "private-uv", machine.python("brought", (3, 13), folder=machine.folder))
    machine.fetch_uv(f"import sys\nassert sys.argv[1] == '.python'\nprint({str(uv)!r})")
    private = machine.folder / ".python" / "cpython-3.13.9-linux" / "bin" / "python3.13"
    assert machine.find() == (private, "setup: bringing a private Python 3.13 into .python\n")
    uv.unlink()
    assert machine.find() == (private, "")


def test_without_a_python_it_is_one_sentence(machine):
    machine.python("python3", (3, 7))
    machine.python("python", (2, 7))
    python, said = machine.find()
    assert python is None
    assert said.startswith("setup: Python 3.13 is needed (the bpy wheel is built for it), and there is no Python 3.8")
    assert said.count("\n") == 1


def test_without_uv_it_says_why(machine):
    machine.python("python3", (3, 12))
    assert machine.find() == (None, "setup: bringing a private Python 3.13 into .python\nPyPI is not reached\n")


def wheel(folder):
    path, info = folder / f"uv-{fetch_uv.VERSION}-py3-none-any.whl", f"uv-{fetch_uv.VERSION}.dist-info"
    with zipfile.ZipFile(path, "w") as packed:
        packed.writestr(f"uv-{fetch_uv.VERSION}.data/scripts/uv", "#!/bin/sh\necho uv\n")
        packed.writestr(f"{info}/METADATA", f"Metadata-Version: 2.1\nName: uv\nVersion: {fetch_uv.VERSION}\n")
        packed.writestr(f"{info}/WHEEL", "Wheel-Version: 1.0\nRoot-Is-Purelib: false\nTag: py3-none-any\n")
        packed.writestr(f"{info}/RECORD", "")
    return path


def test_uv_is_unpacked(tmp_path):
    data = fetch_uv.by_python(wheel(tmp_path).as_uri())
    target = tmp_path / "new" / "uv"
    fetch_uv.unpack(data, hashlib.sha256(data).hexdigest(), target)
    assert subprocess.run([target], capture_output=True, text=True, check=True).stdout == "uv\n"
    assert list(target.parent.iterdir()) == [target]


def test_another_file_than_the_expected_one_is_refused(tmp_path):
    """Pip takes the wheel from a folder here, and its SHA-256 is not the pinned one."""
    wheel(tmp_path)
    environment = os.environ | {"PIP_CONFIG_FILE": os.devnull, "PIP_NO_INDEX": "1", "PIP_FIND_LINKS": str(tmp_path)}
    command = [sys.executable, SCRIPTS / "fetch_uv.py", tmp_path / "python"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr.startswith("setup: no uv to bring Python 3.13: what was downloaded is not the file")
    assert done.stderr.count("\n") == 1
    assert not (tmp_path / "python").exists()


def test_what_cannot_be_had_is_said(tmp_path):
    with pytest.raises(fetch_uv.UvError, match="it is not known for Plan9 on x86_64"):
        fetch_uv.wheel_for("Plan9", "x86_64")
    with pytest.raises(fetch_uv.UvError, match="PyPI is not reached"):
        fetch_uv.by_python((tmp_path / "none.whl").as_uri())
