"""Variables of the loop that are read at every communication point."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence

import numpy as np
import numpy.typing as npt

from ._instance import Instance

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
COMMAND = [f"controller.{name}" for name in MOMENT]

Variable = tuple[str, bool]
"""Name of a variable, component.variable, and whether it is read after the step that begins at the
communication point, because it responds to the inputs there."""

RECORDED: list[Variable] = [
    *((f"plant.{name}", False) for name in ATTITUDE + RATE),
    *((f"controller.{name}", False) for name in REFERENCES),
    *((name, True) for name in COMMAND),
]
"""Variables of the table of a loop."""


class Probes:
    """Reads variables into the rows of a run. With a law in Python its moment replaces that of
    the controller."""

    def __init__(
        self, components: Mapping[str, Instance], variables: Sequence[Variable], has_law: bool
    ) -> None:
        self.columns = {name: place for place, (name, _) in enumerate(variables)}
        self._command = [(self.columns[n], k) for k, n in enumerate(COMMAND) if n in self.columns]
        if not has_law:
            self._command = []
        by_law = {place for place, _ in self._command}
        places: dict[tuple[bool, str, str], list[tuple[int, str]]] = defaultdict(list)
        for place, (path, responds) in enumerate(variables):
            component, _, name = path.partition(".")
            kind = components[component].variable(name).type
            if place not in by_law:
                places[responds, component, kind].append((place, name))
        self._groups: dict[bool, list[tuple[Callable[[], Sequence[float]], list[int]]]]
        self._groups = {False: [], True: []}
        for (responds, component, kind), found in places.items():
            read = components[component].reader(kind, [name for _, name in found])
            self._groups[responds].append((read, [place for place, _ in found]))

    def point(self, row: npt.NDArray[np.float64]) -> None:
        """Reads what is known at a communication point."""
        for read, places in self._groups[False]:
            row[places] = read()

    def response(self, row: npt.NDArray[np.float64], moment: Sequence[float]) -> None:
        """Reads what responds to the inputs there, after the step."""
        for read, places in self._groups[True]:
            row[places] = read()
        self.command(row, moment)

    def command(self, row: npt.NDArray[np.float64], moment: Sequence[float]) -> None:
        """Writes the moment of a law."""
        for place, axis in self._command:
            row[place] = moment[axis]
