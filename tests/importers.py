"""The table of docs/use-it.md, made from the outcomes of the tests that are marked
`importer`."""

from __future__ import annotations

import importlib.metadata
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "use-it.md"
BEGIN, END = "<!-- From here on: scripts/update-generated -->\n", "<!-- Up to here: scripts/update-generated -->\n"
FINDINGS = pytest.StashKey()
# Importers in the order of the table, by the name that the marks use: the title, and the source
# of its version.
IMPORTERS = {
    "orchestrator": ("orchestrator", None),
    "FMPy": ("FMPy", "fmpy"),
    "libcosimpy": ("libcosim (libcosimpy)", "libcosimpy"),
    "fmi-sim": ("fmi-sim", ROOT / "scripts" / "environment.sh"),
    "fmi-rs": ("fmi-rs", ROOT / "Cargo.lock"),
    "fmu-manipulation-toolbox": ("FMU Manipulation Toolbox", "fmu-manipulation-toolbox"),
}
VERSIONS = {"fmi-sim": r"^fmi_sim=(\S+)$", "fmi-rs": r'^name = "fmi-rs"\nversion = "(\S+)"$'}


class Findings:
    def __init__(self, fmus: list[str]):
        self.fmus = fmus
        # Marks and FMUs of each test, by the test's identifier.
        self.expected: dict[str, tuple[pytest.Mark, list[str]]] = {}
        self.outcomes: dict[str, str] = {}
        self.files: set[Path] = set()

    def expect(self, items) -> None:
        for item in items:
            self.files.add(item.path)
            mark = item.get_closest_marker("importer")
            if mark:
                name = mark.kwargs.get("fmu") or item.callspec.params["name"]
                self.expected[item.nodeid] = mark, [name] + ["ReentryPlant"] * mark.kwargs.get("plant", False)

    def note(self, item, outcome: str) -> None:
        if item.nodeid in self.expected:
            # A test whose setup or teardown failed has failed.
            if self.outcomes.get(item.nodeid) != "failed":
                self.outcomes[item.nodeid] = outcome

    def missing(self) -> str | None:
        """Says why the table cannot be made, or returns None if it can."""
        missing = files() - self.files
        if missing:
            return f"{', '.join(sorted(path.name for path in missing))} did not run"
        not_run = [test for test in self.expected if self.outcomes.get(test, "skipped") == "skipped"]
        return f"{len(not_run)} tests of importers did not run, as {not_run[0]}" if not_run else None

    def table(self) -> str:
        rows: dict[tuple[str, str], tuple[pytest.Mark, dict[str, bool]]] = {}
        for test, (mark, fmus) in self.expected.items():
            _, cells = rows.setdefault(mark.args, (mark, {}))
            for fmu in fmus:
                cells[fmu] = cells.get(fmu, True) and self.outcomes[test] == "passed"
        lines = ["| importer | use | " + " | ".join(f"`{fmu}`" for fmu in self.fmus) + " | found | compared with |", "|---" * (len(self.fmus) + 4) + "|"]
        for importer in IMPORTERS:
            for (_, use), (mark, cells) in ((key, row) for key, row in rows.items() if key[0] == importer):
                marks = [{True: "✓", False: "**fails**"}.get(cells.get(fmu), "–") for fmu in self.fmus]
                lines.append(f"| {title(importer)} | {use} | {' | '.join(marks)} | {found(mark)} |")
        return "\n".join(lines) + "\n"

    def write(self) -> None:
        reason = self.missing()
        if reason:
            raise pytest.UsageError(f"docs/use-it.md stays as it is: {reason}")
        before, _, after = split()
        PAGE.write_text(before + BEGIN + "\n" + self.table() + "\n" + END + after)


def files() -> set[Path]:
    """The files whose tests fill the table."""
    return {path for path in Path(__file__).parent.glob("test_*.py") if "mark.importer(" in path.read_text()}


def split() -> tuple[str, str, str]:
    """Splits the page into the parts before, in and after the table."""
    before, rest = PAGE.read_text().split(BEGIN)
    table, after = rest.split(END)
    return before, table.strip() + "\n", after


def title(importer: str) -> str:
    name, source = IMPORTERS[importer]
    if source is None:
        return name
    if isinstance(source, str):
        return f"{name} {importlib.metadata.version(source)}"
    return f"{name} {re.search(VERSIONS[importer], source.read_text(), re.MULTILINE)[1]}"


def found(mark: pytest.Mark) -> str:
    """Returns the agreement and the reference of a mark, as cells of the table."""
    within = mark.kwargs.get("within")
    if within is None:
        return "no problem | –"
    agreement = within if isinstance(within, str) else "the same bits" if within == 0.0 else f"within {within:g}"
    return f"{agreement} | {mark.kwargs.get('to', 'stepping by hand')}"
