"""Draws the pictures of docs/entry.md and docs/entry.md that show more than the plot of a run:
entry.py ACTUATED_DIR NAVIGATED_DIR.

The folders are what `orchestrator run surfaces-and-jets` with `--fmu controller=CRMPC.fmu` and `orchestrator run
navigated` wrote, the latter with wind (docs/entry.md); each holds its results.csv.
"""

import csv
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")  # to a file, with no window
import matplotlib.pyplot as plt
import numpy as np

IMAGES = Path(__file__).resolve().parents[2] / "docs" / "images"
# The colours and dashes of all pictures, and the neutral one of limits.
plt.rcParams["axes.prop_cycle"] = plt.cycler(
    color=["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00"],
    linestyle=["-", (0, (5, 1.5)), (0, (1, 1)), (0, (5, 1, 1, 1)), (0, (9, 2)), (0, (3, 1, 1, 1, 1, 1))],
)
LIMIT = {"color": "#5b6875", "ls": "--"}


# Above the axes, where no curve is.
LEGEND = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "borderaxespad": 0.2, "frameon": False, "fontsize": "small"}


def read(path: str) -> dict[str, np.ndarray]:
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


def actuated(run: dict[str, np.ndarray]) -> None:
    """Who gives the moment: jets at first, then surfaces."""
    time = run["time"]
    figure, (pressure, jets, surfaces, moment) = plt.subplots(4, 1, figsize=(9, 9), sharex=True, layout="constrained")
    pressure.semilogy(time, run["plant.flight.standardDynamicPressure"])
    pressure.axhline(500.0, **LIMIT, label="selector")
    pressure.set(ylabel="dynamic pressure, Pa")
    pressure.legend(**LEGEND)
    duties = [run[f"allocator.jet[{j}]"] for j in range(1, 11)]
    jets.plot(time, np.sum(duties, axis=0))
    jets.set(ylabel="jets, sum of duties")
    names = ["left outer elevon", "right outer elevon", "left inner elevon", "right inner elevon", "left flap", "right flap"]
    for i, name in enumerate(names, start=1):
        surfaces.plot(time, np.degrees(run[f"plant.deflection[{i}]"]), label=name)
    surfaces.set(ylabel="deflection, deg")
    surfaces.legend(ncols=6, **LEGEND)
    for axis, name in zip("xyz", ("roll", "pitch", "yaw")):
        moment.plot(time, run[f"plant.appliedMoment.{axis}"] / 1e3, label=name)
    moment.set(xlabel="time, s", ylabel="moment, kN m")
    moment.legend(ncols=3, **LEGEND)
    for one in (pressure, jets, surfaces, moment):
        one.grid(alpha=0.3)
    figure.savefig(f"{IMAGES}/entry-actuators.png", dpi=90)


def navigated(run: dict[str, np.ndarray]) -> None:
    """Errors of the navigation with what it predicts of them."""
    time = run["time"]
    names = {"attitude.sigma": "bank angle", "flow.alpha": "angle of attack, air", "flow.beta": "sideslip, air"}
    figure, axes = plt.subplots(5, 1, figsize=(9, 11), sharex=True, layout="constrained")
    height = run["plant.motion.altitude"] / 1e3
    for one in axes:
        one.axvspan(time[height < 85][0], time[height < 45][0], color="0.93", lw=0)
        one.grid(alpha=0.3)
    for one, (name, title) in zip(axes, names.items()):
        error = run[f"navigation.{name}"] - run[f"plant.{name}"]
        deviation = np.degrees(run[f"navigation.deviation.{name}"])
        one.fill_between(time, -2 * deviation, 2 * deviation, color="#56b4e9", alpha=0.4, lw=0, label="twice the predicted deviation")
        one.plot(time, np.degrees(np.angle(np.exp(1j * error))), label="error")
        one.set(ylabel="deg")
        one.set_title(title, loc="left")
    axes[0].legend(ncols=2, **LEGEND)
    altitude, deviation = axes[3], run["navigation.deviation.altitude"] / 1e3
    altitude.fill_between(time, -2 * deviation, 2 * deviation, color="#56b4e9", alpha=0.4, lw=0)
    altitude.plot(time, run["navigation.motion.altitude"] / 1e3 - height)
    altitude.set(ylabel="km")
    altitude.set_title("altitude", loc="left")
    wind = axes[-1]
    for part in ("north", "east"):
        wind.plot(time, run[f"navigation.wind.{part}"], label=f"to the {part}")
    low, high = np.interp(height, [20, 60, 100], [40, 20, 0]), np.interp(height, [20, 60, 100], [-30, 10, 0])
    wind.plot(time, low, **LIMIT, label="true")
    wind.plot(time, high, **LIMIT)
    wind.set(xlabel="time, s", ylabel="m/s")
    wind.set_title("wind; without satellite navigation where it is grey", loc="left")
    wind.legend(ncols=3, **LEGEND)
    figure.savefig(f"{IMAGES}/entry-navigation.png", dpi=90)


if __name__ == "__main__":
    by_actuators, by_navigation = sys.argv[1:]
    actuated(read(f"{by_actuators}/results.csv"))
    navigated(read(f"{by_navigation}/results.csv"))
