//! A short run of the units named as arguments, or of all: co-simulation, model exchange, saved
//! states and refusals. It prints nothing and fails by panicking, so that it can run under a memory
//! checker.

use conformance::interface::{CO_SIMULATION, ERROR, MODEL_EXCHANGE};
use conformance::{Unit, c};

/// Number of ticks after which even the slowest law has optimised once.
const TICKS: u32 = 6;

fn main() {
    let names: Vec<_> = std::env::args().skip(1).collect();
    let known = conformance::units();
    for name in &names {
        assert!(known.iter().any(|unit| unit.name() == name), "no unit {name}");
    }
    for unit in
        known.iter().filter(|unit| names.is_empty() || names.iter().any(|name| name == unit.name()))
    {
        simulate(unit);
        if unit.description.model_exchange {
            integrate(unit);
        }
    }
}

fn simulate(unit: &Unit) {
    let instance = unit.instance(CO_SIMULATION).initialized();
    let state = instance.save();
    let rows = instance.drive(0..TICKS);
    let bytes = instance.serialize();
    instance.restore(state);
    assert_eq!(instance.drive(0..TICKS), rows);
    // A refused call is followed by a return to a state from bytes.
    assert_eq!(instance.set_real(unit.input(), f64::NAN), ERROR);
    assert_eq!(instance.deserialize(&bytes[1..]).0, ERROR);
    let (status, state) = instance.deserialize(&bytes);
    instance.ok(status);
    instance.restore(state);
    instance.ok(c!(instance, fmi2Terminate(instance.component)));
    instance.ok(c!(instance, fmi2Reset(instance.component)));
    assert_eq!(instance.initialized().drive(0..TICKS), rows);
}

fn integrate(unit: &Unit) {
    let instance = unit.instance(MODEL_EXCHANGE).initialized();
    let state = instance.save();
    let rows = instance.integrate(0..TICKS);
    instance.restore(state);
    assert_eq!(instance.integrate(0..TICKS), rows);
}
