"""The sliding-mode controllers as FMUs: the scenario of Wu 2015 run by the orchestrator, and their
laws at the first tick."""

import itertools

import numpy as np
import pytest

from conftest import ROOT, results
from fmi import ANGLES, MOMENT, RATES, Instance

TVSMC = ROOT / "orchestrator" / "experiments" / "tvsmc-2015"
DEG = np.pi / 180.0
INERTIA = np.array([[588791.0, 0.0, -24242.0], [0.0, 1303212.0, 0.0], [-24242.0, 0.0, 1534164.0]])
BODY = {"vehicle.file": "wu2015"}
START = dict(zip(ANGLES + RATES, [32 * DEG, 2 * DEG, 58 * DEG, 0.0, 0.0, 0.0]))


def kinematics(alpha, beta) -> np.ndarray:
    """The matrix R of Wu 2015, (4)."""
    sa, ca, sb, cb, tb = np.sin(alpha), np.cos(alpha), np.sin(beta), np.cos(beta), np.tan(beta)
    return np.array([[-ca * tb, np.ones_like(alpha), -sa * tb], [sa, np.zeros_like(alpha), -ca], [-ca * cb, -sb, -sa * cb]])


@pytest.mark.parametrize("name", ["FBL", "BTVSMC", "BTVSMC_DO", "SOTVSMC_DO"])
def test_oracle_first_moment(fmu, name):
    """In the vehicle at rest at t = 0, s is 0, B is 0 and the observer rests: v = b = lambda a =
    -lambda c e, or -kp e."""
    parameters = BODY | {"reference.profile": "tvsmc2015"}
    with Instance(fmu(name), parameters).start(inputs=START) as instance:
        moment = np.array(instance.get(MOMENT))
    error = np.array([2.0, 2.0, -2.0]) * DEG
    v = -(3.0 if name == "FBL" else 4.0) * error
    np.testing.assert_allclose(moment, INERTIA @ np.linalg.solve(kinematics(32 * DEG, 2 * DEG), v), rtol=1e-10)


def test_gains_against_condition_46_are_refused(fmu):
    with Instance(fmu("SOTVSMC_DO"), {"reaching.k2[2]": 0.5}) as instance:
        instance.enter()
        with pytest.raises(Exception):
            instance.exit()
        assert "(46)" in instance.messages() and "axis 2" in instance.messages()


def uncertainty(rates, angles, accelerations, moment) -> np.ndarray:
    """Δv: R times what the accelerations have beyond the law's model, which knows the nominal inertia and this moment."""
    momentum = rates @ INERTIA
    modelled = np.linalg.solve(INERTIA, (moment - np.cross(rates, momentum)).T).T
    return np.einsum("ijk,kj->ki", kinematics(angles[:, 0], angles[:, 1]), accelerations - modelled)


@pytest.mark.tier("studies")
@pytest.mark.parametrize(
    ("law", "ours", "least", "most"),
    [
        ("BTVSMC_DO", False, 0.8, 0.95),
        ("SOTVSMC_DO", False, 0.03, 0.06),
        ("BTVSMC_DO", True, 0.02, 0.05),
        ("SOTVSMC_DO", True, 0.04, 0.07),
    ],
)
def test_the_observer_and_the_uncertainty_with_surfaces_and_jets(orchestrate, tmp_path, law, ours, least, most):
    """Fig. 7 in the paper's setup, in all corners of the biases: from 10 s on, the RMS of z1 - Δv over that of Δv, both
    averaged over 0.1 s because the jets pulse."""
    found = []
    for inertia, air, coefficients in itertools.product((0.95, 1.05), (0.9, 1.1), (0.9, 1.1)):
        experiment = tmp_path / "observed.toml"
        experiment.write_text(
            f"""extends = "{(TVSMC / "allocated.toml").as_posix()}"
title = "{law}"
[components.controller]
fmu = "{law}.fmu"
[components.controller.parameters]
"achievedMoment.used" = {str(ours).lower()}
"antiWindup" = {str(ours).lower()}
[components.plant.parameters]
"inertia.scale" = {inertia}
"density.scale" = {air}
"aerodynamics.scale" = {coefficients}
[record]
every = 1
variables = ["plant.*", "controller.moment.*", "controller.disturbanceEstimate.*", "allocator.achievedMoment.*"]
"""
        )
        finished, out = orchestrate(experiment)
        assert finished.returncode == 0, finished.stderr
        known = "allocator.achievedMoment" if ours else "controller.moment"
        names = [
            *(f"plant.rate.{axis}" for axis in "pqr"),
            *(f"plant.attitude.{angle}" for angle in ("alpha", "beta", "sigma")),
            *(f"plant.angularAcceleration.{axis}" for axis in "pqr"),
            *(f"{known}.{axis}" for axis in "xyz"),
            *(f"controller.disturbanceEstimate.{angle}" for angle in ("alpha", "beta", "sigma")),
        ]
        table = results(out)
        time, parts = table["time"].to_numpy(), np.split(table[names].to_numpy(), 5, axis=1)
        actual = uncertainty(*parts[:4])
        late = (time >= 10.0 - 1e-9) & (time < 20.0 - 1e-9)
        error, size = ((x[late].reshape(-1, 100, 3).mean(axis=1) ** 2).sum(axis=1).mean() for x in (parts[4] - actual, actual))
        found.append(np.sqrt(error / size))
    assert len(found) == 8 and least < min(found) and max(found) < most, found
