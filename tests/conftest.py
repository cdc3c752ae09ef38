"""Fixtures of the tests: FMUs, programs and experiments of the built project
(scripts/build-fmus)."""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import importers
from browsing import ARGUMENTS, CHROMIUM
from fmi import Fmu

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).resolve().parent.parent
# The tests import what scripts/yardsticks and the examples run.
sys.path += [str(ROOT / "scripts" / folder) for folder in ("oracles", "examples", "pages", "benchmarks")]
TARGET = ROOT / os.environ.get("CARGO_TARGET_DIR", "target")
EXPERIMENTS = ROOT / "orchestrator" / "experiments" / "crmpc-2022"
NAMES = [
    "ReentryPlant",
    "CRMPC",
    "DLMPC",
    "LQR",
    "FBL",
    "BTVSMC",
    "BTVSMC_DO",
    "SOTVSMC_DO",
    "TwoLoopSMC",
    "ControlAllocator",
    "AttitudeEstimator",
    "EntryGuidance",
    "EntryNavigation",
]

# The pandas for Python 3.10 reads numbers to the last bit only if it is told.
EXACT = {"float_precision": "round_trip"} if pd.__version__ < "3" else {}
# What `scripts/test` leaves out unless it is told, as it needs more programs or more time.
TIERS = ("browser", "importers", "manual", "memory", "platforms", "release", "studies", "wheel", "windows")

# The files that take longest. Begun first, none of them runs alone at the end while the other
# processes of scripts/test have nothing left to do.
LONGEST = ["test_reproduce.py", "test_wheel.py", "test_platforms.py", "test_manual.py"]


def newest(*candidates: Path) -> Path:
    """The file that was built last."""
    found = [path for path in candidates if path.is_file()]
    assert found, f"none of {candidates} exists: run scripts/build-fmus"
    return max(found, key=lambda path: path.stat().st_mtime)


def program(name: str) -> Path:
    """Path of a built program."""
    file = name + (".exe" if os.name == "nt" else "")
    return newest(*(TARGET / profile / file for profile in ("release", "debug")))


def archive(name: str) -> Path:
    """Path of a packed FMU."""
    path = TARGET / "fmu" / f"{name}.fmu"
    assert path.is_file(), f"{path} does not exist: run scripts/build-fmus"
    return path


def archive3(name: str) -> Path:
    """Path of a packed FMU for FMI 3.0."""
    path = TARGET / "fmi3" / f"{name}.fmu"
    assert path.is_file(), f"{path} does not exist: run scripts/build-fmus"
    return path


def library(crate: str) -> Path:
    """Path of the built library of a crate."""
    names = (f"lib{crate}.so", f"lib{crate}.dylib", f"{crate}.dll")
    return newest(*(TARGET / profile / name for profile in ("release", "debug") for name in names))


def example(name: str) -> Path:
    """A built example of a crate: scripts/test builds those that are run."""
    file = name + (".exe" if os.name == "nt" else "")
    return newest(*(TARGET / profile / "examples" / file for profile in ("release", "debug")))


@pytest.fixture(scope="session")
def tool():
    """Path of a program that came with a Python package."""

    def path(name: str) -> Path:
        found = Path(sys.executable).parent / (name + (".exe" if os.name == "nt" else ""))
        assert found.is_file(), f"{found} does not exist: install tests/requirements.txt"
        return found

    return path


@pytest.fixture(scope="module")
def chromium():
    """A headless Chromium. It is closed after each file, as other tests need the thread's event loop."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        yield browser
        browser.close()


@pytest.fixture(scope="session")
def libpython() -> str:
    """Path of Python's shared library. FMUs by PythonFMU expect the importer to have it in the
    process."""
    name, folder, platform = (sysconfig.get_config_var(key) or "" for key in ("INSTSONAME", "LIBDIR", "MULTIARCH"))
    found = [path for path in (Path(folder, name), Path(folder, platform, name)) if ".so" in name and path.is_file()]
    assert found, f"{name} is not in {folder}: on Debian and Ubuntu install the package libpython3-dev"
    return str(found[0])


@pytest.fixture
def agree(request):
    """Compares an importer's values with ours. Errors are relative to the largest value of each
    column and must keep the bound of the test's mark."""
    within = request.node.get_closest_marker("importer").kwargs["within"]

    def compare(found: np.ndarray, expected: np.ndarray) -> None:
        assert found.shape == expected.shape
        largest = np.abs(expected).max(axis=0)
        error = np.abs(found - expected).max(axis=0)
        assert (error <= within * largest).all(), f"{np.max(error / np.where(largest > 0.0, largest, 1.0))} > {within}"

    return compare


