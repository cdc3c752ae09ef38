"""Plant and controller stepped by hand against the orchestrator, with the same binaries in the same
order."""

import csv
import json
import sys

import pytest

from conftest import EXPERIMENTS, merged
from fmi import Instance, Loop, number

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

STEP = 0.04
COLUMNS = {
    "plant": ["attitude.alpha", "attitude.beta", "attitude.sigma", "rate.p", "rate.q", "rate.r"],
    "controller": ["moment.x", "moment.y", "moment.z", "reference.alpha", "reference.beta", "reference.sigma"],
}


def compare(fmu, text: str, results, jacobi: bool = False) -> None:
    """Steps the components of an experiment by hand and compares them with the orchestrator's
    results."""
    written = tomllib.loads(text)["components"]
    instances = {}
    for component in ("controller", "plant"):
        settings = {key: number(value) for key, value in written[component]["parameters"].items()}
        instances[component] = Instance(fmu(written[component]["fmu"].removesuffix(".fmu")), settings, component)
    with open(results / "results.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 1251

    loop = Loop(instances["controller"], instances["plant"], STEP, jacobi)
    loop.start()
    largest = {}
    difference = {}
    for tick, row in enumerate(rows):
        assert float(row["time"]) == pytest.approx(tick * STEP, abs=1e-12)
        values = {name: value for component, names in COLUMNS.items() for name, value in zip(names, instances[component].get(names))}
        if tick + 1 < len(rows):
            loop.advance()
            values |= zip(COLUMNS["controller"][:3], instances["controller"].get(COLUMNS["controller"][:3]))
        for component, names in COLUMNS.items():
            for column in names:
                value = values[column]
                expected = float(row[f"{component}.{column}"])
                largest[column] = max(largest.get(column, 0.0), abs(expected))
                difference[column] = max(difference.get(column, 0.0), abs(value - expected))
    for column, error in difference.items():
        assert error <= 1e-12 * largest[column], f"{column}: {error}"
    assert largest["moment.x"] > 1e3
    for instance in instances.values():
        assert instance.messages() == ""
        instance.close()


@pytest.mark.parametrize("name", ["crmpc-robust", "crmpc-paper", "lqr"])
def test_oracle_stepping_by_hand_gives_the_orchestrators_trajectory(fmu, experiment, name):
    compare(fmu, merged(EXPERIMENTS / f"{name}.toml"), experiment(name))


def test_oracle_jacobi_by_hand_adds_one_communication_step_of_delay(fmu, orchestrate, tmp_path):
    text = merged(EXPERIMENTS / "crmpc-robust.toml")
    text = text.replace("[components.controller.parameters]", "[components.controller.parameters]\ndelay = 0.04")
    jacobi = tmp_path / "jacobi.toml"
    jacobi.write_text(text.replace('coupling = "sequential"', 'coupling = "jacobi"'))
    finished, out = orchestrate(jacobi)
    assert finished.returncode == 0, finished.stderr
    assert json.loads((out / "metrics.json").read_text())["loop_delay_s"] == pytest.approx(STEP)
    compare(fmu, text, out, jacobi=True)
