"""ReentryPlant along a trajectory, Wu 2015 (1), against rotations that are multiplied and
differentiated here."""

import numpy as np
import pytest

from fmi import ANGLES, RATES, Instance

ANGLE_RATES = [f"attitudeRate.{axis}" for axis in ("alpha", "beta", "sigma")]
PLACE = ["trajectory.flightPathAngle", "trajectory.heading", "trajectory.latitude"]
CHANGE = ["trajectory.flightPathAngleRate", "trajectory.headingRate", "trajectory.latitudeRate"]
# Angular rate of the Earth, rad/s.
EARTH = 7.2921e-5


def about(axis: int, angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    matrix = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix[i, i] = matrix[j, j] = c
    matrix[i, j], matrix[j, i] = -s, s
    return matrix


def attitude(place, longitude, angles) -> np.ndarray:
    """Rotation from body axes to inertial axes. The bank angle falls when the vehicle rolls right,
    as R requires."""
    (gamma, psi, phi), (alpha, beta, sigma) = place, angles
    north_east_down = about(2, longitude) @ about(1, -phi) @ about(1, -np.pi / 2)
    return north_east_down @ about(2, psi) @ about(1, gamma) @ about(0, -sigma) @ about(2, -beta) @ about(1, alpha)


def body_rates(place, change, longitude_rate, angles, angle_rates) -> np.ndarray:
    h = 1e-5

    def at(t):
        return attitude(place + t * change, t * longitude_rate, angles + t * angle_rates)

    cross = at(0.0).T @ (at(h) - at(-h)) / (2 * h)
    return np.array([cross[2, 1], cross[0, 2], cross[1, 0]])


@pytest.mark.parametrize("kinematics", ["exact", "printed"])
@pytest.mark.parametrize("seed", range(6))
def test_oracle_attitude_rates_are_those_of_the_rotations(fmu, kinematics, seed):
    random = np.random.default_rng(seed)
    angles, rates = random.uniform(-1.2, 1.2, 3), random.uniform(-0.2, 0.2, 3)
    place, change = random.uniform(-1.2, 1.2, 3), random.uniform(-0.2, 0.2, 3)
    east = random.uniform(-0.2, 0.2)
    start = dict(zip([f"initial.{axis}" for axis in ("alpha", "beta", "sigma", "p", "q", "r")], [*angles, *rates]))
    parameters = {"kinematics": kinematics, "trajectory.earthRate": EARTH, **start}
    with Instance(fmu("ReentryPlant"), parameters).start() as plant:
        plant.set(dict(zip(PLACE + CHANGE, [*place, *change])) | {"trajectory.longitudeRate": east})
        found = np.array(plant.get(ANGLE_RATES))
    if kinematics == "printed":
        found[2] += found[0] * np.sin(angles[1])
    expected = body_rates(place, change, east + EARTH, angles, found)
    np.testing.assert_allclose(expected, rates, rtol=0, atol=1e-9)


def test_oracle_an_inertial_attitude_at_rest_turns_against_the_earth(fmu):
    """Without moment and rate the body keeps its attitude in space while the vehicle flies around
    the Earth."""
    place, change, east = np.array([-0.02, 0.9, 0.3]), np.array([-1e-3, 2e-3, 4e-4]), 9e-4
    parameters = {"kinematics": "exact", "trajectory.earthRate": EARTH, "disturbance.kind": "none"}
    with Instance(fmu("ReentryPlant"), parameters).start() as plant:
        first = attitude(place, 0.0, plant.get(ANGLES))
        for tick in range(500):
            # Input derivatives let the angles grow within a step.
            plant.set(dict(zip(PLACE, place + 0.1 * tick * change)) | dict(zip(CHANGE, change)))
            plant.set({"trajectory.longitudeRate": east})
            references = [plant.fmu.variables[name].valueReference for name in PLACE]
            plant.slave.setRealInputDerivatives(references, [1] * 3, list(change))
            plant.step(0.1 * tick, 0.1)
        assert plant.get(RATES) == [0.0] * 3
        last = attitude(place + 50 * change, 50 * (east + EARTH), plant.get(ANGLES))
    np.testing.assert_allclose(last, first, rtol=0, atol=1e-10)
