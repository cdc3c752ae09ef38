"""The Python package: the wheel of this machine is built, installed without a compiler into fresh
environments of the oldest and the newest Python that are found, and tested there by
python/tests."""

from __future__ import annotations

import functools
import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import nbformat
import notebooks
import pytest

from conftest import NAMES, ROOT, TARGET, program

pytestmark = pytest.mark.tier("wheel")

SUPPORTED = [(3, minor) for minor in (10, 11, 12, 13)]
PACKAGE = "reentry_fmus"
EXTRAS = ["campaign", "control", "matlab", "xarray"]
TESTS = ROOT / "python" / "tests"


def interpreters() -> list[tuple[tuple[int, int], Path]]:
    """The Pythons of supported versions that are found on the PATH and in pyenv, oldest first."""
    versions = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"), "versions")
    found = {sys.version_info[:2]: Path(sys.executable)}
    for version in SUPPORTED:
        name = "python{}.{}".format(*version)
        candidates = [shutil.which(name), *sorted(versions.glob(f"*/bin/{name}"))]
        ask = ["-c", "import ensurepip, sys; print(sys.version_info[:2])"]
        for candidate in filter(None, candidates):
            # The shims of pyenv exist for versions that are not active, and fail.
            said = subprocess.run([candidate, *ask], capture_output=True, text=True)
            if said.returncode == 0 and said.stdout.strip() == str(version):
                found[version] = Path(candidate)
    return sorted(found.items())

# The packed FMUs are smaller than those that the tests build for themselves.
PACKED = TARGET / "dist" / "linux-x86_64" / "fmu"
FMUS = PACKED if PACKED.is_dir() else TARGET / "fmu"


@functools.cache
def released() -> Path:
    """The built program without its symbols, as a release has it."""
    folder = TARGET / "stripped"
    folder.mkdir(parents=True, exist_ok=True)
    copy = folder / program("orchestrator").name
    shutil.copy(program("orchestrator"), copy)
    if shutil.which("strip"):
        subprocess.run(["strip", copy], check=True)
    return copy


def make(
    fmus: Path,
    folder: Path,
    platform: str = "host",
    orchestrator: Path | None = None,
) -> subprocess.CompletedProcess:
    orchestrator = orchestrator or released()
    command = [ROOT / "scripts" / "wheel", platform, fmus, orchestrator, folder]
    return subprocess.run(command, capture_output=True, text=True)


def made(fmus: Path, folder: Path) -> Path:
    done = make(fmus, folder)
    assert done.returncode == 0, done.stderr
    (wheel,) = folder.glob("*.whl")
    assert done.stdout.endswith(f"{wheel}\n")
    return wheel


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    return made(FMUS, tmp_path_factory.mktemp("wheel"))


# Content of the wheel


def test_the_wheel_holds_what_it_should(wheel):
    assert re.fullmatch(rf"{PACKAGE}-\d+\.\d+\.\d+-py3-none-\w+\.whl", wheel.name)
    assert wheel.stat().st_size <= 25e6
    with zipfile.ZipFile(wheel) as content:
        names = content.namelist()
        for name in NAMES:
            assert content.read(f"{PACKAGE}/data/fmu/{name}.fmu") == (FMUS / f"{name}.fmu").read_bytes()
        stored = next(n for n in names if n.startswith(f"{PACKAGE}/data/orchestrator"))
        assert content.getinfo(stored).external_attr >> 16 & 0o111 == 0o111
        experiments = ROOT / "orchestrator" / "experiments"
        for path in experiments.rglob("*.toml"):
            stored = f"{PACKAGE}/data/experiments/{path.relative_to(experiments).as_posix()}"
            assert content.read(stored) == path.read_bytes()
        (information,) = [n.removesuffix("/METADATA") for n in names if n.endswith("/METADATA")]
        for licence in ("LICENSE-MIT", "LICENSE-APACHE"):
            assert (
                content.read(f"{information}/licenses/{licence}") == (ROOT / licence).read_bytes()
            )
        metadata = content.read(f"{information}/METADATA").decode()
        assert f"{PACKAGE}/py.typed" in names
        assert "Root-Is-Purelib: false" in content.read(f"{information}/WHEEL").decode()
    version = re.search(r'(?m)^version = "(.+)"', (ROOT / "Cargo.toml").read_text())[1]
    assert f"\nVersion: {version}\n" in metadata
    assert "\nLicense-Expression: MIT OR Apache-2.0\n" in metadata
    assert (ROOT / "python" / "README.md").read_text() in metadata


@pytest.mark.parametrize(
    ("platform", "message"),
    [
        ("solaris", "there is no platform solaris; there are: linux-x86_64"),
        ("windows-x86_64", "has no program or library for windows-x86_64"),
        ("macos-universal", "has no program or library for macos-universal"),
    ],
)
def test_what_is_not_for_the_platform_is_refused(tmp_path, platform, message):
    done = make(TARGET / "fmu", tmp_path / "out", platform)
    assert done.returncode == 1 and message in done.stderr
    assert "Traceback" not in done.stderr
    assert not list(tmp_path.glob("out/*"))


def test_fmus_without_a_library_and_folders_without_fmus_are_refused(tmp_path):
    fmus = tmp_path / "fmu"
    fmus.mkdir()
    assert "there are no FMUs (*.fmu)" in make(fmus, tmp_path / "out").stderr
    assert "there is no folder" in make(tmp_path / "nowhere", tmp_path / "out").stderr
    with zipfile.ZipFile(fmus / "Empty.fmu", "w") as empty:
        empty.writestr("modelDescription.xml", "")
    assert "Empty.fmu has no program or library" in make(fmus, tmp_path / "out").stderr


