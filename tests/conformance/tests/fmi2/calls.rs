//! Tests of the functions that may be called in each state, and for which variables: the tables of
//! FMI 2.0.4, sections 3.2.3 (model exchange) and 4.2.4 (co-simulation).

use conformance::interface::{
    CO_SIMULATION, DISCARD, ERROR, EventInfo, FUNCTIONS, FmuState, MODEL_EXCHANGE, OK, Status,
};
use conformance::{Instance, Unit, c, units};
use model_description::variable::{Causality, Kind, Variable};
use std::ffi::{CString, c_int};
use std::ptr::{null, null_mut};

/// Columns of the tables that an instance can be in. The column `start` has no instance, `fatal` is
/// not reached, and steps are never in progress, because no unit computes them asynchronously.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Instantiated,
    InitializationMode,
    EventMode,
    ContinuousTimeMode,
    StepComplete,
    Terminated,
    Error,
}

use State::{
    ContinuousTimeMode, Error, EventMode, InitializationMode, Instantiated, StepComplete,
    Terminated,
};

/// States with their letters in the table.
const STATES: [(State, char); 7] = [
    (Instantiated, 'I'),
    (InitializationMode, 'N'),
    (EventMode, 'E'),
    (ContinuousTimeMode, 'C'),
    (StepComplete, 'S'),
    (Terminated, 'T'),
    (Error, 'X'),
];

/// Returns the states of an interface.
fn states(fmu_type: c_int) -> Vec<(State, char)> {
    let foreign = if fmu_type == MODEL_EXCHANGE {
        vec![StepComplete]
    } else {
        vec![EventMode, ContinuousTimeMode]
    };
    STATES.into_iter().filter(|(state, _)| !foreign.contains(state)).collect()
}

/// Makes a new instance and brings it to that state.
fn instance_in(unit: &Unit, fmu_type: c_int, state: State) -> Instance {
    let instance = unit.instance(fmu_type);
    let component = instance.component;
    match state {
        Instantiated => instance,
        InitializationMode => {
            instance.enter_initialization();
            instance
        }
        EventMode | StepComplete => instance.initialized(),
        ContinuousTimeMode => {
            let instance = instance.initialized();
            instance.ok(c!(instance, fmi2NewDiscreteStates(component, &mut EventInfo::default())));
            instance.ok(c!(instance, fmi2EnterContinuousTimeMode(component)));
            instance
        }
        Terminated => {
            let instance = instance.initialized();
            instance.ok(c!(instance, fmi2Terminate(component)));
            instance
        }
        Error => {
            let instance = instance.initialized();
            assert_eq!(instance.set_real(unit.input(), f64::NAN), ERROR);
            instance
        }
    }
}

/// Call of a function with valid arguments.
type Caller = fn(&Instance, FmuState) -> Status;

