"""Converts a model in DAVE-ML (AIAA S-119) into the file of a vehicle, which `vehicle.file` names.

    python -m reentry_fmus.daveml MODEL.dml --check
    python -m reentry_fmus.daveml MODEL.dml -o vehicle.toml --surface "left elevon=DELEL" ...

The model is evaluated and compared with its own check cases. Then its coefficients are sampled on a
grid of angle of attack, Mach number and deflections, as docs/own-vehicle.md explains.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterable
from math import cos, pi, radians, sin
from pathlib import Path

from ._dave import Difference, Model, Variable
from ._mathml import DaveError
from ._units import factor

__all__ = ["DaveError", "Model", "convert", "main"]

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
}
"""Names by which models call what a vehicle needs: first those of AIAA S-119, then usual identifiers."""
SIDESLIP = 2.0
"""Sideslip from whose effect the derivatives follow, deg."""
RATE = 0.1
"""Rate from whose effect the dampings follow, rad/s, at the speed below."""
SPEED = 100.0
STEPS = 7
"""Number of deflections between the limits of a surface at which it is sampled."""


def simple(name: str) -> str:
    return "".join(c for c in name if c.isalnum())


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

    def need(self, role: str) -> Variable:
        variable = self.find(role)
        if variable is None:
            raise DaveError(f"no variable of the model is known as {role}: give --map {role}=VARID")
        return variable


class Sampler:
    """Evaluates coefficients of a model at angles of attack and sideslip, Mach numbers and deflections in
    degrees."""

    def __init__(self, model: Model, roles: Roles, fixed: dict[str, float]):
        self.model, self.roles, self.fixed = model, roles, fixed
        self.alpha, self.beta, self.mach = roles.need("alpha"), roles.find("beta"), roles.find("mach")

    def at(self, outputs: Iterable[Variable], alpha: float, mach: float, changes: dict[str, float]) -> list[float]:
        given = {**self.fixed, self.alpha.identifier: self.angle(self.alpha, alpha)}
        if self.mach:
            given[self.mach.identifier] = mach
        if self.beta:
            given.setdefault(self.beta.identifier, 0.0)
        value = self.model.evaluate({**given, **changes})
        return [value(output.identifier) for output in outputs]

    @staticmethod
    def angle(variable: Variable, degrees: float) -> float:
        """An angle in the unit of its variable."""
        scale = factor("deg", variable.units)
        return degrees * (1.0 if scale is None else scale)


def written(values: Iterable[float]) -> str:
    return "[" + ", ".join(f"{value:.9g}" if value else "0" for value in values) + "]"


def _table(name: str, source: str, grid: tuple[list[float], list[float]], rows: list[list[float]]) -> str:
    alphas, machs = grid
    body = ",\n    ".join(written(row) for row in rows)
    return (
        f'[{name}]\nsource = "{source}"\n[{name}.table]\nalpha_deg = {written(alphas)}\nmach = {written(machs)}\n'
        f"values = [\n    {body},\n]\n"
    )


def convert(
    model: Model,
    roles: Roles,
    grid: tuple[list[float], list[float]],
    surfaces: dict[str, str],
    options: argparse.Namespace,
) -> str:
    """Returns the text of the vehicle's file."""
    alphas, machs = grid
    source = f"{Path(options.model).name}, sampled by reentry_fmus.daveml".replace('"', "'")
    sampler = Sampler(model, roles, {})
    # Everything that is an input and has no value is zero: rates and deflections.
    for variable in model.variables.values():
        if variable.is_input and variable.initial is None:
            sampler.fixed[variable.identifier] = 0.0
    speed = roles.find("speed")
    if speed and speed.is_input:
        scale = factor("m/s", speed.units)
        sampler.fixed[speed.identifier] = SPEED * (1.0 if scale is None else scale)

    def sampled(names: list[str], changes: dict[str, float]) -> list[list[list[float]]]:
        outputs = [roles.need(name) for name in names]
        points = [[sampler.at(outputs, alpha, mach, changes) for alpha in alphas] for mach in machs]
        return [[[point[i] for point in row] for row in points] for i in range(len(names))]

    def constant(role: str, unit: str, value: float | None) -> float:
        if value is not None:
            return value
        variable = roles.find(role)
        if variable is None:
            raise DaveError(f"no variable of the model is known as {role}: give --{role} in {unit}, or --map {role}=VARID")
        scale = factor(variable.units, unit)
        if scale is None:
            raise DaveError(f'line {variable.node.line}: {role} has the unit "{variable.units}"; give --{role} in {unit}')
        return model.evaluate(sampler.fixed)(variable.identifier) * scale

    lengths = {role: constant(role, unit, getattr(options, role)) for role, unit in (("area", "m2"), ("span", "m"), ("chord", "m"))}
    mass = constant("mass", "kg", options.mass)
    point = written(options.moment_point)
    parts = [
        f'title = "{model.title}, from {source}"\n',
        f'[reference]\nsource = "{source}"\nmass = {{ kilograms = {mass:.9g} }}\narea = {{ square_metres = {lengths["area"]:.9g} }}\n'
        f"span = {{ metres = {lengths['span']:.9g} }}\nchord = {{ metres = {lengths['chord']:.9g} }}\nmoment_point_metres = {point}\n",
    ]
    inertia = options.inertia
    if inertia is None and all(roles.find(role) for role in ("Ixx", "Iyy", "Izz")):
        others = ["Ixz"] if roles.find("Ixz") else []
        inertia = [constant(role, "kgm2", None) for role in ["Ixx", "Iyy", "Izz", *others]]
    if inertia:
        values = "".join(f"{name} = {value:.9g}\n" for name, value in zip(("Ixx", "Iyy", "Izz", "Ixz"), inertia, strict=False))
        parts.append(f'[inertia]\nsource = "{source}"\n{values}')
    has = {role: roles.find(role) is not None for role in ROLES}
    axes = [axis for axis in ("roll", "pitch", "yaw") if has[axis]]
    static = dict(zip(axes, sampled(axes, {}), strict=True)) if axes else {}
    names = ["lift", "drag"] if has["lift"] and has["drag"] else ["axial", "normal"]
    forces = sampled(names, {})
    if names[0] == "axial":
        forces = _turned(forces, alphas)
    parts += [_table(f"forces.{name}", source, grid, rows) for name, rows in zip(("lift", "drag"), forces, strict=True)]
    small = max((abs(value) for axis in ("roll", "yaw") for row in static.get(axis, []) for value in row), default=0.0)
    parts += [_table(f"moments.{axis}", source, grid, rows) for axis, rows in static.items() if axis == "pitch" or small > 1e-12]
    beta = sampler.beta
    if beta:
        either = [name for name in ("side", "roll", "yaw") if has[name]]
        ends = [sampled(either, {beta.identifier: sampler.angle(beta, sign * SIDESLIP)}) for sign in (-1.0, 1.0)]
        for name, low, high in zip(either, *ends, strict=True):
            scale = 1.0 / (2.0 * SIDESLIP * pi / 180.0)
            key = "forces.side" if name == "side" else f"moments.{name}_by_sideslip"
            parts.append(_table(key, source, grid, _difference(low, high, scale)))
    parts += _dampings(sampler, roles, sampled, grid, source, lengths, speed)
    if surfaces:
        parts.append(_surfaces(model, sampler, sampled, static, grid, surfaces, source, options))
    return "\n".join(parts)


