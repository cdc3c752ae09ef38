//! The Riccati method with the cone solver as its judge: the same problem, the same cost, or neither finds an optimum.

use control::linearise::{self, Linear};
use control::mpc::certificate::Certificate;
use control::mpc::cone::{Cone, Structure};
use control::mpc::lq::Unconstrained;
use control::mpc::problem::{End, Frozen, Outcome, Problem, Solution, Start};
use control::mpc::riccati::Riccati;
use control::mpc::{Ball, Balls, Chain, Constraints, Cost, State};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use proptest::prelude::*;
use proptest::test_runner::{RngAlgorithm, TestRng, TestRunner};
use std::cell::Cell;
use vehicle::dynamics::RigidBody;
use vehicle::scenario::Scenario;

const MAX_ITERATIONS: u32 = 60;
/// Problems per shape: their horizon and weights belong to the solvers' construction.
const PER_SHAPE: usize = 125;
const SHAPES: u32 = 44;

/// Bounds on body rates and moment (the limits themselves), or on x_ω and u (the printed sets), about the origin.
struct Sets {
    body: RigidBody,
    printed: bool,
    bounds: (f64, f64),
}

impl Constraints<2> for Sets {
    fn has_state_balls(&self) -> bool {
        true
    }

    fn balls(&self, _: usize, state: &State<2>, input: &Vector3<f64>) -> Balls<2> {
        let at = linearise::linearise(&self.body, &state[0], &state[1], input);
        let of = |y: &Linear, bound: f64| {
            let mut by_angles = Matrix3::zeros();
            by_angles.fixed_view_mut::<3, 2>(0, 0).copy_from(&y.by_angles);
            Ball {
                value: y.value / bound,
                by_state: [by_angles / bound, y.by_rates / bound],
                by_input: y.by_acceleration / bound,
            }
        };
        if self.printed {
            let rates = Ball {
                value: state[1] / self.bounds.0,
                by_state: [Matrix3::zeros(), Matrix3::identity() / self.bounds.0],
                by_input: Matrix3::zeros(),
            };
            let u = linearise::input_of_moment(&self.body, &state[0], &at.moment);
            Balls { state: rates, input: of(&u, self.bounds.1) }
        } else {
            Balls { state: of(&at.rates, self.bounds.0), input: of(&at.moment, self.bounds.1) }
        }
    }
}

/// What the solvers are built for.
#[derive(Clone, Debug)]
struct Shape {
    horizon: usize,
    cost: Cost<2>,
    terminal: bool,
}

fn shape() -> impl Strategy<Value = Shape> {
    // Four decades of each weight about those of Chai 2022.
    let weight = || -2.0..2.0f64;
    let weights = [weight(), weight(), weight()];
    (10..=200usize, weights, any::<bool>()).prop_map(|(horizon, [angle, rate, input], terminal)| {
        let h = 0.2;
        let of = |decade: f64, typical: f64| h * typical * 10.0_f64.powf(decade);
        let (p1, p2, q) = (of(angle, 50.0), of(rate, 50.0), of(input, 10.0));
        let each =
            SMatrix::<f64, 2, 2>::new(8.0 * p1, 3.0 * (p1 * p2).sqrt(), 3.0 * (p1 * p2).sqrt(), 4.0 * p2);
        let cost = Cost {
            state: [Vector3::repeat(p1), Vector3::new(p2, 2.0 * p2, 0.5 * p2)],
            input: Vector3::new(q, 0.7 * q, 2.0 * q),
            end: control::mpc::per_axis(&[each, each * 1.5, each]),
        };
        Shape { horizon, cost, terminal }
    })
}

/// What one problem has of its own.
#[derive(Clone, Debug)]
struct Sample {
    start: State<2>,
    /// Interval and size of a jump of the reference.
    jump: (f64, [f64; 3]),
    printed: bool,
    /// Decades of both bounds about 5 °/s and 1.356e5 N m.
    bounds: (f64, f64),
    /// ε over ‖E_N‖_G of the motion without balls.
    radius: f64,
}

