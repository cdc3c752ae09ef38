"""Independence of a flight from left and right, the clock, the longitude, the plant's own step."""


import numpy as np
import pytest

from conftest import ROOT, tomllib
from loops import ATTITUDE, MOMENT, RATES, content, controllers, experiments, fly
from test_turns import same

# Where the guidance aims at without a setting.
TARGET = tomllib.loads((ROOT / "control" / "data" / "guidance.toml").read_text())["settings"]["target"]["longitude"]
STEP = experiments()["reversal/step"]
STATE = (*ATTITUDE, *RATES, *MOMENT)
MIRROR = np.array([1, -1, -1, -1, 1, -1, -1, 1, -1])[:, None]
"""Signs of STATE in a mirror: beta, sigma, p, r and the moments about x and z change theirs."""


def settings(sign: float = 1.0) -> dict:
    """A start in motion and a constant reference; `sign` = -1 mirrors them."""
    return {
        "plant.initial.alpha": "20 deg", "plant.initial.beta": f"{sign * 3} deg", "plant.initial.sigma": f"{sign * -40} deg",
        "plant.initial.p": f"{sign * 0.7} deg/s", "plant.initial.q": "-0.5 deg/s", "plant.initial.r": f"{sign * 0.4} deg/s",
        "controller.reference.angle.alpha": "22 deg", "controller.reference.angle.beta": f"{sign * 0.5} deg",
        "controller.reference.angle.sigma": f"{sign * -25} deg",
    }


@pytest.mark.parametrize("controller", controllers())
@pytest.mark.parametrize("kinematics", ["printed", "exact"])
def test_a_mirrored_start_is_flown_mirrored(tmp_path, controller, kinematics):
    flights = [
        fly(STEP, tmp_path / f"side{int(sign)}", "--fmu", f"controller={controller}", "--stop", "8", record=STATE,
            parameters=settings(sign) | {"plant.kinematics": kinematics})
        for sign in (1.0, -1.0)
    ]
    for flight in flights:
        assert flight.finished.returncode == 0, flight.finished.stderr
    first, second = (flight[STATE] for flight in flights)
    same(second, MIRROR * first)


@pytest.mark.parametrize("controller", controllers())
def test_a_flight_does_not_depend_on_the_clock(tmp_path, controller):
    flights = [
        fly(STEP, tmp_path / f"from{start}", "--fmu", f"controller={controller}", "--stop", str(start + 8), record=STATE,
            parameters=settings(), simulation={"start": start})
        for start in (0, 1000)
    ]
    for flight in flights:
        assert flight.finished.returncode == 0, flight.finished.stderr
    same(*(flight[STATE] for flight in flights))


@pytest.mark.parametrize("controller", controllers())
def test_half_the_step_of_the_plant_gives_the_same_flight(tmp_path, controller):
    flights = [
        fly(STEP, tmp_path / f"step{step}", "--fmu", f"controller={controller}", "--stop", "4", record=(*ATTITUDE, *RATES),
            parameters=settings() | {"plant.integrator.step": step})
        for step in (0.01, 0.005)
    ]
    for flight in flights:
        assert flight.finished.returncode == 0, flight.finished.stderr
    first, second = (flight[[*ATTITUDE, *RATES]] for flight in flights)
    assert np.abs(second - first).max() < 1e-7


def entries() -> list[str]:
    """The experiments that fly an entry."""
    def flies(name: str) -> bool:
        plant = content(experiments()[name])["components"].get("plant", {})
        return plant.get("parameters", {}).get("translation") == "entry"

    return [name for name in experiments() if flies(name)]


@pytest.mark.parametrize("name", entries())
def test_an_entry_is_the_same_at_every_longitude_and_over_the_date_line(tmp_path, name):
    path = experiments()[name]
    parts = content(path)["components"]
    record = (*ATTITUDE, *RATES, "plant.motion.altitude", "plant.motion.speed", "guidance.range", "guidance.command.bank")

    def moved(degrees: float) -> dict:
        """The start and the target, further to the east."""
        def east(component: str, key: str, start: float) -> str:
            value = str(parts[component].get("parameters", {}).get(key, f"{start} deg")).split()
            assert value[1:] == ["deg"], value
            return f"{(float(value[0]) + degrees + 180.0) % 360.0 - 180.0} deg"

        start = east("plant", "initial.longitude", 0.0)
        # A navigation is told where it begins.
        told = {f"{part}.initial.longitude": start for part in ("plant", "navigation") if part in parts}
        return {**told,
                "guidance.target.longitude": east("guidance", "target.longitude", float(TARGET.split()[0]))}

    flights = [fly(path, tmp_path / f"east{k}", "--stop", "60", record=record, parameters=moved(degrees))
               for k, degrees in enumerate((0.0, 37.5, 179.99))]
    for flight in flights:
        assert flight.finished.returncode == 0, flight.finished.stderr
    first, *others = (flight[record] for flight in flights)
    for other in others:
        scale = np.abs(first).max(axis=1, keepdims=True)
        assert (np.abs(other - first) <= 1e-6 * scale + 1e-12).all()


def swaps() -> list[tuple[str, tuple[str, ...]]]:
    """Orders of components that differ from an experiment's in two neighbours without a connection."""
    found = []
    for name, path in experiments().items():
        text = content(path)
        order = text["simulation"].get("order", [])
        wired = {(wire["from"].split(".")[0], wire["to"].split(".")[0]) for wire in text.get("connections", [])}
        for k, pair in enumerate(zip(order, order[1:])):
            if pair not in wired and pair[::-1] not in wired:
                found.append((name, (*order[:k], pair[1], pair[0], *order[k + 2:])))
    return found


@pytest.mark.parametrize(("name", "order"), swaps())
def test_components_without_a_connection_may_change_places(tmp_path, name, order):
    flights = [
        fly(experiments()[name], tmp_path / f"order{k}", "--stop", "1", record=STATE, simulation=simulation)
        for k, simulation in enumerate((None, {"order": list(order)}))
    ]
    assert all(flight.finished.returncode == 0 for flight in flights), flights[1].finished.stderr
    assert (flights[0][STATE] == flights[1][STATE]).all()
