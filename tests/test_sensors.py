"""Sensors of ReentryPlant as model exchange, and what the page on the vehicle says of its gyroscope."""

import csv

import numpy as np
import pytest
from fmpy import simulate_fmu

from conftest import EXPERIMENTS, merged
from fmi import RATES, Instance

SENSORS = ["gyroscope", "accelerometer", "magnetometer"]
SAMPLE = ["measured.sample", "measured.time"]
READINGS = {sensor: [f"measured.{sensor}.{axis}" for axis in "xyz"] for sensor in SENSORS}
ALL = [name for names in READINGS.values() for name in names]
REST = {"disturbance.kind": "none"}
MEMS = 2


def flown(fmu, parameters: dict, steps: int, step: float, names=SAMPLE + ALL) -> np.ndarray:
    rows = []
    with Instance(fmu("ReentryPlant"), REST | parameters).start() as instance:
        for tick in range(steps + 1):
            rows.append(instance.get(names))
            instance.step(tick * step, step)
    return np.array(rows)


def exchanged(fmu, parameters: dict, solver: str):
    plant = fmu("ReentryPlant")
    parameters = REST | parameters
    values = {
        name: plant.item(name, value) if isinstance(value, str) else value for name, value in parameters.items()
    }
    return simulate_fmu(
        str(plant.path),
        fmi_type="ModelExchange",
        solver=solver,
        start_values=values,
        stop_time=1.0,
        step_size=1e-3,
        output_interval=1e-3 if solver == "Euler" else 0.05,
        output=SAMPLE + ALL,
        **({"relative_tolerance": 1e-10} if solver == "CVode" else {}),
    )


@pytest.mark.parametrize("solver", ["CVode", "Euler"])
def test_oracle_model_exchange_takes_the_same_samples(fmu, solver):
    # The vehicle is at rest, so that Euler's errors do not matter; noise, drops and delay do.
    parameters = {"sensor.set": MEMS, "sensor.drop.probability": 0.2, "sensor.delay": 0.025}
    expected = {int(row[0]): row for row in flown(fmu, parameters, 100, 0.01)}
    result = exchanged(fmu, parameters, solver)
    found = {int(row["measured.sample"]): row for row in result}
    assert sorted(found) == sorted(expected) and len(found) > 70
    for number, row in found.items():
        # Readings differ by at most a step of the converter, where the integrators' last bits
        # change the rounding.
        values = np.array([row[name] for name in SAMPLE + ALL])
        tolerance = np.array([0, 1e-9] + [1.4e-4] * 3 + [1.2e-3] * 3 + [1.6e-7] * 3)
        assert (np.abs(values - expected[number]) <= tolerance).all(), number
        assert row["measured.time"] == pytest.approx(0.01 * (number - 1), abs=1e-9) or number == 0


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
