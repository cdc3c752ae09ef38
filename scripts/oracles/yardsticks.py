"""Numbers against which the experiments of Chai 2022 are measured, computed from the paper's raw
data alone.

scripts/yardsticks writes them by this program. Times are in s, angles in deg.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import clairvoyant

RUN_LENGTHS = [25, 40, 50, 60, 80, 100]
SETS = {
    "printed": "x_omega and u within the sets (6)",
    "paper": "x_omega and u within the tightened sets (21), where the paper set keeps the nominal motion",
    "limits": "omega and m within the limits of section 5.1 themselves",
}
# K of section 5.2 is [k, k] on angle and rate of every axis.
CASES = {"case1": -5.0, "case2": -10.0}
FEEDBACK_PERIOD = 0.04
STATED_BOUND = 2.0
# Bound on Delta in deg/s2 to which the printed tubes of the angles belong (docs/errata.md).
PRINTED_BOUND = 1.0
HEADER = """\
# Yardsticks for the results of Chai 2022, computed from the paper's raw data. Written by scripts/yardsticks: change
# scripts/oracles/yardsticks.py, not this file.
"""


@dataclass(frozen=True)
class Value:
    """A number with its unit and its origin."""

    id: str
    value: float
    unit: str
    source: str


def least_ems(name: str, sets: str, note: str = "", **options) -> tuple[Value, clairvoyant.Motion]:
    """Computes the least EMS that was found. `options` are those of clairvoyant.optimum."""
    motion = clairvoyant.optimum(sets, **options)
    hold = options.get("hold", clairvoyant.COARSE)
    duration = options.get("duration", clairvoyant.DURATION)
    what = f"least EMS of {duration:g} s known beforehand without disturbance, a held {hold:g} s{note}; {SETS[sets]}"
    return Value(f"ems.clairvoyant.{name}", motion.ems, "deg", what), motion


def coarse_bounds() -> tuple[list[Value], dict[str, clairvoyant.Motion]]:
    """Computes all bounds with the input held 0.2 s, and the motions of the full run by their
    sets."""
    values, motions = [], {}
    for sets in SETS:
        value, motions[sets] = least_ems(sets, sets)
        values.append(value)
    for sets in SETS:
        note = ", EMS summed every 0.2 s"
        values.append(least_ems(f"{sets}.5Hz", sets, note, sampling=clairvoyant.COARSE)[0])
    for seconds in RUN_LENGTHS:
        values.append(least_ems(f"paper.{seconds}s", "paper", duration=float(seconds))[0])
    return values, motions


def lower_bounds() -> list[Value]:
    """Computes what no motion can go below, by the convex relaxation, with the input held for one
    communication step."""
    values = []
    for sets in SETS:
        ems = clairvoyant.optimum(sets, hold=clairvoyant.FINE, relaxed=True).ems
        what = f"no motion has a smaller EMS in 50 s with |beta| <= 10 deg: convex relaxation, a held {clairvoyant.FINE:g} s; {SETS[sets]}"
        values.append(Value(f"ems.relaxed.{sets}", ems, "deg", what))
    return values


def fine_bounds(motions: dict[str, clairvoyant.Motion]) -> list[Value]:
    """Computes the bounds with the input held for one communication step."""
    hold = clairvoyant.FINE
    return [least_ems(f"{sets}.fine", sets, hold=hold, guess=motions[sets])[0] for sets in SETS]


def step_response_peak(k1: float, k2: float) -> float:
    """c-bar of (21): the peak of (e^{st} - e^{ft})/(s - f), where s and f are the eigenvalues of
    the error dynamics."""
    slow, fast = np.sort(np.roots([1.0, -k2, -k1]))[::-1]
    peak = np.log(slow / fast) / (fast - slow)
    return float((np.exp(slow * peak) - np.exp(fast * peak)) / (slow - fast))


def sampled_reach(k1: float, k2: float, period: float) -> tuple[float, float]:
    """Bounds on angle and rate at the feedback ticks for |Delta| <= 1, held over each period: the
    L1 norms of the impulse responses."""
    gamma = np.array([0.5 * period**2, period])
    phi = np.array([[1.0, period], [0.0, 1.0]]) + np.outer(gamma, [k1, k2])
    assert np.abs(np.linalg.eigvals(phi)).max() < 1.0
    total, impulse = np.zeros(2), gamma
    while np.abs(impulse).max() > 1e-18:
        total += np.abs(impulse)
        impulse = phi @ impulse
    return float(total[0]), float(total[1])


def tubes() -> list[Value]:
    """Bounds on the deviation from the nominal motion for the two gains of section 5.2."""
    values = []
    for case, k in CASES.items():
        peak = step_response_peak(k, k)
        angle, rate = sampled_reach(k, k, FEEDBACK_PERIOD)
        gain, delta = f"K = [{k:g}, {k:g}]", f"Delta-bar = {STATED_BOUND:g} deg/s2"
        exact = f"{gain}, {delta}: L1 norm of the impulse response with K o sampled and held at 25 Hz, at the samples"
        printed = f"(26), {gain}: Delta-bar/|k1| with the {PRINTED_BOUND:g} deg/s2 that section 5.2's tube belongs to"
        corrected = f"{gain}, {delta}: 2 c-bar Delta-bar, for a Delta that varies with time"
        for name, value, unit, source in [
            ("angle.printed", PRINTED_BOUND / abs(k), "deg", printed),
            ("angle.stated", STATED_BOUND / abs(k), "deg", f"(26), {gain}: Delta-bar/|k1| with {delta}"),
            ("angle.exact", STATED_BOUND * angle, "deg", exact),
            ("rate.printed", STATED_BOUND * peak, "deg/s", f"(26), {gain}, {delta}: c-bar Delta-bar, for a constant Delta"),
            ("rate.corrected", STATED_BOUND * 2.0 * peak, "deg/s", corrected),
            ("rate.exact", STATED_BOUND * rate, "deg/s", exact),
        ]:
            values.append(Value(f"tube.{case}.{name}", value, unit, source))
    return values


def toml(values: list[Value]) -> str:
    """Returns the values in the form that the orchestrator reads."""
    entries = [
        f'[[value]]\nid = "{v.id}"\nvalue = {v.value!r}\nunit = "{v.unit}"\nkind = "computed"\n'
        f'source = "scripts/yardsticks: {v.source}"\n'
        for v in values
    ]
    return "\n".join([HEADER, *entries])


def main() -> None:
    coarse, motions = coarse_bounds()
    Path(sys.argv[1]).write_text(toml(coarse + fine_bounds(motions) + lower_bounds() + tubes()), encoding="utf-8")


if __name__ == "__main__":
    main()
