"""ReentryPlant with surfaces and jets: stepped by hand, and as model exchange under CVode and
Euler. Numbers printed in Wu 2015 are written here a second time."""

from ctypes import c_double

import numpy as np
import pytest
from fmpy import simulate_fmu
from fmpy.fmi2 import FMU2Model

from fmi import ANGLES, RATES, Instance

SURFACE = [f"surface[{i}]" for i in range(1, 9)]
SURFACE_RATE = [f"deflectionRate[{i}]" for i in range(1, 9)]
DEFLECTION = [f"deflection[{i}]" for i in range(1, 9)]
JET = [f"jet[{j}]" for j in range(1, 11)]
APPLIED = [f"appliedMoment.{axis}" for axis in "xyz"]
STEP = 0.04

# Limits of Wu 2015, (63), in deg and deg/s.
LOWER = np.array([-25.0, -25, -25, -25, -10, -10, -30, -30])
UPPER = np.array([0.0, 0, 0, 0, 30, 30, 30, 30])
RATE = 10.0
# Jet moments of Wu 2015, (64), in N m.
JETS = np.array(
    [
        [0, -2048, 11625, -6912, 0, 2054, -11623, 6912, 0, 0],
        [-498, 0, -9466, 10944, -498, 0, -9465, 11798, -498, -498],
        [19897, -15723, -9465, -11798, -19897, 15723, 9465, 11798, -19897, 19897],
    ]
)
# Representative surface effectiveness, N m per degree at 2859 Pa.
SURFACES = np.array(
    [
        [2800, -2800, 2150, -2150, 1375, -1375, 0, 0],
        [-1750, -1750, -1800, -1800, -5100, -5100, 0, 0],
        [-650, 650, -700, 700, -1000, 1000, 0, 0],
    ]
)
QUIET = {"disturbance.kind": "none", "initial.alpha": 0.1, "initial.beta": 0.0, "initial.sigma": 0.2}
ACTUATED = {"actuation": "surfacesAndJets", **QUIET}


def started(fmu, parameters=None) -> Instance:
    return Instance(fmu("ReentryPlant"), {**ACTUATED, **(parameters or {})}).start()


def surfaces(degrees) -> dict:
    return dict(zip(SURFACE, np.radians(degrees)))


def deflections(plant: Instance) -> np.ndarray:
    return np.degrees(plant.get(DEFLECTION))


def test_published_rate_and_position_limits(fmu):
    with started(fmu) as plant:
        for command in (-90.0, 90.0):
            plant.set(surfaces([command] * 8))
            before = deflections(plant)
            for tick in range(150):
                plant.step((tick + (150 if command > 0 else 0)) * STEP, STEP)
                reach = RATE * (tick + 1) * STEP * np.sign(command)
                expected = np.clip(before + reach, LOWER, UPPER)
                np.testing.assert_allclose(deflections(plant), expected, rtol=0, atol=1e-11)


def test_a_surface_stops_at_its_command(fmu):
    command = np.array([-5.0, -1, -12, 0, 7, -3, 2, -2])
    with started(fmu) as plant:
        plant.set(surfaces(command))
        plant.step(0.0, 0.5)
        np.testing.assert_allclose(deflections(plant), np.clip(command, -5, 5), rtol=0, atol=1e-12)
        plant.step(0.5, 1.0)
        np.testing.assert_allclose(deflections(plant), command, rtol=0, atol=1e-12)


def test_published_moment_of_each_jet(fmu):
    with started(fmu) as plant:
        for jet, column in zip(JET, JETS.T):
            plant.set(dict.fromkeys(JET, 0.49) | {jet: 0.5})
            np.testing.assert_allclose(plant.get(APPLIED), column, rtol=0, atol=1e-9)
    with started(fmu, {"jets.symmetric": True}) as plant:
        plant.set({"jet[4]": 1.0})
        # With symmetric jets, jet 4 is the mirror image of jet 8.
        np.testing.assert_allclose(plant.get(APPLIED), JETS[:, 7] * [-1, 1, -1], rtol=0, atol=1e-9)


def test_duty_cycles_scale_and_saturate(fmu):
    with started(fmu, {"jets.duty": True}) as plant:
        for value, duty in ((0.3, 0.3), (1.7, 1.0), (-0.4, 0.0)):
            plant.set({"jet[3]": value, "jet[8]": value})
            np.testing.assert_allclose(plant.get(APPLIED), JETS[:, [2, 7]].sum(axis=1) * duty, rtol=0, atol=1e-9)


