"""The packages of all platforms (scripts/package): what is in them, and that they compute the same.

Windows runs under Wine, Linux on aarch64 under qemu. The binaries of macOS are only read.
"""

import hashlib
import os
import pty
import shutil
import struct
import subprocess
import zipfile
from pathlib import Path

import lief
import pytest

import conftest
from conftest import NAMES, ROOT, TARGET, archive, merged, program
from fmi import NOT_REPRODUCIBLE, Fmu

DIST = TARGET / "dist"
FOLDERS = {
    "all": {"linux64": "so", "win64": "dll", "darwin64": "dylib"},
    "linux-x86_64": {"linux64": "so"},
    "linux-aarch64": {"linux64": "so", "aarch64-linux": "so"},
    "windows-x86_64": {"win64": "dll"},
    "macos-universal": {"darwin64": "dylib"},
    "macos-x86_64": {"darwin64": "dylib"},
    "macos-aarch64": {"darwin64": "dylib"},
}


def marked(platforms) -> list:
    """Parameters of a test, one for each platform."""
    tier = lambda platform: "windows" if platform.startswith("windows") else "platforms"  # noqa: E731
    return [pytest.param(platform, marks=pytest.mark.tier(tier(platform))) for platform in platforms]


# Every file of an experiment that `run` takes: no parts, studies, campaigns or tables of published numbers.
PARTS = ("any", "any-allocated", "study", "published", "computed")
EXPERIMENTS = [
    path
    for path in sorted((ROOT / "orchestrator" / "experiments").glob("*/*.toml"))
    if path.parent.name not in ("base", "campaigns") and path.stem not in PARTS
]
# Libraries of macOS 11.
MACOS = {
    "/usr/lib/libSystem.B.dylib",
    "/System/Library/Frameworks/CoreFoundation.framework/Versions/A/CoreFoundation",
}
MACOS_VERSION = [11, 0, 0]

# An experiment with the FMU of the orchestrator's own tests.
ONE_COMPONENT = """
title = "one component"
simulation = { stop = 4.0, step = 1.0 }
components.model = { fmu = "Model.fmu", unconnected = ["*"] }
record.variables = ["model.steps"]
"""

pytestmark = pytest.mark.skipif(not DIST.is_dir(), reason="no packages: run scripts/package")
# Programs that run under an emulator. scripts/package makes the programs, the tests of a change only FMUs.
PROGRAMS = {"windows-x86_64": "orchestrator.exe", "linux-aarch64": "orchestrator"}


def packed(platform: str, name: str):
    # Where only another platform was packed, it is compared with the FMUs that are tested here.
    if platform == "linux-x86_64" and not (DIST / platform).is_dir():
        return archive(name)
    if not (DIST / platform).is_dir():
        pytest.skip(f"no package for {platform}: run scripts/package")
    path = DIST / platform / "fmu" / f"{name}.fmu"
    assert path.is_file(), f"{path} does not exist: run scripts/package"
    return path


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("platform", marked(FOLDERS))
def test_an_archive_holds_its_platforms_and_the_same_description(platform, name):
    with zipfile.ZipFile(packed(platform, name)) as archive:
        binaries = {file for file in archive.namelist() if file.startswith("binaries/")}
        description = archive.read("modelDescription.xml")
    assert binaries == {f"binaries/{folder}/{name}.{suffix}" for folder, suffix in FOLDERS[platform].items()}
    [committed] = ROOT.glob(f"fmu-*/generated/{name}.xml")
    assert description == committed.read_bytes()
    assert packed(platform, name).stat().st_size <= 4e6


@pytest.fixture(scope="module", params=["ReentryPlant", "CRMPC", "LQR"])
def library(request):
    """Reads the library of an FMU for a platform: one FMU of each library."""

    def read(platform: str) -> bytes:
        [(folder, suffix)] = FOLDERS[platform].items()
        with zipfile.ZipFile(packed(platform, request.param)) as archive:
            return archive.read(f"binaries/{folder}/{request.param}.{suffix}")

    return read


