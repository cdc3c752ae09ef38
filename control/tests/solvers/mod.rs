//! The Riccati method compared with the cone solver: for the same problem both find the same cost,
//! or neither finds an optimum.

mod takeover;

use crate::harness::norm_constraints::Sets;
use crate::prelude::*;
use control::mpc::certificate::Certificate;
use control::mpc::conic::ConicSolver;
use control::mpc::constraints::LinearisedConstraints;
use control::mpc::lq::Unconstrained;
use control::mpc::problem::{End, Outcome, Problem, Solution, Start};
use control::mpc::riccati::Riccati;
use control::mpc::{Budget, Chain, Cost, Layout, State};
use nalgebra::SMatrix;
use proptest::prelude::*;
use proptest::test_runner::{RngAlgorithm, TestRng, TestRunner};

const MAX_ITERATIONS: u32 = 60;

/// Problems per shape; their horizon and weights are fixed when the solvers are set up.
const PER_SHAPE: usize = 125;

const SHAPES: u32 = 44;

/// Shape of the problems for which the solvers are set up.
#[derive(Clone, Debug)]
struct Shape {
    horizon: usize,
    cost: Cost<2>,
    terminal: bool,
}

fn shape() -> impl Strategy<Value = Shape> {
    // Each weight varies over four decades about those of Chai 2022.
    let weight = || -2.0..2.0f64;
    let weights = [weight(), weight(), weight()];
    (10..=200usize, weights, any::<bool>()).prop_map(|(horizon, [angle, rate, input], terminal)| {
        let h = 0.2;
        let weight_of = |decade: f64, typical: f64| h * typical * 10.0_f64.powf(decade);
        let (p1, p2, q) = (weight_of(angle, 50.0), weight_of(rate, 50.0), weight_of(input, 10.0));
        let each = SMatrix::<f64, 2, 2>::new(
            8.0 * p1,
            3.0 * (p1 * p2).sqrt(),
            3.0 * (p1 * p2).sqrt(),
            4.0 * p2,
        );
        let cost = Cost {
            state: [Vector3::repeat(p1), Vector3::new(p2, 2.0 * p2, 0.5 * p2)],
            input: Vector3::new(q, 0.7 * q, 2.0 * q),
            end: control::mpc::per_axis(&[each, each * 1.5, each]),
        };
        Shape { horizon, cost, terminal }
    })
}

/// Data of one problem.
#[derive(Clone, Debug)]
struct Sample {
    start: State<2>,
    /// Interval and size of a jump of the reference.
    jump: (f64, [f64; 3]),
    printed: bool,
    /// Decades of both bounds about 5 °/s and 1.356e5 N m.
    bounds: (f64, f64),
    /// Radius ε relative to ‖E_N‖_G of the unconstrained optimum.
    radius: f64,
}

fn sample() -> impl Strategy<Value = Sample> {
    let cube = |half_deg: f64| {
        let half = half_deg.to_radians();
        [-half..half, -half..half, -half..half].prop_map(Vector3::from)
    };
    let jump = (0.0..1.0f64, [-0.09..0.09f64, -0.02..0.02, -0.09..0.09]);
    (cube(20.0), cube(4.0), jump, any::<bool>(), (-0.3..1.0f64, -0.3..1.0f64), 0.3..1.5f64)
        .prop_map(|(angles, rates, jump, printed, bounds, radius)| Sample {
            start: [angles, rates],
            jump,
            printed,
            bounds,
            radius,
        })
}

/// The solvers of one shape.
struct Solvers {
    shape: Shape,
    chain: Chain<2>,
    unconstrained: Unconstrained<2>,
    riccati: Riccati<2>,
    cone: ConicSolver<2>,
    linearised: LinearisedConstraints<2>,
    affine: Vec<State<2>>,
}

/// Outcome, cost and certificate of both solvers on the linearised problem.
type Verdict = [(Outcome, f64, Certificate); 2];

impl Solvers {
    fn new(shape: Shape) -> Self {
        let chain = Chain::new(0.2);
        let layout = Layout {
            chain,
            cost: shape.cost,
            horizon: shape.horizon,
            constrains_states: true,
            terminal: shape.terminal,
            margin: 0.5,
            scale: [0.1, 0.1],
            standstill: 1e-6,
        };
        let cone = ConicSolver::new(layout, MAX_ITERATIONS);
        Self {
            chain,
            unconstrained: Unconstrained::new(shape.horizon, &chain, &shape.cost),
            riccati: Riccati::new(shape.horizon, MAX_ITERATIONS),
            cone: cone.unwrap(),
            linearised: LinearisedConstraints::new(shape.horizon),
            affine: vec![[Vector3::zeros(); 2]; shape.horizon],
            shape,
        }
    }

