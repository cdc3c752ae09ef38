"""The best tracking that is possible at all in the scenario of Chai 2022, with the whole run known
beforehand and no disturbance.

A nonlinear problem (CasADi, IPOPT) over the exact double integrator of the angles: the input is
the acceleration a of the angles, held for a given time. The objective is EMS itself, summed at the
communication points t_k = 0.04 k before each step as in metrics.json (docs/symbols.md). The
constraints are imposed where an input begins to be held, and nowhere between. IPOPT finds a local
optimum; a convex relaxation bounds what any motion can reach from below. Nothing here comes from the project's code except the raw data in nlp.py. Angles are in
rad, all other values in SI units, EMS in deg.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

import nlp

SAMPLING = 0.04
DURATION = 50.0
COARSE, FINE = 0.2, 0.04
INITIAL_STATE = np.concatenate([nlp.INITIAL_ANGLES, np.zeros(3)])


@dataclass(frozen=True)
class Motion:
    """An optimal motion: `nodes` (n + 1 x 6) are its states every `hold` seconds, and
    `accelerations` (n x 3) hold between them."""

    ems: float
    hold: float
    nodes: np.ndarray
    accelerations: np.ndarray

    def states(self, hold: float) -> np.ndarray:
        """The states every `hold` seconds, which must divide the motion's own hold."""
        ratio = round(self.hold / hold)
        inside = [advance(self.nodes[:-1].T, self.accelerations.T, j * hold).T for j in range(ratio)]
        return np.vstack([np.stack(inside, axis=1).reshape(-1, 6), self.nodes[-1]])


def advance(state, a, h: float):
    """Moves the double integrator of each axis over h, with the axes side by side as columns. It
    works for numbers and for expressions."""
    angles, rates = state[:3, :], state[3:, :]
    moved = (angles + h * rates + 0.5 * h * h * a, rates + h * a)
    return ca.vertcat(*moved) if isinstance(state, ca.MX) else np.vstack(moved)


def outer_bounds() -> tuple[float, float]:
    """Bounds x-bar_omega and u-bar of (6)."""
    r0 = np.sqrt(1.0 + np.tan(10.0 * nlp.DEG))
    return r0 * nlp.RATE_LIMIT, r0 * nlp.MOMENT_LIMIT / np.linalg.eigvalsh(nlp.INERTIA)[0]


# Largest |beta| of the motions that the relaxation bounds: that behind the paper's r-bar0.
SIDESLIP = 10.0 * nlp.DEG


def drift_bound(rate_bound: float) -> float:
    """A bound on the norm of F = R-dot omega - R I^-1 (omega x I omega) for |x_omega| <= rate_bound
    and |beta| <= SIDESLIP.

    |omega| <= |x_omega|, as |R^-1| = 1. R-dot omega is R_alpha omega alpha-dot + R_beta omega
    beta-dot, and (alpha-dot, beta-dot) is no longer than x_omega.
    """
    tan, cos, sin = np.tan(SIDESLIP), np.cos(SIDESLIP), np.sin(SIDESLIP)
    by_alpha = max(1.0, np.hypot(tan, cos))
    by_beta = np.linalg.norm([[-1.0 / cos**2, 0.0], [sin, -cos]], 2)
    # The gyroscopic acceleration of a unit rate: its largest value over a fine grid of directions,
    # with 1 % for what lies between.
    theta, phi = np.meshgrid(np.linspace(0.0, np.pi, 721), np.linspace(0.0, np.pi, 721))
    unit = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)]).reshape(3, -1)
    turned = np.linalg.solve(nlp.INERTIA, np.cross(unit, nlp.INERTIA @ unit, axis=0))
    gyroscopic = 1.01 * np.linalg.norm(turned, axis=0).max()
    return rate_bound**2 * (np.hypot(by_alpha, by_beta) + gyroscopic / cos)


def relaxed_bounds(sets: str) -> tuple[float, float]:
    """Bounds on the norms of x_omega and of the acceleration a = u + F that every motion within the
    sets keeps while |beta| <= SIDESLIP. With them the problem is convex, so that its optimum is a
    lower bound on the EMS of all these motions."""
    constants = nlp.printed_sets()
    secant = 1.0 / np.cos(SIDESLIP)
    limits = secant * nlp.RATE_LIMIT, secant * nlp.MOMENT_LIMIT / np.linalg.eigvalsh(nlp.INERTIA)[0]
    rate, action = {"printed": outer_bounds(), "paper": (constants.x_tube, constants.u_tube), "limits": limits}[sets]
    return rate, action + drift_bound(rate)


