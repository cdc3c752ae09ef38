"""Results of a run: its table, its metrics and its figure."""

from __future__ import annotations

import base64
import csv
import html
import json
import textwrap
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from ._arrays import dataset, write_mat
from ._table import Units, convert

if TYPE_CHECKING:
    from xarray import Dataset


class Figure(str):
    """A figure as the text of an SVG file. A notebook shows it as a picture."""

    def _repr_svg_(self) -> str:
        return str(self)


@dataclass(frozen=True)
class Judgement:
    """Results of the orchestrator about a run."""

    metrics: dict[str, Any]
    figure: Figure
    description: dict[str, Any]


class Run:
    """Results of a run. `run["plant.attitude.alpha"]` is a column of the table.

    Metrics, figure and description of a `ClosedLoop` are the orchestrator's, too. It is asked for
    them when they are first used.
    """

    def __init__(
        self, title: str, table: pd.DataFrame, judge: Judgement | Callable[[], Judgement]
    ) -> None:
        self.title = title
        """Title of the run."""
        self.table = table
        """Recorded variables, one row for each communication point, with the time (s) as index. A
        column is named component.variable, such as "plant.attitude.alpha". `table.attrs["units"]`
        and `table.attrs["descriptions"]` give the unit and the meaning of each column.
        Enumerations are categoricals of their items' names."""
        self._judge = judge

    @cached_property
    def _judgement(self) -> Judgement:
        return self._judge if isinstance(self._judge, Judgement) else self._judge()

    @property
    def metrics(self) -> dict[str, Any]:
        """Metrics, such as "ems_deg" (deg) and "max_rate_deg_s" (deg/s)."""
        return self._judgement.metrics

    @property
    def figure(self) -> Figure:
        """The plot that the experiment defines."""
        return self._judgement.figure

    @property
    def description(self) -> dict[str, Any]:
        """Description of the run: the experiment, all parameters, seeds, and the GUIDs of the
        FMUs. "law" is the name of a law in Python, whose reference and limits are those of the FMU
        in its place."""
        return self._judgement.description

    def __getitem__(self, column: str) -> pd.Series[Any]:
        return self.table[column]

    def to_xarray(self) -> Dataset:
        """Returns the table as an xarray Dataset with the dimension "time" (s). Each variable has
        its unit and its meaning as attributes, and the numbers among the metrics are attributes of
        the whole.

        >>> from reentry_fmus import experiment
        >>> data = experiment("lqr", stop=1.0, units="deg").to_xarray()
        >>> data["plant.rate.p"].dims, data["plant.rate.p"].attrs["units"]
        (('time',), 'deg/s')

        Raises:
            ModuleNotFoundError: xarray is not installed.
        """
        return dataset(self.table, self.title, self._numbers(), index_unit="s")

    def to_mat(self, path: str | Path) -> None:
        """Writes the table as a file of MATLAB: a column vector for the time (s) and one for each
        variable, such as plant_attitude_alpha, with "_" in place of "." and brackets. The structs
        units, names and metrics have the unit and the own name of each, and the metrics that are
        numbers.

        Raises:
            ModuleNotFoundError: scipy is not installed.
            ValueError: a name is too long for MATLAB, or occurs twice.
        """
        write_mat(Path(path), self.table, self._numbers())

    def _numbers(self) -> dict[str, float]:
        """Returns the metrics that are numbers, without the number of rows and computing times,
        which differ from run to run."""
        left_out = ("solver_ms_", "real_time_factor", "wall_s", "samples")
        return {
            name: value
            for name, value in self.metrics.items()
            if isinstance(value, (int, float)) and not name.startswith(left_out)
        }

    def _extent(self) -> str:
        rows, columns = self.table.shape
        first, last = self.table.index[0], self.table.index[-1]
        return f"{first:g} to {last:g} s, {rows} rows, {columns} columns"

    def __repr__(self) -> str:
        try:
            # A name and its number stay on one line.
            shown = [f"{name}\0{short(value)}" for name, value in self._numbers().items()]
            summary = textwrap.fill(", ".join(shown), 76).replace("\0", " ")
        except RuntimeError as error:
            summary = textwrap.fill(f"no metrics: {error}", 76, max_lines=3)
        return f"Run: {self.title}\n  {self._extent()}\n{textwrap.indent(summary, '  ')}"

    def _repr_html_(self) -> str:
        try:
            numbers, figure = self._numbers(), self.figure
        except RuntimeError as error:
            return f"<pre>{html.escape(repr(self))}\n{html.escape(str(error))}</pre>"
        rows = "".join(
            f"<tr><th>{html.escape(name)}</th><td>{short(value)}</td></tr>"
            for name, value in numbers.items()
        )
        picture = "data:image/svg+xml;base64," + base64.b64encode(figure.encode()).decode()
        return (
            f"<p><b>{html.escape(self.title)}</b><br>{self._extent()}</p><table>{rows}</table>"
            + (f'<img alt="{html.escape(self.title)}" src="{picture}">' if figure else "")
        )


def short(value: float) -> str:
    """Writes a number for reading."""
    return ("yes" if value else "no") if isinstance(value, bool) else f"{value:.4g}"


def read(folder: Path, units: Units) -> Run:
    """Reads the files of a run."""
    judgement = read_judgement(folder)
    columns: list[dict[str, Any]] = judgement.description["columns"]
    # NumPy reads back the very bits that were written, which not every pandas does.
    with open(folder / "results.csv", newline="", encoding="utf-8") as file:
        names = next(csv.reader(file))
        rows = np.loadtxt(file, delimiter=",", ndmin=2)
    table = pd.DataFrame(rows, columns=names).set_index("time")
    table.attrs["units"] = {column["name"]: column["unit"] for column in columns}
    table.attrs["descriptions"] = {column["name"]: column["description"] for column in columns}
    for column in columns:
        name = column["name"]
        if column["items"]:
            items = {int(value): item for value, item in column["items"].items()}
            values = table[name].astype(np.int64).map(items)
            table[name] = pd.Categorical(values, categories=list(items.values()))
        elif column["type"] != "Real":
            table[name] = table[name].astype(bool if column["type"] == "Boolean" else np.int64)
    convert(table, units)
    return Run(judgement.description["title"], table, judgement)


def read_judgement(folder: Path) -> Judgement:
    """Reads what the orchestrator wrote about a run besides its table."""
    plot = folder / "plot.svg"
    return Judgement(
        metrics=json.loads((folder / "metrics.json").read_text("utf-8")),
        figure=Figure(plot.read_text("utf-8") if plot.exists() else ""),
        description=json.loads((folder / "results.json").read_text("utf-8")),
    )
