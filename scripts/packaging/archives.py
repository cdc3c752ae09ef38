"""Makes the archives of a release, its README and its checksums. The same inputs give the same
bytes.

    archives.py DIST OUTPUT VERSION NOTE
    archives.py check DIST                says whether DIST is complete, and no more

DIST is what scripts/package leaves; OUTPUT has the licences and the wheels already. NOTE is a
sentence of the README. SOURCE_DATE_EPOCH is the time of every entry. Needs Python's standard
library alone.
"""

from __future__ import annotations

import gzip
import hashlib
import io
import os
import re
import sys
import tarfile
import time
import zipfile
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# The operating systems in words, by the platforms of the orchestrator's archives.
PLATFORMS = {
    "linux-x86_64": "Linux on x86-64, glibc 2.17 or later",
    "linux-aarch64": "Linux on aarch64, glibc 2.17 or later",
    "windows-x86_64": "Windows 10 or later on x86-64",
    "macos-universal": "macOS 11 or later on both processors",
}
# Platforms whose FMUs and program go into wheels alone.
IN_WHEELS = ("macos-x86_64", "macos-aarch64")
LICENCES = ("LICENSE-APACHE", "LICENSE-MIT")
# Licences of the linked packages, by inventory.py and the Rust distribution.
NOTICES = ("LICENSES.txt", "LICENSES-rust-std.html")

FMUS_README = """# Re-entry attitude control: FMUs ({standard}) {version}

The archives (*.fmu) hold the FMUs for {systems}. Any importer for {standard}
co-simulation opens them; each has its documentation in documentation/index.html.

LICENSE-MIT and LICENSE-APACHE are the licences of the FMUs, either of which may be chosen.
LICENSES.txt and LICENSES-rust-std.html are those of what is linked in.
"""
PROGRAM_README = """# Re-entry attitude control: the orchestrator {version}

For {systems}.

    {program} list                        shows experiments, studies, campaigns and FMUs
    {program} run crmpc-2022/crmpc-robust  flies an experiment
    {program} --help                      explains all commands

The program finds experiments/ and fmu/ beside itself, from any folder.

LICENSE-MIT and LICENSE-APACHE are the licences of program and FMUs, either of which may be chosen.
LICENSES.txt and LICENSES-rust-std.html are those of what is linked in.
"""
RELEASE_README = """# Re-entry attitude control {version}

| file | is |
|---|---|
| reentry-fmus-{version}.zip | every FMU, for Linux and Windows on x86-64 and for macOS |
| reentry-fmus-{version}-linux-aarch64.zip | every FMU, for Linux on aarch64 |
| reentry-fmus-fmi3-{version}…zip | the same for FMI 3.0 |
| orchestrator-{version}-PLATFORM | the program with experiments and the platform's FMUs |
| *.whl | the Python package, with program, experiments and FMUs |{page}
| LICENSES.txt, LICENSES-rust-std.html | the licences of what is linked in |
| sbom.cdx.json | what is linked in, as a bill of materials (CycloneDX) |
| SHA256SUMS | checksums: `sha256sum --check SHA256SUMS` |

{note}
"""

# An entry of an archive: its place, content and permissions.
Entry = tuple[str, bytes, int]


class Fault(Exception):
    """A fault of the files that a release needs."""


def packed_fmus(folder: Path) -> Iterator[Entry]:
    for path in folder.glob("*.fmu"):
        yield path.name, path.read_bytes(), 0o644


def check(dist: Path) -> None:
    """Raises a fault unless every platform has the program and all FMUs of this version."""
    described = {path.stem: path.read_bytes() for path in ROOT.glob("fmu-*/generated/*.xml")}
    platforms = (*PLATFORMS, *IN_WHEELS)
    # Wheels may have FMUs of their own.
    wheel_folders = [folder for each in platforms if (folder := dist / each / "fmu-wheel").is_dir()]
    for folder in [*(dist / each / "fmu" for each in ("all", *platforms)), *wheel_folders]:
        for name, description in sorted(described.items()):
            path = folder / f"{name}.fmu"
            if not path.is_file():
                raise Fault(f"{path} does not exist: run scripts/package")
            with zipfile.ZipFile(path) as archive:
                if archive.read("modelDescription.xml") != description:
                    raise Fault(f"{path} is another version of the FMU: run scripts/package")
            check_fmi3(folder.parent / "fmi3" / f"{name}.fmu", description)
        for path in sorted(folder.glob("*.fmu")):
            if path.stem not in described:
                raise Fault(f"{path} is no FMU of this version: remove it")
    programs = [program(dist, platform) for platform in platforms]
    for path in programs:
        if not path.is_file():
            raise Fault(f"{path} does not exist: run scripts/package")


def check_fmi3(path: Path, description: bytes) -> None:
    """Raises a fault unless the archive for FMI 3.0 is of the same FMU as the description of FMI 2.0."""
    if not path.is_file():
        raise Fault(f"{path} does not exist: run scripts/package")
    with zipfile.ZipFile(path) as archive:
        found = archive.read("modelDescription.xml")
    guid = re.search(rb'guid="([^"]+)"', description)[1]
    if b'instantiationToken="%b"' % guid not in found:
        raise Fault(f"{path} is another version of the FMU: run scripts/package")