/// A row has the function, a call, the states of model exchange and of co-simulation in which it is
/// allowed (empty: not a function of that interface), and the status that it returns where it is
/// allowed. `fmi2FreeInstance` returns nothing and has its own test, as have the functions that
/// need no instance.
///
/// The variables that may be set are fewer, as [`settable`] tells. The standard allows `fmi2GetXXX`
/// in initialization mode for outputs, states and derivatives only; the units return every
/// variable.
#[rustfmt::skip]
const TABLE: &[(&str, Caller, &str, &str, Status)] = &[
    ("fmi2SetDebugLogging",               |i, _| c!(i, fmi2SetDebugLogging(i.component, 1, 0, null())),        "INECTX", "INSTX", OK),
    ("fmi2SetupExperiment",               |i, _| c!(i, fmi2SetupExperiment(i.component, 1, 1e-4, 0.0, 1, 9.0)), "I",     "I",     OK),
    ("fmi2EnterInitializationMode",       |i, _| c!(i, fmi2EnterInitializationMode(i.component)),              "I",      "I",     OK),
    ("fmi2ExitInitializationMode",        |i, _| c!(i, fmi2ExitInitializationMode(i.component)),               "N",      "N",     OK),
    ("fmi2Terminate",                     |i, _| c!(i, fmi2Terminate(i.component)),                            "EC",     "S",     OK),
    ("fmi2Reset",                         |i, _| c!(i, fmi2Reset(i.component)),                                "INECTX", "INSTX", OK),
    ("fmi2GetReal",                       |i, _| get_real(i),                                                  "NECTX",  "NSTX",  OK),
    ("fmi2GetInteger",                    |i, _| get_integer(i),                                               "NECTX",  "NSTX",  OK),
    ("fmi2GetBoolean",                    |i, _| get_boolean(i),                                               "NECTX",  "NSTX",  OK),
    ("fmi2GetString",                     |i, _| get_string(i),                                                "NECTX",  "NSTX",  OK),
    ("fmi2SetReal",                       |i, _| i.set_real(i.unit.input(), 0.01),                             "INEC",   "INS",   OK),
    ("fmi2SetInteger",                    |i, _| c!(i, fmi2SetInteger(i.component, null(), 0, null())),        "INE",    "INS",   OK),
    ("fmi2SetBoolean",                    |i, _| c!(i, fmi2SetBoolean(i.component, null(), 0, null())),        "INE",    "INS",   OK),
    ("fmi2SetString",                     |i, _| c!(i, fmi2SetString(i.component, null(), 0, null())),         "INE",    "INS",   OK),
    ("fmi2GetFMUstate",                   |i, _| c!(i, fmi2GetFMUstate(i.component, &mut null_mut())),         "INECTX", "INSTX", OK),
    ("fmi2SetFMUstate",                   |i, s| c!(i, fmi2SetFMUstate(i.component, s)),                       "INECTX", "INSTX", OK),
    ("fmi2FreeFMUstate",                  |i, _| free_state(i),                                                "INECTX", "INSTX", OK),
    ("fmi2SerializedFMUstateSize",        |i, s| c!(i, fmi2SerializedFMUstateSize(i.component, s, &mut 0)),    "INECTX", "INSTX", OK),
    ("fmi2SerializeFMUstate",             serialize,                                                           "INECTX", "INSTX", OK),
    ("fmi2DeSerializeFMUstate",           |i, _| i.deserialize(&i.serialize()).0,                              "INECTX", "INSTX", OK),
    ("fmi2GetDirectionalDerivative",      |i, _| directional_derivative(i),                                    "NECTX",  "NSTX",  OK),

    ("fmi2EnterEventMode",                |i, _| c!(i, fmi2EnterEventMode(i.component)),                       "EC",     "",      OK),
    ("fmi2NewDiscreteStates",             |i, _| c!(i, fmi2NewDiscreteStates(i.component, &mut EventInfo::default())), "E", "",   OK),
    ("fmi2EnterContinuousTimeMode",       |i, _| c!(i, fmi2EnterContinuousTimeMode(i.component)),              "E",      "",      OK),
    ("fmi2CompletedIntegratorStep",       |i, _| c!(i, fmi2CompletedIntegratorStep(i.component, 1, &mut 0, &mut 0)), "C", "",     OK),
    ("fmi2SetTime",                       |i, _| c!(i, fmi2SetTime(i.component, 0.01)),                        "EC",     "",      OK),
    ("fmi2SetContinuousStates",           |i, _| set_states(i),                                                "C",      "",      OK),
    ("fmi2GetDerivatives",                |i, _| with_states(i, |i, x, n| c!(i, fmi2GetDerivatives(i.component, x, n))), "NECTX", "", OK),
    ("fmi2GetEventIndicators",            |i, _| indicators(i),                                                "NECTX",  "",      OK),
    ("fmi2GetContinuousStates",           |i, _| with_states(i, |i, x, n| c!(i, fmi2GetContinuousStates(i.component, x, n))), "NECTX", "", OK),
    ("fmi2GetNominalsOfContinuousStates", |i, _| with_states(i, |i, x, n| c!(i, fmi2GetNominalsOfContinuousStates(i.component, x, n))), "IECTX", "", OK),

    ("fmi2SetRealInputDerivatives",       |i, _| c!(i, fmi2SetRealInputDerivatives(i.component, &i.unit.input(), 1, &1, &0.1)), "", "INS", OK),
    ("fmi2GetRealOutputDerivatives",      |i, _| c!(i, fmi2GetRealOutputDerivatives(i.component, null(), 0, null(), null_mut())), "", "STX", OK),
    ("fmi2DoStep",                        |i, _| i.step(0.0, i.unit.description.default_experiment.step),      "",       "S",     OK),
    ("fmi2CancelStep",                    |i, _| c!(i, fmi2CancelStep(i.component)),                           "",       "",      OK),
    ("fmi2GetStatus",                     |i, _| c!(i, fmi2GetStatus(i.component, 0, &mut 0)),                 "",       "ST",    OK),
    ("fmi2GetRealStatus",                 |i, _| c!(i, fmi2GetRealStatus(i.component, 2, &mut 0.0)),           "",       "ST",    OK),
    // FMI defines no status of type Integer.
    ("fmi2GetIntegerStatus",              |i, _| c!(i, fmi2GetIntegerStatus(i.component, 2, &mut 0)),          "",       "ST",    DISCARD),
    ("fmi2GetBooleanStatus",              |i, _| c!(i, fmi2GetBooleanStatus(i.component, 3, &mut 0)),          "",       "ST",    OK),
    ("fmi2GetStringStatus",               |i, _| c!(i, fmi2GetStringStatus(i.component, 1, &mut null())),      "",       "ST",    OK),
];

