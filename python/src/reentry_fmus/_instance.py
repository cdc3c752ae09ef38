"""One co-simulation instance of an FMU, driven through FMPy, with variables by name."""

from __future__ import annotations

import operator
import os
import warnings
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from fmpy import fmi2
from fmpy.fmi1 import FMICallException

from ._data import caller, hint
from ._unpacked import copies

Value = bool | int | float | str
"""Value of a variable: a number in its SI unit, a truth value, a text, or the name of an
enumeration's item."""

LEAST, MOST = -(2**31), 2**31 - 1
"""Range of an fmi2Integer. A number beyond it would be cut to its last 32 bits on its way."""


def plain(value: Any) -> int | float:
    """Returns a number as one of Python's. A truth value and a text are none."""
    if isinstance(value, (str, bytes, bool, np.bool_)):
        raise TypeError
    try:
        return operator.index(value)
    except TypeError:
        return float(value)


class InstanceError(RuntimeError):
    """An FMU refused a call. The text is the FMU's message."""

    def __init__(self, fmu: str, call: str, message: str) -> None:
        super().__init__(f"{fmu}: {message}")
        self.fmu = fmu
        """Name of the FMU."""
        self.call = call
        """Function of FMI 2.0 that was refused, or "loading" if the library cannot be loaded."""


class InstanceWarning(UserWarning):
    """A warning of an FMU."""


