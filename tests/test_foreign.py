"""FMUs as other makers write them, and as no one should: made from ours by changing the archive or its
XML. Damaged archives, paths, encodings and entities are tested in orchestrator/import and in
orchestrator/tests/program/malformed.rs."""

import struct
import subprocess
import zipfile

import numpy as np
import pytest

from conftest import EXPERIMENTS, TARGET, archive, merged, program
from test_ssp import columns

LAW = "LQR"
DESCRIPTION = "modelDescription.xml"


def entries(*changes: tuple[str, str]) -> dict[str, bytes]:
    """The entries of the archive with a changed description."""
    with zipfile.ZipFile(archive(LAW)) as file:
        files = {name: file.read(name) for name in file.namelist()}
    text = files[DESCRIPTION].decode()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    return files | {DESCRIPTION: text.encode()}


def run(tmp_path, files: dict[str, bytes] | None = None, more: tuple[str, bytes, int] | None = None, damage=lambda data: data):
    """Runs the closed loop of our plant and a law of these entries, and one more with its mode."""
    path = tmp_path / "fmu" / f"{LAW}.fmu"
    path.parent.mkdir()
    if files:
        with zipfile.ZipFile(path, "w") as file:
            for name, content in files.items():
                file.writestr(name, content)
            if more:
                name, content, mode = more
                info = zipfile.ZipInfo(name)
                info.create_system, info.external_attr = 3, mode << 16
                file.writestr(info, content)
        path.write_bytes(damage(path.read_bytes()))
    experiment = tmp_path / "x.toml"
    experiment.write_text(merged(EXPERIMENTS / "lqr.toml").replace("stop = 50.0", "stop = 4.0"))
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    command = [program("orchestrator"), "run", experiment, "--out", tmp_path / "out", "--quiet"]
    command += ["--fmu-dir", path.parent, "--fmu-dir", TARGET / "fmu"]
    environment = {"TMPDIR": str(temporary), "PATH": "/usr/bin:/bin"}
    finished = subprocess.run(command, capture_output=True, cwd=tmp_path, timeout=300, env=environment, text=True)
    # No temporary file stays behind, whatever happened.
    assert list(temporary.iterdir()) == []
    return finished


def test_what_others_write_is_run(tmp_path_factory):
    usual, other = (tmp_path_factory.mktemp(name) for name in ("usual", "other"))
    assert run(usual).returncode == 0
    files = entries(
        ("<fmiModelDescription ", '<fmiModelDescription xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:x="y" z="1" '),
        ("<ModelVariables>", '<VendorAnnotations><Tool name="t"><deep a="1"/></Tool></VendorAnnotations><Unknown><More/></Unknown><ModelVariables>'),
        ("<ModelVariables>", "<!-- <x> --><ModelVariables><!-- - -->"),
    )
    files = {name: content for name, content in files.items() if not name.startswith("resources/")}
    finished = run(other, {"binaries/": b"", "resources/": b""} | files)
    assert finished.returncode == 0, finished.stderr
    found = columns(other / "out")
    assert all(np.array_equal(found[column], values) for column, values in columns(usual / "out").items())


def lying(data: bytes) -> bytes:
    """The last entry declares 10 bytes and holds more."""
    changed = bytearray(data)
    for signature, offset in ((b"PK\x03\x04", 22), (b"PK\x01\x02", 24)):
        struct.pack_into("<I", changed, changed.rindex(signature) + offset, 10)
    return bytes(changed)


BAD = {
    "a link": ({"more": ("resources/link", b"/etc/passwd", 0o120777)}, "symbolic link"),
    "a lie about a size": ({"more": ("resources/large", b"y" * 100_000, 0o100644), "damage": lying}, ""),
    "an identifier with a zero byte": ({"change": ('modelIdentifier="LQR"', 'modelIdentifier="LQR&#0;"')}, ""),
    "an interface that its library lacks": ({"change": ("CoSimulation", "ModelExchange")}, "could not be instantiated"),
    "an index beyond the end": ({"change": ('<Unknown index="', '<Unknown index="9')}, "index 9"),
    "a number that is none": ({"change": ('stepSize="0.04"', 'stepSize="four"')}, DESCRIPTION),
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_hostile_or_broken_is_refused_in_one_line(name, tmp_path):
    options, culprit = BAD[name]
    change = options.get("change")
    files = entries(change) if change else entries()
    finished = run(tmp_path, files, options.get("more"), options.get("damage", bytes))
    assert finished.returncode == 2 and culprit in finished.stderr, finished.stderr
    assert finished.stderr.startswith("error: ") and finished.stderr.count("\n") == 1
    assert not (tmp_path / "out").exists()
