"""Writes what is linked into the FMUs and the orchestrator: `LICENSES.txt`, with the licence
texts, and `sbom.cdx.json`, a bill of materials in CycloneDX's format.

    inventory.py OUTPUT ZIG TRIPLE...

OUTPUT is a folder, ZIG that of the cross compiler; the triples are what the binaries are built for.
Exit code 1: a licence is not allowed or not known, or cargo failed. SOURCE_DATE_EPOCH must be set:
the same sources give the same bytes.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import uuid
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from boolean import Expression
from cyclonedx.model import HashAlgorithm, HashType
from cyclonedx.model.bom import Bom
from cyclonedx.model.component import Component, ComponentType
from cyclonedx.model.license import LicenseExpression
from cyclonedx.output.json import JsonV1Dot6
from cyclonedx.schema import SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator
from license_expression import ExpressionError, get_spdx_licensing
from packageurl import PackageURL

# The packages whose libraries and programs are released.
ROOTS = ("reentry-fmu-plant-library", "reentry-fmu-optimising", "reentry-fmu-feedback", "orchestrator")
# Licences that binaries may be passed on under together with the project's own.
ALLOWED = {
    "0BSD",
    "Apache-2.0",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "CC0-1.0",
    "ISC",
    "MIT",
    "MIT-0",
    "Unicode-3.0",
    "Unlicense",
    "Zlib",
    "bzip2-1.0.6",
}
# Further licences of single packages, each with its reason.
EXCEPTIONS = {
    # It comes with fmi-rs. MPL-2.0 asks that its source, which is not changed, can be had.
    "colored": {"MPL-2.0"},
}
LICENCE_FILE = re.compile(r"(?i)^(un)?licen[cs]es?\b|^licen[cs]e[-_]|^copying|^notice|^ofl")
LICENSING = get_spdx_licensing()
LINE = "=" * 100


class Fault(Exception):
    """A licence that keeps the release from being made, or a failure of cargo."""


def output_of(*command: str) -> str:
    """Returns what a command prints."""
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        raise Fault(f"{command[0]} {command[1]} failed:\n{done.stderr.strip()}")
    return done.stdout


def linked(triples: list[str]) -> list[dict[str, Any]]:
    """Returns the packages, as `cargo metadata` describes them, that are linked in for any of the
    triples, sorted. `needs` has the identifiers of those that each of them uses."""
    linked_versions = set()
    for triple in triples:
        packages = [argument for root in ROOTS for argument in ("--package", root)]
        # Procedural macros, and what builds need, are not in the binaries.
        edges = ["--edges", "normal,no-proc-macro", "--prefix", "none", "--format", "{p}"]
        for line in output_of(
            "cargo", "tree", "--locked", "--target", triple, *packages, *edges
        ).splitlines():
            if line.strip():
                name, version = line.split()[:2]
                linked_versions.add((name, version.removeprefix("v")))
    metadata = json.loads(output_of("cargo", "metadata", "--locked", "--format-version", "1"))
    described = [
        each
        for each in metadata["packages"]
        if (each["name"], each["version"]) in linked_versions
    ]
    ids = {package["id"] for package in described}
    if len(ids) != len(linked_versions):
        raise Fault(
            f"cargo tree names {len(linked_versions)} packages, cargo metadata {len(ids)} of them"
        )
    for node in metadata["resolve"]["nodes"]:
        if node["id"] in ids:
            (package,) = (each for each in described if each["id"] == node["id"])
            package["needs"] = {
                used["pkg"]
                for used in node["deps"]
                if used["pkg"] in ids and any(kind["kind"] is None for kind in used["dep_kinds"])
            }
    return sorted(described, key=lambda package: (package["name"], package["version"]))


# Licences


def label(package: dict[str, Any]) -> str:
    return f"{package['name']} {package['version']}"


def expression(package: dict[str, Any]) -> Expression:
    """Returns the licence of a package as an expression of known SPDX identifiers."""
    if not package["license"]:
        raise Fault(f"{label(package)} does not name its licence")
    try:
        # Before SPDX, cargo separated alternatives by a slash.
        return LICENSING.parse(package["license"].replace("/", " OR "), validate=True, strict=True)
    except ExpressionError as error:
        message = f"{label(package)} has an unknown licence, {package['license']}: {error}"
        raise Fault(message) from None


def allows(licence: Expression, allowed: set[str]) -> bool:
    if isinstance(licence, LICENSING.OR):
        return any(allows(part, allowed) for part in licence.args)
    if isinstance(licence, LICENSING.AND):
        return all(allows(part, allowed) for part in licence.args)
    return str(licence) in allowed


def check(packages: list[dict[str, Any]]) -> None:
    """Raises a fault if the licence of a package is not allowed."""
    faults = []
    for package in packages:
        allowed = ALLOWED | EXCEPTIONS.get(package["name"], set())
        if not allows(expression(package), allowed):
            faults.append(f"{label(package)} is under {package['license']}, which is not allowed")
    if faults:
        raise Fault("\n".join(faults))


def texts(package: dict[str, Any], sysroot: Path) -> list[str]:
    """Returns the licence texts that a package brings, also those of fonts and code within it. If
    it brings none, the usual texts of its licences take their place."""
    folder = Path(package["manifest_path"]).parent
    files = {path for path in folder.rglob("*") if LICENCE_FILE.search(path.name)}
    if package["license_file"]:
        files.add(folder / package["license_file"])
    if package["source"] is None:
        files = set(Path().glob("LICENSE-*"))
    ordered = sorted(path for path in files if path.is_file() and path.suffix != ".rs")
    licence_texts = [
        path.read_text("utf-8", "replace").replace("\r\n", "\n").strip() for path in ordered
    ]
    if licence_texts:
        return licence_texts
    # The Rust distribution has the texts of SPDX for what its own sources use.
    folder = sysroot / "share" / "doc" / "rust" / "licenses"
    symbols = [str(symbol) for symbol in expression(package).get_symbols()]
    usual = {each: folder / f"{each}.txt" for each in symbols if (folder / f"{each}.txt").is_file()}
    if not allows(expression(package), set(usual)):
        raise Fault(f"{label(package)} brings no text of its licence, {package['license']}")
    names = [re.sub(r" *<.*>", "", author) for author in package["authors"]]
    authors = ", ".join(names) or f"the authors of {label(package)}"
    note = f"{label(package)} brings no text of its licence. Copyright: {authors}"
    return [f"{note}\n\n{path.read_text('utf-8').strip()}" for path in usual.values()]


def licences(packages: list[dict[str, Any]], others: dict[str, Path]) -> str:
    """Returns the page with the licences of the packages and of what else is linked in, which is
    given with its texts."""
    sysroot = Path(output_of("rustc", "--print", "sysroot").strip())
    # Texts that differ in their line breaks alone are one.
    users: dict[str, tuple[str, list[str]]] = {}
    lines = [
        "Packages that are linked into the FMUs and the orchestrator, with their licences.",
        "The texts follow below, each after the names of those that bring it.",
        "",
    ]

    def add(user: str, text: str) -> None:
        _, names = users.setdefault(" ".join(text.split()), (text, []))
        if user not in names:
            names.append(user)

    for package in packages:
        source = f", {package['repository']}" if package["repository"] else ""
        lines.append(f"{label(package)}: {expression(package)}{source}")
        for text in texts(package, sysroot):
            add(label(package), text)
    lines.append("Rust's standard library: see LICENSES-rust-std.html")
    for name, path in others.items():
        lines.append(f"{name}: see its text")
        add(name, path.read_text("utf-8").strip())
    for text, names in users.values():
        lines += ["", LINE, ", ".join(names), LINE, "", text]
    return "\n".join(lines) + "\n"


# Bill of materials


def checksums() -> dict[tuple[str, str], str]:
    """Returns the checksums of the packages in the lock file."""
    entry = re.compile(r'name = "(.+)"\nversion = "(.+)"\n(?:source = .+\nchecksum = "(.+)")?')
    entries = entry.findall(Path("Cargo.lock").read_text("utf-8"))
    return {(name, version): checksum for name, version, checksum in entries}


def component(package: dict[str, Any], sums: dict[tuple[str, str], str]) -> Component:
    name, version = package["name"], package["version"]
    identifier = PackageURL("cargo", None, name, version)
    made = Component(
        type=ComponentType.APPLICATION if name == "orchestrator" else ComponentType.LIBRARY,
        name=name,
        version=version,
        bom_ref=str(identifier),
        purl=identifier,
        description=(package["description"] or "").strip() or None,
        licenses=[LicenseExpression(str(expression(package)))],
    )
    if sums.get((name, version)):
        made.hashes.add(HashType(alg=HashAlgorithm.SHA_256, content=sums[name, version]))
    return made


def bill(packages: list[dict[str, Any]], version: str, epoch: int) -> str:
    """Returns the bill of materials as JSON that its schema allows."""
    sums = checksums()
    bom = Bom()
    bom.metadata.timestamp = datetime.fromtimestamp(epoch, timezone.utc)
    bom.metadata.component = Component(
        type=ComponentType.APPLICATION,
        name="reentry-attitude-control",
        version=version,
        bom_ref="release",
        licenses=[LicenseExpression("MIT OR Apache-2.0")],
    )
    compiler = output_of("rustc", "--version").split()[1]
    standard = Component(type=ComponentType.LIBRARY, name="std", version=compiler, bom_ref="std")
    components = {package["id"]: component(package, sums) for package in packages}
    bom.components.update([standard, *components.values()])
    roots = [components[package["id"]] for package in packages if package["name"] in ROOTS]
    bom.register_dependency(bom.metadata.component, roots)
    for package in packages:
        used = [components[other] for other in package["needs"]]
        bom.register_dependency(components[package["id"]], [standard, *used])
    # A number of its own for each content, not for each run.
    content = "\n".join(f"{ref.bom_ref.value}" for ref in bom.components)
    bom.serial_number = uuid.uuid5(uuid.NAMESPACE_URL, f"{version} {epoch} {content}")
    text = JsonV1Dot6(bom).output_as_string(indent=2) + "\n"
    fault = JsonStrictValidator(SchemaVersion.V1_6).validate_str(text)
    if fault:
        raise Fault(f"the bill of materials does not fit its schema: {fault}")
    return text


def compiler_licences(zig: Path) -> dict[str, Path]:
    """Returns what the cross compiler links in beside the packages, with the licence texts."""
    licence_files = {
        "Zig's start-up code and compiler-rt": zig / "LICENSE",
        "mingw-w64's start-up code (Windows)": zig / "lib" / "libc" / "mingw" / "COPYING",
        "libunwind (Windows)": zig / "lib" / "libunwind" / "LICENSE.TXT",
    }
    for path in licence_files.values():
        if not path.is_file():
            raise Fault(f"the cross compiler's licence {path} does not exist")
    return licence_files


def main(output: str, zig: str, *triples: str) -> None:
    epoch = int(os.environ["SOURCE_DATE_EPOCH"])
    packages = linked(list(triples))
    check(packages)
    (version,) = {package["version"] for package in packages if package["name"] == "orchestrator"}
    page = licences(packages, compiler_licences(Path(zig)))
    Path(output, "LICENSES.txt").write_text(page, "utf-8", newline="\n")
    Path(output, "sbom.cdx.json").write_text(bill(packages, version, epoch), "utf-8", newline="\n")
    print(f"{len(packages)} packages are linked in; their licences are allowed")


if __name__ == "__main__":
    try:
        main(*sys.argv[1:])
    except Fault as fault:
        sys.exit("\n".join(f"error: {line}" for line in str(fault).splitlines()))
