//! Remark 3 of Chai 2022: a longer horizon enlarges the set of starts from which a plan exists.

use crate::prelude::*;

/// Number of starts that are drawn, with angles within 60° of the reference and rates within the
/// limit of 5°/s.
const STARTS: usize = 400;

/// Whether there is a plan from each start with a horizon of so many steps of 0.2 s.
fn feasible(constraints: Constraints, horizon: usize) -> Vec<bool> {
    let scenario = Scenario::crmpc2022();
    let reference = move |time| scenario.reference.at(time);
    let mut controller = Crmpc::new(Settings { horizon, ..settings(constraints) }).unwrap();
    let mut random = Random::new(20_221);
    let mut is_feasible = || {
        let angles = reference(0.0).angles + random.vector() * 60f64.to_radians();
        let size = random.between(0.0, 5f64.to_radians());
        let measured =
            Measurement { angles, rates: random.direction(size), ..Measurement::default() };
        let mut memory = Memory::default();
        controller.update(&mut memory, 0, 0.0, &measured, &reference);
        memory.report.status != SolverStatus::Fallback
    };
    (0..STARTS).map(|_| is_feasible()).collect()
}

#[test]
fn published_a_longer_horizon_enlarges_the_region_of_attraction() {
    // With the paper's sets a plan must reach the terminal set within the horizon. Those of the
    // robust sets end in braking, so that a second is enough.
    for (constraints, counts) in [
        (Constraints::Paper, [0, 0, 1, 1, 5, 117, 399, 399]),
        (Constraints::Robust, [381, 400, 400, 400, 400, 400, 400, 400]),
    ] {
        let mut shorter = vec![false; STARTS];
        for (horizon, expected) in [2, 5, 10, 15, 25, 50, 100, 200].into_iter().zip(counts) {
            let longer = feasible(constraints, horizon);
            let lost = shorter.iter().zip(&longer).filter(|(before, now)| **before && !**now);
            assert_eq!(lost.count(), 0, "{constraints:?}, {horizon} steps");
            let count = longer.iter().filter(|&&is_feasible| is_feasible).count();
            assert_eq!(count, expected, "{constraints:?}, {horizon} steps");
            shorter = longer;
        }
    }
}
