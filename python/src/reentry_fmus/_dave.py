"""Models in DAVE-ML (AIAA S-119): variables, tables, functions and their check cases."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from ._mathml import DaveError, Formula, formula, refuse
from ._units import factor
from ._xml import Node, parse

INTERPOLATIONS = ("linear", "discrete", "floor", "ceiling")


def numbers(node: Node) -> list[float]:
    """The numbers of a list, separated by commas or blanks."""
    try:
        return [float(word) for word in node.text.replace(",", " ").split()]
    except ValueError as error:
        raise refuse(node, str(error)) from None


def required(node: Node, name: str) -> str:
    if name not in node.attributes:
        raise refuse(node, f'it lacks the attribute "{name}"')
    return node.attributes[name].strip()


def number(node: Node, name: str, otherwise: float) -> float:
    text = node.attributes.get(name, "").strip()
    try:
        return float(text) if text else otherwise
    except ValueError:
        raise refuse(node, f'{name} = "{text}" is no number') from None


@dataclass
class Variable:
    """A variable of the model."""

    identifier: str
    name: str
    units: str
    node: Node
    initial: float | None
    limits: tuple[float, float]
    is_output: bool
    formula: Formula | None = None
    needs: set[str] = field(default_factory=set)
    """Variables of which it is calculated."""

    @property
    def is_input(self) -> bool:
        return self.formula is None


@dataclass
class Axis:
    """An argument of a table."""

    variable: str
    points: list[float]
    limits: tuple[float, float]
    extrapolate: str
    interpolate: str

    def place(self, value: float) -> tuple[int, float]:
        """Index of the point below a value, and the share of the way to the next."""
        points, value = self.points, min(max(value, self.limits[0]), self.limits[1])
        if len(points) == 1:
            return 0, 0.0
        below = min(max(bisect_right(points, value) - 1, 0), len(points) - 2)
        share = (value - points[below]) / (points[below + 1] - points[below])
        if share < 0.0 and self.extrapolate not in ("min", "both") or self.interpolate != "linear":
            share = max(share, 0.0)
        if share > 1.0 and self.extrapolate not in ("max", "both") or self.interpolate != "linear":
            share = min(share, 1.0)
        if self.interpolate != "linear":
            rounded = {"discrete": math.floor(share + 0.5), "floor": math.floor(share), "ceiling": math.ceil(share)}
            share = float(rounded[self.interpolate])
        return below, share


def interpolated(axes: list[Axis], values: list[float]) -> Formula:
    """The multilinear function of a table, whose last argument varies fastest."""
    strides = [math.prod(len(axis.points) for axis in axes[i + 1 :]) for i in range(len(axes))]

    def at(inputs: Callable[[str], float]) -> float:
        corners = [(0, 1.0)]
        for axis, stride in zip(axes, strides, strict=True):
            below, share = axis.place(inputs(axis.variable))
            ends = [(below, 1.0 - share), (below + 1, share)]
            corners = [(start + i * stride, weight * part) for start, weight in corners for i, part in ends if part]
        return sum(weight * values[index] for index, weight in corners)

    return at


@dataclass
class Signal:
    """A value of a check case."""

    name: str
    units: str
    value: float
    tolerance: float | None
    node: Node


@dataclass
class Shot:
    """A static check case."""

    name: str
    inputs: list[Signal] = field(default_factory=list)
    internal: list[Signal] = field(default_factory=list)
    outputs: list[Signal] = field(default_factory=list)


@dataclass
class Difference:
    """A value of a check case beside that of the model."""

    shot: str
    signal: str
    expected: float
    value: float
    tolerance: float
    is_required: bool

    @property
    def is_kept(self) -> bool:
        return abs(self.value - self.expected) <= self.tolerance


class Model:
    """A DAVE-ML model that can be evaluated.

    Raises:
        DaveError: the file has a fault, or uses what is not supported.
    """

    def __init__(self, path: Path):
        root = parse(path)
        if root.tag != "DAVEfunc":
            raise refuse(root, "the root of a DAVE-ML file is <DAVEfunc>")
        self.variables: dict[str, Variable] = {}
        self.breakpoints: dict[str, list[float]] = {}
        self.tables: dict[str, Node] = {}
        self.axes: list[Axis] = []
        self.shots: list[Shot] = []
        header = root.one("fileHeader")
        self.title = header.attributes.get("name", path.stem) if header else path.stem
        used = ("variableDef", "breakpointDef", "griddedTableDef", "function", "checkData")
        told = ("fileHeader", "description", "documentation", "provenance", "reference", "modificationRecord")
        for node in root.children:
            if node.tag not in used + told:
                raise refuse(node, "it is not supported")
        for node in root.all("variableDef"):
            self._variable(node)
        for node in root.all("breakpointDef"):
            points = node.one("bpVals")
            self.breakpoints[required(node, "bpID")] = self._increasing(node, numbers(points or node))
        for node in root.all("griddedTableDef"):
            self.tables[required(node, "gtID")] = node
        for variable in self.variables.values():
            self._collect_names(variable, variable.node)
        for node in root.all("function"):
            self._function(node)
        for checks in root.all("checkData"):
            self.shots += [self._shot(node) for node in checks.all("staticShot")]

    def _variable(self, node: Node) -> None:
        name = required(node, "varID")
        initial = number(node, "initialValue", math.nan)
        calculation = node.one("calculation")
        self.variables[name] = Variable(
            name,
            node.attributes.get("name", name).strip(),
            node.attributes.get("units", "").strip(),
            node,
            None if math.isnan(initial) else initial,
            (number(node, "minValue", -math.inf), number(node, "maxValue", math.inf)),
            node.one("isOutput") is not None,
            formula(calculation) if calculation else None,
        )

    def _increasing(self, node: Node, points: list[float]) -> list[float]:
        if not points or any(a >= b for a, b in zip(points, points[1:], strict=False)):
            raise refuse(node, "its values must increase, one at least")
        return points

    def _known(self, node: Node, name: str) -> str:
        if name not in self.variables:
            raise refuse(node, f'there is no variable "{name}"')
        return name

    def _collect_names(self, variable: Variable, node: Node) -> None:
        """Notes the variables of a calculation, and refuses one that does not exist."""
        for child in node.children:
            if child.tag == "ci":
                variable.needs.add(self._known(child, child.text.strip()))
            self._collect_names(variable, child)

    def _function(self, node: Node) -> None:
        axes = [self._axis(child) for child in node.all("independentVarRef", "independentVarPts")]
        result = node.one("dependentVarRef", "dependentVarPts")
        if result is None or not axes:
            raise refuse(node, "it needs arguments and a result")
        target = self._known(result, required(result, "varID"))
        if result.tag == "dependentVarPts":
            values = numbers(result)
        else:
            definition = node.one("functionDefn")
            table = definition.children[-1] if definition and definition.children else node
            if table.tag == "griddedTableRef":
                identifier = required(table, "gtID")
                if identifier not in self.tables:
                    raise refuse(table, f'there is no table "{identifier}"')
                table = self.tables[identifier]
            elif table.tag not in ("griddedTableDef", "griddedTable"):
                raise refuse(table, "it is not supported; a function needs a gridded table")
            values = self._table(table, axes)
        size = math.prod(len(axis.points) for axis in axes)
        if len(values) != size:
            raise refuse(node, f"its table has {len(values)} values; its breakpoints need {size}")
        if self.variables[target].formula is not None:
            raise refuse(node, f'the variable "{target}" is calculated twice')
        self.variables[target].formula = interpolated(axes, values)
        self.variables[target].needs |= {axis.variable for axis in axes}
        self.axes += axes

    def _axis(self, node: Node) -> Axis:
        interpolate = node.attributes.get("interpolate", "linear")
        if interpolate not in INTERPOLATIONS:
            raise refuse(node, f'interpolate = "{interpolate}" is not supported')
        name = self._known(node, required(node, "varID"))
        points = self._increasing(node, numbers(node)) if node.tag == "independentVarPts" else []
        limits = (number(node, "min", -math.inf), number(node, "max", math.inf))
        return Axis(name, points, limits, node.attributes.get("extrapolate", "neither"), interpolate)

    def _table(self, table: Node, axes: list[Axis]) -> list[float]:
        """The values of a table, whose breakpoints become those of the arguments."""
        references, data = table.one("breakpointRefs"), table.one("dataTable")
        names = [required(child, "bpID") for child in references.all("bpRef")] if references else []
        if data is None or len(names) != len(axes):
            raise refuse(table, f"it has {len(names)} breakpoints for {len(axes)} arguments, or no data")
        for axis, name in zip(axes, names, strict=True):
            if name not in self.breakpoints:
                raise refuse(table, f'there are no breakpoints "{name}"')
            axis.points = self.breakpoints[name]
        return numbers(data)

    def _shot(self, node: Node) -> Shot:
        shot = Shot(node.attributes.get("name", f"line {node.line}"))
        parts = {"checkInputs": shot.inputs, "internalValues": shot.internal, "checkOutputs": shot.outputs}
        for child in node.children:
            if child.tag in parts:
                parts[child.tag] += [self._signal(signal) for signal in child.all("signal")]
        return shot

    def _signal(self, node: Node) -> Signal:
        name, value = node.one("varID", "signalID", "signalName"), node.one("signalValue")
        units, tolerance = node.one("signalUnits"), node.one("tol")
        if name is None or value is None:
            raise refuse(node, "it needs a name and a value")
        allowed = numbers(tolerance)[0] if tolerance else None
        return Signal(name.text.strip(), units.text.strip() if units else "", numbers(value)[0], allowed, node)

    def find(self, name: str) -> Variable | None:
        """The variable with an identifier or a name."""
        if name in self.variables:
            return self.variables[name]
        for variable in self.variables.values():
            if name in (variable.name, f"{variable.name}_{variable.units}", variable.node.attributes.get("symbol")):
                return variable
        return None

    def behind(self, identifiers: Iterable[str]) -> set[str]:
        """These variables, and all of which they are calculated."""
        found: set[str] = set()
        waiting = list(identifiers)
        while waiting:
            if (name := waiting.pop()) not in found:
                found.add(name)
                waiting += self.variables[name].needs
        return found

    def evaluate(self, inputs: Mapping[str, float]) -> Callable[[str], float]:
        """Returns the function that gives the value of every variable for some inputs, by their
        identifiers. Inputs that are left out have their initial values."""
        known: dict[str, float] = {}
        under_way: list[str] = []

        def value(name: str) -> float:
            if name in known:
                return known[name]
            variable = self.variables[name]
            if name in under_way:
                raise refuse(variable.node, f"it depends on itself: {' <- '.join([*under_way, name])}")
            under_way.append(name)
            if name in inputs:
                found = inputs[name]
            elif variable.formula is not None:
                try:
                    found = variable.formula(value)
                except (ValueError, ArithmeticError) as error:
                    if isinstance(error, DaveError):
                        raise
                    raise refuse(variable.node, f'"{name}" cannot be calculated: {error}') from None
            elif variable.initial is not None:
                found = variable.initial
            else:
                raise refuse(variable.node, f'"{name}" is an input without a value')
            under_way.pop()
            known[name] = min(max(found, variable.limits[0]), variable.limits[1])
            return known[name]

        return value

    def check(self) -> list[Difference]:
        """Evaluates all static check cases, and returns every value that they state."""
        found = []
        for shot in self.shots:
            inputs = {}
            for signal in shot.inputs:
                variable = self._named(signal)
                inputs[variable.identifier] = signal.value * self._scale(signal, variable)
            value = self.evaluate(inputs)
            for signal in shot.internal + shot.outputs:
                variable = self._named(signal)
                scale = self._scale(signal, variable)
                expected = signal.value * scale
                # Without a tolerance, printed digits are compared.
                tolerance = signal.tolerance * scale if signal.tolerance is not None else 1e-4 * max(1.0, abs(expected))
                is_required = signal.tolerance is not None or signal in shot.outputs
                found.append(Difference(shot.name, signal.name, expected, value(variable.identifier), tolerance, is_required))
        return found

    def _named(self, signal: Signal) -> Variable:
        variable = self.find(signal.name)
        if variable is None:
            raise refuse(signal.node, f'there is no variable "{signal.name}"')
        return variable

    def _scale(self, signal: Signal, variable: Variable) -> float:
        """Factor from the unit of a signal to that of its variable. Without a unit it has that of the variable."""
        scale = factor(signal.units, variable.units) if signal.units else 1.0
        if scale is None:
            raise refuse(
                signal.node, f'"{signal.name}" has the unit "{signal.units}", which cannot be converted to "{variable.units}"'
            )
        return scale
