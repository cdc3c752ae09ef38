"""FMUs driven by hand through FMPy, with variables by name and log messages kept."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import fmpy
from fmpy import fmi2, fmi3

ANGLES = [f"attitude.{axis}" for axis in ("alpha", "beta", "sigma")]
RATES = [f"rate.{axis}" for axis in ("p", "q", "r")]
MOMENT = [f"moment.{axis}" for axis in ("x", "y", "z")]
REFERENCE = [f"reference.{axis}" for axis in ("alpha", "beta", "sigma")]

# These outputs are wall-clock times, which differ from run to run.
NOT_REPRODUCIBLE = {"solver.time", "innerLaw.time"}


@dataclass
class Fmu:
    """An unpacked FMU archive with its description."""

    path: Path
    folder: Path
    description: fmpy.model_description.ModelDescription
    variables: dict = field(default_factory=dict)

    @classmethod
    def open(cls, path: Path, folder: Path) -> Fmu:
        shutil.unpack_archive(path, folder, "zip")
        description = fmpy.read_model_description(str(folder))
        return cls(path, folder, description, {v.name: v for v in description.modelVariables})

    @property
    def name(self) -> str:
        return self.description.modelName

    def names(self, causality: str) -> list[str]:
        return [v.name for v in self.description.modelVariables if v.causality == causality]

    def item(self, name: str, text: str) -> int:
        """Returns the value of an enumeration's item."""
        items = self.variables[name].declaredType.items
        return next(int(item.value) for item in items if item.name == text)

    def values(self, settings: dict) -> dict:
        """Settings with the values of enumerations in place of their items."""
        return {name: self.item(name, value) if isinstance(value, str) else value for name, value in settings.items()}

    def arguments(self, kind: str = "coSimulation") -> dict:
        identifier = getattr(self.description, kind).modelIdentifier
        return dict(guid=self.description.guid, unzipDirectory=str(self.folder), modelIdentifier=identifier)


class Instance:
    """A co-simulation instance. Parameters are set by name, and enumerations by their item's
    name."""

    # The name of a type in the functions that transfer its values.
    TYPES = {"Real": "Real", "Integer": "Integer", "Enumeration": "Integer", "Boolean": "Boolean", "String": "String"}

    def __init__(self, fmu: Fmu, parameters: dict | None = None, name: str = "instance", guid: str | None = None):
        self.fmu = fmu
        # Each call of the logger adds status, category and message.
        self.log: list[tuple[int, str, str]] = []
        arguments = fmu.arguments()
        if guid is not None:
            arguments["guid"] = guid
        try:
            self._instantiate(instanceName=name, **arguments)
        except Exception as error:
            raise RuntimeError(self.messages()) from error
        self.set(parameters or {})

    def _instantiate(self, **arguments) -> None:
        self.slave = fmi2.FMU2Slave(**arguments)
        callbacks = fmi2.fmi2CallbackFunctions()
        callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(self._logged)
        callbacks.allocateMemory = fmi2.defaultCallbacks.allocateMemory
        callbacks.freeMemory = fmi2.defaultCallbacks.freeMemory
        self.slave.instantiate(callbacks=callbacks, loggingOn=True)

    def _logged(self, *arguments):
        status, category, message = arguments[-3:]
        self.log.append((status, category.decode(), message.decode()))

    def messages(self) -> str:
        """Returns the warnings and errors of the log."""
        return "\n".join(message for status, _, message in self.log if status >= fmi2.fmi2Warning)

    # Values by name

    def set(self, values: dict) -> None:
        groups: dict[str, tuple[list, list]] = {}
        for name, value in values.items():
            variable = self.fmu.variables[name]
            if variable.type == "Enumeration" and isinstance(value, str):
                value = self.fmu.item(name, value)
            references, group = groups.setdefault(variable.type, ([], []))
            references.append(variable.valueReference)
            group.append(value)
        for kind, (references, group) in groups.items():
            getattr(self.slave, f"set{self.TYPES[kind]}")(references, group)

    def get(self, names: list[str]) -> list:
        """Returns values in the order of the names. All Reals are read in one call, and so are all
        integers."""
        values = {}
        for kind, name_in_functions in self.TYPES.items():
            own = [name for name in names if self.fmu.variables[name].type == kind]
            if own:
                getter = getattr(self.slave, f"get{name_in_functions}")
                values.update(zip(own, getter([self.fmu.variables[name].valueReference for name in own])))
        return [values[name] for name in names]

    def outputs(self) -> list:
        """Returns all reproducible outputs."""
        return self.get([name for name in self.fmu.names("output") if name not in NOT_REPRODUCIBLE])

    # Life

    def enter(self, start: float = 0.0, stop: float | None = None) -> None:
        self.slave.setupExperiment(startTime=start, stopTime=stop)
        self.slave.enterInitializationMode()

    def exit(self) -> None:
        self.slave.exitInitializationMode()

    def start(self, start: float = 0.0, inputs: dict | None = None) -> Instance:
        self.enter(start)
        self.set(inputs or {})
        self.exit()
        return self

    def step(self, time: float, step: float) -> None:
        self.slave.doStep(currentCommunicationPoint=time, communicationStepSize=step)

    def save(self) -> bytes:
        state = self.slave.getFMUstate()
        saved = self.slave.serializeFMUstate(state)
        self.slave.freeFMUstate(state)
        return saved

    def restore(self, saved: bytes) -> None:
        state = self.slave.deSerializeFMUstate(saved)
        self.slave.setFMUstate(state)
        self.slave.freeFMUstate(state)

    def reset(self, parameters: dict | None = None) -> None:
        """Resets to the state of a new instance. FMI resets parameters to their start values, so
        they are set anew."""
        self.slave.reset()
        self.set(parameters or {})

    def close(self) -> None:
        self.slave.freeInstance()

    def __enter__(self) -> Instance:
        return self

    def __exit__(self, *_) -> None:
        self.close()


