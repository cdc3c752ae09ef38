"""What the tests run on: FMUs, programs and experiments of the built project (scripts/build-fmus)."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

from fmi import Fmu

ROOT = Path(__file__).resolve().parent.parent
TARGET = ROOT / os.environ.get("CARGO_TARGET_DIR", "target")
EXPERIMENTS = ROOT / "orchestrator" / "experiments" / "crmpc-2022"
NAMES = [
    "ReentryPlant",
    "CRMPC",
    "DLMPC",
    "LQR",
    "ControlAllocator",
    "FBL",
    "BTVSMC",
    "BTVSMC_DO",
    "SOTVSMC_DO",
    "TwoLoopSMC",
]


def program(name: str) -> Path:
    """A built program."""
    path = TARGET / "release" / (name + (".exe" if os.name == "nt" else ""))
    assert path.is_file(), f"{path} does not exist: run scripts/build-fmus"
    return path


def archive(name: str) -> Path:
    """A packed FMU."""
    path = TARGET / "fmu" / f"{name}.fmu"
    assert path.is_file(), f"{path} does not exist: run scripts/build-fmus"
    return path


def library(crate: str) -> Path:
    """The built library of a crate."""
    candidates = [TARGET / "release" / name for name in (f"lib{crate}.so", f"lib{crate}.dylib", f"{crate}.dll")]
    found = [path for path in candidates if path.is_file()]
    assert found, f"none of {candidates} exists: run scripts/build-fmus"
    return found[0]


@pytest.fixture(scope="session")
def fmu(tmp_path_factory):
    """Opens an FMU by its name, once a session."""
    opened: dict[str, Fmu] = {}

    def open_once(name: str) -> Fmu:
        if name not in opened:
            opened[name] = Fmu.open(archive(name), tmp_path_factory.mktemp(name))
        return opened[name]

    return open_once


@pytest.fixture(scope="session")
def orchestrate(tmp_path_factory):
    """Runs the orchestrator with the packed FMUs; returns the finished process and the folder of its results."""

    def run(experiment: Path, *arguments: str) -> tuple[subprocess.CompletedProcess, Path]:
        out = tmp_path_factory.mktemp(experiment.stem)
        command = [program("orchestrator"), "run", experiment, "--out", out, "--fmu-dir", TARGET / "fmu", *arguments]
        # Away from the project, so that nothing is found by accident.
        finished = subprocess.run(command, capture_output=True, text=True, cwd=out, timeout=120)
        return finished, out

    return run


@pytest.fixture(scope="session")
def experiment(orchestrate):
    """Results folder of one of the experiments of Chai 2022, run once a session."""
    done: dict[str, Path] = {}

    def run_once(name: str) -> Path:
        if name not in done:
            finished, out = orchestrate(EXPERIMENTS / f"{name}.toml")
            assert finished.returncode == 0, finished.stderr
            done[name] = out
        return done[name]

    return run_once
