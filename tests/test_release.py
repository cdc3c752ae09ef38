"""The files of a release (scripts/release), made from stand-ins for the binaries: the same bytes
each time, checksums, licences, the bill of materials, and what keeps a release from being made."""

from __future__ import annotations

import hashlib
import json
import os
import platform
import re
import shutil
import subprocess
import tarfile
import zipfile
from pathlib import Path

import pytest

from conftest import NAMES, ROOT, TARGET, library, program

pytestmark = [
    pytest.mark.tier("release"),
    pytest.mark.skipif((platform.system(), platform.machine()) != ("Linux", "x86_64"), reason="made on Linux x86_64 only"),
]
VERSION = re.search(r'(?m)^version = "(.+)"', (ROOT / "Cargo.toml").read_text())[1]
EPOCH = 1_700_000_000
ELF = b"\x7fELF\x02\x01\x01" + bytes(9) + b"\x03\x00"
# The first bytes of a library for each platform, and where it stands in an FMU.
LIBRARIES = {
    "linux-x86_64": (ELF + b"\x3e\x00" + bytes(44), "binaries/linux64/{}.so"),
    "linux-aarch64": (ELF + b"\xb7\x00" + bytes(44), "binaries/linux64/{}.so"),
    "windows-x86_64": (b"MZ" + bytes(58) + b"\x40\0\0\0PE\0\0\x64\x86", "binaries/win64/{}.dll"),
    "macos-universal": (b"\xca\xfe\xba\xbe\0\0\0\2", "binaries/darwin64/{}.dylib"),
    "macos-x86_64": (b"\xcf\xfa\xed\xfe\x07\0\0\1", "binaries/darwin64/{}.dylib"),
    "macos-aarch64": (b"\xcf\xfa\xed\xfe\x0c\0\0\1", "binaries/darwin64/{}.dylib"),
}
EVERYWHERE = ("linux-x86_64", "windows-x86_64", "macos-universal")
# Tags of the wheels, and where their FMUs come from.
WHEELS = {
    "manylinux2014_x86_64": "linux-x86_64/fmu",
    "manylinux2014_aarch64": "linux-aarch64/fmu-wheel",
    "win_amd64": "windows-x86_64/fmu",
    "macosx_11_0_x86_64": "macos-x86_64/fmu",
    "macosx_11_0_arm64": "macos-aarch64/fmu",
}
ARCHIVES = {
    f"reentry-fmus-{VERSION}.zip",
    f"reentry-fmus-{VERSION}-linux-aarch64.zip",
    f"reentry-fmus-fmi3-{VERSION}.zip",
    f"reentry-fmus-fmi3-{VERSION}-linux-aarch64.zip",
    f"orchestrator-{VERSION}-linux-x86_64.tar.gz",
    f"orchestrator-{VERSION}-linux-aarch64.tar.gz",
    f"orchestrator-{VERSION}-windows-x86_64.zip",
    f"orchestrator-{VERSION}-macos-universal.tar.gz",
}


def write_fmu(path: Path, platforms: tuple[str, ...]) -> None:
    [description] = ROOT.glob(f"fmu-*/generated/{path.stem}.xml")
    beside = path.parents[1] / "fmi3" / path.name
    for folder in (path.parent, beside.parent):
        folder.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(beside, "w") as archive:
        token = re.search(r'guid=("[^"]+")', description.read_text())[1]
        archive.writestr(zipfile.ZipInfo("modelDescription.xml"), f"<fmi3 instantiationToken={token}/>")
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(zipfile.ZipInfo("modelDescription.xml"), description.read_bytes())
        for each in platforms:
            content, place = LIBRARIES[each]
            archive.writestr(zipfile.ZipInfo(place.format(path.stem)), content)


