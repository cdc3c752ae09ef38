//! Tests with NULL for every pointer argument, with pointers between two values, and with arrays
//! that overlap: the call reports an error that names the argument, or it succeeds where the
//! standard or importers need that.

use crate::prelude::*;
use conformance::interface::Callbacks;
use std::sync::atomic::AtomicU64;

type Call = fn(&Instance) -> Status;

/// Calls of both interfaces with one pointer NULL that must not be, and the text that the message
/// must hold.
#[rustfmt::skip]
const NULLS: &[(Call, &str)] = &[
    (|i| c!(i, fmi2SetDebugLogging(i.component, 1, 1, null())), "fmi2SetDebugLogging: argument 'categories' is NULL"),
    (|i| c!(i, fmi2SetDebugLogging(i.component, 1, 1, &null())), "fmi2SetDebugLogging: argument 'categories' is NULL"),
    (|i| c!(i, fmi2GetReal(i.component, null(), 1, &mut 0.0)), "fmi2GetReal: argument 'vr' is NULL"),
    (|i| c!(i, fmi2GetReal(i.component, &0, 1, null_mut())), "fmi2GetReal: argument 'value' is NULL"),
    (|i| c!(i, fmi2GetInteger(i.component, null(), 1, &mut 0)), "fmi2GetInteger: argument 'vr' is NULL"),
    (|i| c!(i, fmi2GetInteger(i.component, &0, 1, null_mut())), "fmi2GetInteger: argument 'value' is NULL"),
    (|i| c!(i, fmi2GetBoolean(i.component, null(), 1, &mut 0)), "fmi2GetBoolean: argument 'vr' is NULL"),
    (|i| c!(i, fmi2GetBoolean(i.component, &0, 1, null_mut())), "fmi2GetBoolean: argument 'value' is NULL"),
    (|i| c!(i, fmi2GetString(i.component, null(), 1, &mut null())), "fmi2GetString: argument 'vr' is NULL"),
    (|i| c!(i, fmi2GetString(i.component, &0, 1, null_mut())), "fmi2GetString: argument 'value' is NULL"),
    (|i| c!(i, fmi2SetReal(i.component, null(), 1, &0.0)), "fmi2SetReal: argument 'vr' is NULL"),
    (|i| c!(i, fmi2SetReal(i.component, &0, 1, null())), "fmi2SetReal: argument 'value' is NULL"),
    (|i| c!(i, fmi2SetInteger(i.component, null(), 1, &0)), "fmi2SetInteger: argument 'vr' is NULL"),
    (|i| c!(i, fmi2SetInteger(i.component, &0, 1, null())), "fmi2SetInteger: argument 'value' is NULL"),
    (|i| c!(i, fmi2SetBoolean(i.component, null(), 1, &0)), "fmi2SetBoolean: argument 'vr' is NULL"),
    (|i| c!(i, fmi2SetBoolean(i.component, &0, 1, null())), "fmi2SetBoolean: argument 'value' is NULL"),
    (|i| c!(i, fmi2SetString(i.component, null(), 1, &c"".as_ptr())), "fmi2SetString: argument 'vr' is NULL"),
    (|i| c!(i, fmi2SetString(i.component, &0, 1, null())), "fmi2SetString: argument 'value' is NULL"),
    (|i| c!(i, fmi2GetFMUstate(i.component, null_mut())), "fmi2GetFMUstate: argument 'FMUstate' is NULL"),
    (|i| c!(i, fmi2SetFMUstate(i.component, null_mut())), "fmi2SetFMUstate: argument 'FMUstate' is NULL"),
    (|i| c!(i, fmi2SerializedFMUstateSize(i.component, null_mut(), &mut 0)), "fmi2SerializedFMUstateSize: argument 'FMUstate' is NULL"),
    (|i| c!(i, fmi2SerializedFMUstateSize(i.component, i.save(), null_mut())), "fmi2SerializedFMUstateSize: argument 'size' is NULL"),
    (|i| c!(i, fmi2SerializeFMUstate(i.component, null_mut(), &mut 0, 1)), "fmi2SerializeFMUstate: argument 'FMUstate' is NULL"),
    (|i| c!(i, fmi2SerializeFMUstate(i.component, i.save(), null_mut(), 1 << 30)), "fmi2SerializeFMUstate: argument 'serializedState' is NULL"),
    (|i| c!(i, fmi2DeSerializeFMUstate(i.component, &0, 1, null_mut())), "fmi2DeSerializeFMUstate: argument 'FMUstate' is NULL"),
    (|i| c!(i, fmi2DeSerializeFMUstate(i.component, null(), 1, &mut null_mut())), "fmi2DeSerializeFMUstate: argument 'serializedState' is NULL"),
    (|i| c!(i, fmi2DeSerializeFMUstate(i.component, null(), 0, &mut null_mut())), "fmi2DeSerializeFMUstate: the saved state is truncated"),
    (|i| c!(i, fmi2GetDirectionalDerivative(i.component, null(), 1, &0, 1, &1.0, &mut 0.0)), "fmi2GetDirectionalDerivative: argument 'vUnknown_ref' is NULL"),
    (|i| c!(i, fmi2GetDirectionalDerivative(i.component, &0, 1, null(), 1, &1.0, &mut 0.0)), "fmi2GetDirectionalDerivative: argument 'vKnown_ref' is NULL"),
    (|i| c!(i, fmi2GetDirectionalDerivative(i.component, &0, 1, &0, 1, null(), &mut 0.0)), "fmi2GetDirectionalDerivative: argument 'dvKnown' is NULL"),
    (|i| c!(i, fmi2GetDirectionalDerivative(i.component, &0, 1, &0, 1, &1.0, null_mut())), "fmi2GetDirectionalDerivative: argument 'dvUnknown' is NULL"),
    // This count exceeds the address space.
    (|i| c!(i, fmi2GetReal(i.component, &0, usize::MAX, &mut 0.0)), "fmi2GetReal: argument 'vr' cannot have"),
];

