"""docs/errata.md names a test for each of its claims, and docs/symbols.md names only variables that
exist."""

import re
import xml.etree.ElementTree as ET
import zipfile

import pytest

import named
from conftest import ROOT, TARGET, tomllib



def tables(page: str) -> list[tuple[list[str], list[list[str]]]]:
    """Returns every table of a page: its header and its rows, cell by cell."""
    found: list[tuple[list[str], list[list[str]]]] = []
    inside = False
    for line in (ROOT / "docs" / page).read_text(encoding="utf-8").splitlines():
        if not line.startswith("|"):
            inside = False
            continue
        cells = [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]]
        if not inside:
            found.append((cells, []))
        elif not all(re.fullmatch(r":?-+:?", cell) for cell in cells):
            found[-1][1].append(cells)
        inside = True
    return found


def quoted(cell: str) -> list[str]:
    """Returns the texts between backticks."""
    return re.findall(r"`([^`]+)`", cell)


# errata.md

ROWS = [(header, cells) for header, rows in tables("errata.md") for cells in rows]


@pytest.mark.parametrize("cells", [cells for _, cells in ROWS], ids=[cells[0] for _, cells in ROWS])
def test_every_erratum_has_a_test_that_exists(cells):
    tests = quoted(cells[-1])
    assert tests or cells[-1] == "the same", "no test"
    for test in tests:
        assert named.exists(test), f"there is no test {test}"


# symbols.md


@pytest.fixture(scope="module")
def variables() -> set[str]:
    """The names of the variables of all FMUs, of what a file sets of them, and of what a file of a vehicle has."""
    found: set[str] = set()
    for archive in (TARGET / "fmu").glob("*.fmu"):
        page = zipfile.ZipFile(archive).read("documentation/index.html").decode()
        found.update(re.findall(r"<code>([^<]+)</code>", page))
    for text in (ROOT / "vehicle" / "data").glob("*.toml"):
        for section, values in tomllib.loads(text.read_text("utf-8")).items():
            found.add(f"[{section}]")
            found.update(f"{section}.{key}" for key in (values if isinstance(values, dict) else []))
    for path in ROOT.glob("fmu-*/generated/*.xml"):
        found.update(variable.get("name") for variable in ET.parse(path).iter("ScalarVariable"))
    return found


def spelled_out(names: list[str]) -> list[str]:
    """Expands `a.x/y` to a.x and a.y, and an index alone to that index of the name before it."""
    result: list[str] = []
    for name in names:
        if re.fullmatch(r"\[\d+\]", name):
            result.append(re.sub(r"\[\d+\]$", name, result[-1]))
            continue
        stem, dot, last = name.rpartition(".")
        result += [stem + dot + part for part in last.split("/")]
    return result


FMI_NAMES = [
    name
    for header, rows in tables("symbols.md")
    if "FMI" in header
    for cells in rows
    for name in spelled_out(quoted(cells[header.index("FMI")]))
]


@pytest.mark.parametrize("name", FMI_NAMES)
def test_every_fmi_name_of_the_symbols_exists(name, variables):
    if name.endswith(".*"):
        assert any(variable.startswith(name[:-1]) for variable in variables)
    else:
        assert name in variables
