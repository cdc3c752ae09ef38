//! Problems in which the Riccati method fails.

use super::{MAX_ITERATIONS, MODERATE, Shape, published};
use crate::harness::norm_constraints::Sets;
use crate::prelude::*;
use control::mpc::{
    Bounded, Bounds, Chain, Constraints, ErrorTrajectory, Layout, Optimiser, StageConstraints,
    State,
};

/// Sets that the Riccati method cannot evaluate: after the first computation of bounds their values
/// are not numbers.
struct Spoilt {
    sets: Sets,
    computed: Cell<usize>,
}

impl Bounded<2> for Spoilt {
    fn norm_constraints(
        &self,
        k: usize,
        state: &State<2>,
        input: &Vector3<f64>,
        _: (f64, f64),
    ) -> StageConstraints<2> {
        let mut constraints = self.sets.norm_constraints(k, state, input);
        if self.computed.get() == 1 {
            constraints.input.value *= f64::NAN;
        }
        constraints
    }

    fn squares(
        &self,
        k: usize,
        state: &State<2>,
        input: &Vector3<f64>,
        bounds: (f64, f64),
    ) -> (f64, f64) {
        let StageConstraints { state, input } = self.norm_constraints(k, state, input, bounds);
        (state.value.norm_squared(), input.value.norm_squared())
    }

    fn bounds_about(&self, _: &ErrorTrajectory<2>, _: Range<usize>, _: &mut Bounds) {
        self.computed.update(|computed| computed + 1);
    }

    fn violated(
        &self,
        trajectory: &ErrorTrajectory<2>,
        mut intervals: Range<usize>,
        _: &mut Bounds,
    ) -> Option<Range<usize>> {
        let violates =
            |k: usize| self.sets.squares(k, &trajectory.states[k], &trajectory.inputs[k]).1 > 1.0;
        let first = intervals.find(|&k| violates(k))?;
        let last = intervals.rev().find(|&k| violates(k)).unwrap_or(first);
        Some(first..last + 1)
    }
}

#[test]
fn the_cone_solver_takes_over_where_the_riccati_method_fails() {
    let Shape { horizon, cost, .. } = published();
    let chain = Chain::new(0.2);
    let layout = Layout {
        chain,
        cost,
        horizon,
        constrains_states: true,
        terminal: false,
        margin: 0.5,
        scale: [0.1, 0.1],
        standstill: 1e-6,
    };
    let affine = vec![[Vector3::zeros(); 2]; horizon];
    let body = Scenario::crmpc2022().inertia.body(1.0).unwrap();
    let previous = ErrorTrajectory::new(horizon);
    let report = |computed: usize, time_budget: f64| {
        let solver = SolverSettings {
            shortcuts: false,
            time_budget,
            max_iterations: MAX_ITERATIONS,
            ..SolverSettings::default()
        };
        let mut optimiser = Optimiser::new(layout.clone(), solver).unwrap();
        let sets = Sets { body, printed: false, bounds: (0.0873, 1.356e5) };
        let spoilt = Spoilt { sets, computed: Cell::new(computed) };
        let before = Some((&previous, &[[0.0; 2]; 100][..]));
        optimiser.begin();
        optimiser.optimise(&spoilt, &MODERATE.start, &affine, before)
    };
    // The spoilt sets are valid again when the cone solver asks.
    let unlimited = SolverSettings::default().time_budget;
    for (computed, status) in [(0, SolverStatus::Cone), (1, SolverStatus::Constrained)] {
        let report = report(computed, unlimited);
        assert_eq!(report.status, status);
        assert!(report.certificate.feasibility < 0.1, "{report:?}");
    }
    // With no time left, neither solver is started.
    let report = report(1, 1e-9);
    assert_eq!((report.status, report.iterations), (SolverStatus::Fallback, 0));
}
