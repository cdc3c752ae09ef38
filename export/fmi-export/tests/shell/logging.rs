//! Tests of the messages that reach the importer's logger, and of their categories.

use crate::support::*;
use std::ffi::{CStr, c_char, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::ptr::null;

fn crossing_the_switch(logging: bool, prepare: impl Fn(&Instance)) -> Vec<String> {
    let instance = instantiate(Some(c"plant 1"), CO_SIMULATION, Some(&guid("Lag")), None, logging);
    prepare(&instance);
    instance.initialize();
    assert_eq!(instance.step(0.0, 2.0), FmiStatus::Ok);
    assert_eq!(instance.set_real(X, 0.0), FmiStatus::Error);
    let messages = instance.messages();
    for message in &messages {
        assert_eq!(message.instance, "plant 1");
        assert!(!message.text.contains('%'), "{}", message.text);
    }
    messages.into_iter().map(|message| message.category).collect()
}

fn choose(instance: &Instance, on: bool, names: &[&CStr]) -> FmiStatus {
    let names: Vec<_> = names.iter().map(|name| name.as_ptr()).collect();
    c!(fmi2SetDebugLogging(instance.component, i32::from(on), names.len(), names.as_ptr()))
}

#[test]
fn the_chosen_categories_and_all_errors_are_reported() {
    const ALL: [&str; 3] = ["logEvents", "logStatusWarning", "logStatusError"];
    type Choice<'a> = Option<(bool, &'a [&'a CStr])>;
    // Whether logging is on at first, and what is switched on or off then.
    let cases: [(bool, Choice, &[&str]); 6] = [
        (true, None, &ALL),
        (false, None, &ALL[2..]),
        (true, Some((false, &[])), &ALL[2..]),
        (false, Some((true, &[c"logStatusWarning"])), &ALL[1..]),
        (false, Some((true, &[c"logAll"])), &ALL),
        (true, Some((false, &[c"logEvents"])), &ALL[1..]),
    ];
    for (logging, choice, expected) in cases {
        let heard = crossing_the_switch(logging, |instance| {
            if let Some((on, names)) = choice {
                assert_eq!(choose(instance, on, names), FmiStatus::Ok);
            }
        });
        assert_eq!(heard, expected, "{choice:?}");
    }
}

#[test]
fn an_unknown_category_is_named() {
    let instance = Instance::lag(CO_SIMULATION);
    assert_eq!(choose(&instance, true, &[c"logStatusWarning", c"logWeather"]), FmiStatus::Ok);
    instance.said(&["no log category 'logWeather'"]);
}

#[test]
fn with_logging_off_a_refused_step_and_the_end_of_the_simulation_say_why() {
    for (fmu, text, reason) in [
        ("Lag", (LABEL, c"refuse"), "fmi2DoStep: steps above 0.5 s are too long"),
        ("Counter", (0, c"end"), "the count is over"),
    ] {
        let instance = instantiate(Some(c"it"), CO_SIMULATION, Some(&guid(fmu)), None, false);
        assert_eq!(instance.set_string(text.0, text.1), FmiStatus::Ok);
        instance.initialize();
        assert_eq!(instance.step(0.0, 2.0), FmiStatus::Discard);
        let messages = instance.messages();
        let heard: Vec<_> =
            messages.iter().map(|m| (m.status, m.category.as_str(), m.text.as_str())).collect();
        assert_eq!(heard, [(FmiStatus::Discard, "logStatusDiscard", reason)]);
    }
}

/// A logger that unwinds, as one in C++ does that throws an exception.
#[allow(unsafe_code)]
unsafe extern "C-unwind" fn unwinds(
    _: *mut c_void,
    _: *const c_char,
    _: FmiStatus,
    _: *const c_char,
    _: *const c_char,
) {
    resume_unwind(Box::new("the logger"));
}

#[test]
fn what_the_logger_throws_passes_through_the_call_and_the_instance_goes_on() {
    let callbacks = callbacks(unwinds, null::<c_void>());
    let guid = guid("Lag");
    let instantiate = |guid: &CStr| {
        c!(fmi2Instantiate(c"it".as_ptr(), 1, guid.as_ptr(), null(), &raw const callbacks, 0, 1))
    };
    let passes = |call: &dyn Fn() -> FmiStatus| {
        let thrown = catch_unwind(AssertUnwindSafe(call)).expect_err("it threw nothing");
        assert_eq!(thrown.downcast_ref(), Some(&"the logger"));
    };
    passes(&|| {
        instantiate(c"another");
        FmiStatus::Ok
    });
    let component = instantiate(&guid);
    assert_eq!(c!(fmi2SetupExperiment(component, 0, 0.0, 0.0, 0, 0.0)), FmiStatus::Ok);
    assert_eq!(c!(fmi2EnterInitializationMode(component)), FmiStatus::Ok);
    // An event, a warning, a status without an answer, and an error: each call does its work first.
    passes(&|| c!(fmi2ExitInitializationMode(component)));
    passes(&|| c!(fmi2DoStep(component, 0.0, 2.0, 1)));
    passes(&|| c!(fmi2GetRealStatus(component, 7, &mut 0.0)));
    assert_eq!(c!(fmi2DoStep(component, 2.0, 0.1, 1)), FmiStatus::Ok);
    passes(&|| c!(fmi2SetReal(component, &X, 1, &0.0)));
    passes(&|| c!(fmi2Reset(component)));
    assert_eq!(c!(fmi2EnterInitializationMode(component)), FmiStatus::Ok);
    c!(fmi2FreeInstance(component));
}
