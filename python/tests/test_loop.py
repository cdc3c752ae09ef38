"""ClosedLoop against the orchestrator, and what it refuses."""

import math
import warnings

import numpy as np
import pytest
from laws import lqr
from laws import pd as pd_law
from reentry_fmus import (
    ClosedLoop,
    InstanceError,
    InstanceWarning,
    LawError,
    OrchestratorError,
    experiment,
    fmu,
)

ATTITUDE = [f"plant.attitude.{axis}" for axis in ("alpha", "beta", "sigma")]
RATE = [f"plant.rate.{axis}" for axis in "pqr"]
MOMENT = [f"controller.moment.{axis}" for axis in "xyz"]
REFERENCE = [f"controller.reference.{axis}" for axis in ("alpha", "beta", "sigma")]
COLUMNS = ATTITUDE + RATE + REFERENCE + MOMENT


def test_oracle_the_last_time_is_the_stop_time_as_in_the_orchestrator():
    # Three steps of 0.2 s are 0.6000000000000001 s.
    recorded = experiment("lqr", step=0.2, stop=0.6).table
    with ClosedLoop(controller="LQR", step=0.2) as loop:
        table = loop.run(0.6).table
    assert table.index[-1] == 0.6 and np.array_equal(table.index, recorded.index)
    assert np.array_equal(table[COLUMNS].to_numpy(), recorded[COLUMNS].to_numpy())


def test_oracle_the_state_at_10_s_is_the_orchestrators():
    recorded = experiment("crmpc-robust").table
    with ClosedLoop(controller="CRMPC") as loop:
        for _ in range(250):
            state = loop.step()
    assert state.time == 10.0
    # The moment is that of the step that ends at 10 s; a row has that of the step that begins.
    for values, names, row in [
        (state.attitude, ATTITUDE, 250),
        (state.rate, RATE, 250),
        (state.reference, REFERENCE, 250),
        (state.moment, MOMENT, 249),
    ]:
        assert values.shape == (3,)
        assert np.array_equal(values, recorded[names].iloc[row].to_numpy(dtype=float))


def test_steps_and_run_agree():
    with ClosedLoop() as loop:
        table = loop.run(2.0, pd_law).table
        state = loop.reset()
        for row in table.iloc[:-1].itertuples():
            assert row[0] == state.time
            assert row[1:4] == tuple(state.attitude)
            moment = pd_law(state)
            assert row[-3:] == tuple(moment)
            state = loop.step(moment)
            assert np.array_equal(state.moment, moment)
            applied = [loop.get(f"plant.appliedMoment.{axis}") for axis in "xyz"]
            assert applied == moment.tolist()
        # No step begins at the last point, which repeats the moment before.
        last = table.iloc[-1]
        assert last.iloc[:3].tolist() == state.attitude.tolist()
        assert last.iloc[-3:].tolist() == moment.tolist()


def test_run_goes_on_from_the_present_time():
    with ClosedLoop() as loop:
        whole = loop.run(2.0, pd_law).table
        loop.reset()
        loop.run(1.0, pd_law)
        rest = loop.run(2.0, pd_law).table
    assert rest.equals(whole.loc[1.0:])


# Metrics and figure


@pytest.mark.parametrize(("controller", "named"), [("CRMPC", "crmpc-robust"), ("LQR", "lqr")])
def test_oracle_a_loop_is_the_orchestrators_bit_for_bit_with_its_metrics_and_figure(controller, named):
    """The parameters of the experiment are set, so that the loop is that of the experiment."""
    recorded = experiment(named)
    components = recorded.description["components"]
    parameters = {
        f"{component}.{name}": value
        for component in ("plant", "controller")
        for name, value in components[component]["set"].items()
    }
    with ClosedLoop(controller=controller, parameters=parameters) as loop:
        run = loop.run(50.0)
    assert run.table.shape == (1251, 18) and np.array_equal(run.table.index, recorded.table.index)
    assert np.array_equal(run.table[COLUMNS].to_numpy(), recorded.table[COLUMNS].to_numpy())
    # The loop is closed, and its metrics are still to be had.
    assert set(run.metrics) == set(recorded.metrics)
    compared = untimed(recorded.metrics)
    assert untimed(run.metrics) == compared and len(compared) >= 12
    assert run.metrics["wall_s"] is None
    assert run.title == f"{controller}, closed loop"
    assert run.figure.replace(run.title, recorded.title) == recorded.figure
    for component in ("plant", "controller"):
        mine = run.description["components"][component]
        assert mine["parameters"] == components[component]["parameters"]
        assert mine["guid"] == components[component]["guid"]


