"""The first optimisation of CRMPC as a nonlinear problem, made from the raw data of Chai 2022,
section 5.1, alone.

Nothing here comes from the project's code: the constants are computed with numpy from the values
that the paper prints, the dynamics are written with CasADi, and IPOPT solves the problem by
multiple shooting. Angles are in rad, all other values in SI units.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

DEG = np.pi / 180.0
INERTIA = np.array([[588791.0, 0.0, -24242.0], [0.0, 1303212.0, 0.0], [-24242.0, 0.0, 1534163.0]])
INITIAL_ANGLES = np.array([7.5, 10.0, -30.0]) * DEG
HORIZON = 100
STEP = 0.2
P = 50.0
Q = 10.0
RATE_LIMIT = 5.0 * DEG
MOMENT_LIMIT = 1.356e5
DISTURBANCE = 2.0 * DEG


@dataclass(frozen=True)
class Sets:
    """Constants of the printed sets."""

    weight: np.ndarray
    x_tube: float
    u_tube: float
    epsilon: float


def printed_sets() -> Sets:
    """Computes the sets (6), (13), (15) and (21), as docs/errata.md reads them."""
    terminal = np.array([-5.0, -5.0])
    # (15) holds per axis with equality: A'G + GA + K~'Q K~ + P = 0 with A = [0 1; K~], as linear
    # equations in G.
    closed = np.vstack([[0.0, 1.0], terminal])
    load = P * np.eye(2) + Q * np.outer(terminal, terminal)
    lyapunov = np.kron(np.eye(2), closed.T) + np.kron(closed.T, np.eye(2))
    weight = np.linalg.solve(lyapunov, -load.reshape(-1)).reshape(2, 2)

    moments = np.linalg.eigvalsh(INERTIA)
    r0 = np.sqrt(1.0 + np.tan(10.0 * DEG))
    r1 = RATE_LIMIT
    gyroscopic = r0 * (moments[-1] / moments[0]) * np.sqrt(3.0) * RATE_LIMIT
    x = r0 * RATE_LIMIT
    u = r0 * MOMENT_LIMIT / moments[0]
    # c-bar of (21) belongs to K = [-10, -10]: it is the peak of the step response (e^{st} -
    # e^{ft})/(s - f).
    slow, fast = np.sort(np.roots([1.0, 10.0, 10.0]))[::-1]
    peak = np.log(slow / fast) / (fast - slow)
    c = (np.exp(slow * peak) - np.exp(fast * peak)) / (slow - fast)
    spread = np.sqrt(3.0) * DISTURBANCE * c
    x_tube = x - spread
    u_tube = u - 2.0 * gyroscopic * x + spread * (r1 + gyroscopic)
    scale = np.sqrt(np.linalg.eigvalsh(weight)[0])
    epsilon1 = scale * (x_tube - 2.5 * DEG)
    epsilon2 = scale * (u_tube - (gyroscopic - r1) * x_tube - 1.25 * DEG) / np.linalg.norm(terminal)
    return Sets(weight, x_tube, u_tube, min(epsilon1, epsilon2))


def reference(time: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Reference angles and their first two derivatives. The first segment still applies at 25 s."""
    if time <= 25.0 + 1e-9:
        s, c = np.sin(0.5 * time), np.cos(0.5 * time)
        angles = [10.0 + 2.5 * s, 0.0, -30.0 + 5.0 * c]
        rates = [1.25 * c, 0.0, -2.5 * s]
        accelerations = [-0.625 * s, 0.0, -1.25 * c]
    else:
        s, c = np.sin(0.25 * time), np.cos(0.25 * time)
        angles = [10.0 + 0.5 * c, 0.0, -30.0 + 0.5 * s]
        rates = [-0.125 * s, 0.0, 0.125 * c]
        accelerations = [-0.03125 * c, 0.0, -0.03125 * s]
    return tuple(np.array(value) * DEG for value in (angles, rates, accelerations))


def kinematics(angles):
    """Matrix R(Theta) of (2)."""
    sa, ca_, sb, cb = ca.sin(angles[0]), ca.cos(angles[0]), ca.sin(angles[1]), ca.cos(angles[1])
    return ca.vertcat(
        ca.horzcat(-ca_ * sb / cb, 1.0, -sa * sb / cb),
        ca.horzcat(sa, 0.0, -ca_),
        ca.horzcat(-ca_ * cb, -sb, -sa * cb),
    )


