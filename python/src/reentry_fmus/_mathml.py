"""Formulas in content MathML, as the calculations of DAVE-ML models have them."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from itertools import pairwise

from ._xml import Node

Values = Callable[[str], float]
"""Returns the value of the variable with an identifier."""

Formula = Callable[[Values], float]


class DaveError(ValueError):
    """A DAVE-ML file has a fault, or uses what is not supported. The message names the line."""


def refuse(node: Node, problem: str) -> DaveError:
    return DaveError(f"line {node.line}, <{node.tag}>: {problem}")


def _root(value: float, degree: float = 2.0) -> float:
    is_odd = degree == round(degree) and round(degree) % 2
    if value < 0.0 and is_odd:
        return -math.pow(-value, 1.0 / degree)
    return math.sqrt(value) if degree == 2.0 else math.pow(value, 1.0 / degree)


def _minus(value: float, *other: float) -> float:
    return value - other[0] if other else -value


UNARY: dict[str, Callable[[float], float]] = {
    "abs": abs,
    "exp": math.exp,
    "ln": math.log,
    "floor": math.floor,
    "ceiling": math.ceil,
    "not": lambda value: float(not value),
    **{name: getattr(math, name) for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh")},
    **{f"arc{name}": getattr(math, f"a{name}") for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh")},
    "sec": lambda value: 1.0 / math.cos(value),
    "csc": lambda value: 1.0 / math.sin(value),
    "cot": lambda value: 1.0 / math.tan(value),
}
BINARY: dict[str, Callable[[float, float], float]] = {
    "divide": operator.truediv,
    "power": math.pow,
    "rem": math.fmod,
    # A real division, as in the reference files of the schema: 6/5 is 1.2.
    "quotient": operator.truediv,
    "atan2": math.atan2,
}
SEVERAL: dict[str, Callable[..., float]] = {
    "plus": lambda *values: float(sum(values)),
    "times": lambda *values: math.prod(values),
    "minus": _minus,
    "min": min,
    "max": max,
    "and": lambda *values: float(all(values)),
    "or": lambda *values: float(any(values)),
    "xor": lambda *values: float(sum(map(bool, values)) % 2),
}
RELATIONS: dict[str, Callable[[float, float], bool]] = {
    name: getattr(operator, python)
    for name, python in {"lt": "lt", "gt": "gt", "leq": "le", "geq": "ge", "eq": "eq", "neq": "ne"}.items()
}
CONSTANTS = {
    "pi": math.pi,
    "exponentiale": math.e,
    "true": 1.0,
    "false": 0.0,
    "infinity": math.inf,
    "notanumber": math.nan,
}


def formula(node: Node) -> Formula:
    """Returns the function of a MathML element.

    Raises:
        DaveError: the element is not supported.
    """
    if node.tag in ("math", "semantics", "calculation"):
        parts = [child for child in node.children if not child.tag.startswith("annotation")]
        if not parts or (len(parts) > 1 and node.tag != "semantics"):
            raise refuse(node, f"it has {len(parts)} formulas; it needs one")
        return formula(parts[0])
    if node.tag == "ci":
        name = node.text.strip()
        return lambda values: values(name)
    if node.tag == "cn":
        number = _number(node)
        return lambda _: number
    if node.tag in CONSTANTS:
        constant = CONSTANTS[node.tag]
        return lambda _: constant
    if node.tag == "piecewise":
        return _piecewise(node)
    if node.tag in ("apply", "reln"):
        return _applied(node)
    raise refuse(node, "this element of MathML is not supported")


def _number(node: Node) -> float:
    parts = [part.strip() for part in node.parts if part.strip()]
    kind = node.attributes.get("type", "real")
    try:
        if kind == "e-notation" and len(parts) == 2:
            return float(f"{parts[0]}e{parts[1]}")
        if kind == "rational" and len(parts) == 2:
            return float(parts[0]) / float(parts[1])
        return float(node.text.strip().replace("D", "e").replace("d", "e"))
    except (ValueError, ZeroDivisionError):
        raise refuse(node, f'"{node.text.strip()}" is no number') from None


def _piecewise(node: Node) -> Formula:
    pieces: list[tuple[Formula, Formula]] = []
    otherwise: Formula | None = None
    for child in node.children:
        if child.tag == "piece" and len(child.children) == 2:
            pieces.append((formula(child.children[0]), formula(child.children[1])))
        elif child.tag == "otherwise" and len(child.children) == 1:
            otherwise = formula(child.children[0])
        else:
            raise refuse(child, "a piece has a value and a condition, and otherwise a value")

    def chosen(values: Values) -> float:
        for value, condition in pieces:
            if condition(values):
                return value(values)
        if otherwise is None:
            raise refuse(node, "no condition holds, and there is no <otherwise>")
        return otherwise(values)

    return chosen


def _applied(node: Node) -> Formula:
    if not node.children:
        raise refuse(node, "it lacks an operator")
    head, *rest = node.children
    if head.tag in ("apply", "piecewise", "ci", "cn") and not rest:
        return formula(head)
    name = head.text.strip() if head.tag == "csymbol" else head.tag
    given = {child.tag: formula(child.children[0]) for child in rest if child.tag in ("degree", "logbase") and child.children}
    inside = [formula(child) for child in rest if child.tag not in ("degree", "logbase")]
    count = len(inside)

    def needs(number: int) -> None:
        if count != number:
            raise refuse(head, f"it has {count} arguments; it needs {number}")

    if name in UNARY:
        needs(1)
        one, only = UNARY[name], inside[0]
        return lambda values: one(only(values))
    if name in BINARY:
        needs(2)
        two, (left, right) = BINARY[name], inside
        return lambda values: two(left(values), right(values))
    if name in SEVERAL:
        if not count or (name == "minus" and count > 2):
            needs(2 if name == "minus" else 1)
        several = SEVERAL[name]
        return lambda values: several(*(part(values) for part in inside))
    if name in RELATIONS:
        relation = RELATIONS[name]
        return lambda values: float(all(relation(a, b) for a, b in pairwise([part(values) for part in inside])))
    if name == "root":
        needs(1)
        degree = given.get("degree")
        return lambda values: _root(inside[0](values), degree(values) if degree else 2.0)
    if name == "log":
        needs(1)
        base = given.get("logbase")
        if base is None:
            return lambda values: math.log10(inside[0](values))
        return lambda values: math.log(inside[0](values), base(values))
    raise refuse(head, f'the operator "{name}" is not supported')
