"""The closed loop of the vehicle and a controller, stepped by hand."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from types import TracebackType

import numpy as np
import numpy.typing as npt
import pandas as pd

from ._data import fmu_path
from ._instance import Instance, InstanceError, Value, parted, split
from ._judged import Flown, judged, observed
from ._recording import ATTITUDE, ATTITUDE_RATE, MOMENT, RATE, RECORDED, REFERENCES
from ._recording import Probes, Variable
from ._run import Run
from ._state import Law, State, moment_of, name_of, vector
from ._table import Units, check_units, convert


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
    is stepped, and gives its moment to the plant, which is then stepped.

    >>> with ClosedLoop(controller="LQR") as loop:
    ...     state = loop.step()
    >>> state.time
    0.04

    Args:
        plant: Name of an FMU of the package, or the path of one with the same variables.
        controller: The same for the controller. With None, `step` takes the moment.
        step: Length of a communication step, s; by default the shorter of those that the FMUs propose.
        parameters: Parameters by component, such as {"plant.disturbance.seed": 7,
            "controller.constraints": "paper"}: numbers in SI units, enumerations by their items'
            names. Without a controller, "controller.reference.*" chooses the reference, and
            "controller.limit.*" the limits on rate and moment that metrics and figure show.

    Raises:
        ValueError: There is no such FMU, variable or item.
        InstanceError: An FMU refused a parameter.
    """

    def __init__(
        self,
        plant: str | os.PathLike[str] = "ReentryPlant",
        controller: str | os.PathLike[str] | None = None,
        step: float | None = None,
        parameters: Mapping[str, Value] | None = None,
    ) -> None:
        if step is not None and not (np.isfinite(step) and step > 0.0):
            raise ValueError(f"step = {step} s, but a positive time is needed")
        by_component = split(parameters or {}, has_controller=controller is not None)
        # Every controller computes the reference. If the law is in Python, one of them is used for
        # that alone: its inputs are not set, and its moment is not read.
        paths = {"plant": fmu_path(plant), "controller": fmu_path(controller or "LQR")}
        self._open(paths, by_component, step, has_controller=controller is not None)
        try:
            self._initialize()
        except BaseException:
            self.close()
            raise

    def _open(
        self,
        paths: dict[str, Path],
        parameters: dict[str, dict[str, Value]],
        step: float | None,
        has_controller: bool,
    ) -> None:
        self._paths = paths
        self._is_open = True
        self._is_asking = False
        self._failure: InstanceError | None = None
        self._has_controller = has_controller
        self._parameters = parameters
        self._plant = Instance(paths["plant"], parameters["plant"])
        try:
            self._controller = Instance(paths["controller"], parameters["controller"])
        except BaseException:
            self._plant.close()
            raise
        try:
            self._step = float(step or min(self._plant.proposed_step, self._controller.proposed_step))
            self._wire()
        except BaseException:
            self.close()
            raise

    @classmethod
    def _with_law(cls, paths: dict[str, Path], step: float) -> ClosedLoop:
        """Opens a loop without a controller, with an FMU's reference. It begins when restarted."""
        loop = cls.__new__(cls)
        loop._open(paths, {"plant": {}, "controller": {}}, step, has_controller=False)
        return loop

    def _restart(self, settings: Mapping[str, Mapping[str, Value]]) -> None:
        """Starts again at t = 0 with these values of parameters and inputs, by component."""
        inputs: dict[str, Value] = {}
        self._parameters = {"plant": {}, "controller": {}}
        for component, values in settings.items():
            for name, value in values.items():
                if self._component(f"{component}.")[0].variable(name).causality == "input":
                    inputs[f"{component}.{name}"] = value
                else:
                    self._parameters[component][name] = value
        self.reset()
        for name, value in inputs.items():
            self.set(name, value)

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
        self._check_idle()
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

    def run(self, stop: float, law: Law | None = None, units: Units = "si") -> Run:
        """Advances the loop to a time, and returns table, metrics and figure as `experiment` does.

        >>> with ClosedLoop(controller="LQR") as loop:
        ...     run = loop.run(10.0)
        >>> run.table.shape, run.table.attrs["units"]["controller.moment.x"]
        ((251, 18), 'N.m')
        >>> round(run.metrics["max_rate_deg_s"], 1)
        6.4

        Args:
            stop: Time to advance to, s: a multiple of the step.
            law: Function from the state to the moment, shape (3,), N m. With a controller it must
                be left out.
            units: "deg" gives angles and angular rates in degrees for reading.

        Raises:
            LawError: The law failed, as its text says with the time.
            InstanceError: An FMU refused a step.

        Returns:
            A table with one row for each communication point, the present one included, with the
            time (s) as index. The moment is that of the step which begins there; the last row
            repeats the one before. Columns and `attrs` are those of `experiment`:
            "plant.attitude.alpha", ... Metrics and figure are those of the time that was run.
        """
        check_units(units)
        self._check_idle()
        if not np.isfinite(stop):
            raise ValueError(f"stop = {stop} s, but a finite time is needed")
        steps = round((stop - self._state.time) / self._step)
        if steps < 0:
            raise ValueError(f"stop = {stop} s is before the present time, {self._state.time} s")
        if abs((self._tick + steps) * self._step - stop) > 1e-9 * max(1.0, abs(stop)):
            raise ValueError(f"stop = {stop} s is no multiple of the step, {self._step} s")
        if law is None and not self._has_controller:
            raise TypeError("run needs a law, because the loop has no controller")
        if law is not None and self._has_controller:
            raise TypeError(f"the moment comes from {self._controller.name}: leave out the law")
        more = [variable for variable in observed(self._paths) if variable not in RECORDED]
        variables = RECORDED + more
        first = self._tick
        asked = None if law is None else partial(moment_of, law)
        rows, failure = self._fly(steps, asked, variables)
        if failure is not None:
            raise failure
        by_name = dict(zip((name for name, _ in variables), rows.T, strict=True))
        name = self._controller.name if law is None else name_of(law)
        title = f"{name}, closed loop"
        span = (first * self._step, float(stop), self._step)
        by_law = None if law is None else name
        flown = Flown(title, span, self._paths, self._parameters, by_name, by_law)
        return Run(title, self._table(rows, stop, units), partial(judged, flown))

    def _fly(
        self, steps: int, law: Law | None, variables: Sequence[Variable]
    ) -> tuple[npt.NDArray[np.float64], InstanceError | None]:
        """Advances the loop by steps. Returns the variables at each communication point, up to the
        one at which an FMU failed, if one did."""
        components = {"plant": self._plant, "controller": self._controller}
        probes = Probes(components, variables, has_law=not self._has_controller)
        rows = np.empty((steps + 1, len(variables)))
        probes.response(rows[0], self._moment)
        for k in range(steps + 1):
            if k > 0:
                rows[k] = rows[k - 1]
            probes.point(rows[k])
            if k == steps:
                break
            moment = None if law is None else self._asked(law)
            try:
                self.step(moment)
            except InstanceError as failure:
                probes.command(rows[k], self._moment)
                return rows[: k + 1], failure
            probes.response(rows[k], self._moment)
        return rows, None

    def _asked(self, law: Law) -> npt.ArrayLike:
        self._is_asking = True
        try:
            return law(self._state)
        finally:
            self._is_asking = False

    def _table(
        self, rows: npt.NDArray[np.float64], stop: float, units: Units
    ) -> pd.DataFrame:
        # As in the orchestrator, the last time is the stop time itself, without a rounding.
        first = self._tick + 1 - len(rows)
        times = [tick * self._step for tick in range(first, self._tick)] + [float(stop)]
        names = [name for name, _ in RECORDED]
        index = pd.Index(times, name="time")
        table = pd.DataFrame(rows[:, : len(names)].copy(), index=index, columns=names)
        about = {}
        for path in names:
            component, name = self._component(path)
            about[path] = component.variable(name)
        table.attrs["units"] = {name: variable.unit for name, variable in about.items()}
        table.attrs["descriptions"] = {name: v.description for name, v in about.items()}
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
        component, variable = parted(name, components)
        return components[component], variable

    def reset(self, parameters: Mapping[str, Value] | None = None) -> State:
        """Starts again at t = 0 and returns the state there.

        Args:
            parameters: Parameters in place of the present ones, or None for the same
                again.
        """
        self._check_idle()
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
        """Frees the instances. A second call does nothing."""
        self._check_asking()
        self._is_open = False
        self._controller.close()
        self._plant.close()

    def _check_open(self) -> None:
        if not self._is_open:
            raise ValueError("the loop is closed: its instances are freed")

    def _check_idle(self) -> None:
        self._check_open()
        self._check_asking()

    def _check_asking(self) -> None:
        if self._is_asking:
            problem = "a law does not step, run, reset or close the loop that asks it"
            raise RuntimeError(f"{problem}: it returns the moment, and the loop makes the step")

    def __enter__(self) -> ClosedLoop:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()
