"""A vehicle from a file, as docs/vehicle.md explains it: the example's flight, faults, and states of
another file."""

import json
import re
import shutil

import jsonschema
import numpy as np
import pandas as pd
import pytest
from fmpy.fmi1 import FMICallException

from conftest import ROOT, call, tomllib
from fmi import Instance

ENTRY = ROOT / "orchestrator" / "experiments" / "entry"
EXAMPLE = ENTRY / "vehicles" / "lifting-body.toml"
DATA = ROOT / "vehicle" / "data"
PAPERS = "\n".join((DATA / name).read_text(encoding="utf-8") for name in ("papers.toml", "effectors.toml"))


def schema() -> dict:
    return json.loads(call("schema", "vehicle").stdout)


SHIPPED = [DATA / "shuttle.toml", *sorted((ENTRY / "vehicles").glob("*.toml"))]


@pytest.mark.parametrize("text", [PAPERS, *(path.read_text(encoding="utf-8") for path in SHIPPED)])
def test_vehicles_keep_to_their_schema(text):
    jsonschema.validate(tomllib.loads(text), schema(), cls=jsonschema.Draft7Validator)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(tomllib.loads(text.replace("[forces.lift]", "[forces.left]")), schema())


@pytest.mark.parametrize("name", ["own-vehicle", "orbiter", "capsule"])
def test_the_examples_fly_to_their_targets(orchestrate, name):
    finished, out = orchestrate(ENTRY / f"{name}.toml", "--page")
    assert finished.returncode == 0 and "WARN" not in finished.stderr, finished.stderr
    page = (out / "page.html").read_text(encoding="utf-8")
    data = re.search(r'id="run-data"[^>]*>(.*?)</script>', page, re.DOTALL)
    shown = json.loads(data[1])["runs"][0]["vehicle"]
    file = tomllib.loads((ENTRY / f"{name}.toml").read_text(encoding="utf-8"))["vehicle"]["file"]
    given = tomllib.loads((ENTRY / file).read_text(encoding="utf-8"))
    assert [surface["name"] for surface in shown["surfaces"]] == given.get("surfaces", {}).get("names", [])
    assert len(shown["jets"]) == len(given["jets"]["moment"][0])
    metrics = json.loads((out / "metrics.json").read_text())
    assert metrics["completed"] and metrics["range_off_km"] < 5
    assert metrics["worst_limit_ratio"] < 1


def test_oracle_axes_turned_by_half_a_turn_about_y_give_the_same_flight(orchestrate, tmp_path):
    """The capsule at 162 deg with its axis to the apex is the same at −18 deg with its axis to the heat shield."""
    for folder in ("entry", "base"):
        shutil.copytree(ENTRY.parent / folder, tmp_path / folder)
    entry = tmp_path / "entry"

    def changed(name: str, *pairs: tuple[str, str]) -> None:
        text = (entry / name).read_text(encoding="utf-8")
        for old, new in pairs:
            assert old in text
            text = text.replace(old, new)
        (entry / name).write_text(text, encoding="utf-8")

    given = tomllib.loads((entry / "vehicles" / "capsule.toml").read_text(encoding="utf-8"))
    alpha = ", ".join(map(str, given["forces"]["lift"]["table"]["alpha_deg"]))
    turned = ", ".join(str(angle - 180) for angle in given["forces"]["lift"]["table"]["alpha_deg"])
    roll, _, yaw = (f"    {row},\n" for row in given["jets"]["moment"])
    other = [f"    {[-value for value in row]},\n" for row in given["jets"]["moment"]]
    changed(
        "vehicles/capsule.toml",
        (f"[{alpha}]", f"[{turned}]"),
        ("[3.67, 0.0, -0.1128]", "[-3.67, 0.0, 0.1128]"),
        (roll, other[0]),
        (yaw, other[2]),
    )
    changed("capsule.toml", ("162 deg", "-18 deg"))
    changed("capsule-guidance.toml", ("162 deg", "-18 deg"))
    flights = []
    for path in (ENTRY / "capsule.toml", entry / "capsule.toml"):
        finished, out = orchestrate(path)
        assert finished.returncode == 0, finished.stderr
        flights.append(pd.read_csv(out / "results.csv"))
    one, other = flights
    same = ["motion.altitude", "motion.longitude", "motion.latitude", "motion.speed", "rate.q", "load.lift", "load.drag"]
    for name in same:
        np.testing.assert_allclose(one[f"plant.{name}"], other[f"plant.{name}"], rtol=1e-6, atol=1e-6)
    for name in ("rate.p", "rate.r"):
        np.testing.assert_allclose(one[f"plant.{name}"], -other[f"plant.{name}"], atol=1e-6)


