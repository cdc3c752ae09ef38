"""A reference that stays constant is reached, from wherever a loop is when it jumps."""

import numpy as np
import pytest

from loops import ATTITUDE, controllers, experiments, fly

AT, STOP = 5.0, 75.0
RATE, ACCELERATION = 4.29, 2.0
"""Rate that CRMPC's tube leaves, deg/s, and least acceleration by the moment, deg/s2."""


def steps(seed: int, count: int) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Attitudes before and after a jump of the reference, deg, and the rates at the start, deg/s."""
    random = np.random.default_rng(seed)

    def attitude() -> np.ndarray:
        return random.uniform([0.0, -5.0, -170.0], [45.0, 5.0, 170.0])

    return [(attitude(), attitude(), random.uniform(-0.5, 0.5, 3)) for _ in range(count)]


@pytest.mark.parametrize("controller", controllers())
def test_a_jump_of_an_external_reference_is_followed_to_its_end(tmp_path, controller):
    for k, (before, after, rates) in enumerate([(np.array([35.0, 0.0, -60.0]), np.array([35.0, 0.0, 60.0]), np.zeros(3)), *steps(1, 3)]):
        names = [f"external.{axis} [deg]" for axis in ("alpha", "beta", "sigma")]
        rows = [[0.0, *before], [AT, *before], [AT, *after], [STOP, *after]]
        table = tmp_path / f"jump{k}.csv"
        table.write_text("\n".join([",".join(["time", *names]), *(",".join(map(repr, map(float, row))) for row in rows)]) + "\n")
        start = dict(zip(("alpha", "beta", "sigma", "p", "q", "r"), [*before, *rates]))
        flight = fly(
            experiments()["reversal/shaped"], tmp_path / f"flight{k}", "--fmu", f"controller={controller}", "--stop", str(STOP),
            "--fmu", f"guidance={table}", record=ATTITUDE,
            parameters={f"plant.initial.{name}": f"{value} deg{'/s' if name in 'pqr' else ''}" for name, value in start.items()},
        )
        assert flight.finished.returncode == 0, flight.finished.stderr
        error = np.degrees(flight[ATTITUDE]) - after[:, None]
        error[2] -= 360.0 * np.round(error[2] / 360.0)
        far = np.linalg.norm(error, axis=0) > 2.0
        turn = np.linalg.norm([after[0] - before[0], after[1] - before[1], (after[2] - before[2] + 180.0) % 360.0 - 180.0])
        # A law that keeps the limits takes the time of a turn within them, the others what they take.
        allowed = AT + turn / RATE + RATE / ACCELERATION + 8.0 if controller == "CRMPC" else STOP - 5.0
        assert flight.columns["time"][far].max(initial=0.0) <= allowed, (before, after, rates)
