"""Variables of FMUs for tables, from the committed descriptions, which follow from the declarations in Rust."""

import math
import re
from pathlib import Path
from xml.etree import ElementTree

ROOT = Path(__file__).resolve().parents[2]
AXES = [["alpha", "beta", "sigma"], ["p", "q", "r"], ["x", "y", "z"], ["north", "east", "down"]]


def description(name):
    [file] = ROOT.glob(f"*/generated/{name}.xml")
    return ElementTree.parse(file).getroot()


def number(text, unit):
    value = float(text) * (180 / math.pi if unit.startswith("rad") else 1)
    return f"{value:.7g}".replace("-", "−")


def rows(root, causality="parameter"):
    """Yields name, start, range, unit and meaning of each parameter, or input, or output."""
    types = {item.get("name"): item for item in root.iter("SimpleType")}
    for variable in root.iter("ScalarVariable"):
        if variable.get("causality") != causality:
            continue
        kind = variable[0]
        unit, text = kind.get("unit", ""), variable.get("description")
        ends = [kind.get("min"), kind.get("max")]
        shown = unit.replace("rad", "deg", 1) if unit.startswith("rad") else unit
        if kind.tag == "Enumeration":
            items = types[kind.get("declaredType")].findall("Enumeration/Item")
            start = kind.get("start") and f"`{items[int(kind.get('start')) - 1].get('name')}`"
            text += ". " + "; ".join(f"`{item.get('name')}`: {item.get('description')}" for item in items)
            ends = [None, None]
        elif kind.tag in ("Boolean", "String"):
            start = kind.get("start") or "empty"
        else:
            start = kind.get("start")
            start = start and (number(start, unit) if kind.tag == "Real" else start)
            ends = [end and (number(end, unit) if kind.tag == "Real" else end) for end in ends]
        low, high = ends
        span = f"{low} to {high}" if low and high else f"from {low}" if low else f"up to {high}" if high else ""
        yield variable.get("name"), start, span, shown, text.replace("|", "\\|")


def pattern(name):
    """Returns the name without what distinguishes the entries of a vector, and this ending."""
    if match := re.fullmatch(r"(.*?)(\[[\d,]+\])", name):
        return match.group(1), match.group(2)
    stem, _, last = name.rpartition(".")
    return (stem, last) if any(last in axes for axes in AXES) else (name, "")


def without_index(condition, ending):
    """Returns a condition for the entry k of a vector, or for column k of a matrix."""
    index = ending.strip("[]").rpartition(",")[2]
    return re.sub(rf"(\[|>= ){index}(?=\]|$)", r"\1k", condition) if index.isdigit() else condition


def shared(text, ending):
    """Returns the part of a description that the entries of a vector share."""
    own, _, condition = text.partition("; used with ")
    own = re.sub(r" \([^()]*\)$", "", own) if ending else own
    return f"{own}; used with {without_index(condition, ending)}" if condition else own


def joined(stem, endings):
    """Returns the name for the entries of a vector with these endings."""
    if endings[0] and not endings[0].startswith("["):
        return f"`{stem}.{'/'.join(endings)}`"
    return f"`{stem}{endings[0]}`" + (f"…`{endings[-1]}`" if len(endings) > 1 else "")


def grouped(variables):
    """Joins the entries of vectors: returns what they share, and the ending and start of each."""
    groups = []
    for name, start, span, unit, text in variables:
        stem, ending = pattern(name)
        meaning = shared(text, ending)
        key = (stem, span, unit, meaning, bool(ending))
        if ending and groups and groups[-1][0] == key:
            groups[-1][1].append((ending, start))
        else:
            groups.append((key, [(ending, start)]))
    return groups