def untimed(metrics):
    """Metrics that do not depend on the wall clock."""
    timed = ("solver_ms", "wall_s", "real_time_factor")
    return {name: value for name, value in metrics.items() if not name.startswith(timed)}


def test_oracle_a_law_in_python_has_the_metrics_of_its_fmu():
    with ClosedLoop() as loop, ClosedLoop(controller="LQR") as packaged:
        by_law, by_fmu = loop.run(50.0, lqr), packaged.run(50.0)
    assert np.allclose(by_law.table[COLUMNS], by_fmu.table[COLUMNS], rtol=1e-9, atol=1e-12)
    numbers = {name: v for name, v in untimed(by_fmu.metrics).items() if isinstance(v, float)}
    assert len(numbers) >= 8
    for name, value in numbers.items():
        assert by_law.metrics[name] == pytest.approx(value, rel=1e-9), name
    assert by_law.title == "lqr, closed loop"


def test_oracle_metrics_are_those_of_the_time_that_was_run():
    """By their definition, from the table: EMS counts the steps, not the last point."""
    with ClosedLoop(controller="CRMPC") as loop:
        loop.run(20.0)
        run = loop.run(50.0)
    error = run.table[ATTITUDE].to_numpy() - run.table[REFERENCE].to_numpy()
    ems = np.degrees(np.sqrt(np.square(error[:-1]).sum(axis=1).mean()))
    assert run.metrics["ems_deg"] == pytest.approx(ems, rel=1e-12)
    norms = np.linalg.norm(run.table[RATE], axis=1)
    assert run.metrics["max_rate_deg_s"] == pytest.approx(np.degrees(norms.max()), rel=1e-12)
    assert run.description["simulation"]["start"] == 20.0 and run.metrics["samples"] == 751


def test_a_loop_that_is_lost_is_judged_up_to_then():
    with ClosedLoop(parameters={"controller.limit.moment": 2e5}) as loop:
        run = loop.run(20.0, lambda state: [1e4, 0.0, 0.0])
    assert run.metrics["lost_at"] < 20.0 and not run.metrics["completed"]
    assert run.metrics["moment_limit"] == 2e5
    assert len(run.table) == 501


def test_fmus_that_the_orchestrator_refuses_fly_without_metrics(tmp_path):
    """Such as one that has left since."""
    copy = tmp_path / "Mine.fmu"
    copy.write_bytes(fmu("LQR").read_bytes())
    with ClosedLoop(controller=copy) as loop:
        run = loop.run(1.0)
    copy.unlink()
    with pytest.raises(OrchestratorError, match="Mine.fmu"):
        run.metrics
    assert "no metrics: " in repr(run) and "Mine.fmu" in repr(run)
    assert len(run["plant.rate.p"]) == 26 and "Mine.fmu" in run._repr_html_()


def test_degrees_are_for_reading():
    with ClosedLoop() as loop:
        si = loop.run(1.0, pd_law).table
        loop.reset()
        deg = loop.run(1.0, pd_law, units="deg").table
    assert np.allclose(deg[ATTITUDE + RATE], np.degrees(si[ATTITUDE + RATE]), rtol=1e-15)
    assert deg[MOMENT].equals(si[MOMENT])
    expected = {ATTITUDE[0]: "deg", RATE[0]: "deg/s", MOMENT[0]: "N.m"}
    assert {name: deg.attrs["units"][name] for name in expected} == expected
    assert deg.attrs["units"]["controller.referenceAcceleration.alpha"] == "deg/s2"
    assert deg.attrs["descriptions"][ATTITUDE[0]] == "Angle of attack relative to the ground velocity"