class Instance:
    """An instance of an FMU. `close` frees it."""

    def __init__(self, path: Path, parameters: Mapping[str, Value]) -> None:
        self._messages: list[tuple[int, str]] = []
        self._fmpy: Any = None
        self._unpacked = copies.open(path)
        try:
            description = self._unpacked.description
            self.name: str = description.modelName
            self.variables: dict[str, Any] = {v.name: v for v in description.modelVariables}
            self.values(parameters, "parameter")
            instance = self._loaded()
            callbacks = fmi2.fmi2CallbackFunctions()
            callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(self._log)
            callbacks.allocateMemory = fmi2.defaultCallbacks.allocateMemory
            callbacks.freeMemory = fmi2.defaultCallbacks.freeMemory
            try:
                instance.instantiate(callbacks=callbacks, loggingOn=True)
            except Exception as error:
                instance.freeLibrary()
                raise InstanceError(self.name, "fmi2Instantiate", self._errors(str(error))) from error
            self._fmpy = instance
            self.set(parameters, "parameter")
        except BaseException:
            self.close()
            raise

    def _loaded(self) -> Any:
        unpacked = self._unpacked
        # FMPy looks for the library in its folder, and stays there if it cannot be loaded.
        here = os.getcwd()
        try:
            return fmi2.FMU2Slave(
                guid=unpacked.description.guid,
                modelIdentifier=unpacked.interface.modelIdentifier,
                unzipDirectory=str(unpacked.folder),
                instanceName=self.name,
                libraryPath=unpacked.library,
            )
        except Exception as error:
            os.chdir(here)
            raise InstanceError(self.name, "loading", str(error)) from error

    def _log(self, _: Any, __: bytes, status: int, ___: bytes, message: bytes) -> None:
        self._messages.append((status, message.decode(errors="replace")))

    def _errors(self, otherwise: str) -> str:
        errors = [message for status, message in self._messages if status > fmi2.fmi2Warning]
        return "; ".join(errors) or otherwise

    def _call(self, function: Callable[..., Any], *arguments: Any, **named: Any) -> Any:
        """Calls a function of the FMU. Its errors become exceptions with the FMU's message."""
        self._messages.clear()
        try:
            result = function(*arguments, **named)
        except FMICallException as error:
            raise InstanceError(self.name, error.function, self._errors(str(error))) from None
        for status, message in self._messages:
            if status == fmi2.fmi2Warning:
                warnings.warn(f"{self.name}: {message}", InstanceWarning, stacklevel=caller())
        return result

    # Variables

    def variable(self, name: str) -> Any:
        """Returns the description of a variable."""
        if name not in self.variables:
            raise ValueError(f'{self.name} has no variable "{name}"{hint(name, self.variables)}')
        return self.variables[name]

    def references(self, names: Sequence[str]) -> list[int]:
        """Returns the value references of variables."""
        return [self.variable(name).valueReference for name in names]

    def get_reals(self, references: list[int]) -> list[float]:
        """Returns real variables by value reference."""
        values: list[float] = self._call(self._fmpy.getReal, references)
        return values

    def set_reals(self, references: list[int], values: Sequence[float]) -> None:
        """Sets real variables by value reference."""
        self._call(self._fmpy.setReal, references, values)

    def reader(self, kind: str, names: Sequence[str]) -> Callable[[], Sequence[float]]:
        """Returns a function that reads variables of a type as numbers."""
        functions = {"Real": self._fmpy.getReal, "Boolean": self._fmpy.getBoolean}
        function = functions.get(kind, self._fmpy.getInteger)
        references = self.references(names)

        def read() -> Sequence[float]:
            values: Sequence[float] = self._call(function, references)
            return values

        return read

    def get(self, name: str) -> Value:
        """Returns a variable; an enumeration as its item's name."""
        variable = self.variable(name)
        references = [variable.valueReference]
        if variable.type == "Real":
            return self.get_reals(references)[0]
        if variable.type == "String":
            text = self._call(self._fmpy.getString, references)[0]
            return text.decode() if isinstance(text, bytes) else str(text)
        if variable.type == "Boolean":
            return bool(self._call(self._fmpy.getBoolean, references)[0])
        number = int(self._call(self._fmpy.getInteger, references)[0])
        if variable.type == "Enumeration":
            return next(
                str(item.name) for item in variable.declaredType.items if int(item.value) == number
            )
        return number

    def values(self, settings: Mapping[str, Value], causality: str) -> list[tuple[Any, Any]]:
        """Checks settings against the variables' types, before any of them is set."""
        pairs = []
        for name, value in settings.items():
            variable = self.variable(name)
            if variable.causality != causality:
                problem = f"{self.name}: {name} is no {causality}, but has the causality"
                raise ValueError(f"{problem} {variable.causality}")
            pairs.append((variable, self._checked(variable, value)))
        return pairs

    def _checked(self, variable: Any, value: Value) -> Any:
        needs = f"{self.name}: {variable.name} needs"
        if variable.type == "Enumeration":
            items = {str(item.name): int(item.value) for item in variable.declaredType.items}
            if not isinstance(value, str) or value not in items:
                raise ValueError(
                    f"{needs} one of its items, not {value!r}{hint(str(value), items)}"
                )
            return items[value]
        if variable.type == "String":
            if isinstance(value, str):
                return value
            raise TypeError(f"{needs} a text, not {value!r}")
        if variable.type == "Boolean":
            if value in (True, False):
                return bool(value)
            raise TypeError(f"{needs} True or False, not {value!r}")
        unit = f" in {variable.unit}" if getattr(variable, "unit", None) else ""
        try:
            number = plain(value)
            if variable.type == "Real":
                return float(number)
        except (TypeError, ValueError, OverflowError):
            kind = "an integer" if variable.type == "Integer" else f"a number{unit}"
            raise TypeError(f"{needs} {kind}, not {value!r}") from None
        if number != number or number in (np.inf, -np.inf) or number != int(number):
            raise TypeError(f"{needs} an integer, not {value!r}")
        low = LEAST if variable.min is None else int(variable.min)
        high = MOST if variable.max is None else int(variable.max)
        if not low <= number <= high:
            raise ValueError(f"{needs} an integer from {low} to {high}, not {value!r}")
        return int(number)

    def set(self, settings: Mapping[str, Value], causality: str) -> None:
        """Sets variables of a causality by name."""
        setters = {
            "Real": self._fmpy.setReal,
            "Integer": self._fmpy.setInteger,
            "Enumeration": self._fmpy.setInteger,
            "Boolean": self._fmpy.setBoolean,
            "String": self._fmpy.setString,
        }
        for variable, value in self.values(settings, causality):
            self._call(setters[variable.type], [variable.valueReference], [value])

    # States of the instance

    def enter(self) -> None:
        """Enters initialization mode at t = 0."""
        self._call(self._fmpy.setupExperiment, startTime=0.0)
        self._call(self._fmpy.enterInitializationMode)

    def exit(self) -> None:
        """Leaves initialization mode."""
        self._call(self._fmpy.exitInitializationMode)

    def step(self, time: float, step: float) -> None:
        """Advances by one communication step, s."""
        self._call(self._fmpy.doStep, currentCommunicationPoint=time, communicationStepSize=step)

    def reset(self, parameters: Mapping[str, Value]) -> None:
        """Resets the instance. FMI resets parameters to their start values, so they are set
        again."""
        self._call(self._fmpy.reset)
        self.set(parameters, "parameter")

    def close(self) -> None:
        """Frees the instance. A second call does nothing."""
        instance, self._fmpy = self._fmpy, None
        if instance is not None:
            instance.freeInstance()
        self._unpacked.release()


def parted(name: str, components: Mapping[str, object]) -> tuple[str, str]:
    """Splits "component.variable"."""
    component, _, variable = name.partition(".")
    if component not in components:
        raise ValueError(
            f'{name}: there is no component "{component}"{hint(component, components)}'
        )
    return component, variable


def split(parameters: Mapping[str, Value], has_controller: bool) -> dict[str, dict[str, Value]]:
    """Sorts parameters by component."""
    by_component: dict[str, dict[str, Value]] = {"plant": {}, "controller": {}}
    for name, value in parameters.items():
        component, variable = parted(name, by_component)
        if component == "controller" and not has_controller:
            if not variable.startswith(("reference.", "limit.")):
                problem = "the loop has no controller, only a reference and limits"
                raise ValueError(f"{name}: {problem}")
        by_component[component][variable] = value
    return by_component
