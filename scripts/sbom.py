"""A software bill of materials of a zip, as CycloneDX: `python scripts/sbom.py ZIP OUTPUT.cdx.json`.

It lists the extension, its model, each wheel, the libraries in the wheels, and every file of the zip and of its wheels
with its hash. The same zip gives the same bytes.
"""

import argparse
import hashlib
import io
import sys
import tomllib
import uuid
import warnings
import zipfile
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import components
from cyclonedx.model import HashAlgorithm, HashType, Property
from cyclonedx.model.bom import Bom, BomMetaData
from cyclonedx.model.component import Component, ComponentType, Pedigree
from cyclonedx.model.license import LicenseExpression
from cyclonedx.output import make_outputter
from cyclonedx.schema import OutputFormat, SchemaVersion
from packageurl import PackageURL
from without_openssl import notice

WITHIN = "!/"  # between a wheel's path in the zip and a file's path in the wheel


def write(zip_path: Path, output_path: Path) -> None:
    """Writes the bill of materials of an extension's zip, whole or not at all.

    Raises OSError, and zipfile.BadZipFile or KeyError where the file is no zip of this extension.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # the zip without wheels does depend on nothing
        text = make_outputter(_bom(zip_path), OutputFormat.JSON, SchemaVersion.V1_6).output_as_string(indent=2)
    half = output_path.with_name(f"{output_path.name}.part")
    half.write_text(text + "\n", encoding="utf-8", newline="\n")
    half.replace(output_path)


def _bom(zip_path: Path) -> Bom:
    digest = _sha256(zip_path.read_bytes())
    with zipfile.ZipFile(zip_path) as packed:
        manifest = tomllib.loads(packed.read("blender_manifest.toml").decode())
        newest = max(member.date_time for member in packed.infolist())
        extension = _extension(manifest, digest)
        bom = Bom(
            serial_number=uuid.uuid5(uuid.NAMESPACE_OID, digest),
            metadata=BomMetaData(component=extension, timestamp=datetime(*newest, tzinfo=UTC)),
        )
        bom.components.update(_files(packed))
        models = [_model(its, packed.read(its["path"])) for its in components.DATA["model"].values()]
        bom.components.update(models)
        wheels = [_wheel(path.removeprefix("./"), packed, manifest["platforms"][0]) for path in _wheels(manifest)]
    for wheel, bundled in wheels:
        bom.components.update((wheel, *bundled))
        bom.register_dependency(wheel, bundled)
    bom.register_dependency(extension, [*models, *(wheel for wheel, _ in wheels)])
    return bom


def _wheels(manifest: dict) -> list[str]:
    """The wheels of a zip, which Blender's builder lists elsewhere where it splits systems."""
    return sorted(manifest.get("build", {}).get("generated", manifest).get("wheels", []))


def _extension(manifest: dict, digest: str) -> Component:
    return Component(
        name=manifest["id"],
        version=manifest["version"],
        type=ComponentType.APPLICATION,
        bom_ref=manifest["id"],
        licenses=[LicenseExpression(licence.removeprefix("SPDX:")) for licence in manifest["license"]],
        copyright="\n".join(manifest["copyright"]),
        hashes=[_hash(digest)],
    )


def _model(its: dict, content: bytes) -> Component:
    return Component(
        name=its["name"],
        type=ComponentType.MACHINE_LEARNING_MODEL,
        bom_ref=its["path"],
        licenses=[LicenseExpression(its["licence"])],
        copyright="\n".join(its["copyright"]),
        hashes=[_hash(_sha256(content))],
    )


def _wheel(path: str, packed: zipfile.ZipFile, system: str) -> tuple[Component, list[Component]]:
    content, name = packed.read(path), components.wheel_name(path)
    its = components.DATA["wheel"][name]
    with zipfile.ZipFile(io.BytesIO(content)) as wheel:
        says = components.metadata(wheel)
        libraries = components.libraries(wheel.namelist())
    changed = notice(path[7:])
    file = {} if changed else {"file_name": path[7:]}  # a changed one is not on PyPI
    component = Component(
        name=says["Name"],
        version=says["Version"],
        type=ComponentType.LIBRARY,
        bom_ref=path,
        purl=PackageURL("pypi", name=says["Name"].lower(), version=says["Version"], qualifiers=file),
        licenses=[LicenseExpression(its["licence"])],
        copyright="\n".join(its["copyright"]),
        hashes=[_hash(_sha256(content))],
        pedigree=Pedigree(notes=changed) if changed else None,
    )
    bundled = []
    for part in components.parts(name, system):
        members = tuple(member for member, plain in libraries.items() if plain in part.files)
        bundled.append(_library(replace(part, files=members), part.versions(), path))
    return component, bundled


def _library(part: components.Part, versions: list[str], wheel: str) -> Component:
    """A library in a wheel; its files are named as they are there."""
    return Component(
        name=part.name,
        version=versions[0] if len(versions) == 1 else None,
        type=ComponentType.LIBRARY,
        bom_ref=f"{wheel}{WITHIN}{part.name}",
        licenses=[LicenseExpression(part.licence)],
        copyright="\n".join(part.copyright),
        properties=[
            *(Property(name="virtual_shutter:file", value=f"{wheel}{WITHIN}{name}") for name in part.files),
            *(Property(name="virtual_shutter:built_in", value=name) for name in part.built_in),
        ],
    )


def _files(packed: zipfile.ZipFile) -> Iterator[Component]:
    """Every file of a zip, and every file of the wheels in it."""
    for path, content in contents(packed):
        digest = [_hash(_sha256(content))]
        yield Component(name=path, type=ComponentType.FILE, bom_ref=f"file:{path}", hashes=digest)


def contents(packed: zipfile.ZipFile, within: str = "") -> Iterator[tuple[str, bytes]]:
    for member in packed.infolist():
        if member.is_dir():
            continue
        path, content = within + member.filename, packed.read(member)
        yield path, content
        if path.endswith(".whl"):
            with zipfile.ZipFile(io.BytesIO(content)) as wheel:
                yield from contents(wheel, path + WITHIN)


def _sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _hash(content: str) -> HashType:
    return HashType(alg=HashAlgorithm.SHA_256, content=content)


def main() -> None:
    parser = argparse.ArgumentParser("scripts/sbom.py", description="Writes the bill of materials of a zip.")
    parser.add_argument("zip", type=Path, metavar="ZIP")
    parser.add_argument("output", type=Path, metavar="OUTPUT.cdx.json")
    options = parser.parse_args()
    try:
        write(options.zip, options.output)
    except (OSError, zipfile.BadZipFile, KeyError) as error:
        print(f"sbom: {options.zip}: no bill of materials: {error}", file=sys.stderr)
        sys.exit(2)


if __name__ == "__main__":
    main()
