"""Values of parameters of a loop: an integer is one of 32 bits, as FMI has them, and a number is a
number. tests/test_integers.py has the same for the orchestrator."""

import math

import numpy as np
import pytest
from reentry_fmus import ClosedLoop, InstanceError


@pytest.mark.parametrize(
    "value",
    [2**31, -(2**31) - 1, 2**32 + 7, 2**53 + 1, 2**64, 10**400, 1e10, np.int64(2**40), np.uint64(2**63)]
    + [math.nan, math.inf, 1.5, True, np.True_, "7", b"7", None, [7]],
    ids=lambda value: repr(value)[:24],
)
@pytest.mark.parametrize("way", ["open", "reset"])
def test_integers_are_those_of_fmi(way, value):
    """A number beyond 32 bits is not cut to another one."""
    parameters = {"plant.disturbance.seed": value}
    with pytest.raises((ValueError, TypeError), match=r"disturbance\.seed needs an integer"):
        if way == "open":
            ClosedLoop(parameters=parameters)
        with ClosedLoop() as loop:
            loop.reset(parameters)


def test_integers_may_be_written_in_every_way():
    for value in (7, 7.0, np.int32(7), np.float64(7.0), np.array(7), 2**31 - 1):
        with ClosedLoop(parameters={"plant.disturbance.seed": value}) as loop:
            assert loop.get("plant.disturbance.seed") == value


@pytest.mark.parametrize("value", ["1", True, None, [1.0], 10**400, 1j], ids=lambda value: repr(value)[:24])
def test_numbers_are_numbers(value):
    with pytest.raises(TypeError, match="disturbance.bound needs a number in rad/s2"):
        ClosedLoop(parameters={"plant.disturbance.bound": value})


def test_what_cannot_be_made_leaves_nothing_behind(temporary):
    def opened():
        """Number of unpacked archives."""
        return len(list(temporary.iterdir()))

    with ClosedLoop(controller="CRMPC") as loop:
        loop.step()
    before = opened()
    for arguments in [
        {"controller": "CRPMC"},
        {"parameters": {"plant.disturbance.bound": -1.0}},
        {"controller": "CRMPC", "parameters": {"controller.disturbance.bound": 1.0}},
    ]:
        with pytest.raises((ValueError, InstanceError)):
            ClosedLoop(**arguments)
        assert opened() == before, arguments
    loop.close()
