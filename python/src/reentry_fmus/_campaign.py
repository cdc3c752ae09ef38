"""Campaigns: thousands of cases of an experiment, and the search for the worst of them."""

from __future__ import annotations

import html
import json
import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from ._arrays import dataset
from ._data import FMUS, fmu, need
from ._experiment import recorded
from ._law import STAND_IN, Laws, PickledLaw
from ._orchestrator import OrchestratorError, missing_parts, orchestrate
from ._pool import Pool
from ._run import Figure, Run
from ._state import Law, LawError
from ._table import Units, check_units, convert

if TYPE_CHECKING:
    from xarray import Dataset

STATUS = ["completed", "ended", "lost", "failed"]
PAUSE = 10.0
"""Time from one message of the progress to the next, s."""


@dataclass(frozen=True, eq=False)
class Flown:
    """Results of a campaign."""

    table: pd.DataFrame
    """One row for each case, with its number as index: varied parameters, metrics and measures,
    whether each limit was kept ("kept.…"), how the case ended ("status"), and when ("time", s).
    `table.attrs["units"]` gives the unit of each column. Texts are categoricals, except for the
    messages of cases that failed. A number that a case does not have is NaN."""

    summary: dict[str, Any]
    """Findings over all cases: numbers of cases, limits with the probability that they are broken,
    distributions and sensitivities of the measures. Its numbers have the units of the campaign's
    file, whatever the units of the table are."""

    folder: Path
    """Folder of the results: cases.parquet, summary.json, report.html, and the parts."""

    @property
    def report(self) -> Path:
        """Path of the report, a page for the browser."""
        return self.folder / "report.html"

    def to_xarray(self) -> Dataset:
        """Returns the table as an xarray Dataset with the dimension "case". Each variable has its
        unit as an attribute.

        Raises:
            ModuleNotFoundError: xarray is not installed.
        """
        return dataset(self.table, self.summary["title"], {})

    def __repr__(self) -> str:
        status = self.table["status"].value_counts()
        counts = ", ".join(f"{count} {name}" for name, count in status.items() if count)
        lines = [f"Flown: {self.summary['title']}", f"  {len(self.table)} cases, {counts}"]
        for limit in self.summary["limits"]:
            broken = limit["broken"]
            lines.append(
                f"  {limit['says']}: broken by {broken['events']} of {broken['cases']}, "
                f"probability {broken['low']:.3g} to {broken['high']:.3g}"
            )
        return "\n".join([*lines, f"  {near(self.report)}"])

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><td>{html.escape(limit['says'])}</td>"
            f"<td>{limit['broken']['events']} of {limit['broken']['cases']}</td>"
            f"<td>{limit['broken']['low']:.3g} to {limit['broken']['high']:.3g}</td></tr>"
            for limit in self.summary["limits"]
        )
        heading = "<tr><th>limit</th><th>broken by</th><th>probability (95 %)</th></tr>"
        title = f"{html.escape(self.summary['title'])}, {len(self.table)} cases"
        return f"<p><b>{title}</b></p><table>{heading}{rows}</table>"


@dataclass(frozen=True, eq=False)
class Search:
    """Results of a search for the worst case."""

    table: pd.DataFrame
    """One row for each case in the order in which they were tried, as in `Flown.table`."""

    outcome: dict[str, Any]
    """Outcome of the search: "largest" is the largest value of "measure", in "unit"; "broken" are
    the limits that this case breaks; "ended" tells why the search ended."""

    figure: Figure
    """The largest value against the number of cases, as the text of an SVG file."""

    folder: Path
    """Folder of the results: search.parquet, search.json, worst.toml, history.svg."""

    @property
    def worst(self) -> Path:
        """Path of the worst case, an experiment for `experiment`."""
        return self.folder / "worst.toml"

    def __repr__(self) -> str:
        found = self.outcome
        lines = [
            f"Search: largest {found['measure']} {found['largest']:.6g} {found['unit']}",
            f"  {len(self.table)} cases; {found['ended']}",
        ]
        if found["broken"]:
            lines.append(f"  breaks {', '.join(found['broken'])}")
        return "\n".join([*lines, f"  {near(self.worst)}"])

    def _repr_svg_(self) -> str:
        return str(self.figure)


