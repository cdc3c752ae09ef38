"""Bad input gives an FMI error that names the culprit in the log; the process stays alive, and the
instance is usable again after a reset."""

import math
from ctypes import c_double, c_uint

import pytest
from fmpy.fmi1 import FMICallException

from conftest import NAMES
from fmi import ANGLES, RATES, Instance

STEP = 0.04
INPUT = {"ReentryPlant": "moment.x", "CRMPC": "rate.p", "DLMPC": "rate.q", "LQR": "attitude.beta", "ControlAllocator": "moment.y", "AttitudeEstimator": "measured.gyroscope.y", "EntryGuidance": "motion.heading", "EntryNavigation": "measured.gyroscope.y"}
INPUT |= {name: "rate.p" for name in NAMES if name not in INPUT}


def drive(instance: Instance, ticks: int = 12) -> list:
    rows = []
    for tick in range(ticks):
        instance.set({INPUT[instance.fmu.name]: 1e-3 * tick})
        rows.append(instance.outputs())
        instance.step(tick * STEP, STEP)
    return rows


def refuses(instance: Instance, *words: str):
    """The call inside must fail, and the log must tell why."""

    class Expectation:
        def __enter__(self):
            instance.log.clear()

        def __exit__(self, kind, error, _):
            assert kind is not None and issubclass(kind, FMICallException), f"no error, log: {instance.log}"
            messages = instance.messages()
            assert "not allowed in state error" not in messages, "an earlier call has failed, this one was not looked at"
            for word in words:
                assert word in messages, f"{word!r} is not in {messages!r}"
            return True

    return Expectation()


@pytest.fixture(params=NAMES)
def instance(request, fmu):
    """An instance that misuse must not break: after a reset it behaves as a new one."""
    with Instance(fmu(request.param)) as fresh:
        expected = drive(fresh.start())
    with Instance(fmu(request.param)) as instance:
        yield instance
        instance.reset()
        assert drive(instance.start()) == expected


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_inputs_that_are_no_numbers(instance, value):
    name = INPUT[instance.fmu.name]
    instance.start()
    drive(instance, 3)
    with refuses(instance, name, "not a finite number"):
        instance.set({name: value})


def test_value_references_that_do_not_exist(instance):
    instance.start()
    with refuses(instance, "123456"):
        instance.slave.getReal([123456])
    instance.reset()
    instance.start()
    with refuses(instance, "123456"):
        instance.slave.setReal([123456], [1.0])


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
        ("EntryGuidance", "shaping.bankRate", -1.0),
        ("EntryNavigation", "alignment.attitude", -1.0),
        ("LQR", "reference.profile", 77),
    ],
)
def test_parameters_out_of_range_are_refused_when_set(fmu, name, variable, value):
    with Instance(fmu(name)) as instance:
        with refuses(instance, variable):
            instance.set({variable: value})
        instance.reset()
        drive(instance.start())


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
        ("EntryGuidance", {"shaping.bankRate": 0.0}, ["shaping.bankRate"]),
        ("EntryNavigation", {"fix.gate": 1.0}, ["fix.gate"]),
        ("ReentryPlant", {"translation": "entry", "initial.altitude": 10e3}, ["initial.altitude", "end.altitude"]),
        ("ReentryPlant", {"translation": "entry", "air.rows": 2}, ["air.altitude[2]"]),
    ],
)
def test_designs_that_cannot_work_are_refused_at_initialization(fmu, name, settings, words):
    with Instance(fmu(name), settings) as instance:
        with refuses(instance, *words):
            instance.start()
        instance.reset()
        drive(instance.start())


@pytest.mark.parametrize("name", NAMES)
def test_another_guid(fmu, name):
    with pytest.raises(RuntimeError, match="GUID"):
        Instance(fmu(name), guid="{00000000-0000-0000-0000-000000000000}")


def test_saved_states_that_do_not_fit(instance, fmu):
    instance.start()
    drive(instance, 3)
    saved = instance.save()
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
        with refuses(instance, word):
            instance.restore(bad)
    other = "LQR" if instance.fmu.name != "LQR" else "CRMPC"
    with Instance(fmu(other)).start() as stranger:
        with refuses(instance, "GUID"):
            instance.restore(stranger.save())
    # None of these refusals left a trace.
    assert instance.save() == saved


def test_calls_in_the_wrong_state(instance):
    with refuses(instance, "fmi2DoStep"):
        instance.step(0.0, STEP)
    instance.reset()
    with refuses(instance, "fmi2ExitInitializationMode"):
        instance.exit()
    instance.reset()
    with refuses(instance, "fmi2Terminate"):
        instance.slave.terminate()
    instance.reset()
    instance.start()
    with refuses(instance, "fmi2EnterInitializationMode"):
        instance.slave.enterInitializationMode()


def test_parameters_are_fixed_once_the_simulation_runs(instance):
    name = {"ControlAllocator": "weight.jet", "AttitudeEstimator": "field.declination", "EntryGuidance": "planet.radius", "EntryNavigation": "planet.radius"}.get(instance.fmu.name, "inertia.Ixx")
    instance.start()
    with refuses(instance, name):
        instance.set({name: 6e5})


@pytest.mark.parametrize("time, step", [(1.0, STEP), (0.0, -STEP), (0.0, math.nan), (math.nan, STEP), (0.0, math.inf)])
def test_steps_that_do_not_join(instance, time, step):
    instance.start()
    with refuses(instance, "fmi2DoStep"):
        instance.step(time, step)


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
def test_null_pointers(instance, function, arguments):
    instance.start()
    with refuses(instance, function):
        getattr(instance.slave, function)(instance.slave.component, *arguments)


def test_no_instance(instance):
    # Without an instance there is no log.
    with pytest.raises(FMICallException):
        instance.slave.fmi2DoStep(None, 0.0, STEP, 0)
    with pytest.raises(FMICallException):
        instance.slave.fmi2GetReal(None, ONE, 1, VALUE)


def test_a_plant_at_a_singular_attitude_says_so(fmu):
    with Instance(fmu("ReentryPlant"), {"disturbance.kind": "none", "initial.alpha": math.pi / 2, "initial.beta": 1.5, "initial.p": 0.5}) as plant:
        with refuses(plant, "beta"):
            plant.start()
            for tick in range(50):
                plant.step(tick * STEP, STEP)
        plant.reset()
        drive(plant.start())


def test_measurements_without_sense_do_not_end_a_controller(fmu):
    """At a state far from anything feasible the controller counts a fallback with a finite moment,
    and recovers."""
    with Instance(fmu("CRMPC")).start() as instance:
        for tick in range(5):
            instance.step(tick * STEP, STEP)
        instance.set(dict(zip(ANGLES + RATES, [0.13, 0.17, -0.5, 0.5, -0.5, 0.5])))
        fallbacks, status = instance.get(["solver.fallbacks", "solver.status"])
        assert fallbacks == 1 and status == instance.fmu.item("solver.status", "fallback")
        assert all(math.isfinite(value) for value in instance.outputs())
        for tick in range(5, 10):
            instance.step(tick * STEP, STEP)
        instance.set(dict(zip(ANGLES + RATES, [0.13, 0.17, -0.5, 0.0, 0.0, 0.0])))
        fallbacks, status = instance.get(["solver.fallbacks", "solver.status"])
        assert fallbacks == 1 and status != instance.fmu.item("solver.status", "fallback")