class Instance3(Instance):
    """A co-simulation instance of FMI 3.0. With `events`, the importer uses event mode and allows
    early return. A step returns whether an event is to be handled, whether the simulation ends,
    whether the step ended early, and the time reached."""

    TYPES = {"Float64": "Float64", "Int32": "Int32", "Enumeration": "Int64", "Boolean": "Boolean", "String": "String"}

    def __init__(self, *arguments, events: bool = False, **named):
        self.events = events
        super().__init__(*arguments, **named)

    def _instantiate(self, **arguments) -> None:
        self.slave = fmi3.FMU3Slave(**arguments)
        self.slave.instantiate(loggingOn=True, eventModeUsed=self.events, earlyReturnAllowed=self.events, logMessage=self._logged)

    def enter(self, start: float = 0.0, stop: float | None = None) -> None:
        self.slave.enterInitializationMode(startTime=start, stopTime=stop)

    def handle(self) -> float | None:
        """Handles an event, and returns the time of the next one."""
        *_, is_defined, time = self.slave.updateDiscreteStates()
        return time if is_defined else None

    def step(self, time: float, step: float) -> tuple[bool, bool, bool, float]:
        return self.slave.doStep(currentCommunicationPoint=time, communicationStepSize=step)

    def save(self) -> bytes:
        state = self.slave.getFMUState()
        saved = self.slave.serializeFMUState(state)
        self.slave.freeFMUState(state)
        return saved

    def restore(self, saved: bytes) -> None:
        state = self.slave.deserializeFMUState(saved)
        self.slave.setFMUState(state)
        self.slave.freeFMUState(state)


class EventLoop:
    """Controller and plant of FMI 3.0 in event mode: both make the step at the same time, then each
    gets the inputs of the instant, so that the loop has no delay."""

    def __init__(self, controller: Instance3, plant: Instance3, step: float):
        self.controller, self.plant, self.period = controller, plant, step

    def exchange(self) -> list[float]:
        """Handles the event at the present instant. Returns state and moment."""
        state = self.plant.get(ANGLES + RATES)
        self.controller.set(dict(zip(ANGLES + RATES, state)))
        self.controller.handle()
        moment = self.controller.get(MOMENT)
        self.plant.set(dict(zip(MOMENT, moment)))
        self.plant.handle()
        for instance in (self.controller, self.plant):
            instance.slave.enterStepMode()
        return state + moment

    def fly(self, steps: int) -> list[list[float]]:
        for instance in (self.plant, self.controller):
            instance.enter()
            instance.exit()
        rows = [self.exchange()]
        for tick in range(steps):
            for instance in (self.controller, self.plant):
                instance.step(tick * self.period, self.period)
                instance.slave.enterEventMode()
            rows.append(self.exchange())
        return rows


def number(written):
    """Converts a parameter of an experiment file to a number in SI units; a text carries a unit in
    degrees."""
    if not isinstance(written, str):
        return written
    match = re.fullmatch(r"(\S+) deg(/s2?)?", written)
    return float(match[1]) * 3.141592653589793 / 180.0 if match else written


class Loop:
    """Controller and plant stepped by hand, in the order of calls that FMI 2.0 prescribes.

    In each step, the plant's state goes to the controller, which is stepped and read; its moment
    goes to the plant, which is stepped. With `jacobi`, both are read, then both are set, then both
    are stepped. A clock gives time and length of each step, because importers compute them in ways
    that round differently.
    """

    def __init__(self, controller: Instance, plant: Instance, step: float, jacobi: bool = False, clock: Callable | None = None):
        self.controller, self.plant, self.jacobi = controller, plant, jacobi
        self.clock = clock or (lambda tick: (tick * step, step))
        self.tick = 0

    def start(self) -> None:
        self.controller.enter()
        self.plant.enter()
        state = self.plant.get(ANGLES + RATES)
        self.controller.set(dict(zip(ANGLES + RATES, state)))
        self.plant.set(dict(zip(MOMENT, self.controller.get(MOMENT))))
        self.controller.exit()
        self.plant.exit()

    def read(self) -> list[float]:
        """Returns state and moment at the present communication point."""
        return self.plant.get(ANGLES + RATES) + self.controller.get(MOMENT)

    def advance(self) -> None:
        now = self.clock(self.tick)
        state, moment = self.plant.get(ANGLES + RATES), self.controller.get(MOMENT)
        self.controller.set(dict(zip(ANGLES + RATES, state)))
        if self.jacobi:
            self.plant.set(dict(zip(MOMENT, moment)))
        self.controller.step(*now)
        if not self.jacobi:
            self.plant.set(dict(zip(MOMENT, self.controller.get(MOMENT))))
        self.plant.step(*now)
        self.tick += 1

    def fly(self, steps: int) -> list[list[float]]:
        """Starts, makes all steps, and returns state and moment at each communication point. The
        moment is that of the step before."""
        self.start()
        rows = [self.read()]
        for _ in range(steps):
            self.advance()
            rows.append(self.read())
        return rows


def of_step(rows):
    """Shifts the moments, so that each row has that of the step which begins there, as in the
    orchestrator's results. The last row, where none begins, keeps its own."""
    return [row[:6] + after[6:] for row, after in zip(rows, [*rows[1:], rows[-1]])]
