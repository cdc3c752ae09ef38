"""Laws in Python that fly what the orchestrator asks for."""

from __future__ import annotations

import functools
import hashlib
import inspect
import pickle
import sys
from collections.abc import Callable
from mmap import mmap
from pathlib import Path
from struct import Struct
from typing import Any

import numpy as np
import numpy.typing as npt

from ._data import FMUS, need
from ._instance import InstanceError
from ._loop import ClosedLoop
from ._orchestrator import Rows
from ._recording import ATTITUDE, COMMAND, RATE
from ._state import Law, State, moment_of, name_of

REFERENCE = "LQR"
"""FMU that computes the reference of a law and has the limits that it is judged by."""

DIRECT = {
    *((f"plant.{name}", f"controller.{name}") for name in ATTITUDE + RATE),
    *((name, name.replace("controller", "plant")) for name in COMMAND),
}
"""Connections of the loops that a law can fly."""


class Flyer:
    """Flies runs of the vehicle with a law in Python. The instances are reset between two
    runs, as far as they are FMUs of this package."""

    def __init__(
        self, make: Callable[[], Law], case: int | None = None, progress: Progress | None = None
    ) -> None:
        self.name = name_of(make())
        """Name of the law."""
        self._make = make
        self._case = case
        self._progress = progress
        self._loop: ClosedLoop | None = None
        self._opened: tuple[Any, ...] = ()

    def __call__(self, request: dict[str, Any]) -> Rows:
        """Flies a run that the orchestrator asks for. `make` gives each run a law.

        Raises:
            LawError: The law ended in another way than by returning a moment.
            InstanceError: An FMU cannot be opened, which is no matter of the run.
            ValueError: The loop is none that a law can fly.
        """
        check(request)
        loop = self._opened_for(request)
        case = self._case if request["case"] is None else request["case"]
        if self._progress is not None:
            self._progress.begin(case)
        try:
            loop._restart({name: found["set"] for name, found in request["components"].items()})
        except InstanceError as refusal:
            # An FMU may refuse the values of one case and take those of others.
            self.close()
            return Rows(np.empty((0, len(request["variables"]))), described(refusal))
        law, progress = self._make(), self._progress

        def moment(state: State) -> npt.ArrayLike:
            if progress is None:
                return moment_of(law, state, case)
            progress.ask(state.time)
            answer = moment_of(law, state, case)
            progress.answer()
            return answer

        variables = [(str(name), bool(responds)) for name, responds in request["variables"]]
        rows, failure = loop._fly(request["steps"], moment, variables)
        return Rows(rows, None if failure is None else described(failure))

    def _opened_for(self, request: dict[str, Any]) -> ClosedLoop:
        paths = {name: Path(found["fmu"]) for name, found in request["components"].items()}
        wanted = (paths, request["step"])
        is_ours = all(path.parent == FMUS for path in paths.values())
        if self._loop is None or self._opened != wanted or not is_ours:
            self.close()
            self._loop = ClosedLoop._with_law(paths, request["step"])
            self._opened = wanted
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


class Progress:
    """The case and the time at which a process asks a law, in a file that another process reads
    when the first one has ended."""

    FORM = Struct("=?qd")
    """Whether the law is being asked, number of the case, time in s."""

    def __init__(self, path: Path) -> None:
        if not path.exists():
            path.write_bytes(self.FORM.pack(False, -1, 0.0))
        with open(path, "r+b") as file:
            self._map = mmap(file.fileno(), self.FORM.size)
        self._case = -1

    def begin(self, case: int | None) -> None:
        """Notes the case."""
        self._case = -1 if case is None else case
        self.FORM.pack_into(self._map, 0, False, self._case, 0.0)

    def ask(self, time: float) -> None:
        """Notes that the law is asked."""
        self.FORM.pack_into(self._map, 0, True, self._case, time)

    def answer(self) -> None:
        """Notes that the law has answered."""
        self._map[0] = 0

    def read(self) -> tuple[bool, int | None, float]:
        """Returns whether the law was being asked, the case, and the time, s."""
        is_asked, case, time = self.FORM.unpack_from(self._map)
        return is_asked, None if case < 0 else case, time

    def close(self) -> None:
        """Closes the file."""
        self._map.close()


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


class PickledLaw:
    """A law that can be sent to other processes, in which each run gets a fresh copy of it."""

    def __init__(self, law: Law) -> None:
        need("cloudpickle", "campaign")
        import cloudpickle

        self.name = name_of(law)
        if not callable(law):
            raise TypeError(f"a law is a function from the state to the moment, not {law!r}")
        code = getattr(law, "__code__", None) or getattr(type(law).__call__, "__code__", None)
        self.file: str | None = getattr(code, "co_filename", None)
        """File that defines the law."""
        try:
            self.content: bytes = cloudpickle.dumps(law)
        except Exception as error:
            problem = f"the law {self.name} cannot be sent to other processes"
            raise TypeError(f"{problem}: {error}") from error
        digest = hashlib.sha256(self.content)
        while isinstance(law, functools.partial):
            law = law.func
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
