"""Experiments: the orchestrator is run, and its results are read."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from ._data import FMUS, experiment_path, fmu_path
from ._instance import Value as Value
from ._law import STAND_IN, Laws, laws_of
from ._orchestrator import OrchestratorError, orchestrate
from ._run import Run, read
from ._state import Law
from ._table import Units, check_units

def experiment(
    name: str | os.PathLike[str],
    set: Mapping[str, Value] | None = None,
    *,
    fmu: Mapping[str, str | os.PathLike[str]] | None = None,
    stop: float | None = None,
    step: float | None = None,
    units: Units = "si",
    out: str | os.PathLike[str] | None = None,
    law: Law | None = None,
) -> Run:
    """Runs an experiment with the FMUs of this package, or with a law in Python.

    >>> run = experiment("lqr", set={"plant.disturbance.kind": "none"}, stop=10.0, units="deg")
    >>> run.table.shape[0]
    251
    >>> run.table.attrs["units"]["plant.rate.p"]
    'deg/s'
    >>> round(run.metrics["max_rate_deg_s"], 1)
    6.3

    Args:
        name: An experiment of `experiments()`, or the path of an experiment file (TOML).
        set: Parameters by component.parameter, such as {"plant.disturbance.seed": 7}: numbers in
            SI units, truth values, names of enumerations' items, or texts with a unit, such as
            "2 deg/s2".
        fmu: FMUs that replace those of components, by name as in {"controller": "LQR"} or by path.
        stop: Stop time of the simulation, s.
        step: Length of the communication step, s.
        units: "deg" gives angles and angular rates in degrees for reading.
        out: Folder that keeps the files of the run; earlier results in it are replaced. Without
            it they are removed.
        law: Law that replaces the controller, a function from the state to the moment as in
            `ClosedLoop.run`. LQR.fmu stands in for everything else: it computes the reference, has
            the limits, and its period says when the law is asked.

    Raises:
        OrchestratorError: The experiment was refused, or its run failed.
        LawError: The law failed.
    """
    check_units(units)
    command = ["run", "--quiet", "--force", experiment_path(name)]
    command += changes(set, fmu, law, stop=stop, step=step)
    return recorded(command, out, units, laws=None if law is None else laws_of(law, is_first=True))


def changes(
    set: Mapping[str, Value] | None,
    fmu: Mapping[str, str | os.PathLike[str]] | None,
    law: Law | None,
    **numbers: float | None,
) -> list[str]:
    """Returns the arguments of the orchestrator for changes of an experiment."""
    if law is not None:
        if "controller" in (fmu or {}):
            raise TypeError("the law replaces the controller: leave out its FMU")
        # One beside the experiment might be another.
        fmu = {**(fmu or {}), "controller": STAND_IN}
    arguments = ["--fmu-dir", str(FMUS)]
    for component, replacement in (fmu or {}).items():
        arguments += ["--fmu", f"{component}={fmu_path(replacement)}"]
    for parameter, value in (set or {}).items():
        arguments += ["--set", f"{parameter}={written(parameter, value)}"]
    for option, number in numbers.items():
        if number is not None:
            arguments += [f"--{option}", repr(float(number))]
    return arguments


def recorded(
    arguments: Sequence[str],
    out: str | os.PathLike[str] | None,
    units: Units,
    laws: Laws | None = None,
) -> Run:
    """Calls the orchestrator for one run, and reads what it recorded."""
    with TemporaryDirectory() as temporary:
        folder = Path(temporary, "out") if out is None else Path(out)
        command = [*arguments, "--out", str(folder)]
        # A folder of earlier results must not pass for those of a run that was refused.
        stale = folder / "results.json"
        before = stale.stat().st_mtime_ns if stale.exists() else None
        exit_code, error, _ = orchestrate(command, laws=laws)
        is_new = stale.exists() and stale.stat().st_mtime_ns != before
        run = read(folder, units) if is_new else None
    if run is not None and laws is not None:
        run.description["law"] = laws.key.split()[0]
    if exit_code != 0 or run is None:
        raise OrchestratorError(error, exit_code, run)
    return run


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