/// Returns an address between two values, where there is room for a few.
fn between<T>() -> *mut T {
    static ROOM: [AtomicU64; 16] = [const { AtomicU64::new(0) }; 16];
    ROOM[0].as_ptr().cast::<u8>().wrapping_add(1).cast()
}

/// Calls with a pointer that cannot point to a value of its type, and the argument that is named.
#[rustfmt::skip]
const BETWEEN: &[(Call, &str)] = &[
    (|i| c!(i, fmi2SetDebugLogging(i.component, 1, 1, between())), "fmi2SetDebugLogging: argument 'categories' is at 0x"),
    (|i| c!(i, fmi2GetReal(i.component, between(), 1, &mut 0.0)), "fmi2GetReal: argument 'vr' is at 0x"),
    (|i| c!(i, fmi2GetReal(i.component, &0, 1, between())), "fmi2GetReal: argument 'value' is at 0x"),
    (|i| c!(i, fmi2GetInteger(i.component, &0, 1, between())), "fmi2GetInteger: argument 'value' is at 0x"),
    (|i| c!(i, fmi2GetBoolean(i.component, &0, 1, between())), "fmi2GetBoolean: argument 'value' is at 0x"),
    (|i| c!(i, fmi2GetString(i.component, &0, 1, between())), "fmi2GetString: argument 'value' is at 0x"),
    (|i| c!(i, fmi2SetReal(i.component, between(), 1, &0.0)), "fmi2SetReal: argument 'vr' is at 0x"),
    (|i| c!(i, fmi2SetReal(i.component, &0, 1, between())), "fmi2SetReal: argument 'value' is at 0x"),
    (|i| c!(i, fmi2SetInteger(i.component, &0, 1, between())), "fmi2SetInteger: argument 'value' is at 0x"),
    (|i| c!(i, fmi2SetBoolean(i.component, &0, 1, between())), "fmi2SetBoolean: argument 'value' is at 0x"),
    (|i| c!(i, fmi2SetString(i.component, &0, 1, between())), "fmi2SetString: argument 'value' is at 0x"),
    (|i| c!(i, fmi2GetFMUstate(i.component, between())), "fmi2GetFMUstate: argument 'FMUstate' is at 0x"),
    (|i| c!(i, fmi2FreeFMUstate(i.component, between())), "fmi2FreeFMUstate: argument 'FMUstate' is at 0x"),
    (|i| c!(i, fmi2SerializedFMUstateSize(i.component, i.save(), between())), "fmi2SerializedFMUstateSize: argument 'size' is at 0x"),
    (|i| c!(i, fmi2DeSerializeFMUstate(i.component, &0, 1, between())), "fmi2DeSerializeFMUstate: argument 'FMUstate' is at 0x"),
    (|i| c!(i, fmi2GetDirectionalDerivative(i.component, between(), 1, &0, 1, &1.0, &mut 0.0)), "fmi2GetDirectionalDerivative: argument 'vUnknown_ref' is at 0x"),
    (|i| c!(i, fmi2GetDirectionalDerivative(i.component, &0, 1, between(), 1, &1.0, &mut 0.0)), "fmi2GetDirectionalDerivative: argument 'vKnown_ref' is at 0x"),
    (|i| c!(i, fmi2GetDirectionalDerivative(i.component, &0, 1, &0, 1, between(), &mut 0.0)), "fmi2GetDirectionalDerivative: argument 'dvKnown' is at 0x"),
    (|i| c!(i, fmi2GetDirectionalDerivative(i.component, &0, 1, &0, 1, &1.0, between())), "fmi2GetDirectionalDerivative: argument 'dvUnknown' is at 0x"),
];

