"""Sensors of ReentryPlant: their readings at rest, along the calibration sequence, through lost
samples, in both interfaces. The errors are those of vehicle/data/sensors.toml, read back from the
FMU's parameters."""

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
OFF, IDEAL, MEMS = 0, 1, 2


def matrix(sensor: str) -> list[str]:
    return [f"sensor.{sensor}.matrix[{i},{j}]" for i in (1, 2, 3) for j in (1, 2, 3)]


def errors(instance: Instance, sensor: str) -> tuple[np.ndarray, np.ndarray]:
    """Returns A and b of m = A h + b."""
    bias = instance.get([f"sensor.{sensor}.bias.{axis}" for axis in "xyz"])
    return np.reshape(instance.get(matrix(sensor)), (3, 3)), np.array(bias)


def flown(fmu, parameters: dict, steps: int, step: float, names=SAMPLE + ALL) -> np.ndarray:
    rows = []
    with Instance(fmu("ReentryPlant"), REST | parameters).start() as instance:
        for tick in range(steps + 1):
            rows.append(instance.get(names))
            instance.step(tick * step, step)
    return np.array(rows)


def test_oracle_mean_and_deviation_at_rest_are_those_of_the_parameters(fmu):
    count = 4000
    rows = flown(fmu, {"sensor.set": MEMS}, count, 0.01)
    # The delay is less than a period, so at the end of a step the sample of its beginning has
    # arrived.
    assert rows[1:, 0].tolist() == list(range(1, count + 1))
    np.testing.assert_allclose(rows[1:, 1], 0.01 * np.arange(count), rtol=0, atol=1e-12)
    with Instance(fmu("ReentryPlant"), REST).start() as instance:
        for i, sensor in enumerate(SENSORS):
            a, b = errors(instance, sensor)
            expected = a @ instance.get(READINGS[sensor]) + b
            noise, step = instance.get([f"sensor.{sensor}.noise", f"sensor.{sensor}.resolution"])
            deviation = np.hypot(noise, step / np.sqrt(12))
            found = rows[1:, 2 + 3 * i : 5 + 3 * i]
            # The bounds are five standard deviations of each estimate.
            assert np.abs(found.mean(axis=0) - expected).max() < 5 * deviation / np.sqrt(count)
            assert np.abs(found.std(axis=0) / deviation - 1).max() < 5 / np.sqrt(2 * count)
            np.testing.assert_allclose(found / step, np.round(found / step), rtol=0, atol=1e-6)


def test_oracle_the_gyroscope_measures_the_change_of_orientation_whatever_the_kinematics(fmu):
    def orientation(angles: np.ndarray) -> np.ndarray:
        (sa, sb, ss), (ca, cb, cs) = np.sin(angles), np.cos(angles)
        bank = np.array([[1, 0, 0], [0, cs, -ss], [0, ss, cs]])
        sideslip = np.array([[cb, -sb, 0], [sb, cb, 0], [0, 0, 1]])
        attack = np.array([[ca, 0, -sa], [0, 1, 0], [sa, 0, ca]])
        return attack @ sideslip @ bank

    names = [f"attitude.{axis}" for axis in ("alpha", "beta", "sigma")] + READINGS["gyroscope"] + RATES
    start = {"initial.p": 0.3, "initial.q": -0.2, "initial.r": 0.4}
    step = 1e-3
    for kinematics in ("printed", "exact"):
        rows = flown(fmu, {"kinematics": kinematics, "integrator.step": step, **start}, 400, step, names)
        turned = np.array([orientation(row[:3]) for row in rows])
        # A fourth-order difference gives dC/dt, and dC/dt C' = -omega^x.
        slope = (turned[:-4] - 8 * turned[1:-3] + 8 * turned[3:-1] - turned[4:]) / (12 * step)
        spin = -slope @ turned[2:-2].transpose(0, 2, 1)
        expected = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
        assert np.abs(rows[2:-2, 3:6] - expected).max() < 1e-9
        # The value by hand is alpha_dot = -0.2617 rad/s at the start, times sin 10 deg.
        off = np.linalg.norm(rows[:, 3:6] - rows[:, 6:9], axis=1)
        assert not off.any() if kinematics == "exact" else off[0] == pytest.approx(0.04544, abs=1e-5)


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


def test_oracle_the_calibration_sequence_determines_hard_and_soft_iron(fmu):
    # |A^-1 (m - b)| is the field's strength, so the readings lie on an ellipsoid, which is fitted
    # by least squares.
    m = flown(fmu, {"sensor.set": MEMS, "calibration.active": True}, 12000, 0.01, READINGS["magnetometer"])[1:]
    scale = 5e-5
    x, y, z = m.T / scale
    design = np.stack([x * x, y * y, z * z, 2 * x * y, 2 * x * z, 2 * y * z, 2 * x, 2 * y, 2 * z], axis=1)
    v = np.linalg.lstsq(design, np.ones(len(m)), rcond=None)[0]
    q = np.array([[v[0], v[3], v[4]], [v[3], v[1], v[5]], [v[4], v[5], v[2]]])
    center = -np.linalg.solve(q, v[6:])
    q = q / (1.0 + center @ q @ center)
    with Instance(fmu("ReentryPlant"), REST).start() as instance:
        a, b = errors(instance, "magnetometer")
        strength = np.linalg.norm(instance.get([f"sensor.field.{axis}" for axis in ("north", "east", "down")]))
    # The noise is 0.3 uT in 12000 samples; the fit's own bias is of the size of the squared noise
    # over the field.
    np.testing.assert_allclose(center * scale, b, rtol=0, atol=5e-8)
    inverse = np.linalg.inv(a)
    expected = inverse.T @ inverse * (scale / strength) ** 2
    np.testing.assert_allclose(q, expected, rtol=0, atol=2e-3 * np.abs(expected).max())


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
