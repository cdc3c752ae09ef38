"""Experiments: the orchestrator is run, and its results are read."""

from __future__ import annotations

import csv
import json
import os
import re
import subprocess
import tempfile
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ._data import FMUS, experiment_path, fmu_path, program
from ._table import Units, check_units, convert

Value = bool | int | float | str
"""Value of a parameter: a number in the variable's SI unit, a truth value, the name of an
enumeration's item, or a text with a unit such as "2 deg/s2"."""


class Figure(str):
    """A figure as the text of an SVG file. A notebook shows it as a picture."""

    def _repr_svg_(self) -> str:
        return str(self)


@dataclass(frozen=True, eq=False)
class Run:
    """Results of an experiment."""

    table: pd.DataFrame
    """Recorded variables, one row for each communication point, with the time (s) as index. A
    column is named component.variable, such as "plant.attitude.alpha". `table.attrs["units"]` and
    `table.attrs["descriptions"]` give the unit and the meaning of each column. Enumerations are
    categoricals of their items' names."""

    metrics: dict[str, Any]
    """Metrics, such as "ems_deg" (deg) and "max_rate_deg_s" (deg/s)."""

    figure: Figure
    """The plot that the experiment defines."""

    description: dict[str, Any]
    """Description of the run: the experiment, all parameters, seeds, and the GUIDs of the FMUs."""

    def _repr_svg_(self) -> str:
        return str(self.figure)


class OrchestratorError(RuntimeError):
    """The orchestrator refused an experiment, or its run failed. The text is the
    orchestrator's."""

    def __init__(self, message: str, exit_code: int, run: Run | None) -> None:
        super().__init__(message)
        self.exit_code = exit_code
        """1: the run failed, 2: bad experiment, 3: the attitude was lost."""
        self.run = run
        """Results that were recorded until then, if there are any."""


class OrchestratorWarning(UserWarning):
    """A warning of the orchestrator, or of an FMU that it steps."""


def experiment(
    name: str | os.PathLike[str],
    set: Mapping[str, Value] | None = None,
    *,
    fmu: Mapping[str, str | os.PathLike[str]] | None = None,
    stop: float | None = None,
    step: float | None = None,
    units: Units = "si",
    out: str | os.PathLike[str] | None = None,
) -> Run:
    """Runs an experiment with the FMUs of this package.

    >>> run = experiment("lqr", set={"plant.disturbance.kind": "none"}, stop=10.0, units="deg")
    >>> run.table.shape[0]
    251
    >>> run.table.attrs["units"]["plant.rate.p"]
    'deg/s'
    >>> round(run.metrics["max_rate_deg_s"], 1)
    6.3

    Args:
        name: An experiment of `experiments()`, or the path of an experiment file (TOML).
        set: Parameters by component.parameter, such as {"plant.disturbance.seed": 7}.
        fmu: FMUs that replace those of components, by name as in {"controller": "LQR"} or by path.
        stop: Stop time of the simulation, s.
        step: Length of the communication step, s.
        units: "deg" gives angles and angular rates in degrees for reading.
        out: Folder that keeps the files of the run; earlier results in it are replaced. Without
            it they are removed.

    Raises:
        OrchestratorError: The experiment was refused, or its run failed.
    """
    check_units(units)
    command = ["run", experiment_path(name), "--quiet", "--force"]
    command += ["--fmu-dir", str(FMUS)]
    for component, replacement in (fmu or {}).items():
        command += ["--fmu", f"{component}={fmu_path(replacement)}"]
    for parameter, value in (set or {}).items():
        command += ["--set", f"{parameter}={written(parameter, value)}"]
    for option, number in (("--stop", stop), ("--step", step)):
        if number is not None:
            command += [option, repr(float(number))]
    return recorded(command, out, units)


def recorded(
    arguments: Sequence[str], out: str | os.PathLike[str] | None, units: Units, stacklevel: int = 4
) -> Run:
    """Calls the orchestrator for one run, and reads what it recorded."""
    with tempfile.TemporaryDirectory(prefix="reentry-") as temporary:
        folder = Path(temporary) if out is None else Path(out)
        # A folder of earlier results must not pass for those of a run that was refused.
        stale = folder / "results.json"
        before = stale.stat().st_mtime_ns if stale.exists() else None
        exit_code, error, _ = orchestrate([*arguments, "--out", str(folder)], stacklevel)
        is_new = stale.exists() and stale.stat().st_mtime_ns != before
        run = read(folder, units) if is_new else None
    if exit_code != 0 or run is None:
        raise OrchestratorError(error, exit_code, run)
    return run


def orchestrate(
    arguments: Sequence[str], stacklevel: int, level: str = "warn"
) -> tuple[int, str, str]:
    """Runs the orchestrator. Returns its exit code, the text of its error, and what it printed.
    Its warnings are Python warnings, as many levels of calls further up as `stacklevel` says; with
    the level "error" there are none."""
    done = subprocess.run(
        [str(program()), *arguments],
        capture_output=True,
        text=True,
        encoding="utf-8",
        env={**os.environ, "RUST_LOG": level},
        check=False,
    )
    messages, _, error = done.stderr.partition("error: ")
    for text in re.findall(r"^ *WARN (.+)$", messages, re.MULTILINE):
        warnings.warn(text, OrchestratorWarning, stacklevel=stacklevel)
    return done.returncode, error.strip() or done.stderr.strip(), done.stdout


def written(parameter: str, value: Value) -> str:
    """Writes the value of a parameter as the orchestrator reads it."""
    if isinstance(value, str):
        return value
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    if isinstance(value, (float, np.floating)):
        return repr(float(value))
    raise TypeError(
        f"{parameter}: a number, a truth value or a text is needed, not {type(value).__name__}"
    )


def read(folder: Path, units: Units) -> Run:
    """Reads the files of a run."""
    description = json.loads((folder / "results.json").read_text("utf-8"))
    columns: list[dict[str, Any]] = description["columns"]
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
    plot = folder / "plot.svg"
    return Run(
        table=table,
        metrics=json.loads((folder / "metrics.json").read_text("utf-8")),
        figure=Figure(plot.read_text("utf-8") if plot.exists() else ""),
        description=description,
    )
