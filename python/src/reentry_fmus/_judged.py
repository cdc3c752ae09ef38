"""Runs that were flown here, judged by the orchestrator."""

from __future__ import annotations

import json
import os
import re
import subprocess
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import numpy.typing as npt

from ._data import EXPERIMENTS, FMUS, program
from ._experiment import written
from ._instance import Value
from ._orchestrator import OrchestratorError
from ._recording import RECORDED, Variable
from ._run import Judgement, read_judgement

LOST = 3
"""Exit code of the orchestrator for a run in which the attitude was lost."""


@dataclass(frozen=True, eq=False)
class Flown:
    """A run of the loop of the vehicle and a controller."""

    title: str
    span: tuple[float, float, float]
    """First time, last time and communication step, s."""
    paths: dict[str, Path]
    """FMUs by component."""
    parameters: dict[str, dict[str, Value]]
    columns: dict[str, npt.NDArray[np.float64]]
    """Values of variables at each communication point."""
    law: str | None = None
    """Name of the law, if it is one in Python."""


def judged(flown: Flown) -> Judgement:
    """Returns the orchestrator's metrics, figure and description of a run.

    Raises:
        OrchestratorError: The orchestrator refused the FMUs.
    """
    with TemporaryDirectory() as folder:
        with asked(flown, Path(folder)) as (process, variables):
            rows = [flown.columns[name] for name, _ in variables]
            _, said = process.communicate(np.array(rows, "<f8").T.tobytes())
        # A run in which the attitude was lost is judged up to then.
        if process.returncode not in (0, LOST):
            error = said.decode(errors="replace").partition("error: ")[2]
            # The experiment's file was made here, and nobody has seen it.
            problem = re.sub(r"^\S*closed_loop\.toml:(\d+:)? ", "", error.strip())
            raise OrchestratorError(problem, process.returncode, None)
        judgement = read_judgement(Path(folder, "out"))
    if flown.law is not None:
        judgement.description["law"] = flown.law
    return judgement


@contextmanager
def asked(
    flown: Flown, folder: Path
) -> Iterator[tuple[subprocess.Popen[bytes], list[Variable]]]:
    """Starts the orchestrator, which writes into the folder's `out`, and gives it with the variables
    whose values it asks for; there are none if it refuses the FMUs."""
    path = folder / "closed_loop.toml"
    path.write_text(experiment_of(flown), encoding="utf-8")
    command: list[str | Path] = [program(), "judge", path, "--out", folder / "out"]
    command += ["--fmu-dir", FMUS]
    with subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env={**os.environ, "RUST_LOG": "error"},
    ) as process:
        assert process.stdout is not None
        found = json.loads(process.stdout.readline() or "[]")
        yield process, [(str(name), bool(responds)) for name, responds in found]


@lru_cache
def observed_by(plant: Path, controller: Path, changed: Any) -> tuple[Variable, ...]:
    paths = {"plant": plant, "controller": controller}
    nothing = Flown("", (0.0, 1.0, 1.0), paths, {"plant": {}, "controller": {}}, {})
    with TemporaryDirectory() as folder, asked(nothing, Path(folder)) as (process, variables):
        process.communicate()
    # The loop runs also if these FMUs are refused. Whoever asks for its metrics gets the reason.
    return tuple(variables)


def observed(paths: Mapping[str, Path]) -> tuple[Variable, ...]:
    """Returns the variables that metrics and figure need of a loop of these FMUs. They are looked
    up once, as long as no file changes."""
    changed = tuple(path.stat().st_mtime_ns for path in paths.values() if path.exists())
    return observed_by(paths["plant"], paths["controller"], changed)


def experiment_of(flown: Flown) -> str:
    """Writes a run as an experiment."""
    start, stop, step = flown.span
    recorded = json.dumps([name for name, _ in RECORDED])
    lines = [
        f"extends = {text((EXPERIMENTS / 'base' / 'direct.toml').as_posix())}",
        f"title = {text(flown.title)}",
        f"[simulation]\nstart = {start!r}\nstop = {stop!r}\nstep = {step!r}",
        f"[record]\nvariables = {recorded}",
    ]
    for component, path in flown.paths.items():
        lines.append(f"[components.{component}]\nfmu = {text(str(path))}")
        lines.append(f"[components.{component}.parameters]")
        for name, value in flown.parameters[component].items():
            # Numbers are as on the command line.
            right = text(value) if isinstance(value, str) else written(name, value)
            lines.append(f"{text(name)} = {right}")
    return "\n".join(lines) + "\n"


def text(value: str) -> str:
    """Writes a text as TOML does, whose escapes are those of JSON."""
    return json.dumps(value, ensure_ascii=False)
