"""Limits of what surfaces and jets can do in the scenario of Jia, Zhou and Zhou, two-loop SMC, by
linear programmes from the effectors' data alone. scripts/yardsticks writes
orchestrator/experiments/two-loop-smc/computed.toml by it.

Moments are in N m and deflections in deg, at the reference dynamic pressure.
"""

import itertools
from pathlib import Path

import numpy as np
import scipy.sparse as sparse
from scipy.optimize import linprog

try:
    import tomllib
except ModuleNotFoundError:  # Python 3.10
    import tomli as tomllib

ROOT = Path(__file__).parents[2]
FILE = ROOT / "orchestrator" / "experiments" / "two-loop-smc" / "computed.toml"
HEADER = """\
# Moments that surfaces and jets can give. Written by scripts/yardsticks:
# change scripts/oracles/reach.py, not this file."""
with (ROOT / "vehicle" / "data" / "effectors.toml").open("rb") as _file:
    _DATA = tomllib.load(_file)
with (ROOT / "vehicle" / "data" / "two-loop-smc.toml").open("rb") as _file:
    _SCENARIO = tomllib.load(_file)

# The rudders are kept at zero, Wu 2015 (65).
_USED = np.array(_DATA["surfaces"]["allowed"])
SURFACES = np.array(_DATA["surfaces"]["effectiveness_deg"])[:, _USED]
LOW, HIGH, RATE = (np.array(_DATA["surfaces"][name])[_USED] for name in ("min_deg", "max_deg", "rate_deg_s"))
JETS = np.array(_DATA["jets"]["moment"])
ALL = np.hstack([SURFACES, JETS])
BOUNDS = [*zip(LOW, HIGH), *[(0.0, 1.0)] * JETS.shape[1]]
N_SURFACES, N_JETS = SURFACES.shape[1], JETS.shape[1]
DISTURBANCE = np.array(_SCENARIO["disturbance"]["sine"]["wave"][0]["amplitude"])


def reach(direction, matrix=ALL, bounds=BOUNDS) -> float:
    """Returns the largest multiple of `direction` (N m) that the effectors give exactly."""
    columns = matrix.shape[1]
    system = np.column_stack([matrix, -np.array(direction, float)])
    cost = np.append(np.zeros(columns), -1.0)
    optimum = linprog(cost, A_eq=system, b_eq=np.zeros(3), bounds=[*bounds, (0, None)])
    assert optimum.status == 0, optimum.message
    return optimum.x[-1]


def _rate_limits(samples: int, columns: int) -> tuple[sparse.csr_matrix, np.ndarray]:
    """Rows that keep the rate of each surface within its limit from sample to sample of a
    period."""
    step = 2 * np.pi / samples
    rows, entries = [], []
    for k, j in itertools.product(range(samples), range(N_SURFACES)):
        now, then = N_SURFACES * k + j, N_SURFACES * ((k + 1) % samples) + j
        for sign in (1.0, -1.0):
            entries += [(len(rows), then, sign), (len(rows), now, -sign)]
            rows.append(RATE[j] * step)
    i, j, value = zip(*entries)
    return sparse.csr_matrix((value, (i, j)), shape=(len(rows), columns)), np.array(rows)


def cancelled(samples: int = 64) -> float:
    """Returns the largest amplitude (N m) of sin t on all axes that effectors of limited range and
    rate cancel exactly in every period."""
    duties = N_SURFACES * samples
    columns = duties + N_JETS * samples + 1
    system = sparse.lil_matrix((3 * samples, columns))
    for k in range(samples):
        rows = slice(3 * k, 3 * k + 3)
        system[rows, N_SURFACES * k : N_SURFACES * (k + 1)] = SURFACES
        system[rows, duties + N_JETS * k : duties + N_JETS * (k + 1)] = JETS
        system[rows, columns - 1] = np.full((3, 1), np.sin(2 * np.pi * k / samples))
    limits, most = _rate_limits(samples, columns)
    bounds = [*zip(LOW, HIGH)] * samples + [(0, 1)] * (N_JETS * samples) + [(0, None)]
    cost = np.append(np.zeros(columns - 1), -1.0)
    optimum = linprog(cost, A_ub=limits, b_ub=most, A_eq=system.tocsr(), b_eq=np.zeros(3 * samples), bounds=bounds)
    assert optimum.status == 0, optimum.message
    return optimum.x[-1]


