"""The navigation in a closed loop: what it shows against the plant, and what its health says."""

import numpy as np
import pandas as pd
import pytest

from conftest import EXPERIMENTS, results

NAVIGATED = EXPERIMENTS.parent / "entry" / "navigated.toml"
SHOWN = ("attitude.alpha", "attitude.beta", "attitude.sigma")


def fly(orchestrate, *options: str, until: float) -> pd.DataFrame:
    """Columns of a flight with CRMPC, once a second."""
    finished, out = orchestrate(NAVIGATED, "--stop", str(until), *options)
    assert finished.returncode == 0, finished.stderr
    return results(out)


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
