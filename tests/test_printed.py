"""Equations of Chai 2022 and Wu 2015 as printed, against closed forms and differences: steps of
proofs and formulas that no FMU computes. Angles are in rad, all other values in SI units.
"""


import numpy as np
import pytest

from conftest import ROOT, tomllib
from nlp import DEG, DISTURBANCE, INERTIA, MOMENT_LIMIT, RATE_LIMIT, printed_sets


H = 1e-6
WU_INERTIA = {"x": 588791.0, "y": 1303212.0, "z": 1534164.0, "zx": 24242.0}


def r(alpha: float, beta: float) -> np.ndarray:
    """Chai 2022 (2), Wu 2015 (4)."""
    sa, ca, sb, cb = np.sin(alpha), np.cos(alpha), np.sin(beta), np.cos(beta)
    return np.array([[-ca * sb / cb, 1.0, -sa * sb / cb], [sa, 0.0, -ca], [-ca * cb, -sb, -sa * cb]])


def r_dot(alpha: float, beta: float, rates: np.ndarray) -> np.ndarray:
    """The change of R along Θ̇ = (α̇, β̇, …), by a central difference."""
    ahead, behind = (r(alpha + sign * H * rates[0], beta + sign * H * rates[1]) for sign in (1, -1))
    return (ahead - behind) / (2 * H)


def cross(rates: np.ndarray) -> np.ndarray:
    p, q, nu = rates
    return np.array([[0.0, -nu, q], [nu, 0.0, -p], [-q, p, 0.0]])


def attitudes(number: int, largest_beta: float = 1.2):
    random = np.random.default_rng(2022)
    for _ in range(number):
        yield random.uniform(-1.5, 1.5), random.uniform(-largest_beta, largest_beta), random


# Chai 2022, proof of Lemma 1


def test_published_inverse_of_r_is_right():
    for alpha, beta, _ in attitudes(100):
        sa, ca, sb, cb = np.sin(alpha), np.cos(alpha), np.sin(beta), np.cos(beta)
        printed = np.array([[-sb * ca * cb, sa, -cb * ca], [cb**2, 0.0, -sb], [-sa * cb * sb, -ca, -cb * sa]])
        np.testing.assert_allclose(printed @ r(alpha, beta), np.eye(3), atol=1e-13)


def test_published_eigenvalues_of_the_inverse_and_of_omega():
    for alpha, beta, random in attitudes(100):
        inverse = np.linalg.inv(r(alpha, beta))
        np.testing.assert_allclose(np.linalg.eigvalsh(inverse.T @ inverse), [np.cos(beta) ** 2, 1.0, 1.0], atol=1e-12)
        rates = random.uniform(-0.2, 0.2, 3)
        size = rates @ rates
        np.testing.assert_allclose(np.linalg.eigvalsh(cross(rates).T @ cross(rates)), [0.0, size, size], atol=1e-15)


def test_oracle_a1_is_not_diagonal_as_printed():
    change = r_dot(0.3, 0.1, np.array([0.05, -0.04, 0.0]))
    product = change @ change.T
    aside = np.abs(product - np.diag(np.diag(product))).max()
    assert aside > 0.8 * product[1, 1]
    # The printed a₂₂ = α̇² is right; a₃₃ lacks a square.
    assert product[1, 1] == pytest.approx(0.05**2, rel=1e-6)
    assert product[2, 2] == pytest.approx(0.05**2 * np.cos(0.1) ** 2 + 0.04**2, rel=1e-6)


def test_published_r1_is_exceeded_within_the_limits():
    # ‖Ṙ‖ for ‖ω‖ = 5 deg/s and |β| = 10 deg, against the printed r̄₁ = 5 deg/s.
    largest = 0.0
    for alpha, _, random in attitudes(2000):
        beta = 10.0 * DEG
        rates = random.normal(size=3)
        rates *= RATE_LIMIT / np.linalg.norm(rates)
        largest = max(largest, np.linalg.norm(r_dot(alpha, beta, r(alpha, beta) @ rates), 2))
    assert 0.0873 < 0.0945 < largest < 0.097


# Chai 2022, Lemmas 2 and 3


def paper_axis(k: float) -> np.ndarray:
    return np.array([[0.0, 1.0], [k, k]])


