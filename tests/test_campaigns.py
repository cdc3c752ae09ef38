"""The campaigns of orchestrator/experiments/campaigns, each with every controller that it is for."""

import json

import pandas
import pytest

from conftest import EXPERIMENTS, TARGET, call

CAMPAIGNS = EXPERIMENTS.parent / "campaigns"
CONTROLLERS = ["crmpc-robust", "crmpc-paper", "dlmpc-tuned", "lqr"]
# Campaigns that name an experiment in which any controller can fly.
FOR_ANY = sorted(path.stem for path in CAMPAIGNS.glob("*.toml") if "experiment =" in path.read_text("utf-8"))
FOR_CHAI = sorted({path.stem for path in CAMPAIGNS.glob("*.toml")} - set(FOR_ANY))
FMUS = ["CRMPC", "DLMPC", "LQR", "FBL", "BTVSMC", "BTVSMC_DO", "SOTVSMC_DO", "TwoLoopSMC"]


def orchestrator(*arguments, folder) -> str:
    return call(*arguments, "--fmu-dir", TARGET / "fmu", cwd=folder).stdout


def check(campaign, arguments, folder):
    """Checks that a campaign could be flown, without flying it."""
    path = CAMPAIGNS / f"{campaign}.toml"
    work = json.loads(orchestrator("campaign", path, *arguments, "--work", folder=folder))
    assert work["missing"][0][0] == 0 and work["missing"][-1][1] == work["cases"]
    assert not list(folder.iterdir())


@pytest.mark.tier("studies")
@pytest.mark.parametrize("controller", CONTROLLERS)
@pytest.mark.parametrize("campaign", FOR_CHAI)
def test_every_campaign_fits_every_controller(campaign, controller, tmp_path):
    check(campaign, ["--experiment", controller], tmp_path)


@pytest.mark.tier("studies")
@pytest.mark.parametrize("name", FMUS)
@pytest.mark.parametrize("campaign", FOR_ANY)
def test_every_campaign_of_any_controller_fits_every_fmu(campaign, name, tmp_path):
    check(campaign, ["--fmu", f"controller={name}.fmu"], tmp_path)


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_a_case_by_itself_is_the_case_of_the_campaign(controller, tmp_path):
    """All cases but the first are flown by instances that were reset and keep their design."""
    path = CAMPAIGNS / "adversaries.toml"
    told = ["campaign", path, "--experiment", controller, "--out", tmp_path / "out"]
    said = orchestrator(*told, folder=tmp_path)
    assert "8 cases, 8 flown now" in said
    table = pandas.read_parquet(tmp_path / "out" / "cases.parquet")
    for case in (1, 6):
        orchestrator(*told[:-1], tmp_path / str(case), "--case", str(case), "--quiet", folder=tmp_path)
        metrics = json.loads((tmp_path / str(case) / "metrics.json").read_text())
        for name in ("ems_deg", "cms", "max_rate_deg_s", "max_moment_ratio"):
            assert metrics[name] == table[name][case]


@pytest.mark.tier("studies")
@pytest.mark.parametrize("campaign", ["entry", "entry-told"])
def test_what_a_campaign_of_entries_disperses_is_what_crmpc_is_told(campaign, tmp_path):
    """The plant's disturbances and inertia are compared with the declared ones at each step."""
    path = CAMPAIGNS / f"{campaign}.toml"
    orchestrator("campaign", path, "--case", "1", "--quiet", "--out", tmp_path / "case", folder=tmp_path)
    metrics = json.loads((tmp_path / "case" / "metrics.json").read_text())
    assert metrics["guarantee_share"] == 1.0 and metrics["guarantee_unfounded"] is None
    other = ["--set", "controller.inertia.tensorError=0.001"]
    orchestrator("campaign", path, *other, "--case", "1", "--quiet", "--out", tmp_path / "other", folder=tmp_path)
    metrics = json.loads((tmp_path / "other" / "metrics.json").read_text())
    assert "plant.inertia.tensorError" in metrics["guarantee_unfounded"]


def test_a_delay_of_a_case_is_compared_with_the_one_that_crmpc_is_told(tmp_path):
    campaign = tmp_path / "delays.toml"
    campaign.write_text(f"""
title = "Delays that CRMPC is told or not"
experiment = "{EXPERIMENTS / "crmpc-robust.toml"}"
cases = 4
design = "levels"
metrics = ["guarantee_share", "guarantee_unfounded_at"]

[[vary]]
parameter = "plant.actuation.delay"
list = [0.0, 0.02]

[[vary]]
parameter = "controller.delay"
list = [0.0, 0.02]
""")
    orchestrator("campaign", campaign, "--out", tmp_path / "out", folder=tmp_path)
    table = pandas.read_parquet(tmp_path / "out" / "cases.parquet")
    assert (table["guarantee_share"] > 0).sum() >= 3
    in_force = table[table["guarantee_share"] > 0]
    told = in_force["plant.actuation.delay"] == in_force["controller.delay"]
    assert (in_force["guarantee_unfounded_at"].isna() == told).all() and told.sum() == 2
