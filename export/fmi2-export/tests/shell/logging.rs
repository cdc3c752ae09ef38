//! Tests of the messages that reach the importer's logger, and of their categories.

use crate::support::*;
use fmi2_export::types::FmiStatus;

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

fn choose(instance: &Instance, on: bool, names: &[&std::ffi::CStr]) -> FmiStatus {
    let names: Vec<_> = names.iter().map(|name| name.as_ptr()).collect();
    c!(fmi2SetDebugLogging(instance.component, i32::from(on), names.len(), names.as_ptr()))
}

#[test]
fn with_logging_on_everything_is_reported() {
    let heard = crossing_the_switch(true, |_| ());
    assert_eq!(heard, ["logEvents", "logStatusWarning", "logStatusError"]);
}

#[test]
fn with_logging_off_errors_are_reported_all_the_same() {
    assert_eq!(crossing_the_switch(false, |_| ()), ["logStatusError"]);
    let switched_off = crossing_the_switch(true, |instance| {
        assert_eq!(choose(instance, false, &[]), FmiStatus::Ok);
    });
    assert_eq!(switched_off, ["logStatusError"]);
}

#[test]
fn categories_are_chosen_by_name() {
    let heard = crossing_the_switch(false, |instance| {
        assert_eq!(choose(instance, true, &[c"logStatusWarning"]), FmiStatus::Ok);
    });
    assert_eq!(heard, ["logStatusWarning", "logStatusError"]);
}

#[test]
fn an_unknown_category_is_named() {
    let instance = Instance::lag(CO_SIMULATION);
    assert_eq!(choose(&instance, true, &[c"logStatusWarning", c"logWeather"]), FmiStatus::Ok);
    instance.said(&["no log category 'logWeather'"]);
}