def _difference(low: list[list[float]], high: list[list[float]], scale: float) -> list[list[float]]:
    return [[(b - a) * scale for a, b in zip(one, other, strict=True)] for one, other in zip(low, high, strict=True)]


def _turned(forces: list[list[list[float]]], alphas: list[float]) -> list[list[list[float]]]:
    """Lift and drag of the forces along the body axes x and z."""
    turns = [(sin(radians(alpha)), cos(radians(alpha))) for alpha in alphas]
    rows = list(zip(*forces, strict=True))
    lift = [[x * s - z * c for x, z, (s, c) in zip(xs, zs, turns, strict=True)] for xs, zs in rows]
    drag = [[-x * c - z * s for x, z, (s, c) in zip(xs, zs, turns, strict=True)] for xs, zs in rows]
    return [lift, drag]


def _dampings(
    sampler: Sampler,
    roles: Roles,
    sampled: Callable[[list[str], dict[str, float]], list[list[list[float]]]],
    grid: tuple[list[float], list[float]],
    source: str,
    lengths: dict[str, float],
    speed: Variable | None,
) -> list[str]:
    """The groups of the dampings, as far as the model has rates and a speed."""
    parts = []
    for axis, rate, length in (("roll", "p", "span"), ("pitch", "q", "chord"), ("yaw", "r", "span")):
        variable = roles.find(rate)
        if not (variable and variable.is_input and speed and roles.find(axis)):
            continue
        scale = factor("rad/s", variable.units)
        turned = RATE * (1.0 if scale is None else scale)
        low, high = (sampled([axis], {variable.identifier: sign * turned})[0] for sign in (-1.0, 1.0))
        by_rate = 1.0 / (2.0 * RATE * lengths[length] / (2.0 * SPEED))
        parts.append(_table(f"moments.{axis}_damping", source, grid, _difference(low, high, by_rate)))
    return parts


