"""Every FMU in hosts that differ from the usual one: an importer in C, tests/platforms/host.c, whose
process has another floating-point environment, a small stack, another locale, no /proc or no home
must get the same bits. And an importer in C++ whose logger throws goes on.
"""

from __future__ import annotations

import ctypes
import json
import os
import shutil
import subprocess
from functools import cache
from pathlib import Path

import pytest

from conftest import ROOT, TARGET
from fmi import NOT_REPRODUCIBLE

FMUS = sorted(path.stem for path in (TARGET / "fmu").glob("*.fmu"))
STEPS = 250
ENVIRONMENTS = [
    "traps",
    "upward",
    "downward",
    "towardzero",
    "flush",
    "precision",
    "pending",
    "flags",
    "traps+upward+flush",
    "stack",
    "traps+stack",
]


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """Compiles a host once."""
    folder = tmp_path_factory.mktemp("hosts")

    def build(source: str) -> Path:
        compiler = "c++" if source.endswith("cpp") else "cc"
        if not shutil.which(compiler):
            pytest.skip(f"there is no {compiler}")
        host = folder / source.partition(".")[0]
        if not host.is_file():
            subprocess.run([compiler, "-O1", ROOT / "tests" / "platforms" / source, "-o", host, "-ldl", "-lm", "-lpthread"], check=True)
        return host

    return build


@pytest.fixture(scope="module")
def parts(fmu):
    """Library, GUID and resources of an FMU, as the hosts take them."""

    def of(name: str) -> list:
        opened = fmu(name)
        [library] = opened.folder.glob("binaries/linux64/*.so")
        return [library, opened.description.guid, (opened.folder / "resources").as_uri()]

    return of


@pytest.fixture(scope="module")
def flown(built, fmu, parts):
    """Output of the host about an FMU in an environment, on stdout and stderr."""
    done = {}

    def fly(name: str, environment: str, *around: object, **variables: str) -> tuple[list[str], str]:
        if (key := (name, environment, around)) not in done or variables:
            opened = fmu(name)
            shown = [n for n in opened.names("output") if opened.variables[n].type == "Real" and n not in NOT_REPRODUCIBLE]
            outputs = [opened.variables[n].valueReference for n in shown]
            command = [*around, built("host.c"), environment, *parts(name), STEPS, *outputs]
            result = subprocess.run([str(part) for part in command], capture_output=True, text=True, timeout=120, env=variables or None)
            assert result.returncode == 0, (result.returncode, result.stderr)
            lines = result.stdout.splitlines()
            if not NOT_REPRODUCIBLE.isdisjoint(opened.variables):
                # Its states hold computing times.
                lines = [line for line in lines if not line.startswith("state")]
            done[key] = (lines, result.stderr)
        return done[key]

    return fly


def test_there_are_fmus():
    assert len(FMUS) >= 12


@pytest.mark.parametrize("environment", ENVIRONMENTS)
@pytest.mark.parametrize("name", FMUS)
def test_every_environment_gives_the_same_bits(flown, name, environment):
    usual, _ = flown(name, "usual")
    assert len(usual) > STEPS * 3 // 2 and len(set(usual)) > 20
    assert flown(name, environment)[0] == usual


@pytest.mark.parametrize("name", FMUS)
def test_a_state_gives_the_bits_that_followed_it(flown, name):
    lines, _ = flown(name, "usual")
    assert lines[-STEPS // 2 :] == lines[-STEPS : -STEPS // 2]


@pytest.mark.parametrize("name", FMUS)
def test_every_choice_of_a_parameter_needs_little_stack(built, fmu, parts, name):
    """A stack that is used up ends the host by a signal; code 4 is that of a choice that is refused."""
    opened = fmu(name)
    for variable in opened.description.modelVariables:
        if variable.causality != "parameter" or variable.type not in ("Boolean", "Enumeration"):
            continue
        values = [item.value for item in variable.declaredType.items] if variable.type == "Enumeration" else [0, 1]
        for value in values:
            word = f"{'b' * (variable.type == 'Boolean')}{variable.valueReference}={value}"
            command = [built("host.c"), f"stack+traps+{word}", *parts(name), 20]
            done = subprocess.run([str(part) for part in command], capture_output=True, text=True, timeout=60)
            assert done.returncode in (0, 4), (variable.name, value, done.returncode, done.stderr)


@pytest.mark.parametrize("name", FMUS)
def test_a_host_without_proc_and_home_gets_the_same_bits(flown, name):
    if subprocess.run(["unshare", "-Urm", "mount", "-t", "tmpfs", "none", "/proc"], capture_output=True).returncode != 0:
        pytest.skip("namespaces are not permitted here")
    around = ("unshare", "-Urm", "sh", "-c", 'mount -t tmpfs none /proc && ! [ -e /proc/self ] && exec "$@"', "sh")
    assert flown(name, "usual", *around, PATH=os.environ["PATH"]) == flown(name, "usual")


@pytest.mark.parametrize("name", FMUS)
def test_a_decimal_comma_changes_nothing(flown, name, tmp_path_factory):
    folder = tmp_path_factory.getbasetemp() / "locale"
    if not folder.is_dir() and shutil.which("localedef"):
        folder.mkdir()
        subprocess.run(["localedef", "--no-archive", "-i", "de_DE", "-f", "UTF-8", folder / "de_DE.UTF-8"], capture_output=True)
    if not (folder / "de_DE.UTF-8").is_dir():
        pytest.skip("the locale cannot be made: it needs the package locales")
    variables = {"LOCPATH": str(folder), "LC_ALL": "de_DE.UTF-8"}
    assert flown(name, "locale", **variables)[0] == flown(name, "usual")[0]


@cache
def linked_here() -> dict[str, Path]:
    """The newest library of each FMU as this system's linker makes it. Shipped libraries for Linux hold
    an unwinder of their own, which does not know the exceptions of others."""
    found = {}
    for crate in ("fmu_plant_library", "fmu_optimising", "fmu_feedback"):
        candidates = [TARGET / folder / f"lib{crate}.so" for folder in ("debug", "debug/deps", "release")]
        for path in sorted(filter(Path.is_file, candidates), key=lambda path: path.stat().st_mtime):
            describe = ctypes.CDLL(str(path)).fmu_model_descriptions
            describe.restype = ctypes.c_char_p
            found |= {description["name"]: path for description in json.loads(describe())}
    return found


@pytest.mark.parametrize("name", FMUS)
def test_an_exception_of_the_logger_reaches_the_importer(built, parts, name):
    if name not in linked_here():
        pytest.skip("no library was linked by this system's linker")
    _, *others = parts(name)
    done = subprocess.run([built("throwing_host.cpp"), linked_here()[name], *others], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout) == (0, "fine\n"), done.stderr