def test_the_reference_is_chosen():
    parameters = {
        "controller.reference.profile": "constant",
        "controller.reference.angle.alpha": 0.25,
    }
    with ClosedLoop(parameters=parameters) as loop:
        state = loop.step([0.0, 0.0, 0.0])
    assert state.reference[0] == 0.25
    assert not state.reference_rate.any() and not state.reference_acceleration.any()


def test_a_reset_repeats_and_takes_other_parameters():
    with ClosedLoop(controller="LQR") as loop:
        first = loop.run(2.0).table
        assert loop.reset().time == 0.0
        assert loop.run(2.0).table.equals(first)
        loop.reset({"plant.disturbance.seed": 2})
        other = loop.run(2.0).table
        assert not other.equals(first)
        loop.reset()
        assert loop.run(2.0).table.equals(other)


def test_inputs_that_are_not_connected_can_be_set():
    with ClosedLoop(parameters={"plant.disturbance.kind": "none"}) as loop:
        loop.set("plant.disturbanceMoment.x", 1e4)
        assert loop.step([0.0, 0.0, 0.0]).rate[0] > 0.0
        assert loop.get("plant.disturbanceMoment.x") == 1e4


def test_two_loops_do_not_disturb_each_other():
    with ClosedLoop(controller="CRMPC") as one, ClosedLoop(controller="CRMPC") as other:
        states = [(one.step(), other.step()) for _ in range(50)]
    assert all(np.array_equal(a.attitude, b.attitude) for a, b in states)


# Failure


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"plant": "RentryPlant"}, 'there is no FMU "RentryPlant"; did you mean "ReentryPlant"?'),
        ({"controller": "nowhere/My.fmu"}, "My.fmu: there is no such FMU"),
        ({"controller": "ControlAllocator"}, 'ControlAllocator has no variable "attitude.alpha"'),
        ({"step": 0.0}, "step = 0.0 s, but a positive time is needed"),
        ({"step": math.nan}, "step = nan s, but a positive time is needed"),
        ({"parameters": {"plan.seed": 1}}, 'no component "plan"; did you mean "plant"?'),
        (
            {"parameters": {"plant.disturbance.bund": 1.0}},
            'ReentryPlant has no variable "disturbance.bund"; did you mean "disturbance.bound"?',
        ),
        (
            {"parameters": {"plant.disturbance.kind": "wite"}},
            "disturbance.kind needs one of its items, not 'wite'; did you mean \"white\"?",
        ),
        (
            {"parameters": {"plant.disturbance.bound": "2 deg/s2"}},
            "disturbance.bound needs a number in rad/s2, not '2 deg/s2'",
        ),
        ({"parameters": {"plant.disturbance.seed": 1.5}}, "disturbance.seed needs an integer"),
        ({"parameters": {"plant.disturbance.seed": -1}}, "= -1 is below the minimum 0"),
        ({"parameters": {"plant.moment.x": 1.0}}, "moment.x is no parameter"),
        ({"parameters": {"plant.disturbance.bound": -1.0}}, "= -1.0 is below the minimum 0"),
        (
            {"parameters": {"controller.weight.P[1]": 1.0}},
            "controller.weight.P[1]: the loop has no controller, only a reference and limits",
        ),
        (
            {"controller": "CRMPC", "parameters": {"controller.disturbance.bound": 1.0}},
            "constraints = robust cannot be guaranteed",
        ),
    ],
)
def test_what_cannot_be_made_is_refused(arguments, message):
    with pytest.raises((ValueError, TypeError, OSError, InstanceError)) as caught:
        ClosedLoop(**arguments)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    "moment",
    [
        [1.0, 2.0],
        [[1.0, 2.0, 3.0]],
        1.0,
        [0.0, 0.0, math.nan],
        [0.0, 0.0, 10**400],
        ["a", 0.0, 0.0],
        ["1", "2", "3"],
        [0.0, 0.0, 1j],
        {},
    ],
)
def test_a_moment_is_three_finite_numbers(moment):
    with ClosedLoop() as loop:
        with pytest.raises(ValueError, match="three finite numbers"):
            loop.step(moment)
        with pytest.raises(LawError, match="at t = 0 s: ValueError: .* three finite numbers"):
            loop.run(1.0, lambda state: moment)
        # The loop goes on as if nothing had been asked.
        assert loop.step([0.0, 0.0, 0.0]).time == 0.04


