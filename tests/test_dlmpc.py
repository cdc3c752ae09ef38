"""DLMPC as an FMU: its outer optimum against IPOPT, and its two rates against the communication
step."""

import csv

import casadi as ca
import numpy as np
import pytest

import nlp
from conftest import EXPERIMENTS
from fmi import ANGLES, MOMENT, NOT_REPRODUCIBLE, RATES, Instance

COMMAND = [f"rateCommand.{axis}" for axis in ("p", "q", "r")]
SLIDING = [f"slidingVariable.{axis}" for axis in ("p", "q", "r")]
FEEDBACK = 0.04
OPTIMISATION = 0.2


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


def test_oracle_inner_law_at_the_first_tick(fmu):
    """The moment follows the equation of docs/DLMPC.md with z = 0, at rates near the command."""
    q, p, gamma, rho = 5.0, 5.0, 0.15, 0.7
    angles = nlp.reference(0.0)[0]
    with Instance(fmu("DLMPC")).start(inputs=dict(zip(ANGLES + RATES, [*angles, 0.0, 0.0, 0.0]))) as dlmpc:
        command = np.array(dlmpc.get(COMMAND))
        rates = command + np.array([2e-3, -1e-3, 5e-4])
        dlmpc.set(dict(zip(RATES, rates)))
        moment, sliding = np.array(dlmpc.get(MOMENT)), np.array(dlmpc.get(SLIDING))
    e = rates - command
    np.testing.assert_allclose(sliding, e, rtol=1e-12)
    power = np.abs(e) ** rho * np.sign(e)
    momentum = nlp.INERTIA @ rates
    expected = np.cross(rates, momentum) - nlp.INERTIA @ (gamma * power + q * e + p * power)
    assert np.linalg.norm(expected) < nlp.MOMENT_LIMIT
    np.testing.assert_allclose(moment, expected, rtol=1e-10)


# Steps

TICKS = 200
DIVISIONS = {
    "20 ms": [0.02] * 10,
    "40 ms": [0.04] * 5,
    "200 ms": [0.2],
    "irregular": [0.013, 0.027, 0.001, 0.1, 0.059],
    "irregular, across ticks": [0.07, 0.003, 0.127],
}
# These divisions stop at every tick, so that inputs can change there.
AT_TICKS = {
    "20 ms": [0.02] * 2,
    "40 ms": [0.04],
    "irregular": [0.013, 0.026, 0.001],
}


def course(time: float) -> dict:
    """Measurements as functions of time, near enough to the reference that the law is not always
    saturated."""
    angles = np.array([10.0 + 2.0 * np.sin(0.5 * time), 3.0 * np.exp(-0.3 * time), -30.0 + 4.0 * np.cos(0.5 * time)])
    rates = np.array([0.3 * np.sin(2.1 * time), 0.8 * np.cos(0.7 * time), 0.4 * np.sin(1.3 * time + 1.0)])
    return dict(zip(ANGLES + RATES, [*(angles * nlp.DEG), *(rates * nlp.DEG)]))


def driven(fmu, hold: float, division: list[float]) -> list[list[str]]:
    """Returns the exact outputs at the beginning of each hold, except the reference and those that
    a clock gives."""
    assert sum(division) == pytest.approx(hold)
    names = [n for n in fmu.names("output") if n not in NOT_REPRODUCIBLE and not n.startswith("reference")]
    rows = []
    with Instance(fmu).start(inputs=course(0.0)) as instance:
        for k in range(round(TICKS * FEEDBACK / hold)):
            begin = k * hold
            instance.set(course(begin))
            rows.append([float(value).hex() for value in instance.get(names)])
            for step in division:
                instance.step(begin, step)
                begin += step
    return rows


@pytest.mark.parametrize("division", [name for name in DIVISIONS if name != "200 ms"])
def test_steps_inputs_of_the_outer_layer(fmu, division):
    """With inputs held for 0.2 s, any division of that time gives the same outputs, bit for bit."""
    expected = driven(fmu("DLMPC"), OPTIMISATION, DIVISIONS["200 ms"])
    assert len({tuple(row) for row in expected}) == len(expected)
    assert driven(fmu("DLMPC"), OPTIMISATION, DIVISIONS[division]) == expected


@pytest.mark.parametrize("division", [name for name in AT_TICKS if name != "40 ms"])
def test_steps_inputs_of_the_inner_layer(fmu, division):
    """With inputs held for 0.04 s, any division of that time gives the same outputs, bit for
    bit."""
    expected = driven(fmu("DLMPC"), FEEDBACK, AT_TICKS["40 ms"])
    assert len({tuple(row) for row in expected}) == len(expected)
    assert driven(fmu("DLMPC"), FEEDBACK, AT_TICKS[division]) == expected


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


@pytest.mark.parametrize("name", ["dlmpc", "dlmpc-tuned"])
def test_the_experiments_run(orchestrate, name):
    finished, out = orchestrate(EXPERIMENTS / f"{name}.toml")
    assert finished.returncode == 0, finished.stderr
    with open(out / "results.csv") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    moments = np.array([[float(row[key]) for key in row if "plant.appliedMoment" in key] for row in rows])
    assert moments.shape == (1251, 3)
    assert np.linalg.norm(moments, axis=1).max() <= nlp.MOMENT_LIMIT
    fallbacks = next(key for key in rows[0] if "solver.fallbacks" in key)
    assert float(rows[-1][fallbacks]) == 0