def least_error(amplitude, samples: int = 64) -> float:
    """Returns the smallest possible largest error (deg) of any angle, in a periodic motion about
    alpha = beta = 5 deg under `amplitude` sin t known beforehand. The model is linear, with R of
    Chai 2022 (2) at that point and no gyroscopic moment."""
    inertia = _SCENARIO["inertia"]
    body = np.diag([inertia["Ixx"], inertia["Iyy"], inertia["Izz"]])
    body[0, 2] = body[2, 0] = -inertia["Ixz"]
    a = b = np.radians(5.0)
    sa, ca, tb, sb, cb = np.sin(a), np.cos(a), np.tan(b), np.sin(b), np.cos(b)
    r = np.array([[-ca * tb, 1, -sa * tb], [sa, 0, -ca], [-ca * cb, -sb, -sa * cb]])
    by_moment = np.degrees(r @ np.linalg.inv(body))
    step = 2 * np.pi / samples
    duties = N_SURFACES * samples
    states = duties + N_JETS * samples  # of each sample three angles, deg, and their rates
    columns = states + 6 * samples + 1  # the last is the bound on all angles
    system, right = sparse.lil_matrix((6 * samples, columns)), np.zeros(6 * samples)
    bounded = sparse.lil_matrix((6 * samples, columns))
    for k in range(samples):
        then = (k + 1) % samples
        angles, rates = slice(6 * k, 6 * k + 3), slice(6 * k + 3, 6 * k + 6)
        # Angles and deflections are integrated by the trapezoidal rule; jets are held.
        for at, sign in ((k, -1.0), (then, 1.0)):
            start = states + 6 * at
            system[angles, start : start + 3] = sign * np.eye(3)
            system[angles, start + 3 : start + 6] = -step / 2 * np.eye(3)
            system[rates, start + 3 : start + 6] = sign * np.eye(3)
            system[rates, N_SURFACES * at : N_SURFACES * (at + 1)] = -step / 2 * by_moment @ SURFACES
        system[rates, duties + N_JETS * k : duties + N_JETS * (k + 1)] = -step * by_moment @ JETS
        right[rates] = step * by_moment @ (np.array(amplitude) * np.sin((k + 0.5) * step))
        for row, sign in ((angles, 1.0), (rates, -1.0)):
            bounded[row, states + 6 * k : states + 6 * k + 3] = sign * np.eye(3)
            bounded[row, columns - 1] = -np.ones((3, 1))
    limits, most = _rate_limits(samples, columns)
    bounds = [*zip(LOW, HIGH)] * samples + [(0, 1)] * (N_JETS * samples)
    bounds += [(None, None)] * (6 * samples) + [(0, None)]
    cost = np.append(np.zeros(columns - 1), 1.0)
    upper = sparse.vstack([limits, bounded.tocsr()])
    most = np.append(most, np.zeros(6 * samples))
    optimum = linprog(cost, A_ub=upper, b_ub=most, A_eq=system.tocsr(), b_eq=right, bounds=bounds)
    assert optimum.status == 0, optimum.message
    return optimum.x[-1]


def values() -> list[tuple[str, float, str, str]]:
    """Returns name, value, unit and meaning of all values."""
    one = np.eye(3)
    both = min(reach(np.ones(3)), reach(-np.ones(3)))
    about = "surfaces at 2859 Pa and jets, the other axes balanced"
    together = "moment of one size on all axes, of the worse sign"
    surfaces = (SURFACES, BOUNDS[:N_SURFACES])
    jets = (JETS, BOUNDS[N_SURFACES:])
    # The smaller value of both signs counts, except for pitch.
    return [
        ("reach.roll", min(reach(one[0]), reach(-one[0])), "N m", f"roll, {about}"),
        ("reach.pitch.up", reach(one[1]), "N m", f"pitch up, {about}"),
        ("reach.pitch.down", -reach(-one[1]), "N m", f"pitch down, {about}"),
        ("reach.yaw", min(reach(one[2]), reach(-one[2])), "N m", f"yaw, {about}"),
        ("reach.all", both, "N m", f"{together}, surfaces at 2859 Pa and jets"),
        ("reach.all.surfaces", min(reach(s * np.ones(3), *surfaces) for s in (1, -1)), "N m", f"{together}, surfaces alone"),
        ("reach.all.jets", min(reach(s * np.ones(3), *jets) for s in (1, -1)), "N m", f"{together}, jets alone"),
        ("cancelled", cancelled(), "N m", "largest sin t on all axes that surfaces of 10 deg/s and jets cancel"),
        ("error.least", least_error(DISTURBANCE), "deg", "least largest error under the disturbance of section V, known beforehand"),
    ]


def text() -> str:
    """Returns the text of the file."""
    lines = [HEADER]
    for name, value, unit, meaning in values():
        # HiGHS reaches its optimum to about 1e-9.
        lines += ["", "[[value]]", f'id = "{name}"', f"value = {value:.6g}", f'unit = "{unit}"']
        lines += ['kind = "computed"', f'source = "scripts/yardsticks: {meaning}"']
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    FILE.write_text(text(), encoding="utf-8")
