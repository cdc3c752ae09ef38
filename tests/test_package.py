"""FMUs for old Linux systems (scripts/package): their requirements, their size, and that they
behave the same."""

import platform
import zipfile

import pytest
from elftools.elf.dynamic import DynamicSection
from elftools.elf.elffile import ELFFile
from elftools.elf.gnuversions import GNUVerNeedSection

from conftest import NAMES, TARGET
from fmi import Fmu, Instance

pytestmark = [
    pytest.mark.tier("platforms"),
    pytest.mark.skipif((platform.system(), platform.machine()) != ("Linux", "x86_64"), reason="built on Linux x86_64 only"),
]
# CentOS 7 and manylinux2014 have this version of glibc and these libraries.
GLIBC = (2, 17)
LIBRARIES = {"libc.so.6", "libm.so.6", "libpthread.so.0", "libdl.so.2", "ld-linux-x86-64.so.2"}
NODELETE = 0x8


@pytest.fixture(scope="module", params=NAMES)
def packed(request):
    path = TARGET / "dist" / "linux-x86_64" / "fmu" / f"{request.param}.fmu"
    assert path.is_file(), f"{path} does not exist: run scripts/package"
    return path


@pytest.fixture(scope="module")
def library(packed, tmp_path_factory):
    with zipfile.ZipFile(packed) as archive:
        path = archive.extract(f"binaries/linux64/{packed.stem}.so", tmp_path_factory.mktemp(packed.stem))
    with open(path, "rb") as file:
        yield ELFFile(file)


def test_nothing_newer_than_glibc_2_17_is_needed(library):
    versions = set()
    for section in library.iter_sections():
        if isinstance(section, GNUVerNeedSection):
            versions |= {version.name for _, needed in section.iter_versions() for version in needed}
    assert versions and all(name.startswith("GLIBC_") for name in versions)
    newest = max(tuple(int(part) for part in name.removeprefix("GLIBC_").split(".")) for name in versions)
    assert newest <= GLIBC, newest


def test_no_library_is_needed_that_every_system_does_not_have(library):
    dynamic = next(section for section in library.iter_sections() if isinstance(section, DynamicSection))
    assert {tag.needed for tag in dynamic.iter_tags("DT_NEEDED")} <= LIBRARIES
    # Thread-local destructors of an unloaded library would crash its host.
    assert next(dynamic.iter_tags("DT_FLAGS_1")).entry.d_val & NODELETE


def test_libraries_are_stripped_and_archives_small(library, packed):
    assert library.get_section_by_name(".symtab") is None
    assert not [section.name for section in library.iter_sections() if section.name.startswith(".debug")]
    assert packed.stat().st_size <= 4e6


def test_the_fmu_is_the_same(packed, fmu, tmp_path):
    usual, old = fmu(packed.stem), Fmu.open(packed, tmp_path)
    assert (old.folder / "modelDescription.xml").read_bytes() == (usual.folder / "modelDescription.xml").read_bytes()
    shown = []
    for each in (usual, old):
        with Instance(each).start() as instance:
            for tick in range(10):
                instance.step(0.04 * tick, 0.04)
            shown.append(instance.outputs())
    assert shown[0] == shown[1]