def _surfaces(
    model: Model,
    sampler: Sampler,
    sampled: Callable[[list[str], dict[str, float]], list[list[list[float]]]],
    static: dict[str, list[list[list[float]]]],
    grid: tuple[list[float], list[float]],
    surfaces: dict[str, str],
    source: str,
    options: argparse.Namespace,
) -> str:
    limits, tables = [], []
    for name, identifier in surfaces.items():
        variable = model.find(identifier)
        if variable is None or not variable.is_input:
            raise DaveError(f'--surface "{name}": there is no input "{identifier}" in the model')
        scale = factor(variable.units, "deg")
        scale = 1.0 if scale is None else scale
        low, high = (end * scale for end in variable.limits)
        low, high = max(low, options.deflection[0]), min(high, options.deflection[1])
        if not low <= 0.0 <= high:
            raise DaveError(f'line {variable.node.line}: the limits of "{name}" must hold 0')
        limits.append((low, high))
        points = sorted({round(low + (high - low) * i / (STEPS - 1), 9) for i in range(STEPS)} | {0.0})
        parts = [sampled(list(static), {variable.identifier: sampler.angle(variable, point)}) for point in points]
        for i, axis in enumerate(static):
            changes = [_difference(static[axis], part[i], 1.0) for part in parts]
            if max(abs(value) for part in changes for row in part for value in row) < 1e-12:
                continue
            body = ",\n".join("    [" + ", ".join(written(row) for row in part) + "]" for part in changes)
            tables.append(
                f'[[surfaces.table]]\nsurface = "{name}"\naxis = "{axis}"\nsource = "{source}"\nalpha_deg = {written(grid[0])}\n'
                f"mach = {written(grid[1])}\ndeflection_deg = {written(points)}\nvalues = [\n{body},\n]\n"
            )
    names = ", ".join(f'"{name}"' for name in surfaces)
    head = (
        f'[surfaces]\nsource = "{source}"\nnames = [{names}]\nmin_deg = {written(low for low, _ in limits)}\n'
        f"max_deg = {written(high for _, high in limits)}\nrate_deg_s = {written(options.rate for _ in limits)}\n"
    )
    return "\n".join([head, *tables])


def report(differences: list[Difference]) -> bool:
    """Prints every value of the check cases. Returns whether all that have a tolerance keep it."""
    for found in differences:
        word = "ok" if found.is_kept else "WRONG" if found.is_required else "differs"
        print(f"{word:8}{found.shot}: {found.signal} = {found.value:.9g}, stated {found.expected:.9g}, tolerance {found.tolerance:.3g}")
    shots = len({found.shot for found in differences})
    wrong = sum(not found.is_kept for found in differences if found.is_required)
    print(f"{len(differences)} values of {shots} check cases, {wrong} of them wrong")
    return not wrong