def packages(folder: Path, names: list[str]) -> Path:
    """Makes a folder like that of scripts/package, with files in the order of the names."""
    for name in names:
        write_fmu(folder / "all" / "fmu" / f"{name}.fmu", EVERYWHERE)
        for each in LIBRARIES:
            write_fmu(folder / each / "fmu" / f"{name}.fmu", (each,))
        # Where there is such a folder, its FMUs go into the wheel.
        others = ("linux-aarch64", "macos-x86_64")
        write_fmu(folder / "linux-aarch64" / "fmu-wheel" / f"{name}.fmu", others)
    for each, (content, _) in LIBRARIES.items():
        name = "orchestrator.exe" if each.startswith("windows") else "orchestrator"
        (folder / each / name).write_bytes(content + b"program")
    (folder / "browser").mkdir()
    (folder / "browser" / "index.html").write_text("the page")
    return folder


def release(folder: Path, output: Path, *options: object) -> subprocess.CompletedProcess:
    # No database can be fetched, wherever the test runs.
    redirected = {
        "GIT_CONFIG_COUNT": "1",
        "GIT_CONFIG_KEY_0": f"url.{output.parent}/nowhere/.insteadOf",
        "GIT_CONFIG_VALUE_0": "https://github.com/",
    }
    command = [ROOT / "scripts" / "release", "--from", folder, "--output", output, *options]
    environment = {**os.environ, **redirected, "SOURCE_DATE_EPOCH": str(EPOCH)}
    return subprocess.run(command, capture_output=True, text=True, env=environment)


@pytest.fixture(scope="module")
def dist(tmp_path_factory) -> Path:
    return packages(tmp_path_factory.mktemp("packages"), NAMES)


@pytest.fixture(scope="module")
def made(dist, tmp_path_factory) -> Path:
    done = release(dist, output := tmp_path_factory.mktemp("release") / "dist")
    assert done.returncode == 0, done.stderr
    assert "warning: advisories: not checked, no database could be fetched" in done.stderr
    return output


@pytest.fixture(params=sorted(ARCHIVES))
def content(request, made) -> dict[str, tuple[bytes, int, float]]:
    """Content, permissions and time of every entry of an archive, whose one folder is left out."""
    path = made / request.param
    top = re.sub(r"(\.zip|\.tar\.gz)$", "", path.name) + "/"
    found = {}
    if path.suffix == ".zip":
        with zipfile.ZipFile(path) as archive:
            for entry in archive.infolist():
                found[entry.filename] = (
                    archive.read(entry),
                    entry.external_attr >> 16 & 0o777,
                    entry.date_time,
                )
        moment = (2023, 11, 14, 22, 13, 20)
    else:
        with tarfile.open(path) as archive:
            for entry in archive.getmembers():
                assert (entry.uid, entry.gid, entry.uname, entry.gname) == (0, 0, "", "")
                found[entry.name] = (archive.extractfile(entry).read(), entry.mode, entry.mtime)
        moment = EPOCH
    assert list(found) == sorted(found) and all(name.startswith(top) for name in found)
    assert {time for _, _, time in found.values()} == {moment}
    return {"": path.name} | {name.removeprefix(top): entry for name, entry in found.items()}


def test_a_release_has_these_files(made):
    wheels = {f"reentry_fmus-{VERSION}-py3-none-{tag}.whl" for tag in WHEELS}
    others = {"LICENSES.txt", "LICENSES-rust-std.html", "README.md", "SHA256SUMS", "sbom.cdx.json", "try-in-browser.html"}
    assert {path.name for path in made.iterdir()} == ARCHIVES | wheels | others
    assert all(zipfile.ZipFile(made / wheel).read("reentry_fmus/data/try.html") == b"the page" for wheel in wheels)


