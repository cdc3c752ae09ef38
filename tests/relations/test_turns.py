"""A bank angle and the same angle after whole turns are one attitude: for every loop."""

import numpy as np
import pytest

from loops import ATTITUDE, MOMENT, content, controllers, experiments, fly

TURN = 2.0 * np.pi
# Limit on the moment in the papers, N m.
LIMIT = 1.356e5


def same(first: np.ndarray, second: np.ndarray) -> None:
    """Angles and rates agree within 1e-6 rad and rad/s, and moments, in the last three rows, within
    2e-4 of their limit: what chatters, and roots near zero, amplify the rounding of 2 pi and of the
    clock."""
    assert np.abs(first[:-3] - second[:-3]).max() < 1e-6
    assert np.abs(first[-3:] - second[-3:]).max() < 2e-4 * LIMIT


def loops() -> list[str]:
    """The experiments whose vehicle begins at an attitude."""
    def begins(name: str) -> bool:
        components = content(experiments()[name])["components"]
        return "controller" in components and "initial.sigma" in components["plant"].get("parameters", {})

    return [name for name in experiments() if begins(name)]


def radians(value) -> float:
    number, *unit = str(value).split()
    return np.radians(float(number)) if unit == ["deg"] else float(number)


@pytest.mark.parametrize("controller", controllers())
def test_a_bank_of_two_degrees_over_the_end_is_one_of_two_degrees(tmp_path, controller):
    flight = fly(
        experiments()["reversal/step"], tmp_path / "over", "--fmu", f"controller={controller}", "--stop", "30",
        record=(*ATTITUDE, *MOMENT),
        parameters={"plant.initial.sigma": "179 deg", "controller.reference.angle.sigma": "-179 deg"},
    )
    assert flight.finished.returncode == 0, flight.finished.stderr
    sigma = np.degrees(flight.columns["plant.attitude.sigma"])
    assert sigma.min() > 178.0 and sigma.max() < 186.0, (sigma.min(), sigma.max())
    assert abs(sigma[-1] - 181.0) < 0.5, sigma[-1]
    assert flight.metrics["ems_deg"] < 2.0, flight.metrics["ems_deg"]


@pytest.mark.parametrize("name", loops())
def test_a_start_after_a_whole_turn_is_the_same_flight(tmp_path, name):
    parameters = content(experiments()[name])["components"]["plant"]["parameters"]
    sigma = radians(parameters["initial.sigma"])
    # The plant takes angles up to a whole turn.
    turns = 1 if sigma <= 0.0 else -1
    first, flight = (
        fly(experiments()[name], tmp_path / f"turn{k}", "--stop", "1", record=(*ATTITUDE, *MOMENT),
            parameters={"plant.initial.sigma": sigma + k * TURN})
        for k in (0, turns)
    )
    assert first.finished.returncode == 0 and flight.finished.returncode == 0, flight.finished.stderr
    moved = first[ATTITUDE] + np.array([[0.0], [0.0], [turns * TURN]])
    same(np.vstack([flight[ATTITUDE], flight[MOMENT]]), np.vstack([moved, first[MOMENT]]))
    assert abs(flight.metrics["ems_deg"] - first.metrics["ems_deg"]) < 1e-6
