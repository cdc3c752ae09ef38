"""A controller runs its own ticks, whatever the communication step is."""

import numpy as np
import pytest

from fmi import ANGLES, NOT_REPRODUCIBLE, RATES, REFERENCE, Instance

CONTROLLERS = ["CRMPC", "DLMPC", "LQR"]
# Time for which inputs are held, s.
HOLD = 0.2
HOLDS = 30
FEEDBACK = 0.04
# Division of the k-th hold into communication steps.
DIVISIONS = {
    "20 ms": lambda _: [0.02] * 10,
    "40 ms": lambda _: [0.04] * 5,
    "irregular": lambda k: [0.013, 0.007 + 0.001 * (k % 20), 0.1, 0.08 - 0.001 * (k % 20)],
    "10 ms, then the rest": lambda _: [0.01, 0.19],
}


def held(k: int) -> dict:
    return dict(zip(ANGLES + RATES, [0.13 + 2e-3 * k, 0.16 - 4e-3 * k, -0.5 + 1e-3 * k, 0.01, -0.02, 1e-3 * k]))


def sampled(instance: Instance) -> list:
    """Returns the exact outputs that change at ticks only, and the reference, which depends on
    time."""
    # In a longer step some ticks have old inputs: the guarantee's status says so, and they tell
    # nothing of the loop's delay.
    other = ("reference", "guarantee", "loopDelay")
    names = [n for n in instance.fmu.names("output") if not n.startswith(other) and n not in NOT_REPRODUCIBLE]
    return instance.get(names), instance.get(REFERENCE)


def run(fmu, division) -> list:
    rows = []
    with Instance(fmu).start(inputs=held(0)) as instance:
        for k in range(HOLDS):
            instance.set(held(k))
            rows.append(sampled(instance))
            begin = k * HOLD
            for step in division(k):
                instance.step(begin, step)
                begin += step
    return rows


@pytest.mark.parametrize("division", DIVISIONS)
@pytest.mark.parametrize("name", CONTROLLERS)
def test_any_communication_step_gives_the_same_outputs_at_common_ticks(fmu, name, division):
    # CRMPC judges measurements of the present, which repeat here although the rates are not 0, and
    # plans by its judgement. Those of a longer step are known to be old.
    is_judged = name == "CRMPC" and division in ("20 ms", "40 ms")
    expected = run(fmu(name), lambda _: [FEEDBACK / 4] * 20 if is_judged else [HOLD])
    found = run(fmu(name), DIVISIONS[division])
    assert len({tuple(row) for row, _ in expected}) == HOLDS
    for (row, reference), (other, other_reference) in zip(expected, found):
        assert row == other
        np.testing.assert_allclose(other_reference, reference, rtol=1e-12)