/// Calls whose results would overwrite their input.
#[rustfmt::skip]
const OVERLAPS: &[(Call, &str)] = &[
    (|i| overlapping(|p| c!(i, fmi2GetReal(i.component, p.cast(), 2, p))), "fmi2GetReal: arguments 'vr' and 'value' overlap"),
    (|i| overlapping(|p| c!(i, fmi2GetReal(i.component, p.wrapping_add(1).cast(), 2, p))), "fmi2GetReal: arguments 'vr' and 'value' overlap"),
    (|i| overlapping(|p| c!(i, fmi2GetInteger(i.component, p.cast(), 2, p.cast()))), "fmi2GetInteger: arguments 'vr' and 'value' overlap"),
    (|i| overlapping(|p| c!(i, fmi2GetBoolean(i.component, p.cast(), 2, p.cast()))), "fmi2GetBoolean: arguments 'vr' and 'value' overlap"),
    (|i| overlapping(|p| c!(i, fmi2GetString(i.component, p.cast(), 2, p.cast()))), "fmi2GetString: arguments 'vr' and 'value' overlap"),
    (|i| overlapping(|p| c!(i, fmi2GetDirectionalDerivative(i.component, &0, 1, &0, 1, p, p))), "fmi2GetDirectionalDerivative: arguments 'dvKnown' and 'dvUnknown' overlap"),
    (|i| overlapping(|p| c!(i, fmi2GetDirectionalDerivative(i.component, p.cast(), 1, &0, 1, &1.0, p))), "fmi2GetDirectionalDerivative: arguments 'vUnknown_ref' and 'dvUnknown' overlap"),
    (|i| overlapping(|p| c!(i, fmi2GetDirectionalDerivative(i.component, &0, 1, p.cast(), 1, &1.0, p))), "fmi2GetDirectionalDerivative: arguments 'vKnown_ref' and 'dvUnknown' overlap"),
];

/// Makes a call with an array of four numbers.
fn overlapping(call: impl Fn(*mut f64) -> Status) -> Status {
    call([0.0; 4].as_mut_ptr())
}

/// Such calls in event mode, for model exchange only.
#[rustfmt::skip]
const NULLS_OF_EXCHANGE: &[(Call, &str)] = &[
    (|i| c!(i, fmi2NewDiscreteStates(i.component, null_mut())), "fmi2NewDiscreteStates: argument 'fmi2eventInfo' is NULL"),
    (|i| c!(i, fmi2GetDerivatives(i.component, null_mut(), 1)), "fmi2GetDerivatives: argument 'derivatives' is NULL"),
    (|i| c!(i, fmi2GetEventIndicators(i.component, null_mut(), 1)), "fmi2GetEventIndicators: argument 'eventIndicators' is NULL"),
    (|i| c!(i, fmi2GetContinuousStates(i.component, null_mut(), 1)), "fmi2GetContinuousStates: argument 'x' is NULL"),
    (|i| c!(i, fmi2GetNominalsOfContinuousStates(i.component, null_mut(), 1)), "fmi2GetNominalsOfContinuousStates: argument 'x_nominal' is NULL"),
    // No values are requested, although the FMU has some.
    (|i| c!(i, fmi2GetDerivatives(i.component, null_mut(), 0)), "fmi2GetDerivatives: room for 0"),
    (|i| c!(i, fmi2GetEventIndicators(i.component, null_mut(), 0)), "fmi2GetEventIndicators: room for 0"),
    (|i| c!(i, fmi2GetContinuousStates(i.component, null_mut(), 0)), "fmi2GetContinuousStates: room for 0"),
    (|i| c!(i, fmi2GetNominalsOfContinuousStates(i.component, null_mut(), 0)), "fmi2GetNominalsOfContinuousStates: room for 0"),
];

