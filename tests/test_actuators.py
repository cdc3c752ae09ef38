"""ReentryPlant with surfaces and jets: stepped by hand, and as model exchange under CVode and
Euler. Numbers printed in Wu 2015 are written here a second time."""


import numpy as np
import pytest
from fmpy import simulate_fmu

from fmi import ANGLES, RATES, Instance

SURFACE = [f"surface[{i}]" for i in range(1, 9)]
DEFLECTION = [f"deflection[{i}]" for i in range(1, 9)]
JET = [f"jet[{j}]" for j in range(1, 11)]

# Limits of Wu 2015, (63), in deg and deg/s.
LOWER = np.array([-25.0, -25, -25, -25, -10, -10, -30, -30])
UPPER = np.array([0.0, 0, 0, 0, 30, 30, 30, 30])
RATE = 10.0
QUIET = {"disturbance.kind": "none", "initial.alpha": 0.1, "initial.beta": 0.0, "initial.sigma": 0.2}
ACTUATED = {"actuation": "surfacesAndJets", **QUIET}


def surfaces(degrees) -> dict:
    return dict(zip(SURFACE, np.radians(degrees)))


def commands(tick: int) -> dict:
    """Piecewise constant commands beyond rate and position limits, with jets that switch."""
    time = tick * 0.2
    wanted = [12 * np.sin(0.9 * time + i) - (6 if i < 4 else 0) for i in range(8)]
    return surfaces(wanted) | {jet: float((tick * 7 + 3 * j) % 10 < 3) for j, jet in enumerate(JET)}


def co_simulated(fmu, parameters: dict, at, ticks: int) -> np.ndarray:
    """Returns angles, rates and deflections at every tick of co-simulation."""
    rows = []
    with Instance(fmu, parameters).start(inputs=at(0)) as plant:
        for tick in range(ticks + 1):
            plant.set(at(tick))
            rows.append(plant.get(ANGLES + RATES + DEFLECTION))
            if tick < ticks:
                plant.step(tick * 0.2, 0.2)
    return np.array(rows)


def simulated(fmu, start: dict, **options) -> np.ndarray:
    """Returns the variables that FMPy records in model exchange."""
    values = {name: fmu.item(name, value) if isinstance(value, str) else value for name, value in start.items()}
    output = ANGLES + RATES + DEFLECTION
    return simulate_fmu(str(fmu.path), fmi_type="ModelExchange", start_values=values, output=output, **options)


def exchanged(fmu, parameters: dict, at, ticks: int, **options) -> np.ndarray:
    """Runs model exchange with a jump of the commands at every tick."""
    names = list(at(0))
    rows = []
    for tick in range(ticks + 1):
        if tick > 0:
            rows.append((tick * 0.2, *at(tick - 1).values()))
        rows.append((tick * 0.2, *at(tick).values()))
    signal = np.array(rows, dtype=[("time", float), *((name, float) for name in names)])
    return simulated(fmu, parameters, input=signal, stop_time=ticks * 0.2, **options)


def columns(result) -> np.ndarray:
    return np.array([result[name] for name in ANGLES + RATES + DEFLECTION]).T


@pytest.mark.parametrize("duty", [False, True])
@pytest.mark.parametrize("kind", ["none", "square", "againstMoment"])
def test_oracle_cvode_agrees_with_co_simulation(fmu, duty, kind):
    plant = fmu("ReentryPlant")
    parameters = {**ACTUATED, "jets.duty": duty, "disturbance.kind": kind}

    def at(tick):
        scale = 0.7 if duty else 1.0
        return {name: value * (scale if name in JET else 1.0) for name, value in commands(tick).items()}

    expected = co_simulated(plant, parameters, at, 25)
    assert np.ptp(expected[:, :3], axis=0).min() > 0.02
    options = dict(solver="CVode", relative_tolerance=1e-10, output_interval=0.2, record_events=False)
    found = columns(exchanged(plant, parameters, at, 25, **options))
    assert np.abs(found[:, :6] - expected[:, :6]).max() < 3e-7
    assert np.abs(found[:, 6:] - expected[:, 6:]).max() < 1e-9


@pytest.mark.parametrize("kind", ["stuck", "floating", "slow", "jetOn", "jetOff"])
def test_oracle_a_failure_within_a_step_is_an_event_of_model_exchange(fmu, kind):
    plant = fmu("ReentryPlant")
    failing = {**ACTUATED, "effector.fault.kind": kind, "effector.fault.number": 5, "effector.fault.start": 1.13}
    healthy, expected = (co_simulated(plant, parameters, commands, 25) for parameters in (ACTUATED, failing))
    assert np.array_equal(healthy[:6], expected[:6]) and np.abs(healthy - expected).max() > 1e-3
    options = dict(solver="CVode", relative_tolerance=1e-10, output_interval=0.2, record_events=False)
    found = columns(exchanged(plant, failing, commands, 25, **options))
    assert np.abs(found[:, :6] - expected[:, :6]).max() < 3e-7
    assert np.abs(found[:, 6:] - expected[:, 6:]).max() < 1e-9


def test_published_arrivals_are_located_by_cvode(fmu):
    # Wu 2015, (63): the commands are beyond the limits, at a limit and within them; every surface
    # that moves does so at 10 deg/s.
    wanted = np.array([-90.0, 4, -3, -7.5, 90, -10, 0, 29])
    stop = np.clip(wanted, LOWER, UPPER)
    options = dict(solver="CVode", relative_tolerance=1e-8, stop_time=4.0, output_interval=4.0, record_events=True)
    result = simulated(fmu("ReentryPlant"), ACTUATED | surfaces(wanted), **options)
    times = result["time"]
    events = times[1:][np.diff(times) == 0.0]
    arrivals = np.unique(np.abs(stop)[stop != 0]) / RATE
    np.testing.assert_allclose(events, arrivals, rtol=0, atol=1e-7)
    for i, name in enumerate(DEFLECTION):
        # From the event on, the deflection equals its target to the last bit.
        rested = result[name][np.flatnonzero(times >= np.abs(stop[i]) / RATE - 1e-7)[1:]]
        np.testing.assert_array_equal(rested, np.radians(stop[i]))
