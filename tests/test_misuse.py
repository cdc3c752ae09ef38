"""Bad input gives an FMI error that names the culprit in the log; the process stays alive, and the
unit is usable again after a reset."""

import math
from ctypes import c_double, c_uint

import pytest
from fmpy.fmi1 import FMICallException

from conftest import NAMES
from fmi import ANGLES, RATES, Unit

STEP = 0.04
INPUT = {"ReentryPlant": "moment.x", "CRMPC": "rate.p", "DLMPC": "rate.q", "LQR": "attitude.beta", "ControlAllocator": "moment.y", "AttitudeEstimator": "measured.gyroscope.y"}
INPUT |= {name: "rate.p" for name in NAMES if name not in INPUT}


def drive(unit: Unit, ticks: int = 12) -> list:
    rows = []
    for tick in range(ticks):
        unit.set({INPUT[unit.fmu.name]: 1e-3 * tick})
        rows.append(unit.outputs())
        unit.step(tick * STEP, STEP)
    return rows


def refuses(unit: Unit, *words: str):
    """The call inside must fail, and the log must tell why."""

    class Expectation:
        def __enter__(self):
            unit.log.clear()

        def __exit__(self, kind, error, _):
            assert kind is not None and issubclass(kind, FMICallException), f"no error, log: {unit.log}"
            messages = unit.messages()
            assert "not allowed in state error" not in messages, "an earlier call has failed, this one was not looked at"
            for word in words:
                assert word in messages, f"{word!r} is not in {messages!r}"
            return True

    return Expectation()


@pytest.fixture(params=NAMES)
def unit(request, fmu):
    """A unit that misuse must not break: after a reset it behaves as a new one."""
    with Unit(fmu(request.param)) as fresh:
        expected = drive(fresh.start())
    with Unit(fmu(request.param)) as unit:
        yield unit
        unit.reset()
        assert drive(unit.start()) == expected


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_inputs_that_are_no_numbers(unit, value):
    name = INPUT[unit.fmu.name]
    unit.start()
    drive(unit, 3)
    with refuses(unit, name, "not a finite number"):
        unit.set({name: value})


def test_value_references_that_do_not_exist(unit):
    unit.start()
    with refuses(unit, "123456"):
        unit.slave.getReal([123456])
    unit.reset()
    unit.start()
    with refuses(unit, "123456"):
        unit.slave.setReal([123456], [1.0])


@pytest.mark.parametrize(
    "name, variable, value",
    [
        ("ReentryPlant", "inertia.scale", -1.0),
        ("ReentryPlant", "disturbance.kind", 99),
        ("ReentryPlant", "disturbance.seed", -1),
        ("ReentryPlant", "integrator.step", 0.0),
        ("CRMPC", "horizon", 1),
        ("CRMPC", "constraints", 0),
        ("CRMPC", "feedback.k1", 5.0),
        ("CRMPC", "disturbance.bound", -1.0),
        ("CRMPC", "limit.rate", math.nan),
        ("DLMPC", "slidingMode.rho", 1.5),
        ("LQR", "limit.moment", -1.0),
        ("ControlAllocator", "limit.surfaceMax[3]", -0.1),
        ("ControlAllocator", "dynamicPressure", -1.0),
        ("AttitudeEstimator", "filter.cutoff", -1.0),
        ("LQR", "reference.profile", 77),
    ],
)
def test_parameters_out_of_range_are_refused_when_set(fmu, name, variable, value):
    with Unit(fmu(name)) as unit:
        with refuses(unit, variable):
            unit.set({variable: value})
        unit.reset()
        drive(unit.start())


@pytest.mark.parametrize(
    "name, settings, words",
    [
        # This case is marginal: at this rate the spectral radius is exactly one (docs/errata.md).
        ("CRMPC", {"feedback.k1": -10.0, "feedback.k2": -10.0, "period.feedback": 0.2}, ["spectral radius", "-10"]),
        ("CRMPC", {"feedback.k1": -60.0, "feedback.k2": -60.0}, ["spectral radius", "-60"]),
        ("CRMPC", {"period.optimisation": 0.21}, ["period.optimisation", "period.feedback"]),
        ("CRMPC", {"limit.rate": 1e-4, "constraints": "paper"}, ["x_tube"]),
        ("DLMPC", {"slidingMode.q": 50.0}, ["slidingMode.q", "50"]),
        ("DLMPC", {"period.feedback": 0.03}, ["period.optimisation", "period.feedback"]),
        ("LQR", {"weight.P[1]": 1e7, "weight.P[4]": 1e7}, ["spectral radius"]),
        ("LQR", {"reference.profile": "table", "reference.file": "nowhere.csv"}, ["nowhere.csv"]),
        ("CRMPC", {"inertia.Ixz": 1e6}, ["inertia.Ixz"]),
        ("ReentryPlant", {"inertia.Iyy": 1e3}, ["inertia.Iyy"]),
        ("ControlAllocator", {"period": 0.0105}, ["period", "pwpf.period"]),
        ("ControlAllocator", {"pwpf.on": 5.0}, ["pwpf.on"]),
        ("ControlAllocator", {"weight.moment[2]": 0.0}, ["weight.moment[2]"]),
        ("AttitudeEstimator", {"filter.cutoff": 50.0}, ["filter.cutoff"]),
        ("AttitudeEstimator", {"lost.after": 0.0}, ["lost.after"]),
    ],
)
def test_designs_that_cannot_work_are_refused_at_initialization(fmu, name, settings, words):
    with Unit(fmu(name), settings) as unit:
        with refuses(unit, *words):
            unit.start()
        unit.reset()
        drive(unit.start())


