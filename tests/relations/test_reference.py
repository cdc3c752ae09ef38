"""A reference's rates and accelerations are the derivatives of its angles, in every experiment and in
flight; and a controller says so where they are not."""

import numpy as np
import pytest

from loops import ATTITUDE, REFERENCE, content, experiments, fly

WARNING = "have not been the derivatives"


def steered() -> list[str]:
    """The experiments with a reference."""
    return [name for name in experiments() if "controller" in content(experiments()[name])["components"]]


def drift(time: np.ndarray, values: np.ndarray, rates: np.ndarray, held: bool = False) -> float:
    """How far the values move away from the integral of their rates, which may be held in between, apart from jumps."""
    mean = rates[:, :-1] if held else (rates[:, 1:] + rates[:, :-1]) / 2.0
    left = np.diff(values) - np.diff(time) * mean
    jumps = np.abs(left) > np.radians(0.25)
    assert jumps.any(axis=0).sum() <= 1, "Chai's profile jumps once, at 25 s"
    return np.abs(np.cumsum(np.where(jumps, 0.0, left), axis=1)).max()


@pytest.mark.parametrize("name", steered())
def test_the_rates_of_a_reference_are_the_derivatives_of_its_angles(tmp_path, name):
    path = experiments()[name]
    stop = min(content(path)["simulation"]["stop"], 120.0)
    flight = fly(path, tmp_path / "flight", "--stop", str(stop), record=(*REFERENCE, *ATTITUDE))
    # One experiment shows that a law as it is printed loses the attitude.
    assert flight.finished.returncode in (0, 3), flight.finished.stderr
    assert WARNING not in flight.finished.stdout + flight.finished.stderr
    # Between two ticks the loop holds what the guidance has given, whose acceleration is then constant.
    guidance = content(path)["components"].get("guidance")
    ticks = slice(None, None, (guidance or {}).get("every", 1))
    time, values = flight.columns["time"][ticks], flight[REFERENCE][:, ticks]
    assert drift(time, values[:3], values[3:6]) < np.radians(0.02)
    assert drift(time, values[3:6], values[6:], guidance is not None) < np.radians(0.1)


CASES = {
    "a rate beside constant angles": ("controller.reference.externalRate.alpha", "1.25 deg/s", True),
    "nothing but constant angles": ("controller.reference.external.alpha", "36 deg", False),
}


@pytest.mark.parametrize("case", CASES)
def test_a_controller_warns_of_rates_that_are_no_derivatives(tmp_path, case):
    name, value, warned = CASES[case]
    flight = fly(
        experiments()["reversal/step"], tmp_path / "flight", "--fmu", "controller=LQR", "--stop", "3",
        record=(*REFERENCE, *ATTITUDE), parameters={"controller.reference.profile": "external", name: value},
    )
    assert flight.finished.returncode == 0, flight.finished.stderr
    assert (WARNING in flight.finished.stdout + flight.finished.stderr) == warned, flight.finished.stderr


def test_an_external_reference_of_angles_alone_is_reached(tmp_path):
    flight = fly(
        experiments()["reversal/step"], tmp_path / "flight", "--fmu", "controller=LQR", "--stop", "20",
        record=ATTITUDE,
        parameters={"controller.reference.profile": "external", "controller.reference.external.alpha": "10 deg",
                    "controller.reference.external.beta": "0 deg", "controller.reference.external.sigma": "-25 deg"},
    )
    assert np.degrees(flight[ATTITUDE][:, -1]) == pytest.approx([10.0, 0.0, -25.0], abs=1e-3)
