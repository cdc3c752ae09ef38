"""The closed loop of the vehicle and a controller, stepped by hand."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import TracebackType

import numpy as np
import numpy.typing as npt
import pandas as pd

from ._data import fmu_path, hint
from ._instance import Instance, InstanceError, Value
from ._table import Units, check_units, convert

Vector = npt.NDArray[np.float64]

ANGLES = ("alpha", "beta", "sigma")
ATTITUDE = [f"attitude.{axis}" for axis in ANGLES]
ATTITUDE_RATE = [f"attitudeRate.{axis}" for axis in ANGLES]
RATE = [f"rate.{axis}" for axis in "pqr"]
MOMENT = [f"moment.{axis}" for axis in "xyz"]
REFERENCES = [
    f"{kind}.{axis}"
    for kind in ("reference", "referenceRate", "referenceAcceleration")
    for axis in ANGLES
]


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


class ClosedLoop:
    """The vehicle and optionally a controller, advanced step by step by FMPy.

    Without a controller the loop is closed in Python: `step` takes the moment.

    >>> import numpy as np
    >>> with ClosedLoop(parameters={"plant.disturbance.kind": "none"}) as loop:
    ...     state = loop.state
    ...     for _ in range(250):
    ...         error = state.attitude - state.reference
    ...         state = loop.step(-1e5 * error[[2, 1, 0]])
    >>> state.time, state.attitude.shape
    (10.0, (3,))

    With a controller of the package, or an FMU with the same inputs and outputs, the loop is that
    of the orchestrator bit for bit, and has no delay: in each step the controller gets the state,
    is stepped, and gives its moment to the plant, which is then stepped. Nothing is read between
    setting and stepping, as FMI 2.0 requires.

    >>> with ClosedLoop(controller="LQR") as loop:
    ...     state = loop.step()
    >>> state.time
    0.04

    Args:
        plant: Name of an FMU of the package, or the path of one with the same variables.
        controller: The same for the controller. With None, `step` takes the moment.
        step: Length of a communication step, s.
        parameters: Parameters by component, such as {"plant.disturbance.seed": 7,
            "controller.constraints": "paper"}: numbers in SI units, enumerations by their items'
            names. Without a controller, "controller.reference.*" chooses the reference.

    Raises:
        ValueError: There is no such FMU, variable or item.
        InstanceError: An FMU refused a parameter.
    """

    def __init__(
        self,
        plant: str | os.PathLike[str] = "ReentryPlant",
        controller: str | os.PathLike[str] | None = None,
        step: float = 0.04,
        parameters: Mapping[str, Value] | None = None,
    ) -> None:
        if not (np.isfinite(step) and step > 0.0):
            raise ValueError(f"step = {step} s, but a positive time is needed")
        by_component = split(parameters or {}, has_controller=controller is not None)
        self._step = float(step)
        self._is_open = True
        self._failure: InstanceError | None = None
        self._has_controller = controller is not None
        self._parameters = by_component
        self._plant = Instance(fmu_path(plant), by_component["plant"])
        try:
            # Every controller computes the reference. If the law is in Python, one of them is
            # used for that alone: its inputs are not set, and its moment is not read.
            path = fmu_path(controller if controller is not None else "LQR")
            self._controller = Instance(path, by_component["controller"])
        except BaseException:
            self._plant.close()
            raise
        try:
            self._wire()
            self._initialize()
        except BaseException:
            self.close()
            raise

    def _wire(self) -> None:
        self._from_plant = self._plant.references(ATTITUDE + RATE)
        self._more_of_plant = self._plant.references(ATTITUDE_RATE)
        self._to_plant = self._plant.references(MOMENT)
        self._to_controller = self._controller.references(ATTITUDE + RATE)
        self._from_controller = self._controller.references(MOMENT)
        self._reference = self._controller.references(REFERENCES)

    def _initialize(self) -> None:
        self._tick = 0
        self._moment = [0.0, 0.0, 0.0]
        self._pending: list[tuple[Instance, str, Value]] = []
        self._controller.enter()
        self._plant.enter()
        if self._has_controller:
            state = self._plant.get_reals(self._from_plant)
            self._controller.set_reals(self._to_controller, state)
            self._moment = self._controller.get_reals(self._from_controller)
            self._plant.set_reals(self._to_plant, self._moment)
        self._controller.exit()
        self._plant.exit()
        self._measured, self._state = self._read()

    def _read(self) -> tuple[list[float], State]:
        """Returns the next inputs of the controller, and the state."""
        measured = self._plant.get_reals(self._from_plant)
        reference = self._controller.get_reals(self._reference)
        return measured, State(
            time=self._tick * self._step,
            attitude=np.array(measured[:3]),
            attitude_rate=np.array(self._plant.get_reals(self._more_of_plant)),
            rate=np.array(measured[3:]),
            reference=np.array(reference[:3]),
            reference_rate=np.array(reference[3:6]),
            reference_acceleration=np.array(reference[6:]),
            moment=np.array(self._moment),
        )

    @property
    def state(self) -> State:
        """The present state."""
        return self._state

    def step(self, moment: npt.ArrayLike | None = None) -> State:
        """Advances the loop by one communication step and returns the new state.

        Args:
            moment: Roll, pitch and yaw moment on the vehicle, shape (3,), N m, held over the step.
                With a controller it must be left out.

        Raises:
            ValueError: The moment is not three finite numbers, or the loop is closed.
            TypeError: A moment is missing, or is given although there is a controller.
            InstanceError: An FMU refused the moment or the step. `reset` makes the loop usable again.
        """
        self._check_open()
        if self._failure is not None:
            name, call = self._failure.fmu, self._failure.call
            raise InstanceError(name, call, "the loop ended when this FMU failed: reset the loop")
        if moment is None and not self._has_controller:
            raise TypeError("step needs a moment, because the loop has no controller")
        if moment is not None:
            if self._has_controller:
                raise TypeError(f"the moment comes from {self._controller.name}: leave it out")
            self._moment = vector(moment).tolist()
        try:
            self._advance()
        except InstanceError as failure:
            # The instances are at different times now.
            self._failure = failure
            raise
        return self._state

    def _advance(self) -> None:
        for instance, name, value in self._pending:
            instance.set({name: value}, "input")
        self._pending.clear()
        now = self._tick * self._step
        if self._has_controller:
            self._controller.set_reals(self._to_controller, self._measured)
        self._controller.step(now, self._step)
        if self._has_controller:
            self._moment = self._controller.get_reals(self._from_controller)
        self._plant.set_reals(self._to_plant, self._moment)
        self._plant.step(now, self._step)
        self._tick += 1
        self._measured, self._state = self._read()

    def run(
        self,
        stop: float,
        law: Callable[[State], npt.ArrayLike] | None = None,
        units: Units = "si",
    ) -> pd.DataFrame:
        """Advances the loop to a time and returns a table of it.

        >>> with ClosedLoop(controller="LQR") as loop:
        ...     table = loop.run(1.0)
        >>> table.shape, table.attrs["units"]["controller.moment.x"]
        ((26, 18), 'N.m')

        Args:
            stop: Time to advance to, s: a multiple of the step.
            law: Function from the state to the moment, shape (3,), N m. With a controller it must
                be left out.
            units: "deg" gives angles and angular rates in degrees for reading.

        Returns:
            One row for each communication point, the present one included, with the time (s) as
            index. The moment is that of the step which begins there; the last row repeats the one
            before, or has the moment of the law. Columns and `attrs` are those of `experiment`:
            "plant.attitude.alpha", ...
        """
        check_units(units)
        self._check_open()
        steps = round((stop - self._state.time) / self._step)
        if steps < 0:
            raise ValueError(f"stop = {stop} s is before the present time, {self._state.time} s")
        if abs((self._tick + steps) * self._step - stop) > 1e-9 * max(1.0, abs(stop)):
            raise ValueError(f"stop = {stop} s is no multiple of the step, {self._step} s")
        if law is None and not self._has_controller:
            raise TypeError("run needs a law, because the loop has no controller")
        if law is not None and self._has_controller:
            raise TypeError(f"the moment comes from {self._controller.name}: leave out the law")
        rows: list[list[float]] = []
        for k in range(steps + 1):
            if k > 0:
                self.step(None if law is None else rows[-1][-3:])
                rows[-1][-3:] = self._moment
            state = self._state
            moment = state.moment if law is None else vector(law(state))
            rows.append(
                [
                    state.time,
                    *state.attitude,
                    *state.rate,
                    *state.reference,
                    *state.reference_rate,
                    *state.reference_acceleration,
                    *moment,
                ]
            )
        columns = {f"plant.{name}": self._plant.variable(name) for name in ATTITUDE + RATE}
        columns |= {
            f"controller.{name}": self._controller.variable(name) for name in REFERENCES + MOMENT
        }
        table = pd.DataFrame(rows, columns=["time", *columns]).set_index("time")
        table.attrs["units"] = {name: variable.unit for name, variable in columns.items()}
        table.attrs["descriptions"] = {
            name: variable.description for name, variable in columns.items()
        }
        convert(table, units)
        return table

    def get(self, name: str) -> Value:
        """Returns any variable at the present time, in SI units; an enumeration as its item's name.

        >>> with ClosedLoop(controller="CRMPC") as loop:
        ...     loop.get("controller.guarantee.status")
        'inForce'

        Args:
            name: component.variable, such as "plant.flight.dynamicPressure".
        """
        self._check_open()
        component, variable = self._component(name)
        return component.get(variable)

    def set(self, name: str, value: Value) -> None:
        """Sets an input that the loop does not set itself, such as "plant.disturbanceMoment.x"
        (N m). It acts from the next step on, until it is set again."""
        self._check_open()
        component, variable = self._component(name)
        connected = MOMENT if component is self._plant else ATTITUDE + RATE
        if variable in connected:
            raise ValueError(f"{name} is set by the loop itself")
        component.values({variable: value}, "input")
        self._pending.append((component, variable, value))

    def _component(self, name: str) -> tuple[Instance, str]:
        components = {"plant": self._plant, "controller": self._controller}
        component, _, variable = name.partition(".")
        if component not in components:
            raise ValueError(
                f'{name}: there is no component "{component}"{hint(component, components)}'
            )
        return components[component], variable

    def reset(self, parameters: Mapping[str, Value] | None = None) -> State:
        """Starts again at t = 0 and returns the state there.

        Args:
            parameters: Parameters in place of the present ones, or None for the same
                again.
        """
        self._check_open()
        if parameters is not None:
            by_component = split(parameters, self._has_controller)
            self._plant.values(by_component["plant"], "parameter")
            self._controller.values(by_component["controller"], "parameter")
            self._parameters = by_component
        self._failure = None
        self._plant.reset(self._parameters["plant"])
        self._controller.reset(self._parameters["controller"])
        self._initialize()
        return self._state

    def close(self) -> None:
        """Frees the instances and removes their temporary folders. A second call does nothing."""
        self._is_open = False
        self._controller.close()
        self._plant.close()

    def _check_open(self) -> None:
        if not self._is_open:
            raise ValueError("the loop is closed: its instances are freed")

    def __enter__(self) -> ClosedLoop:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


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


def split(parameters: Mapping[str, Value], has_controller: bool) -> dict[str, dict[str, Value]]:
    """Sorts parameters by component."""
    by_component: dict[str, dict[str, Value]] = {"plant": {}, "controller": {}}
    for name, value in parameters.items():
        component, _, variable = name.partition(".")
        if component not in by_component:
            raise ValueError(
                f'{name}: there is no component "{component}"{hint(component, by_component)}'
            )
        if component == "controller" and not has_controller:
            if not variable.startswith("reference."):
                raise ValueError(f"{name}: the loop has no controller, only a reference")
        by_component[component][variable] = value
    return by_component
