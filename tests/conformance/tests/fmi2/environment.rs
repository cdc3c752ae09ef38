//! Tests that no function depends on the importer's floating-point environment, nor changes it.

use crate::mxcsr::{mxcsr, set_mxcsr};
use crate::prelude::*;
use conformance::table::Row;

/// Traps, rounding up and flushing to zero; and rounding down with all flags raised.
const OTHERS: [u32; 2] = [0xd940, 0x3fbf];
const DEFAULT: u32 = 0x1f80;

#[test]
fn every_function_answers_the_same_and_leaves_the_environment_as_it_is() {
    for (fmu, fmu_type) in fmus_and_interfaces() {
        for state in states(fmu_type) {
            let instance = instance_in(&fmu, fmu_type, state);
            let saved_state = instance.save();
            for &Row(name, call, ..) in TABLE {
                let mut answers = [DEFAULT, OTHERS[0], OTHERS[1]].map(|environment| {
                    instance.forget();
                    set_mxcsr(environment);
                    let status = call(&instance, saved_state);
                    let after = mxcsr();
                    set_mxcsr(DEFAULT);
                    assert_eq!(after, environment, "{}: {name} in {state:?}", fmu.name());
                    instance.restore(saved_state);
                    (status, instance.messages().into_iter().map(|message| message.text))
                });
                let [usual, others @ ..] = &mut answers;
                for other in others {
                    assert_eq!(usual.0, other.0, "{}: {name} in {state:?}", fmu.name());
                    assert!(usual.1.clone().eq(other.1.clone()), "{}: {name}", fmu.name());
                }
            }
        }
    }
}
