"""The campaigns of orchestrator/experiments/campaigns with the units, each with every controller that they are for."""

import json
import subprocess

import pytest

from conftest import EXPERIMENTS, TARGET, program

CAMPAIGNS = sorted(path.stem for path in (EXPERIMENTS.parent / "campaigns").glob("*.toml"))
CONTROLLERS = ["crmpc-robust", "crmpc-paper", "dlmpc-tuned", "lqr"]


def orchestrator(*arguments, folder) -> str:
    command = [program("orchestrator"), *arguments, "--fmu-dir", TARGET / "fmu"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=folder, timeout=300)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("controller", CONTROLLERS)
@pytest.mark.parametrize("campaign", CAMPAIGNS)
def test_every_campaign_fits_every_controller(campaign, controller, tmp_path):
    path = EXPERIMENTS.parent / "campaigns" / f"{campaign}.toml"
    work = json.loads(orchestrator("campaign", path, "--experiment", controller, "--work", folder=tmp_path))
    assert work["missing"][0][0] == 0 and work["missing"][-1][1] == work["cases"]
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_a_case_by_itself_is_the_case_of_the_campaign(controller, tmp_path):
    """All cases but the first are flown by units that were reset, whose controllers keep their design."""
    path = EXPERIMENTS.parent / "campaigns" / "adversaries.toml"
    told = ["campaign", path, "--experiment", controller, "--out", tmp_path / "out"]
    said = orchestrator(*told, "--csv", folder=tmp_path)
    assert "8 cases, 8 flown now" in said
    heading, *rows = [line.split(",") for line in (tmp_path / "out" / "cases.csv").read_text().splitlines()]
    for case in (1, 6):
        row = dict(zip(heading, rows[case], strict=True))
        orchestrator(*told[:-1], tmp_path / str(case), "--case", str(case), "--quiet", folder=tmp_path)
        metrics = json.loads((tmp_path / str(case) / "metrics.json").read_text())
        for name in ("ems_deg", "cms", "max_rate_deg_s", "max_moment_ratio"):
            assert metrics[name] == float(row[name])
