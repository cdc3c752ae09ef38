"""Converts a model in DAVE-ML (AIAA S-119) into the file of a vehicle, which `vehicle.file` names.

    python -m reentry_fmus.daveml MODEL.dml --check
    python -m reentry_fmus.daveml MODEL.dml -o vehicle.toml --surface "left elevon=DELEL" ...

The model is evaluated and compared with its own check cases. Then its coefficients are sampled on a
grid of angle of attack, Mach number and deflections, as docs/vehicle.md explains.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterable
from math import pi
from pathlib import Path

from ._dave import Difference, Model
from ._mathml import DaveError
from ._sampling import RATE, ROLES, SIDESLIP, SPEED, Grid, Roles, Rows, Sampler, finite, scaled
from ._units import factor

__all__ = ["DaveError", "Model", "convert", "main"]

STEPS = 7
"""Number of deflections between the limits of a surface at which it is sampled."""
ALPHAS = [2.0 * i for i in range(21)]
"""Angles of attack of a model without breakpoints, deg."""
MACHS = [2.0, 4.0]
MOST_SURFACES = 8
INERTIA = ("Ixx", "Iyy", "Izz", "Ixz", "Ixy", "Iyz")

def quoted(text: str) -> str:
    """A basic string of TOML."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def written(values: Iterable[float]) -> str:
    return "[" + ", ".join(f"{value:.9g}" if value else "0" for value in values) + "]"


def _table(name: str, source: str, grid: Grid, rows: Rows) -> str:
    alphas, machs = grid
    body = ",\n    ".join(written(row) for row in rows)
    return (
        f'[{name}]\nsource = {source}\n[{name}.table]\nalpha_deg = {written(alphas)}\nmach = {written(machs)}\n'
        f"values = [\n    {body},\n]\n"
    )


def convert(sampler: Sampler, grid: Grid, surfaces: dict[str, str], options: argparse.Namespace) -> str:
    """Returns the text of the vehicle's file."""
    model, roles = sampler.model, sampler.roles
    told = f"{Path(options.model).name}, sampled by reentry_fmus.daveml"
    source = quoted(told)

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
    point = written(options.moment_point or [0.0, 0.0, 0.0])
    parts = [
        f"title = {quoted(f'{model.title}, from {told}')}\n",
        f'[reference]\nsource = {source}\nmass = {{ kilograms = {mass:.9g} }}\narea = {{ square_metres = {lengths["area"]:.9g} }}\n'
        f"span = {{ metres = {lengths['span']:.9g} }}\nchord = {{ metres = {lengths['chord']:.9g} }}\nmoment_point_metres = {point}\n",
    ]
    inertia = options.inertia
    if inertia is None and all(roles.find(role) for role in ("Ixx", "Iyy", "Izz")):
        inertia = [constant(role, "kgm2", None) if roles.find(role) else 0.0 for role in INERTIA]
    if inertia:
        values = "".join(f"{name} = {value:.9g}\n" for name, value in zip(INERTIA, inertia, strict=False))
        parts.append(f'[inertia]\nsource = {source}\n{values}')
    static = dict(zip(sampler.axes, sampler.tables(sampler.axes, grid, {}), strict=True))
    forces = sampler.forces(grid)
    parts += [_table(f"forces.{name}", source, grid, rows) for name, rows in zip(("lift", "drag"), forces, strict=True)]
    small = max((abs(value) for axis in ("roll", "yaw") for row in static.get(axis, []) for value in row), default=0.0)
    parts += [_table(f"moments.{axis}", source, grid, rows) for axis, rows in static.items() if axis == "pitch" or small > 1e-12]
    beta = sampler.beta
    if beta:
        either = [name for name in ("side", "roll", "yaw") if roles.find(name)]
        slip = SIDESLIP * roles.scale("beta")
        ends = [sampler.tables(either, grid, {beta.identifier: sign * slip}) for sign in (-1.0, 1.0)]
        for name, low, high in zip(either, *ends, strict=True):
            scale = 1.0 / (2.0 * SIDESLIP * pi / 180.0)
            key = "forces.side" if name == "side" else f"moments.{name}_by_sideslip"
            parts.append(_table(key, source, grid, _difference(low, high, scale)))
    parts += _dampings(sampler, grid, source, lengths)
    if surfaces:
        parts.append(_surfaces(sampler, static, grid, surfaces, source, options))
    return "\n".join(parts)


def _difference(low: Rows, high: Rows, scale: float) -> Rows:
    return [[(b - a) * scale for a, b in zip(one, other, strict=True)] for one, other in zip(low, high, strict=True)]