def program(dist: Path, platform: str) -> Path:
    return (
        dist / platform / ("orchestrator.exe" if platform.startswith("windows") else "orchestrator")
    )


def licence_files(output: Path) -> Iterator[Entry]:
    for path in [*(ROOT / name for name in LICENCES), *(output / name for name in NOTICES)]:
        yield path.name, path.read_bytes(), 0o644


def write(path: Path, entries: list[Entry], epoch: int) -> None:
    """Writes an archive whose only folder has the archive's name."""
    is_zip = path.name.endswith(".zip")
    top = path.name.removesuffix(".zip" if is_zip else ".tar.gz")
    entries = sorted((f"{top}/{place}", content, mode) for place, content, mode in entries)
    if is_zip:
        # The format knows no time before 1980.
        moment = max(time.gmtime(epoch)[:6], (1980, 1, 1, 0, 0, 0))
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
            for place, content, mode in entries:
                info = zipfile.ZipInfo(place, moment)
                info.compress_type = zipfile.ZIP_DEFLATED
                # As on Unix, whatever system this is.
                info.create_system, info.external_attr = 3, (0o100000 | mode) << 16
                archive.writestr(info, content)
        return
    with (
        path.open("wb") as file,
        gzip.GzipFile("", "wb", 9, file, mtime=epoch) as packed,
        tarfile.open(fileobj=packed, mode="w", format=tarfile.USTAR_FORMAT) as archive,
    ):
        for place, content, mode in entries:
            # Without anything else said, the owner is 0 and has no name.
            entry = tarfile.TarInfo(place)
            entry.size, entry.mode, entry.mtime = len(content), mode, epoch
            archive.addfile(entry, io.BytesIO(content))


def readme(text: str, **values: str) -> Entry:
    return "README.md", text.format(**values).encode(), 0o644


def write_fmus(dist: Path, output: Path, version: str, epoch: int) -> None:
    """Writes the archives of the FMUs alone."""
    for platform, suffix, systems in (
        ("all", "", "Linux and Windows on x86-64 and for macOS"),
        ("linux-aarch64", "-linux-aarch64", PLATFORMS["linux-aarch64"]),
    ):
        for folder, standard, mark in (("fmu", "FMI 2.0", ""), ("fmi3", "FMI 3.0", "-fmi3")):
            page = readme(FMUS_README, version=version, standard=standard, systems=systems)
            fmus = packed_fmus(dist / platform / folder)
            entries = [*fmus, *licence_files(output), page]
            write(output / f"reentry-fmus{mark}-{version}{suffix}.zip", entries, epoch)


def write_programs(dist: Path, output: Path, version: str, epoch: int) -> None:
    """Writes the archives of the orchestrator, with all that it finds beside itself."""
    experiments = []
    source = ROOT / "orchestrator"
    # Editors find the schema by the first line of each experiment.
    for folder in ("experiments", "schema"):
        for path in (source / folder).rglob("*"):
            if path.suffix in (".toml", ".csv", ".json"):
                experiments.append((path.relative_to(source).as_posix(), path.read_bytes(), 0o644))
    for platform, systems in PLATFORMS.items():
        binary = program(dist, platform)
        name = binary.stem if binary.suffix else f"./{binary.name}"
        page = readme(PROGRAM_README, version=version, systems=systems, program=name)
        fmus = [(f"fmu/{name}", content, mode) for name, content, mode in packed_fmus(dist / platform / "fmu")]
        entries = [
            (binary.name, binary.read_bytes(), 0o755),
            *experiments,
            *fmus,
            *licence_files(output),
            page,
        ]
        suffix = "zip" if platform.startswith("windows") else "tar.gz"
        write(output / f"orchestrator-{version}-{platform}.{suffix}", entries, epoch)


def write_checksums(output: Path) -> None:
    lines = [
        f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.name}\n"
        for path in sorted(output.iterdir())
        if path.name != "SHA256SUMS"
    ]
    (output / "SHA256SUMS").write_text("".join(lines), newline="\n")


def main(dist: str, output: str, version: str, note: str) -> None:
    folder, epoch = Path(output), int(os.environ["SOURCE_DATE_EPOCH"])
    write_fmus(Path(dist), folder, version, epoch)
    write_programs(Path(dist), folder, version, epoch)
    page = ""
    if (folder / "try-in-browser.html").is_file():
        page = "\n| try-in-browser.html | one page that flies the controllers; open it in a browser |"
    text = RELEASE_README.format(version=version, note=note, page=page)
    (folder / "README.md").write_text(text, newline="\n")
    write_checksums(folder)


if __name__ == "__main__":
    try:
        if sys.argv[1] == "check":
            check(Path(sys.argv[2]))
        else:
            main(*sys.argv[1:])
    except Fault as fault:
        sys.exit(f"error: {fault}")
