"""The orchestrator's command line on the packed FMUs, and the figures of merit of the paper's
scenario."""

import json
import re
import subprocess

import numpy as np
import pytest

from conftest import EXPERIMENTS, NAMES, archive, merged, program

KEYS = {
    "ems_deg",
    "cms",
    "max_rate_deg_s",
    "max_moment_ratio",
    "solver_ms_mean",
    "solver_ms_p99",
    "solver_ms_max",
    "fallbacks",
    "guarantee_share",
    "guarantee_lost_at",
    "guarantee_status",
    "guarantee_rate_margin_min",
    "guarantee_moment_margin_min",
    "guarantee_broken",
    "real_time_factor",
}


def metrics(folder) -> dict:
    return json.loads((folder / "metrics.json").read_text())


def changed(tmp_path, old: str, new: str, name: str = "crmpc-robust"):
    """An experiment file with one text replaced."""
    text = merged(EXPERIMENTS / f"{name}.toml")
    assert old in text
    path = tmp_path / "changed.toml"
    path.write_text(text.replace(old, new))
    return path


@pytest.mark.parametrize("name", ["crmpc-robust", "crmpc-paper", "lqr"])
def test_a_run_leaves_its_results(experiment, fmu, name):
    out = experiment(name)
    assert {"results.csv", "results.json", "metrics.json", "plot.svg"} <= {path.name for path in out.iterdir()}
    found = metrics(out)
    assert KEYS <= found.keys()
    assert found["completed"] is True
    assert found["loop_delay_s"] == 0.0
    sidecar = json.loads((out / "results.json").read_text())
    assert sidecar["status"] == "completed"
    assert sidecar["seeds"] == {"plant.disturbance.seed": 1, "plant.sensor.seed": 1}
    for component in sidecar["components"].values():
        assert component["guid"] == fmu(component["fmu"].removesuffix(".fmu")).description.guid


def test_regress_robust_keeps_both_limits(experiment):
    found = metrics(experiment("crmpc-robust"))
    assert found["ems_deg"] <= 2.2
    assert found["max_rate_deg_s"] <= 5.0
    assert found["max_moment_ratio"] <= 1.0
    assert found["fallbacks"] == 0


def test_regress_paper_set_tracks_closer_and_violates(experiment):
    found = metrics(experiment("crmpc-paper"))
    assert found["ems_deg"] <= 1.85
    assert found["max_moment_ratio"] > 1.0


def test_regress_lqr_violates_both_limits(experiment):
    found = metrics(experiment("lqr"))
    assert found["max_rate_deg_s"] > 5.0
    assert found["max_moment_ratio"] > 1.0


@pytest.mark.parametrize("scale", [0.95, 1.05])
@pytest.mark.parametrize("kind", ["white", "constant", "square", "alongRate", "againstMoment"])
def test_regress_robust_keeps_both_limits_under_any_disturbance(orchestrate, kind, scale):
    settings = ["--set", f"plant.disturbance.kind={kind}", "--set", f"plant.inertia.scale={scale}"]
    finished, out = orchestrate(EXPERIMENTS / "crmpc-robust.toml", *settings)
    assert finished.returncode == 0, finished.stderr
    used = json.loads((out / "results.json").read_text())["components"]["plant"]["parameters"]
    assert (used["disturbance.kind"], used["inertia.scale"]) == (kind, scale)
    found = metrics(out)
    assert found["max_rate_deg_s"] <= 5.0
    assert found["max_moment_ratio"] <= 1.0
    assert found["fallbacks"] == 0


@pytest.mark.parametrize("name", ["crmpc-robust", "lqr"])
def test_oracle_figures_of_merit_follow_from_the_recorded_trajectory(experiment, name):
    found = metrics(experiment(name))
    data = np.genfromtxt(experiment(name) / "results.csv", delimiter=",", names=True, deletechars="")

    def vector(*names):
        return np.array([data[name] for name in names]).T

    axes = ("alpha", "beta", "sigma")
    error = vector(*(f"plant.attitude.{a}" for a in axes)) - vector(*(f"controller.reference.{a}" for a in axes))
    moment = np.linalg.norm(vector(*(f"controller.moment.{a}" for a in "xyz")), axis=1) / 1.356e5
    rate = np.linalg.norm(vector(*(f"plant.rate.{a}" for a in "pqr")), axis=1)
    # The means are taken over the steps, each represented by its beginning.
    assert found["ems_deg"] == pytest.approx(np.degrees(np.sqrt((error[:-1] ** 2).sum(axis=1).mean())), rel=1e-12)
    assert found["cms"] == pytest.approx(np.sqrt((moment[:-1] ** 2).mean()), rel=1e-12)
    assert found["max_rate_deg_s"] == pytest.approx(np.degrees(rate.max()), rel=1e-12)
    assert found["max_moment_ratio"] == pytest.approx(moment.max(), rel=1e-12)


