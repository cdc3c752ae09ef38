"""One co-simulation instance of an FMU, driven by FMPy, with variables by name."""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from multiprocessing.util import Finalize
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
from fmpy import fmi2
from fmpy.fmi1 import FMICallException

from ._data import caller, hint

Value = bool | int | float | str
"""Value of a variable: a number in its SI unit, a truth value, a text, or the name of an
enumeration's item."""

NEEDS = {
    "Real": "a number",
    "Integer": "an integer of 32 bits",
    "Boolean": "True or False",
    "String": "a text",
    "Enumeration": "one of its items",
}
"""Values that a variable takes, by its type."""


class InstanceError(RuntimeError):
    """An FMU refused a call. The text is the FMU's message."""

    def __init__(self, fmu: str, call: str, message: str) -> None:
        super().__init__(f"{fmu}: {message}")
        self.fmu = fmu
        """Name of the FMU."""
        self.call = call
        """Function of FMI 2.0 that was refused."""


class InstanceWarning(UserWarning):
    """A warning of an FMU."""


@cache
def unpacked(archive: Path, changed: int) -> tuple[Path, Any]:
    """Unpacks an archive, and returns its folder and its description. It is unpacked once in a
    process, as long as the time of its last change is the same: a library of this project stays
    loaded until the process ends, and is shared by all instances."""
    prefix = f"unpacked-fmu-{os.getpid()}-" if sys.platform != "win32" else "reentry-fmus-"
    folder = Path(tempfile.mkdtemp(prefix=prefix))
    # After the children of `multiprocessing` have ended, and not at the end of a forked process.
    Finalize(None, shutil.rmtree, (folder, True), exitpriority=-1)
    if sys.platform != "win32":
        import fcntl

        # The orchestrator removes folders of this name that nobody holds, as after a kill.
        fcntl.flock(os.open(folder, os.O_RDONLY), fcntl.LOCK_EX)
    fmpy.extract(str(archive), str(folder))
    return folder, fmpy.read_model_description(str(folder))


if hasattr(os, "register_at_fork"):
    # The parent may remove its folders at any time.
    os.register_at_fork(after_in_child=unpacked.cache_clear)


