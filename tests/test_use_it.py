"""The steps of docs/use-it.md, in their order."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from conftest import ROOT, TARGET, call, program, results

# tests/test_strict.py runs the programs for FMI 3.0, and what follows is for Windows.
PAGE, _ = (ROOT / "docs" / "use-it.md").read_text().split("\n## FMI 3.0\n")
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```$", PAGE, re.DOTALL | re.MULTILINE)
# How the loops of the table of delays are made with the orchestrator, in the table's order.
LOOPS = [
    [],
    ["--coupling", "jacobi"],
    ["--set", "plant.actuation.delay=0.04"],
    ["--coupling", "jacobi", "--set", "plant.actuation.delay=0.04"],
]


@pytest.mark.skipif(
    sys.platform != "linux" or os.uname().machine != "x86_64" or sys.version_info < (3, 11),
    reason="not every importer of the page is there for this platform or Python",
)
def test_the_steps_of_the_page(pytestconfig, libpython, tmp_path):
    for name in ("orchestrator", "scripts", "docs"):
        (tmp_path / name).symlink_to(ROOT / name)
    # The page has programs of the release profile; here are those that were built.
    (tmp_path / "target").mkdir()
    for path in TARGET.iterdir():
        if path.name != "release":
            (tmp_path / "target" / path.name).symlink_to(path)
    (tmp_path / "target" / "release").symlink_to(program("orchestrator").parent)
    (tmp_path / "out").mkdir()
    programs = Path(sys.executable).parent
    environment = {**os.environ, "LIBPYTHON": libpython, "PATH": f"{programs}:{os.environ['PATH']}"}
    for language, text in BLOCKS:
        # Only `scripts/test --with importers` installs fmi-sim.
        if "bin/fmi-sim" in text and not {"all", "importers"} & set(pytestconfig.getoption("--tier")):
            continue
        if language == "toml":
            (tmp_path / "out" / "pd.toml").write_text(text)
            continue
        command = {"sh": ["bash", "-euo", "pipefail", "-c"], "python": [sys.executable, "-c"]}[language]
        done = subprocess.run([*command, text], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120)
        assert done.returncode == 0, text + done.stdout + done.stderr
    made = [path.name for path in (tmp_path / "out").iterdir()]
    expected = "crmpc paced loop.ssp again plant.csv exchange.csv closed_loop.csv archive loop.fmu container.csv PdController.fmu pd".split()
    if {"all", "importers"} & set(pytestconfig.getoption("--tier")):
        expected.append("crmpc.csv")
    assert set(expected) <= set(made)
    assert {language for language, _ in BLOCKS} == {"sh", "python", "toml"}


def test_the_attitudes_by_which_a_tool_shows_its_delay(tmp_path):
    _, table = PAGE.split("| loop | `delay` to set |")
    rows = [line.split(" | ") for line in table.split("\n\n")[0].splitlines()[2:]]
    assert len(rows) == len(LOOPS)
    for row, options in zip(rows, LOOPS):
        experiment = ROOT / "orchestrator" / "experiments" / "crmpc-2022" / "lqr.toml"
        folder = ["--fmu-dir", TARGET / "fmu", "--out", tmp_path, "--force", "--no-plot"]
        call("run", experiment, "--stop", "2", *options, *folder)
        values = results(tmp_path).iloc[-1]
        assert values["time"] == 2.0
        found = [values[f"plant.attitude.{angle}"] for angle in ("alpha", "beta", "sigma")]
        said = [cell.strip(" |").replace("−", "-") for cell in row[2:]]
        assert [f"{value:.6f}" for value in found] == said