    /// Solves the sample's problem with both solvers, with its norm constraints linearised about
    /// the unconstrained optimum.
    fn solve(&mut self, sample: &Sample) -> Verdict {
        let Self { shape, chain, unconstrained, riccati, cone, linearised, affine } = self;
        affine.fill([Vector3::zeros(); 2]);
        let at = (sample.jump.0 * shape.horizon as f64) as usize;
        affine[at.min(shape.horizon - 1)][0] = Vector3::from(sample.jump.1);
        let sets = Sets {
            body: Scenario::crmpc2022().inertia.body(1.0).unwrap(),
            printed: sample.printed,
            bounds: (
                5.0_f64.to_radians() * 10.0_f64.powf(sample.bounds.0),
                if sample.printed { 0.2 } else { 1.356e5 } * 10.0_f64.powf(sample.bounds.1),
            ),
        };
        let mut solution = Solution::new(shape.horizon);
        unconstrained.solve(&sample.start, affine, &mut solution.trajectory);
        linearised.set(&sets, &solution.trajectory, 0);
        let end = &solution.trajectory.states[shape.horizon];
        let radius =
            shape.terminal.then(|| (sample.radius * shape.cost.end_square(end).sqrt()).max(1e-4));
        let zero = [Vector3::zeros(); 2];
        let problem = Problem {
            chain,
            cost: &shape.cost,
            start: Start::Fixed(sample.start),
            affine,
            constraints: &*linearised,
            end: End { weight: &shape.cost.end, slope: zero, radius },
        };
        let mut judged = solution.clone();
        let outcome =
            riccati.solve(&problem, &mut solution, 0, false, &mut Budget::unlimited(), None);
        let verdict = cone.solve(&problem, &mut judged, (u32::MAX, f64::INFINITY));
        let assessed = |outcome, solution: &Solution<2>| {
            (
                outcome,
                shape.cost.total(&solution.trajectory),
                Certificate::new(&problem, solution, false),
            )
        };
        [assessed(outcome, &solution), assessed(verdict, &judged)]
    }
}

fn runner(cases: u32) -> TestRunner {
    let config = ProptestConfig {
        cases,
        failure_persistence: None,
        max_shrink_iters: 0,
        ..ProptestConfig::default()
    };
    TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::ChaCha))
}

#[test]
fn oracle_riccati_and_cone_agree_on_the_cost_of_5500_random_problems() {
    let counts = [Cell::new(0), Cell::new(0), Cell::new(0)];
    let (worst, most) = (Cell::new(0.0_f64), Cell::new(0));
    let problems = (shape(), prop::collection::vec(sample(), PER_SHAPE));
    runner(SHAPES)
        .run(&problems, |(shape, samples)| {
            let mut solvers = Solvers::new(shape.clone());
            for sample in samples {
                let [(ours, cost, certificate), (judge, judged, judged_certificate)] = solvers.solve(&sample);
                let context = || format!("{shape:?} {sample:?}: {ours:?} {cost} {certificate:?}, {judge:?} {judged} {judged_certificate:?}");
                let which = match (ours.solved(), judge.solved()) {
                    (true, true) => {
                        let difference = (cost - judged).abs() / judged;
                        worst.set(worst.get().max(difference));
                        most.set(most.get().max(ours.iterations()));
                        prop_assert!(difference <= 1e-7, "{difference:e} {}", context());
                        prop_assert!(certificate.residual() <= 1e-5, "{}", context());
                        0
                    }
                    (false, false) => 1,
                    (true, false) => {
                        // The certificate shows that the cone solver is wrong.
                        prop_assert!(certificate.residual() <= 1e-5, "{}", context());
                        2
                    }
                    (false, true) => return Err(TestCaseError::fail(context())),
                };
                counts[which].update(|count| count + 1);
            }
            Ok(())
        })
        .unwrap();
    let [both, neither, alone] = counts.map(|count| count.get());
    println!(
        "{both} solved by both, {neither} by neither, {alone} by riccati alone; {:e}, {}",
        worst.get(),
        most.get()
    );
    assert!(both >= 4000 && neither >= 20, "{both} {neither} {alone}");
}

/// The problem of Chai 2022, section 5.1, with a terminal constraint.
fn published() -> Shape {
    let settings = control::crmpc::Settings::new(control::crmpc::Constraints::Robust);
    let h = settings.period_optimisation;
    let g = control::crmpc::terminal_weight(
        settings.terminal,
        nalgebra::Vector2::new(50.0, 50.0),
        10.0,
    );
    let cost = Cost {
        state: [Vector3::repeat(50.0 * h); 2],
        input: Vector3::repeat(10.0 * h),
        end: control::mpc::per_axis(&[g; 3]),
    };
    Shape { horizon: settings.horizon, cost, terminal: true }
}

