//! The functions that may be called in each state, and for which variables: the tables of FMI
//! 2.0.5, sections 3.2.3 (model exchange) and 4.2.4 (co-simulation).

use crate::interface::{DISCARD, ERROR, EventInfo, FmuState, MODEL_EXCHANGE, OK, Status};
use crate::{Fmu, Instance, c, ok};
use model_description::ModelDescription;
use model_description::variable::{Causality, VariableKind};
use std::ffi::c_int;
use std::ptr::{null, null_mut};

/// Columns of the tables that an instance can be in. The column `start` has no instance, `fatal` is
/// not reached, and steps are never in progress, because no FMU computes them asynchronously.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names are the standard's")]
pub enum State {
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

impl State {
    /// Letter of the state in [`TABLE`].
    fn letter(self) -> char {
        match self {
            Instantiated => 'I',
            InitializationMode => 'N',
            EventMode => 'E',
            ContinuousTimeMode => 'C',
            StepComplete => 'S',
            Terminated => 'T',
            Error => 'X',
        }
    }
}

/// Returns the states of an interface.
pub fn states(fmu_type: c_int) -> Vec<State> {
    let running = match fmu_type {
        MODEL_EXCHANGE => vec![EventMode, ContinuousTimeMode],
        _ => vec![StepComplete],
    };
    [vec![Instantiated, InitializationMode], running, vec![Terminated, Error]].concat()
}

/// Makes a new instance and brings it to that state.
pub fn instance_in(fmu: &Fmu, fmu_type: c_int, state: State) -> Instance {
    let instance = fmu.instance(fmu_type);
    match state {
        Instantiated => instance,
        InitializationMode => {
            instance.enter_initialization();
            instance
        }
        EventMode | StepComplete => instance.initialized(),
        ContinuousTimeMode => {
            let instance = instance.initialized();
            ok!(instance, fmi2NewDiscreteStates(&mut EventInfo::default()));
            ok!(instance, fmi2EnterContinuousTimeMode());
            instance
        }
        Terminated => {
            let instance = instance.initialized();
            ok!(instance, fmi2Terminate());
            instance
        }
        Error => {
            let instance = instance.initialized();
            assert_eq!(instance.set_real(fmu.input(), f64::NAN), ERROR);
            instance
        }
    }
}

/// Call of a function with valid arguments.
pub type Caller = fn(&Instance, FmuState) -> Status;

/// A row of the table: the function, a call, the states of model exchange and of co-simulation in
/// which it is allowed (empty: not a function of that interface), and the status that it returns
/// where it is allowed.
#[derive(Clone, Copy, Debug)]
pub struct Row(pub &'static str, pub Caller, pub &'static str, pub &'static str, pub Status);

impl Row {
    /// Whether the function may be called in a state of that interface.
    pub fn is_allowed(&self, fmu_type: c_int, state: State) -> bool {
        let Self(_, _, exchange, simulation, _) = self;
        if fmu_type == MODEL_EXCHANGE { exchange } else { simulation }.contains(state.letter())
    }
}

/// Gets all variables of a kind.
macro_rules! get_all {
    ($i:expr, $get:ident, $kind:pat, $empty:expr) => {{
        let references = $i.fmu.references(|variable| matches!(variable.kind, $kind));
        let mut values = vec![$empty; references.len()];
        c!($i, $get($i.component, references.as_ptr(), references.len(), values.as_mut_ptr()))
    }};
}

/// All functions that answer for an instance. `fmi2FreeInstance` returns nothing and has its own
/// test, as have the functions that need no instance.
///
/// The variables that may be set are fewer, see [`settable`]. The standard allows `fmi2GetXXX` in
/// initialization mode for outputs, states and derivatives only; the FMUs return every variable.
#[rustfmt::skip]
pub const TABLE: &[Row] = &[
    Row("fmi2SetDebugLogging",               |i, _| c!(i, fmi2SetDebugLogging(i.component, 1, 0, null())),        "INECTX", "INSTX", OK),
    Row("fmi2SetupExperiment",               |i, _| c!(i, fmi2SetupExperiment(i.component, 1, 1e-4, 0.0, 1, 9.0)), "I",     "I",     OK),
    Row("fmi2EnterInitializationMode",       |i, _| c!(i, fmi2EnterInitializationMode(i.component)),              "I",      "I",     OK),
    Row("fmi2ExitInitializationMode",        |i, _| c!(i, fmi2ExitInitializationMode(i.component)),               "N",      "N",     OK),
    Row("fmi2Terminate",                     |i, _| c!(i, fmi2Terminate(i.component)),                            "EC",     "S",     OK),
    Row("fmi2Reset",                         |i, _| c!(i, fmi2Reset(i.component)),                                "INECTX", "INSTX", OK),
    Row("fmi2GetReal",                       |i, _| get_all!(i, fmi2GetReal, VariableKind::Real { .. }, 0.0), "NECTX",  "NSTX",  OK),
    Row("fmi2GetInteger",                    |i, _| get_all!(i, fmi2GetInteger, VariableKind::Integer { .. } | VariableKind::Enumeration { .. }, 0), "NECTX",  "NSTX",  OK),
    Row("fmi2GetBoolean",                    |i, _| get_all!(i, fmi2GetBoolean, VariableKind::Boolean { .. }, 0), "NECTX",  "NSTX",  OK),
    Row("fmi2GetString",                     |i, _| get_all!(i, fmi2GetString, VariableKind::String { .. }, null()), "NECTX",  "NSTX",  OK),
    Row("fmi2SetReal",                       |i, _| i.set_real(i.fmu.input(), 0.01),                             "INEC",   "INS",   OK),
    Row("fmi2SetInteger",                    |i, _| c!(i, fmi2SetInteger(i.component, null(), 0, null())),        "INE",    "INS",   OK),
    Row("fmi2SetBoolean",                    |i, _| c!(i, fmi2SetBoolean(i.component, null(), 0, null())),        "INE",    "INS",   OK),
    Row("fmi2SetString",                     |i, _| c!(i, fmi2SetString(i.component, null(), 0, null())),         "INE",    "INS",   OK),
    Row("fmi2GetFMUstate",                   |i, _| c!(i, fmi2GetFMUstate(i.component, &mut null_mut())),         "INECTX", "INSTX", OK),
    Row("fmi2SetFMUstate",                   |i, s| c!(i, fmi2SetFMUstate(i.component, s)),                       "INECTX", "INSTX", OK),
    Row("fmi2FreeFMUstate",                  |i, _| free_state(i),                                                "INECTX", "INSTX", OK),
    Row("fmi2SerializedFMUstateSize",        |i, s| c!(i, fmi2SerializedFMUstateSize(i.component, s, &mut 0)),    "INECTX", "INSTX", OK),
    Row("fmi2SerializeFMUstate",             serialize,                                                           "INECTX", "INSTX", OK),
    Row("fmi2DeSerializeFMUstate",           |i, _| i.deserialize(&i.serialize()).0,                              "INECTX", "INSTX", OK),
    Row("fmi2GetDirectionalDerivative",      |i, _| directional_derivative(i),                                    "NECTX",  "NSTX",  OK),

    Row("fmi2EnterEventMode",                |i, _| c!(i, fmi2EnterEventMode(i.component)),                       "EC",     "",      OK),
    Row("fmi2NewDiscreteStates",             |i, _| c!(i, fmi2NewDiscreteStates(i.component, &mut EventInfo::default())), "E", "",   OK),
    Row("fmi2EnterContinuousTimeMode",       |i, _| c!(i, fmi2EnterContinuousTimeMode(i.component)),              "E",      "",      OK),
    Row("fmi2CompletedIntegratorStep",       |i, _| c!(i, fmi2CompletedIntegratorStep(i.component, 1, &mut 0, &mut 0)), "C", "",     OK),
    Row("fmi2SetTime",                       |i, _| c!(i, fmi2SetTime(i.component, 0.01)),                        "EC",     "",      OK),
    Row("fmi2SetContinuousStates",           |i, _| set_states(i),                                                "C",      "",      OK),
    Row("fmi2GetDerivatives",                |i, _| with_states(i, |i, x, n| c!(i, fmi2GetDerivatives(i.component, x, n))), "NECTX", "", OK),
    Row("fmi2GetEventIndicators",            |i, _| indicators(i),                                                "NECTX",  "",      OK),
    Row("fmi2GetContinuousStates",           |i, _| with_states(i, |i, x, n| c!(i, fmi2GetContinuousStates(i.component, x, n))), "NECTX", "", OK),
    Row("fmi2GetNominalsOfContinuousStates", |i, _| with_states(i, |i, x, n| c!(i, fmi2GetNominalsOfContinuousStates(i.component, x, n))), "IECTX", "", OK),

    Row("fmi2SetRealInputDerivatives",       |i, _| c!(i, fmi2SetRealInputDerivatives(i.component, &i.fmu.input(), 1, &1, &0.1)), "", "INS", OK),
    Row("fmi2GetRealOutputDerivatives",      |i, _| c!(i, fmi2GetRealOutputDerivatives(i.component, null(), 0, null(), null_mut())), "", "STX", OK),
    Row("fmi2DoStep",                        |i, _| i.step(0.0, i.fmu.description.default_experiment.step),      "",       "S",     OK),
    Row("fmi2CancelStep",                    |i, _| c!(i, fmi2CancelStep(i.component)),                           "",       "",      OK),
    Row("fmi2GetStatus",                     |i, _| c!(i, fmi2GetStatus(i.component, 0, &mut 0)),                 "",       "ST",    OK),
    Row("fmi2GetRealStatus",                 |i, _| c!(i, fmi2GetRealStatus(i.component, 2, &mut 0.0)),           "",       "ST",    OK),
    // FMI defines no status of type Integer.
    Row("fmi2GetIntegerStatus",              |i, _| c!(i, fmi2GetIntegerStatus(i.component, 2, &mut 0)),          "",       "ST",    DISCARD),
    Row("fmi2GetBooleanStatus",              |i, _| c!(i, fmi2GetBooleanStatus(i.component, 3, &mut 0)),          "",       "ST",    OK),
    Row("fmi2GetStringStatus",               |i, _| c!(i, fmi2GetStringStatus(i.component, 1, &mut null())),      "",       "ST",    OK),
];

fn free_state(i: &Instance) -> Status {
    c!(i, fmi2FreeFMUstate(i.component, &mut { i.save() }))
}

fn serialize(i: &Instance, state: FmuState) -> Status {
    let mut bytes = vec![0u8; 1 << 20];
    c!(i, fmi2SerializeFMUstate(i.component, state, bytes.as_mut_ptr().cast(), bytes.len()))
}

/// Asks for the derivative of the first state derivative with respect to the first state, or for
/// none if the FMU has no states.
fn directional_derivative(i: &Instance) -> Status {
    let states = i.fmu.description.states();
    let (states, derivatives): (Vec<_>, Vec<_>) =
        states.iter().take(1).map(|&(state, derivative)| (state as u32, derivative as u32)).unzip();
    let n = states.len();
    c!(
        i,
        fmi2GetDirectionalDerivative(
            i.component,
            derivatives.as_ptr(),
            n,
            states.as_ptr(),
            n,
            &1.0,
            &mut 0.0
        )
    )
}

fn with_states(i: &Instance, call: fn(&Instance, *mut f64, usize) -> Status) -> Status {
    let mut x = vec![0.0; i.fmu.description.states().len()];
    call(i, x.as_mut_ptr(), x.len())
}

/// Sets the continuous states to their present values.
fn set_states(i: &Instance) -> Status {
    with_states(i, |i, x, n| {
        // In states where they cannot be read they cannot be set either; the second call must be
        // the one that reports it.
        let saved_state = i.save();
        if c!(i, fmi2GetContinuousStates(i.component, x, n)) != OK {
            i.restore(saved_state);
        }
        c!(i, fmi2SetContinuousStates(i.component, x, n))
    })
}

fn indicators(i: &Instance) -> Status {
    let mut values = vec![0.0; i.fmu.description.event_indicators];
    c!(i, fmi2GetEventIndicators(i.component, values.as_mut_ptr(), values.len()))
}

/// Whether the variable with a value reference may be set in a state: conditions 1, 3, 4, 5 and 6
/// of the tables. No FMU has tunable parameters or constants.
///
/// There are two differences from the tables. An input may also be set before initialization,
/// because importers set all start values there, and section 2.2.7 gives inputs one. Condition 5
/// allows only continuous inputs in continuous-time mode, but FMPy sets all inputs there: a
/// discrete Real is accepted and waits for the next event.
pub fn settable(description: &ModelDescription, reference: u32, state: State) -> bool {
    let position = reference as usize;
    let Some(variable) = description.variables.get(position) else { return false };
    let real = matches!(variable.kind, VariableKind::Real { .. });
    match variable.causality {
        Causality::Parameter => matches!(state, Instantiated | InitializationMode),
        Causality::Input => match state {
            Instantiated | InitializationMode | EventMode | StepComplete => true,
            ContinuousTimeMode => real,
            Terminated | Error => false,
        },
        _ => {
            let is_state = || description.states().iter().any(|state| state.0 == position);
            state == ContinuousTimeMode && is_state()
        }
    }
}
