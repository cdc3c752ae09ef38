"""The navigation in a closed loop: what it shows against the plant, and what its health says."""

import csv

import numpy as np
import pytest

from conftest import EXPERIMENTS

NAVIGATED = EXPERIMENTS.parent / "entry" / "navigated.toml"
SHOWN = ("attitude.alpha", "attitude.beta", "attitude.sigma")


def fly(orchestrate, *options: str, until: float) -> dict[str, np.ndarray]:
    """Columns of a flight with CRMPC, once a second."""
    finished, out = orchestrate(NAVIGATED, "--stop", str(until), *options)
    assert finished.returncode == 0, finished.stderr
    with open(out / "results.csv", newline="") as file:
        heading, *rows = csv.reader(file)
    return {name: np.array(column, dtype=float) for name, column in zip(heading, zip(*rows))}


def grade(number: int) -> list[str]:
    return ["--set", f"plant.sensor.set={number}", "--set", f"navigation.sensor.set={number}"]


@pytest.mark.parametrize("number", [3, 4, 5])
def test_oracle_errors_stay_within_five_predicted_deviations(orchestrate, number):
    run = fly(orchestrate, *grade(number), until=400.0)
    for name in SHOWN:
        error = np.angle(np.exp(1j * (run[f"navigation.{name}"] - run[f"plant.{name}"])))
        predicted = run[f"navigation.deviation.{name}"]
        assert np.all(np.abs(error) < 5.0 * predicted), name
    assert np.all(np.abs(run["navigation.motion.altitude"] - run["plant.motion.altitude"]) < 5.0 * run["navigation.deviation.position"] + 1.0)


def test_fixes_come_when_signals_are_received(orchestrate):
    run = fly(orchestrate, "--set", "plant.sensor.star.period=0.5", until=400.0)
    altitude, gnss, star = run["plant.motion.altitude"], run["plant.gnss.fix"], run["plant.star.fix"]
    # One fix a second above the blackout, and two of the stars.
    high = altitude > 91e3
    assert np.all(np.diff(gnss[high]) == 1) and np.all(np.diff(star[high]) == 2)
    low = altitude < 84e3
    assert np.ptp(gnss[low]) == 0 and np.ptp(star[low]) == 0 and low.sum() > 100


def test_health_says_when_the_inertial_sensors_bridge(orchestrate):
    run = fly(orchestrate, until=400.0)
    aided, bridging = 2, 3
    assert np.all(run["navigation.health"][run["plant.motion.altitude"] > 86e3][1:] == aided)
    assert run["navigation.health"][-1] == bridging
