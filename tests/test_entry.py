"""Entry flights of ReentryPlant: co-simulation against model exchange by CVode, the end of a flight
as FMI 2.0 says it, and the orchestrator's."""

import json

import numpy as np
import pytest
from fmpy import simulate_fmu
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import fmi2Discard, fmi2LastSuccessfulTime, fmi2Terminated

from conftest import EXPERIMENTS, results
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
    return simulate_fmu(
        str(fmu.path),
        fmi_type="ModelExchange",
        solver="CVode",
        relative_tolerance=1e-10,
        start_values={**fmu.values(FLIGHT), **INPUTS},
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


def test_fmpy_ends_with_the_flight(fmu):
    plant = fmu("ReentryPlant")
    start = {**plant.values(FLIGHT), **INPUTS, "initial.altitude": 30e3, "initial.speed": 1200.0}
    heard = []

    def log(_environment, _name, status, _category, message):
        heard.append((status, message.decode()))

    for kind in ("CoSimulation", "ModelExchange"):
        rows = simulate_fmu(str(plant.path), fmi_type=kind, start_values=start, stop_time=500.0, output_interval=1.0, output=MOTION, logger=log)
        assert 10 < rows["time"][-1] < 400, kind
        assert abs(rows["motion.altitude"][-1] - 24_384) < 300, kind
    # FMPy leaves logging off.
    assert [status for status, _ in heard] == [2] and "the entry flight ended" in heard[0][1]


@pytest.mark.parametrize(
    ("changes", "stop"),
    [
        # The runway point lies beyond the longest flight, and before the shortest.
        (["guidance.target.longitude=150 deg"], None),
        (["guidance.target.longitude=30 deg"], None),
        # The vehicle skips out of the air, and the flight does not end.
        (["plant.initial.flightPathAngle=-0.6 deg", "plant.initial.speed=7800"], None),
        # A run that is cut off says nothing of its end.
        (["guidance.target.longitude=150 deg"], 10),
    ],
)
def test_a_target_out_of_reach_is_told_at_the_first_tick_and_its_run_is_not_completed(orchestrate, changes, stop):
    arguments = [part for change in changes for part in ("--set", change)]
    finished, out = orchestrate(EXPERIMENTS.parent / "entry" / "from-80km.toml", *arguments, *(["--stop", str(stop)] if stop else []))
    assert "t = 0 s" in finished.stderr and "the target is out of reach" in finished.stderr, finished.stderr
    metrics = json.loads((out / "metrics.json").read_text())
    assert metrics["range_off_km"] > 5 and metrics["completed"] == bool(stop)
    assert finished.returncode == (0 if stop else 3) and ("terminal area missed" in finished.stderr) == (not stop)


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
    # The last row is that of the end, which lies within a communication step.
    assert results(out)["plant.motion.speed"].iloc[-1] == pytest.approx(762, abs=1e-3)
