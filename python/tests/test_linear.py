"""Linear models of loops, and their margins."""

import control
import numpy as np
import pytest
from reentry_fmus import OrchestratorError, linearise, margins
from reentry_fmus._data import experiment_path

OPEN = "plant.moment.*"
QUIET = {"plant.disturbance.kind": "none"}


def test_an_open_loop_becomes_a_model_of_python_control():
    loop = linearise("lqr", at=10.0, open=OPEN, set=QUIET)
    assert loop.signals == ["plant.moment.x", "plant.moment.y", "plant.moment.z"] and loop.units == ["N.m"] * 3
    assert (loop.period, loop.samples, loop.sides) == (0.04, 1, None) and loop.time == 10.0
    system = loop.statespace()
    assert isinstance(system, control.StateSpace) and system.dt == loop.period
    assert system.input_labels[0] == "plant_moment_x" and np.array_equal(system.A, loop.a)
    # Closed, the loop is stable: the feedback is positive.
    closed = loop.a + loop.b @ np.linalg.solve(np.eye(3) - loop.d, loop.c)
    assert np.abs(np.linalg.eigvals(closed)).max() < 1.0


def test_margins_are_a_table():
    table = margins("lqr", at=10.0, open=OPEN, set=QUIET)
    assert list(table.index) == ["plant.moment.x", "plant.moment.y", "plant.moment.z", "all together"]
    assert table.attrs["stable"] and table.attrs["period"] == 0.04
    assert (table["disk"] <= table["disk"].max()).all() and table.loc["all together", "disk"] == table["disk"].min()
    shorter = margins("lqr", at=10.0, open=OPEN, set={**QUIET, "plant.actuation.delay": 0.04})
    lost = table["delay"] - shorter["delay"]
    assert lost.to_numpy() == pytest.approx(0.04, abs=2e-3)


def test_bounds_that_the_guarantee_accepts_are_a_table(tmp_path):
    # The shipped experiment asks for more of them, which takes half a minute.
    few = 'largest = ["controller.disturbance.bound"]\nsmallest = ["controller.limit.moment"]\n'
    (tmp_path / "few.toml").write_text(f"extends = ['{experiment_path('crmpc-robust')}']\n[observe.guarantee.accepted]\n{few}")
    table = margins(tmp_path / "few.toml", set={"controller.inertia.error": 0.0}, guarantee=True)
    assert table.columns.tolist() == ["unit", "set", "as_set", "by_rule"]
    bound = table.loc["largest controller.disturbance.bound"]
    # docs/guarantee.md has these without the error of the inertia.
    assert (bound["set"], bound["unit"]) == (pytest.approx(2.0), "deg/s2")
    assert [bound["as_set"], bound["by_rule"]] == pytest.approx([2.5526, 2.8862], abs=1e-3)
    assert table.loc["smallest controller.limit.moment", "set"] == 135600.0
    assert (table.loc["controller.guarantee.turnTime", ["as_set", "by_rule"]] > 20.0).all()


def test_a_loop_that_is_unstable_has_no_rows():
    table = margins("lqr", at=1.0, open=OPEN, set={**QUIET, "plant.actuation.delay": 0.45})
    assert not table.attrs["stable"] and table.empty and table.attrs["spectral_radius"] > 1.0


def test_a_period_of_several_samples_has_a_name_for_each():
    loop = linearise("crmpc-robust", at=10.0, open=OPEN, set=QUIET)
    assert (loop.period, loop.samples) == (pytest.approx(0.2), 5)
    assert loop.statespace().input_labels[3] == "plant_moment_x[1]"


def test_what_is_refused_says_why():
    with pytest.raises(OrchestratorError, match="must be a communication point") as caught:
        linearise("lqr", at=0.01, open=OPEN)
    assert caught.value.exit_code == 2
