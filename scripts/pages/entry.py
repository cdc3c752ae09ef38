"""Draws the pictures of docs/entry.md and docs/EntryNavigation.md from finished runs of entry flights:
entry.py DIRECT_DIR ACTUATED_DIR NAVIGATED_DIR.

The folders are what `orchestrator run from-120km`, `orchestrator run surfaces-and-jets` with
`--fmu controller=CRMPC.fmu`, and `orchestrator run navigated` wrote, the latter with wind (docs/EntryNavigation.md);
each holds its results.csv.
The corridor of the first picture has the altitudes at which the vehicle of vehicle/data/papers.toml, at the
flight's angle of attack, would meet a load of 2.5, a heat flux of 700 kW/m2, or a lift that holds it in
equilibrium without bank.
"""

import csv
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")  # to a file, with no window
import matplotlib.pyplot as plt
import numpy as np

IMAGES = Path(__file__).resolve().parents[2] / "docs" / "images"
GRAVITY, RADIUS = 9.80665, 6_378_137.0
LARGEST_LOAD, LARGEST_FLUX = 2.5, 700.0  # g; kW/m2
# The colours and dashes of all pictures, and the neutral one of limits.
plt.rcParams["axes.prop_cycle"] = plt.cycler(
    color=["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00"],
    linestyle=["-", (0, (5, 1.5)), (0, (1, 1)), (0, (5, 1, 1, 1)), (0, (9, 2)), (0, (3, 1, 1, 1, 1, 1))],
)
LIMIT = {"color": "#5b6875", "ls": "--"}


def read(path: str) -> dict[str, np.ndarray]:
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