def _dampings(sampler: Sampler, grid: Grid, source: str, lengths: dict[str, float]) -> list[str]:
    """The groups of the dampings, as far as the model has rates and a speed."""
    parts, roles = [], sampler.roles
    speed = roles.find("speed")
    for axis, rate, length in (("roll", "p", "span"), ("pitch", "q", "chord"), ("yaw", "r", "span")):
        variable = roles.find(rate)
        if not (variable and variable.is_input and speed and roles.find(axis)):
            continue
        turned = RATE * roles.scale(rate)
        low, high = (sampler.tables([axis], grid, {variable.identifier: sign * turned})[0] for sign in (-1.0, 1.0))
        by_rate = 1.0 / (2.0 * RATE * lengths[length] / (2.0 * SPEED))
        parts.append(_table(f"moments.{axis}_damping", source, grid, _difference(low, high, by_rate)))
    return parts


def _surfaces(
    sampler: Sampler,
    static: dict[str, Rows],
    grid: Grid,
    surfaces: dict[str, str],
    source: str,
    options: argparse.Namespace,
) -> str:
    limits, tables = [], []
    for name, identifier in surfaces.items():
        variable = sampler.model.variables[identifier]
        scale = scaled(variable, "deg", f'surface "{name}"')
        low, high = (end / scale for end in variable.limits)
        low, high = max(low, options.deflection[0]), min(high, options.deflection[1])
        if not low <= 0.0 <= high:
            raise DaveError(f'line {variable.node.line}: the limits of "{name}" must hold 0')
        limits.append((low, high))
        points = sorted({round(low + (high - low) * i / (STEPS - 1), 9) for i in range(STEPS)} | {0.0})
        parts = [sampler.tables(list(static), grid, {identifier: point * scale}) for point in points]
        for i, axis in enumerate(static):
            changes = [_difference(static[axis], part[i], 1.0) for part in parts]
            if max(abs(value) for part in changes for row in part for value in row) < 1e-12:
                continue
            body = ",\n".join("    [" + ", ".join(written(row) for row in part) + "]" for part in changes)
            tables.append(
                f'[[surfaces.table]]\nsurface = {quoted(name)}\naxis = "{axis}"\nsource = {source}\nalpha_deg = {written(grid[0])}\n'
                f"mach = {written(grid[1])}\ndeflection_deg = {written(points)}\nvalues = [\n{body},\n]\n"
            )
    names = ", ".join(quoted(name) for name in surfaces)
    head = (
        f'[surfaces]\nsource = {source}\nnames = [{names}]\nmin_deg = {written(low for low, _ in limits)}\n'
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
    try:
        if ":" in text:
            begin, end, step = (finite(part) for part in text.split(":"))
            count = round((end - begin) / step) if step > 0.0 else -1
            if count < 0 or abs(begin + count * step - end) > 1e-6 * step:
                raise argparse.ArgumentTypeError(f'"{text}": steps of {step:g} from {begin:g} do not reach {end:g}')
            return [round(begin + i * step, 9) for i in range(count + 1)]
        points = [finite(part) for part in text.split(",")]
    except ValueError:
        raise argparse.ArgumentTypeError(f'"{text}" is not of the form 0:40:4 or 0,10,30') from None
    if points != sorted(set(points)):
        raise argparse.ArgumentTypeError(f'"{text}" does not increase')
    return points


def positive(text: str) -> float:
    try:
        value = finite(text)
    except ValueError:
        value = 0.0
    if value <= 0.0:
        raise argparse.ArgumentTypeError(f'"{text}" is no positive number')
    return value


def pairs(written_pairs: list[str], form: str = "NAME=VARID") -> dict[str, str]:
    for pair in written_pairs:
        if "=" not in pair:
            raise DaveError(f'"{pair}" is not of the form {form}')
    return {name.strip(): value.strip() for name, _, value in (pair.rpartition("=") for pair in written_pairs)}


def surfaces_of(model: Model, told: dict[str, str], fixed: Iterable[str]) -> dict[str, str]:
    """Names and identifiers of the inputs that deflect surfaces: as told, or else as far as the model says so,
    without those that are set."""
    found = {}
    for name, identifier in told.items():
        variable = model.find(identifier)
        if variable is None or not variable.is_input:
            raise DaveError(f'--surface "{name}": there is no input "{identifier}" in the model')
        found[name] = variable.identifier
    if not told:
        settled = [model.find(name) for name in fixed]
        for variable in model.variables.values():
            is_deflection = "deflection" in variable.name.lower()
            is_angle = variable.node.one("isControl") and factor(variable.units, "deg") is not None
            if variable.is_input and variable not in settled and (is_deflection or is_angle):
                found[variable.name] = variable.identifier
    if len(found) > MOST_SURFACES:
        raise DaveError(f"there are {len(found)} surfaces, but a vehicle has at most {MOST_SURFACES}: choose them by --surface")
    for name, identifier in found.items():
        scaled(model.variables[identifier], "deg", f'surface "{name}"')
    return found


def warn_of_moments(sampler: Sampler) -> None:
    """Says that the moments are taken about the centre of mass, and what the model says of their point."""
    told = []
    for variable in sampler.model.variables.values():
        name = "".join(c for c in f"{variable.name} {variable.identifier}".lower() if c.isalnum())
        if "mrc" in name or "momentreference" in name:
            try:
                value = f"{sampler.model.evaluate(sampler.fixed)(variable.identifier):.9g} {variable.units}".strip()
            except DaveError:
                value = "without a value"
            told.append(f"{variable.name} = {value}")
    says = f"; the model says: {', '.join(told)}" if told else ""
    print(
        f"warning: without --moment-point the moments are taken to be about the centre of mass{says}", file=sys.stderr
    )


def arguments() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser("python -m reentry_fmus.daveml", description=(__doc__ or "").partition("\n\n")[0])
    parser.add_argument("model", help="file in DAVE-ML")
    parser.add_argument("-o", "--output", type=Path, help="file of the vehicle, in TOML; without it only the check cases are evaluated")
    parser.add_argument("--check", action="store_true", help="only evaluate the check cases")
    parser.add_argument("--force", action="store_true", help="convert although a check case is wrong")
    parser.add_argument("--alpha", type=grid_of, help="angles of attack in deg, as 0:40:4, 0,10,30 or --alpha=-20:20:5; by default the model's breakpoints")
    parser.add_argument("--mach", type=grid_of, help="Mach numbers, as --alpha")
    parser.add_argument("--set", action="append", default=[], metavar="VARID=VALUE", help="value of another input, in its own unit, once for each")
    parser.add_argument("--map", action="append", default=[], metavar="ROLE=VARID", help="variable of a role, as lift=CL")
    parser.add_argument("--surface", action="append", default=[], metavar="NAME=VARID", help="input that deflects a surface, once for each; by default all inputs that are controls or deflections")
    parser.add_argument("--deflection", nargs=2, type=finite, default=[-30.0, 30.0], help="widest limits of the deflections, deg")
    parser.add_argument("--rate", type=positive, default=20.0, help="largest deflection rate, deg/s")
    parser.add_argument("--mass", type=positive, help="mass, kg")
    parser.add_argument("--inertia", type=finite, nargs=4, metavar=("IXX", "IYY", "IZZ", "IXZ"), help="kg m2")
    for name, unit in (("area", "m2"), ("span", "m"), ("chord", "m")):
        parser.add_argument(f"--{name}", type=positive, help=f"reference {name}, {unit}")
    parser.add_argument("--moment-point", nargs=3, type=finite, metavar=("X", "Y", "Z"), help="point of the moments from the centre of mass, m")
    return parser


def _default(sampler: Sampler, role: str, otherwise: list[float]) -> list[float]:
    points = sampler.breakpoints(role)
    if len(points) > 1:
        return points
    print(f"no table of the model has breakpoints of {role}: give --{role}, if the following do not suffice")
    return otherwise


def _write(model: Model, options: argparse.Namespace) -> None:
    roles, fixed = Roles(model, pairs(options.map)), pairs(options.set, "VARID=VALUE")
    surfaces = surfaces_of(model, pairs(options.surface), fixed)
    for role, variable in [(role, roles.find(role)) for role in ROLES]:
        print(f"{role}: {variable.identifier if variable else 'none'}")
    print("surfaces: " + (", ".join(f"{name} = {identifier}" for name, identifier in surfaces.items()) or "none"))
    sampler = Sampler(model, roles, surfaces.values(), fixed)
    for variable in sampler.initial():
        print(f"initial value: {variable.identifier} ({variable.name}) = {variable.initial:.9g} {variable.units}".rstrip())
    if options.moment_point is None:
        warn_of_moments(sampler)
    grid = (
        options.alpha or _default(sampler, "alpha", ALPHAS),
        options.mach or _default(sampler, "mach", MACHS),
    )
    print(f"angles of attack, deg: {written(grid[0])}\nMach numbers: {written(grid[1])}")
    for name, difference, alpha, mach in sampler.between(grid):
        print(f"half-way between grid points {name} differs by {difference:.3g} at most, at {alpha:g} deg and Mach {mach:g}")
    text = convert(sampler, grid, surfaces, options)
    options.output.write_text(text, encoding="utf-8")
    print(f"{options.output}: written")


def main(words: list[str] | None = None) -> int:
    """Runs the command. Returns its exit code: 1 if a check case is wrong, 2 if the model cannot be used."""
    options = arguments().parse_args(words)
    try:
        if options.output and options.output.exists() and options.output.samefile(options.model):
            raise DaveError("-o names the model itself")
        model = Model(Path(options.model))
        is_right = report(model.check()) if model.shots else print("the model has no check cases") is None
        if not is_right and not options.force:
            return 1
        if options.output and not options.check:
            _write(model, options)
    except (DaveError, ValueError, OSError) as error:
        print(f"{options.model}: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