def test_runs_repeat_bit_for_bit(experiment, orchestrate):
    finished, out = orchestrate(EXPERIMENTS / "crmpc-robust.toml")
    assert finished.returncode == 0
    assert (out / "results.csv").read_bytes() == (experiment("crmpc-robust") / "results.csv").read_bytes()


def test_the_summary_names_the_figures(orchestrate):
    finished, _ = orchestrate(EXPERIMENTS / "lqr.toml")
    for word in ("EMS", "CMS", "deg"):
        assert word in finished.stdout


@pytest.mark.parametrize(
    "old, new, hint",
    [
        ('constraints = "robust"', 'constraint = "robust"', "constraints"),
        ('constraints = "robust"', 'constraints = "robbust"', "robust"),
        ('to = "plant.moment.*"', 'to = "plant.momment.*"', "moment"),
        ('"disturbance.bound" = "2 deg/s2"', '"disturbance.bound" = "2 deg/s"', "disturbance.bound"),
        ("CRMPC.fmu", "CRMCP.fmu", "CRMPC.fmu"),
        ('unconnected = ["disturbanceMoment.*", ', "unconnected = [", "disturbanceMoment"),
        ('horizon = 100', 'horizon = 1', "horizon"),
        ("stop = 50.0", "stop = 50.01", "50.01"),
    ],
)
def test_a_bad_experiment_is_refused_with_the_culprit(orchestrate, tmp_path, old, new, hint):
    finished, _ = orchestrate(changed(tmp_path, old, new))
    assert finished.returncode == 2, finished.stderr
    assert hint in finished.stderr


def test_an_instance_that_fails_ends_the_run(orchestrate, tmp_path):
    path = changed(tmp_path, '"feedback.k1" = -1.5', '"feedback.k1" = -5000.0')
    finished, _ = orchestrate(path)
    assert finished.returncode == 1, finished.stderr
    assert "controller" in finished.stderr and "spectral radius" in finished.stderr


def test_a_lost_attitude_ends_the_run(orchestrate, tmp_path):
    path = changed(tmp_path, "beyond = 60.0", "beyond = 1.0", "lqr")
    finished, out = orchestrate(path)
    assert finished.returncode == 3, finished.stderr
    found = re.search(r"attitude lost at t = (\S+) s: the norm of \"error\" exceeds 1 deg", finished.stderr)
    assert found and "attitude lost at" in finished.stdout
    assert metrics(out)["lost_at"] == pytest.approx(float(found[1])) and metrics(out)["completed"] is False
    assert json.loads((out / "results.json").read_text())["status"].startswith("attitude lost at t = ")
    # The last row is that at which the attitude was lost.
    last = (out / "results.csv").read_text().splitlines()[-1]
    assert float(last.split(",")[0]) == metrics(out)["lost_at"]


def test_usage():
    finished = subprocess.run([program("orchestrator"), "rum"], capture_output=True, text=True)
    assert finished.returncode == 2
    assert "run" in finished.stderr


@pytest.mark.parametrize("name", NAMES)
def test_inspect_shows_every_variable(fmu, name):
    finished = subprocess.run([program("orchestrator"), "inspect", archive(name)], capture_output=True, text=True)
    assert finished.returncode == 0, finished.stderr
    for variable in fmu(name).variables:
        assert re.search(rf"(?m)(^|\s){re.escape(variable)}(\s|$)", finished.stdout), variable


def test_list_shows_experiments_and_fmus():
    finished = subprocess.run([program("orchestrator"), "list", EXPERIMENTS], capture_output=True, text=True)
    assert finished.returncode == 0, finished.stderr
    assert "crmpc-robust" in finished.stdout
    finished = subprocess.run(
        [program("orchestrator"), "list", archive("CRMPC").parent], capture_output=True, text=True
    )
    assert finished.returncode == 0, finished.stderr
    for name in NAMES:
        assert name in finished.stdout


@pytest.mark.parametrize(("kind", "warns"), [("constant", True), ("white", False)])
def test_a_seed_that_changes_nothing_is_told(orchestrate, kind, warns):
    settings = ["--set", f"plant.disturbance.kind={kind}", "--set", "plant.disturbance.seed=7"]
    finished, _ = orchestrate(EXPERIMENTS / "lqr.toml", *settings)
    assert finished.returncode == 0, finished.stderr
    text = "disturbance.seed has no effect: it is used with disturbance.kind = white"
    assert (text in finished.stderr) == warns, finished.stderr