class Instance:
    """An instance of an FMU. `close` frees it."""

    def __init__(self, path: Path, parameters: Mapping[str, Value]) -> None:
        self._messages: list[tuple[int, str]] = []
        self._fmpy: Any = None
        folder, description = unpacked(path, path.stat().st_mtime_ns)
        if description.fmiVersion != "2.0" or description.coSimulation is None:
            raise ValueError(f"{path}: a loop needs an FMU for co-simulation by FMI 2.0")
        self.name: str = description.modelName
        self.variables: dict[str, Any] = {v.name: v for v in description.modelVariables}
        self.proposed_step = float(getattr(description.defaultExperiment, "stepSize", None) or 0.04)
        self.values(parameters, "parameter")
        callbacks = fmi2.fmi2CallbackFunctions(
            fmi2.fmi2CallbackLoggerTYPE(self._log),
            fmi2.defaultCallbacks.allocateMemory,
            fmi2.defaultCallbacks.freeMemory,
        )
        here = os.getcwd()
        try:
            instance = fmi2.FMU2Slave(
                guid=description.guid,
                modelIdentifier=description.coSimulation.modelIdentifier,
                unzipDirectory=str(folder),
                instanceName=self.name,
            )
            instance.instantiate(callbacks=callbacks, loggingOn=True)
        except Exception as error:
            raise InstanceError(self.name, "fmi2Instantiate", self._errors(error)) from error
        finally:
            # FMPy stays in the folder of a library that cannot be loaded.
            os.chdir(here)
        self._fmpy = instance
        try:
            self.set(parameters, "parameter")
        except BaseException:
            self.close()
            raise

    def _log(self, _: Any, __: bytes, status: int, ___: bytes, message: bytes) -> None:
        self._messages.append((status, message.decode(errors="replace")))

    def _errors(self, error: Exception) -> str:
        errors = [message for status, message in self._messages if status > fmi2.fmi2Warning]
        return "; ".join(errors) or str(error)

    def _call(self, function: str, *arguments: Any) -> Any:
        """Calls a function of the FMU. Its errors become exceptions with the FMU's message."""
        self._messages.clear()
        try:
            result = getattr(self._fmpy, function)(*arguments)
        except FMICallException as error:
            raise InstanceError(self.name, error.function, self._errors(error)) from None
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
        values: list[float] = self._call("getReal", references)
        return values

    def set_reals(self, references: list[int], values: Sequence[float]) -> None:
        """Sets real variables by value reference."""
        self._call("setReal", references, values)

    def reader(self, kind: str, names: Sequence[str]) -> Callable[[], list[Any]]:
        """Returns a function that reads variables of a type; of an enumeration, the numbers of its
        items."""
        function = "getInteger" if kind == "Enumeration" else f"get{kind}"
        references = self.references(names)
        return lambda: list(self._call(function, references))

    def get(self, name: str) -> Value:
        """Returns a variable; an enumeration as its item's name."""
        variable = self.variable(name)
        value: Any = self.reader(variable.type, [name])()[0]
        if variable.type == "Enumeration":
            return {number: item for item, number in items(variable).items()}[value]
        found: Value = value.decode() if isinstance(value, bytes) else value
        return bool(found) if variable.type == "Boolean" else found

    def values(self, settings: Mapping[str, Value], causality: str) -> list[tuple[Any, Any]]:
        """Checks settings against the variables' types, before any of them is set. Returns the
        variables with what FMI knows of the values."""
        pairs = []
        for name, value in settings.items():
            variable = self.variable(name)
            if variable.causality != causality:
                problem = f"{self.name}: {name} is no {causality}, but has the causality"
                raise ValueError(f"{problem} {variable.causality}")
            try:
                pairs.append((variable, converted(variable, value)))
            except (TypeError, ValueError, OverflowError):
                unit = f" in {variable.unit}" if getattr(variable, "unit", None) else ""
                near = hint(str(value), items(variable)) if variable.type == "Enumeration" else ""
                problem = f"{name} needs {NEEDS[variable.type]}{unit}, not {value!r}{near}"
                raise TypeError(f"{self.name}: {problem}") from None
        return pairs

    def set(self, settings: Mapping[str, Value], causality: str) -> None:
        """Sets variables of a causality by name."""
        for variable, value in self.values(settings, causality):
            kind = "Integer" if variable.type == "Enumeration" else variable.type
            self._call(f"set{kind}", [variable.valueReference], [value])

    # States of the instance

    def enter(self) -> None:
        """Enters initialization mode at t = 0."""
        self._call("setupExperiment")
        self._call("enterInitializationMode")

    def exit(self) -> None:
        """Leaves initialization mode."""
        self._call("exitInitializationMode")

    def step(self, time: float, step: float) -> None:
        """Advances by one communication step, s."""
        self._call("doStep", time, step)

    def reset(self, parameters: Mapping[str, Value]) -> None:
        """Resets the instance. FMI resets parameters to their start values, so they are set
        again."""
        self._call("reset")
        self.set(parameters, "parameter")

    def close(self) -> None:
        """Frees the instance. A second call does nothing."""
        instance, self._fmpy = self._fmpy, None
        if instance is not None:
            instance.freeInstance()


def items(variable: Any) -> dict[str, int]:
    """Returns the numbers of an enumeration's items by their names."""
    return {str(item.name): int(item.value) for item in variable.declaredType.items}


def converted(variable: Any, value: Any) -> Any:
    """Returns a value as FMI knows it.

    Raises:
        TypeError, ValueError, OverflowError: The variable takes no such value.
    """
    if isinstance(value, (np.generic, np.ndarray)):
        value = value.item()
    if variable.type == "Enumeration" and value in (known := items(variable)):
        return known[value]
    if variable.type == "String" and isinstance(value, str):
        return value
    if variable.type == "Boolean" and value in (True, False):
        return bool(value)
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        if variable.type == "Real":
            return float(value)
        if variable.type == "Integer" and value == int(value):
            # FMPy would cut a larger number to its last 32 bits.
            return int(np.int32(int(value)))
    raise TypeError


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
