"""Laws for the tests, written from the papers' equations."""

import numpy as np

INERTIA = np.array(
    [[588791.0, 0.0, -24242.0], [0.0, 1303212.0, 0.0], [-24242.0, 0.0, 1534163.0]]
)
K1 = -np.sqrt(50.0 / 10.0)
K2 = -np.sqrt((50.0 + 2.0 * np.sqrt(50.0 * 10.0)) / 10.0)


def pd(state):
    """Proportional and derivative feedback to each axis."""
    a = 0.25 * (state.reference - state.attitude) - 0.8 * state.attitude_rate
    return np.array([0.6e6 * -a[2], 1.3e6 * a[0], 1.5e6 * -a[1]])


def lqr(state):
    """The law of docs/laws.md with the defaults of the FMU: m = I R⁻¹ (v − Ṙ ω) + ω × I ω."""
    alpha, beta, _ = state.attitude
    sa, ca, sb, cb = np.sin(alpha), np.cos(alpha), np.sin(beta), np.cos(beta)
    tb = sb / cb
    # Chai 2022, (2).
    r = np.array([[-ca * tb, 1.0, -sa * tb], [sa, 0.0, -ca], [-ca * cb, -sb, -cb * sa]])
    by_alpha = np.array([[sa * tb, 0.0, -ca * tb], [ca, 0.0, sa], [sa * cb, 0.0, -cb * ca]])
    by_beta = np.array([[-ca / cb**2, 0.0, -sa / cb**2], [0.0, 0.0, 0.0], [ca * sb, -cb, sb * sa]])
    angle_rates = r @ state.rate
    r_dot = by_alpha * angle_rates[0] + by_beta * angle_rates[1]
    v = (
        state.reference_acceleration
        + K1 * (state.attitude - state.reference)
        + K2 * (angle_rates - state.reference_rate)
    )
    turned = np.cross(state.rate, INERTIA @ state.rate)
    return INERTIA @ np.linalg.solve(r, v - r_dot @ state.rate) + turned
