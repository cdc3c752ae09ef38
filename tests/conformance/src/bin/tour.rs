//! A short run of the FMUs named as arguments, or of all: co-simulation, model exchange, saved
//! states and refusals. It prints nothing and fails by panicking, so that it can run under a memory
//! checker.

use conformance::interface::{CO_SIMULATION, ERROR, MODEL_EXCHANGE};
use conformance::{Fmu, c};

/// Number of ticks after which even the slowest law has optimised once.
const TICKS: u32 = 6;

fn main() {
    let names: Vec<_> = std::env::args().skip(1).collect();
    let fmus = conformance::fmus();
    for name in &names {
        assert!(fmus.iter().any(|fmu| fmu.name() == name), "no FMU {name}");
    }
    for fmu in
        fmus.iter().filter(|fmu| names.is_empty() || names.iter().any(|name| name == fmu.name()))
    {
        simulate(fmu);
        if fmu.description.model_exchange {
            integrate(fmu);
        }
    }
}

fn simulate(fmu: &Fmu) {
    let instance = fmu.instance(CO_SIMULATION).initialized();
    let state = instance.save();
    let rows = instance.drive(0..TICKS);
    let bytes = instance.serialize();
    instance.restore(state);
    assert_eq!(instance.drive(0..TICKS), rows);
    // A refused call is followed by a return to a state from bytes.
    assert_eq!(instance.set_real(fmu.input(), f64::NAN), ERROR);
    assert_eq!(instance.deserialize(&bytes[1..]).0, ERROR);
    let (status, state) = instance.deserialize(&bytes);
    instance.ok(status);
    instance.restore(state);
    instance.ok(c!(instance, fmi2Terminate(instance.component)));
    instance.ok(c!(instance, fmi2Reset(instance.component)));
    assert_eq!(instance.initialized().drive(0..TICKS), rows);
}

fn integrate(fmu: &Fmu) {
    let instance = fmu.instance(MODEL_EXCHANGE).initialized();
    let state = instance.save();
    let rows = instance.integrate(0..TICKS);
    instance.restore(state);
    assert_eq!(instance.integrate(0..TICKS), rows);
}
