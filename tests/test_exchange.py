"""ReentryPlant as model exchange under FMPy's CVode against its own co-simulation."""

from ctypes import c_double

import numpy as np
import pytest
from fmpy import simulate_fmu
from fmpy.fmi2 import FMU2Model

from fmi import ANGLES, MOMENT, RATES, Unit

STOP = 20.0
STEP = 0.04
# Moments that swing the vehicle by some 0.7 rad without leaving |beta| < 90 deg.
AMPLITUDE = np.array([2e4, 3e4, -4e4])
FREQUENCY = np.array([0.5, 0.7, 0.9])


def moment(tick: int) -> np.ndarray:
    """Piecewise constant, so that both interfaces see the very same input."""
    return AMPLITUDE * np.sin(FREQUENCY * tick * STEP)


@pytest.fixture(scope="module", params=["none", "white", "square", "sine"])
def settings(request):
    return {"inertia.scale": 1.05, "disturbance.kind": request.param, "disturbance.seed": 7}


def co_simulated(fmu, settings) -> np.ndarray:
    rows = []
    with Unit(fmu, settings).start(inputs=dict(zip(MOMENT, moment(0)))) as plant:
        for tick in range(round(STOP / STEP) + 1):
            plant.set(dict(zip(MOMENT, moment(tick))))
            rows.append(plant.get(ANGLES + RATES))
            if tick * STEP < STOP - STEP / 2:
                plant.step(tick * STEP, STEP)
    return np.array(rows)


def exchanged(fmu, settings) -> np.ndarray:
    # A jump at each tick: a row for the old value and one for the new, which FMPy takes for an event.
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


def test_oracle_cvode_agrees_with_co_simulation(fmu, settings):
    plant = fmu("ReentryPlant")
    expected = co_simulated(plant, settings)
    assert np.ptp(expected[:, :3], axis=0).min() > 0.02
    found = exchanged(plant, settings)
    # rad and rad/s, over a swing of about one.
    assert np.abs(found - expected).max() < 3e-7


def test_oracle_directional_derivatives_are_central_differences(fmu):
    plant = fmu("ReentryPlant")
    derivatives = [v for v in plant.variables.values() if v.derivative is not None]
    states = [v.derivative for v in derivatives]
    assert [v.name for v in states] == ANGLES + RATES
    inputs = [plant.variables[name] for name in MOMENT + [f"disturbanceMoment.{axis}" for axis in "xyz"]]
    model = FMU2Model(instanceName="model", **plant.arguments("modelExchange"))
    model.instantiate()
    model.setupExperiment()
    model.enterInitializationMode()
    model.exitInitializationMode()
    while model.newDiscreteStates()[0]:
        pass
    model.enterContinuousTimeMode()
    point = np.array([0.3, -0.4, 0.5, 0.05, -0.08, 0.11])
    load = np.array([2e4, -3e4, 5e4, 1e3, 2e3, -3e3])
    references = [v.valueReference for v in derivatives]

    def right_side(state, moments):
        model.setContinuousStates((c_double * 6)(*state), 6)
        model.setReal([v.valueReference for v in inputs], moments)
        return np.array(model.getReal(references))

    steps = [(1e-5, np.eye(6)[i], np.zeros(6), states[i]) for i in range(6)]
    steps += [(10.0, np.zeros(6), np.eye(6)[i], inputs[i]) for i in range(6)]
    for h, by_state, by_input, known in steps:
        ahead = right_side(point + h * by_state, load + h * by_input)
        behind = right_side(point - h * by_state, load - h * by_input)
        right_side(point, load)
        found = model.getDirectionalDerivative(references, [known.valueReference], [1.0])
        expected = (ahead - behind) / (2.0 * h)
        np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-7 * max(1e-6, np.abs(expected).max()))
    model.freeInstance()


def test_oracle_euler_converges_to_co_simulation_with_order_one(fmu):
    vehicle = fmu("ReentryPlant")
    start = {"initial.p": 0.05, "initial.q": 0.03}
    with Unit(vehicle, {"disturbance.kind": "none", **start}).start() as plant:
        for tick in range(100):
            plant.step(tick * STEP, STEP)
        expected = np.array(plant.get(ANGLES + RATES))

    def error(step: float) -> float:
        # FMPy's Euler integrates in steps of the output interval.
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
