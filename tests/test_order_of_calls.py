"""FMI 2.0.5, section 4.2.1: in co-simulation, nothing is read from an instance between setting its
inputs and stepping it. Two orders of calls remain for a loop, and what is promised holds in both."""

import math

import numpy as np
import pytest

from fmi import ANGLES, MOMENT, RATES, Instance, Loop

STEP = 0.04
CONTROLLERS = ["CRMPC", "DLMPC", "LQR", "FBL", "BTVSMC", "BTVSMC_DO", "SOTVSMC_DO", "TwoLoopSMC"]
SIXTY_SECONDS = 60.0


def fly(fmu, settings=None, plant=None, jacobi=False, steps=1250, name="CRMPC", step=STEP):
    """Returns state and moment at each point, and what the guarantee's status is after each step."""
    with Instance(fmu(name), settings) as controller, Instance(fmu("ReentryPlant"), plant) as vehicle:
        loop = Loop(controller, vehicle, step, jacobi)
        loop.start()
        rows, in_force = [loop.read()], []
        for _ in range(steps):
            loop.advance()
            rows.append(loop.read())
            in_force.append(controller.get(["guarantee.inForce"])[0])
        return np.array(rows), np.array(in_force)


ADVERSARIES = {
    "white": {"disturbance.kind": "white"},
    "along the rate": {"disturbance.kind": "alongRate"},
    "against the moment": {"disturbance.kind": "againstMoment"},
    "constant": {"disturbance.kind": "constant"},
    "square": {"disturbance.kind": "square", "disturbance.square.period": 3.0},
    "light": {"disturbance.kind": "againstMoment", "inertia.scale": 0.95},
    "heavy": {"disturbance.kind": "constant", "inertia.scale": 1.05},
}


@pytest.mark.parametrize("adversary", ADVERSARIES)
def test_oracle_read_set_step_has_exactly_one_step_of_delay(fmu, adversary):
    """It is the loop of a plant that acts one step late, bit for bit, and the guarantee holds."""
    plant = {"disturbance.seed": 11, **ADVERSARIES[adversary]}
    rows, in_force = fly(fmu, {"delay": STEP}, plant, jacobi=True)
    late, late_in_force = fly(fmu, {"delay": STEP}, plant | {"actuation.delay": STEP})
    assert (rows[:, :6] == late[:, :6]).all() and (in_force == late_in_force).all()
    assert np.mean(in_force) >= 0.99
    assert np.degrees(np.linalg.norm(rows[:, 3:6], axis=1)).max() <= 5.0
    assert np.linalg.norm(rows[:, 6:9], axis=1).max() <= 1.356e5


@pytest.mark.parametrize("name", CONTROLLERS)
def test_with_a_delay_nothing_acts_before_the_first_command(fmu, name):
    with Instance(fmu(name), {"delay": STEP}).start() as instance:
        assert instance.get(MOMENT) == [0.0] * 3
        instance.step(0.0, STEP)
        assert np.abs(instance.get(MOMENT)).max() > 0.0


@pytest.mark.parametrize("name", CONTROLLERS)
def test_outputs_are_held_after_a_step_until_an_input_is_set(fmu, name):
    values = dict(zip(ANGLES + RATES, [0.13, 0.16, -0.5, 0.01, -0.02, 0.0]))
    later = dict(zip(ANGLES + RATES, [0.12, 0.15, -0.4, 0.02, -0.01, 0.01]))
    with Instance(fmu(name)).start(inputs=values) as instance:
        period = instance.get(["period.feedback"])[0] if "period.feedback" in instance.fmu.variables else STEP
        first = instance.get(MOMENT)
        instance.step(0.0, period)
        assert instance.get(MOMENT) == first, "the moment that acted over the step"
        saved = instance.save()
        instance.set(values)
        due = instance.get(MOMENT)
        # The laws of these two give the same moment at the next tick for the same measurement.
        assert due != first or name in ("DLMPC", "FBL"), "an equal value counts as set, so that the next tick is due"
        instance.set(later)
        assert instance.get(MOMENT) != due
        instance.set(values)
        assert instance.get(MOMENT) == due, "the evaluation for other inputs leaves no trace"
        instance.restore(saved)
        assert instance.get(MOMENT) == first, "the saved state knows that no input was set"
        instance.set(later)
        expected = instance.get(MOMENT)
        instance.restore(saved)
        instance.set(later)
        instance.step(period, period)
        assert instance.get(MOMENT) == expected, "what is read after the step is what was asked for before"
        instance.reset()
        instance.start(inputs=values)
        assert instance.get(MOMENT) == first


