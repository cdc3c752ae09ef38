"""Linear models of loops, and their stability margins: the orchestrator is run, and its answer is
read."""

from __future__ import annotations

import json
import os
import tempfile
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from ._data import caller, experiment_path
from ._experiment import Value, changes
from ._law import laws_of
from ._orchestrator import OrchestratorError, OrchestratorWarning, orchestrate
from ._state import Law

if TYPE_CHECKING:
    import control

Matrix = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class OpenLoop:
    """The open loop of an experiment over one common period of its components, x⁺ = A x + B u,
    y = C x + D u: from what is put in at the opened signals to what arrives there. The loop is
    closed by u = y, so that the return ratio is the negative of this system."""

    a: Matrix
    b: Matrix
    c: Matrix
    d: Matrix
    period: float
    """Length of the period, s."""
    samples: int
    """Number of samples in a period. Inputs and outputs are all signals at the first sample, then
    all at the second, and so on."""
    signals: list[str]
    """Names of the opened signals."""
    units: list[str]
    """Their units."""
    time: float
    """Time of the run at which it was linearised, s."""
    note: str
    """How the model was found."""
    sides: tuple[OpenLoop, OpenLoop] | None
    """The loop for increases and for decreases of every signal, where it has no derivative."""

    def statespace(self) -> control.StateSpace:
        """The open loop for python-control, which must be installed."""
        import control

        names = [
            name if self.samples == 1 else f"{name}[{sample}]"
            for sample in range(self.samples)
            for name in self.signals
        ]
        return control.ss(
            self.a,
            self.b,
            self.c,
            self.d,
            self.period,
            inputs=[name.replace(".", "_") for name in names],
            outputs=[name.replace(".", "_") + "_back" for name in names],
        )