def test_oracle_moment_of_surfaces_under_both_biases(fmu):
    command = np.array([-5.0, -3, -2, -4, 3, -2, 1, -1])
    nominal = SURFACES @ command
    for bias in (1.0, 0.9):
        with started(fmu, {"density.scale": bias, "aerodynamics.scale": bias}) as plant:
            plant.set(surfaces(command))
            plant.step(0.0, 1.0)
            pressure = plant.get(["flight.dynamicPressure"])[0]
            # The flight is at 55 km and Mach 9.8 in the US Standard Atmosphere 1976.
            assert pressure == pytest.approx(2858.9 * bias, abs=0.05)
            found = plant.get(APPLIED)
            np.testing.assert_allclose(found, nominal * bias * pressure / 2859.0, rtol=1e-12)


def test_oracle_pitch_under_flaps_that_move_at_their_rate(fmu):
    # Both flaps at -2 deg give a pure pitching moment at beta = 0, which rises for 0.2 s and stays.
    with started(fmu, {"density.scale": 1.0}) as plant:
        inertia = 1.05 * plant.get(["inertia.Iyy"])[0]
        plant.set(surfaces([0, 0, 0, 0, -2, -2, 0, 0]))
        plant.step(0.0, 1.0)
        full = 4.0 * 5100.0 * plant.get(["flight.dynamicPressure"])[0] / 2859.0 / inertia
        assert plant.get(["rate.q"])[0] == pytest.approx(full * (0.1 + 0.8), rel=1e-12)
        alpha = 0.1 + full * (0.2**2 / 6 + 0.1 * 0.8 + 0.8**2 / 2)
        assert plant.get(["attitude.alpha"])[0] == pytest.approx(alpha, rel=1e-12)


def test_under_a_moment_actuators_rest(fmu):
    results = []
    for command in ({}, surfaces([-5.0] * 8) | dict.fromkeys(JET, 1.0)):
        with started(fmu, {"actuation": "moment"}) as plant:
            plant.set(command | {"moment.x": 1e4, "moment.y": -2e4})
            plant.step(0.0, 1.0)
            assert plant.get(DEFLECTION) == [0.0] * 8
            results.append(plant.outputs())
    assert results[0] == results[1]


def test_a_saved_state_continues_a_moving_surface(fmu):
    with started(fmu) as plant:
        plant.set(surfaces([-20.0, 0, 0, -9, 13, 0, 0, 0]) | {"jet[2]": 1.0})
        plant.step(0.0, 0.5)
        saved = plant.save()
        plant.step(0.5, 1.0)
        expected = plant.outputs()
        plant.restore(saved)
        plant.step(0.5, 1.0)
        assert plant.outputs() == expected


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


def test_oracle_euler_comes_to_co_simulation_with_order_one(fmu):
    plant = fmu("ReentryPlant")
    expected = co_simulated(plant, ACTUATED, commands, 25)

    def error(step: float) -> float:
        # FMPy's Euler method integrates in steps of the output interval and looks at the event
        # indicators after each, so a deflection moves on for up to a step.
        result = exchanged(plant, ACTUATED, commands, 25, solver="Euler", step_size=step, output_interval=step)
        at_ticks = np.isclose(result["time"] / 0.2, np.round(result["time"] / 0.2))
        last = {round(row["time"] / 0.2): row for row in result[at_ticks]}
        found = np.array([list(last[tick])[1:] for tick in range(26)])
        return np.abs(found - expected).max()

    errors = [error(0.02 / parts) for parts in (1, 4, 16)]
    assert errors[0] < 5e-3
    for coarse, fine in zip(errors, errors[1:]):
        assert coarse / fine == pytest.approx(4.0, abs=0.2)


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


def test_a_saved_state_continues_a_moving_surface_in_model_exchange(fmu):
    plant = fmu("ReentryPlant")

    def reference(names):
        return [plant.variables[name].valueReference for name in names]

    model = FMU2Model(instanceName="model", **plant.arguments("modelExchange"))
    model.instantiate()
    model.setupExperiment()
    model.setInteger(reference(["actuation"]), [plant.item("actuation", "surfacesAndJets")])
    model.enterInitializationMode()
    model.setReal(reference(["surface[5]"]), [0.1])
    model.exitInitializationMode()
    model.newDiscreteStates()
    model.enterContinuousTimeMode()

    def seen():
        indicators = (c_double * 10)()
        model.getEventIndicators(indicators, 10)
        return model.getReal(reference(DEFLECTION + SURFACE_RATE)), list(indicators)

    saved = model.getFMUstate()
    before = seen()
    assert before[0][12] == np.radians(RATE) and before[1][4] == pytest.approx(0.1 / np.radians(RATE))
    model.setTime(1.0)
    model.setContinuousStates((c_double * 20)(*[0.0] * 10, 0.11, *[0.0] * 9), 20)
    assert seen()[1][4] < 0.0
    model.enterEventMode()
    *_, changed, _, _ = model.newDiscreteStates()
    assert changed
    assert (seen()[0][4], seen()[0][12]) == (0.1, 0.0)
    assert seen()[1] == [1.0] * 10
    model.setFMUstate(saved)
    assert seen() == before
    model.freeFMUstate(saved)
    model.freeInstance()
