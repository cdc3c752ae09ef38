"""The environment of gymnasium, and the example that acts in it."""

import importlib
import re
import subprocess
import sys
import warnings

import numpy as np
import pytest
import reentry_fmus
from conftest import ROOT
from laws import pd as pd_law
from reentry_fmus import ClosedLoop

gymnasium = pytest.importorskip("gymnasium")
from gymnasium.utils.env_checker import check_env  # noqa: E402
from reentry_fmus.environment import ID, AttitudeEnv  # noqa: E402

LIMIT = 1.356e5


@pytest.fixture
def env():
    env = AttitudeEnv(stop=2.0)
    yield env
    env.close()


def flown(env, seed, actions=50):
    """Observations and rewards of an episode of random actions, which are those of the seed."""
    env.action_space.seed(seed)
    steps = [env.reset(seed=seed)[0]]
    for _ in range(actions):
        observation, reward, *_ = env.step(env.action_space.sample())
        steps += [observation, reward]
    return np.hstack(steps)


def test_gymnasiums_checker_has_no_complaint():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gymnasium.make(ID, stop=1.0)
        check_env(env.unwrapped)
        env.close()


def test_the_same_seed_gives_the_same_episode(env):
    first = flown(env, 1)
    assert np.array_equal(flown(env, 1), first)
    assert not np.array_equal(flown(env, 2), first)
    other = AttitudeEnv(stop=2.0)
    assert np.array_equal(flown(other, 1), first)
    other.close()
    # Without a seed another disturbance follows, which is that of the first seed, too.
    _, first = env.reset(seed=5)
    _, second = env.reset()
    _, again = env.reset(seed=5)
    assert again["disturbance_seed"] == first["disturbance_seed"] != second["disturbance_seed"]
    assert env.reset()[1]["disturbance_seed"] == second["disturbance_seed"]


def test_oracle_an_episode_is_the_flight_of_a_closed_loop():
    """The agent's actions as a law; observations and rewards from the table, by the docstring."""
    env = AttitudeEnv(stop=10.0)
    _, info = env.reset(seed=3)
    parameters = {"plant.disturbance.seed": info["disturbance_seed"]}
    with ClosedLoop(parameters=parameters) as loop:
        run = loop.run(10.0, pd_law)
        limited = np.linalg.norm(run.table.iloc[:, -3:], axis=1).max()
    assert limited < LIMIT
    rewards = []
    for row in run.table.iloc[:-1, -3:].to_numpy():
        # As float64, so that the moment is that of the law to the last digit but one.
        observation, reward, terminated, truncated, info = env.step(row / LIMIT)
        rewards.append(reward)
    assert (terminated, truncated) == (False, True) and info["time"] == 10.0
    table = run.table
    angles = table[[f"plant.attitude.{a}" for a in ("alpha", "beta", "sigma")]].to_numpy()
    reference = table[[f"controller.reference.{a}" for a in ("alpha", "beta", "sigma")]].to_numpy()
    rates = table[[f"plant.rate.{axis}" for axis in "pqr"]].to_numpy()
    moments = table.iloc[:, -3:].to_numpy() / LIMIT
    error = angles - reference
    assert observation[:3] == pytest.approx(error[-1], rel=1e-6, abs=1e-9)
    assert observation[6:9] == pytest.approx(rates[-1], rel=1e-6, abs=1e-9)
    assert observation[9:12] == pytest.approx(reference[-1], rel=1e-6)
    assert observation[12:] == pytest.approx(moments[-2], rel=1e-6)
    excess = np.maximum(0.0, np.degrees(np.linalg.norm(rates[1:], axis=1)) / 5.0 - 1.0)
    expected = -0.04 * (
        np.square(np.degrees(error[1:])).sum(axis=1)
        + 0.1 * np.square(moments[:-1]).sum(axis=1)
        + 10.0 * excess**2
    )
    assert rewards == pytest.approx(expected, rel=1e-6)
    env.close()


def test_actions_keep_the_moment_limit(env):
    env.reset(seed=1)
    *_, info = env.step(np.ones(3, np.float32))
    assert np.linalg.norm(info["moment"]) == pytest.approx(LIMIT)
    *_, info = env.step(np.array([0.5, 0.0, 0.0], np.float32))
    assert info["moment"].tolist() == [LIMIT / 2, 0.0, 0.0]


def test_an_episode_that_is_lost_terminates():
    env = AttitudeEnv(stop=50.0, moment_limit=3e7)
    env.reset(seed=1)
    action = np.array([0.0, 0.7, 0.7], np.float32)
    for step in range(1, 1251):
        observation, reward, terminated, truncated, info = env.step(action)
        if terminated or truncated:
            break
    assert terminated and not truncated and step < 100
    assert reward < -100.0 * (50.0 - info["time"])
    assert env.observation_space.contains(observation)
    # The vehicle's FMU, which may have refused, begins again.
    observation, info = env.reset(seed=1)
    assert info["time"] == 0.0 and env.observation_space.contains(observation)
    env.close()


def test_parameters_are_those_of_the_loop(env):
    start = env.reset(seed=1)[0]
    tilted, _ = env.reset(seed=1, options={"parameters": {"plant.initial.beta": 0.2}})
    assert tilted[1] == pytest.approx(0.2) and start[1] != tilted[1]
    assert np.array_equal(env.reset(seed=1)[0], start)
    _, info = env.reset(seed=1, options={"parameters": {"plant.disturbance.seed": 7}})
    assert info["disturbance_seed"] == 7
    with pytest.raises(ValueError, match="no positive multiple of 0.04 s"):
        AttitudeEnv(stop=1.01)
    with pytest.raises(ValueError, match="moment_limit"):
        AttitudeEnv(moment_limit=0.0)


def test_the_docstring_names_what_there_is(env):
    said = AttitudeEnv.__doc__
    ranges = [(0, 2), (3, 5), (6, 8), (9, 11), (12, 14)]
    assert all(re.search(rf"^ *{first} to {last}  ", said, re.M) for first, last in ranges)
    assert env.observation_space.shape == (15,) and env.action_space.shape == (3,)
    high = env.observation_space.high
    assert high[[0, 3, 6, 9, 12]] == pytest.approx([np.pi / 3, np.pi, np.pi, np.pi, 1.0], rel=1e-6)
    for word in ("rad/s", "N m", "terminates", "truncated", "reward", "60 deg", "180 deg/s"):
        assert word in said


def test_the_example_runs(tmp_path):
    example = ROOT / "python" / "examples" / "gymnasium_agents.py"
    run = [sys.executable, example, "--stop", "10"]
    done = subprocess.run(run, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert [line.split(":")[0] for line in lines] == ["no moment", "random", "PD"]
    returns = [float(line.split("return ")[1].split(",")[0]) for line in lines]
    assert returns[2] > returns[0] and returns[2] > returns[1]
    again = subprocess.run(run, cwd=tmp_path, capture_output=True, text=True)
    assert again.stdout == done.stdout


def test_a_missing_package_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "gymnasium", None)
    monkeypatch.delitem(sys.modules, "reentry_fmus.environment")
    monkeypatch.delattr(reentry_fmus, "environment", raising=False)
    with pytest.raises(ModuleNotFoundError) as caught:
        importlib.import_module("reentry_fmus.environment")
    assert 'pip install "reentry-fmus[gymnasium]"' in str(caught.value)
