"""Laws in Python that fly what the orchestrator asks for."""

from __future__ import annotations

import hashlib
import inspect
import pickle
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

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


class LawError(RuntimeError):
    """A law in Python failed. The text names the case and the time, and has the law's own
    traceback."""

    def __init__(self, message: str, case: int | None, time: float) -> None:
        super().__init__(message)
        self.case = case
        """Number of the case, if it is one of a campaign."""
        self.time = time
        """Simulated time, s."""

    def __reduce__(self) -> tuple[Any, ...]:
        return LawError, (str(self), self.case, self.time)


class Flyer:
    """Flies runs of the vehicle with a law in Python. The instances are reset between two
    runs, as far as they are FMUs of this package."""

    def __init__(self, make: Callable[[], Law]) -> None:
        self._make = make
        self._loop: ClosedLoop | None = None
        self._opened: tuple[Any, ...] = ()

    def __call__(self, request: dict[str, Any]) -> Rows:
        """Flies a run that the orchestrator asks for. `make` gives each run a law.

        Raises:
            LawError: The law raised an error, or gave something else than a moment.
            ValueError: The loop is none that a law can fly.
        """
        check(request)
        loop = self._prepared(request)
        law, case = self._make(), request["case"]

        def moment(state: State) -> npt.ArrayLike:
            try:
                return vector(law(state))
            except Exception as error:
                message = explained(error, name_of(law), case, state.time)
                raise LawError(message, case, state.time) from error

        variables = [(str(name), bool(responds)) for name, responds in request["variables"]]
        rows, failure = loop._fly(request["steps"], moment, variables)
        return Rows(rows, None if failure is None else self._described(loop, failure))

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

    @staticmethod
    def _described(loop: ClosedLoop, failure: InstanceError) -> dict[str, str]:
        """Describes a failure as the orchestrator describes those of its own instances."""
        call = failure.call.removeprefix("fmi2")
        component = "plant" if failure.fmu == loop._plant.name else "controller"
        message = str(failure).removeprefix(f"{failure.fmu}: ")
        return {"component": component, "call": call[:1].lower() + call[1:], "message": message}

    def close(self) -> None:
        """Frees the instances."""
        if self._loop is not None:
            self._loop.close()
            self._loop = None

    def __enter__(self) -> Flyer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


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
    """Explains an error of a law, with the lines of the law that led to it."""
    where = f"at t = {time:.10g} s" if case is None else f"in case {case} at t = {time:.10g} s"
    lines = traceback.extract_tb(error.__traceback__)[1:]
    trace = "".join(traceback.format_list(lines))
    what = "".join(traceback.format_exception_only(error)).strip()
    return f"the law {name} failed {where}: {what}" + (f"\n{trace.rstrip()}" if trace else "")


class PickledLaw:
    """A law that can be sent to other processes, in which each run gets a fresh copy of it."""

    def __init__(self, law: Law) -> None:
        need("cloudpickle", "campaign")
        import cloudpickle

        self.name = name_of(law)
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