# The objects of lief are kept in names, as their parts do not keep the whole alive. That libraries need nothing but the
# system, and export the same functions on every platform, fmu-pack holds.


@pytest.mark.tier("platforms")
def test_linux_may_be_as_old_as_promised_and_never_unloads_a_library(library):
    linux = lief.ELF.parse(list(library("linux-x86_64")))
    versions = {each.name for needed in linux.symbols_version_requirement for each in needed.get_auxiliary_symbols()}
    # CentOS 7 and manylinux2014 have glibc 2.17.
    assert versions and max(tuple(map(int, name.removeprefix("GLIBC_").split("."))) for name in versions) <= (2, 17)
    # Thread-local destructors of an unloaded library would crash its host.
    assert linux.get(lief.ELF.DynamicEntry.TAG.FLAGS_1).has(lief.ELF.DynamicEntryFlags.FLAG.NODELETE)
    assert len({symbol.name for symbol in linux.exported_symbols}) == 44 + 75 + 2
    assert not [section.name for section in linux.sections if section.name.startswith((".symtab", ".debug"))]


def signed(slice_: bytes) -> bool:
    """Whether the ad-hoc signature of a single-architecture Mach-O file covers its content: every
    page has the hash that the signature's code directory says."""
    commands = struct.unpack_from("<I", slice_, 16)[0]
    at = 32
    for _ in range(commands):
        kind, size = struct.unpack_from("<II", slice_, at)
        if kind == 0x1D:  # LC_CODE_SIGNATURE
            break
        at += size
    else:
        return False
    offset = struct.unpack_from("<I", slice_, at + 8)[0]
    magic, _, blobs = struct.unpack_from(">III", slice_, offset)
    assert magic == 0xFADE0CC0
    index = dict(struct.unpack_from(">II", slice_, offset + 12 + 8 * i) for i in range(blobs))
    directory = offset + index[0]
    magic, _, _, flags, hashes, _, _, pages, limit = struct.unpack_from(">IIIIIIIII", slice_, directory)
    hash_size, hash_type, _, page = struct.unpack_from(">BBBB", slice_, directory + 36)
    assert magic == 0xFADE0C02 and flags & 0x2 and (hash_size, hash_type) == (32, 2)
    assert limit == offset and pages == -(-limit // (1 << page))
    for i in range(pages):
        content = slice_[i << page : min((i + 1) << page, limit)]
        at = directory + hashes + hash_size * i
        if hashlib.sha256(content).digest() != slice_[at : at + hash_size]:
            return False
    return True


def slices(universal: bytes) -> list[bytes]:
    magic, count = struct.unpack_from(">II", universal)
    assert magic == 0xCAFEBABE
    entries = [struct.unpack_from(">IIIII", universal, 8 + 20 * i) for i in range(count)]
    assert all(offset % (1 << alignment) == 0 for _, _, offset, _, alignment in entries)
    return [universal[offset : offset + size] for _, _, offset, size, _ in entries]


def check_macos(universal: bytes):
    found = set()
    for content in slices(universal):
        parsed = lief.MachO.parse(list(content))
        binary = parsed.at(0)
        found.add(binary.header.cpu_type)
        libraries = {each.name for each in binary.libraries if each.command != lief.MachO.LoadCommand.TYPE.ID_DYLIB}
        assert libraries <= MACOS
        least = binary.build_version.minos if binary.has_build_version else binary.version_min.version
        assert least <= MACOS_VERSION
        # Only Apple's processors refuse code without a signature.
        if binary.header.cpu_type == lief.MachO.Header.CPU_TYPE.ARM64:
            assert signed(content)
            broken = bytearray(content)
            broken[5000] ^= 1
            assert not signed(bytes(broken))
    assert found == {lief.MachO.Header.CPU_TYPE.ARM64, lief.MachO.Header.CPU_TYPE.X86_64}


@pytest.mark.tier("platforms")
def test_macos_has_both_processors_signed_and_needs_nothing_but_macos(library):
    check_macos(library("macos-universal"))


@pytest.mark.tier("platforms")
def test_the_orchestrator_of_macos_has_both_processors_signed():
    program = DIST / "macos-universal" / "orchestrator"
    if not program.is_file():
        pytest.skip("no orchestrator for macOS: run scripts/package")
    check_macos(program.read_bytes())


@pytest.mark.parametrize("platform", marked(["linux-x86_64", "windows-x86_64", "macos-universal"]))
def test_no_path_of_the_build_is_in_a_binary(library, platform):
    content = library(platform)
    assert str(ROOT).encode() not in content
    assert os.path.expanduser("~").encode() + b"/.cargo" not in content


# Names of zig for the platforms that the tests run; Linux as old as the packages promise.
ZIG = {
    "linux-x86_64": "x86_64-linux-gnu.2.17",
    "linux-aarch64": "aarch64-linux-gnu.2.17",
    "windows-x86_64": "x86_64-windows-gnu",
}


def compiled(platform: str, source: str | Path, to: Path, *arguments: str) -> Path:
    """Compiles a program or library in C for a platform."""
    compiler = [TARGET / "zig" / "bin" / "python", "-m", "ziglang", "cc", "-target", ZIG[platform], "-s"]
    subprocess.run([*compiler, ROOT / "tests" / "platforms" / source, "-o", to, *arguments], check=True)
    return to


@pytest.fixture(scope="session")
def wine(tmp_path_factory):
    """Command and environment that run a program for Windows."""
    if not shutil.which("wine"):
        pytest.skip("wine is not installed: scripts/install-tools emulators")
    environment = os.environ | {
        "WINEPREFIX": str(tmp_path_factory.mktemp("wine")),
        "WINEDEBUG": "-all",
        "DISPLAY": "",
        # Wine 8 lacks ProcessPrng, which Windows has since version 10.
        "WINEDLLOVERRIDES": "bcryptprimitives=n;mscoree,mshtml=",
    }
    subprocess.run(["wineboot", "--init"], env=environment, capture_output=True, check=True, timeout=120)
    stand_in = Path(environment["WINEPREFIX"], "drive_c", "windows", "system32", "bcryptprimitives.dll")
    stand_in.unlink(missing_ok=True)
    compiled("windows-x86_64", "process_prng.c", stand_in, "-shared", "-ladvapi32")
    yield ["wine"], environment
    subprocess.run(["wineserver", "--kill"], env=environment, capture_output=True)


@pytest.fixture(scope="session")
def qemu():
    """Command and environment that run a program for Linux on aarch64."""
    if not shutil.which("qemu-aarch64"):
        pytest.skip("qemu-aarch64 is not installed: scripts/install-tools emulators")
    return ["qemu-aarch64", "-L", "/usr/aarch64-linux-gnu"], dict(os.environ)


@pytest.fixture(params=marked(PROGRAMS))
def foreign(request):
    """The name of another platform, and what runs its programs."""
    emulator, environment = request.getfixturevalue("wine" if request.param.startswith("windows") else "qemu")

    def run(*command, **options):
        return subprocess.run([*emulator, *command], env=environment, capture_output=True, timeout=300, **options)

    return request.param, run


def orchestrator(platform: str) -> Path:
    path = DIST / platform / PROGRAMS[platform]
    if not path.is_file():
        pytest.skip(f"no orchestrator for {platform}: run scripts/package")
    return path


def driven(variable) -> str:
    """An input as an argument of the importer in C: its reference, and limits to jump between, near
    its start value so that sensors are believed."""
    start = float(variable.start)
    low, high = (start + sign * 0.05 * max(abs(start), 0.2) for sign in (-1.0, 1.0))
    low = low if variable.min is None else max(low, float(variable.min))
    high = high if variable.max is None else min(high, float(variable.max))
    return f"{variable.valueReference}:{low}:{high}"


@pytest.fixture(scope="session")
def importer(tmp_path_factory):
    """Command that runs an FMU of a platform in the importer in C, without its emulator."""
    folder = tmp_path_factory.mktemp("importer")

    def command(platform: str, name: str) -> list:
        program = folder / f"{platform}.exe"
        if not program.is_file():
            compiled(platform, "importer.c", program, *([] if platform.startswith("windows") else ["-ldl"]))
        fmu = Fmu.open(packed(platform, name), folder / platform / name)
        [library] = fmu.folder.glob("binaries/*64/*")
        shown = [n for n in fmu.names("output") if fmu.variables[n].type == "Real" and n not in NOT_REPRODUCIBLE]
        outputs = [fmu.variables[n].valueReference for n in shown]
        inputs = [driven(fmu.variables[n]) for n in fmu.names("input") if fmu.variables[n].type == "Real"]
        resources = (fmu.folder / "resources").as_uri()
        command = [program, library, fmu.description.guid, resources, 250, *inputs, "--", *outputs]
        return [str(part) for part in command]

    return command


@pytest.mark.parametrize("name", NAMES)
def test_oracle_every_fmu_gives_the_same_bits_in_an_importer_in_c(foreign, importer, name):
    platform, run = foreign
    here = subprocess.run(importer("linux-x86_64", name), capture_output=True, timeout=60)
    assert here.returncode == 0, here.stderr.decode()
    rows = here.stdout.decode().split("\n")
    assert len(rows) == 251 and len(set(rows)) > 50
    there = run(*importer(platform, name))
    assert there.returncode == 0, there.stderr.decode(errors="replace")
    assert there.stdout.decode().split() == here.stdout.decode().split()


def native(*arguments, **options):
    command = [program("orchestrator"), *arguments]
    return subprocess.run(command, capture_output=True, timeout=120, **options)


@pytest.mark.tier("platforms")
@pytest.mark.parametrize("experiment", EXPERIMENTS, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_oracle_every_platform_computes_the_same_bits(foreign, experiment, tmp_path):
    """Times of computation are not recorded in results.csv; everything else is compared."""
    fmus = DIST / "linux-x86_64" / "fmu"
    here = native("run", experiment, "--out", tmp_path / "here", "--fmu-dir", fmus, "--quiet")
    platform, run = foreign
    own = [orchestrator(platform), "run", experiment, "--fmu-dir", DIST / platform / "fmu"]
    there = run(*own, "--out", tmp_path / "there", "--quiet")
    # These lose the attitude, which ends the run early and keeps what was recorded.
    is_lost = experiment.stem in ("printed", "two-loop-smc-allocated")
    assert here.returncode == (3 if is_lost else 0), here.stderr.decode()
    assert there.returncode == here.returncode, there.stderr.decode(errors="replace")
    expected = (tmp_path / "here" / "results.csv").read_bytes()
    assert len(expected) > 10_000
    assert (tmp_path / "there" / "results.csv").read_bytes() == expected


@pytest.mark.tier("platforms")
def test_windows_takes_spaces_letters_backslashes_and_drive_letters(wine, tmp_path):
    """The experiment stands in a folder whose path is long, has spaces and letters that are not
    ASCII, and its lines end as those of Windows do."""
    folder = tmp_path / ("Flüge über 再突入 " + "x" * 100) / ("y" * 100)
    folder.mkdir(parents=True)
    assert len(str(folder)) > 260
    text = merged(ROOT / "orchestrator" / "experiments" / "crmpc-2022" / "crmpc-robust.toml")
    (folder / "loop.toml").write_bytes(text.replace("\n", "\r\n").encode())
    for name in ("ReentryPlant", "CRMPC"):
        shutil.copy(packed("all", name), folder)
    emulator, environment = wine
    own = orchestrator("windows-x86_64")
    experiment, out = ("Z:" + str(folder / name).replace("/", "\\") for name in ("loop.toml", "out"))
    command = [*emulator, own, "run", experiment, "--out", out, "--stop", "2", "--quiet"]
    there = subprocess.run(command, env=environment, capture_output=True, timeout=120)
    assert there.returncode == 0, there.stderr.decode(errors="replace")
    native("run", folder / "loop.toml", "--stop", "2", "--quiet", "--out", tmp_path / "here", cwd=folder)
    written = (folder / "out" / "results.csv").read_bytes()
    assert written == (tmp_path / "here" / "results.csv").read_bytes()


@pytest.mark.tier("platforms")
@pytest.mark.parametrize(
    ("how", "together"),
    [
        ("EXIT", "(exit)"),
        ("ABORT", "(SIGABRT)"),
        ("SEGFAULT", "(SIGSEGV)"),
    ],
)
def test_an_instance_that_ends_its_process_on_windows_is_named(wine, tmp_path, how, together):
    """The instance harms the process of the program in its third step."""
    emulator, environment = wine
    model = ROOT / "orchestrator" / "tests" / "model"
    library = compiled("windows-x86_64", model / "model.c", tmp_path / "model.dll", "-shared", "-DPLACE=STEP", f"-DHOW={how}")
    with zipfile.ZipFile(tmp_path / "Model.fmu", "w") as archive:
        archive.write(model / "modelDescription.xml", "modelDescription.xml")
        archive.write(library, "binaries/win64/model.dll")
    (tmp_path / "one.toml").write_text(ONE_COMPONENT)
    command = [*emulator, orchestrator("windows-x86_64"), "run", "one.toml", "--quiet", "--force"]
    options = {"env": environment, "capture_output": True, "timeout": 120, "cwd": tmp_path}
    there = subprocess.run(command, **options)
    assert there.returncode == 1 and f"model ended this process in doStep {together}" in there.stderr.decode()


@pytest.mark.tier("platforms")
def test_ctrl_c_on_windows_ends_a_run_and_keeps_its_results(wine, tmp_path):
    emulator, environment = wine
    compiled("windows-x86_64", "press_ctrl_c.c", tmp_path / "press.exe")
    own = orchestrator("windows-x86_64")
    experiment = ROOT / "orchestrator" / "experiments" / "crmpc-2022" / "lqr.toml"
    fmus = DIST / "windows-x86_64" / "fmu"
    run = f"Z:{own} run Z:{experiment} --fmu-dir Z:{fmus} --out Z:{tmp_path}/out --real-time --quiet"
    # A program for the console has one only if the test gives it a terminal.
    _, terminal = pty.openpty()
    command = [*emulator, tmp_path / "press.exe", run.replace("/", "\\")]
    ended = subprocess.run(command, env=environment, stdin=terminal, stdout=terminal, stderr=terminal, timeout=120)
    assert ended.returncode == 130
    rows = (tmp_path / "out" / "results.csv").read_text().splitlines()
    # In step with the clock, five seconds have at most 126 rows below the heading.
    assert 10 < len(rows) < 140


@pytest.mark.tier("windows")
@pytest.mark.parametrize(
    "old, new, words",
    [
        (None, b"0" * 64, "was built from other sources"),
        (b"KERNEL32.dll", b"KERNEL99.dll", "needs kernel99.dll, which not every system has"),
        (b"fmi2GetReal\0", b"fmi2GetReaf\0", "its exported functions differ: "),
        (b"MZ", b"ZM", "Unknown file magic"),
    ],
    ids=["sources", "imports", "exports", "format"],
)
def test_a_library_that_does_not_belong_to_the_others_is_refused(old, new, words, tmp_path):
    host, other = conftest.library("fmu_plant_library"), TARGET / "x86_64-pc-windows-gnullvm/release/fmu_plant_library.dll"
    content = other.read_bytes()
    if old is None:
        windows = lief.PE.parse(list(content))
        [old] = [bytes(section.content)[:64] for section in windows.sections if section.name == ".fmi2src"]
    assert content.count(old) >= 1
    changed = tmp_path / "changed.dll"
    changed.write_bytes(content.replace(old, new))
    command = [program("fmu-pack"), host, "--also", changed, "--output", tmp_path]
    refused = subprocess.run(command, capture_output=True, text=True)
    assert refused.returncode == 1
    assert "changed.dll" in refused.stderr and words in refused.stderr
    command[3] = other
    assert subprocess.run(command, capture_output=True).returncode == 0
    command[3] = host
    same = subprocess.run(command, capture_output=True, text=True)
    assert same.returncode == 1 and "is for the same platform as" in same.stderr
