"""State of the closed loop, and laws that answer it with a moment."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Vector = npt.NDArray[np.float64]
Law = Callable[["State"], npt.ArrayLike]
"""Function from the state to the moment: roll, pitch and yaw, shape (3,), N m."""


@dataclass(frozen=True, eq=False)
class State:
    """State of the loop at one communication point. All arrays have the shape (3,)."""

    time: float
    """Time, s."""

    attitude: Vector
    """Angle of attack, sideslip angle and bank angle, rad."""

    attitude_rate: Vector
    """Time derivative of the attitude, rad/s."""

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


def vector(moment: npt.ArrayLike) -> Vector:
    """Checks a moment and returns it as an array of the shape (3,)."""
    try:
        components = np.asarray(moment, dtype=np.float64)
    except (TypeError, ValueError):
        components = np.array(np.nan)
    if components.shape != (3,) or not np.isfinite(components).all():
        raise ValueError(
            f"a moment is three finite numbers, x, y and z in N m, but this is {moment!r}"
        )
    return components


def name_of(law: Law) -> str:
    """Returns the name of a law: that of a function, or of an object's class."""
    return str(getattr(law, "__name__", type(law).__name__))