def test_archives_hold_fmus_licences_and_experiments(content, dist):
    name = content.pop("")
    licences = {"LICENSE-MIT", "LICENSE-APACHE", "LICENSES.txt", "LICENSES-rust-std.html"}
    assert {*licences, "README.md"} <= set(content)
    assert VERSION in content["README.md"][0].decode()
    executable = {place for place, (_, mode, _) in content.items() if mode == 0o755}
    assert {mode for _, mode, _ in content.values()} <= {0o644, 0o755}
    if name.startswith("reentry-fmus"):
        system = "linux-aarch64" if "aarch64" in name else "all"
        folder = dist / system / ("fmi3" if "fmi3" in name else "fmu")
        places = {f"{each}.fmu": folder / f"{each}.fmu" for each in NAMES}
        assert set(content) == {*places, *licences, "README.md"} and not executable
    else:
        system = re.match(rf"orchestrator-{VERSION}-(.+?)\.(zip|tar)", name)[1]
        places = {f"fmu/{each}.fmu": dist / system / "fmu" / f"{each}.fmu" for each in NAMES}
        [binary] = executable
        assert binary == ("orchestrator.exe" if system.startswith("windows") else "orchestrator")
        assert content[binary][0] == LIBRARIES[system][0] + b"program"
        experiments = ROOT / "orchestrator" / "experiments"
        shown = {path for path in content if path.startswith("experiments/")}
        assert shown == {
            f"experiments/{path.relative_to(experiments).as_posix()}"
            for path in experiments.rglob("*")
            if path.suffix in (".toml", ".csv")
        }
        assert "schema/experiment.json" in content
    for place, path in places.items():
        assert content[place][0] == path.read_bytes()


def test_the_same_packages_give_the_same_bytes(made, tmp_path):
    # Other times, other permissions and another order in the folders.
    again = packages(tmp_path / "packages", NAMES[::-1])
    for path in again.rglob("*.fmu"):
        path.chmod(0o600)
        os.utime(path, (1, 1))
    done = release(again, tmp_path / "dist")
    assert done.returncode == 0, done.stderr
    for path in made.iterdir():
        assert (tmp_path / "dist" / path.name).read_bytes() == path.read_bytes(), path.name
    # A release takes the place of the last one, and of nothing else.
    (tmp_path / "dist" / "old.zip").touch()
    assert release(again, tmp_path / "dist").returncode == 0
    assert not (tmp_path / "dist" / "old.zip").exists()
    kept = tmp_path / "other" / "file"
    kept.parent.mkdir()
    kept.touch()
    assert "holds something else than a release" in release(again, kept.parent).stderr
    assert kept.exists()


def test_the_checksums_are_those_of_the_files(made):
    lines = (made / "SHA256SUMS").read_text().splitlines()
    files = [path for path in made.iterdir() if path.name != "SHA256SUMS"]
    sums = {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in files}
    assert lines == [f"{sums[name]}  {name}" for name in sorted(sums)]


def test_wheels_have_the_fmus_and_the_licences_of_what_is_linked_in(made, dist):
    for tag, folder in WHEELS.items():
        [wheel] = made.glob(f"*-{tag}.whl")
        with zipfile.ZipFile(wheel) as archive:
            assert {entry.date_time for entry in archive.infolist()} == {(2023, 11, 14, 22, 13, 20)}
            for name in NAMES:
                packed = archive.read(f"reentry_fmus/data/fmu/{name}.fmu")
                assert packed == (dist / folder / f"{name}.fmu").read_bytes()
            for name in ("LICENSES.txt", "LICENSES-rust-std.html"):
                assert archive.read(f"reentry_fmus/data/{name}") == (made / name).read_bytes()


def compiled_in() -> set[str]:
    """The packages, as NAME-VERSION, whose source files the messages in the binaries name."""
    files = [program("orchestrator"), *map(library, ("fmu_plant_library", "fmu_optimising", "fmu_feedback"))]
    pattern = re.compile(rb"registry/src/[^/]+/([\w.+-]+)/src/")
    return {name.decode() for file in files for name in pattern.findall(file.read_bytes())}