/// Such calls in continuous-time mode.
#[rustfmt::skip]
const NULLS_OF_CONTINUOUS_TIME: &[(Call, &str)] = &[
    (|i| c!(i, fmi2CompletedIntegratorStep(i.component, 1, null_mut(), &mut 0)), "fmi2CompletedIntegratorStep: argument 'enterEventMode' is NULL"),
    (|i| c!(i, fmi2CompletedIntegratorStep(i.component, 1, &mut 0, null_mut())), "fmi2CompletedIntegratorStep: argument 'terminateSimulation' is NULL"),
    (|i| c!(i, fmi2SetContinuousStates(i.component, null(), 1)), "fmi2SetContinuousStates: argument 'x' is NULL"),
    (|i| c!(i, fmi2SetContinuousStates(i.component, null(), 0)), "fmi2SetContinuousStates: room for 0"),
];

/// Such calls between the steps of co-simulation.
#[rustfmt::skip]
const NULLS_OF_SIMULATION: &[(Call, &str)] = &[
    (|i| c!(i, fmi2SetRealInputDerivatives(i.component, null(), 1, &1, &0.0)), "fmi2SetRealInputDerivatives: argument 'vr' is NULL"),
    (|i| c!(i, fmi2SetRealInputDerivatives(i.component, &0, 1, null(), &0.0)), "fmi2SetRealInputDerivatives: argument 'order' is NULL"),
    (|i| c!(i, fmi2SetRealInputDerivatives(i.component, &0, 1, &1, null())), "fmi2SetRealInputDerivatives: argument 'value' is NULL"),
    (|i| c!(i, fmi2GetRealOutputDerivatives(i.component, &0, 1, &1, &mut 0.0)), "maxOutputDerivativeOrder is 0"),
    (|i| c!(i, fmi2GetStatus(i.component, 0, null_mut())), "fmi2GetStatus: argument 'value' is NULL"),
    (|i| c!(i, fmi2GetRealStatus(i.component, 2, null_mut())), "fmi2GetRealStatus: argument 'value' is NULL"),
    (|i| c!(i, fmi2GetBooleanStatus(i.component, 3, null_mut())), "fmi2GetBooleanStatus: argument 'value' is NULL"),
    (|i| c!(i, fmi2GetStringStatus(i.component, 1, null_mut())), "fmi2GetStringStatus: argument 'value' is NULL"),
];

/// Calls without any values, which need no pointers.
const NOTHING: &[Call] = &[
    |i| c!(i, fmi2SetDebugLogging(i.component, 1, 0, null())),
    |i| c!(i, fmi2GetReal(i.component, null(), 0, null_mut())),
    |i| c!(i, fmi2GetInteger(i.component, null(), 0, null_mut())),
    |i| c!(i, fmi2GetBoolean(i.component, null(), 0, null_mut())),
    |i| c!(i, fmi2GetString(i.component, null(), 0, null_mut())),
    |i| c!(i, fmi2SetReal(i.component, null(), 0, null())),
    |i| c!(i, fmi2SetInteger(i.component, null(), 0, null())),
    |i| c!(i, fmi2SetBoolean(i.component, null(), 0, null())),
    |i| c!(i, fmi2SetString(i.component, null(), 0, null())),
    |i| c!(i, fmi2FreeFMUstate(i.component, null_mut())),
    |i| c!(i, fmi2FreeFMUstate(i.component, &mut null_mut())),
];

fn check(instance: &Instance, calls: &[(Call, &str)]) {
    let (saved_state, before) = (instance.save(), instance.serialize());
    for (call, message) in calls {
        instance.forget();
        let status = call(instance);
        instance.refused(status, ERROR, &[message]);
        assert_eq!(instance.messages().len(), 1, "{message}: said once");
        instance.restore(saved_state);
        assert!(instance.serialize() == before, "{message}");
    }
}

#[test]
fn wrong_pointers_are_errors_that_name_them() {
    for (fmu, fmu_type) in fmus_and_interfaces() {
        let instance = fmu.instance(fmu_type).initialized();
        check(&instance, NULLS);
        check(&instance, BETWEEN);
        check(&instance, OVERLAPS);
        for call in NOTHING {
            instance.ok(call(&instance));
        }
        if fmu_type == CO_SIMULATION {
            check(&instance, NULLS_OF_SIMULATION);
            ok!(instance, fmi2SetRealInputDerivatives(null(), 0, null(), null()));
            let none = null_mut();
            ok!(instance, fmi2GetRealOutputDerivatives(null(), 0, null(), none));
        } else {
            check(&instance, NULLS_OF_EXCHANGE);
            ok!(instance, fmi2EnterContinuousTimeMode());
            check(&instance, NULLS_OF_CONTINUOUS_TIME);
        }
    }
}

