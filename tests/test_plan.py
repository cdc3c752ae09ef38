"""The plans that CRMPC shows, as a run records them: the tube of the plan in force contains what was flown, with and without a
delay, and showing them changes nothing else."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from conftest import call, results

STEP = 0.04
LIMITS = {"rate": np.radians(5.0), "moment": 1.356e5}


def flown(folder: Path, experiment: str, settings: dict) -> pd.DataFrame:
    given = [part for name, value in settings.items() for part in ("--set", f"{name}={value}")]
    call("run", experiment, "--quiet", "--force", "--out", folder, *given)
    return results(folder)


def norm(table: pd.DataFrame, name: str, axes: str) -> np.ndarray:
    return np.sqrt(sum(table[f"{name}.{axis}"] ** 2 for axis in axes)).to_numpy()


@pytest.mark.parametrize("delay", [0.0, 0.04, 0.1])
@pytest.mark.parametrize("kind", ["white", "alongRate"])
def test_oracle_the_tube_of_the_plan_in_force_contains_the_flight(tmp_path, delay, kind):
    table = flown(
        tmp_path,
        "crmpc-plan",
        {
            "plant.actuation.delay": delay,
            "controller.delay": delay,
            "plant.disturbance.kind": kind,
            "plant.disturbance.bound": "1 deg/s2",
            "controller.disturbance.bound": "1 deg/s2",
            "plant.disturbance.seed": 11,
        },
    )
    # It is pending until a moment of the first plan acts.
    assert table["controller.guarantee.inForce"][5:].all()
    time, rate, moment = table["time"].to_numpy(), norm(table, "plant.rate", "pqr"), norm(table, "plant.appliedMoment", "xyz")
    plans = table.loc[table["controller.plan.began"].drop_duplicates().index]
    assert len(plans) >= 249
    # A plan begins when its moment acts, later than its optimisation by the delay.
    np.testing.assert_allclose(plans["controller.plan.began"], 0.2 * np.arange(len(plans)) + delay, atol=1e-9)
    closest = 0.0
    for (_, plan), (_, following) in zip(plans.iloc[:-2].iterrows(), plans.iloc[1:-1].iterrows(), strict=True):
        begin, end = plan["controller.plan.began"], following["controller.plan.began"]
        acting = (time > begin - 1e-9) & (time + STEP < end + 1e-9)
        tube = LIMITS["moment"] - plan["controller.plan.momentBound[1]"]
        away = np.abs(moment[acting] - plan["controller.plan.moment[1]"])
        assert (away <= tube + 1e-3).all(), (begin, away.max(), tube)
        tube = LIMITS["rate"] - plan["controller.plan.rateBound[2]"]
        reached = rate[np.argmin(np.abs(time - end))]
        away = abs(reached - plan["controller.plan.rate[2]"])
        assert away <= tube + 1e-9, (end, away, tube)
        closest = max(closest, away / tube)
    # The tube is no wider than needed by orders of magnitude.
    assert closest > 0.1, closest
