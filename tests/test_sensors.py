"""What the page on the vehicle says of its gyroscope."""

import csv

import numpy as np
import pytest

from conftest import EXPERIMENTS, merged
from fmi import RATES

SENSORS = ["gyroscope", "accelerometer", "magnetometer"]
READINGS = {sensor: [f"measured.{sensor}.{axis}" for axis in "xyz"] for sensor in SENSORS}


def test_regress_what_the_dropped_term_does_to_the_gyroscope_in_the_scenario_of_chai_2022(orchestrate, tmp_path):
    text = merged(EXPERIMENTS / "crmpc-robust.toml")
    wanted = text.replace('"plant.rate.*",', '"plant.rate.*", "plant.measured.gyroscope.*",')
    assert wanted != text
    path = tmp_path / "gyroscope.toml"
    path.write_text(wanted)
    finished, out = orchestrate(path)
    assert finished.returncode == 0, finished.stderr
    with (out / "results.csv").open() as file:
        rows = list(csv.DictReader(file))
    shown, model = (np.array([[float(row[f"plant.{n}"]) for n in names] for row in rows]) for names in (READINGS["gyroscope"], RATES))
    difference = np.degrees(np.linalg.norm(shown - model, axis=1))
    time = np.array([float(row["time"]) for row in rows])
    # docs/vehicle.md states these values in deg/s.
    assert difference.max() == pytest.approx(0.277, abs=2e-3)
    assert np.sqrt(np.mean(difference**2)) == pytest.approx(0.0420, abs=1e-3)
    assert difference[time > 5.0].max() == pytest.approx(0.0038, abs=3e-4)