def test_published_eigenvalues_of_a_and_b_are_real_and_negative():
    for k in (-5.0, -10.0):
        root = np.sqrt(k * k + 4.0 * k)
        np.testing.assert_allclose(np.sort(np.linalg.eigvals(paper_axis(k))), [(k - root) / 2, (k + root) / 2], rtol=1e-12)
        assert (k + root) / 2 < 0.0


def test_oracle_inside_the_terminal_set_the_rate_keeps_16():
    sets = printed_sets()
    g = np.kron(sets.weight, np.eye(3))
    epsilon_1 = np.sqrt(np.linalg.eigvalsh(sets.weight)[0]) * (sets.x_tube - 2.5 * DEG)
    random, largest = np.random.default_rng(16), 0.0
    for _ in range(2000):
        e, reference = random.normal(size=6), random.normal(size=3)
        e *= epsilon_1 / np.sqrt(e @ g @ e)
        reference *= 2.5 * DEG / np.linalg.norm(reference)
        largest = max(largest, np.linalg.norm(e[3:] + reference))
    assert 0.7 * sets.x_tube < largest <= sets.x_tube


def test_published_inverse_of_b_is_not_an_inverse():
    for k in (-5.0, -10.0):
        b, printed = paper_axis(k), np.array([[0.0, 1.0], [1.0 / k, -k / k]])
        assert np.abs(printed @ b - np.eye(2)).max() > 0.5
        # With rows and columns exchanged it is.
        np.testing.assert_allclose(printed[::-1, ::-1] @ b, np.eye(2), atol=1e-14)


def test_oracle_f_and_g_of_24_and_25_are_the_responses_to_a_constant_disturbance():
    for k in (-5.0, -10.0):
        root = np.sqrt(k * k + 4.0 * k)
        fast, slow = (k - root) / 2, (k + root) / 2
        times = np.linspace(0.0, 12.0, 2401)
        f = ((np.exp(fast * times) - 1) * slow - (np.exp(slow * times) - 1) * fast) / (k * root)
        g = (np.exp(slow * times) - np.exp(fast * times)) / root
        # (22) with Δ = 1, stepped exactly by the exponential of B and its integral.
        values, vectors = np.linalg.eig(paper_axis(k))
        step = times[1]
        power = (vectors * np.exp(values * step)) @ np.linalg.inv(vectors)
        push = np.linalg.solve(paper_axis(k), (power - np.eye(2)) @ [0.0, 1.0])
        o = np.zeros(2)
        for i in range(len(times)):
            np.testing.assert_allclose(o, [f[i], g[i]], atol=1e-12)
            o = power @ o + push
        assert (np.diff(f) > 0.0).all() and f[-1] == pytest.approx(-1.0 / k, rel=1e-3)
        peak = np.log(slow / fast) / (fast - slow)
        assert times[g.argmax()] == pytest.approx(peak, abs=step)


def test_oracle_tightening_21_leaves_nothing_for_the_feedback():
    # B O_e ⊕ Û_tube lies in Û of (30) only if ū_tube leaves √3 Δ̄ (1 − k₂ c̄) more than (21) does.
    sets = printed_sets()
    moments = np.linalg.eigvalsh(INERTIA)
    r0 = np.sqrt(1 + np.tan(10 * DEG))
    gyroscopic = r0 * moments[-1] / moments[0] * np.sqrt(3) * RATE_LIMIT
    x, u = r0 * RATE_LIMIT, r0 * MOMENT_LIMIT / moments[0]
    inner = sets.u_tube + (RATE_LIMIT + gyroscopic) * sets.x_tube
    outer = u + (RATE_LIMIT - gyroscopic) * x
    assert inner == pytest.approx(outer, abs=1e-12)
    c = (x - sets.x_tube) / (np.sqrt(3) * DISTURBANCE)
    assert np.sqrt(3) * DISTURBANCE * (1 + 10.0 * c) == pytest.approx(0.111, abs=5e-4)


# Wu 2015


def wu_tensor() -> np.ndarray:
    i = WU_INERTIA
    return np.array([[i["x"], 0.0, -i["zx"]], [0.0, i["y"], 0.0], [-i["zx"], 0.0, i["z"]]])


