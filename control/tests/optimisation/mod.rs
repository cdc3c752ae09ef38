//! The optimisation of CRMPC: its shortcuts, its fallback (31), and the independence of its solvers
//! from earlier samples.

mod fallback;
mod shortcuts;

use crate::prelude::*;

fn controller(constraints: Constraints) -> Crmpc {
    Crmpc::new(settings(constraints)).unwrap()
}

/// Returns the memory without values from a clock.
fn timeless(memory: &Memory) -> Memory {
    Memory { report: SolverReport { time: 0.0, ..memory.report }, ..memory.clone() }
}

/// Returns all optimisations of the scenario with white noise.
fn optimisations(constraints: Constraints) -> Vec<Recorded<Memory>> {
    let mut controller = controller(constraints);
    let ratio = controller.ratio();
    recorded(&mut controller, 1.05, ratio)
}

#[test]
fn another_evaluation_of_a_tick_leaves_no_trace() {
    assert_another_evaluation_leaves_no_trace(|| controller(Constraints::Robust), timeless);
}

#[test]
fn a_saved_memory_continues_bit_for_bit_in_a_new_controller() {
    for constraints in [Constraints::Robust, Constraints::Paper] {
        assert_a_saved_memory_continues(|| controller(constraints), 0.95, timeless);
    }
}
