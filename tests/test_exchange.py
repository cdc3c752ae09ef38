"""ReentryPlant as model exchange, under FMPy's CVode and in the orchestrator, against its own
co-simulation, also with surfaces and jets."""

from ctypes import c_double
from functools import partial

import numpy as np
import pytest
from fmpy import simulate_fmu
from fmpy.fmi2 import FMU2Model

from conftest import EXPERIMENTS, TARGET, call, results
from fmi import ANGLES, MOMENT, RATES, Instance

STOP = 20.0
STEP = 0.04
MOTION = ANGLES + RATES
DEFLECTION = [f"deflection[{i}]" for i in range(1, 9)]
JET = [f"jet[{j}]" for j in range(1, 11)]
# Bound on the difference between CVode and our integrator, rad and rad/s, over a swing of about
# one.
BOUND = 3e-7
# Amplitudes of moments that swing the vehicle by some 0.7 rad without leaving |beta| < 90 deg.
AMPLITUDE = np.array([2e4, 3e4, -4e4])
FREQUENCY = np.array([0.5, 0.7, 0.9])


def forces(tick: int) -> dict[str, float]:
    """Piecewise constant moment, so that both interfaces see exactly the same input."""
    return dict(zip(MOMENT, AMPLITUDE * np.sin(FREQUENCY * tick * STEP)))


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


def co_simulated(fmu, settings: dict, at=forces, step: float = STEP, ticks: int = round(STOP / STEP), names=MOTION) -> np.ndarray:
    """These outputs at every tick of co-simulation with piecewise constant inputs."""
    rows = []
    with Instance(fmu, settings).start(inputs=at(0)) as plant:
        for tick in range(ticks + 1):
            plant.set(at(tick))
            rows.append(plant.get(names))
            if tick < ticks:
                plant.step(tick * step, step)
    return np.array(rows)


def exchanged(fmu, settings: dict, at=forces, step: float = STEP, ticks: int = round(STOP / STEP), names=MOTION) -> np.ndarray:
    """The same by FMPy's CVode. The inputs jump at each tick: one row has the old values and one the new, which FMPy takes
    for an event."""
    rows = [(tick * step, *at(row).values()) for tick in range(ticks + 1) for row in ((tick - 1, tick) if tick else (0,))]
    result = simulate_fmu(
        str(fmu.path),
        fmi_type="ModelExchange",
        solver="CVode",
        relative_tolerance=1e-10,
        start_values=fmu.values(settings),
        input=np.array(rows, dtype=[(name, float) for name in ("time", *at(0))]),
        stop_time=ticks * step,
        output_interval=step,
        output=names,
        record_events=False,
    )
    np.testing.assert_allclose(result["time"], step * np.arange(ticks + 1), atol=1e-9)
    return np.array([result[name] for name in names]).T


@pytest.mark.importer("FMPy", "model exchange, CVode", fmu="ReentryPlant", within=BOUND, to="our co-simulation")
def test_oracle_cvode_agrees_with_co_simulation(fmu, settings):
    plant = fmu("ReentryPlant")
    expected = co_simulated(plant, settings)
    assert np.ptp(expected[:, :3], axis=0).min() > 0.02
    found = exchanged(plant, settings)
    assert np.abs(found - expected).max() < BOUND


# With surfaces and jets. Commands are beyond their limits of rate and position.
ACTUATED = {"actuation": "surfacesAndJets", "disturbance.kind": "none", "initial.alpha": 0.1, "initial.beta": 0.0, "initial.sigma": 0.2}


def commands(tick: int, jets: float = 1.0) -> dict[str, float]:
    wanted = [np.radians(12 * np.sin(0.18 * tick + i) - (6 if i < 4 else 0)) for i in range(8)]
    surfaces = {f"surface[{i}]": value for i, value in enumerate(wanted, 1)}
    return surfaces | {jet: jets * ((tick * 7 + 3 * j) % 10 < 3) for j, jet in enumerate(JET)}


ACTUATING = {"step": 0.2, "ticks": 25, "names": MOTION + DEFLECTION}


def assert_same_actuation(found: np.ndarray, expected: np.ndarray) -> None:
    assert np.abs(found[:, :6] - expected[:, :6]).max() < BOUND
    assert np.abs(found[:, 6:] - expected[:, 6:]).max() < 1e-9


@pytest.mark.parametrize("duty", [False, True])
@pytest.mark.parametrize("kind", ["none", "square", "againstMoment"])
def test_oracle_cvode_agrees_with_co_simulation_under_surfaces_and_jets(fmu, duty, kind):
    plant, settings = fmu("ReentryPlant"), {**ACTUATED, "jets.duty": duty, "disturbance.kind": kind}
    at = partial(commands, jets=0.7 if duty else 1.0)
    expected = co_simulated(plant, settings, at, **ACTUATING)
    assert np.ptp(expected[:, :3], axis=0).min() > 0.02
    assert_same_actuation(exchanged(plant, settings, at, **ACTUATING), expected)


@pytest.mark.parametrize("kind", ["stuck", "floating", "slow", "jetOn", "jetOff"])
def test_oracle_a_failure_within_a_step_is_an_event_of_model_exchange(fmu, kind):
    plant = fmu("ReentryPlant")
    failing = {**ACTUATED, "effector.fault.kind": kind, "effector.fault.number": 5, "effector.fault.start": 1.13}
    healthy, expected = (co_simulated(plant, settings, commands, **ACTUATING) for settings in (ACTUATED, failing))
    assert np.array_equal(healthy[:6], expected[:6]) and np.abs(healthy - expected).max() > 1e-3
    assert_same_actuation(exchanged(plant, failing, commands, **ACTUATING), expected)


@pytest.mark.parametrize("kinematics", ["printed", "exact"])
def test_oracle_directional_derivatives_are_central_differences(fmu, kinematics):
    plant = fmu("ReentryPlant")
    derivatives = [v for v in plant.variables.values() if v.derivative is not None]
    states = [v.derivative for v in derivatives]
    motion = [name for name in plant.names("output") if name.startswith("motion.")]
    assert [v.name for v in states] == MOTION + DEFLECTION + motion
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
        expected = np.array(plant.get(MOTION))

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
            output=MOTION,
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
    command = ["run", folder / "exchange.toml", "--stop", "10", "--quiet", "--force", f"--isolate={isolate}"]
    call(*command, "--out", folder / "out", "--fmu-dir", TARGET / fmus)
    return results(folder / "out").to_numpy()


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
