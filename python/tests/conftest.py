"""Tests of the installed package. tests/test_wheel.py installs the wheel into fresh environments
and runs them there; they start in a folder outside the project."""

import gc
import os
import signal
import sys
import tempfile
from pathlib import Path

import pytest
import reentry_fmus
from reentry_fmus._data import experiment_path

ROOT = Path(__file__).resolve().parents[2]
assert ROOT / "python" / "src" not in Path(reentry_fmus.__file__).parents, "install the wheel"
# The pages are checked as they are in the repository: a page, and how many blocks it has at least.
PAGES = {ROOT / "docs" / "python.md": 5, ROOT / "python" / "README.md": 4, ROOT / "README.md": 1}
SHORT = """
title = "Short"
experiment = "short.toml"
cases = 50
metrics = ["ems_deg"]

[[vary]]
parameter = "plant.disturbance.seed"
case = 1
"""


def usual_signals():
    """Ends the ignoring of signals in a new process, for `preexec_fn`: `nohup` and a shell that starts
    the tests in the background make their processes ignore some."""
    for number in (signal.SIGHUP, signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_DFL)


USUAL = {} if os.name == "nt" else {"preexec_fn": usual_signals}


def pytest_configure():
    """A process that was started with Ctrl-C ignored has no handler that raises KeyboardInterrupt."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def short(tmp_path):
    """A campaign of two parts, which are flown in no time."""
    (tmp_path / "short.toml").write_text(
        f"title = 'LQR for 1 s'\nextends = '{experiment_path('lqr')}'\n[simulation]\nstop = 1.0\n"
    )
    (tmp_path / "campaign.toml").write_text(SHORT)
    return tmp_path / "campaign.toml"


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    """Folder in which temporary files and folders are made. The collector of garbage, which would
    tidy up some time later, is off."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    gc.disable()
    yield folder
    gc.enable()


def pytest_report_header():
    return f"{Path(reentry_fmus.__file__).parent} on Python {sys.version}"
