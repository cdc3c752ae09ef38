"""Writes the reference of the experiment `reversal/shaped`: a bank angle from -60 deg to 60 deg whose rate is a
trapezoid of at most 4.2 deg/s with slopes of 1 deg/s2, at a constant angle of attack of 35 deg.

    python scripts/oracles/reversal.py orchestrator/experiments/reversal/reversal.csv
"""

from __future__ import annotations

import sys
from pathlib import Path

START, END = -60.0, 60.0
"""Bank angle, deg."""
RATE, ACCELERATION = 4.2, 1.0
"""Largest rate, deg/s, and slope of the rate, deg/s2."""
RAMP = RATE / ACCELERATION
"""Duration of a slope, s."""
CRUISE = (END - START) / RATE - RAMP
"""Duration of the constant rate, s."""
STEP = 0.1
"""Time between two rows, s. Between them the bank angle is a straight line: it is off by 1/800 deg at most."""


ENDS = [round(end, 6) for end in (RAMP, RAMP + CRUISE, 2 * RAMP + CRUISE)]
"""Ends of the slope, of the constant rate, and of the other slope, s."""


def motion(time: float, phase: int) -> tuple[float, float, float]:
    """Bank angle (deg), its rate (deg/s) and acceleration (deg/s2) at a time (s) of a phase."""
    left = 2 * RAMP + CRUISE - time
    return [
        (START + ACCELERATION * time**2 / 2, ACCELERATION * time, ACCELERATION),
        (START + RATE * (time - RAMP / 2), RATE, 0.0),
        (END - ACCELERATION * left**2 / 2, ACCELERATION * left, -ACCELERATION),
        (END, 0.0, 0.0),
    ][phase]


def table() -> str:
    """The reference as a lookup table. The acceleration jumps where two rows have the same time."""
    angles = "external.alpha [deg],external.beta [deg],external.sigma [deg]"
    lines = [f"time,{angles},externalRate.sigma [deg/s],externalAcceleration.sigma [deg/s2]"]
    grid = [round(k * STEP, 6) for k in range(int(ENDS[-1] / STEP) + 1)]
    for phase, (begin, end) in enumerate(zip([0.0, *ENDS], [*ENDS, ENDS[-1]], strict=True)):
        for time in sorted({begin, *(time for time in grid if begin < time < end), end}):
            sigma, rate, acceleration = motion(time, phase)
            lines.append(f"{time:.10g},35,0,{sigma:.10g},{rate:.10g},{acceleration:.10g}")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(table(), encoding="utf-8")
