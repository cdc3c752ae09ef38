"""Every function of FMI 3.0 in every state and in any order, called by an importer in C that is compiled
with the headers of the standard."""

import subprocess
from random import Random

import pytest

from conftest import NAMES, ROOT
from fmi import Fmu
from strict.judge import LEADS
from strict.proxy import HEADERS
from strict.rules import rules


@pytest.fixture(scope="session")
def importer(tmp_path_factory):
    """Starts an importer in C, which takes lines of calls."""
    program = tmp_path_factory.mktemp("importer") / "importer"
    source = ROOT / "tests" / "strict" / "importer.c"
    subprocess.run(["cc", "-O1", "-Wall", "-Werror", "-I", HEADERS, source, "-o", program, "-ldl"], check=True)

    def call(unit: Fmu, interface: str, events: bool, lines: list[str]) -> tuple[list[str], int]:
        """Returns an answer to each line, and the largest memory of the process in kB."""
        description = unit.description
        library = unit.folder / "binaries" / "x86_64-linux" / f"{description.coSimulation.modelIdentifier}.so"
        reals = [variable for variable in description.modelVariables if variable.type == "Float64"]
        # A derivative of a state in the direction of an input, where there are both.
        known = next((v.valueReference for v in reals if v.name == "moment.x" and v.causality == "input"), 0)
        unknown = next((v.valueReference for v in reals if v.derivative), 0)
        numbers = [description.numberOfContinuousStates, len(description.eventIndicators), known, unknown]
        command = [program, library, description.instantiationToken, interface, int(events), *numbers]
        finished = subprocess.run([str(part) for part in command], input="\n".join(lines), capture_output=True, text=True)
        answers = finished.stdout.splitlines()
        assert finished.returncode == 0 and len(answers) == len(lines), finished.stderr
        return answers, int(finished.stderr)

    return call


KINDS = [(name, "CS", events) for name in NAMES for events in (False, True)] + [("ReentryPlant", "ME", False)]
# Where the units take more than they must: what FMI 2.0 allows, and what changes nothing. So does
# fmi3EnterEventMode in event mode.
NUMBERS = {"initialization", "continuous", "terminated"}
LENIENT = {
    "fmi3SetTime": {"event"},
    "fmi3GetNominalsOfContinuousStates": {"instantiated"},
    "fmi3GetNumberOfContinuousStates": NUMBERS,
    "fmi3GetNumberOfEventIndicators": NUMBERS,
}


def offered(unit: Fmu) -> dict[str, bool]:
    """What not every unit has."""
    text = (unit.folder / "modelDescription.xml").read_text()
    return {
        "fmi3GetDirectionalDerivative": 'providesDirectionalDerivatives="true"' in text,
        "fmi3GetAdjointDerivative": 'providesAdjointDerivatives="true"' in text,
        # No unit has derivatives of outputs, or states that are evaluated apart from an update.
        "fmi3GetOutputDerivatives": False,
        "fmi3EvaluateDiscreteStates": False,
    }


@pytest.mark.parametrize(("name", "interface", "events"), KINDS)
def test_calls_are_allowed_where_fmi_3_says(fmu3, importer, name, interface, events):
    unit = fmu3(name)
    description = unit.description
    table = rules("3", interface)
    reals = [variable for variable in description.modelVariables if variable.type == "Float64"]
    states = {variable.derivative.name for variable in reals if variable.derivative}
    has = offered(unit)
    lines, expected = [], []
    for (function, state), rule in table.items():
        if state == "fatal" or state == "event" and interface == "CS" and not events:
            continue
        for variable in reals if function == "fmi3Set" else reals[:1]:
            may = has.get(function, True) and rule.mark != "."
            if function == "fmi3Set":
                # FMPy sets all inputs in continuous-time mode, so that discrete ones are taken too.
                discrete = state == "continuous" and variable.causality == "input"
                may = may and (discrete or rule.allows("3", variable, variable.name in states, False))
            else:
                may = may or interface == "ME" and state in LENIENT.get(function, [])
            if function == "fmi3EnterEventMode":
                may = (may or state == "event") and (events or interface == "ME")
            lines.append(f"{state} {function} {variable.valueReference}")
            expected.append((state, function, variable.name, may))
    answers, _ = importer(unit, interface, events, lines)
    wrong = [(*each, answer) for each, answer in zip(expected, answers) if answer[:2] != ("0 " if each[3] else "3 ")]
    assert wrong == []
    # Whatever is refused is explained.
    assert [each for each, answer in zip(expected, answers) if not each[3] and len(answer) < 10] == []


def walk(table: dict, has: dict, interface: str, events: bool, random: Random) -> tuple[str, list[str], list[int]]:
    """A state, calls in any order, and the status of each by the standard. What is refused ends the
    simulation (2.3.1)."""
    names = sorted({name for name, _ in table if has.get(name, True)} - {"fmi3FreeInstance"})
    states = sorted({state for _, state in table} - {"fatal"} - (set() if events or interface == "ME" else {"event"}))
    begin = state = saved = random.choice(states)
    calls, statuses = [], []
    for _ in range(60):
        name = random.choice(names)
        if name == "fmi3DoStep" and events and "fmi3DoStep" in calls[-1:]:
            # The first of them may have asked for event mode.
            continue
        if state == "terminated" and name.endswith("Derivative"):
            # If an error ended the initialization, there is no plant to be differentiated.
            continue
        may = table[name, state].mark != "." or interface == "ME" and state in LENIENT.get(name, [])
        if name == "fmi3EnterEventMode":
            may = (may or state == "event") and (events or interface == "ME")
        calls.append(name)
        statuses.append(0 if may else 3)
        ready = "event" if events or interface == "ME" else "step"
        if not may:
            state = "terminated"
        elif name == "fmi3ExitInitializationMode":
            state = ready
        elif name == "fmi3GetFMUState":
            saved = state
        elif name == "fmi3SetFMUState":
            state = saved
        else:
            state = LEADS.get(name[4:], state)
    return begin, calls, statuses


@pytest.mark.parametrize(("name", "interface", "events"), KINDS)
def test_calls_in_any_order_are_answered_as_fmi_3_says(fmu3, importer, name, interface, events):
    unit, table, random = fmu3(name), rules("3", interface), Random(f"{name}{interface}{events}")
    inputs = [v.valueReference for v in unit.description.modelVariables if v.type == "Float64" and v.causality == "input"]
    walks = [walk(table, offered(unit), interface, events, random) for _ in range(200)]
    lines = [f"{begin} {','.join(calls)} {inputs[0]}" for begin, calls, _ in walks]
    for (begin, calls, expected), answer in zip(walks, importer(unit, interface, events, lines)[0]):
        statuses = [int(word) for word in answer.split()[: len(calls)]]
        wrong = next((place for place, pair in enumerate(zip(statuses, expected)) if pair[0] != pair[1]), None)
        assert wrong is None, " ".join([begin, *calls[max(0, wrong - 3) : wrong + 1], str(statuses[max(0, wrong - 3) : wrong + 1])])


@pytest.mark.parametrize("name", ["ReentryPlant", "CRMPC", "EntryNavigation"])
def test_no_instance_leaves_memory_behind(fmu3, importer, name):
    calls = "fmi3GetFMUState,fmi3DoStep,fmi3SetFMUState,fmi3DoStep,fmi3Reset 1"
    few, many = (importer(fmu3(name), "CS", False, [f"step {calls}"] * count)[1] for count in (50, 1500))
    # A state takes at least some kB.
    assert many - few < 1000