def test_different_vehicles_in_one_loop_are_warned_of(orchestrate):
    finished, _ = orchestrate(ENTRY / "own-vehicle.toml", "--stop", "1")
    assert finished.returncode == 0 and "vehicle.file" not in finished.stderr
    finished, _ = orchestrate(ENTRY / "own-vehicle.toml", "--stop", "1", "--set", "guidance.vehicle.file=")
    said = " ".join(finished.stderr.split())
    assert finished.returncode == 0
    assert "vehicle.file differs from component to component" in said and '"guidance" reads none' in said, said


def test_settings_of_one_component_are_no_other_vehicle(orchestrate, tmp_path):
    file = tmp_path / "gyroscope.toml"
    file.write_text('sensor.gyroscope.bias.x = "0.2 deg/s"\n')
    finished, _ = orchestrate(ENTRY / "navigated.toml", "--stop", "1", "--set", f"plant.settings.file={file}")
    assert finished.returncode == 0 and "component to component" not in finished.stderr, finished.stderr


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("mach = [2.0, 5.0]", "mach = [5.0, 2.0]", "forces.lift.table.mach must increase, but 2 follows 5"),
        ("kilograms = 36000.0", "kilograms = 0.0", "reference.mass: must be positive"),
        ("[forces.lift]", "[forces.left]", "unknown field `left`"),
        ('surface = "body flap"', 'surface = "body flop"', "there is no 'body flop'"),
    ],
)
def test_a_fault_is_refused_with_file_line_and_key(orchestrate, tmp_path, old, new, named):
    for folder in ("entry", "base"):
        shutil.copytree(ENTRY.parent / folder, tmp_path / folder)
    file = tmp_path / "entry" / "vehicles" / "lifting-body.toml"
    lines = file.read_text(encoding="utf-8").splitlines()
    line = lines.index(old) if old in lines else next(i for i, text in enumerate(lines) if old in text)
    file.write_text("\n".join([*lines[:line], lines[line].replace(old, new), *lines[line + 1 :]]), encoding="utf-8")
    finished, _ = orchestrate(tmp_path / "entry" / "own-vehicle.toml")
    assert finished.returncode != 0
    said = " ".join(finished.stderr.split())
    assert f"lifting-body.toml, line {line + 1}: " in said and named in said and "vehicle.file" in said, finished.stderr


@pytest.mark.parametrize("name", ["ReentryPlant", "EntryGuidance", "ControlAllocator"])
def test_a_saved_state_does_not_fit_another_content_of_the_file(fmu, tmp_path, name):
    file = tmp_path / "vehicle.toml"
    shutil.copy(EXAMPLE, file)
    inputs = {"flow.mach": 5.0} if name == "ControlAllocator" else {}
    settings = {"vehicle.file": str(file)}
    with Instance(fmu(name), settings).start(inputs=inputs) as instance:
        saved = instance.save()
    with Instance(fmu(name), settings).start(inputs=inputs) as instance:
        instance.restore(saved)
    file.write_text(EXAMPLE.read_text(encoding="utf-8").replace("36000.0", "36001.0"), encoding="utf-8")
    with Instance(fmu(name), settings).start(inputs=inputs) as instance:
        with pytest.raises(FMICallException):
            instance.restore(saved)
        assert "vehicle.file" in instance.messages()