fn get_real(i: &Instance) -> Status {
    let references = i.unit.references(|v| matches!(v.kind, Kind::Real { .. }));
    let mut values = vec![0.0; references.len()];
    c!(i, fmi2GetReal(i.component, references.as_ptr(), references.len(), values.as_mut_ptr()))
}

fn get_integer(i: &Instance) -> Status {
    let wanted = |v: &Variable| matches!(v.kind, Kind::Integer { .. } | Kind::Enumeration { .. });
    let references = i.unit.references(wanted);
    let mut values = vec![0; references.len()];
    c!(i, fmi2GetInteger(i.component, references.as_ptr(), references.len(), values.as_mut_ptr()))
}

fn get_boolean(i: &Instance) -> Status {
    let references = i.unit.references(|v| matches!(v.kind, Kind::Boolean { .. }));
    let mut values = vec![0; references.len()];
    c!(i, fmi2GetBoolean(i.component, references.as_ptr(), references.len(), values.as_mut_ptr()))
}

fn get_string(i: &Instance) -> Status {
    let references = i.unit.references(|v| matches!(v.kind, Kind::String { .. }));
    let mut values = vec![null(); references.len()];
    c!(i, fmi2GetString(i.component, references.as_ptr(), references.len(), values.as_mut_ptr()))
}

fn free_state(i: &Instance) -> Status {
    c!(i, fmi2FreeFMUstate(i.component, &mut { i.save() }))
}

fn serialize(i: &Instance, state: FmuState) -> Status {
    let mut bytes = vec![0u8; 1 << 20];
    c!(i, fmi2SerializeFMUstate(i.component, state, bytes.as_mut_ptr().cast(), bytes.len()))
}

/// Asks for the derivative of the first state derivative with respect to the first state, or for
/// none if the unit has no states.
fn directional_derivative(i: &Instance) -> Status {
    let states = i.unit.description.states();
    let (known, unknown): (Vec<_>, Vec<_>) =
        states.iter().take(1).map(|&(state, derivative)| (state as u32, derivative as u32)).unzip();
    let n = known.len();
    c!(
        i,
        fmi2GetDirectionalDerivative(
            i.component,
            unknown.as_ptr(),
            n,
            known.as_ptr(),
            n,
            &1.0,
            &mut 0.0
        )
    )
}

fn with_states(i: &Instance, call: fn(&Instance, *mut f64, usize) -> Status) -> Status {
    let mut x = vec![0.0; i.unit.description.states().len()];
    call(i, x.as_mut_ptr(), x.len())
}

