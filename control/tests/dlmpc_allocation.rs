//! No tick of DLMPC allocates memory, apart from the inside of the cone solver.

use crate::counting::COUNT;
use crate::prelude::*;
use control::dlmpc::{Memory, Settings};

#[test]
fn ticks_without_the_cone_solver_allocate_nothing() {
    let scenario = Scenario::crmpc2022();
    let mut truth: Vec<Measurement> = Vec::new();
    let mut controller = Dlmpc::new(Settings::published()).unwrap();
    let noise = disturbance(DisturbanceKind::White);
    let mut memory = Memory::default();
    simulate(&mut controller, &mut memory, 1.05, noise, |_, _, &now| truth.push(now));

    let reference = |time: f64| scenario.reference.at(time);
    let mut memory = controller.memory();
    let mut before = controller.memory();
    // The setup shows that the counter works.
    assert!(COUNT.get() > 0);
    let (mut unconstrained, mut constrained) = (0, 0);
    for (tick, measured) in (0..).zip(&truth) {
        let counted = COUNT.get();
        before.clone_from(&memory);
        let time = tick as f64 * FEEDBACK;
        controller.update(&mut memory, tick, time, measured, &reference);
        assert_eq!(COUNT.get() - counted, 0, "tick {tick}");
        if tick % controller.ratio() == 0 {
            unconstrained += usize::from(memory.report.status == SolverStatus::Unconstrained);
            constrained += usize::from(memory.report.status == SolverStatus::Constrained);
        }
    }
    assert!(unconstrained > 50 && constrained > 50, "{unconstrained} {constrained}");
}
