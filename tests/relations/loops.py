"""Loops for relations: every shipped experiment and every controller, found by scanning, flown by the
orchestrator with changes, and their results as columns by name."""

from __future__ import annotations

import json
import subprocess
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from conftest import ROOT, TARGET, merged, program, tomllib

FMUS = TARGET / "fmu"
ATTITUDE = [f"plant.attitude.{axis}" for axis in ("alpha", "beta", "sigma")]
RATES = [f"plant.rate.{axis}" for axis in ("p", "q", "r")]
MOMENT = [f"controller.moment.{axis}" for axis in ("x", "y", "z")]
REFERENCE = [f"controller.{kind}.{axis}" for kind in ("reference", "referenceRate", "referenceAcceleration")
             for axis in ("alpha", "beta", "sigma")]


@cache
def experiments() -> dict[str, Path]:
    """Every experiment that the project ships, by its path below the folder of experiments."""
    listed = subprocess.run([program("orchestrator"), "list", "--json", ROOT / "orchestrator" / "experiments"],
                            capture_output=True, text=True, check=True, cwd=ROOT).stdout
    paths = [ROOT / entry["path"] for entry in json.loads(listed) if entry["kind"] == "experiment"]
    folder = ROOT / "orchestrator" / "experiments"
    return {str(path.relative_to(folder).with_suffix("")): path for path in paths}


@cache
def content(path: Path) -> dict:
    """An experiment with all that it extends."""
    return tomllib.loads(merged(path))


@cache
def controllers() -> list[str]:
    """Every FMU that turns an attitude into a moment."""
    def fits(name: str) -> bool:
        shown = subprocess.run([program("orchestrator"), "inspect", FMUS / f"{name}.fmu", "--json"],
                               capture_output=True, text=True, check=True).stdout
        of = {variable["name"]: variable["causality"] for variable in json.loads(shown)["variables"]}
        return (of.get("attitude.sigma"), of.get("moment.x")) == ("input", "output")

    return sorted(path.stem for path in FMUS.glob("*.fmu") if fits(path.stem))


@dataclass
class Flight:
    """A finished run."""

    finished: subprocess.CompletedProcess
    columns: dict[str, np.ndarray]
    metrics: dict

    def __getitem__(self, names: list[str]) -> np.ndarray:
        return np.array([self.columns[name] for name in names])


def fly(experiment: Path, out: Path, *arguments: str, record: tuple = (), parameters: dict | None = None,
        simulation: dict | None = None) -> Flight:
    """Flies an experiment into a new folder, with parameters changed and only these variables
    recorded."""
    lines = [f"extends = {json.dumps(str(experiment))}"]
    if record:
        lines.append(f"record = {{ every = 1, variables = {json.dumps(list(record))} }}")
    lines += [f"components.{name.split('.')[0]}.parameters.{json.dumps(name.split('.', 1)[1])} = {json.dumps(value)}"
              for name, value in (parameters or {}).items()]
    lines += [f"simulation.{key} = {json.dumps(value)}" for key, value in (simulation or {}).items()]
    changed = out.parent / f"{out.name}.toml"
    changed.write_text("\n".join(lines) + "\n", encoding="utf-8")
    command = [program("orchestrator"), "run", changed, "--out", out, "--fmu-dir", FMUS, "--no-plot", *arguments]
    finished = subprocess.run(command, capture_output=True, text=True, cwd=out.parent, timeout=120)
    columns, metrics = {}, {}
    if (out / "results.csv").exists():
        with open(out / "results.csv", encoding="utf-8") as lines:
            names = next(lines).rstrip("\n").split(",")
        rows = np.genfromtxt(out / "results.csv", delimiter=",", skip_header=1, ndmin=2)
        columns = dict(zip(names, rows.T))
    if (out / "metrics.json").exists():
        metrics = json.loads((out / "metrics.json").read_text())
    return Flight(finished, columns, metrics)
