"""Every call between importers and the FMUs, written down by a library between them and checked
against the state machines of FMI 2.0 and 3.0: what importers may call, and what units may answer."""

import re
import subprocess
import sys
from functools import cache

import pytest
from fmpy import read_model_description, simulate_fmu

from conftest import EXPERIMENTS, NAMES, ROOT, TARGET, archive, archive3, call
from fmi import Fmu, Instance, Instance3, Loop
from strict.judge import Judge
from strict.proxy import HEADERS, build, interpose, read

ARCHIVES = {"2": archive, "3": archive3}


@pytest.fixture(scope="session")
def strict(tmp_path_factory):
    """The libraries for both versions."""
    folder = tmp_path_factory.mktemp("strict")
    return {version: build(version, folder) for version in ARCHIVES}


@pytest.fixture
def watched(strict, tmp_path, monkeypatch):
    """Makes an archive whose calls are written to a log, opens it, and judges the log."""

    logs = tmp_path / "logs"
    logs.mkdir()
    monkeypatch.setenv("LC_STRICT_LOGS", str(logs))

    class Watched:
        folder = tmp_path / "fmu"

        def __init__(self, name: str, version: str):
            self.folder.mkdir(exist_ok=True)
            self.version = version
            self.path = interpose(ARCHIVES[version](name), strict[version], self.folder / f"{name}.fmu")
            self.fmu = Fmu.open(self.path, tmp_path / f"{name}{version}")
            self.log = logs / f"{self.fmu.description.coSimulation.modelIdentifier}.so.log"

        def judge(self) -> Judge:
            judge = Judge(self.version, self.fmu.description)
            judge.all(read(self.log))
            return judge

    return Watched


@pytest.mark.parametrize("events", [False, True], ids=["step mode", "event mode"])
@pytest.mark.parametrize("name", NAMES)
def test_fmpy_and_a_unit_keep_to_fmi_3(watched, name, events):
    unit = watched(name, "3")
    with Instance3(unit.fmu, events=events) as instance:
        instance.start()
        if events:
            instance.handle()
            instance.slave.enterStepMode()
        time = 0.0
        while time < 1.0:
            due, ends, _, time = instance.step(time, 1.0 - time)
            if due:
                instance.slave.enterEventMode()
                while instance.slave.updateDiscreteStates()[0]:
                    pass
                instance.slave.enterStepMode()
            if ends:
                break
        instance.outputs()
        if not ends:
            instance.restore(instance.save())
            instance.step(time, 0.2)
        instance.slave.terminate()
    judge = unit.judge()
    assert judge.broken == []
    assert ("fmi3Terminate", "step") in judge.seen


@pytest.mark.parametrize("jacobi", [False, True])
def test_loops_by_hand_keep_to_fmi_2(watched, jacobi):
    units = [watched(name, "2") for name in ("CRMPC", "ReentryPlant")]
    with Instance(units[0].fmu) as controller, Instance(units[1].fmu) as plant:
        Loop(controller, plant, 0.04, jacobi).fly(50)
    assert [unit.judge().broken for unit in units] == [[], []]


# Every way in which the orchestrator uses units.
USES = {
    "run": ["run", "lqr", "--out", "out", "--quiet", "--stop", "2"],
    "margins": ["margins", "lqr", "--at", "1", "--open", "plant.moment.*", "--model", "out.json"],
    "exchange": ["run", "exchange.toml", "--out", "out", "--quiet", "--stop", "2"],
    "campaign": ["campaign", "few.toml", "--out", "out", "--jobs", "1", "--quiet", "--stop", "2"],
}
CAMPAIGN = f"""#:schema {EXPERIMENTS}/../../schema/campaign.json
title = "Few cases"
experiment = "{EXPERIMENTS}/lqr.toml"
cases = 4

[[vary]]
parameter = "plant.disturbance.seed"
case = 1
"""


EXCHANGE = f"""#:schema {EXPERIMENTS}/../../schema/experiment.json
extends = "{EXPERIMENTS}/lqr.toml"
title = "The plant integrated by the master"

[components.plant]
interface = "modelExchange"
"""
MODES = {"2": ("complete", "continuous"), "3": ("step", "continuous")}