def test_the_licences_name_what_is_linked_in_and_bring_the_texts(made):
    page = (made / "LICENSES.txt").read_text()
    listed = {"-".join(entry) for entry in re.findall(r"(?m)^([\w-]+) (\d\S+): ", page)}
    found = compiled_in()
    assert len(found) > 60 and found <= listed
    for name in ("clarabel", "nalgebra", "orchestrator", "clap"):
        assert re.search(rf"(?m)^{name} \d+\.\d+\.\d+: ", page)
    # Tests and builds need them; nobody gets them.
    for name in ("criterion", "proptest", "serde_derive"):
        assert not re.search(rf"(?m)^{name} \d", page)
    headings = re.findall(r"(?m)^={100}\n(.+)\n={100}\n", page)
    for name in ("clarabel", "nalgebra", "fmi-rs", "reentry-vehicle", "mingw-w64's start-up code"):
        assert any(name in heading for heading in headings), name
    assert "SIL OPEN FONT LICENSE" in page
    assert str(ROOT) not in page and str(Path.home()) not in page


def test_the_bill_of_materials_fits_its_schema_and_the_lock_file(made):
    text = (made / "sbom.cdx.json").read_text()
    bill = json.loads(text)
    # The validator is that of CycloneDX, with its schema.
    validator = (
        "import sys; from cyclonedx.schema import SchemaVersion;"
        "from cyclonedx.validation.json import JsonStrictValidator as V;"
        "sys.exit(str(V(SchemaVersion.V1_6).validate_str(sys.stdin.read()) or '') or None)"
    )
    python = TARGET / "release-tools" / "bin" / "python"
    for given, code in ((text, 0), (text.replace('"bomFormat"', '"form"'), 1)):
        done = subprocess.run([python, "-c", validator], input=given, capture_output=True, text=True)
        assert done.returncode == code, done.stderr
    components = {(each["name"], each["version"]): each for each in bill["components"]}
    assert compiled_in() <= {"-".join(key) for key in components}
    lock = (ROOT / "Cargo.lock").read_text()
    entries = re.findall(r'name = "(.+)"\nversion = "(.+)"\nsource = .+\nchecksum = "(.+)"', lock)
    sums = {(name, version): checksum for name, version, checksum in entries}
    for key in set(components) & set(sums):
        assert components[key]["hashes"] == [{"alg": "SHA-256", "content": sums[key]}]
        assert components[key]["purl"] == "pkg:cargo/{}@{}".format(*key).replace("+", "%2B")
    uses = {each["ref"]: each.get("dependsOn", []) for each in bill["dependencies"]}
    controller = uses[f"pkg:cargo/reentry-fmu-controller@{VERSION}"]
    assert f"pkg:cargo/reentry-control@{VERSION}" in controller and "std" in controller
    assert bill["metadata"]["timestamp"].startswith("2023-11-14T22:13:20")


# Faults that prevent a release


def test_missing_and_foreign_fmus_are_named(dist, tmp_path):
    folder = tmp_path / "packages"
    shutil.copytree(dist, folder)

    def said() -> str:
        done = release(folder, tmp_path / "dist")
        assert done.returncode == 1 and "Traceback" not in done.stderr
        assert not (tmp_path / "dist").exists()
        return done.stderr

    binary = folder / "macos-aarch64" / "orchestrator"
    binary.rename(tmp_path / "kept")
    assert f"{binary} does not exist: run scripts/package" in said()
    (tmp_path / "kept").rename(binary)
    foreign = folder / "all" / "fmu" / "Foreign.fmu"
    foreign.touch()
    assert f"{foreign} is no FMU of this version" in said()
    foreign.unlink()
    one = folder / "windows-x86_64" / "fmu" / "LQR.fmu"
    with zipfile.ZipFile(one, "w") as archive:
        archive.writestr("modelDescription.xml", "<fmiModelDescription/>")
    assert f"{one} is another version of the FMU" in said()
    one.unlink()
    assert f"{one} does not exist: run scripts/package" in said()
    shutil.copy(dist / "windows-x86_64" / "fmu" / "LQR.fmu", one)
    beside = folder / "windows-x86_64" / "fmi3" / "LQR.fmu"
    shutil.copy(beside.with_name("FBL.fmu"), beside)
    assert f"{beside} is another version of the FMU" in said()
    shutil.copy(dist / "windows-x86_64" / "fmi3" / "LQR.fmu", beside)
    of_wheel = folder / "linux-aarch64" / "fmu-wheel" / "LQR.fmu"
    of_wheel.unlink()
    assert f"{of_wheel} does not exist: run scripts/package" in said()