@pytest.fixture(scope="session")
def fmu(tmp_path_factory):
    """Opens an FMU by its name, once per session."""
    return cache(lambda name: Fmu.open(archive(name), tmp_path_factory.mktemp(name)))


@pytest.fixture(scope="session")
def fmu3(tmp_path_factory):
    """Opens an FMU of FMI 3.0 by its name, once per session."""
    return cache(lambda name: Fmu.open(archive3(name), tmp_path_factory.mktemp(name)))


def call(*arguments: object, code: int | None = 0, **options) -> subprocess.CompletedProcess:
    """Runs the orchestrator, which must end with this exit code if one is given."""
    done = subprocess.run([program("orchestrator"), *arguments], capture_output=True, text=True, timeout=300, **options)
    assert code in (None, done.returncode), done.stdout + done.stderr
    return done


def merged(experiment: Path) -> str:
    """An experiment with all that it extends, as one text that can stand in any folder."""
    return call("show", experiment).stdout


def results(folder: Path, name: str = "results.csv") -> pd.DataFrame:
    """The recorded rows of a run, to the last bit, by the names of the variables without their units."""
    return pd.read_csv(folder / name, **EXACT).rename(columns=lambda name: name.split(" ")[0])


@pytest.fixture(scope="session")
def orchestrate(tmp_path_factory):
    """Runs the orchestrator with the packed FMUs and returns the finished process and the folder of
    its results."""

    def run(experiment: Path, *arguments: str) -> tuple[subprocess.CompletedProcess, Path]:
        out = tmp_path_factory.mktemp(experiment.stem)
        command = [program("orchestrator"), "run", experiment, "--out", out, "--fmu-dir", TARGET / "fmu", *arguments]
        # The run starts outside the project, so that it finds no file by accident.
        finished = subprocess.run(command, capture_output=True, text=True, cwd=out, timeout=120)
        return finished, out

    return run


@pytest.fixture(scope="session")
def experiment(orchestrate):
    """Returns the results folder of an experiment of Chai 2022, which is run once per session."""
    done: dict[str, Path] = {}

    def run_once(name: str) -> Path:
        if name not in done:
            finished, out = orchestrate(EXPERIMENTS / f"{name}.toml")
            assert finished.returncode == 0, finished.stderr
            done[name] = out
        return done[name]

    return run_once


# The table of docs/use-it.md holds the outcomes of the tests marked `importer`.


def pytest_addoption(parser):
    parser.addoption("--write-importers", action="store_true", help="write the table of docs/use-it.md anew")
    parser.addoption("--tier", action="append", default=[], choices=[*TIERS, "all"], help="run these tests as well")


def pytest_configure(config):
    config.addinivalue_line(
        "markers",
        "importer(importer, use, fmu, plant, within, to): a row of docs/use-it.md. The FMU is that of the parameter `name`, unless "
        "it is given, and with `plant` ReentryPlant too. Results are `within` a share of the largest value `to` a reference.",
    )
    config.addinivalue_line("markers", "tier(name): left out by `scripts/test`, unless it is called --with this name or --all")
    config.stash[importers.FINDINGS] = importers.Findings(NAMES)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """Lets one process run all tests of a file, and those of files that belong together."""
    from xdist.scheduler import LoadScopeScheduling

    together = {path.name: "importers" for path in importers.files()}
    # Both make what scripts/wheel needs.
    together |= {"test_wheel.py": "wheel", "test_release.py": "wheel"}

    class ByFile(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            name = Path(nodeid.split("::")[0]).name
            return together.get(name, name)

    return ByFile(config, log)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config, items):
    chosen = config.getoption("--tier")
    for item in items:
        left_out = [] if "all" in chosen else [mark.args[0] for mark in item.iter_markers("tier") if mark.args[0] not in chosen]
        assert set(left_out) <= set(TIERS), f"{item.nodeid} is of no tier that there is"
        if left_out:
            item.add_marker(pytest.mark.skip(reason=f"scripts/test --with {left_out[0]} runs this"))
    config.stash[importers.FINDINGS].expect(items)
    rank = {name: place for place, name in enumerate(LONGEST)}
    items.sort(key=lambda item: rank.get(item.path.name, len(rank)))


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item, call):
    report = (yield).get_result()
    if report.when == "call" or not report.passed:
        item.config.stash[importers.FINDINGS].note(item, report.outcome)


def pytest_sessionfinish(session):
    if session.config.getoption("--write-importers"):
        session.config.stash[importers.FINDINGS].write()