class Campaign:
    """A campaign: an experiment, the parameters that vary from case to case, and the limits that
    the cases are to keep. `campaign` makes one."""

    def __init__(self, path: str, law: Law | None = None) -> None:
        self.path = path
        """The campaign's file, or a name that the orchestrator knows."""
        self.law = None if law is None else PickledLaw(law)
        """Law in Python that replaces the controller."""

    def __repr__(self) -> str:
        law = "" if self.law is None else f", law={self.law.name}"
        return f"campaign({self.path!r}{law})"

    @property
    def name(self) -> str:
        """Name of the campaign, which is that of its file, and that of a law."""
        stem = Path(self.path).stem
        return stem if self.law is None else f"{stem}-{self.law.name.strip('<>')}"

    def run(
        self,
        out: str | os.PathLike[str] | None = None,
        jobs: int | None = None,
        *,
        units: Units = "si",
    ) -> Flown:
        """Flies the cases that are not flown yet, and returns the results of all.

        Finished parts are stored in the folder of the results at once. A run that was ended in any
        way continues from there when it is started again. The results are the same bytes, on any
        number of processes.

        Args:
            out: Folder of the results, by default out/NAME.
            jobs: Number of threads, or of processes with a law in Python, by default one for each
                core.
            units: "deg" gives angles and angular rates of the table in degrees.

        Raises:
            OrchestratorError: The campaign was refused, or flying it failed.
            LawError: The law failed. Finished parts are kept.
            """
        check_units(units)
        folder = Path("out", self.name) if out is None else Path(out)
        with self._progress(folder):
            if self.law is not None:
                self._fly(self.law, folder, jobs)
            else:
                threads = [] if jobs is None else ["--jobs", str(jobs)]
                self.call("--out", str(folder), *threads)
        return Flown(
            table=read_cases(folder / "cases.parquet", units),
            summary=json.loads((folder / "summary.json").read_text("utf-8")),
            folder=folder.absolute(),
        )

    def case(
        self, number: int, *, units: Units = "si", out: str | os.PathLike[str] | None = None
    ) -> Run:
        """Runs one case with everything recorded.

        Args:
            number: Number of the case, from 0.
            units: "deg" gives angles and angular rates in degrees for reading.
            out: Folder that keeps the files of the run. Without it they are removed.

        Raises:
            OrchestratorError: The campaign was refused, or the run failed.
            LawError: The law failed.
        """
        check_units(units)
        command = [*self.command(), "--case", str(number)]
        with self._laws(number) as laws:
            return recorded(command, out, units, laws=laws)

    def worst(
        self,
        out: str | os.PathLike[str] | None = None,
        jobs: int | None = None,
        *,
        units: Units = "si",
    ) -> Search:
        """Looks for the worst case of a campaign that has a [search].

        Args:
            out: Folder of the results, by default out/NAME-worst. Those of an earlier search in it
                are replaced.
            jobs: Number of threads, by default one for each core.
            units: "deg" gives angles and angular rates of the table in degrees.

        Raises:
            OrchestratorError: The campaign was refused, or the search failed.
            LawError: The law failed. `experiment` takes it together with the worst case.
        """
        check_units(units)
        folder = Path("out", f"{self.name}-worst") if out is None else Path(out)
        arguments = ["--worst", "--out", str(folder), "--fresh"]
        if jobs is not None:
            arguments += ["--jobs", str(jobs)]
        self.call(*arguments)
        return Search(
            table=read_cases(folder / "search.parquet", units),
            outcome=json.loads((folder / "search.json").read_text("utf-8")),
            figure=Figure((folder / "history.svg").read_text("utf-8")),
            folder=folder.absolute(),
        )

    def _fly(self, law: PickledLaw, folder: Path, jobs: int | None) -> None:
        """Flies the missing parts with a law, and lets the orchestrator merge and judge them."""
        # The workers share the cores.
        command = [*self.command(), "--out", str(folder.absolute()), "--jobs", "1"]
        with Pool(law, command, jobs) as pool:
            if missing := missing_parts(self.call, folder):
                pool.fly(missing)
            pool.finish()

    @contextmanager
    def _progress(self, folder: Path) -> Iterator[None]:
        """Tells on standard error from time to time how many cases are left."""
        done = threading.Event()

        def tell() -> None:
            while not done.wait(PAUSE):
                with suppress(Exception):
                    left = sum(last - first for first, last in missing_parts(self._quietly, folder))
                    print(f"{self.name}: {left} cases to be flown", file=sys.stderr, flush=True)

        thread = threading.Thread(target=tell, daemon=True)
        thread.start()
        try:
            yield
        finally:
            done.set()
            thread.join()

    def _quietly(self, *arguments: str) -> str:
        """Calls the orchestrator with this campaign, without its warnings."""
        with self._laws() as laws:
            return orchestrate([*self.command(), *arguments], "error", laws)[2]

    def command(self) -> list[str]:
        """Returns the arguments of the orchestrator for this campaign."""
        command = ["campaign", self.path, "--fmu-dir", str(FMUS), "--quiet"]
        if self.law is not None:
            command += ["--fmu", f"controller={fmu(STAND_IN)}"]
        return command

    @contextmanager
    def _laws(self, case: int | None = None) -> Iterator[Laws | None]:
        """Gives the laws of flights in this process, whose errors name the file of the law."""
        try:
            yield None if self.law is None else self.law.laws(case)
        except LawError as error:
            assert self.law is not None
            raise error.in_file(self.law.file) from error.__cause__

    def call(self, *arguments: str) -> str:
        """Calls the orchestrator with this campaign, and returns what it prints."""
        command_line = [*self.command(), *arguments]
        with self._laws() as laws:
            if laws is not None:
                laws.has_cases = "--worst" not in arguments
            exit_code, error, printed = orchestrate(command_line, laws=laws)
        if exit_code != 0:
            raise OrchestratorError(error, exit_code, None)
        return printed


