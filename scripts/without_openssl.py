"""Takes OpenSSL 1.1.1 out of OpenCV's wheel for Linux, whose licence does not go with the GPL.

The FFmpeg in that wheel asks for it by name, for encrypted network protocols that nobody uses here. A function that is
missing would keep the whole of OpenCV from being loaded, and one that is not there crash who opens an https address: so
what was OpenSSL's is asked of the C library's sched_yield, which takes nothing, changes nothing and gives 0. To FFmpeg
that is an OpenSSL that can make nothing (NULL), and it opens no such address.
"""

import base64
import hashlib
import io
import json
import tempfile
import zipfile
import zlib
from pathlib import Path

import lief

TAG = "1noopenssl"  # the wheel's build tag: it is no longer the one on PyPI
CHANGED = "2026-11-26"  # when what is done here was changed last
_STAND_IN = "sched_yield"


def take_out(wheel: Path, folder: Path) -> Path:
    """Writes a wheel without its OpenSSL 1.1.1 into a folder; the new wheel's path. The same wheel gives the same."""
    name, version, rest = wheel.name.split("-", 2)
    path = folder / f"{name}-{version}-{TAG}-{rest}"
    with zipfile.ZipFile(wheel) as old, zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as new:
        gone = [member.filename for member in old.infolist() if is_openssl(member.filename)]
        record = []
        for member in old.infolist():
            if member.filename in gone or member.is_dir() or member.filename.endswith(".dist-info/RECORD"):
                continue
            content = _changed(member.filename, old.read(member), [Path(each).name for each in gone])
            record.append(_line(member.filename, content))
            new.writestr(member, content, zipfile.ZIP_DEFLATED)
        (member,) = (each for each in old.infolist() if each.filename.endswith(".dist-info/RECORD"))
        new.writestr(member, "".join((*record, f"{member.filename},,\n")), zipfile.ZIP_DEFLATED)
    return path


def kept(wheel: Path) -> Path:
    """The wheel without its OpenSSL, where it has one, else as it is. Kept beside it: packing it takes ten seconds."""
    if not has_openssl(wheel):
        return wheel
    makers = f"lief {lief.__version__}, zlib {zlib.ZLIB_RUNTIME_VERSION}, "  # both decide on the bytes
    made_by = hashlib.sha256(makers.encode() + Path(__file__).read_bytes()).hexdigest()[:8]
    folder = wheel.parent / f"{TAG}-{made_by}"
    found = list(folder.glob(f"{wheel.name.split('-')[0]}-{wheel.name.split('-')[1]}-*.whl"))
    if found:
        return found[0]
    folder.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder) as half:  # builds beside each other see none that is half written
        made = take_out(wheel, Path(half))
        return made.replace(folder / made.name)


def has_openssl(wheel: Path) -> bool:
    with zipfile.ZipFile(wheel) as packed:
        return any(map(is_openssl, packed.namelist()))


def is_openssl(member: str) -> bool:
    return Path(member).name.startswith(("libssl-", "libcrypto-")) and ".so.1.1" in member


def notice(wheel: str) -> str:
    """What has been changed in a wheel of that file name, when and by whom, as the LGPL and Apache's licence ask for;
    "" of a wheel that is as PyPI has it."""
    if f"-{TAG}-" not in wheel:
        return ""
    return f"""\
MODIFIED: {wheel} is not the wheel that its makers
have published on PyPI, which is {wheel.replace(f"-{TAG}-", "-")}.
The Virtual Shutter developers changed it on {CHANGED}, by scripts/without_openssl.py of Virtual Shutter's source code:
  OpenSSL 1.1.1 (libssl, libcrypto) is taken out;
  FFmpeg's libavformat and libavutil no longer ask for it;
  its bill of materials (sboms/auditwheel.cdx.json), WHEEL and RECORD say so.
"""


def _changed(member: str, content: bytes, gone: list[str]) -> bytes:
    if member.endswith(".dist-info/WHEEL"):
        head, tags = content.split(b"Tag:", 1)
        return head + f"Build: {TAG}\nTag:".encode() + tags
    if member.endswith(".cdx.json"):
        return _without_components(content)
    if ".so" in Path(member).name and any(name.encode() in content for name in gone):
        return _without_libraries(content, gone)
    return content


def _without_libraries(content: bytes, gone: list[str]) -> bytes:
    """A shared library that no longer asks for some others, nor for what is theirs."""
    library = lief.ELF.parse(io.BytesIO(content))
    for symbol in library.dynamic_symbols:
        version = symbol.symbol_version
        if version.has_auxiliary_version and version.symbol_version_auxiliary.name.startswith("OPENSSL_"):
            symbol.name = _STAND_IN
            version.as_global()
    for name in filter(library.has_library, gone):
        library.remove_library(name)
        library.remove_version_requirement(name)
    return bytes(library.write_to_bytes())


def _without_components(content: bytes) -> bytes:
    """A bill of materials, by auditwheel, that no longer lists OpenSSL."""
    bill = json.loads(content)
    gone = {each["bom-ref"] for each in bill["components"] if each["name"].startswith("openssl")}
    bill["components"] = [each for each in bill["components"] if each["bom-ref"] not in gone]
    bill["dependencies"] = [each for each in bill["dependencies"] if each["ref"] not in gone]
    for each in bill["dependencies"]:
        if "dependsOn" in each:
            each["dependsOn"] = [needed for needed in each["dependsOn"] if needed not in gone]
    return json.dumps(bill).encode()


def _line(name: str, content: bytes) -> str:
    digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
    return f"{name},sha256={digest},{len(content)}\n"
