"""Entry flights of ReentryPlant: co-simulation against model exchange by CVode, the end of a flight
as FMI 2.0 says it, and the orchestrator's."""

import csv
import json

import numpy as np
import pytest
from fmpy import simulate_fmu
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import fmi2Discard, fmi2LastSuccessfulTime, fmi2Terminated

from conftest import EXPERIMENTS
from fmi import Instance

MOTION = [f"motion.{name}" for name in ("altitude", "longitude", "latitude", "speed", "flightPathAngle", "heading")]
# A flight of some 2,000 s that follows a prescribed attitude through wind and a gust.
FLIGHT = {
    "translation": "entry",
    "kinematics": "exact",
    "disturbance.kind": "none",
    "prescribed.active": True,
    "initial.alpha": 0.5,
    "initial.beta": 0.0,
    "initial.sigma": 0.6,
    "initial.p": 0.0,
    "initial.q": 0.0,
    "initial.r": 0.0,
    "initial.altitude": 80e3,
    "initial.speed": 7400.0,
    "initial.flightPathAngle": np.radians(-1.0),
    "air.rows": 2,
    "air.altitude[2]": 80e3,
    "air.densityRatio[1]": 0.95,
    "air.densityRatio[2]": 1.1,
    "air.wind.north[1]": 10.0,
    "air.wind.east[2]": 30.0,
    "gust.down": -10.0,
    "gust.start": 700.0,
    "gust.duration": 20.0,
}
INPUTS = {"prescribed.alpha": 0.5, "prescribed.sigma": 0.6}
STEP = 0.5


def flown(fmu, until: float) -> tuple[float, np.ndarray]:
    """Time and motion at the end of a flight in co-simulation, or at a time before."""
    with Instance(fmu, FLIGHT).start(inputs=INPUTS) as plant:
        for tick in range(round(until / STEP)):
            try:
                plant.step(tick * STEP, STEP)
            except FMICallException as problem:
                assert problem.status == fmi2Discard
                assert plant.slave.getBooleanStatus(fmi2Terminated)
                return plant.slave.getRealStatus(fmi2LastSuccessfulTime), plant.get(MOTION)
        return until, plant.get(MOTION)


def exchanged(fmu, until: float):
    values = {name: fmu.item(name, value) if isinstance(value, str) else value for name, value in FLIGHT.items()}
    return simulate_fmu(
        str(fmu.path),
        fmi_type="ModelExchange",
        solver="CVode",
        relative_tolerance=1e-10,
        start_values={**values, **INPUTS},
        stop_time=until,
        output_interval=10.0,
        output=MOTION,
    )


def test_oracle_co_simulation_agrees_with_cvode_over_a_whole_entry(fmu):
    plant = fmu("ReentryPlant")
    end, last = flown(plant, 4000.0)
    assert 1500 < end < 3000 and last[0] < 24_384
    rows = exchanged(plant, 4000.0)
    # Model exchange ends by terminateSimulation, at the same time.
    assert abs(rows["time"][-1] - end) < 1e-6 * end
    time, motion = flown(plant, 1500.0)
    other = np.array([rows[name][rows["time"] == time][0] for name in MOTION])
    assert np.all(np.abs(motion - other) < 1e-6 * np.maximum(np.abs(other), 1.0)), motion - other


@pytest.mark.parametrize("name", ["from-120km", "from-80km"])
def test_the_guidance_brings_the_vehicle_to_the_terminal_area(orchestrate, name):
    finished, out = orchestrate(EXPERIMENTS.parent / "entry" / f"{name}.toml")
    assert finished.returncode == 0, finished.stderr
    assert "the entry flight ended" in finished.stdout
    metrics = json.loads((out / "metrics.json").read_text())
    assert metrics["completed"] and metrics["range_off_km"] < 5
    assert abs(metrics["final_altitude_km"] - 24.4) < 0.5 and metrics["reversals"] >= 3
    # CRMPC keeps both limits, with its guarantee in force.
    assert metrics["worst_limit_ratio"] <= 1.0 and metrics["guarantee_share"] >= 0.99
    with open(out / "results.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    # The last row is that of the end, which lies within a communication step.
    assert float(rows[-1]["plant.motion.speed"]) == pytest.approx(762, abs=1e-3)