#[test]
fn what_cannot_be_given_leaves_the_room_as_it_was() {
    for fmu in fmus() {
        let instance = fmu.instance(CO_SIMULATION);
        let mut value = 7.5;
        let status = c!(instance, fmi2GetReal(instance.component, &u32::MAX, 1, &mut value));
        instance.refused(status, ERROR, &["fmi2GetReal"]);
        assert_eq!(value, 7.5);
    }
}

#[test]
fn null_is_not_taken_for_a_text() {
    for fmu in fmus() {
        for reference in
            fmu.references(|variable| matches!(variable.kind, VariableKind::String { .. }))
        {
            let instance = fmu.instance(CO_SIMULATION);
            let name = &fmu.description.variables[reference as usize].name;
            let status = c!(instance, fmi2SetString(instance.component, &reference, 1, &null()));
            instance.refused(status, ERROR, &[&format!("'{name}'"), "NULL"]);
        }
    }
}

#[test]
fn no_callbacks_or_none_of_their_functions_are_fine() {
    let none = Callbacks {
        logger: None,
        allocate_memory: None,
        free_memory: None,
        step_finished: None,
        component_environment: null_mut(),
    };
    for fmu in fmus() {
        for callbacks in [null(), &raw const none] {
            let instantiate = |name| {
                let guid = fmu.guid().as_ptr();
                c!(fmu, fmi2Instantiate(name, CO_SIMULATION, guid, null(), callbacks, 0, 1))
            };
            let component = instantiate(c"it".as_ptr());
            assert!(!component.is_null(), "{}", fmu.name());
            // A premature step is refused, and there is no logger to report it to.
            assert_eq!(c!(fmu, fmi2DoStep(component, 0.0, 0.1, 1)), ERROR);
            assert_eq!(c!(fmu, fmi2Reset(component)), OK);
            assert_eq!(c!(fmu, fmi2EnterInitializationMode(component)), OK);
            assert_eq!(c!(fmu, fmi2ExitInitializationMode(component)), OK);
            assert_eq!(c!(fmu, fmi2DoStep(component, 0.0, 0.01, 1)), OK);
            c!(fmu, fmi2FreeInstance(component));
            // A refused instantiation has no logger either.
            assert!(instantiate(null()).is_null());
            let (name, guid) = (c"it".as_ptr(), fmu.guid().as_ptr());
            let made = c!(fmu, fmi2Instantiate(name, 1, guid, null(), between(), 0, 1));
            assert!(made.is_null());
        }
    }
}

#[test]
fn what_cannot_be_instantiated_is_refused_by_name() {
    for fmu in fmus() {
        let fmu_guid = Some(fmu.guid());
        let cases: [(Option<&CStr>, c_int, Option<&CStr>, &str); 8] = [
            (None, CO_SIMULATION, fmu_guid, "'instanceName' is NULL"),
            (Some(c""), CO_SIMULATION, fmu_guid, "instance name is empty"),
            (Some(c"it"), CO_SIMULATION, None, "'fmuGUID' is NULL"),
            (Some(c"it"), CO_SIMULATION, Some(c""), "no FMU with GUID ''"),
            (Some(c"it"), CO_SIMULATION, Some(c"{0}"), "no FMU with GUID '{0}'"),
            (Some(c"it"), -1, fmu_guid, "fmuType -1"),
            (Some(c"it"), 2, fmu_guid, "fmuType 2"),
            (Some(c"it"), MODEL_EXCHANGE, fmu_guid, "is for co-simulation only"),
        ];
        for (name, fmu_type, guid, part) in cases {
            if fmu_type == MODEL_EXCHANGE && fmu.description.model_exchange {
                continue;
            }
            let refused = fmu.instantiate(name, fmu_type, guid, None);
            assert!(refused.component.is_null(), "{}: {part}", fmu.name());
            assert_eq!(refused.messages().len(), 1, "{part}: said once");
            refused.refused(refused.messages()[0].status, ERROR, &["fmi2Instantiate: ", part]);
        }
    }
}
