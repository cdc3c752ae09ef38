"""AttitudeEstimator behind the sensors of ReentryPlant, stepped by hand: calibration flight,
accuracy, lost and frozen samples."""

import numpy as np

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


def test_oracle_attitude_and_rates_at_rest(fmu):
    """The errors stay below the required 0.2 deg and 0.1 deg/s for the typical set. The true rate
    is the vehicle's drift without a moment."""
    found, true = flown(fmu, {"sensor.seed": 3}, {"sensor.set": 2}, 2000, ANGLES + RATES, ANGLES + RATES)
    errors = np.degrees(found - true)[1:]
    rms = np.sqrt(np.mean(errors**2, axis=0))
    assert np.linalg.norm(rms[:3]) < 0.2, rms
    assert np.all(rms[3:] < 0.1), rms