fn sample() -> impl Strategy<Value = Sample> {
    let cube = |half_deg: f64| {
        let half = half_deg.to_radians();
        [-half..half, -half..half, -half..half].prop_map(Vector3::from)
    };
    let jump = (0.0..1.0f64, [-0.09..0.09f64, -0.02..0.02, -0.09..0.09]);
    (cube(20.0), cube(4.0), jump, any::<bool>(), (-0.3..1.0f64, -0.3..1.0f64), 0.3..1.5f64).prop_map(
        |(angles, rates, jump, printed, bounds, radius)| Sample {
            start: [angles, rates],
            jump,
            printed,
            bounds,
            radius,
        },
    )
}

/// The solvers of one shape.
struct Solvers {
    shape: Shape,
    chain: Chain<2>,
    unconstrained: Unconstrained<2>,
    riccati: Riccati<2>,
    cone: Cone<2>,
    frozen: Frozen<2>,
    affine: Vec<State<2>>,
}

/// Outcome, cost and certificate of both solvers on the linearised problem.
type Verdict = [(Outcome, f64, Certificate); 2];

impl Solvers {
    fn new(shape: Shape, start: Option<[Vec<SVector<f64, 2>>; 3]>) -> Self {
        let chain = Chain::new(0.2);
        let faces = start.iter().flatten().map(Vec::len).sum();
        let cone = Cone::new(Structure {
            chain,
            cost: shape.cost,
            horizon: shape.horizon,
            state_balls: true,
            terminal: shape.terminal,
            start,
            scale: [0.1, 0.1],
            max_iterations: MAX_ITERATIONS,
        });
        Self {
            chain,
            unconstrained: Unconstrained::new(shape.horizon, &chain, &shape.cost),
            riccati: Riccati::new(shape.horizon, faces, MAX_ITERATIONS),
            cone: cone.unwrap(),
            frozen: Frozen::new(shape.horizon),
            affine: vec![[Vector3::zeros(); 2]; shape.horizon],
            shape,
        }
    }

    /// The sample's problem with its balls linearised about the optimum without balls, by both solvers.
    fn solve(&mut self, sample: &Sample, normals: Option<&[Vec<SVector<f64, 2>>; 3]>) -> Verdict {
        let Self { shape, chain, unconstrained, riccati, cone, frozen, affine } = self;
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
        unconstrained.solve(&sample.start, affine, &mut solution.motion);
        frozen.set(&sets, &solution.motion);
        let end = &solution.motion.states[shape.horizon];
        let radius = shape.terminal.then(|| (sample.radius * shape.cost.end_square(end).sqrt()).max(1e-4));
        let zero = [Vector3::zeros(); 2];
        let problem = Problem {
            chain,
            cost: &shape.cost,
            start: normals.map_or(Start::Fixed(sample.start), |normals| Start::Within(sample.start, normals)),
            affine,
            constraints: &*frozen,
            end: End { weight: &shape.cost.end, slope: zero, radius },
        };
        let mut judged = solution.clone();
        let outcome = riccati.solve(&problem, &mut solution, 0, false, None);
        let verdict = cone.solve(&problem, &mut judged);
        let of = |outcome, solution: &Solution<2>| {
            (outcome, shape.cost.of(&solution.motion), Certificate::of(&problem, solution))
        };
        [of(outcome, &solution), of(verdict, &judged)]
    }
}

fn runner(cases: u32) -> TestRunner {
    let config =
        ProptestConfig { cases, failure_persistence: None, max_shrink_iters: 0, ..ProptestConfig::default() };
    TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::ChaCha))
}

#[test]
fn oracle_riccati_and_cone_agree_on_the_cost_of_5500_random_problems() {
    let counts = [Cell::new(0), Cell::new(0), Cell::new(0)];
    let (worst, most) = (Cell::new(0.0_f64), Cell::new(0));
    let problems = (shape(), prop::collection::vec(sample(), PER_SHAPE));
    runner(SHAPES)
        .run(&problems, |(shape, samples)| {
            let mut solvers = Solvers::new(shape.clone(), None);
            for sample in samples {
                let [(ours, cost, certificate), (judge, judged, judged_certificate)] = solvers.solve(&sample, None);
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
                        // The certificate shows that it is the judge who is wrong.
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
