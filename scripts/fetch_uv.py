"""Brings a private uv from PyPI, which can bring a Python 3.13: python3 scripts/fetch_uv.py FOLDER

Prints where uv lies in FOLDER. Any Python from 3.8 on will do, with nothing else installed: pip downloads if it is
there, for it knows a machine's proxies and mirrors; otherwise Python itself does. Whatever cannot be done is one
sentence on stderr and exit code 1.
"""

import hashlib
import io
import os
import platform
import subprocess
import sys
import tempfile
import urllib.request
import zipfile
from pathlib import Path

VERSION = "0.13.9"
PYPI = "https://files.pythonhosted.org/packages"
# By system and processor, those that have Blender as a library: where the wheel lies on PyPI, and its SHA-256.
WHEELS = {
    ("Linux", "x86_64"): (
        f"{PYPI}/3d/aa/26d64642d808de4a652579ef950d7cd2d37f080a8babf9c67c6b75fc4c3f/"
        f"uv-{VERSION}-py3-none-manylinux_2_17_x86_64.manylinux2014_x86_64.whl",
        "d7f459fe4fd247d830351c75686d3996ace3c6f3f728eb0e85a30b7ada0cef19",
    ),
    ("Darwin", "arm64"): (
        f"{PYPI}/f3/a7/a8d7b074798c7fb3b26b37584b8fe2e29df2ccdc24ce7902caab2a53edbf/"
        f"uv-{VERSION}-py3-none-macosx_11_0_arm64.whl",
        "66c512266d633bef48384a1f53003f41f2a8e7b36fe6e7fbfd3e0fd52d96fa63",
    ),
}


class UvError(Exception):
    """uv cannot be had; the message says why."""


def wheel_for(system, machine):
    """The address and SHA-256 of a system's wheel. UvError where none is known."""
    try:
        return WHEELS[system, machine]
    except KeyError:
        raise UvError(f"it is not known for {system} on {machine}") from None


def by_pip():
    """The wheel, as bytes, by this Python's pip; None where pip is missing or does not get it."""
    pip = [sys.executable, "-W", "ignore", "-m", "pip", "download"]
    options = ["--no-deps", "--only-binary=:all:", "--retries=1"]
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([*pip, *options, "--dest", folder, f"uv=={VERSION}"], capture_output=True, check=False)
        return next((path.read_bytes() for path in Path(folder).glob("*.whl")), None)


def by_python(address):
    """The wheel, as bytes, by Python's own library. UvError where the address is not reached."""
    try:
        with urllib.request.urlopen(address, timeout=60) as answer:
            return answer.read()
    except OSError as error:
        raise UvError(f"PyPI is not reached ({error})") from None


def unpack(wheel, sha256, target):
    """Writes the wheel's uv to the path target, whole or not at all. UvError where the wheel has another SHA-256."""
    if hashlib.sha256(wheel).hexdigest() != sha256:
        raise UvError("what was downloaded is not the file that this project expects (its SHA-256 differs)")
    target.parent.mkdir(parents=True, exist_ok=True)
    part = target.with_name(f"{target.name}.{os.getpid()}")
    with zipfile.ZipFile(io.BytesIO(wheel)) as packed:
        part.write_bytes(packed.read(f"uv-{VERSION}.data/scripts/uv"))
    part.chmod(0o755)
    part.replace(target)


def main(folder):
    target = Path(folder).resolve() / f"uv-{VERSION}"
    try:
        if not target.exists():
            address, sha256 = wheel_for(platform.system(), platform.machine())
            unpack(by_pip() or by_python(address), sha256, target)
    except (UvError, OSError) as error:
        sys.exit(f"setup: no uv to bring Python 3.13: {error}; install Python 3.13, or set PYTHON to one")
    print(target)


if __name__ == "__main__":
    main(sys.argv[1])
