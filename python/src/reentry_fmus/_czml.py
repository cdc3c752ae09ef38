"""Flights as CZML, which CesiumJS shows on a globe."""

from __future__ import annotations

from datetime import datetime, timedelta, timezone
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ._data import need

Array = NDArray[np.float64]
# Names of the vehicle's motion, and of its attitude relative to the velocity.
MOTION = ("altitude", "longitude", "latitude", "flightPathAngle", "heading")
ATTITUDE = ("alpha", "beta", "sigma")
# Time of the flight's start, which no experiment says.
EPOCH = datetime(2000, 1, 1, tzinfo=timezone.utc)


def write_czml(
    path: Path, table: pd.DataFrame, title: str, planet: tuple[float, float], component: str
) -> None:
    """Writes position, attitude and ground track of a component. `planet` is its equatorial radius
    (m) and flattening."""
    need("czml3", "czml")
    from czml3 import Document, Packet
    from czml3.properties import (
        Clock,
        Color,
        Orientation,
        Path as Trail,
        Point,
        Polyline,
        PolylineMaterial,
        Position,
        PositionList,
        SolidColorMaterial,
    )
    from czml3.types import TimeInterval

    names = [f"{component}.motion.{name}" for name in MOTION]
    names += [f"{component}.attitude.{name}" for name in ATTITUDE]
    if missing := [name for name in names if name not in table.columns]:
        raise ValueError(f"{missing[0]} is not recorded: the run is no flight over a planet")
    altitude, longitude, latitude, climb, heading, alpha, beta, sigma = (
        radians(table, name) for name in names
    )
    time = table.index.to_numpy(dtype=float)
    radius, flattening = planet
    ground = radius * (1 - flattening) / np.hypot((1 - flattening) * np.cos(latitude), np.sin(latitude))
    up = np.stack(
        [np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude), np.sin(latitude)]
    )
    # From the planet's axes to north, east, down, to the velocity, and to the body. A positive bank
    # angle turns to the left.
    turns = [
        (2, longitude), (1, -latitude - np.pi / 2), (2, heading), (1, climb), (0, -sigma), (2, -beta), (1, alpha),
    ]  # fmt: skip
    attitude = np.array([0.0, 0.0, 0.0, 1.0])[:, None] * np.ones_like(time)
    for axis, angle in turns:
        attitude = product(attitude, turn(axis, angle))
    span = TimeInterval(start=EPOCH, end=EPOCH + timedelta(seconds=float(time[-1])))
    red = Color(rgba=[213, 94, 0, 255])
    solid = PolylineMaterial(solidColor=SolidColorMaterial(color=Color(rgba=[0, 114, 178, 255])))

    def sampled(values: Array) -> list[float]:
        return [float(value) for row in np.vstack([time, values]).T for value in row]

    track = [float(value) for place in (ground * up).T for value in place]
    document = Document(
        packets=[
            Packet(id="document", name=title, version="1.0", clock=Clock(currentTime=EPOCH, multiplier=10)),
            Packet(
                id=component,
                name=title,
                availability=span,
                position=Position(epoch=EPOCH, cartesian=sampled((ground + altitude) * up)),
                orientation=Orientation(epoch=EPOCH, unitQuaternion=sampled(attitude)),
                point=Point(pixelSize=8, color=red),
                path=Trail(width=2, material=solid),
            ),
            Packet(
                id="ground track",
                polyline=Polyline(positions=PositionList(cartesian=track), clampToGround=True, width=2),
            ),
        ]
    )
    path.write_text(document.to_json(), encoding="utf-8")


def radians(table: pd.DataFrame, name: str) -> Array:
    """Returns a column, an angle in rad."""
    values = table[name].to_numpy(dtype=float)
    return np.radians(values) if table.attrs["units"].get(name) == "deg" else values


def turn(axis: int, angle: Array) -> Array:
    """Returns the quaternions (x, y, z, w) of turns about an axis."""
    quaternion = np.zeros((4, len(angle)))
    quaternion[axis], quaternion[3] = np.sin(angle / 2), np.cos(angle / 2)
    return quaternion


def product(a: Array, b: Array) -> Array:
    """Returns the quaternions of a turn by `b` in the axes that `a` has turned."""
    vector = a[3] * b[:3] + b[3] * a[:3] + np.cross(a[:3], b[:3], axis=0)
    return np.vstack([vector, a[3] * b[3] - (a[:3] * b[:3]).sum(axis=0)])


def planet_of(description: dict[str, Any], component: str) -> tuple[float, float]:
    """Returns equatorial radius (m) and flattening of a component's planet."""
    parameters = description["components"][component]["parameters"]
    return parameters["planet.radius"], parameters["planet.flattening"]
