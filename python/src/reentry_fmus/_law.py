"""Laws in Python that fly what the orchestrator asks for."""

from __future__ import annotations

import hashlib
import inspect
import pickle
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from traceback import FrameSummary
from typing import Any

import numpy as np
import numpy.typing as npt

from ._data import FMUS, need
from ._instance import InstanceError
from ._loop import ClosedLoop
from ._orchestrator import Rows
from ._recording import ATTITUDE, COMMAND, RATE
from ._state import Law, State, name_of, vector

REFERENCE = "LQR"
"""FMU that computes the reference of a law and has the limits that it is judged by."""

DIRECT = {
    *((f"plant.{name}", f"controller.{name}") for name in ATTITUDE + RATE),
    *((name, name.replace("controller", "plant")) for name in COMMAND),
}
"""Connections of the loops that a law can fly."""

SENT = "<dynamic-code>"
"""Name that cloudpickle gives to the file of a function that it sends."""

Line = tuple[str, int, str]
"""File, line and function of a call."""


class LawError(RuntimeError):
    """A law in Python failed. The text names the case and the time, and the lines of the law."""

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


class Flyer:
    """Flies runs of the vehicle with a law in Python. The instances are reset between two
    runs, as far as they are FMUs of this package."""

    def __init__(self, make: Callable[[], Law], case: int | None = None) -> None:
        self.name = name_of(make())
        """Name of the law."""
        self._make = make
        self._case = case
        self._loop: ClosedLoop | None = None
        self._opened: tuple[Any, ...] = ()

    def __call__(self, request: dict[str, Any]) -> Rows:
        """Flies a run that the orchestrator asks for. `make` gives each run a law.

        Raises:
            LawError: The law raised an error, or gave something else than a moment.
            ValueError: The loop is none that a law can fly.
        """
        check(request)
        try:
            loop = self._prepared(request)
        except InstanceError as refusal:
            # An FMU may refuse the values of one case and take those of others.
            self.close()
            return Rows(np.empty((0, len(request["variables"]))), described(refusal))
        law = self._make()
        case = self._case if request["case"] is None else request["case"]

        def moment(state: State) -> npt.ArrayLike:
            try:
                return vector(law(state))
            except Exception as error:
                problem = explained(error, name_of(law), case, state.time)
                raise LawError(problem, lines_of(error), case, state.time) from error

        variables = [(str(name), bool(responds)) for name, responds in request["variables"]]
        rows, failure = loop._fly(request["steps"], moment, variables)
        return Rows(rows, None if failure is None else described(failure))

    def _prepared(self, request: dict[str, Any]) -> ClosedLoop:
        paths = {name: Path(found["fmu"]) for name, found in request["components"].items()}
        wanted = (paths, request["step"])
        is_ours = all(path.parent == FMUS for path in paths.values())
        if self._loop is None or self._opened != wanted or not is_ours:
            self.close()
            self._loop = ClosedLoop._with_law(paths, request["step"])
            self._opened = wanted
        self._loop._restart({name: c["set"] for name, c in request["components"].items()})
        return self._loop

    def close(self) -> None:
        """Frees the instances."""
        if self._loop is not None:
            self._loop.close()
            self._loop = None

    def __enter__(self) -> Flyer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def described(failure: InstanceError) -> dict[str, str]:
    """Describes a failure as the orchestrator describes those of its own instances."""
    component = "controller" if failure.fmu == REFERENCE else "plant"
    call = failure.call.removeprefix("fmi2")
    message = str(failure).removeprefix(f"{failure.fmu}: ")
    return {"component": component, "call": call[:1].lower() + call[1:], "message": message}


def check(request: dict[str, Any]) -> None:
    """Refuses loops that are not those of `ClosedLoop`."""
    connections = {(source, target) for source, target in request["connections"]}
    is_direct = (
        request["order"] == ["controller", "plant"]
        and request["coupling"] == "sequential"
        and all(component["every"] == 1 for component in request["components"].values())
        and connections == DIRECT
        and request["start"] == 0.0
    )
    if not is_direct:
        raise ValueError(
            "a law in Python flies a plant and a controller that are connected directly, as in the "
            f'experiment "lqr", from t = 0; here {", ".join(request["order"])} are stepped '
            f"({request['coupling']}), with {len(connections)} connections"
        )


def explained(error: Exception, name: str, case: int | None, time: float) -> str:
    """Says which law failed when, and why."""
    where = f"at t = {time:.10g} s" if case is None else f"in case {case} at t = {time:.10g} s"
    what = "".join(traceback.format_exception_only(error)).strip()
    return f"the law {name} failed {where}: {what}"


def lines_of(error: Exception) -> list[Line]:
    """Returns file, line and function of the calls within a law that led to an error."""
    calls = traceback.extract_tb(error.__traceback__)[1:]
    return [(call.filename, call.lineno or 0, call.name) for call in calls]


class PickledLaw:
    """A law that can be sent to other processes, in which each run gets a fresh copy of it."""

    def __init__(self, law: Law) -> None:
        need("cloudpickle", "campaign")
        import cloudpickle

        self.name = name_of(law)
        code = getattr(law, "__code__", None) or getattr(type(law).__call__, "__code__", None)
        self.file: str | None = getattr(code, "co_filename", None)
        """File that defines the law."""
        self.content: bytes = cloudpickle.dumps(law)
        digest = hashlib.sha256(self.content)
        # A function of an imported module is sent by its name.
        source = inspect.getmodule(law if inspect.isroutine(law) else type(law))
        file = getattr(source, "__file__", None)
        if file is not None and source is not sys.modules["__main__"]:
            digest.update(Path(file).read_bytes())
        self.key = f"{self.name} {digest.hexdigest()[:32]}"
        """Name and hash, under which the orchestrator keeps what the law has flown."""

    def __call__(self) -> Law:
        law: Law = pickle.loads(self.content)
        return law