def campaign(name: str | os.PathLike[str], law: Law | None = None) -> Campaign:
    """Returns a campaign, whose `run` flies it.

    Args:
        name: Path of a campaign file (TOML), or the name of a campaign of this package.
        law: Law in Python that replaces the controller, a function from the state to the moment as
            in `experiment`. It is sent to processes by cloudpickle, and each case begins with a
            fresh copy of it, so that it may be an object with a memory.

    Raises:
        ModuleNotFoundError: pyarrow, which reads the results, or cloudpickle is not installed.
    """
    need("pyarrow", "campaign")
    path = Path(name)
    return Campaign(str(path.absolute()) if path.is_file() else os.fspath(name), law)


def near(path: Path) -> Path:
    """Returns a path as it is from the current folder, if it lies below it."""
    return path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path


def read_cases(path: Path, units: Units) -> pd.DataFrame:
    """Reads a table of cases from its Parquet file."""
    from pyarrow import parquet

    content = parquet.read_table(path)
    column_units = json.loads(content.schema.metadata[b"units"])
    table: pd.DataFrame = content.to_pandas().set_index("case")
    for name in table.columns:
        if name != "message" and table[name].dtype.kind not in "bif":
            levels = STATUS if name == "status" else sorted(table[name].unique())
            table[name] = pd.Categorical(table[name], categories=levels)
    table.attrs["units"] = {name: column_units.get(name) for name in table.columns}
    convert(table, units)
    return table