/// A moderate problem from which the cases below deviate.
const MODERATE: Sample = Sample {
    start: [Vector3::new(0.1, -0.05, -0.15), Vector3::new(0.01, 0.0, -0.01)],
    jump: (0.5, [0.0; 3]),
    printed: false,
    bounds: (0.0, 0.0),
    radius: 1.2,
};

fn assert_agree([(ours, cost, certificate), (judge, judged, _)]: Verdict, context: &str) {
    assert!(ours.solved() && judge.solved(), "{context}: {ours:?} {judge:?}");
    assert!((cost - judged).abs() <= 1e-7 * judged, "{context}: {cost} {judged}");
    assert!(certificate.residual() <= 1e-5, "{context}: {certificate:?}");
}

#[test]
fn oracle_riccati_and_cone_agree_in_degenerate_cases() {
    let mut solvers = Solvers::new(published());
    // The first state is as fast as permitted, so that the first input must keep the rate or reduce
    // it.
    let limit = 5.0_f64.to_radians();
    let start = [Vector3::new(0.3, 0.05, -0.2), Vector3::new(0.0, 0.0, 0.999 * limit)];
    assert_agree(solvers.solve(&Sample { start, ..MODERATE }), "rate at its bound at the start");
    // These bounds are so large that no constraint is active; then the end state is almost given.
    assert_agree(solvers.solve(&Sample { bounds: (3.0, 3.0), ..MODERATE }), "no constraint active");
    let jump = (0.99, [0.012, 0.0, -0.087]);
    assert_agree(
        solvers.solve(&Sample { radius: 1e-3, jump, ..MODERATE }),
        "tiny terminal constraint",
    );
    // One axis is already at its reference.
    let start = [Vector3::new(0.3, 0.0, 0.0), Vector3::zeros()];
    assert_agree(solvers.solve(&Sample { start, ..MODERATE }), "one axis only");
}

#[test]
fn an_infeasible_problem_is_recognised_within_the_iteration_limit() {
    let mut solvers = Solvers::new(published());
    // The start is three times as fast as permitted, with hardly any moment.
    let start = [Vector3::zeros(), Vector3::new(0.0, 0.26, 0.0)];
    for moment in [0.0, -1.0, -3.0] {
        let [(ours, ..), (judge, ..)] =
            solvers.solve(&Sample { start, bounds: (0.0, moment), ..MODERATE });
        assert!(!ours.solved() && !judge.solved(), "{ours:?} {judge:?}");
        // The search must not end by its last iteration but because it is recognised as hopeless.
        assert!(ours.hopeless() && ours.iterations() < MAX_ITERATIONS, "{ours:?}");
    }
}

#[test]
fn oracle_constraints_that_only_the_iterates_come_near_are_found() {
    let Shape { horizon, cost, .. } = published();
    let chain = Chain::new(0.2);
    let affine = vec![[Vector3::zeros(); 2]; horizon];
    let body = Scenario::crmpc2022().inertia.body(1.0).unwrap();
    let sets = Sets { body, printed: false, bounds: (5.0_f64.to_radians(), 1.356e5) };
    let start = [Vector3::new(0.35, -0.2, -0.35), Vector3::zeros()];
    let problem = Problem {
        chain: &chain,
        cost: &cost,
        start: Start::Fixed(start),
        affine: &affine,
        constraints: &sets,
        end: End { weight: &cost.end, slope: [Vector3::zeros(); 2], radius: None },
    };
    // One guess violates its bounds, the other rests at the start, far from all bounds.
    let (mut fast, mut still) = (Solution::new(horizon), Solution::new(horizon));
    Unconstrained::new(horizon, &chain, &cost).solve(&start, &affine, &mut fast.trajectory);
    still.trajectory.states.fill(start);
    let optima = [fast, still].map(|mut solution| {
        let outcome = Riccati::new(horizon, MAX_ITERATIONS).solve(
            &problem,
            &mut solution,
            0,
            false,
            &mut Budget::unlimited(),
            None,
        );
        assert!(outcome.solved(), "{outcome:?}");
        let residual = Certificate::new(&problem, &solution, false).residual();
        assert!(residual <= 1e-6, "{residual}");
        assert!(solution.multipliers.intervals.iter().any(|[state, _]| *state > 1e-3));
        cost.total(&solution.trajectory)
    });
    assert!((optima[0] - optima[1]).abs() <= 1e-8 * optima[0], "{optima:?}");
}