def linearise(
    name: str | os.PathLike[str],
    at: float | None = None,
    open: str | Sequence[str] = (),
    set: Mapping[str, Value] | None = None,
    *,
    fmu: Mapping[str, str | os.PathLike[str]] | None = None,
    step: float | None = None,
    law: Law | None = None,
) -> OpenLoop:
    """Linearises an experiment at an instant of its run.

    >>> loop = linearise("lqr", at=10.0, open="plant.moment.*")
    >>> loop.a.shape, loop.period, loop.signals[0]
    ((6, 6), 0.04, 'plant.moment.x')

    Args:
        name: An experiment of `experiments()`, or the path of an experiment file (TOML).
        at: Time of the run, s, by default that of the experiment's [observe.margins].
        open: Signals at which the loop is opened: connected inputs or outputs. By default those of
            [observe.margins].
        set: Parameters by component.parameter.
        fmu: FMUs that replace those of components.
        step: Length of the communication step, s.
        law: Law in Python that replaces the controller, as in `experiment`. Its memory is copied
            with the state of the loop (by cloudpickle): what an object holds and a function
            encloses, but not what is global.

    Raises:
        OrchestratorError: The experiment was refused, or its run failed.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "model.json")
        answer(["--model", str(path)], name, at, open, set, fmu, step, law)
        found = json.loads(path.read_text(encoding="utf-8"))
    sides = found.get("sides")
    return open_loop(
        found,
        found,
        (open_loop(sides["increases"], found), open_loop(sides["decreases"], found))
        if sides
        else None,
    )


def margins(
    name: str | os.PathLike[str],
    at: float | None = None,
    open: str | Sequence[str] = (),
    set: Mapping[str, Value] | None = None,
    *,
    fmu: Mapping[str, str | os.PathLike[str]] | None = None,
    step: float | None = None,
    law: Law | None = None,
    guarantee: bool = False,
) -> pd.DataFrame:
    """Computes the stability margins of an experiment at an instant of its run, or the bounds that a
    controller's guarantee accepts.

    >>> table = margins("lqr", at=10.0, open="plant.moment.*", set={"plant.disturbance.kind": "none"})
    >>> float(table.loc["all together", "disk"].round(2))
    1.34

    Args:
        name: An experiment of `experiments()`, or the path of an experiment file (TOML).
        at: Time of the run, s, by default that of the experiment's [observe.margins].
        open: Signals at which the loop is opened: connected inputs or outputs. By default those of
            [observe.margins].
        set: Parameters by component.parameter.
        fmu: FMUs that replace those of components.
        step: Length of the communication step, s.
        law: Law in Python that replaces the controller, as in `experiment`. Its memory is copied
            with the state of the loop, as by `linearise`.
        guarantee: Whether to tell instead, without a flight, what the guarantee accepts: a row for
            the largest disturbance bound and the like, and for outputs such as the designed time of
            a turn, each with the gains as set and by rule. What has no value is not a number.

    Returns:
        One row for each signal, with the loops of the others closed, and one for all together:
        factors of the gain, phase lag (deg) and delay (s) at which the loop becomes unstable, the
        radius of the disk margin with its frequency (rad/s), and the largest magnitude of the
        sensitivity. What has no limit is not a number. The table is empty if the loop is unstable,
        with a warning; `attrs` has "stable", "spectral_radius", "period", "note", and "sides" with
        the answers for increases and decreases where the loop has no derivative.

    Raises:
        OrchestratorError: The experiment was refused, or its run failed.
    """
    if guarantee:
        rows = answer(["--guarantee"], name, at, open, set, fmu, step, law)
        numbers = dict.fromkeys(("set", "as_set", "by_rule"), float)
        table = pd.DataFrame(rows).set_index("answer").astype(numbers)
        return table[["unit", *numbers]]
    found = answer([], name, at, open, set, fmu, step, law)
    rows = found["loops"] + ([found["together"]] if found["together"] else [])

    def value(crossing: dict[str, float] | None) -> float:
        return crossing["value"] if crossing else float("nan")

    table = pd.DataFrame(
        {
            "gain_below": [value(row["classical"]["gain_below"]) for row in rows],
            "gain_above": [value(row["classical"]["gain_above"]) for row in rows],
            "phase": [value(row["classical"]["phase"]) for row in rows],
            "delay": [value(row["classical"]["delay"]) for row in rows],
            "disk": [row["disk"]["alpha"] for row in rows],
            "disk_frequency": [row["disk"]["frequency"] for row in rows],
            "sensitivity": [row["sensitivity"]["value"] for row in rows],
        },
        index=pd.Index([row["signal"] for row in rows], name="signal"),
    )
    kept = ("stable", "spectral_radius", "period", "note", "sides")
    table.attrs.update({key: found[key] for key in kept if key in found})
    if not found["stable"]:
        magnitude = found["spectral_radius"]
        text = f"there are no margins, because the loop is unstable at t = {found['time']:g} s: an eigenvalue of the closed loop has the magnitude {magnitude:.6f}"
        warnings.warn(text, OrchestratorWarning, stacklevel=caller())
    return table


def answer(
    more: list[str],
    name: str | os.PathLike[str],
    at: float | None,
    open: str | Sequence[str],
    set: Mapping[str, Value] | None,
    fmu: Mapping[str, str | os.PathLike[str]] | None,
    step: float | None,
    law: Law | None,
) -> Any:
    """The orchestrator's answer."""
    arguments = ["margins", "--json", experiment_path(name), *more]
    arguments += changes(set, fmu, law, at=at, step=step)
    for signal in [open] if isinstance(open, str) else open:
        arguments += ["--open", signal]
    laws = None if law is None else laws_of(law)
    exit_code, error, text = orchestrate(arguments, laws=laws)
    if exit_code != 0:
        raise OrchestratorError(error, exit_code, None)
    return json.loads(text)


def open_loop(
    model: dict[str, Any], whole: dict[str, Any], sides: tuple[OpenLoop, OpenLoop] | None = None
) -> OpenLoop:
    """Reads one model of an answer."""
    states, ports = len(model["a"]), model["samples"] * len(model["signals"])
    shapes = {"a": (states, states), "b": (states, ports), "c": (ports, states), "d": (ports, ports)}
    matrices = {key: np.array(model[key], float).reshape(shape) for key, shape in shapes.items()}
    return OpenLoop(
        **matrices,
        period=model["period"],
        samples=model["samples"],
        signals=[signal["name"] for signal in model["signals"]],
        units=[signal["unit"] for signal in model["signals"]],
        time=whole["time"],
        note=whole["note"],
        sides=sides,
    )