def drift_function() -> ca.Function:
    """Drift f(Theta, x_omega) = (dR/dt) omega - R I^-1 (omega x I omega), with dR/dt differentiated
    by CasADi."""
    angles, rates = ca.SX.sym("angles", 3), ca.SX.sym("rates", 3)
    r = kinematics(angles)
    omega = ca.solve(r, rates)
    r_dot = ca.reshape(ca.jtimes(ca.reshape(r, 9, 1), angles, rates), 3, 3)
    inertia = ca.DM(INERTIA)
    gyroscopic = ca.solve(inertia, ca.cross(omega, ca.mtimes(inertia, omega)))
    return ca.Function("f", [angles, rates], [ca.mtimes(r_dot, omega) - ca.mtimes(r, gyroscopic)])


@dataclass(frozen=True)
class Optimum:
    """Solution of the nonlinear problem."""

    cost: float
    moment: np.ndarray
    rates: np.ndarray
    inputs: np.ndarray
    sets: Sets


def first_optimum() -> Optimum:
    """Solves the problem at t = 0 from the paper's initial state, at rest."""
    sets = printed_sets()
    n, h = HORIZON, STEP
    f = drift_function()
    x = ca.MX.sym("x", 6, n + 1)
    a = ca.MX.sym("a", 3, n)
    cost = 0.0
    equal = [x[:, 0] - np.concatenate([INITIAL_ANGLES, np.zeros(3)])]
    below_one = []
    guess = []
    for k in range(n):
        theta_r, rate_r, acceleration_r = reference(k * h)
        guess.append(np.concatenate([theta_r, rate_r]))
        error = x[:, k] - guess[-1]
        v = a[:, k] - acceleration_r
        cost += h * (P * ca.sumsqr(error) + Q * ca.sumsqr(v))
        angles, rates = x[:3, k], x[3:, k]
        equal.append(x[:3, k + 1] - (angles + h * rates + 0.5 * h * h * a[:, k]))
        equal.append(x[3:, k + 1] - (rates + h * a[:, k]))
        below_one.append(ca.sumsqr(x[3:, k + 1]) / sets.x_tube**2)
        below_one.append(ca.sumsqr(a[:, k] - f(angles, rates)) / sets.u_tube**2)
    theta_r, rate_r, _ = reference(n * h)
    guess.append(np.concatenate([theta_r, rate_r]))
    error = x[:, n] - guess[-1]
    terminal = 0.0
    for i in range(3):
        axis_error = ca.vertcat(error[i], error[3 + i])
        terminal += ca.bilin(ca.DM(sets.weight), axis_error, axis_error)
    cost += terminal
    below_one.append(terminal / sets.epsilon**2)

    unknowns = ca.veccat(x, a)
    equalities, inequalities = ca.vertcat(*equal), ca.vertcat(*below_one)
    problem = {"x": unknowns, "f": cost, "g": ca.vertcat(equalities, inequalities)}
    # IPOPT relaxes bounds slightly by default, which would show in the cost.
    options = {"tol": 1e-10, "bound_relax_factor": 0.0, "print_level": 0, "sb": "yes"}
    solver = ca.nlpsol("solver", "ipopt", problem, {"print_time": False, "ipopt": options})
    start = np.concatenate([np.array(guess).reshape(-1), np.zeros(3 * n)])
    lower = np.concatenate([np.zeros(equalities.numel()), np.full(inequalities.numel(), -np.inf)])
    upper = np.concatenate([np.zeros(equalities.numel()), np.ones(inequalities.numel())])
    solution = solver(x0=start, lbg=lower, ubg=upper)
    assert solver.stats()["success"], solver.stats()["return_status"]

    values = np.array(solution["x"]).reshape(-1)
    states = values[: 6 * (n + 1)].reshape(n + 1, 6)
    accelerations = values[6 * (n + 1) :].reshape(n, 3)
    drifts = [np.array(f(state[:3], state[3:])).reshape(-1) for state in states[:-1]]
    inputs = accelerations - np.array(drifts)
    # The moment is m = I R^-1 u at the first state.
    r = np.array(ca.DM(kinematics(ca.DM(INITIAL_ANGLES))))
    moment = INERTIA @ np.linalg.solve(r, inputs[0])
    return Optimum(float(solution["f"]), moment, states[:, 3:], inputs, sets)
