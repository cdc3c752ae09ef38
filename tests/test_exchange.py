"""ReentryPlant as model exchange, under FMPy's CVode and in the orchestrator, against its own
co-simulation. For surfaces and jets see test_actuators.py."""

import subprocess
from ctypes import c_double

import numpy as np
import pytest
from fmpy import simulate_fmu
from fmpy.fmi2 import FMU2Model

from conftest import EXPERIMENTS, TARGET, program
from fmi import ANGLES, MOMENT, RATES, Instance

STOP = 20.0
STEP = 0.04
# Bound on the difference between CVode and our integrator, rad and rad/s, over a swing of about
# one.
BOUND = 3e-7
# Amplitudes of moments that swing the vehicle by some 0.7 rad without leaving |beta| < 90 deg.
AMPLITUDE = np.array([2e4, 3e4, -4e4])
FREQUENCY = np.array([0.5, 0.7, 0.9])


def moment(tick: int) -> np.ndarray:
    """Piecewise constant moment, so that both interfaces see exactly the same input."""
    return AMPLITUDE * np.sin(FREQUENCY * tick * STEP)


# Jumps at times that are no communication points.
TABLE = {
    "disturbance.start": 0.15,
    "disturbance.table.rows": 3,
    "disturbance.table.period": 3.3,
    "disturbance.table.time[1]": 0.123,
    "disturbance.table.alpha[1]": 1.0,
    "disturbance.table.sigma[1]": -0.5,
    "disturbance.table.time[2]": 1.4142,
    "disturbance.table.beta[2]": -0.3,
    "disturbance.table.time[3]": 2.005,
    "disturbance.table.alpha[3]": -1.0,
    "disturbance.table.sigma[3]": 0.7,
}


@pytest.fixture(scope="module", params=["none", "white", "square", "sine", "table"])
def settings(request):
    table = TABLE if request.param == "table" else {}
    return {"inertia.scale": 1.05, "disturbance.kind": request.param, "disturbance.seed": 7, **table}


def co_simulated(fmu, settings) -> np.ndarray:
    rows = []
    with Instance(fmu, settings).start(inputs=dict(zip(MOMENT, moment(0)))) as plant:
        for tick in range(round(STOP / STEP) + 1):
            plant.set(dict(zip(MOMENT, moment(tick))))
            rows.append(plant.get(ANGLES + RATES))
            if tick * STEP < STOP - STEP / 2:
                plant.step(tick * STEP, STEP)
    return np.array(rows)


def exchanged(fmu, settings) -> np.ndarray:
    # The input jumps at each tick: one row has the old value and one the new, which FMPy takes for
    # an event.
    rows = []
    for tick in range(round(STOP / STEP) + 1):
        if tick > 0:
            rows.append((tick * STEP, *moment(tick - 1)))
        rows.append((tick * STEP, *moment(tick)))
    signal = np.array(rows, dtype=[("time", float), *((name, float) for name in MOMENT)])
    values = {
        name: fmu.item(name, value) if isinstance(value, str) else value for name, value in settings.items()
    }
    result = simulate_fmu(
        str(fmu.path),
        fmi_type="ModelExchange",
        solver="CVode",
        relative_tolerance=1e-10,
        start_values=values,
        input=signal,
        stop_time=STOP,
        output_interval=STEP,
        output=ANGLES + RATES,
        record_events=False,
    )
    np.testing.assert_allclose(result["time"], STEP * np.arange(len(result)), atol=1e-9)
    return np.array([result[name] for name in ANGLES + RATES]).T


@pytest.mark.importer("FMPy", "model exchange, CVode", fmu="ReentryPlant", within=BOUND, to="our co-simulation")
def test_oracle_cvode_agrees_with_co_simulation(fmu, settings):
    plant = fmu("ReentryPlant")
    expected = co_simulated(plant, settings)
    assert np.ptp(expected[:, :3], axis=0).min() > 0.02
    found = exchanged(plant, settings)
    assert np.abs(found - expected).max() < BOUND


