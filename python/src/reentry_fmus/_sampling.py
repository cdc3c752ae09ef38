"""Samples of a model in DAVE-ML on a grid of angle of attack and Mach number."""

from __future__ import annotations

from collections.abc import Iterable
from math import cos, inf, radians, sin

from ._dave import Model, Variable
from ._mathml import DaveError
from ._units import factor

Grid = tuple[list[float], list[float]]
"""Angles of attack in degrees, and Mach numbers."""
Rows = list[list[float]]
"""Values of a coefficient, in one row for each Mach number."""

ROLES = {
    "alpha": ("angleOfAttack", "alpha", "ALP", "alfa", "alphaDeg"),
    "beta": ("angleOfSideslip", "beta", "BET", "betaDeg"),
    "mach": ("mach", "machNumber", "XMACH", "Ma", "MACH", "M"),
    "lift": ("totalCoefficientOfLift", "liftCoefficient", "CL", "CLtotal"),
    "drag": ("totalCoefficientOfDrag", "dragCoefficient", "CD", "CDtotal"),
    "normal": ("aeroBodyForceCoefficient_Z", "CZ"),
    "axial": ("aeroBodyForceCoefficient_X", "CX"),
    "side": ("aeroBodyForceCoefficient_Y", "sideForceCoefficient", "CY"),
    "roll": ("aeroBodyMomentCoefficient_Roll", "rollingMomentCoefficient", "Cl", "CR"),
    "pitch": ("aeroBodyMomentCoefficient_Pitch", "pitchingMomentCoefficient", "Cm", "CM"),
    "yaw": ("aeroBodyMomentCoefficient_Yaw", "yawingMomentCoefficient", "Cn", "CN"),
    "area": ("referenceWingArea", "referenceArea", "SWING", "SREF", "Sref", "S"),
    "span": ("referenceWingSpan", "referenceSpan", "BWING", "BSPAN", "BREF"),
    "chord": ("referenceWingChord", "referenceChord", "CBAR", "CWING", "CREF"),
    "speed": ("trueAirspeed", "VT", "vt"),
    "p": ("bodyAngularRate_Roll", "eulerAngleRate_Roll", "PB", "p"),
    "q": ("bodyAngularRate_Pitch", "QB", "q"),
    "r": ("bodyAngularRate_Yaw", "RB", "r"),
    "mass": ("totalMass", "vehicleMass", "XMASS", "mass"),
    "Ixx": ("bodyMomentOfInertia_X", "bodyMomentOfInertia_Roll", "XIXX", "IXX"),
    "Iyy": ("bodyMomentOfInertia_Y", "bodyMomentOfInertia_Pitch", "XIYY", "IYY"),
    "Izz": ("bodyMomentOfInertia_Z", "bodyMomentOfInertia_Yaw", "XIZZ", "IZZ"),
    "Ixz": ("bodyProductOfInertia_ZX", "bodyProductOfInertia_XZ", "XIZX", "IXZ", "IZX"),
    "Ixy": ("bodyProductOfInertia_XY", "bodyProductOfInertia_YX", "XIXY", "IXY", "IYX"),
    "Iyz": ("bodyProductOfInertia_YZ", "bodyProductOfInertia_ZY", "XIYZ", "IYZ", "IZY"),
}
"""Names by which models call what a vehicle needs: first those of AIAA S-119, then usual identifiers."""
SIDESLIP = 2.0
"""Sideslip from whose effect the derivatives follow, deg."""
RATE = 0.1
"""Rate from whose effect the dampings follow, rad/s, at the speed below."""
SPEED = 100.0
UNITS_OF_ROLES = {
    **dict.fromkeys(("alpha", "beta"), "deg"),
    **dict.fromkeys(("p", "q", "r"), "rad/s"),
    **dict.fromkeys(("mach", "lift", "drag", "normal", "axial", "side", "roll", "pitch", "yaw"), ""),
    "speed": "m/s",
}
"""Units of the roles that are sampled."""


