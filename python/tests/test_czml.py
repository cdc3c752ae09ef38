"""Flights as CZML."""

import json

import numpy as np
import pytest
from reentry_fmus import experiment


def test_oracle_a_flight_on_a_globe_points_along_its_path(tmp_path):
    pytest.importorskip("czml3")
    run = experiment("from-120km", stop=400.0)
    run.to_czml(tmp_path / "entry.czml")
    document, vehicle, track = json.loads((tmp_path / "entry.czml").read_text())
    assert document["name"] == run.title and len(track["polyline"]["positions"]["cartesian"]) == 3 * len(run.table)
    time, *position = np.reshape(vehicle["position"]["cartesian"], (-1, 4)).T
    assert np.array_equal(time, run.table.index)
    _, *vector, scalar = np.reshape(vehicle["orientation"]["unitQuaternion"], (-1, 5)).T
    alpha, beta = (run.table[f"plant.attitude.{name}"] for name in ("alpha", "beta"))
    velocity = np.array([np.cos(alpha) * np.cos(beta), np.sin(beta), np.sin(alpha) * np.cos(beta)])
    # By the formula of Rodrigues, against differences of the position.
    across = np.cross(vector, velocity, axis=0)
    turned = velocity + 2 * (scalar * across + np.cross(vector, across, axis=0))
    flown = np.gradient(position, time, axis=1)
    flown /= np.linalg.norm(flown, axis=0)
    assert (turned * flown).sum(axis=0)[1:-1].min() > 1 - 1e-6
    # The lift, against the body's z-axis, points away from the planet unless the bank exceeds 90 degrees.
    axis = np.array([0.0, 0.0, -1.0])[:, None] * np.ones_like(time)
    across = np.cross(vector, axis, axis=0)
    lift = axis + 2 * (scalar * across + np.cross(vector, across, axis=0))
    assert ((lift * position).sum(axis=0) > 0).all()
    with pytest.raises(ValueError, match="is not recorded"):
        experiment("lqr", stop=1.0).to_czml(tmp_path / "no.czml")
