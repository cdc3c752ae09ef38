"""FMUs as other makers write them, and as no one should: made from ours by changing the archive or
its XML."""

import io
import struct
import subprocess
import zipfile

import numpy as np
import pytest

from conftest import EXPERIMENTS, TARGET, archive, merged, program
from test_ssp import columns

LAW = "LQR"
DESCRIPTION = "modelDescription.xml"
LIBRARY = f"binaries/linux64/{LAW}.so"


def entries() -> dict[str, bytes]:
    with zipfile.ZipFile(archive(LAW)) as file:
        return {name: file.read(name) for name in file.namelist()}


def changed(old: str, new: str, count: int = -1, **encoding) -> dict[str, bytes]:
    """Returns the entries of the archive with a changed description."""
    files = entries()
    text = files[DESCRIPTION].decode()
    assert old in text
    return files | {DESCRIPTION: text.replace(old, new, count).encode(**encoding)}


def write(path, files: dict[str, bytes]):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        for name, content in files.items():
            file.writestr(name, content)
    return path


def run(tmp_path, *arguments, change=lambda text: text):
    """Runs the closed loop of our plant and the LQR.fmu in the folder `fmu` below `tmp_path`. The
    temporary folder is below `temporary`."""
    experiment = tmp_path / "x.toml"
    experiment.write_text(change(merged(EXPERIMENTS / "lqr.toml")).replace("stop = 50.0", "stop = 4.0"))
    temporary = tmp_path / "temporary"
    temporary.mkdir(exist_ok=True)
    command = [program("orchestrator"), "run", experiment, "--out", tmp_path / "out", "--force", "--quiet", *arguments]
    command += ["--fmu-dir", tmp_path / "fmu", "--fmu-dir", TARGET / "fmu"]
    environment = {"TMPDIR": str(temporary), "PATH": "/usr/bin:/bin"}
    finished = subprocess.run(command, capture_output=True, cwd=tmp_path, timeout=60, env=environment)
    # No temporary file stays behind, whatever happened.
    assert list(temporary.iterdir()) == []
    return finished


@pytest.fixture(scope="module")
def usual(tmp_path_factory):
    folder = tmp_path_factory.mktemp("usual")
    assert run(folder).returncode == 0
    return columns(folder / "out")


def header(text: str) -> dict[str, bytes]:
    return changed("<fmiModelDescription ", f"<fmiModelDescription {text} ", 1)


GOOD = {
    "xmlns:xsi and unknown attributes": lambda: header('xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:x="y" z="1"'),
    "annotations": lambda: changed(
        "<ModelVariables>", '<VendorAnnotations><Tool name="t"><deep><deeper a="1"/></deep></Tool></VendorAnnotations><ModelVariables>'
    ),
    "elements no one knows": lambda: changed("<ModelVariables>", "<Unknown><More/></Unknown><ModelVariables>"),
    "comments and CDATA": lambda: changed("<ModelVariables>", "<!-- <x> --><ModelVariables><!-- - -->"),
    "Latin-1": lambda: changed('encoding="UTF-8"', 'encoding="ISO-8859-1"')
    | {
        DESCRIPTION: changed('encoding="UTF-8"', 'encoding="ISO-8859-1"')[DESCRIPTION]
        .decode()
        .replace("Linear-quadratic", "Linear-quadratischer Lageregler für")
        .encode("latin-1")
    },
    "a byte order mark": lambda: changed("<?xml", "\ufeff<?xml", 1),
    "UTF-16": lambda: changed('encoding="UTF-8"', 'encoding="UTF-16"', encoding="utf-16"),
    "no resources": lambda: {name: content for name, content in entries().items() if not name.startswith("resources/")},
    "entries for folders": lambda: {"binaries/": b"", "resources/": b""} | entries(),
    "deep annotations": lambda: changed(
        "<ModelVariables>", "<VendorAnnotations>" + "<a>" * 50_000 + "</a>" * 50_000 + "</VendorAnnotations><ModelVariables>"
    ),
}


@pytest.mark.parametrize("name", GOOD)
def test_what_others_write_is_run(name, tmp_path, usual):
    (tmp_path / "fmu").mkdir()
    write(tmp_path / "fmu" / f"{LAW}.fmu", GOOD[name]())
    finished = run(tmp_path)
    assert finished.returncode == 0, finished.stderr
    found = columns(tmp_path / "out")
    assert all(np.array_equal(found[column], values) for column, values in usual.items())


