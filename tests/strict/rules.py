"""Which function of FMI may be called in which state, as the standard writes it, with the section.

A table of FMI 2.0 has the columns of the standard's own (`x`: allowed; a number: allowed for some
variables, `VARIABLES`). FMI 3.0 describes each state by text; its tables are written in the same form.
"""

from __future__ import annotations

from dataclasses import dataclass

# Sections of FMI 2.0.5 and of FMI 3.0.2.
SECTION = {("2", "ME"): "3.2.3", ("2", "CS"): "4.2.4", ("3", "ME"): "2.3 and 3.2", ("3", "CS"): "2.3 and 4.2"}

COLUMNS = {
    ("2", "ME"): "instantiated initialization event continuous terminated error fatal",
    ("2", "CS"): "instantiated initialization complete failed canceled terminated error fatal",
    ("3", "ME"): "instantiated initialization event continuous terminated fatal",
    ("3", "CS"): "instantiated initialization event step terminated fatal",
}

# Steps in progress are left out, as no unit here is asynchronous.
TABLES = {
    ("2", "ME"): """
fmi2SetDebugLogging              x x x x x x .
fmi2FreeInstance                 x x x x x x .
fmi2SetupExperiment              x . . . . . .
fmi2EnterInitializationMode      x . . . . . .
fmi2ExitInitializationMode       . x . . . . .
fmi2Terminate                    . . x x . . .
fmi2Reset                        x x x x x x .
fmi2GetReal                      . 2 x x x 7 .
fmi2GetInteger                   . 2 x x x 7 .
fmi2GetBoolean                   . 2 x x x 7 .
fmi2GetString                    . 2 x x x 7 .
fmi2SetReal                      1 3 4 5 . . .
fmi2SetInteger                   1 3 4 . . . .
fmi2SetBoolean                   1 3 4 . . . .
fmi2SetString                    1 3 4 . . . .
fmi2GetFMUstate                  x x x x x 7 .
fmi2SetFMUstate                  x x x x x x .
fmi2FreeFMUstate                 x x x x x x .
fmi2SerializedFMUstateSize       x x x x x x .
fmi2SerializeFMUstate            x x x x x x .
fmi2DeSerializeFMUstate          x x x x x x .
fmi2GetDirectionalDerivative     . x x x x 7 .
fmi2EnterEventMode               . . x x . . .
fmi2NewDiscreteStates            . . x . . . .
fmi2EnterContinuousTimeMode      . . x . . . .
fmi2CompletedIntegratorStep      . . . x . . .
fmi2SetTime                      . . 8 x . . .
fmi2SetContinuousStates          . . . x . . .
fmi2GetEventIndicators           . x x x x 7 .
fmi2GetContinuousStates          . x x x x 7 .
fmi2GetDerivatives               . x x x x 7 .
fmi2GetNominalsOfContinuousStates x x x x x 7 .
""",
    ("2", "CS"): """
fmi2SetDebugLogging              x x x x x x x .
fmi2FreeInstance                 x x x x x x x .
fmi2SetupExperiment              x . . . . . . .
fmi2EnterInitializationMode      x . . . . . . .
fmi2ExitInitializationMode       . x . . . . . .
fmi2Terminate                    . . x x . . . .
fmi2Reset                        x x x x x x x .
fmi2GetReal                      . 2 x 8 7 x 7 .
fmi2GetInteger                   . 2 x 8 7 x 7 .
fmi2GetBoolean                   . 2 x 8 7 x 7 .
fmi2GetString                    . 2 x 8 7 x 7 .
fmi2SetReal                      1 3 6 . . . . .
fmi2SetInteger                   1 3 6 . . . . .
fmi2SetBoolean                   1 3 6 . . . . .
fmi2SetString                    1 3 6 . . . . .
fmi2GetFMUstate                  x x x 8 7 x 7 .
fmi2SetFMUstate                  x x x x x x x .
fmi2FreeFMUstate                 x x x x x x x .
fmi2SerializedFMUstateSize       x x x x x x x .
fmi2SerializeFMUstate            x x x x x x x .
fmi2DeSerializeFMUstate          x x x x x x x .
fmi2GetDirectionalDerivative     . x x 8 7 x 7 .
fmi2SetRealInputDerivatives      x x x . . . . .
fmi2GetRealOutputDerivatives     . . x 8 x x 7 .
fmi2DoStep                       . . x . . . . .
fmi2GetStatus                    . . x x . x . .
fmi2GetRealStatus                . . x x . x . .
fmi2GetIntegerStatus             . . x x . x . .
fmi2GetBooleanStatus             . . x x . x . .
fmi2GetStringStatus              . . x x . x . .
""",
    ("3", "ME"): """
fmi3EnterInitializationMode       x . . . . .
fmi3ExitInitializationMode        . x . . . .
fmi3Terminate                     . . x x . .
fmi3Get                           x x x x x .
fmi3Set                           1 3 4 5 . .
fmi3GetDirectionalDerivative      . x x x x .
fmi3GetAdjointDerivative          . x x x x .
fmi3EnterEventMode                . . . x . .
fmi3EvaluateDiscreteStates        . . x . . .
fmi3UpdateDiscreteStates          . . x . . .
fmi3EnterContinuousTimeMode       . . x . . .
fmi3CompletedIntegratorStep       . . . x . .
fmi3SetTime                       . . . x . .
fmi3SetContinuousStates           . . . x . .
fmi3GetEventIndicators            . x x x x .
fmi3GetContinuousStates           . x x x x .
fmi3GetContinuousStateDerivatives . x x x x .
fmi3GetNominalsOfContinuousStates . x x x x .
fmi3GetNumberOfContinuousStates   x . x . . .
fmi3GetNumberOfEventIndicators    x . x . . .
""",
    ("3", "CS"): """
fmi3EnterInitializationMode       x . . . . .
fmi3ExitInitializationMode        . x . . . .
fmi3Terminate                     . . x x . .
fmi3Get                           x x x x x .
fmi3Set                           1 3 4 4 . .
fmi3GetDirectionalDerivative      . x x x x .
fmi3GetAdjointDerivative          . x x x x .
fmi3GetOutputDerivatives          . . . x x .
fmi3EnterEventMode                . . . x . .
fmi3EvaluateDiscreteStates        . . x . . .
fmi3UpdateDiscreteStates          . . x . . .
fmi3EnterStepMode                 . . x . . .
fmi3DoStep                        . . . x . .
""",
}