def test_who_gives_the_moment_is_clear():
    with ClosedLoop() as loop:
        with pytest.raises(TypeError, match="step needs a moment"):
            loop.step()
        with pytest.raises(TypeError, match="run needs a law"):
            loop.run(1.0)
    with ClosedLoop(controller="LQR") as loop:
        with pytest.raises(TypeError, match="comes from LQR"):
            loop.step([0.0, 0.0, 0.0])
        with pytest.raises(TypeError, match="comes from LQR"):
            loop.run(1.0, pd_law)


def test_run_refuses_times_that_it_cannot_reach():
    with ClosedLoop(controller="LQR") as loop:
        loop.run(1.0)
        with pytest.raises(ValueError, match="before the present time"):
            loop.run(0.5)
        with pytest.raises(ValueError, match="no multiple of the step"):
            loop.run(1.05)
        for never in (math.nan, math.inf):
            with pytest.raises(ValueError, match=f"stop = {never} s, but a finite time is needed"):
                loop.run(never)
        with pytest.raises(ValueError, match='"si" or "deg"'):
            loop.run(2.0, units="grad")


def test_variables_are_named_in_errors():
    with ClosedLoop() as loop:
        with pytest.raises(ValueError, match='did you mean "attitude.alpha"'):
            loop.get("plant.atitude.alpha")
        with pytest.raises(ValueError, match="no component"):
            loop.get("attitude.alpha")
        with pytest.raises(ValueError, match="set by the loop itself"):
            loop.set("plant.moment.x", 1.0)
        with pytest.raises(ValueError, match="is no input"):
            loop.set("plant.attitude.alpha", 1.0)


def test_an_fmu_that_fails_says_why_and_can_be_reset():
    def spin(loop):
        while True:
            loop.step([3e6, 3e6, 3e6])

    with ClosedLoop() as loop:
        start = loop.state
        with pytest.raises(InstanceError, match="the attitude angles are singular") as caught:
            spin(loop)
        assert (caught.value.fmu, caught.value.call) == ("ReentryPlant", "fmi2DoStep")
        with pytest.raises(InstanceError, match="ReentryPlant: the loop ended.*reset the loop"):
            loop.step([0.0, 0.0, 0.0])
        assert np.array_equal(loop.reset().attitude, start.attitude)
        assert loop.step([0.0, 0.0, 0.0]).time == 0.04


def test_warnings_of_fmus_are_warnings():
    # The plant is much lighter than the controller assumes, which no guarantee covers.
    with ClosedLoop(controller="CRMPC", parameters={"plant.inertia.scale": 0.5}) as loop:
        with pytest.warns(InstanceWarning, match="CRMPC: the guarantee is no longer in force"):
            loop.run(50.0)
    with warnings.catch_warnings(), ClosedLoop(controller="CRMPC") as loop:
        warnings.simplefilter("error")
        loop.run(50.0)


def test_a_closed_loop_is_closed():
    with ClosedLoop() as loop:
        pass
    for use in (
        lambda: loop.step([0.0, 0.0, 0.0]),
        lambda: loop.run(1.0, pd_law),
        lambda: loop.get("plant.rate.p"),
        lambda: loop.set("plant.disturbanceMoment.x", 0.0),
        loop.reset,
    ):
        with pytest.raises(ValueError, match="the loop is closed"):
            use()