def with_entry(name: str, content: bytes = b"x", mode: int = 0o100644) -> bytes:
    """Returns the archive with a further entry, whose name is written unchanged."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as file:
        for own, own_content in entries().items():
            file.writestr(own, own_content)
        info = zipfile.ZipInfo("placeholder")
        info.create_system = 3
        info.external_attr = mode << 16
        info.filename = info.orig_filename = name
        file.writestr(info, content)
    return buffer.getvalue()


def packed(files: dict[str, bytes]) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as file:
        for name, content in files.items():
            file.writestr(name, content)
    return buffer.getvalue()


def twice(name: str) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as file:
        for own, content in entries().items():
            file.writestr(own, content)
        with pytest.warns(UserWarning):
            file.writestr(name, b"again")
    return buffer.getvalue()


def bomb() -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as file:
        for own, content in entries().items():
            file.writestr(own, content)
        with file.open("resources/zeros", "w", force_zip64=True) as zeros:
            for _ in range(1100):
                zeros.write(bytes(1 << 20))
    return buffer.getvalue()


def lying() -> bytes:
    """Writes an entry that declares 10 bytes and holds more."""
    data = bytearray(with_entry("resources/large", b"y" * 100_000))
    for signature, offset in ((b"PK\x03\x04", 22), (b"PK\x01\x02", 24)):
        place = data.rindex(b"resources/large", 0, None if signature == b"PK\x01\x02" else data.rindex(b"PK\x01\x02"))
        start = data.rindex(signature, 0, place)
        struct.pack_into("<I", data, start + offset, 10)
    return bytes(data)


HEAD = '<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;">]>'
# Damaged archives and wrong descriptions are tested in orchestrator/tests/program/malformed.rs.
BAD = {
    "a drive": (lambda: with_entry("C:/evil"), "absolute"),
    "a link": (lambda: with_entry("resources/link", b"/etc/passwd", 0o120777), "symbolic link"),
    "an entry twice": (lambda: twice(DESCRIPTION), "same name"),
    "a bomb": (bomb, "unpacks to more than"),
    "a lie about a size": (lying, ""),
    "an entity that is used": (
        lambda: packed(entries() | {DESCRIPTION: (HEAD + '<fmiModelDescription fmiVersion="2.0" guid="&b;"/>').encode()}),
        DESCRIPTION,
    ),
    "an encoding no one knows": (lambda: packed(changed('encoding="UTF-8"', 'encoding="klingon"')), "klingon"),
    "bytes of another encoding": (
        lambda: packed(entries() | {DESCRIPTION: entries()[DESCRIPTION].replace(b"Linear", b"\xfcber")}),
        "UTF-8",
    ),
    "an identifier with a zero byte": (lambda: packed(changed('modelIdentifier="LQR"', 'modelIdentifier="LQR&#0;"')), None),
    "an interface that its library lacks": (lambda: packed(changed("CoSimulation", "ModelExchange")), "could not be instantiated"),
    "an index beyond the end": (lambda: packed(changed('<Unknown index="', '<Unknown index="9', 1)), "variable 9"),
    "a number that is none": (lambda: packed(changed('stepSize="0.04"', 'stepSize="four"')), DESCRIPTION),
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_hostile_or_broken_is_refused_in_one_line(name, tmp_path):
    make, culprit = BAD[name]
    (tmp_path / "fmu").mkdir()
    (tmp_path / "fmu" / f"{LAW}.fmu").write_bytes(make())
    before = sorted(path for path in tmp_path.rglob("*") if "temporary" not in path.parts)
    finished = run(tmp_path)
    message = finished.stderr.decode()
    assert finished.returncode == 2, message
    if culprit is not None:
        assert culprit in message, message
    assert message.startswith("error: ") and message.count("\n") == 1 and "panicked" not in message
    after = sorted(path for path in tmp_path.rglob("*") if "temporary" not in path.parts)
    assert set(after) - set(before) <= {tmp_path / "x.toml", tmp_path / "temporary"}


def test_units_are_converted_only_when_asked(tmp_path, usual):
    """The description is changed as if the law took its angles in thousandths of a radian."""
    (tmp_path / "fmu").mkdir()
    write(tmp_path / "fmu" / f"{LAW}.fmu", changed('<BaseUnit rad="1"/>', '<BaseUnit rad="1" factor="0.001"/>'))

    def other(text: str) -> str:
        return text.replace('to = "controller.attitude.*"', 'to = "controller.attitude.*"\nconvert_units = true')

    finished = run(tmp_path)
    assert finished.returncode == 2 and b"convert_units = true" in finished.stderr
    finished = run(tmp_path, "--stop", "0.04", change=other)
    assert finished.returncode == 0, finished.stderr
    found = columns(tmp_path / "out")
    # At the start the moment is that of angles a thousand times as large.
    start = {axis: found[f"controller.moment.{axis}"][0] for axis in "xyz"}
    assert any(abs(start[axis]) > 100.0 * abs(usual[f"controller.moment.{axis}"][0]) for axis in "xyz")