def simple(name: str) -> str:
    return "".join(c for c in name if c.isalnum())


def scaled(variable: Variable, unit: str, role: str) -> float:
    """Factor from a unit to that of a variable, which is refused if its unit is not of this kind."""
    scale = factor(unit, variable.units)
    if scale is None:
        given = f'the unit "{variable.units}"' if variable.units else "no unit"
        named = f'line {variable.node.line}: "{variable.identifier}" ({role})'
        raise DaveError(f"{named} has {given}, which cannot be converted to {unit or 'a plain number'}")
    return scale


class Roles:
    """Finds the variables that play a role, as told or by their names."""

    def __init__(self, model: Model, told: dict[str, str]):
        self.model, self.told = model, told
        for role in told:
            if role not in ROLES:
                raise DaveError(f'--map: there is no role "{role}"; there are: {", ".join(ROLES)}')

    def find(self, role: str) -> Variable | None:
        if role in self.told:
            variable = self.model.find(self.told[role])
            if variable is None:
                raise DaveError(f'--map {role}: there is no variable "{self.told[role]}" in the model')
            return variable
        # Short names such as Cl and CL differ in a capital letter only.
        for wanted in ROLES[role]:
            for variable in self.model.variables.values():
                names = [variable.identifier, variable.name, variable.name.removesuffix(f"_{variable.units}")]
                pairs_ = [(simple(name), simple(wanted)) for name in names]
                if any(name == known or len(known) > 3 and name.lower() == known.lower() for name, known in pairs_):
                    return variable
        return None

    def scale(self, role: str) -> float:
        """Factor from the unit in which a role is sampled to that of its variable."""
        return scaled(self.need(role), UNITS_OF_ROLES[role], role)

    def need(self, role: str) -> Variable:
        variable = self.find(role)
        if variable is None:
            raise DaveError(f"no variable of the model is known as {role}: give --map {role}=VARID")
        return variable