def constrained(sets: str, relaxed: bool = False) -> ca.Function:
    """The function (state, a) -> squared norms of the rate and of the input, each over its squared
    bound.

    `printed` puts x_omega and u within (6). `paper` puts them within the tightened sets (21), where
    the `paper` set keeps the nominal motion. `limits` puts omega and m within the limits
    themselves. If `relaxed`, the rate x_omega and the acceleration are bounded instead, which makes
    the problem convex.
    """
    state, a = ca.SX.sym("state", 6), ca.SX.sym("a", 3)
    if relaxed:
        rate_bound, acceleration_bound = relaxed_bounds(sets)
        outputs = [ca.sumsqr(state[3:]) / rate_bound**2, ca.sumsqr(a) / acceleration_bound**2]
        return ca.Function("constrained", [state, a], [ca.vertcat(*outputs)])
    angles, rates = state[:3], state[3:]
    u = a - nlp.drift_function()(angles, rates)
    if sets == "limits":
        r = nlp.kinematics(angles)
        rate, rate_bound = ca.solve(r, rates), nlp.RATE_LIMIT
        action, action_bound = ca.mtimes(ca.DM(nlp.INERTIA), ca.solve(r, u)), nlp.MOMENT_LIMIT
    else:
        constants = nlp.printed_sets()
        bounds = {"printed": outer_bounds(), "paper": (constants.x_tube, constants.u_tube)}
        (rate_bound, action_bound), rate, action = bounds[sets], rates, u
    outputs = [ca.sumsqr(rate) / rate_bound**2, ca.sumsqr(action) / action_bound**2]
    return ca.Function("constrained", [state, a], [ca.vertcat(*outputs)])


def references(duration: float, sampling: float = SAMPLING) -> np.ndarray:
    """Reference angles at the communication points before each step, one per column."""
    return np.array([nlp.reference(k * sampling)[0] for k in range(round(duration / sampling))]).T


def optimum(
    sets: str,
    hold: float = COARSE,
    duration: float = DURATION,
    sampling: float = SAMPLING,
    guess: Motion | None = None,
    relaxed: bool = False,
) -> Motion:
    """The motion of least EMS, sampled every `sampling` seconds, from rest at the paper's initial
    state.

    `hold` and `duration` are whole multiples of `sampling`. `guess`, with a longer hold,
    warm-starts the solver. If `relaxed`, the result is a lower bound (see relaxed_bounds).
    """
    n, ratio = round(duration / hold), round(hold / sampling)
    x, a = ca.MX.sym("x", 6, n + 1), ca.MX.sym("a", 3, n)
    theta_r = references(duration, sampling)
    cost = 0.0
    for j in range(ratio):
        angles = advance(x[:, :-1], a, j * sampling)[:3, :]
        cost += ca.sumsqr((angles - ca.DM(theta_r[:, j::ratio])) / nlp.DEG) / theta_r.shape[1]
    inequalities = ca.vec(constrained(sets, relaxed).map(n)(x[:, :-1], a))
    equal = [x[:, 0] - ca.DM(INITIAL_STATE), ca.vec(x[:, 1:] - advance(x[:, :-1], a, hold))]
    equalities = ca.vertcat(*equal)

    if guess is None:
        rest = np.tile(INITIAL_STATE, (n + 1, 1))
        start = np.concatenate([rest.reshape(-1), np.zeros(3 * n)])
        warm = {}
    else:
        finer = np.repeat(guess.accelerations, round(guess.hold / hold), axis=0)
        start = np.concatenate([guess.states(hold).reshape(-1), finer.reshape(-1)])
        warm = {"mu_init": 1e-4}
    problem = {"x": ca.veccat(x, a), "f": cost, "g": ca.vertcat(equalities, inequalities)}
    options = {"tol": 1e-9, "bound_relax_factor": 0.0, "max_iter": 1000, "print_level": 0, "sb": "yes", **warm}
    solver = ca.nlpsol("solver", "ipopt", problem, {"print_time": False, "ipopt": options})
    lower = np.concatenate([np.zeros(equalities.numel()), np.full(inequalities.numel(), -np.inf)])
    upper = np.concatenate([np.zeros(equalities.numel()), np.ones(inequalities.numel())])
    solution = solver(x0=start, lbg=lower, ubg=upper)
    assert solver.stats()["success"], solver.stats()["return_status"]

    values = np.array(solution["x"]).reshape(-1)
    nodes = values[: 6 * (n + 1)].reshape(n + 1, 6)
    accelerations = values[6 * (n + 1) :].reshape(n, 3)
    return Motion(float(solution["f"]) ** 0.5, hold, nodes, accelerations)
