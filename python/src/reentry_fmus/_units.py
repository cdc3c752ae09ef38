"""Units by the names that DAVE-ML models use."""

from __future__ import annotations

import math

NONE = "nd"
# Factors to one unit of each kind, by the names that models use.
UNITS = {
    **dict.fromkeys(("rad", "r", "radian", "radians"), ("angle", 1.0)),
    **dict.fromkeys(("deg", "d", "degree", "degrees"), ("angle", math.pi / 180.0)),
    **dict.fromkeys(("m",), ("length", 1.0)),
    **dict.fromkeys(("ft", "f"), ("length", 0.3048)),
    **dict.fromkeys(("in",), ("length", 0.0254)),
    **dict.fromkeys(("m2", "m^2"), ("area", 1.0)),
    **dict.fromkeys(("ft2", "f2", "ft^2", "sqft"), ("area", 0.3048**2)),
    **dict.fromkeys(("m_s", "m/s", "m_s-1"), ("speed", 1.0)),
    **dict.fromkeys(("ft_s", "f_s", "ft/s", "ft/sec", "f_s-1", "fs-1", "fps"), ("speed", 0.3048)),
    **dict.fromkeys(("kn", "kt", "knots"), ("speed", 1852.0 / 3600.0)),
    **dict.fromkeys(("rad_s", "r_s", "rad/s", "r_s-1", "rad_s-1", "rs-1", "rad/sec"), ("rate", 1.0)),
    **dict.fromkeys(("deg_s", "d_s", "deg/s", "d_s-1", "deg_s-1", "deg/sec"), ("rate", math.pi / 180.0)),
    **dict.fromkeys(("kg",), ("mass", 1.0)),
    **dict.fromkeys(("slug", "slugs", "sl"), ("mass", 0.45359237 * 9.80665 / 0.3048)),
    **dict.fromkeys(("lbm",), ("mass", 0.45359237)),
    **dict.fromkeys(("kgm2", "kg_m2", "kg-m2"), ("inertia", 1.0)),
    **dict.fromkeys(("psf", "lbf_ft2", "lbf/ft2"), ("pressure", 1.0)),
    **dict.fromkeys(("_rad", "rad-1", "r-1", "1/rad"), ("per angle", 1.0)),
    **dict.fromkeys(("_deg", "deg-1", "d-1", "1/deg"), ("per angle", 180.0 / math.pi)),
    **dict.fromkeys(("s_rad", "s_r", "sr-1"), ("per rate", 1.0)),
    **dict.fromkeys(("", NONE, "none", "nondimensional", "dimensionless", "unitless", "-", "1", "frac"), ("number", 1.0)),
    **dict.fromkeys(("pct", "%"), ("number", 0.01)),
    **dict.fromkeys(("slugft2", "slug_ft2", "slug-ft2"), ("inertia", 0.45359237 * 9.80665 * 0.3048)),
}


def factor(given: str, wanted: str) -> float | None:
    """Factor from one unit to another; none if they differ and are not known, or
    are of different kinds."""
    given, wanted = given.strip().lower(), wanted.strip().lower()
    if given == wanted:
        return 1.0
    one, other = UNITS.get(given), UNITS.get(wanted)
    return one[1] / other[1] if one and other and one[0] == other[0] else None