class Sampler:
    """Evaluates coefficients of a model at angles of attack and sideslip, Mach numbers and deflections in
    degrees. Sideslip, rates and deflections are zero where nothing else is said."""

    def __init__(self, model: Model, roles: Roles, surfaces: Iterable[str], told: dict[str, str]):
        self.model, self.roles = model, roles
        self.alpha, self.beta, self.mach = roles.need("alpha"), roles.find("beta"), roles.find("mach")
        self.names = ["lift", "drag"] if roles.find("lift") and roles.find("drag") else ["axial", "normal"]
        self.axes = [axis for axis in ("roll", "pitch", "yaw") if roles.find(axis)]
        self.fixed = dict.fromkeys(surfaces, 0.0)
        for role in ("alpha", "beta", "mach", "p", "q", "r", "speed"):
            if (variable := roles.find(role)) and variable.is_input:
                self.fixed[variable.identifier] = roles.scale(role) * (SPEED if role == "speed" else 0.0)
        self.sampled = set(self.fixed)
        for name, value in told.items():
            self._set(name, value)
        outputs = [roles.need(name) for name in [*self.names, *self.axes]]
        outputs += [side] if (side := roles.find("side")) else []
        for output in outputs:
            scaled(output, "", "a coefficient")
        self.used = model.behind(output.identifier for output in outputs)

    def _set(self, name: str, value: str) -> None:
        variable = self.model.find(name)
        if variable is None or not variable.is_input:
            raise DaveError(f'--set {name}: there is no input "{name}" in the model')
        if variable.identifier in self.sampled:
            raise DaveError(f'--set {name}: "{name}" is sampled, so that it has no fixed value')
        try:
            self.fixed[variable.identifier] = finite(value)
        except ValueError:
            raise DaveError(f'--set {name}: "{value}" is no finite number') from None

    def initial(self) -> list[Variable]:
        """The inputs that take their initial values. Refuses inputs that have none."""
        left = [v for v in self.model.variables.values() if v.is_input and v.identifier in self.used - set(self.fixed)]
        missing = [v for v in left if v.initial is None]
        if missing:
            named = ", ".join(f"{v.identifier} ({v.name}) in {v.units or 'no unit'}" for v in missing)
            wanted = " ".join(f"--set {v.identifier}=…" for v in missing)
            raise DaveError(f"inputs without a value: {named}; give {wanted}")
        return left

    def at(self, outputs: Iterable[Variable], alpha: float, mach: float, changes: dict[str, float]) -> list[float]:
        given = {**self.fixed, self.alpha.identifier: alpha * self.roles.scale("alpha")}
        if self.mach:
            given[self.mach.identifier] = mach * self.roles.scale("mach")
        value = self.model.evaluate({**given, **changes})
        return [value(output.identifier) for output in outputs]

    def tables(self, names: list[str], grid: Grid, changes: dict[str, float]) -> list[Rows]:
        outputs = [self.roles.need(name) for name in names]
        points = [[self.at(outputs, alpha, mach, changes) for alpha in grid[0]] for mach in grid[1]]
        return [[[point[i] for point in row] for row in points] for i in range(len(names))]

    def forces(self, grid: Grid) -> list[Rows]:
        """Lift and drag."""
        forces = self.tables(self.names, grid, {})
        return _turned(forces, grid[0]) if self.names[0] == "axial" else forces

    def breakpoints(self, role: str) -> list[float]:
        """Those of all used tables over the angle of attack in degrees or the Mach number, or over a variable
        that is the same within limits."""
        variable, found = self.roles.find(role), set()
        if variable is None or not variable.is_input:
            return []
        for axis in self.model.axes:
            over = self.model.variables[axis.variable]
            scale = factor(over.units, UNITS_OF_ROLES[role])
            if over.identifier not in self.used or scale is None or variable.identifier not in self.model.behind([over.identifier]):
                continue
            for point in axis.points:
                value = point * scale
                alpha, mach = (value, 1.0) if role == "alpha" else (0.0, value)
                is_within = role == "alpha" or value > 0.0
                if is_within and abs(self.at([over], alpha, mach, {})[0] - point) <= 1e-9 * max(1.0, abs(point)):
                    found.add(round(value, 9))
        return sorted(found)

    def between(self, grid: Grid) -> list[tuple[str, float, float, float]]:
        """The largest differences from a linear course half-way between points of the grid: name,
        difference, angle of attack and Mach number."""
        fine = (_halved(grid[0]), _halved(grid[1]))
        tables = dict(zip(("lift", "drag"), self.forces(fine), strict=True))
        if "pitch" in self.axes:
            (tables["pitch"],) = self.tables(["pitch"], fine, {})
        found = []
        for name, rows in tables.items():
            worst = (0.0, fine[0][0], fine[1][0])
            for i, row in enumerate(rows):
                for j, value in enumerate(row):
                    ends = [rows[k][m] for k in (i - i % 2, i + i % 2) for m in (j - j % 2, j + j % 2)]
                    if (difference := abs(value - sum(ends) / 4.0)) > worst[0]:
                        worst = (difference, fine[0][j], fine[1][i])
            found.append((name, *worst))
        return found


def finite(text: str) -> float:
    value = float(text)
    if not -inf < value < inf:
        raise ValueError(text)
    return value


def _halved(points: list[float]) -> list[float]:
    middles = [(low + high) / 2.0 for low, high in zip(points, points[1:], strict=False)]
    return sorted([*points, *middles])


def _turned(forces: list[Rows], alphas: list[float]) -> list[Rows]:
    """Lift and drag of the forces along the body axes x and z."""
    turns = [(sin(radians(alpha)), cos(radians(alpha))) for alpha in alphas]
    rows = list(zip(*forces, strict=True))
    lift = [[x * s - z * c for x, z, (s, c) in zip(xs, zs, turns, strict=True)] for xs, zs in rows]
    drag = [[-x * c - z * s for x, z, (s, c) in zip(xs, zs, turns, strict=True)] for xs, zs in rows]
    return [lift, drag]
