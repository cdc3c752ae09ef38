"""The control allocator as an FMU: its optimum against scipy, its limits, its jets."""

import numpy as np
from scipy.optimize import minimize

from fmi import MOMENT, Instance

SURFACE = [f"surface[{i}]" for i in range(1, 9)]
JET = [f"jet[{i}]" for i in range(1, 11)]
DUTY = [f"jetDuty[{i}]" for i in range(1, 11)]
ACHIEVED = [f"achievedMoment.{axis}" for axis in "xyz"]
RESIDUAL = [f"residual.{axis}" for axis in "xyz"]
DEG = np.pi / 180

# Limits of Wu 2015, (63) and (65), in rad.
MIN = -np.array([25, 25, 25, 25, 10, 10, 0, 0]) * DEG
MAX = np.array([0, 0, 0, 0, 30, 30, 0, 0]) * DEG
RANGE = np.array([25, 25, 25, 25, 40, 40]) * DEG
RATE = 10 * DEG
PERIOD = 0.01
# Jet moments of Wu 2015, (64), in N m.
D_RCS = np.array(
    [
        [0, -2048, 11625, -6912, 0, 2054, -11623, 6912, 0, 0],
        [-498, 0, -9466, 10944, -498, 0, -9465, 11798, -498, -498],
        [19897, -15723, -9465, -11798, -19897, 15723, 9465, 11798, -19897, 19897],
    ]
)
# Representative surface effectiveness, N m/rad at 2859 Pa.
D_A = (
    np.array(
        [
            [2800, -2800, 2150, -2150, 1375, -1375],
            [-1750, -1750, -1800, -1800, -5100, -5100],
            [-650, 650, -700, 700, -1000, 1000],
        ]
    )
    / DEG
)
W_2, W_SURFACE = 0.1, 1e-3


def cost(moment, pressure, surfaces, jets):
    """Cost of (60) with the weight on the deflections, written anew."""
    left = moment - D_A * (pressure / 2859) @ surfaces - D_RCS @ jets
    return np.linalg.norm(left) + W_2 * jets.sum() + 0.5 * W_SURFACE * ((surfaces / RANGE) ** 2).sum()


def optimum(moment, pressure, before):
    """Returns the least cost by SLSQP, as a smooth problem: the norm's slack t with an inequality
    for the cone, or, if the moment can be given, the equality M_c = D delta, for which the norm
    vanishes."""
    low = np.maximum(MIN[:6], before - RATE * PERIOD)
    high = np.minimum(MAX[:6], before + RATE * PERIOD)
    scale = np.concatenate([(high - low), np.ones(10)])
    d = np.hstack([D_A * (pressure / 2859), D_RCS]) * scale / 1e4
    offset = np.concatenate([low, np.zeros(10)])
    rest = moment / 1e4 - d @ (offset / scale)

    def unscale(x):
        return offset + scale * x

    def effort(x):
        z = unscale(x)
        return W_2 * z[6:].sum() + 0.5 * W_SURFACE * ((z[:6] / RANGE) ** 2).sum()

    def effort_slope(x):
        z = unscale(x)
        return scale * np.concatenate([W_SURFACE * z[:6] / RANGE**2, np.full(10, W_2)])

    def norm(x):
        return 1e4 * np.linalg.norm(rest - d @ x) + effort(x)

    def norm_slope(x):
        left = rest - d @ x
        return -1e4 * d.T @ left / np.linalg.norm(left) + effort_slope(x)

    bounds = [(0, 1)] * 16
    options = dict(method="SLSQP", bounds=bounds, options=dict(maxiter=2000, ftol=1e-14))
    # The nearest point decides which of the two problems is solved.
    nearest = minimize(
        lambda x: ((rest - d @ x) ** 2).sum(), np.full(16, 0.5), jac=lambda x: -2 * d.T @ (rest - d @ x), **options
    )
    if nearest.fun < 1e-10:
        equal = dict(type="eq", fun=lambda x: rest - d @ x, jac=lambda x: -d)
        found = minimize(effort, nearest.x, jac=effort_slope, constraints=[equal], **options)
    else:
        found = minimize(norm, nearest.x, jac=norm_slope, **options)
    return found, unscale(found.x)


def commands(number: int):
    """Moments from within reach of the surfaces to beyond reach of all effectors, at various
    dynamic pressures."""
    random = np.random.default_rng(2015)
    for _ in range(number):
        size = 10 ** random.uniform(3.5, 5.7)
        yield size * random.uniform(-1, 1, 3), random.uniform(200, 4000)


def inputs(moment, pressure):
    return dict(zip(MOMENT, moment)) | {"dynamicPressure": pressure}


def test_oracle_allocations_are_optimal(fmu):
    compared, reachable = 0, 0
    for moment, pressure in commands(60):
        with Instance(fmu("ControlAllocator"), {"jets": "duty"}).start(inputs=inputs(moment, pressure)) as instance:
            # The comparison starts from deflections that were reached after some samples.
            for k in range(30):
                held = np.array(instance.get(SURFACE))[:6]
                instance.step(k * PERIOD, PERIOD)
            surfaces, jets = np.array(instance.get(SURFACE))[:6], np.array(instance.get(JET))
            assert instance.get(["solver.status"])[0] == instance.fmu.item("solver.status", "optimal")
        found, z = optimum(moment, pressure, held)
        ours, theirs = cost(moment, pressure, surfaces, jets), cost(moment, pressure, z[:6], z[6:])
        # A cost below that of scipy is no fault.
        assert ours <= theirs + 1e-6 * max(1, theirs)
        if found.success:
            compared += 1
            assert abs(ours - theirs) <= 1e-6 * max(1, theirs)
        reachable += ours < 1
    assert compared >= 50 and 10 <= reachable <= 50


def pulses(instance, step: float, seconds: float) -> np.ndarray:
    seen = []
    for k in range(round(seconds / step)):
        seen.append(instance.get(JET))
        instance.step(k * step, step)
    return np.array(seen)


def test_jets_switch_every_millisecond_whatever_the_step(fmu):
    """The jets are the same at common instants; their pulses between them show only in steps of 1
    ms."""
    given = inputs([2e3, -4e3, 1.2e4], 0.0)
    with Instance(fmu("ControlAllocator")).start(inputs=given) as fine:
        each = pulses(fine, 1e-3, 2.0)
    with Instance(fmu("ControlAllocator")).start(inputs=given) as coarse:
        tenth = pulses(coarse, 1e-2, 2.0)
    assert np.array_equal(each[::10], tenth)
    switched = np.abs(np.diff(each, axis=0)).sum(axis=1).nonzero()[0] + 1
    assert np.any(switched % 10 != 0)