def corridor(run: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Altitudes (km) at which each limit would be met at the speed of the flight. The density at which a
    quantity has its limit follows from the flight's own values, which are proportional to the density, or
    the flux to its root; the density over altitude is the flight's own."""
    altitude, density = run["plant.motion.altitude"], run["plant.flow.density"]
    order = np.argsort(density)
    height = lambda wanted: np.interp(np.log(wanted), np.log(density[order]), altitude[order] / 1e3, np.nan, np.nan)
    speed, lift = run["plant.motion.speed"], run["plant.load.lift"]
    load, flux = run["plant.loadFactor"], run["plant.heating.flux"] / 1e3
    needed = GRAVITY - speed**2 / (RADIUS + altitude)
    return {
        f"load of {LARGEST_LOAD} g": height(density * LARGEST_LOAD / np.maximum(load, 1e-9)),
        f"heat flux of {LARGEST_FLUX:.0f} kW/m²": height(density * (LARGEST_FLUX / np.maximum(flux, 1e-9)) ** 2),
        "equilibrium without bank": height(density * np.maximum(needed, 1e-3) / np.maximum(lift, 1e-9)),
    }


def whole(run: dict[str, np.ndarray]) -> None:
    time = run["time"]
    degrees = lambda name: np.degrees(run[name])
    figure, axes = plt.subplots(2, 3, figsize=(15, 8), layout="constrained")
    (corridor_axes, track, bank), (load, rates, moments) = axes

    corridor_axes.plot(run["plant.motion.speed"] / 1e3, run["plant.motion.altitude"] / 1e3, "k", lw=2, label="flight")
    for name, altitude in corridor(run).items():
        corridor_axes.plot(run["plant.motion.speed"] / 1e3, altitude, label=name)
    corridor_axes.set(xlabel="speed, km/s", ylabel="altitude, km", title="Altitude over speed", ylim=(15, 125))
    corridor_axes.legend(loc="upper left")

    track.plot(degrees("plant.motion.longitude"), degrees("plant.motion.latitude"), lw=2)
    sign = np.sign(run["guidance.command.bank"])
    for i in np.flatnonzero(np.diff(sign)):
        track.plot(degrees("plant.motion.longitude")[i], degrees("plant.motion.latitude")[i], "o", color="C1")
    track.plot(degrees("guidance.target.longitude")[0], degrees("guidance.target.latitude")[0], "k*", ms=12)
    track.set(xlabel="longitude, deg", ylabel="latitude, deg", title="Ground track, bank reversals and runway point")

    bank.plot(time, degrees("guidance.command.bank"), color="0.7", ls="-", label="commanded")
    bank.plot(time, degrees("controller.reference.sigma"), label="reference")
    bank.plot(time, degrees("plant.attitude.sigma"), label="bank angle")
    bank.plot(time, degrees("plant.attitude.alpha"), label="angle of attack")
    bank.set(xlabel="time, s", ylabel="deg", title="Attitude")
    bank.legend(loc="lower left")

    load.plot(time, run["plant.loadFactor"], label="load, g")
    load.plot(time, run["plant.flight.dynamicPressure"] / 1e4, label="dynamic pressure, 10 kPa")
    load.plot(time, run["plant.heating.flux"] / 5e5, label="heat flux, 500 kW/m²")
    load.set(xlabel="time, s", title="Loads")
    load.legend()

    size = np.sqrt(sum(degrees(f"plant.rate.{axis}") ** 2 for axis in "pqr"))
    rates.plot(time, size, label="‖ω‖")
    rates.axhline(5.0, **LIMIT, label="limit")
    rates.set(xlabel="time, s", ylabel="deg/s", title="Angular rate")
    rates.legend()

    norm = lambda name: np.sqrt(sum(run[f"{name}.{axis}"] ** 2 for axis in "xyz")) / 1e3
    moments.plot(time, norm("controller.moment"), label="control")
    moments.plot(time, norm("plant.airMoment"), label="air, without surfaces")
    moments.axhline(135.6, **LIMIT, label="limit")
    moments.set(xlabel="time, s", ylabel="kN m", title="Moments")
    moments.legend()
    for one in axes.flat:
        one.grid(alpha=0.3)
    figure.savefig(f"{IMAGES}/entry.png", dpi=90)


def actuated(run: dict[str, np.ndarray]) -> None:
    """Who gives the moment: jets at first, then surfaces."""
    time = run["time"]
    figure, (pressure, jets, surfaces, moment) = plt.subplots(4, 1, figsize=(9, 9), sharex=True, layout="constrained")
    pressure.semilogy(time, run["plant.flight.standardDynamicPressure"])
    pressure.axhline(500.0, **LIMIT, label="selector")
    pressure.set(ylabel="dynamic pressure, Pa")
    pressure.legend()
    duties = [run[f"allocator.jet[{j}]"] for j in range(1, 11)]
    jets.plot(time, np.sum(duties, axis=0))
    jets.set(ylabel="jets, sum of duties")
    names = ["left outer elevon", "right outer elevon", "left inner elevon", "right inner elevon", "left flap", "right flap"]
    for i, name in enumerate(names, start=1):
        surfaces.plot(time, np.degrees(run[f"plant.deflection[{i}]"]), label=name)
    surfaces.set(ylabel="deflection, deg")
    surfaces.legend(ncols=3, fontsize="small")
    for axis, name in zip("xyz", ("roll", "pitch", "yaw")):
        moment.plot(time, run[f"plant.appliedMoment.{axis}"] / 1e3, label=name)
    moment.set(xlabel="time, s", ylabel="moment, kN m")
    moment.legend(ncols=3)
    for one in (pressure, jets, surfaces, moment):
        one.grid(alpha=0.3)
    figure.savefig(f"{IMAGES}/entry-actuators.png", dpi=90)


def navigated(run: dict[str, np.ndarray]) -> None:
    """Errors of the navigation with what it predicts of them."""
    time = run["time"]
    names = {"attitude.sigma": "bank angle", "flow.alpha": "angle of attack, air", "flow.beta": "sideslip, air"}
    figure, axes = plt.subplots(4, 1, figsize=(9, 9), sharex=True, layout="constrained")
    height = run["plant.motion.altitude"] / 1e3
    for one in axes:
        one.axvspan(time[height < 85][0], time[height < 45][0], color="0.93", lw=0)
        one.grid(alpha=0.3)
    for one, (name, title) in zip(axes, names.items()):
        error = run[f"navigation.{name}"] - run[f"plant.{name}"]
        deviation = np.degrees(run[f"navigation.deviation.{name}"])
        one.fill_between(time, -2 * deviation, 2 * deviation, color="#56b4e9", alpha=0.4, lw=0, label="twice the predicted deviation")
        one.plot(time, np.degrees(np.angle(np.exp(1j * error))), label="error")
        one.set(ylabel="deg", title=title)
    axes[0].legend(loc="upper left", ncols=2)
    wind = axes[-1]
    for part in ("north", "east"):
        wind.plot(time, run[f"navigation.wind.{part}"], label=f"to the {part}")
    low, high = np.interp(height, [20, 60, 100], [40, 20, 0]), np.interp(height, [20, 60, 100], [-30, 10, 0])
    wind.plot(time, low, **LIMIT, label="true")
    wind.plot(time, high, **LIMIT)
    wind.set(xlabel="time, s", ylabel="m/s", title="wind; without satellite navigation where it is grey")
    wind.legend(loc="lower left", ncols=3)
    figure.savefig(f"{IMAGES}/entry-navigation.png", dpi=90)


if __name__ == "__main__":
    direct, by_actuators, by_navigation = sys.argv[1:]
    whole(read(f"{direct}/results.csv"))
    actuated(read(f"{by_actuators}/results.csv"))
    navigated(read(f"{by_navigation}/results.csv"))
