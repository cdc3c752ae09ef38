"""FMUs driven by hand through FMPy, with variables by name and log messages kept."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import fmpy
from fmpy import fmi2

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

    def arguments(self, kind: str = "coSimulation") -> dict:
        identifier = getattr(self.description, kind).modelIdentifier
        return dict(guid=self.description.guid, unzipDirectory=str(self.folder), modelIdentifier=identifier)


class Instance:
    """A co-simulation instance. Parameters are set by name, and enumerations by their item's
    name."""

    def __init__(self, fmu: Fmu, parameters: dict | None = None, name: str = "instance", guid: str | None = None):
        self.fmu = fmu
        # Each call of the logger adds status, category and message.
        self.log: list[tuple[int, str, str]] = []
        arguments = fmu.arguments()
        if guid is not None:
            arguments["guid"] = guid
        self.slave = fmi2.FMU2Slave(instanceName=name, **arguments)
        callbacks = fmi2.fmi2CallbackFunctions()
        callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(self._logged)
        callbacks.allocateMemory = fmi2.defaultCallbacks.allocateMemory
        callbacks.freeMemory = fmi2.defaultCallbacks.freeMemory
        try:
            self.slave.instantiate(callbacks=callbacks, loggingOn=True)
        except Exception as error:
            raise RuntimeError(self.messages()) from error
        self.set(parameters or {})

    def _logged(self, _environment, _instance, status, category, message):
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
        setters = {
            "Real": self.slave.setReal,
            "Integer": self.slave.setInteger,
            "Enumeration": self.slave.setInteger,
            "Boolean": self.slave.setBoolean,
            "String": self.slave.setString,
        }
        for kind, (references, group) in groups.items():
            setters[kind](references, group)

    def get(self, names: list[str]) -> list:
        """Returns values in the order of the names. All Reals are read in one call, and so are all
        integers."""
        values = {}
        getters = {
            "Real": self.slave.getReal,
            "Integer": self.slave.getInteger,
            "Enumeration": self.slave.getInteger,
            "Boolean": self.slave.getBoolean,
            "String": self.slave.getString,
        }
        for kind, getter in getters.items():
            own = [name for name in names if self.fmu.variables[name].type == kind]
            if own:
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
