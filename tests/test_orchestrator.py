"""Figures of merit, repeated runs and warnings of the orchestrator on the packed FMUs."""

import json
import re

import numpy as np
import pytest

from conftest import EXPERIMENTS, merged, results


def metrics(folder) -> dict:
    return json.loads((folder / "metrics.json").read_text())


def changed(tmp_path, old: str, new: str, name: str = "crmpc-robust"):
    """An experiment file with one text replaced."""
    text = merged(EXPERIMENTS / f"{name}.toml")
    assert old in text
    path = tmp_path / "changed.toml"
    path.write_text(text.replace(old, new))
    return path


@pytest.mark.parametrize("name", ["crmpc-robust", "lqr"])
def test_oracle_figures_of_merit_follow_from_the_recorded_trajectory(experiment, name):
    found = metrics(experiment(name))
    data, axes = results(experiment(name)), ("alpha", "beta", "sigma")
    error = data[[f"plant.attitude.{a}" for a in axes]].to_numpy() - data[[f"controller.reference.{a}" for a in axes]].to_numpy()
    moment = np.linalg.norm(data[[f"controller.moment.{a}" for a in "xyz"]], axis=1) / 1.356e5
    rate = np.linalg.norm(data[[f"plant.rate.{a}" for a in "pqr"]], axis=1)
    # The means are taken over the steps, each represented by its beginning.
    assert found["ems_deg"] == pytest.approx(np.degrees(np.sqrt((error[:-1] ** 2).sum(axis=1).mean())), rel=1e-12)
    assert found["cms"] == pytest.approx(np.sqrt((moment[:-1] ** 2).mean()), rel=1e-12)
    assert found["max_rate_deg_s"] == pytest.approx(np.degrees(rate.max()), rel=1e-12)
    assert found["max_moment_ratio"] == pytest.approx(moment.max(), rel=1e-12)


def test_a_vector_is_set_as_a_whole(orchestrate):
    short = [EXPERIMENTS / "lqr.toml", "--stop", "1"]
    given = ["--set", "controller.weight.P=50", "--set", "controller.weight.P[2]=60", "--set", "controller.weight.Q=[1, 2, 3]"]
    entries = [f"controller.weight.P[{k}]={60 if k == 2 else 50}" for k in range(1, 7)]
    entries += [f"controller.weight.Q[{k}]={k}" for k in (1, 2, 3)]
    whole, out = orchestrate(*short, *given)
    single, other = orchestrate(*short, *(word for entry in entries for word in ("--set", entry)))
    assert whole.returncode == single.returncode == 0, whole.stderr
    assert (out / "results.csv").read_bytes() == (other / "results.csv").read_bytes()
    parameters = json.loads((out / "results.json").read_text())["components"]["controller"]["parameters"]
    assert [parameters[f"weight.P[{k}]"] for k in range(1, 7)] == [50, 60, 50, 50, 50, 50]
    refused, _ = orchestrate(*short, "--set", "controller.weight.Q=[1, 2]")
    assert refused.returncode == 2 and "has 2 values, but the entries are weight.Q[1], weight.Q[2], weight.Q[3]" in refused.stderr


def test_a_lost_attitude_ends_the_run(orchestrate):
    finished, out = orchestrate(EXPERIMENTS / "lqr.toml", "--set", "plant.actuation.delay=0.8")
    assert finished.returncode == 3, finished.stderr
    found = re.search(r"attitude lost at t = (\S+) s: the norm of \"error\" exceeds 60 deg", finished.stderr)
    assert found and "attitude lost at" in finished.stdout
    assert metrics(out)["lost_at"] == pytest.approx(float(found[1])) and metrics(out)["completed"] is False
    assert json.loads((out / "results.json").read_text())["status"].startswith("attitude lost at t = ")
    # The last row is that at which the attitude was lost.
    last = (out / "results.csv").read_text().splitlines()[-1]
    assert float(last.split(",")[0]) == metrics(out)["lost_at"]
