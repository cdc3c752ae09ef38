"""Flies an entry and writes position, attitude and ground track as CZML, which CesiumJS shows on a
globe. Needs `pip install scipy`.

    python python/examples/entry_on_a_globe.py from-120km entry.czml
"""

import json
import sys
from functools import reduce
from operator import mul
from pathlib import Path

import numpy as np
from reentry_fmus import experiment
from scipy.spatial.transform import Rotation

EPOCH = np.datetime64("2000-01-01T00:00:00", "ms")  # of the start, which no experiment says
MOTION = ("altitude", "longitude", "latitude", "flightPathAngle", "heading")
ATTITUDE = ("alpha", "beta", "sigma")


def czml(run, component="plant"):
    """Returns the flight of a component as a list of CZML's packets."""
    names = [f"motion.{name}" for name in MOTION] + [f"attitude.{name}" for name in ATTITUDE]
    columns = (run[f"{component}.{name}"].to_numpy() for name in names)
    altitude, longitude, latitude, climb, heading, alpha, beta, sigma = columns
    parameters = run.description["components"][component]["parameters"]
    polar = 1.0 - parameters["planet.flattening"]
    ground = parameters["planet.radius"] * polar / np.hypot(polar * np.cos(latitude), np.sin(latitude))
    equatorial = np.cos(latitude)
    up = np.stack([equatorial * np.cos(longitude), equatorial * np.sin(longitude), np.sin(latitude)])
    # From the planet's axes to north, east, down, to the velocity, and to the body. A positive bank
    # angle turns to the left.
    turns = zip("zyzyxzy", [longitude, -latitude - np.pi / 2, heading, climb, -sigma, -beta, alpha])
    attitude = reduce(mul, (Rotation.from_euler(axis, angle[:, None]) for axis, angle in turns)).as_quat()

    def sampled(values):
        return np.column_stack([run.table.index, values]).ravel().tolist()

    span = f"{EPOCH}Z/{EPOCH + np.timedelta64(int(1e3 * run.table.index[-1]), 'ms')}Z"
    start = f"{EPOCH}Z"
    track = {"positions": {"cartesian": (ground * up).T.ravel().tolist()}, "clampToGround": True, "width": 2}
    vehicle = {
        "id": component,
        "name": run.title,
        "availability": span,
        "position": {"epoch": start, "cartesian": sampled(((ground + altitude) * up).T)},
        "orientation": {"epoch": start, "unitQuaternion": sampled(attitude)},
        "point": {"pixelSize": 8, "color": {"rgba": [213, 94, 0, 255]}},
        "path": {"width": 2},
    }
    clock = {"interval": span, "currentTime": start, "multiplier": 10}
    document = {"id": "document", "name": run.title, "version": "1.0", "clock": clock}
    return [document, vehicle, {"id": "ground track", "polyline": track}]


if __name__ == "__main__":
    name, file = sys.argv[1:]
    Path(file).write_text(json.dumps(czml(experiment(name))), encoding="utf-8")