# FMI 3.0, 2.3.1: allowed in every state until a function returns fmi3Fatal.
SETTABLE = ["SetDebugLogging", "Reset", "FreeInstance", "GetFMUState", "SetFMUState", "FreeFMUState"]
SETTABLE += ["SerializedFMUStateSize", "SerializeFMUState", "DeserializeFMUState"]

# For which variables a function with a number may be called. `initial` has the standard's defaults.
VARIABLES = {
    "1": "variability is not constant and initial is exact or approx",
    "2": "causality is output, or listed under InitialUnknowns",
    "3": "initial is exact and variability is not constant, or causality is input",
    "4": "causality is input, or a tunable parameter",
    "5": "a continuous input, or a continuous-time state",
    "6": "causality is input, or a tunable parameter",
}
ALWAYS = {"x", "7", "8"}


@dataclass(frozen=True)
class Rule:
    """A row of a table in one state."""

    mark: str
    section: str

    def allows(self, version: str, variable, is_state: bool, is_unknown: bool) -> bool:
        """Returns whether the function may be called for a variable of FMPy's model description, which
        may be a continuous-time state, or listed under InitialUnknowns."""
        if self.mark in ALWAYS:
            return True
        is_input = variable.causality == "input"
        can_change = variable.variability != "constant"
        tunable = variable.causality == "parameter" and variable.variability == "tunable"
        match self.mark:
            case "1":
                # FMI 2.0 gives inputs no `initial`, FMI 3.0 gives them `exact`.
                return can_change and (initial(variable) in ("exact", "approx") or is_input and version == "3")
            case "2":
                return variable.causality == "output" or is_unknown
            case "3":
                return is_input or initial(variable) == "exact" and can_change
            case "4" | "6":
                return is_input or tunable
            case "5":
                return is_input and variable.variability == "continuous" or is_state
        return False


def initial(variable) -> str:
    """The attribute `initial` with the defaults of FMI 2.0, 2.2.7, and FMI 3.0, 2.4.7.5."""
    if variable.initial:
        return variable.initial
    if variable.causality == "parameter" or variable.variability == "constant":
        return "exact"
    return "calculated"


def rules(version: str, interface: str) -> dict[tuple[str, str], Rule]:
    """The rule for each function and state."""
    key = (version, interface)
    states = COLUMNS[key].split()
    found = {}
    for line in TABLES[key].strip().splitlines():
        name, *marks = line.split()
        assert len(marks) == len(states), line
        found |= {(name, state): Rule(mark, SECTION[key]) for state, mark in zip(states, marks)}
    if version == "3":
        for name in SETTABLE:
            found |= {(f"fmi3{name}", state): Rule("." if state == "fatal" else "x", "2.3.1") for state in states}
    return found