@pytest.mark.parametrize("use", USES)
@pytest.mark.parametrize("version", ["2", "3"])
def test_the_orchestrator_keeps_to_the_standard(watched, tmp_path, version, use):
    units = [watched(name, version) for name in ("ReentryPlant", "LQR")]
    (tmp_path / "few.toml").write_text(CAMPAIGN)
    (tmp_path / "exchange.toml").write_text(EXCHANGE)
    call(*USES[use], "--fmu-dir", units[0].folder, cwd=tmp_path)
    for unit in units:
        judge = unit.judge()
        assert judge.broken == []
        stepping, integrating = MODES[version]
        exchanges = use == "exchange" and unit is units[0]
        made = ("SetContinuousStates", integrating) if exchanges else ("DoStep", stepping)
        assert (f"fmi{version}{made[0]}", made[1]) in judge.seen


@pytest.fixture(scope="module")
def recorded(strict, tmp_path_factory):
    """Calls of correct runs, for one version and interface each."""
    folder = tmp_path_factory.mktemp("recorded")

    @cache
    def calls(version: str, kind: str):
        path = interpose(ARCHIVES[version]("ReentryPlant"), strict[version], folder / f"{version}.fmu")
        with pytest.MonkeyPatch.context() as patch:
            logs = folder / f"{version}{kind}"
            logs.mkdir()
            patch.setenv("LC_STRICT_LOGS", str(logs))
            more = {"use_event_mode": True, "early_return_allowed": False} if version == "3" and kind == "CoSimulation" else {}
            simulate_fmu(str(path), fmi_type=kind, stop_time=0.2, solver="CVode", output_interval=0.04, **more)
        return read_model_description(path), read(next(logs.iterdir()))

    return calls


def change(calls: list[dict], function: str, where: str = "first", **values) -> list[dict]:
    """Changes arguments or results of one call."""
    calls = [call | {"in": dict(call["in"]), "out": dict(call["out"])} for call in calls]
    found = [call for call in calls if call["call"] == function]
    call = found[0 if where == "first" else -1]
    for name, value in values.items():
        (call if name == "status" else call["in"] if name in call["in"] else call["out"])[name] = value
    return calls


def without(calls: list[dict], function: str, every: bool = False) -> list[dict]:
    place = next(place for place, call in enumerate(calls) if call["call"] == function)
    return [call for other, call in enumerate(calls) if not (call["call"] == function and (every or other == place))]


def again(calls: list[dict], function: str, behind: str) -> list[dict]:
    """Makes a call once more, behind the last call of another function."""
    call = next(call for call in calls if call["call"] == function)
    place = max(place for place, other in enumerate(calls) if other["call"] == behind)
    return [*calls[: place + 1], call, *calls[place + 1 :]]


def block(language: str) -> str:
    """The program of a language in the page's section about FMI 3.0."""
    _, page = (ROOT / "docs" / "use-it.md").read_text().split("\n## FMI 3.0\n")
    return re.search(rf"```{language}\n(.*?)```", page, re.S)[1]


def test_the_documented_loop_in_c_is_that_in_python_and_keeps_to_the_standard(watched, tmp_path):
    units = [watched(name, "3") for name in ("ReentryPlant", "CRMPC")]
    (tmp_path / "loop.c").write_text(block("c"))
    (tmp_path / "loop.py").write_text(block("python").replace("target/fmi3", str(TARGET / "fmi3")))
    subprocess.run(["cc", "-Wall", "-Werror", "-I", HEADERS, tmp_path / "loop.c", "-o", tmp_path / "loop", "-ldl"], check=True)
    arguments = []
    for unit in units:
        library = unit.fmu.folder / "binaries" / "x86_64-linux" / unit.log.stem
        arguments += [library, unit.fmu.description.instantiationToken, str(unit.fmu.variables["moment.x"].valueReference)]
    commands = [[tmp_path / "loop", *arguments], [sys.executable, tmp_path / "loop.py"]]
    said = [subprocess.run(command, capture_output=True, text=True, check=True).stdout for command in commands]
    assert said[0] == said[1] != ""
    for unit in units:
        judge = unit.judge()
        assert judge.broken == []
        assert {("fmi3DoStep", "step"), ("fmi3UpdateDiscreteStates", "event")} <= judge.seen


