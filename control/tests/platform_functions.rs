//! The solver of the cone programs takes no elementary function from the platform. Its cones of
//! exponentials and powers would, and a built library therefore imports `exp`, `log` and `pow`; but
//! no optimisation here has such a cone. These three are counted here in place of the C library's.
#![allow(unsafe_code)]

use crate::prelude::*;
use control::allocation::{self, Command};
use control::crmpc;
use control::mpc::Method;
use std::hint::black_box;
use vehicle::math;

thread_local! {
    // Other tests of this program run at the same time, and may call these functions.
    static CALLS: Cell<usize> = const { Cell::new(0) };
}

fn count() {
    CALLS.set(CALLS.get() + 1);
}

// SAFETY: each has the name and the signature of the function of C, whose value it returns.
#[unsafe(no_mangle)]
extern "C" fn exp(x: f64) -> f64 {
    count();
    math::exp(x)
}

// SAFETY: as above.
#[unsafe(no_mangle)]
extern "C" fn log(x: f64) -> f64 {
    count();
    math::ln(x)
}

// SAFETY: as above.
#[unsafe(no_mangle)]
extern "C" fn pow(x: f64, y: f64) -> f64 {
    count();
    math::powf(x, y)
}

/// Flies the scenario and asserts that the cone solver finds every plan.
fn fly<C: Optimising>(mut controller: C) {
    let mut memory = controller.memory();
    let noise = disturbance(DisturbanceKind::White);
    simulate(&mut controller, &mut memory, 1.05, noise, |memory, _, _| {
        assert_eq!(C::report(memory).status, SolverStatus::Cone);
    });
}

#[test]
fn the_cone_solver_takes_no_exp_log_or_pow_from_the_platform() {
    let cone = |solver| SolverSettings { method: Method::Cone, shortcuts: false, ..solver };
    for constraints in [Constraints::Robust, Constraints::Paper] {
        let settings: crmpc::Settings = settings(constraints);
        fly(Crmpc::new(Settings { solver: cone(settings.solver), ..settings }).unwrap());
    }
    let settings = dlmpc::Settings::published();
    fly(Dlmpc::new(dlmpc::Settings { solver: cone(settings.solver), ..settings }).unwrap());

    let mut memory = allocation::Memory::default();
    let moment = Vector3::new(1e4, 2e4, -1e4);
    let command = Command { moment, dynamic_pressure: 2859.0, ..Command::default() };
    let mut allocator = Allocator::new(allocation::Settings::published()).unwrap();
    allocator.update(&mut memory, 0, 0.0, &command);
    assert_eq!(memory.report.status, allocation::AllocationStatus::Optimal);

    assert_eq!(CALLS.get(), 0);
    // The count works.
    black_box(black_box(2f64).exp() + black_box(2f64).ln() + black_box(2f64).powf(black_box(0.3)));
    assert_eq!(CALLS.get(), 3);
}