def irregular(k: int) -> float:
    return [0.013, 0.04, 0.021, 0.09, 0.04, 0.0371, 0.2][k % 7]


STEPS = {f"{step} s": lambda k, step=step: step for step in (0.01, 0.02, 0.03, 0.04, 0.05, 0.1, 0.2, 0.4)}


@pytest.mark.parametrize("step", [*STEPS, "irregular"])
def test_a_guarantee_in_force_is_kept_with_any_communication_step(fmu, step):
    length = STEPS.get(step, irregular)
    with Instance(fmu("CRMPC")) as controller, Instance(fmu("ReentryPlant")) as plant:
        loop = Loop(controller, plant, STEP)
        loop.start()
        time, k, withdrawals, was, statuses = 0.0, 0, 0, False, []
        while time < SIXTY_SECONDS:
            loop.clock = lambda _, now=(time, length(k)): now
            loop.advance()
            time, k = time + length(k), k + 1
            rows = loop.read()
            is_in_force, status = controller.get(["guarantee.inForce", "guarantee.status"])
            statuses.append(status)
            if is_in_force:
                assert math.degrees(np.linalg.norm(rows[3:6])) <= 5.0, time
                assert np.linalg.norm(rows[6:9]) <= 1.356e5, time
            withdrawals += was and not is_in_force
            was = is_in_force
    assert withdrawals <= 2
    is_part = step in ("0.01 s", "0.02 s", "0.04 s")
    stale = fmu("CRMPC").item("guarantee.status", "stale")
    assert is_part == was and (is_part or statuses.count(stale) > 0.9 * len(statuses))


@pytest.mark.parametrize("name", ["CRMPC", "LQR"])
def test_a_delay_that_nobody_told_is_found(fmu, name):
    plant = {"disturbance.kind": "square", "disturbance.square.period": 3.0}
    for jacobi, told, delay in [(True, 0.0, STEP), (True, STEP, STEP), (False, 0.0, 0.0), (False, STEP, 0.0)]:
        with Instance(fmu(name), {"delay": told}) as controller, Instance(fmu("ReentryPlant"), plant) as vehicle:
            Loop(controller, vehicle, STEP, jacobi).fly(250)
            estimate, differs = controller.get(["loopDelay.estimate", "loopDelay.differs"])
            assert estimate == pytest.approx(delay, abs=0.25 * STEP) and differs == (told != delay)
            if name == "CRMPC":
                status, contradiction = controller.get(["guarantee.status", "guarantee.contradiction"])
                named = (controller.fmu.item("guarantee.status", "exceeded"), controller.fmu.item("guarantee.contradiction", "delay"))
                assert ((status, contradiction) == named) == differs
            assert ("loop delay" in controller.messages()) == differs


def test_little_moment_is_said(fmu):
    for delay, little in [(0.04, False), (0.08, True)]:
        with Instance(fmu("CRMPC"), {"delay": delay}).start() as controller:
            controller.step(0.0, STEP)
            (left,) = controller.get(["guarantee.momentLeft"])
            assert (0.0 < left < 0.1) == little and left < 0.2
            assert ("guarantee.momentLeft" in controller.messages()) == little
