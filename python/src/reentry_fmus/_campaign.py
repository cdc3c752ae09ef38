"""Campaigns: thousands of cases of an experiment, and the search for the worst of them."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from ._data import FMUS, need
from ._experiment import Figure, OrchestratorError, Run, orchestrate, recorded
from ._table import Units, check_units, convert

if TYPE_CHECKING:
    from distributed import Client

STATUS = ["completed", "ended", "lost", "failed"]


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

    def _repr_svg_(self) -> str:
        return str(self.figure)


class Campaign:
    """A campaign: an experiment, the parameters that vary from case to case, and the limits that
    the cases are to keep. `campaign` makes one."""

    def __init__(self, path: str) -> None:
        self.path = path
        """The campaign's file, or a name that the orchestrator knows."""

    def __repr__(self) -> str:
        return f"campaign({self.path!r})"

    @property
    def name(self) -> str:
        """Name of the campaign, which is that of its file."""
        return Path(self.path).stem

    def run(
        self,
        client: Client | None = None,
        out: str | os.PathLike[str] | None = None,
        jobs: int | None = None,
        *,
        units: Units = "si",
    ) -> Flown:
        """Flies the cases that are not flown yet, and returns the results of all.

        Finished parts are stored in the folder of the results at once. A run that was ended in any
        way continues from there when it is started again. The results are the same bytes, however
        the cases were distributed.

        Args:
            client: Dask client whose workers fly the cases (`reentry_fmus.cluster`). Without one
                this machine does.
            out: Folder of the results, by default out/NAME. With a client it may be the address
                of a folder that all workers reach, such as "s3://bucket/folder", where they store
                the finished parts; the results are then in out/NAME as well.
            jobs: Number of threads without a client, by default one for each core.
            units: "deg" gives angles and angular rates of the table in degrees.

        Raises:
            OrchestratorError: The campaign was refused, or flying it failed.
            ClusterError: The cluster failed. Finished parts are kept.
        """
        check_units(units)
        is_address = out is not None and "://" in os.fspath(out)
        if is_address and client is None:
            raise ValueError(f"out={os.fspath(out or '')!r}: an address is for runs with a client")
        if client is not None and jobs is not None:
            raise ValueError("jobs is for runs without a client: workers have threads of their own")
        folder = Path("out", self.name) if out is None or is_address else Path(out)
        if client is not None:
            from . import cluster

            cluster.fly(self.call, client, folder, os.fspath(out) if out and is_address else None)
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
        """
        check_units(units)
        return recorded([*self.command("campaign"), "--case", str(number)], out, units)

    def command(self, name: str) -> list[str]:
        """Returns the arguments of a command of the orchestrator for this campaign."""
        return [name, self.path, "--fmu-dir", str(FMUS), "--quiet"]

    def call(self, *arguments: str, command: str = "campaign") -> str:
        """Calls the orchestrator with this campaign, and returns what it prints."""
        command_line = [*self.command(command), *arguments]
        exit_code, error, printed = orchestrate(command_line, stacklevel=4)
        if exit_code != 0:
            raise OrchestratorError(error, exit_code, None)
        return printed


def campaign(name: str | os.PathLike[str]) -> Campaign:
    """Returns a campaign, whose `run` flies it.

    Args:
        name: Path of a campaign file (TOML), or the name of a campaign of this package.

    Raises:
        ModuleNotFoundError: pyarrow, which reads the results, is not installed.
    """
    need("pyarrow", "campaign")
    path = Path(name)
    return Campaign(str(path.absolute()) if path.is_file() else os.fspath(name))


def falsify(
    name: str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    time: int | None = None,
    jobs: int | None = None,
    *,
    units: Units = "si",
) -> Search:
    """Looks for the worst case of a campaign that has a [search].

    Args:
        name: Path of a campaign file (TOML), or the name of a campaign of this package.
        out: Folder of the results, by default out/NAME-worst. Those of an earlier search in it
            are replaced.
        time: Time after which no further cases are begun, s.
        jobs: Number of threads, by default one for each core.
        units: "deg" gives angles and angular rates of the table in degrees.

    Raises:
        OrchestratorError: The campaign was refused, or the search failed.
    """
    check_units(units)
    searched = campaign(name)
    folder = Path("out", f"{searched.name}-worst") if out is None else Path(out)
    arguments = ["--out", str(folder), "--force"]
    for option, value in (("--time", time), ("--jobs", jobs)):
        if value is not None:
            arguments += [option, str(value)]
    searched.call(*arguments, command="falsify")
    return Search(
        table=read_cases(folder / "search.parquet", units),
        outcome=json.loads((folder / "search.json").read_text("utf-8")),
        figure=Figure((folder / "history.svg").read_text("utf-8")),
        folder=folder.absolute(),
    )


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
