"""DLMPC as an FMU: its outer optimum against IPOPT, and its two rates against the communication
step."""


import casadi as ca
import numpy as np
import pytest

import nlp
from fmi import ANGLES, MOMENT, RATES, Instance

COMMAND = [f"rateCommand.{axis}" for axis in ("p", "q", "r")]
FEEDBACK = 0.04


def outer_optimum(start: np.ndarray, time: float) -> tuple[float, np.ndarray]:
    """Returns cost and first body rate command of the outer layer, from a nonlinear programme by
    multiple shooting."""
    n, h = nlp.HORIZON, nlp.STEP
    angles, v = ca.MX.sym("angles", 3, n + 1), ca.MX.sym("v", 3, n)
    matrix = ca.SX.sym("angles", 3)
    kinematics = ca.Function("R", [matrix], [nlp.kinematics(matrix)])
    cost, equal, below_one, guess = 0.0, [angles[:, 0] - start], [], []
    for k in range(n + 1):
        theta_r, rate_r, _ = nlp.reference(time + k * h)
        guess.append(theta_r)
        cost += nlp.P * ca.sumsqr(angles[:, k] - theta_r)
        if k < n:
            cost += nlp.Q * ca.sumsqr(v[:, k] - rate_r)
            equal.append(angles[:, k + 1] - angles[:, k] - h * v[:, k])
            rates = ca.solve(kinematics(angles[:, k]), v[:, k])
            below_one.append(ca.sumsqr(rates) / nlp.RATE_LIMIT**2)
    equalities, inequalities = ca.vertcat(*equal), ca.vertcat(*below_one)
    problem = {"x": ca.veccat(angles, v), "f": cost, "g": ca.vertcat(equalities, inequalities)}
    # IPOPT relaxes bounds slightly by default, which would show in the cost.
    options = {"tol": 1e-10, "bound_relax_factor": 0.0, "print_level": 0, "sb": "yes"}
    solver = ca.nlpsol("solver", "ipopt", problem, {"print_time": False, "ipopt": options})
    solution = solver(
        x0=np.concatenate([np.array(guess).reshape(-1), np.zeros(3 * n)]),
        lbg=np.concatenate([np.zeros(equalities.numel()), np.full(n, -np.inf)]),
        ubg=np.concatenate([np.zeros(equalities.numel()), np.ones(n)]),
    )
    assert solver.stats()["success"], solver.stats()["return_status"]
    values = np.array(solution["x"]).reshape(-1)
    command = values[3 * (n + 1) : 3 * (n + 2)]
    r = np.array(ca.DM(nlp.kinematics(ca.DM(start))))
    return float(solution["f"]), np.linalg.solve(r, command)


@pytest.mark.parametrize(
    "start, time, active",
    [
        (nlp.INITIAL_ANGLES, 0.0, True),
        # The horizon contains the reference's jump.
        (np.array([12.0, 1.0, -29.0]) * nlp.DEG, 14.0, False),
    ],
)
def test_oracle_first_optimisation_is_the_nonlinear_optimum(fmu, start, time, active):
    cost, command = outer_optimum(start, time)
    # If the first command is at its bound, the bound determines it.
    assert (np.linalg.norm(command) == pytest.approx(nlp.RATE_LIMIT, rel=1e-6)) == active
    dlmpc = Instance(fmu("DLMPC"))
    with dlmpc.start(start=time, inputs=dict(zip(ANGLES + RATES, [*start, 0.0, 0.0, 0.0]))):
        status, found = dlmpc.get(["solver.status", "solver.cost"])
        assert status == dlmpc.fmu.item("solver.status", "constrained")
        assert found == pytest.approx(cost, rel=1e-6)
        found = np.array(dlmpc.get(COMMAND))
    assert np.linalg.norm(found - command) <= 1e-5 * nlp.RATE_LIMIT


# Steps


def course(time: float) -> dict:
    """Measurements as functions of time, near enough to the reference that the law is not always
    saturated."""
    angles = np.array([10.0 + 2.0 * np.sin(0.5 * time), 3.0 * np.exp(-0.3 * time), -30.0 + 4.0 * np.cos(0.5 * time)])
    rates = np.array([0.3 * np.sin(2.1 * time), 0.8 * np.cos(0.7 * time), 0.4 * np.sin(1.3 * time + 1.0)])
    return dict(zip(ANGLES + RATES, [*(angles * nlp.DEG), *(rates * nlp.DEG)]))


def test_the_outer_layer_runs_at_every_fifth_tick(fmu):
    with Instance(fmu("DLMPC")).start(inputs=course(0.0)) as instance:
        seen = []
        for tick in range(25):
            instance.set(course(tick * FEEDBACK))
            seen.append((instance.get(["solver.solves"])[0], tuple(instance.get(COMMAND)), tuple(instance.get(MOMENT))))
            instance.step(tick * FEEDBACK, FEEDBACK)
    assert [solves for solves, _, _ in seen] == [1 + tick // 5 for tick in range(25)]
    commands = [command for _, command, _ in seen]
    assert all((commands[k] == commands[k - 1]) == (k % 5 != 0) for k in range(1, 25))
    assert len({moment for _, _, moment in seen}) == 25