/// Sets the continuous states to their present values.
fn set_states(i: &Instance) -> Status {
    with_states(i, |i, x, n| {
        // In states where they cannot be read they cannot be set either; the second call must be
        // the one that reports it.
        let here = i.save();
        if c!(i, fmi2GetContinuousStates(i.component, x, n)) != OK {
            i.restore(here);
        }
        c!(i, fmi2SetContinuousStates(i.component, x, n))
    })
}

fn indicators(i: &Instance) -> Status {
    let mut values = vec![0.0; i.unit.description.event_indicators];
    c!(i, fmi2GetEventIndicators(i.component, values.as_mut_ptr(), values.len()))
}

#[test]
fn the_table_has_every_function_that_answers_for_an_instance() {
    let others = ["fmi2GetTypesPlatform", "fmi2GetVersion", "fmi2Instantiate", "fmi2FreeInstance"];
    let rows: Vec<_> = TABLE.iter().map(|row| row.0).chain(others).collect();
    assert_eq!(rows.len(), FUNCTIONS.len());
    for function in FUNCTIONS {
        assert!(rows.contains(function), "{function}");
    }
}

/// Functions whose arguments come from the instance itself.
const OWN_ARGUMENTS: [&str; 3] =
    ["fmi2FreeFMUstate", "fmi2DeSerializeFMUstate", "fmi2SetContinuousStates"];

#[test]
fn without_an_instance_every_call_is_an_error() {
    for unit in units() {
        // A refused instantiation leaves NULL.
        let nobody = unit.instantiate(None, CO_SIMULATION, None, None);
        assert!(nobody.component.is_null());
        nobody.forget();
        for &(name, call, ..) in TABLE.iter().filter(|row| !OWN_ARGUMENTS.contains(&row.0)) {
            assert_eq!(call(&nobody, null_mut()), ERROR, "{name}");
        }
        let none = null_mut();
        assert_eq!(c!(nobody, fmi2FreeFMUstate(none, &mut null_mut())), ERROR);
        assert_eq!(c!(nobody, fmi2DeSerializeFMUstate(none, &0, 1, &mut null_mut())), ERROR);
        assert_eq!(c!(nobody, fmi2SetContinuousStates(none, &0.0, 1)), ERROR);
        c!(nobody, fmi2FreeInstance(none));
        assert!(nobody.messages().is_empty(), "there is nobody to say it");
    }
}

fn check(fmu_type: c_int) {
    let units: Vec<_> =
        units().into_iter().filter(|unit| unit.interfaces().contains(&fmu_type)).collect();
    for unit in &units {
        for (state, letter) in states(fmu_type) {
            let instance = instance_in(unit, fmu_type, state);
            let (here, before) = (instance.save(), instance.serialize());
            for &(name, call, exchange, simulation, answer) in TABLE {
                let what = format!("{}: {name} in {state:?}", unit.name());
                let allowed =
                    if fmu_type == MODEL_EXCHANGE { exchange } else { simulation }.contains(letter);
                // This is the one function that not every unit offers.
                let offered = name != "fmi2GetDirectionalDerivative"
                    || unit.description.directional_derivatives();
                instance.forget();
                let status = call(&instance, here);
                let text = instance
                    .messages()
                    .last()
                    .map_or(String::new(), |message| message.text.clone());
                if allowed && offered {
                    assert_eq!(status, answer, "{what}: {text}");
                } else {
                    assert_eq!(status, ERROR, "{what}: {text}");
                    assert!(text.starts_with(name), "{what}: {text}");
                    if offered {
                        let reasons = ["not allowed in state", "not available"];
                        assert!(
                            reasons.iter().any(|reason| text.contains(reason)),
                            "{what}: {text}"
                        );
                    }
                }
                // The instance returns to its state before the call, bit for bit, whatever was
                // refused.
                instance.restore(here);
                assert!(instance.serialize() == before, "{what}");
            }
        }
    }
}

#[test]
fn oracle_calls_of_co_simulation_are_allowed_where_the_standard_says() {
    check(CO_SIMULATION);
}

#[test]
fn oracle_calls_of_model_exchange_are_allowed_where_the_standard_says() {
    check(MODEL_EXCHANGE);
}