@pytest.mark.parametrize("kinematics", ["printed", "exact"])
def test_oracle_directional_derivatives_are_central_differences(fmu, kinematics):
    plant = fmu("ReentryPlant")
    derivatives = [v for v in plant.variables.values() if v.derivative is not None]
    states = [v.derivative for v in derivatives]
    deflections = [f"deflection[{i}]" for i in range(1, 9)]
    motion = [name for name in plant.names("output") if name.startswith("motion.")]
    assert [v.name for v in states] == ANGLES + RATES + deflections + motion
    loads = MOMENT + [f"disturbanceMoment.{axis}" for axis in "xyz"]
    trajectory = [name for name in plant.names("input") if name.startswith("trajectory.")]
    assert len(trajectory) == 7
    inputs = [plant.variables[name] for name in loads + trajectory]
    model = FMU2Model(instanceName="model", **plant.arguments("modelExchange"))
    model.instantiate()
    model.setupExperiment()
    for name, value in (("kinematics", kinematics), ("actuation", "surfacesAndJets")):
        model.setInteger([plant.variables[name].valueReference], [plant.item(name, value)])
    model.setReal([plant.variables["trajectory.earthRate"].valueReference], [7.2921e-5])
    model.enterInitializationMode()
    model.exitInitializationMode()
    while model.newDiscreteStates()[0]:
        pass
    model.enterContinuousTimeMode()
    point = np.array([0.3, -0.4, 0.5, 0.05, -0.08, 0.11, *0.01 * np.arange(-4, 4), 55e3, 0.1, -0.2, 3e3, -0.02, 1.0])
    load = np.array([2e4, -3e4, 5e4, 1e3, 2e3, -3e3, -0.1, 0.8, 0.4, 0.01, -0.02, 0.03, 0.01])
    references = [v.valueReference for v in derivatives]

    def right_side(state, values):
        model.setContinuousStates((c_double * 20)(*state), 20)
        model.setReal([v.valueReference for v in inputs], values)
        return np.array(model.getReal(references))

    none = np.zeros(13)
    steps = [(1e-5, row, none, states[i]) for i, row in enumerate(np.eye(20))]
    steps += [(10.0 if i < 6 else 1e-5, np.zeros(20), row, inputs[i]) for i, row in enumerate(np.eye(13))]
    for h, by_state, by_input, known in steps:
        ahead = right_side(point + h * by_state, load + h * by_input)
        behind = right_side(point - h * by_state, load - h * by_input)
        right_side(point, load)
        found = model.getDirectionalDerivative(references, [known.valueReference], [1.0])
        expected = (ahead - behind) / (2.0 * h)
        np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-7 * max(1e-6, np.abs(expected).max()))
    model.freeInstance()


@pytest.mark.importer("FMPy", "model exchange, Euler", fmu="ReentryPlant", within="error of order one", to="our co-simulation")
def test_oracle_euler_converges_to_co_simulation_with_order_one(fmu):
    vehicle = fmu("ReentryPlant")
    start = {"initial.p": 0.05, "initial.q": 0.03}
    with Instance(vehicle, {"disturbance.kind": "none", **start}).start() as plant:
        for tick in range(100):
            plant.step(tick * STEP, STEP)
        expected = np.array(plant.get(ANGLES + RATES))

    def error(step: float) -> float:
        # FMPy's Euler method integrates in steps of the output interval.
        result = simulate_fmu(
            str(vehicle.path),
            fmi_type="ModelExchange",
            solver="Euler",
            start_values={"disturbance.kind": vehicle.item("disturbance.kind", "none"), **start},
            stop_time=100 * STEP,
            step_size=step,
            output_interval=step,
            output=ANGLES + RATES,
        )
        return np.abs(np.array(list(result[-1]))[1:] - expected).max()

    errors = [error(STEP / parts) for parts in (1, 2, 4, 8)]
    assert errors[0] < 1e-3
    for coarse, fine in zip(errors, errors[1:]):
        assert coarse / fine == pytest.approx(2.0, abs=0.1)


def flown(folder, settings, *lines, fmus="fmu", isolate="false") -> np.ndarray:
    """Angles (rad) and rates (rad/s) of a flight of LQR in the orchestrator, with these lines about the plant and the
    FMUs of this folder."""
    values = [f'"{name}" = {repr(value).replace(chr(39), chr(34))}' for name, value in settings.items()]
    text = [f"extends = '{EXPERIMENTS / 'lqr.toml'}'", "title = 'Exchange'", "[components.plant]", *lines]
    recorded = '["plant.attitude.*", "plant.rate.*"]'
    text += ["[components.plant.parameters]", '"integrator.step" = 0.001', *values, "[record]", f"variables = {recorded}"]
    (folder / "exchange.toml").write_text("\n".join(text), encoding="utf-8")
    command = [program("orchestrator"), "run", folder / "exchange.toml", "--stop", "10", "--quiet", "--force", f"--isolate={isolate}"]
    subprocess.run([*command, "--out", folder / "out", "--fmu-dir", TARGET / fmus], check=True)
    return np.loadtxt(folder / "out" / "results.csv", delimiter=",", skiprows=1)


@pytest.mark.importer("orchestrator", "model exchange", fmu="ReentryPlant", within=1e-9, to="our co-simulation")
def test_oracle_the_orchestrator_integrates_as_its_co_simulation(settings, tmp_path):
    own = flown(tmp_path, settings)
    lines = ('interface = "modelExchange"', "tolerance = 1e-11")
    integrated = flown(tmp_path, settings, *lines)
    assert np.ptp(own, axis=0).min() > 1e-3
    assert np.abs(integrated - own).max() < 1e-9
    for isolation in ("true", "false"):
        third = flown(tmp_path, settings, *lines, fmus="fmi3", isolate=isolation)
        assert np.array_equal(third, integrated)
