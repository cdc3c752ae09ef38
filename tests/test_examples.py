"""The programs of scripts/examples run and give the results of the orchestrator."""

import json
import subprocess
import sys

import pytest

from conftest import ROOT, TARGET, results
from conftest import example as built_example

EXAMPLES = ROOT / "scripts" / "examples"


def run(folder, name, *arguments):
    """Runs a program in a folder of its own and returns the text that it prints."""
    command = [sys.executable, EXAMPLES / name, "--fmus", TARGET / "fmu", "--out", ".", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, encoding="utf-8", timeout=120, cwd=folder)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize(("controller", "named"), [("CRMPC", "crmpc-robust"), ("LQR", "lqr")])
def test_closed_loop_is_the_orchestrators(experiment, tmp_path, controller, named):
    said = run(tmp_path, "closed_loop.py", controller)
    found, rows = results(tmp_path, "closed_loop.csv"), results(experiment(named))
    for name, values in found.items():
        component = "controller." if name.startswith(("moment", "reference")) else "" if name == "time" else "plant."
        assert (values == rows[component + name]).all(), name
    metrics = json.loads((experiment(named) / "metrics.json").read_text())
    assert f"EMS {metrics['ems_deg']:.3f} deg" in said


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("01_fly_a_law", "EMS 1.6"),
        ("02_the_guarantee", "in force at 1250 ticks of 1250"),
        ("03_a_delay", "0.117 s, compensated: ‖ω‖ 0.7"),
    ],
)
def test_regress_the_numbered_examples_of_the_laws(name, says):
    done = subprocess.run([built_example(name)], capture_output=True, text=True, encoding="utf-8", timeout=120)
    assert done.returncode == 0, done.stderr
    assert says in done.stdout