def test_binaries_that_need_a_newer_glibc_than_the_tag_allows_are_refused(tmp_path):
    # The first bytes of an ELF file for x86_64, and the names of the symbols' versions.
    head = b"\x7fELF\x02\x01\x01" + bytes(9) + b"\x03\x00\x3e\x00" + bytes(44)
    old, new = head + b"\0GLIBC_2.2.5\0GLIBC_2.17\0", head + b"\0GLIBC_2.2.5\0GLIBC_2.34\0"
    fmus, orchestrator = tmp_path / "fmu", tmp_path / "orchestrator"
    fmus.mkdir()

    def said(of_fmu: bytes, of_program: bytes) -> str:
        with zipfile.ZipFile(fmus / "Some.fmu", "w") as fmu:
            fmu.writestr("binaries/linux64/Some.so", of_fmu)
        orchestrator.write_bytes(of_program)
        return make(fmus, tmp_path / "out", "linux-x86_64", orchestrator=orchestrator).stderr

    assert "Some.fmu needs glibc 2.34, but manylinux2014_x86_64 allows 2.17" in said(new, old)
    assert "orchestrator needs glibc 2.34" in said(old, new)
    assert said(old, old) == ""
    (wheel,) = (tmp_path / "out").iterdir()
    assert wheel.name.endswith("-py3-none-manylinux2014_x86_64.whl")


# Use where it is installed


class Installed:
    """A fresh environment with the wheel."""

    def __init__(self, interpreter: Path, folder: Path, wheel: Path, lowest: bool) -> None:
        subprocess.run([interpreter, "-m", "venv", folder], check=True)
        scripts = folder / ("Scripts" if os.name == "nt" else "bin")
        self.python = scripts / "python"
        # There is no compiler on the PATH, and no package may be built.
        unset = {"PYTHONPATH", "ORCHESTRATOR_PATH", "CC", "CXX"}
        self.environment = {k: v for k, v in os.environ.items() if k not in unset}
        self.environment["PATH"] = str(scripts)
        assert not any(
            shutil.which(name, path=str(scripts)) for name in ("cc", "gcc", "clang", "cl")
        )
        constraints = folder / "constraints.txt"
        constraints.write_text(self._lowest(wheel) if lowest else "")
        install = [self.python, "-m", "pip", "install", "--quiet", "--only-binary", ":all:"]
        name, version = wheel.name.split("-")[:2]
        package = f"{name}[{','.join(EXTRAS)}]=={version}"
        self.run([*install, "--find-links", wheel.parent, "-c", constraints, package])
        self.run([*install, "-c", constraints, "-r", TESTS / "requirements.txt"])

    @staticmethod
    def _lowest(wheel: Path) -> str:
        with zipfile.ZipFile(wheel) as content:
            (metadata,) = [n for n in content.namelist() if n.endswith(".dist-info/METADATA")]
            needed = re.findall(
                r"^Requires-Dist: (\w+)>=([^\s;]+)", content.read(metadata).decode(), re.M
            )
        return "\n".join(f"{name}=={version}" for name, version in needed)

    def run(self, command: list, folder: Path | None = None) -> str:
        done = subprocess.run(
            command, cwd=folder, env=self.environment, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout


@pytest.mark.parametrize("which", ["newest", "oldest"])
def test_the_package_works_where_it_is_installed(which, wheel, tmp_path):
    found = interpreters()
    version, interpreter = found[0 if which == "oldest" else -1]
    if which == "oldest" and len(found) == 1:
        pytest.skip(f"{interpreter} is the only Python here")
    # The lowest versions of what it needs are those of the lowest Python.
    lowest = version == SUPPORTED[0]
    installed = Installed(interpreter, tmp_path / "venv", wheel, lowest)
    outside = tmp_path / "outside"
    outside.mkdir()
    command = [installed.python, "-m", "pytest", "-q", "-p", "no:cacheprovider", TESTS]
    said = installed.run(command, outside)
    passed = re.search(r"(\d+) passed", said)
    assert passed and int(passed[1]) >= 135, said


# Examples that show it


@pytest.fixture(scope="module")
def site(wheel, tmp_path_factory) -> Path:
    """Folder with the package alone, for the Python of the tests."""
    return notebooks.install(wheel, tmp_path_factory.mktemp("site"))


# Output of each notebook, and the number of its pictures.
PRINTED = {
    "campaign": (["broken in ", "deg/s again: True"], 2),
    "own_controller": (["PD: EMS 2.7", "CRMPC: EMS 2.0", "Run: pd, closed loop", "broken by 2 of 200"], 2),
    "closed_loop": (["CRMPC: EMS 1.974"], 2),
}


@pytest.mark.parametrize("name", notebooks.NOTEBOOKS)
def test_the_notebooks_are_kept_with_what_they_give(name, site, tmp_path):
    kept = nbformat.read(notebooks.NOTEBOOKS[name], as_version=4)
    said = "".join(notebooks.texts(kept))
    words, count = PRINTED[name]
    assert all(text in said for text in words), said
    assert "/tmp" not in said and str(Path.home()) not in said
    shown = notebooks.outputs(kept)
    assert sum("image/png" in output.get("data", {}) for output in shown) == count
    assert all(output.get("name") != "stderr" for output in shown)
    fresh = notebooks.run(notebooks.NOTEBOOKS[name], site, tmp_path / "place")
    assert notebooks.texts(fresh) == notebooks.texts(kept), "run scripts/pages/notebooks.py"