def grid_of(text: str) -> list[float]:
    """Reads `0:40:5` (from, to, step) or `0,5,10`."""
    if ":" in text:
        begin, end, step = (float(part) for part in text.split(":"))
        if step <= 0.0 or end < begin:
            raise ValueError(text)
        return [begin + i * step for i in range(round((end - begin) / step) + 1)]
    return [float(part) for part in text.split(",")]


def pairs(written_pairs: list[str]) -> dict[str, str]:
    for pair in written_pairs:
        if "=" not in pair:
            raise DaveError(f'"{pair}" is not of the form NAME=VARID')
    return {name.strip(): value.strip() for name, _, value in (pair.rpartition("=") for pair in written_pairs)}


def controls(model: Model) -> dict[str, str]:
    """The inputs that deflect surfaces, as far as the model says so."""
    inputs = [variable for variable in model.variables.values() if variable.is_input]
    found = [v for v in inputs if v.node.one("isControl") or "deflection" in v.name.lower()]
    angles = [variable for variable in found if factor(variable.units, "deg") is not None]
    return {variable.name: variable.identifier for variable in angles}


def arguments() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser("python -m reentry_fmus.daveml", description=(__doc__ or "").partition("\n\n")[0])
    three = {"nargs": 3, "type": float}
    parser.add_argument("model", help="file in DAVE-ML")
    parser.add_argument("-o", "--output", type=Path, help="file of the vehicle, in TOML; without it only the check cases are evaluated")
    parser.add_argument("--check", action="store_true", help="only evaluate the check cases")
    parser.add_argument("--force", action="store_true", help="convert although a check case is wrong")
    parser.add_argument("--alpha", type=grid_of, default=grid_of("0:40:4"), help="angles of attack in deg, as 0:40:4 or 0,10,30")
    parser.add_argument("--mach", type=grid_of, default=[2.0, 4.0], help="Mach numbers, as --alpha")
    parser.add_argument("--map", action="append", default=[], metavar="ROLE=VARID", help="variable of a role, as lift=CL")
    parser.add_argument("--surface", action="append", default=[], metavar="NAME=VARID", help="input that deflects a surface, once for each; by default all inputs that are controls or deflections")
    parser.add_argument("--deflection", nargs=2, type=float, default=[-30.0, 30.0], help="widest limits of the deflections, deg")
    parser.add_argument("--rate", type=float, default=20.0, help="largest deflection rate, deg/s")
    parser.add_argument("--mass", type=float, help="mass, kg")
    parser.add_argument("--inertia", type=float, nargs=4, metavar=("IXX", "IYY", "IZZ", "IXZ"), help="kg m2")
    for name, unit in (("area", "m2"), ("span", "m"), ("chord", "m")):
        parser.add_argument(f"--{name}", type=float, help=f"reference {name}, {unit}")
    parser.add_argument("--moment-point", default=[0.0, 0.0, 0.0], metavar=("X", "Y", "Z"), help="point of the moments from the centre of mass, m", **three)
    return parser


def main(words: list[str] | None = None) -> int:
    """Runs the command. Returns its exit code: 1 if a check case is wrong, 2 if the model cannot be used."""
    options = arguments().parse_args(words)
    try:
        model = Model(Path(options.model))
        is_right = report(model.check()) if model.shots else print("the model has no check cases") is None
        if not is_right and not options.force:
            return 1
        if options.output and not options.check:
            roles = Roles(model, pairs(options.map))
            surfaces = pairs(options.surface) or controls(model)
            for role, variable in [(role, roles.find(role)) for role in ROLES]:
                print(f"{role}: {variable.identifier if variable else 'none'}")
            print("surfaces: " + (", ".join(f"{name} = {identifier}" for name, identifier in surfaces.items()) or "none"))
            text = convert(model, roles, (options.alpha, options.mach), surfaces, options)
            options.output.write_text(text, encoding="utf-8")
            print(f"{options.output}: written")
    except (DaveError, ValueError, OSError) as error:
        print(f"{options.model}: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
