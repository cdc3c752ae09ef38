"""Drives any FMU by inputs that move enough to change every optimisation. As a program, with an archive, a folder to unpack it
to, a file with a saved state and two ticks, it goes on from the state and prints the outputs."""

import json
import sys
from pathlib import Path

from fmi import ANGLES, MOMENT, RATES, Fmu, Instance

STEP = 0.04
# Other parameters than those of the start values are part of the state.
SETTINGS = {
    "ReentryPlant": {"inertia.scale": 1.05, "disturbance.kind": "white", "disturbance.seed": 3},
    "CRMPC": {"constraints": "robust"},
}


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


if __name__ == "__main__":
    archive, folder, saved, *ticks = sys.argv[1:]
    unit = Fmu.open(Path(archive), Path(folder))
    with Instance(unit, SETTINGS.get(unit.name), "elsewhere").start() as instance:
        instance.restore(Path(saved).read_bytes())
        print(json.dumps(drive(instance, range(*map(int, ticks)))))