def test_published_kinetics_2_10_and_11_are_eulers_equations():
    i, tensor = WU_INERTIA, wu_tensor()
    x, y, z, zx = i["x"], i["y"], i["z"], i["zx"]
    det = x * z - zx**2
    random = np.random.default_rng(2)
    for _ in range(50):
        p, q, nu = rates = random.uniform(-0.3, 0.3, 3)
        moment = random.uniform(-1e5, 1e5, 3)
        free = [
            (zx * (z + x - y) * p * q + (y * z - z**2 - zx**2) * q * nu) / det,
            ((z - x) * p * nu + zx * (nu**2 - p**2)) / y,
            ((-x * y + x**2 + zx**2) * p * q + zx * (-z - x + y) * q * nu) / det,
        ]
        g = np.array([[z / det, 0.0, zx / det], [0.0, 1 / y, 0.0], [zx / det, 0.0, x / det]])
        expected = np.linalg.solve(tensor, moment - np.cross(rates, tensor @ rates))
        np.testing.assert_allclose(free + g @ moment, expected, rtol=1e-10, atol=1e-12)


def test_oracle_uncertainty_8_is_what_another_inertia_and_a_moment_add():
    tensor = wu_tensor()
    change = 0.05 * tensor
    rates, moment, disturbance = np.array([0.02, -0.03, 0.05]), np.array([1e4, 2e4, -3e4]), np.array([5e3, -4e3, 3e3])
    true = tensor + change
    acceleration = np.linalg.solve(true, moment + disturbance - np.cross(rates, true @ rates))
    uncertainty = np.linalg.solve(tensor, -change @ acceleration - np.cross(rates, change @ rates) + disturbance)
    nominal = np.linalg.solve(tensor, moment - np.cross(rates, tensor @ rates))
    np.testing.assert_allclose(nominal + uncertainty, acceleration, rtol=1e-12)


# The data files, number by number as the papers print them


def data(path: str) -> dict:
    return tomllib.loads((ROOT / path).read_text(encoding="utf-8"))


def test_published_data_of_the_vehicles():
    chai, wu, jia = (data(f"vehicle/data/{name}.toml") for name in ("crmpc-2022", "tvsmc-2015", "two-loop-smc"))
    axes = ("Ixx", "Iyy", "Izz", "Ixz", "scale")
    assert [chai["inertia"][axis] for axis in axes] == [588791.0, 1303212.0, 1534163.0, 24242.0, 1.05]
    assert [wu["inertia"][axis] for axis in axes] == [588791.0, 1303212.0, 1534164.0, 24242.0, 1.05]
    assert [jia["inertia"][axis] for axis in axes] == [554486.0, 1136949.0, 1376852.0, 23002.0, 1.0]
    assert chai["initial"]["angles_deg"] == [7.5, 10.0, -30.0] and wu["initial"]["angles_deg"] == [32.0, 2.0, 58.0]
    assert chai["initial"]["rates_deg_s"] == wu["initial"]["rates_deg_s"] == [0.0, 0.0, 0.0]
    assert jia["disturbance"]["sine"]["wave"] == [{"frequency": 1.0, "amplitude": [1e5, 1e5, 1e5]}]


def test_published_settings_of_the_controllers():
    crmpc, dlmpc, wu = (data(f"control/data/{name}.toml") for name in ("crmpc-2022", "dlmpc-2022", "tvsmc-2015"))
    settings, double = crmpc["settings"], dlmpc["settings"]
    assert settings["weight"] == {"P": [50.0] * 6, "Q": [10.0] * 3}
    assert crmpc["feedback"]["paper"] == [settings["terminal"]] == [{"k1": -5.0, "k2": -5.0}]
    assert settings["horizon"] * settings["period"]["optimisation"] == pytest.approx(20.0)
    assert double["horizon"] * double["period"]["optimisation"] == pytest.approx(20.0)
    assert double["period"] == {"optimisation": 0.2, "feedback": 0.04}
    assert double["slidingMode"] == {"q": 5.0, "p": 5.0, "gamma": 0.15, "rho": 0.7}
    assert wu["sliding_modes"]["period"]["feedback"] == wu["feedback_linearisation"]["period"]["feedback"] == 0.01
