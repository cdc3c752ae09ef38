"""The controllers' results against other programs: IPOPT and CasADi's sqpmethod for CRMPC, the Riccati
solver of scipy for LQR."""

import casadi as ca
import numpy as np
import pytest
from scipy.linalg import solve_continuous_are

import nlp
import solvers
from conftest import example
from fmi import ANGLES, MOMENT, RATES, Instance


@pytest.fixture(scope="module")
def optimum():
    return nlp.first_optimum()


def test_published_constants_follow_from_the_raw_data(optimum):
    # The digits are those printed in Chai 2022, section 5.1, and in docs/errata.md.
    sets = optimum.sets
    np.testing.assert_allclose(sets.weight, [[80.0, 30.0], [30.0, 36.0]], rtol=1e-12)
    assert sets.x_tube == pytest.approx(0.0896, abs=5e-5)
    assert sets.u_tube == pytest.approx(0.1717, abs=5e-5)
    assert sets.epsilon == pytest.approx(0.0770, abs=5e-5)


def test_oracle_first_optimisation_is_the_nonlinear_optimum(fmu, optimum):
    # Both sets are active, so the cost depends on them.
    assert np.linalg.norm(optimum.rates, axis=1).max() == pytest.approx(optimum.sets.x_tube, rel=1e-6)
    assert np.linalg.norm(optimum.inputs, axis=1).max() == pytest.approx(optimum.sets.u_tube, rel=1e-6)

    measured = dict(zip(ANGLES + RATES, [*nlp.INITIAL_ANGLES, 0.0, 0.0, 0.0]))
    with Instance(fmu("CRMPC"), {"constraints": "paper"}).start(inputs=measured) as crmpc:
        status, cost = crmpc.get(["solver.status", "solver.cost"])
        assert status == crmpc.fmu.item("solver.status", "constrained")
        assert cost == pytest.approx(optimum.cost, rel=1e-5)
        moment = np.array(crmpc.get(MOMENT))
    assert np.linalg.norm(moment - optimum.moment) <= 1e-5 * np.linalg.norm(optimum.moment)


@pytest.fixture(scope="module")
def samples():
    return solvers.taken(example("samples"), 1)


@pytest.mark.parametrize("kind", ["robust", "paper"])
def test_oracle_optimisations_of_a_flight_are_those_that_two_other_solvers_find(samples, kind):
    of_kind = [sample for sample in samples if sample.kind == kind]
    assert len(of_kind) == 250
    for sample in of_kind:
        assert all(np.isfinite(bounds.stages).all() for bounds in (sample.bounds, sample.point_bounds))
        assert (sample.bounds.terminal is None) == (kind == "robust")
    for name, solver in solvers.nonlinear(of_kind[0]).items():
        # At the start, on the way, with the jump of the reference in the horizon, and after it.
        for sample in (of_kind[index] for index in (0, 5, 10, 60, 160)):
            cost = solver.solve(sample)[2]
            assert cost == pytest.approx(sample.cost_of("riccati"), rel=solvers.SAME_COST), f"{name}, {sample.time} s"


def test_oracle_lqr_is_the_riccati_feedback_with_the_drift_cancelled(fmu):
    # Each axis is a double integrator.
    a, b = np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1.0]])
    riccati = solve_continuous_are(a, b, nlp.P * np.eye(2), [[nlp.Q]])
    gain = -(b.T @ riccati / nlp.Q).reshape(2)

    angles, rates = np.array([0.2, -0.1, -0.4]), np.array([0.03, -0.05, 0.04])
    r = np.array(ca.DM(nlp.kinematics(ca.DM(angles))))
    angle_rates = r @ rates
    theta_r, rate_r, acceleration_r = nlp.reference(0.0)
    drift = np.array(nlp.drift_function()(angles, angle_rates)).reshape(3)
    u = acceleration_r + gain[0] * (angles - theta_r) + gain[1] * (angle_rates - rate_r) - drift
    expected = nlp.INERTIA @ np.linalg.solve(r, u)
    with Instance(fmu("LQR")).start(inputs=dict(zip(ANGLES + RATES, [*angles, *rates]))) as lqr:
        np.testing.assert_allclose(lqr.get(MOMENT), expected, rtol=1e-10)
