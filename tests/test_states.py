"""Saved states in another process, bit for bit. Reset, restored states and
instances side by side are tested in tests/conformance."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from conftest import NAMES
from fmi import ANGLES, MOMENT, RATES, Instance

STEP = 0.04
PLANT = {"inertia.scale": 1.05, "disturbance.kind": "white", "disturbance.seed": 3}
SETTINGS = {"ReentryPlant": PLANT, "CRMPC": {"constraints": "robust"}, "DLMPC": {}, "LQR": {}, "ControlAllocator": {}}
SETTINGS |= {name: {} for name in NAMES if name not in SETTINGS}


def course(tick: int) -> dict:
    """Measurements near the initial state that move enough to change every optimisation."""
    values = [0.13 + 1e-3 * tick, 0.15 - 1e-3 * tick, -0.5 + 5e-4 * tick, 1e-2, -2e-3, 1e-4 * tick]
    return dict(zip(ANGLES + RATES, values))


def inputs(name: str, tick: int) -> dict:
    if name == "AttitudeEstimator":
        return {"measured.gyroscope.x": 1e-3 * tick, "measured.gyroscope.y": -0.02, "measured.time": STEP * tick, "measured.sample": tick + 1}
    if name == "EntryGuidance":
        return {"motion.altitude": 60e3 - 10.0 * tick, "motion.speed": 5000.0 - 30.0 * tick, "motion.heading": 1.2 + 0.01 * tick, "load.drag": 3.0}
    if name == "EntryNavigation":
        sample = {"measured.time": STEP * tick, "measured.sample": tick + 1}
        return sample | {"measured.gyroscope.x": 1e-3 * tick, "measured.accelerometer.z": -9.0}
    if name not in ("ReentryPlant", "ControlAllocator"):
        return course(tick)
    return dict(zip(MOMENT, [1e4 * (-1) ** (tick // 10), 2e3 * tick, -3e4 + 1e3 * tick]))


def drive(instance: Instance, ticks: range) -> list:
    """Returns the exact outputs at each tick."""
    rows = []
    for tick in ticks:
        instance.set(inputs(instance.fmu.name, tick))
        rows.append([float(value).hex() for value in instance.outputs()])
        instance.step(tick * STEP, STEP)
    return rows


@pytest.mark.parametrize("name", NAMES)
def test_a_state_saved_to_a_file_goes_on_in_a_new_process(fmu, name, tmp_path):
    with Instance(fmu(name), SETTINGS[name]).start(inputs=inputs(name, 0)) as instance:
        drive(instance, range(23))
        (tmp_path / "state").write_bytes(instance.save())
        expected = drive(instance, range(23, 60))
    script = {"parameters": SETTINGS[name], "inputs": [inputs(name, tick) for tick in range(23, 60)]}
    (tmp_path / "script.json").write_text(json.dumps(script))
    program = Path(__file__).with_name("continue_elsewhere.py")
    arguments = [fmu(name).path, tmp_path / "unpacked", tmp_path / "script.json", tmp_path / "state", "23", str(STEP)]
    finished = subprocess.run([sys.executable, program, *arguments], capture_output=True, text=True, timeout=120)
    assert finished.returncode == 0, finished.stderr
    assert [json.loads(line) for line in finished.stdout.splitlines()] == expected