@pytest.mark.parametrize("name", NAMES)
def test_another_guid(fmu, name):
    with pytest.raises(RuntimeError, match="GUID"):
        Unit(fmu(name), guid="{00000000-0000-0000-0000-000000000000}")


def test_saved_states_that_do_not_fit(unit, fmu):
    unit.start()
    drive(unit, 3)
    saved = unit.save()
    damaged = bytearray(saved)
    damaged[-20] ^= 0x10
    for bad, word in (
        (saved[:-1], "truncated"),
        (saved[: len(saved) // 2], "truncated"),
        (saved[:5], "truncated"),
        (saved + b"x", "truncated or too long"),
        (bytes(damaged), "checksum"),
        (b"\x00" * len(saved), "not a saved state"),
    ):
        with refuses(unit, word):
            unit.restore(bad)
    other = "LQR" if unit.fmu.name != "LQR" else "CRMPC"
    with Unit(fmu(other)).start() as stranger:
        with refuses(unit, "GUID"):
            unit.restore(stranger.save())
    # None of these refusals left a trace.
    assert unit.save() == saved


def test_calls_in_the_wrong_state(unit):
    with refuses(unit, "fmi2DoStep"):
        unit.step(0.0, STEP)
    unit.reset()
    with refuses(unit, "fmi2ExitInitializationMode"):
        unit.exit()
    unit.reset()
    with refuses(unit, "fmi2Terminate"):
        unit.slave.terminate()
    unit.reset()
    unit.start()
    with refuses(unit, "fmi2EnterInitializationMode"):
        unit.slave.enterInitializationMode()


def test_parameters_are_fixed_once_the_simulation_runs(unit):
    name = {"ControlAllocator": "weight.jet", "AttitudeEstimator": "field.declination"}.get(unit.fmu.name, "inertia.Ixx")
    unit.start()
    with refuses(unit, name):
        unit.set({name: 6e5})


@pytest.mark.parametrize("time, step", [(1.0, STEP), (0.0, -STEP), (0.0, math.nan), (math.nan, STEP), (0.0, math.inf)])
def test_steps_that_do_not_join(unit, time, step):
    unit.start()
    with refuses(unit, "fmi2DoStep"):
        unit.step(time, step)


ONE = (c_uint * 1)(0)
VALUE = (c_double * 1)(0.0)


@pytest.mark.parametrize(
    "function, arguments",
    [
        ("fmi2GetReal", [None, 1, VALUE]),
        ("fmi2GetReal", [ONE, 1, None]),
        ("fmi2SetReal", [None, 1, VALUE]),
        ("fmi2SetReal", [ONE, 1, None]),
        ("fmi2GetInteger", [ONE, 1, None]),
        ("fmi2GetBoolean", [ONE, 1, None]),
        ("fmi2GetString", [ONE, 1, None]),
        ("fmi2SetString", [ONE, 1, None]),
        ("fmi2SetRealInputDerivatives", [ONE, 1, None, None]),
        ("fmi2GetFMUstate", [None]),
        ("fmi2SetFMUstate", [None]),
        ("fmi2SerializedFMUstateSize", [None, None]),
        ("fmi2SerializeFMUstate", [None, None, 10]),
        ("fmi2DeSerializeFMUstate", [None, 10, None]),
        ("fmi2GetRealStatus", [2, None]),
    ],
)
def test_null_pointers(unit, function, arguments):
    unit.start()
    with refuses(unit, function):
        getattr(unit.slave, function)(unit.slave.component, *arguments)


def test_no_instance(unit):
    # Without an instance there is no log.
    with pytest.raises(FMICallException):
        unit.slave.fmi2DoStep(None, 0.0, STEP, 0)
    with pytest.raises(FMICallException):
        unit.slave.fmi2GetReal(None, ONE, 1, VALUE)


def test_a_plant_at_a_singular_attitude_says_so(fmu):
    with Unit(fmu("ReentryPlant"), {"disturbance.kind": "none", "initial.alpha": math.pi / 2, "initial.beta": 1.5, "initial.p": 0.5}) as plant:
        with refuses(plant, "beta"):
            plant.start()
            for tick in range(50):
                plant.step(tick * STEP, STEP)
        plant.reset()
        drive(plant.start())


def test_measurements_without_sense_do_not_end_a_controller(fmu):
    """At a state far from anything feasible the controller counts a fallback with a finite moment,
    and recovers."""
    with Unit(fmu("CRMPC")).start() as unit:
        for tick in range(5):
            unit.step(tick * STEP, STEP)
        unit.set(dict(zip(ANGLES + RATES, [0.13, 0.17, -0.5, 0.5, -0.5, 0.5])))
        fallbacks, status = unit.get(["solver.fallbacks", "solver.status"])
        assert fallbacks == 1 and status == unit.fmu.item("solver.status", "fallback")
        assert all(math.isfinite(value) for value in unit.outputs())
        for tick in range(5, 10):
            unit.step(tick * STEP, STEP)
        unit.set(dict(zip(ANGLES + RATES, [0.13, 0.17, -0.5, 0.0, 0.0, 0.0])))
        fallbacks, status = unit.get(["solver.fallbacks", "solver.status"])
        assert fallbacks == 1 and status != unit.fmu.item("solver.status", "fallback")