#[test]
fn after_a_refused_call_a_reset_makes_a_new_unit() {
    for unit in units() {
        for &fmu_type in unit.interfaces() {
            let drive =
                if fmu_type == MODEL_EXCHANGE { Instance::integrate } else { Instance::drive };
            let expected = drive(&unit.instance(fmu_type).initialized(), 0..3);
            for (state, _) in states(fmu_type) {
                let instance = instance_in(&unit, fmu_type, state);
                assert_eq!(c!(instance, fmi2CancelStep(instance.component)), ERROR);
                instance.ok(c!(instance, fmi2Reset(instance.component)));
                assert!(
                    drive(&instance.initialized(), 0..3) == expected,
                    "{} from {state:?}",
                    unit.name()
                );
            }
        }
    }
}

#[test]
fn a_unit_can_be_freed_in_every_state() {
    for unit in units() {
        for &fmu_type in unit.interfaces() {
            for (state, _) in states(fmu_type) {
                // The instance is freed at the end of its scope, with a saved state that was not
                // freed.
                instance_in(&unit, fmu_type, state).save();
            }
        }
    }
}

/// Whether a variable may be set in a state: conditions 1, 3, 4, 5 and 6 of the tables. No unit has
/// tunable parameters or constants.
///
/// There are two differences from the tables. An input may also be set before initialization,
/// because importers set all start values there, and section 2.2.7 gives inputs one. Condition 5
/// allows only continuous inputs in continuous-time mode, but FMPy sets all inputs there: a
/// discrete Real is accepted and waits for the next event.
fn settable(variable: &Variable, state: State) -> bool {
    let real = matches!(variable.kind, Kind::Real { .. });
    match variable.causality {
        Causality::Parameter => matches!(state, Instantiated | InitializationMode),
        Causality::Input => match state {
            Instantiated | InitializationMode | EventMode | StepComplete => true,
            ContinuousTimeMode => real,
            Terminated | Error => false,
        },
        _ => false,
    }
}

/// Sets a variable to its start value, and a calculated one to any value.
fn set(instance: &Instance, reference: u32) -> (&'static str, Status) {
    let component = instance.component;
    match &instance.unit.description.variables[reference as usize].kind {
        Kind::Real { start, .. } => {
            ("fmi2SetReal", instance.set_real(reference, start.unwrap_or_default()))
        }
        Kind::Integer { start, .. } | Kind::Enumeration { start, .. } => {
            let value = start.unwrap_or(1);
            ("fmi2SetInteger", c!(instance, fmi2SetInteger(component, &reference, 1, &value)))
        }
        Kind::Boolean { start } => {
            let value = c_int::from(start.unwrap_or_default());
            ("fmi2SetBoolean", c!(instance, fmi2SetBoolean(component, &reference, 1, &value)))
        }
        Kind::String { start } => {
            let value = CString::new(start.clone().unwrap_or_default()).unwrap();
            (
                "fmi2SetString",
                c!(instance, fmi2SetString(component, &reference, 1, &value.as_ptr())),
            )
        }
    }
}

#[test]
fn oracle_variables_can_be_set_where_the_standard_says() {
    for unit in units() {
        for &fmu_type in unit.interfaces() {
            for (state, _) in states(fmu_type) {
                let instance = instance_in(&unit, fmu_type, state);
                let here = instance.save();
                for (variable, reference) in unit.description.variables.iter().zip(0..) {
                    instance.forget();
                    let (function, status) = set(&instance, reference);
                    let what = format!("{}: {} in {state:?}", unit.name(), variable.name);
                    if settable(variable, state) {
                        assert_eq!(status, OK, "{what}: {:?}", instance.messages());
                    } else {
                        assert_eq!(status, ERROR, "{what}");
                        let text = &instance.messages()[0].text;
                        let named = text.contains(&format!("'{}'", variable.name));
                        assert!(text.starts_with(function), "{what}: {text}");
                        assert!(named || text.contains("not allowed in state"), "{what}: {text}");
                        instance.restore(here);
                    }
                }
            }
        }
    }
}
