"""Checks recorded calls against the standard's state machine: those of the importer, and what the unit
answers."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field

from strict.rules import VARIABLES, Rule, rules

OK, WARNING, DISCARD, ERROR, FATAL, PENDING = range(6)
# State to which a function leads if it succeeds.
LEADS = {
    "EnterInitializationMode": "initialization",
    "EnterEventMode": "event",
    "EnterContinuousTimeMode": "continuous",
    "EnterStepMode": "step",
    "Terminate": "terminated",
    "Reset": "instantiated",
}
# Values of one type are got and set by functions of their own; the tables name FMI 3.0's once.
TYPED = re.compile(r"fmi3(Get|Set)(Float32|Float64|U?Int(8|16|32|64)|Boolean|String|Binary)$")
# A time as exact as a sum of steps.
EXACT = 1e-9


@dataclass
class Life:
    """An instance as the standard sees it."""

    version: str
    interface: str
    events: bool
    early: bool
    table: dict[tuple[str, str], Rule]
    # None after a state was set whose origin is not known.
    state: str | None = "instantiated"
    time: float | None = None
    stop: float | None = None
    next_event: float | None = None
    was_set: bool = False
    iterating: bool = False
    event_due: bool = False
    ends: bool = False
    # States that an event has changed must be read.
    unread: bool = False
    # Times before this one must not be set again, and that of the last completed step.
    floor: float = -math.inf
    completed: float = -math.inf
    states: dict[str, tuple | None] = field(default_factory=dict)

    def forget(self) -> None:
        """Forgets what was due, as another state of the unit was set."""
        self.was_set = self.iterating = self.event_due = self.ends = self.unread = False
        self.floor = self.completed = -math.inf


class Judge:
    """Collects what breaks a rule."""

    def __init__(self, version: str, description):
        self.version = version
        self.variables: dict[int, list] = {}
        for variable in description.modelVariables:
            self.variables.setdefault(variable.valueReference, []).append(variable)
        self.continuous = {variable.derivative.name for variable in description.modelVariables if variable.derivative}
        self.unknown = {unknown.variable.name for unknown in description.initialUnknowns}
        self.lives: dict[str, Life] = {}
        self.serialized: dict[int, tuple | None] = {}
        self.broken: list[str] = []
        self.seen: set[tuple[str, str]] = set()

    def say(self, who: str, call: dict, text: str, section: str) -> None:
        self.broken.append(f"{who}: {call['call']} {text} (FMI {self.version}.0, {section})")

    def all(self, calls: list[dict], finished: bool = True) -> list[str]:
        """Returns what breaks a rule in a whole log."""
        for call in calls:
            self.one(call)
        if finished:
            for instance in self.lives:
                self.broken.append(f"importer: instance {instance} was not freed")
        return self.broken

    def one(self, call: dict) -> None:
        name = call["call"]
        if "Instantiate" in name:
            self.instantiate(call)
            return
        if name in ("fmi2GetVersion", "fmi2GetTypesPlatform", "fmi3GetVersion"):
            return
        life = self.lives.get(call["instance"])
        if life is None:
            self.say("importer", call, "for an instance that does not exist", "2.1.5" if self.version == "2" else "2.3.1")
            return
        self.allowed(life, call)
        self.order(life, call)
        self.answers(life, call)
        self.follow(life, call)

    def instantiate(self, call: dict) -> None:
        handle, given = call["out"]["answer"], call["in"]
        if handle == "(nil)":
            return
        exchange = given.get("fmuType") == 0 or call["call"].endswith("ModelExchange")
        interface = "ME" if exchange else "CS"
        events = bool(given.get("eventModeUsed"))
        early = bool(given.get("earlyReturnAllowed"))
        self.lives[handle] = Life(self.version, interface, events, early, rules(self.version, interface))

    def allowed(self, life: Life, call: dict) -> None:
        """The function must be allowed in this state, and for its variables."""
        name = call["call"]
        typed = TYPED.match(name)
        row = f"fmi3{typed[1]}" if typed else name
        if life.state is None:
            return
        rule = life.table.get((row, life.state))
        if rule is None:
            self.say("importer", call, f"in {life.interface}, where it does not exist", "2.3")
            return
        if rule.mark == ".":
            self.say("importer", call, f"is not allowed in state {life.state}", rule.section)
            return
        self.seen.add((name, life.state))
        if not re.search(r"(Get|Set)(Real|Integer|Boolean|String|Float|U?Int|Binary)", name):
            return
        for reference in next((value for value in call["in"].values() if isinstance(value, list)), []):
            named = self.variables.get(reference)
            if not named:
                self.say("importer", call, f"for the unknown value reference {reference}", rule.section)
            elif not any(
                rule.allows(self.version, variable, variable.name in self.continuous, variable.name in self.unknown)
                for variable in named
            ):
                text = f"for {named[0].name} in state {life.state}: only if {VARIABLES[rule.mark]}"
                self.say("importer", call, text, rule.section)

    def order(self, life: Life, call: dict) -> None:
        """What an answer of the unit obliges the importer to."""
        name, given = call["call"], call["in"]
        steps = name.endswith(("DoStep", "EnterStepMode", "EnterContinuousTimeMode", "SetContinuousStates"))
        if life.ends and (steps or name.endswith("CompletedIntegratorStep")):
            self.say("importer", call, "after the unit asked for the end of the simulation", "2.3.5")
        if life.iterating and steps:
            self.say("importer", call, "although the event iteration has not ended", "2.3.5")
        if life.event_due and steps:
            self.say("importer", call, "although the unit asked for event mode", "3.2.1 and 4.2.1")
        if life.interface == "CS" and life.was_set and re.search(r"Get(Real|Integer|Boolean|String|Float|U?Int)", name):
            if life.state in ("complete", "step"):
                self.say("importer", call, "after a value was set and before the step", "4.2.4 and 4.2.1")
        if name.endswith("DoStep"):
            begins, length = given["currentCommunicationPoint"], given["communicationStepSize"]
            if life.time is not None and abs(begins - life.time) > EXACT * max(1.0, abs(begins)):
                self.say("importer", call, f"from {begins}, the unit stands at {life.time}", "4.2.1")
            if not length > 0.0:
                self.say("importer", call, f"of length {length}", "4.2.1")
            if life.stop is not None and begins + length > life.stop * (1 + EXACT) + EXACT:
                self.say("importer", call, f"to {begins + length}, beyond the stop time {life.stop}", "2.1.6 and 2.3.2")
            if life.next_event is not None and begins + length > life.next_event + EXACT and not life.early:
                self.say("importer", call, f"past the event at {life.next_event}", "2.3.5")
        if name.endswith("SetTime"):
            time = given["time"]
            if time < life.floor - EXACT:
                self.say("importer", call, f"back to {time}, before {life.floor}", "3.2.1")
        # An integrator may try times beyond an event, but not accept them.
        if name.endswith(("CompletedIntegratorStep", "EnterEventMode")) and life.interface == "ME":
            if life.next_event is not None and life.time > life.next_event + EXACT:
                self.say("importer", call, f"past the event at {life.next_event}", "2.3.5 and 3.2.2")
        if name.endswith("EnterContinuousTimeMode") and life.unread:
            self.say("importer", call, "although the new states were not read", "2.3.5 and 3.2.2")

    def answers(self, life: Life, call: dict) -> None:
        """What the unit may answer."""
        name, out, status = call["call"], call["out"], call["status"]
        if status not in range(6 if life.version == "2" else 5):
            self.say("unit", call, f"has the status {status}", "2.1.3 and 2.2.4")
        if status == PENDING:
            self.say("unit", call, "is asynchronous, which was not offered", "4.2.2")
        if name == "fmi3DoStep" and status in (OK, WARNING):
            reached = out["lastSuccessfulTime"]
            ends = call["in"]["currentCommunicationPoint"] + call["in"]["communicationStepSize"]
            if out["eventHandlingNeeded"] and not life.events:
                self.say("unit", call, "asks for event mode, which is not used", "4.2.1")
            if out["earlyReturn"] and not life.early:
                self.say("unit", call, "returns early, which is not allowed", "4.2.1")
            if not out["earlyReturn"] and not out["terminateSimulation"] and abs(reached - ends) > EXACT * max(1.0, ends):
                self.say("unit", call, f"reached {reached} instead of {ends} and says nothing", "4.2.1")
            if reached > ends + EXACT * max(1.0, ends):
                self.say("unit", call, f"reached {reached}, beyond {ends}", "4.2.1")
        if life.state is not None and status == ERROR:
            self.say("unit", call, f"refused in state {life.state}", "2.3 and 3.2.3 and 4.2.4")

    def follow(self, life: Life, call: dict) -> None:
        """Follows the transitions."""
        name, given, out, status = call["call"], call["in"], call["out"], call["status"]
        short = name[4:]
        if short == "FreeInstance":
            del self.lives[call["instance"]]
            return
        if status == FATAL:
            life.state = "fatal"
        elif status == ERROR:
            life.state = "error" if life.version == "2" else "terminated"
        elif status == DISCARD and short == "DoStep":
            # FMI 3.0: the unit is in the state before the call.
            life.state = "failed" if life.version == "2" else life.state
        if status not in (OK, WARNING):
            return
        if short in ("SetupExperiment", "EnterInitializationMode") and "startTime" in given:
            life.time = given["startTime"]
            life.stop = given["stopTime"] if given["stopTimeDefined"] else None
        if short == "ExitInitializationMode":
            ready = "complete" if life.version == "2" else "event" if life.events else "step"
            life.state = "event" if life.interface == "ME" else ready
            life.was_set = False
        elif short in LEADS:
            life.state = LEADS[short]
        if short == "Reset":
            life.time = life.stop = life.next_event = None
            life.forget()
        if short in ("UpdateDiscreteStates", "NewDiscreteStates"):
            life.iterating = bool(out.get("discreteStatesNeedUpdate", out.get("newDiscreteStatesNeeded")))
            life.ends = bool(out["terminateSimulation"])
            life.unread |= bool(out["valuesOfContinuousStatesChanged"]) and life.interface == "ME"
            life.next_event = out["nextEventTime"] if out["nextEventTimeDefined"] else None
        if short == "GetContinuousStates":
            life.unread = False
        if short == "SetTime":
            life.time = given["time"]
        if short == "EnterEventMode":
            life.event_due, life.floor, life.completed = False, life.time if life.time is not None else -math.inf, -math.inf
            # A time event has to be announced anew.
            life.next_event = None
        if short == "CompletedIntegratorStep":
            life.floor, life.completed = max(life.floor, life.completed), life.time
            life.event_due = bool(out["enterEventMode"])
            life.ends = bool(out["terminateSimulation"])
        if short == "DoStep":
            life.was_set = False
            life.time = given["currentCommunicationPoint"] + given["communicationStepSize"]
            if life.version == "3":
                life.time, life.event_due = out["lastSuccessfulTime"], bool(out["eventHandlingNeeded"])
                life.ends = bool(out["terminateSimulation"])
        if re.match(r"Set(Real|Integer|Boolean|String|Float|U?Int|Binary)", short):
            life.was_set = True
        self.saved(life, short, given, out)

    def saved(self, life: Life, short: str, given: dict, out: dict) -> None:
        """A state that is set brings the state of the machine back with it."""
        kind = "FMUstate" if life.version == "2" else "FMUState"
        if short in ("GetFMUstate", "GetFMUState"):
            life.states[out[kind]] = (life.state, life.time, life.next_event)
        elif short in ("SetFMUstate", "SetFMUState"):
            kept = life.states.get(given[kind])
            life.state, life.time, life.next_event = kept or (None, None, None)
            life.forget()
        elif short in ("SerializeFMUstate", "SerializeFMUState"):
            self.serialized[out["bytes"]] = life.states.get(given[kind])
        elif short in ("DeSerializeFMUstate", "DeserializeFMUState"):
            life.states[out[kind]] = self.serialized.get(given["bytes"])
