"""What the page on the vehicle says of its gyroscope."""

import numpy as np
import pytest

from conftest import EXPERIMENTS, merged, results
from fmi import RATES

READINGS = [f"measured.gyroscope.{axis}" for axis in "xyz"]


def test_regress_what_the_dropped_term_does_to_the_gyroscope_in_the_scenario_of_chai_2022(orchestrate, tmp_path):
    text = merged(EXPERIMENTS / "crmpc-robust.toml")
    wanted = text.replace('"plant.rate.*",', '"plant.rate.*", "plant.measured.gyroscope.*",')
    assert wanted != text
    path = tmp_path / "gyroscope.toml"
    path.write_text(wanted)
    finished, out = orchestrate(path)
    assert finished.returncode == 0, finished.stderr
    rows = results(out)
    shown, model = (rows[[f"plant.{name}" for name in names]].to_numpy() for names in (READINGS, RATES))
    difference, time = np.degrees(np.linalg.norm(shown - model, axis=1)), rows["time"]
    # docs/vehicle.md states these values in deg/s.
    assert difference.max() == pytest.approx(0.277, abs=2e-3)
    assert np.sqrt(np.mean(difference**2)) == pytest.approx(0.0420, abs=1e-3)
    assert difference[time > 5.0].max() == pytest.approx(0.0038, abs=3e-4)
