"""AttitudeEstimator behind the sensors of ReentryPlant, stepped by hand: calibration flight,
accuracy, lost and frozen samples."""

import numpy as np
import pytest

from fmi import ANGLES, RATES, Instance

PERIOD = 0.01
MEMS = {"sensor.set": 2, "disturbance.kind": "none"}
MEASURED = [f"measured.{sensor}.{axis}" for sensor in ("gyroscope", "accelerometer", "magnetometer") for axis in "xyz"]
MEASURED += ["measured.time", "measured.sample"]


def flown(fmu, plant: dict, estimator: dict, steps: int, names: list[str], truth: list[str] = ANGLES) -> tuple:
    """Returns the outputs of the estimator and of the plant at each tick."""
    found, true = [], []
    with Instance(fmu("ReentryPlant"), MEMS | plant) as vehicle, Instance(fmu("AttitudeEstimator"), estimator) as instance:
        vehicle.start()
        instance.start(inputs=dict(zip(MEASURED, vehicle.get(MEASURED))))
        for tick in range(steps + 1):
            instance.set(dict(zip(MEASURED, vehicle.get(MEASURED))))
            found.append(instance.get(names))
            true.append(vehicle.get(truth))
            vehicle.step(tick * PERIOD, PERIOD)
            instance.step(tick * PERIOD, PERIOD)
    return np.array(found), np.array(true)


def health(fmu, item: str) -> int:
    return fmu("AttitudeEstimator").item("health", item)


def test_oracle_a_calibration_flight_finds_soft_and_hard_iron(fmu):
    """The estimator finds the magnetometer's errors from its readings alone; the plant's parameters
    hold the true errors."""
    matrix = [f"calibration.matrix[{i},{j}]" for i in (1, 2, 3) for j in (1, 2, 3)]
    bias = [f"calibration.bias.{axis}" for axis in "xyz"]
    estimator = {"calibration.mode": "fit", "calibration.duration": 60.0}
    found, _ = flown(fmu, {"calibration.active": True, "sensor.seed": 5}, estimator, 6010, ["calibration.status"] + matrix + bias)
    status = fmu("AttitudeEstimator").item
    assert found[3000, 0] == status("calibration.status", "collecting")
    assert found[-1, 0] == status("calibration.status", "fitted")
    with Instance(fmu("ReentryPlant"), MEMS).start() as plant:
        names = [f"sensor.magnetometer.matrix[{i},{j}]" for i in (1, 2, 3) for j in (1, 2, 3)]
        iron = np.reshape(plant.get(names), (3, 3))
        hard = np.array(plant.get([f"sensor.magnetometer.bias.{axis}" for axis in "xyz"]))
        field = np.linalg.norm(plant.get([f"sensor.field.{axis}" for axis in ("north", "east", "down")]))
    left = np.reshape(found[-1, 1:10], (3, 3)) @ iron * field - np.eye(3)
    assert np.linalg.norm(left, 2) < 5e-3
    assert np.linalg.norm(found[-1, 10:13] - hard) < 2e-3 * field


def test_oracle_attitude_and_rates_at_rest(fmu):
    """The errors stay below the required 0.2 deg and 0.1 deg/s for the typical set. The true rate
    is the vehicle's drift without a moment."""
    found, true = flown(fmu, {"sensor.seed": 3}, {"sensor.set": 2}, 2000, ANGLES + RATES, ANGLES + RATES)
    errors = np.degrees(found - true)[1:]
    rms = np.sqrt(np.mean(errors**2, axis=0))
    assert np.linalg.norm(rms[:3]) < 0.2, rms
    assert np.all(rms[3:] < 0.1), rms


def test_ideal_sensors_unplugged_and_plugged_in(fmu):
    """Without a line, the start values of the inputs give the scenario's start; with the plant's
    true readings the estimate is the truth."""
    with Instance(fmu("AttitudeEstimator")).start() as instance:
        assert np.degrees(instance.get(ANGLES)) == pytest.approx([7.5, 10.0, -30.0], abs=1e-9)
        assert instance.get(["health"]) == [health(fmu, "ok")]
    found, true = flown(fmu, {"sensor.set": 0, "initial.q": 0.02}, {"filter.cutoff": 0.0}, 500, ANGLES)
    assert np.degrees(np.abs(found - true)).max() < 0.01


@pytest.mark.parametrize(
    "plant, item, inside, after",
    [
        ({"sensor.drop.probability": 1.0, "sensor.drop.start": 2.0, "sensor.drop.end": 2.3}, "bridging", 2.2, 2.4),
        ({"sensor.drop.probability": 1.0, "sensor.drop.start": 2.0, "sensor.drop.end": 3.0}, "lost", 2.9, 3.2),
        ({"sensor.gyroscope.freeze.start": 2.0, "sensor.gyroscope.freeze.end": 2.3}, "frozen", 2.2, 2.4),
    ],
)
def test_bad_samples_are_flagged_and_bridged(fmu, plant, item, inside, after):
    found, true = flown(fmu, plant, {"sensor.set": 2}, 500, ["health"] + ANGLES)
    at = lambda time: found[round(time / PERIOD), 0]
    assert at(0.0) == health(fmu, "waiting")
    assert at(1.9) == health(fmu, "ok")
    assert at(inside) == health(fmu, item)
    assert at(after) == health(fmu, "ok")
    errors = np.degrees(np.abs(found[:, 1:] - true))
    assert errors[round(inside / PERIOD)].max() < 2.0
    assert errors[round(after / PERIOD) + 100 :].max() < 1.0
