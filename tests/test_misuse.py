"""Bad input gives an FMI error that names the culprit in the log; the process stays alive, and the
instance is usable again after a reset. What every FMU refuses in the same way, as calls, pointers and
references, is tested in tests/conformance, and every message in the tests of the FMUs' crates."""

import math

import pytest
from fmpy.fmi1 import FMICallException

from fmi import ANGLES, RATES, Instance

STEP = 0.04


def drive(instance: Instance) -> None:
    for tick in range(12):
        instance.step(tick * STEP, STEP)


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


@pytest.mark.parametrize(
    "name, settings, words",
    [
        # This case is marginal: at this rate the spectral radius is exactly one (docs/errata.md).
        ("CRMPC", {"feedback.k1": -10.0, "feedback.k2": -10.0, "period.feedback": 0.2}, ["spectral radius", "-10"]),
        ("DLMPC", {"slidingMode.q": 50.0}, ["slidingMode.q", "50"]),
        ("LQR", {"weight.P[1]": 1e7, "weight.P[4]": 1e7}, ["spectral radius"]),
        ("LQR", {"reference.profile": "table", "reference.file": "nowhere.csv"}, ["nowhere.csv"]),
        ("CRMPC", {"vehicle.file": "no-such"}, ["vehicle.file: no-such"]),
        ("ControlAllocator", {"weight.moment[2]": 0.0}, ["weight.moment[2]"]),
        ("AttitudeEstimator", {"settings.file": "filter.cutoff = 50.0"}, ["filter.cutoff"]),
        ("EntryGuidance", {"settings.file": "shaping.bankRate = 0.0"}, ["shaping.bankRate"]),
        ("EntryGuidance", {"settings.file": "shaping.bank = 1.0"}, ["settings.file", "shaping.bank: there is no such setting"]),
        ("EntryGuidance", {"settings.file": "limit.load = 1.0"}, ["limit.load is a variable"]),
        ("EntryNavigation", {"settings.file": "fix.gate = 1.0"}, ["fix.gate"]),
        ("EntryNavigation", {"settings.file": "fix.gate ="}, ["settings.file", "line 1"]),
        ("ReentryPlant", {"sensor.set": 2, "settings.file": "sensor.gyroscope.noise = -1"}, ["sensor.gyroscope.noise"]),
        ("ReentryPlant", {"translation": "entry", "initial.altitude": 10e3}, ["initial.altitude", "end.altitude"]),
        ("ReentryPlant", {"translation": "entry", "air.rows": 2}, ["air.altitude[2]"]),
    ],
)
def test_designs_that_cannot_work_are_refused_at_initialization(fmu, name, settings, words, tmp_path):
    if text := settings.get("settings.file"):
        file = tmp_path / "settings.toml"
        file.write_text(text)
        settings = settings | {"settings.file": str(file)}
    with Instance(fmu(name), settings) as instance:
        with refuses(instance, *words):
            instance.start()
        instance.reset()
        drive(instance.start())


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
