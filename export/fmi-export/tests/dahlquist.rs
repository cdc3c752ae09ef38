//! A model that leaves integration and derivatives to the shell.
#![allow(unsafe_code)]

#[path = "../examples/dahlquist.rs"]
#[allow(unreachable_pub)]
mod dahlquist;

use dahlquist::Dahlquist;
use fmi_export::Export;
use fmi_export::linked::Linked;

/// Value references of k, x and der(x).
const K: u32 = 0;
const X: u32 = 1;
const DERIVATIVE: u32 = 2;

#[test]
fn oracle_the_state_decays_as_the_exponential_function() {
    let mut model = Linked::new(&Export::new::<Dahlquist>());
    model.set_real(&[K], &[2.0]).unwrap();
    model.enter_initialization(0.0, 1.0).unwrap();
    model.exit_initialization().unwrap();
    for step in 0..10 {
        model.do_step(f64::from(step) * 0.1, 0.1).unwrap();
    }
    let mut values = [0.0; 2];
    model.get_real(&[X, DERIVATIVE], &mut values).unwrap();
    let exact = (-2_f64).exp();
    // The error of the method is (k h)⁵ / 120 a step, with 100 steps of h = 0.01 s.
    let bound = 1.1 * 100.0 * 0.02_f64.powi(5) / 120.0;
    assert!((values[0] - exact).abs() < bound * exact, "{} {exact}", values[0]);
    assert_eq!(values[1], -2.0 * values[0]);
}
