//! Tests of instances in the same program, without the C interface.

use crate::counter::Counter;
use crate::lag::Lag;
use crate::support::*;
use fmi_export::linked::Linked;
use fmi_export::{Export, Failure};

fn lag() -> Linked {
    Linked::new(&Export::new::<Lag>())
}

fn initialize(linked: &mut Linked, stop: f64) -> Result<(), Failure> {
    linked.enter_initialization(0.0, stop)?;
    linked.exit_initialization()
}

/// Returns the value reference of a variable.
fn reference(linked: &Linked, name: &str) -> u32 {
    linked.description().position(name).unwrap() as u32
}

#[test]
fn it_computes_the_bits_of_an_instance_behind_the_c_interface() {
    let (mut linked, instance) = (lag(), Instance::stepping());
    initialize(&mut linked, 2.0).unwrap();
    let mut state = [0.0];
    for k in 0..40 {
        let (time, input) = (f64::from(k) * 0.05, f64::from(k % 7) - 2.5);
        assert_eq!(instance.set_real(U, input), FmiStatus::Ok);
        linked.set_real(&[U], &[input]).unwrap();
        assert_eq!(instance.step(time, 0.05), FmiStatus::Ok);
        linked.do_step(time, 0.05).unwrap();
        linked.get_real(&[X], &mut state).unwrap();
        assert_eq!(state[0].to_bits(), instance.real(X).to_bits());
    }
}

#[test]
fn calls_are_refused_as_through_the_c_interface() {
    let refused = |outcome: Result<(), Failure>| outcome.unwrap_err().to_string();
    let mut linked = lag();
    let text = refused(linked.do_step(0.0, 0.1));
    assert!(text.contains("not allowed in state instantiated"), "{text}");
    initialize(&mut linked, 1.0).unwrap();
    let text = refused(linked.get_real(&[9999], &mut [0.0]));
    assert!(text.contains("value reference 9999 does not exist"), "{text}");
    let text = refused(linked.do_step(0.5, 0.1));
    assert!(text.contains("communication point 0.5 s"), "{text}");

    let mut counter = Linked::new(&Export::new::<Counter>());
    let increment = reference(&counter, "increment");
    let text = refused(counter.set_integer(&[increment], &[1]));
    assert!(text.contains("'increment'") && text.contains("type"), "{text}");
    let defect = reference(&counter, "defect");
    counter.set_string(defect, "parameter").unwrap();
    assert!(refused(initialize(&mut counter, 1.0)).contains("defect = parameter"));
}
