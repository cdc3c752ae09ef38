"""Units of measure of tables."""

from __future__ import annotations

import math
from typing import Literal

import pandas as pd

Units = Literal["si", "deg"]
"""Units of a table: "si", or "deg" for angles, rates and accelerations in degrees."""


def check_units(units: str) -> None:
    """Refuses unknown units of a table."""
    if units not in ("si", "deg"):
        raise ValueError(f'units are "si" or "deg", not {units!r}')


def convert(table: pd.DataFrame, units: Units) -> None:
    """Converts the columns in rad, rad/s and rad/s2 to degrees, if `units` says so. Expects the
    columns' units in `attrs["units"]` and changes them too."""
    if units == "si":
        return
    for name, unit in table.attrs["units"].items():
        if unit is not None and (unit == "rad" or unit.startswith("rad/")):
            table[name] = table[name] * (180.0 / math.pi)
            table.attrs["units"][name] = "deg" + unit.removeprefix("rad")
