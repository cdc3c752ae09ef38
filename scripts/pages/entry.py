"""Draws the pictures of docs/entry.md from finished runs of entry flights: entry.py DIRECT_DIR ACTUATED_DIR.

The folders are what `orchestrator run from-120km` and `orchestrator run surfaces-and-jets` wrote, the latter with
`--fmu controller=CRMPC.fmu`; each holds its results.csv.
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


if __name__ == "__main__":
    direct, by_actuators = sys.argv[1:]
    whole(read(f"{direct}/results.csv"))
    actuated(read(f"{by_actuators}/results.csv"))
