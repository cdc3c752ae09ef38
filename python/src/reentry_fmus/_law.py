"""Laws in Python that the orchestrator asks for moments."""

from __future__ import annotations

import copy
import functools
import hashlib
import inspect
import math
import pickle
import sys
from collections.abc import Callable
from mmap import mmap
from pathlib import Path
from struct import Struct

import numpy as np

from ._data import need
from ._recording import ATTITUDE, RATE
from ._state import Inputs, Law, LawError, State, Vector, moment_of, name_of


STAND_IN = "LQR"
"""FMU that stands in for everything but the moment of a law."""


class Flight:
    """A law and its inputs in a flight."""

    def __init__(self, law: Law, case: int | None, names: list[str]) -> None:
        self.law = law
        self.case = case
        self.names = names
        self._places = {name: place for place, name in enumerate(names[:-12])}
        self._attitude = [self._places[name] for name in ATTITUDE]
        self._rate = [self._places[name] for name in RATE]

    def state(self, time: float, told: bytes) -> State:
        """Reads the values that the law receives: the inputs, nine numbers of the reference, and the moment."""
        values = np.frombuffer(told).copy()
        attitude, rate = values[self._attitude], values[self._rate]
        return State(
            time=time,
            attitude=attitude,
            attitude_rate=attitude_rate(attitude, rate),
            rate=rate,
            reference=values[-12:-9],
            reference_rate=values[-9:-6],
            reference_acceleration=values[-6:-3],
            moment=values[-3:],
            inputs=Inputs(self._places, values),
        )


def attitude_rate(attitude: Vector, rate: Vector) -> Vector:
    """Returns the time derivative of the attitude that body rates give: Chai 2022, (2)."""
    alpha, beta, _ = attitude.tolist()
    p, q, r = rate.tolist()
    sa, ca, sb, cb = math.sin(alpha), math.cos(alpha), math.sin(beta), math.cos(beta)
    tb = sb / cb if cb else math.nan
    return np.array(
        [
            -ca * tb * p + q - sa * tb * r,
            sa * p - ca * r,
            -ca * cb * p - sb * q - cb * sa * r,
        ]
    )


class Laws:
    """The laws of all flights of an orchestrator, which it asks by messages (its module `law`)."""

    HEAD = Struct("<cQdI")
    """Kind of a message, number of the law, time in s, length of what follows."""

    def __init__(
        self,
        make: Callable[[], Law],
        key: str,
        case: int | None = None,
        progress: Progress | None = None,
        file: str | None = None,
    ) -> None:
        self.key = key
        """Name and hash, under which the orchestrator keeps what the law has flown."""
        self.has_cases = True
        """Whether the number of a case says which one it is. In a search it does not."""
        self.printed = bytearray()
        """Output that the orchestrator has printed."""
        self._make = make
        self._case = case
        self._progress = progress
        self._file = file
        self._flights: dict[int, Flight] = {}

    def answer(self, kind: bytes, number: int, time: float, told: bytes) -> bytes | None:
        """Serves the request of a message, and returns the answer if there is one.

        Raises:
            LawError: The law ended in another way than by returning a moment.
        """
        if kind == b"a":
            return self._ask(self._flights[number], time, told)
        if kind == b"b":
            case, *names = told.decode().split("\n")
            is_numbered = case and self.has_cases
            flight = Flight(self._make(), int(case) if is_numbered else self._case, names)
            self._flights[number] = flight
            if self._progress is not None:
                self._progress.begin(flight.case)
        elif kind == b"c":
            source = self._flights[int.from_bytes(told, "little")]
            self._flights[number] = Flight(copied(source.law), source.case, source.names)
        elif kind == b"e":
            self._flights.pop(number, None)
        elif kind == b"p":
            self.printed += told
        else:
            raise RuntimeError(f"the orchestrator sent {kind!r}, which is no message")
        return None

    def _ask(self, flight: Flight, time: float, told: bytes) -> bytes:
        state, progress = flight.state(time, told), self._progress
        if progress is not None:
            progress.ask(time)
        try:
            moment = moment_of(flight.law, state, flight.case)
        except LawError as error:
            # A function that was sent or copied has lost its file.
            raise error.in_file(self._file) from error.__cause__
        if progress is not None:
            progress.answer()
        return moment.tobytes()


def copied(law: Law) -> Law:
    """Returns a law with a memory of its own: what an object holds and a function encloses, but not
    what is global.

    Raises:
        TypeError: The law cannot be copied.
        ModuleNotFoundError: cloudpickle, which copies functions, is not installed.
    """
    if inspect.isfunction(law) and law.__closure__ is None:
        return law
    if inspect.isfunction(law):
        need("cloudpickle", "campaign")
    try:
        try:
            import cloudpickle
        except ModuleNotFoundError:
            return copy.deepcopy(law)
        again: Law = pickle.loads(cloudpickle.dumps(law))
    except Exception as error:
        raise TypeError(f"the law {name_of(law)} cannot be copied: {error}") from error
    if again is law:
        raise TypeError(f"the law {name_of(law)} cannot be copied: it is known by its name")
    return again


def file_of(law: Law) -> str | None:
    """Returns the file that defines a law."""
    code = getattr(law, "__code__", None) or getattr(type(law).__call__, "__code__", None)
    return getattr(code, "co_filename", None)


def laws_of(law: Law, is_first: bool = False) -> Laws:
    """Returns the laws of flights in this process, each a copy of a law; the first one is the law
    itself if `is_first` says so.

    Raises:
        TypeError: The law cannot be called, or cannot be copied.
    """
    if not callable(law):
        raise TypeError(f"a law is a function from the state to the moment, not {law!r}")
    left = [law] if is_first else []
    try:
        fresh = copied(law)
    except (TypeError, ModuleNotFoundError):
        if not is_first:
            raise
        # Most runs need no second one.
        fresh = law
    make = lambda: left.pop() if left else copied(fresh)  # noqa: E731
    return Laws(make, name_of(law), file=file_of(law))


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


class PickledLaw:
    """A law that can be sent to other processes, in which each run gets a fresh copy of it."""

    def __init__(self, law: Law) -> None:
        need("cloudpickle", "campaign")
        import cloudpickle

        self.name = name_of(law)
        if not callable(law):
            raise TypeError(f"a law is a function from the state to the moment, not {law!r}")
        self.file = file_of(law)
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

    def laws(self, case: int | None = None) -> Laws:
        """Returns the laws of flights in this process."""
        return Laws(lambda: pickle.loads(self.content), self.key, case, file=self.file)
