"""State of the closed loop, and laws that answer it with a moment."""

from __future__ import annotations

import signal
import traceback
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from traceback import FrameSummary

import numpy as np
import numpy.typing as npt

Vector = npt.NDArray[np.float64]
Law = Callable[["State"], npt.ArrayLike]
"""Function from the state to the moment: roll, pitch and yaw, shape (3,), N m."""


class Inputs(Mapping[str, float]):
    """Values by the names of variables."""

    def __init__(self, places: Mapping[str, int], values: Vector) -> None:
        self._places = places
        self._values = values

    def __getitem__(self, name: str) -> float:
        return float(self._values[self._places[name]])

    def __iter__(self) -> Iterator[str]:
        return iter(self._places)

    def __len__(self) -> int:
        return len(self._places)


@dataclass(frozen=True, eq=False)
class State:
    """State of the loop at one communication point, as the controller knows it: attitude and rate
    may be measured or estimated. All arrays have the shape (3,)."""

    time: float
    """Time, s."""

    attitude: Vector
    """Angle of attack, sideslip angle and bank angle, rad."""

    attitude_rate: Vector
    """Time derivative of the attitude, rad/s. In an experiment it is that of body rates and
    attitude, without the turn of the trajectory."""

    rate: Vector
    """Body rates p, q, r, rad/s."""

    reference: Vector
    """Reference of the attitude, rad."""

    reference_rate: Vector
    """First derivative of the reference, rad/s."""

    reference_acceleration: Vector
    """Second derivative of the reference, rad/s2."""

    moment: Vector
    """Roll, pitch and yaw moment of the last step, N m. Before the first step it is the
    controller's initial moment, or zero without a controller."""

    inputs: Mapping[str, float] = field(default_factory=dict)
    """In an experiment, all inputs of the controller by name, such as "knownMoment.x" (N m) or
    "trajectory.headingRate" (rad/s). One that is not connected has its start value."""


SENT = "<dynamic-code>"
"""Name that cloudpickle gives to the file of a function that it sends."""

Line = tuple[str, int, str]
"""File, line and function of a call."""


class LawError(RuntimeError, ValueError):
    """A law in Python failed. The text names the law, the case and the time, and the lines of the
    law. It is a ValueError, too, because a law also fails by giving something else than a moment."""

    def __init__(self, problem: str, lines: list[Line], case: int | None, time: float) -> None:
        super().__init__(problem, lines, case, time)
        self.problem = problem
        """The law with the time, and the error that it raised."""
        self.lines = lines
        """Calls within the law that led to the error."""
        self.case = case
        """Number of the case, if it is one of a campaign."""
        self.time = time
        """Simulated time, s."""

    def __str__(self) -> str:
        summary = [FrameSummary(file, line, function) for file, line, function in self.lines]
        return "\n".join([self.problem, *traceback.format_list(summary)]).rstrip()

    def in_file(self, file: str | None) -> LawError:
        """Returns the error with the file of a law that was sent without it."""
        lines = [
            (file if file and name == SENT else name, line, function)
            for name, line, function in self.lines
        ]
        return LawError(self.problem, lines, self.case, self.time)


def moment_of(law: Law, state: State, case: int | None = None) -> Vector:
    """Asks a law for its moment.

    Raises:
        LawError: The law ended in another way than by returning a moment.
    """
    try:
        return vector(law(state))
    except BaseException as error:
        if isinstance(error, KeyboardInterrupt) and is_interruptible():
            raise
        what = "".join(traceback.format_exception_only(error)).strip()
        problem = f"the law {name_of(law)} failed {instant(case, state.time)}: {what}"
        raise LawError(problem, lines_of(error), case, state.time) from error


def is_interruptible() -> bool:
    """Returns whether Ctrl-C raises KeyboardInterrupt in this process."""
    return signal.getsignal(signal.SIGINT) is signal.default_int_handler


def instant(case: int | None, time: float) -> str:
    """Says in which case and at which time something was."""
    return f"at t = {time:.10g} s" if case is None else f"in case {case} at t = {time:.10g} s"


def lines_of(error: BaseException) -> list[Line]:
    """Returns file, line and function of the calls within a law that led to an error."""
    here = str(Path(__file__).parent)
    calls = traceback.extract_tb(error.__traceback__)
    return [
        (call.filename, call.lineno or 0, call.name)
        for call in calls
        if not call.filename.startswith(here)
    ]


def vector(moment: npt.ArrayLike) -> Vector:
    """Checks a moment and returns it as an array of the shape (3,)."""
    try:
        given = np.asarray(moment)
        # NumPy would read texts and truth values, and leave out imaginary parts and masks.
        parts = moment if isinstance(moment, (list, tuple)) else [moment]
        is_other = given.dtype.kind in "SUcb" or any(
            isinstance(part, (bool, np.bool_)) or np.ma.is_masked(part) for part in parts
        )
        components = np.array(np.nan if is_other else given, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        components = np.array(np.nan)
    if components.shape != (3,) or not np.isfinite(components).all():
        raise ValueError(
            f"a moment is three finite numbers, x, y and z in N m, but this is {moment!r}"
        )
    return components


def name_of(law: Law) -> str:
    """Returns the name of a law: that of a function, or of an object's class."""
    return str(getattr(law, "__name__", type(law).__name__))
