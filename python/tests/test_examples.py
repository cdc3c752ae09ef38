"""The programs of python/examples."""

import importlib
import re
import subprocess
import sys

import numpy as np
import pytest
from conftest import ROOT
from laws import pd as pd_law
from reentry_fmus import ClosedLoop, experiment

EXAMPLES = ROOT / "python" / "examples"


@pytest.fixture
def example(monkeypatch):
    monkeypatch.syspath_prepend(EXAMPLES)
    return importlib.import_module


def test_oracle_a_flight_on_a_globe_points_along_its_path(example):
    pytest.importorskip("scipy")
    run = experiment("from-120km", stop=400.0)
    document, vehicle, track = example("entry_on_a_globe").czml(run)
    assert document["name"] == run.title and len(track["polyline"]["positions"]["cartesian"]) == 3 * len(run.table)
    time, *position = np.reshape(vehicle["position"]["cartesian"], (-1, 4)).T
    assert np.array_equal(time, run.table.index)
    _, *vector, scalar = np.reshape(vehicle["orientation"]["unitQuaternion"], (-1, 5)).T
    alpha, beta = (run.table[f"plant.attitude.{name}"] for name in ("alpha", "beta"))
    velocity = np.array([np.cos(alpha) * np.cos(beta), np.sin(beta), np.sin(alpha) * np.cos(beta)])
    # By the formula of Rodrigues, against differences of the position.
    across = np.cross(vector, velocity, axis=0)
    turned = velocity + 2 * (scalar * across + np.cross(vector, across, axis=0))
    flown = np.gradient(position, time, axis=1)
    flown /= np.linalg.norm(flown, axis=0)
    assert (turned * flown).sum(axis=0)[1:-1].min() > 1 - 1e-6
    # The lift, against the body's z-axis, points away from the planet unless the bank exceeds 90 degrees.
    axis = np.array([0.0, 0.0, -1.0])[:, None] * np.ones_like(time)
    across = np.cross(vector, axis, axis=0)
    lift = axis + 2 * (scalar * across + np.cross(vector, across, axis=0))
    assert ((lift * position).sum(axis=0) > 0).all()


def test_oracle_an_episode_is_the_flight_of_a_closed_loop(example):
    """The agent's actions as a law; observations and rewards from the table."""
    pytest.importorskip("gymnasium")
    from gymnasium.utils.env_checker import check_env

    module = example("gymnasium_environment")
    env = module.AttitudeEnv(stop=10.0)
    check_env(env, skip_render_check=True)
    env.reset(seed=3)
    seed = int(np.random.Generator(np.random.PCG64(np.random.SeedSequence(3))).integers(2**31))
    with ClosedLoop(parameters={"plant.disturbance.seed": seed}) as loop:
        table = loop.run(10.0, pd_law).table
    moments = table.iloc[:, -3:].to_numpy() / module.MOMENT_LIMIT
    assert np.linalg.norm(moments, axis=1).max() < 1.0
    # As float64, so that the moment is that of the law to the last digit but one.
    steps = [env.step(moment) for moment in moments[:-1]]
    observation, _, terminated, truncated, info = steps[-1]
    assert (terminated, truncated) == (False, True) and info["time"] == 10.0
    angles = ("alpha", "beta", "sigma")
    reference = table[[f"controller.reference.{angle}" for angle in angles]].to_numpy()
    error = table[[f"plant.attitude.{angle}" for angle in angles]].to_numpy() - reference
    rates = table[[f"plant.rate.{axis}" for axis in "pqr"]].to_numpy()
    assert observation[:3] == pytest.approx(error[-1], rel=1e-6, abs=1e-9)
    assert observation[6:] == pytest.approx([*rates[-1], *reference[-1], *moments[-2]], rel=1e-6, abs=1e-9)
    excess = np.maximum(0.0, np.degrees(np.linalg.norm(rates[1:], axis=1)) / 5.0 - 1.0)
    cost = np.square(np.degrees(error[1:])).sum(axis=1) + 0.1 * np.square(moments[:-1]).sum(axis=1) + 10.0 * excess**2
    assert [reward for _, reward, *_ in steps] == pytest.approx(-0.04 * cost, rel=1e-6)
    env.close()


def test_agents_are_compared():
    pytest.importorskip("gymnasium")
    done = subprocess.run([sys.executable, EXAMPLES / "gymnasium_environment.py"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    by_chance, by_feedback = map(float, re.findall(r"return (\S+),", done.stdout))
    assert by_feedback > by_chance
