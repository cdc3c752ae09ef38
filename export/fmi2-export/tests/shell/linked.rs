//! Tests of instances in the same program, without the C interface.

use crate::counter::Counter;
use crate::lag::Lag;
use crate::support::*;
use fmi2_export::Export;
use fmi2_export::linked::{Linked, Value};
use fmi2_export::types::FmiStatus;

fn lag() -> Linked {
    Linked::new(&Export::new::<Lag>())
}

#[test]
fn it_computes_the_bits_of_an_instance_behind_the_c_interface() {
    let (mut linked, instance) = (lag(), Instance::stepping());
    linked.initialize(0.0, 2.0).unwrap();
    let mut state = [0.0];
    for k in 0..40 {
        let (time, input) = (f64::from(k) * 0.05, f64::from(k % 7) - 2.5);
        assert_eq!(instance.set_real(U, input), FmiStatus::Ok);
        linked.set_reals(&[U], &[input]).unwrap();
        assert_eq!(instance.step(time, 0.05), FmiStatus::Ok);
        linked.step(time, 0.05).unwrap();
        linked.reals(&[X], &mut state).unwrap();
        assert_eq!(state[0].to_bits(), instance.real(X).to_bits());
    }
}

#[test]
fn calls_are_refused_as_through_the_c_interface() {
    let refused = |outcome: Result<(), fmi2_export::Failure>| outcome.unwrap_err().to_string();
    let mut linked = lag();
    let text = refused(linked.set("nothing", &Value::Real(1.0)));
    assert!(text.contains("no variable 'nothing'"), "{text}");
    let text = refused(linked.step(0.0, 0.1));
    assert!(text.contains("not allowed in state instantiated"), "{text}");
    linked.initialize(0.0, 1.0).unwrap();
    let text = refused(linked.reals(&[9999], &mut [0.0]));
    assert!(text.contains("value reference 9999 does not exist"), "{text}");
    let text = refused(linked.step(0.5, 0.1));
    assert!(text.contains("communication point 0.5 s"), "{text}");

    let mut counter = Linked::new(&Export::new::<Counter>());
    let text = refused(counter.set("increment", &Value::Integer(1)));
    assert!(text.contains("'increment'") && text.contains("type"), "{text}");
    counter.set("defect", &Value::Text("parameter".into())).unwrap();
    assert!(refused(counter.initialize(0.0, 1.0)).contains("defect = parameter"));
}

#[test]
fn values_of_all_types_are_found_by_name() {
    let mut counter = Linked::new(&Export::new::<Counter>());
    assert_eq!(counter.description().name, "Counter");
    counter.set("increment", &Value::Real(3.0)).unwrap();
    counter.initialize(0.0, 1.0).unwrap();
    counter.step(0.0, 0.1).unwrap();
    let (reference, variable) = counter.find("resets").unwrap();
    assert_eq!(variable.description, "Resets of this model");
    assert_eq!(counter.integer(reference), Ok(0));
    let (count, _) = counter.find("count").unwrap();
    let mut values = [0.0];
    counter.reals(&[count], &mut values).unwrap();
    assert_eq!(values, [3.0]);
    assert_eq!(counter.take_warnings(), Vec::<String>::new());
}