# A change of a correct run, and what the judge must say of it.
BROKEN = {
    "a step from another time": ("2", "CoSimulation", lambda c: change(c, "fmi2DoStep", "last", currentCommunicationPoint=7.0), "the unit stands at"),
    "a step backwards": ("2", "CoSimulation", lambda c: change(c, "fmi2DoStep", communicationStepSize=-0.1), "of length -0.1"),
    "beyond the stop time": ("2", "CoSimulation", lambda c: change(c, "fmi2DoStep", "last", communicationStepSize=9.0), "beyond the stop time"),
    "no end of initialization": ("2", "CoSimulation", lambda c: without(c, "fmi2ExitInitializationMode"), "fmi2DoStep is not allowed in state initialization"),
    "not freed": ("2", "CoSimulation", lambda c: without(c, "fmi2FreeInstance"), "was not freed"),
    "used after it was freed": ("2", "CoSimulation", lambda c: again(c, "fmi2GetReal", "fmi2FreeInstance"), "does not exist"),
    "a refused step": ("2", "CoSimulation", lambda c: change(c, "fmi2DoStep", status=3), "refused in state complete"),
    "set after the end": ("2", "CoSimulation", lambda c: again(c, "fmi2SetupExperiment", "fmi2Terminate"), "fmi2SetupExperiment is not allowed in state terminated"),
    "a status that does not exist": ("2", "CoSimulation", lambda c: change(c, "fmi2DoStep", status=9), "has the status 9"),
    "an unknown variable": ("2", "CoSimulation", lambda c: change(c, "fmi2GetReal", vr=[4_000_000]), "unknown value reference"),
    "an event is passed": ("3", "CoSimulation", lambda c: change(c, "fmi3UpdateDiscreteStates", nextEventTimeDefined=1, nextEventTime=0.01), "past the event at 0.01"),
    "an iteration ends early": ("3", "CoSimulation", lambda c: change(c, "fmi3UpdateDiscreteStates", discreteStatesNeedUpdate=1), "event iteration has not ended"),
    "an event is not handled": ("3", "CoSimulation", lambda c: change(c, "fmi3DoStep", eventHandlingNeeded=1), "although the unit asked for event mode"),
    "the end is not heard": ("3", "CoSimulation", lambda c: change(c, "fmi3DoStep", terminateSimulation=1), "asked for the end"),
    "an early return nobody allowed": ("3", "CoSimulation", lambda c: change(c, "fmi3DoStep", earlyReturn=1), "returns early, which is not allowed"),
    "a step that is not completed": ("3", "CoSimulation", lambda c: change(c, "fmi3DoStep", lastSuccessfulTime=0.01), "says nothing"),
    "states set in event mode": ("3", "ModelExchange", lambda c: again(c, "fmi3SetContinuousStates", "fmi3EnterEventMode"), "is not allowed in state event"),
    "a step of co-simulation": ("3", "ModelExchange", lambda c: [*c[:-1], c[-1] | {"call": "fmi3EnterStepMode"}, c[-1]], "does not exist"),
    "back beyond a step": ("3", "ModelExchange", lambda c: change(c, "fmi3SetTime", "last", time=0.0), "back to 0.0"),
    "states not read": ("2", "ModelExchange", lambda c: without(change(c, "fmi2NewDiscreteStates", valuesOfContinuousStatesChanged=1), "fmi2GetContinuousStates", True), "new states were not read"),
}


@pytest.mark.parametrize("what", BROKEN)
def test_a_broken_rule_is_found(recorded, what):
    version, kind, alter, said = BROKEN[what]
    description, calls = recorded(version, kind)
    assert Judge(version, description).all(calls) == []
    broken = Judge(version, description).all(alter(calls))
    assert any(said in line for line in broken), broken