JUDGE = """
import inventory
package = lambda licence, name="some": {"name": name, "version": "1.0.0", "license": licence}
good = ("MIT", "MIT/Apache-2.0", "GPL-3.0-only OR MIT", "(MIT OR MPL-2.0) AND BSD-3-Clause")
for licence in good:
    inventory.check([package(licence)])
inventory.check([package("MPL-2.0", "colored")])
bad = ("GPL-3.0-only", "MIT AND GPL-3.0-only", "MPL-2.0", "MIT WITH LLVM-exception", "My own", None)
for licence in bad:
    try:
        inventory.check([package("MIT", "other"), package(licence)])
    except inventory.Fault as fault:
        print(fault)
    else:
        print("allowed:", licence)
"""


def test_licences_that_are_not_allowed_are_named(made):
    python = TARGET / "release-tools" / "bin" / "python"
    done = subprocess.run([python, "-c", JUDGE], cwd=ROOT / "scripts" / "packaging", capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    said = [line.split(":")[0] for line in done.stdout.splitlines()]
    assert said == [
        "some 1.0.0 is under GPL-3.0-only, which is not allowed",
        "some 1.0.0 is under MIT AND GPL-3.0-only, which is not allowed",
        "some 1.0.0 is under MPL-2.0, which is not allowed",
        "some 1.0.0 is under MIT WITH LLVM-exception, which is not allowed",
        "some 1.0.0 has an unknown licence, My own",
        "some 1.0.0 does not name its licence",
    ]


# Advisories

ADVISORY = """```toml
[advisory]
id = "RUSTSEC-2026-9999"
package = "{package}"
date = "2026-01-01"
url = "https://example.org/"

[versions]
patched = ["{patched}"]
```

# An advisory of this test

It replaces a real one.
"""


def database(folder: Path, package: str, patched: str) -> Path:
    path = folder / "crates" / package / "RUSTSEC-2026-9999.md"
    path.parent.mkdir(parents=True)
    path.write_text(ADVISORY.format(package=package, patched=patched))
    return folder


def test_a_release_says_that_advisories_were_not_checked(made, dist, tmp_path):
    assert "Advisories: not checked, no database could be fetched." in (made / "README.md").read_text()
    done = release(dist, tmp_path / "dist", "--require-advisories")
    assert done.returncode == 1 and not (tmp_path / "dist").exists()
    assert "error: advisories: not checked, no database could be fetched" in done.stderr


def test_an_advisory_against_a_crate_of_the_lock_file_fails_the_release(dist, tmp_path):
    hit = database(tmp_path / "hit", "clarabel", ">= 99.0.0")
    done = release(dist, tmp_path / "dist", "--advisory-db", hit)
    assert done.returncode == 1 and not (tmp_path / "dist").exists()
    assert "RUSTSEC-2026-9999" in done.stdout and "an advisory concerns a crate" in done.stderr
    mended = database(tmp_path / "mended", "clarabel", ">= 0.0.1")
    done = release(dist, tmp_path / "dist", "--advisory-db", mended, "--require-advisories")
    assert done.returncode == 0, done.stderr
    said = (tmp_path / "dist" / "README.md").read_text()
    assert f"Advisories: none concerns a crate of Cargo.lock, by the database {mended}." in said
