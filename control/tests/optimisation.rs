//! The optimisation of CRMPC: its shortcuts, its fallback (31), and the independence of its solvers
//! from earlier samples.

mod harness;

use control::controller::Preview;
use control::crmpc::{
    Constraints, GuaranteeStatus, InitialState, Memory, Plan, Settings, SolverReport, SolverStatus,
};
use control::mpc::{Method, Nonlinearity, SolverSettings};
use control::schedule::Sampled;
use control::{Controller, Crmpc, Measurement};
use harness::{FEEDBACK, disturbance, settings, simulate};
use nalgebra::{Vector2, Vector3};
use proptest::prelude::*;
use proptest::test_runner::{RngAlgorithm, TestRng, TestRunner};
use std::cell::{Cell, RefCell};
use std::ops::Range;
use vehicle::disturbance::DisturbanceKind;
use vehicle::kinematics;
use vehicle::reference::Reference;
use vehicle::scenario::Scenario;

fn reference() -> impl Fn(f64) -> Reference {
    let scenario = Scenario::crmpc2022();
    move |time| scenario.reference.at(time)
}

fn controller(constraints: Constraints) -> Crmpc {
    Crmpc::new(settings(constraints)).unwrap()
}

/// Returns the controller with the cone program of the whole horizon at every sample.
fn cone(constraints: Constraints) -> Crmpc {
    let settings = settings(constraints);
    let solver = SolverSettings { method: Method::Cone, shortcuts: false, ..settings.solver };
    Crmpc::new(Settings { solver, ..settings }).unwrap()
}

/// Returns the memory without values from a clock.
fn timeless(memory: &Memory) -> Memory {
    Memory { report: SolverReport { time: 0.0, ..memory.report }, ..memory.clone() }
}

/// Input of one optimisation of a recorded run.
struct Recorded {
    tick: u64,
    before: Memory,
    measured: Measurement,
}

impl Recorded {
    fn update(&self, controller: &mut Crmpc) -> (Memory, Vector3<f64>) {
        let mut memory = self.before.clone();
        let time = self.tick as f64 * FEEDBACK;
        let moment = controller.update(&mut memory, self.tick, time, &self.measured, &reference());
        (memory, moment)
    }
}

/// Returns all optimisations of the scenario with white noise.
fn recorded(constraints: Constraints) -> Vec<Recorded> {
    let mut controller = controller(constraints);
    let ratio = controller.design().ratio as u64;
    let mut before = Memory::default();
    let mut samples = Vec::new();
    simulate(
        &mut controller,
        &mut Memory::default(),
        1.05,
        disturbance(DisturbanceKind::White),
        |after, tick, &measured| {
            if tick % ratio == 0 {
                samples.push(Recorded { tick, before: before.clone(), measured });
            }
            before.clone_from(after);
        },
    );
    samples
}

#[test]
fn shortcuts_lead_to_the_optimum_of_the_whole_horizon() {
    // These are first optimisations, which iterate to convergence, from random states at random
    // times.
    let cube = |half_deg: f64| {
        let half = half_deg.to_radians();
        [-half..half, -half..half, -half..half]
    };
    let states = (0.0..1.0f64, cube(8.0), cube(1.5), 0..225u64);
    for constraints in [Constraints::Robust, Constraints::Paper] {
        let (with, without) = (controller(constraints), cone(constraints));
        let (with, without) = (RefCell::new(with), RefCell::new(without));
        let limit = settings(constraints).limit_moment;
        let counts = [Cell::new(0), Cell::new(0)];
        let property = |(size, offset, rates, sample): (f64, [f64; 3], [f64; 3], u64)| {
            let time = sample as f64 * 0.2;
            let angles = reference()(time).angles + Vector3::from(offset) * size;
            let measured = Measurement {
                angles,
                rates: Vector3::from(rates) * size,
                ..Measurement::default()
            };
            let [(status, cost, moment), (status_whole, cost_whole, moment_whole)] =
                [&with, &without].map(|controller| {
                    let mut memory = Memory::default();
                    let mut controller = controller.borrow_mut();
                    let moment = controller.update(&mut memory, 0, time, &measured, &reference());
                    (memory.report.status, memory.report.cost, moment)
                });
            prop_assume!(status_whole == SolverStatus::Cone);
            prop_assert_ne!(status, SolverStatus::Fallback);
            counts[usize::from(status == SolverStatus::Constrained)].update(|count| count + 1);
            prop_assert!((cost - cost_whole).abs() <= 1e-6 * cost_whole, "{cost} {cost_whole}");
            let difference = (moment - moment_whole).norm() / limit;
            prop_assert!(difference < 1e-4, "{status:?}: {difference}");
            Ok(())
        };
        let config =
            ProptestConfig { cases: 192, failure_persistence: None, ..ProptestConfig::default() };
        let random = TestRng::deterministic_rng(RngAlgorithm::ChaCha);
        TestRunner::new_with_rng(config, random).run(&states, property).unwrap();
        assert!(counts.iter().all(|count| count.get() >= 10), "{constraints:?}: {counts:?}");
    }
}

#[test]
fn oracle_terminal_constraint_is_a_ball_in_the_norm_of_g() {
    // Chai 2022, (12): the print has the index R, which is 3×3, where E has six components.
    let mut controller = controller(Constraints::Paper);
    let (g, paper) = (controller.design().g, controller.design().paper.unwrap());
    let epsilon = paper.epsilon1.min(paper.epsilon2);
    let Settings { horizon, period_optimisation, period_feedback, .. } =
        settings(Constraints::Paper);
    let mut active = 0;
    for sample in recorded(Constraints::Paper) {
        let (memory, _) = sample.update(&mut controller);
        let end = reference()(
            sample.tick as f64 * period_feedback + horizon as f64 * period_optimisation,
        );
        let state = memory.plan.states[horizon];
        let axis = |i: usize| Vector2::new(state[i] - end.angles[i], state[3 + i] - end.rates[i]);
        let norm = (0..3).map(|i| (g[i] * axis(i)).dot(&axis(i))).sum::<f64>().sqrt();
        assert!(norm <= epsilon * (1.0 + 1e-6), "tick {}: {norm}", sample.tick);
        active += usize::from(norm >= epsilon * (1.0 - 1e-6));
    }
    // The terminal constraint is active while the jump is at the end of the horizon.
    assert!(active >= 3, "{active}");
}

#[test]
fn oracle_off_the_nominal_motion_the_input_changes_by_k_times_the_deviation() {
    // Chai 2022, (28): û = u + f(x), and (29): û^m = û* + K O_e. The print has B O_e, which has six
    // components.
    let mut controller = controller(Constraints::Robust);
    let Settings { body, feedback, .. } = settings(Constraints::Robust);
    let mut inside = 0;
    for sample in recorded(Constraints::Robust).iter().step_by(10) {
        let (mut memory, _) = sample.update(&mut controller);
        let tick = sample.tick + 1;
        let angles = sample.measured.angles + Vector3::new(0.001, -0.002, 0.003);
        let rates = sample.measured.rates + Vector3::new(-0.002, 0.001, 0.0005);
        let time = tick as f64 * FEEDBACK;
        let moment = controller.update(
            &mut memory,
            tick,
            time,
            &Measurement { angles, rates, ..Measurement::default() },
            &reference(),
        );

        let angle_rates = kinematics::r(&angles) * rates;
        let nominal = memory.nominal;
        let (angle, rate) =
            (angles - nominal.fixed_rows::<3>(0), angle_rates - nominal.fixed_rows::<3>(3));
        let expected = memory.plan.accelerations[0] + angle * feedback.k1 + rate * feedback.k2;
        // This is the state to which that acceleration leads by the middle of the period
        // (docs/guarantee.md).
        let half = 0.5 * FEEDBACK;
        let middle = angles + angle_rates * half + expected * (0.5 * half * half);
        if moment.norm() > (1.0 - 1e-12) * settings(Constraints::Robust).limit_moment {
            continue;
        }
        inside += 1;
        let input = kinematics::r(&middle) * body.inverse * moment
            + body.drift(&middle, &(angle_rates + expected * half));
        assert!((input - expected).norm() < 1e-13, "tick {tick}: {input} {expected}");
        assert!(angle.norm() > 1e-4, "tick {tick}: no deviation");
    }
    assert!(inside > 10, "{inside}");
}

#[test]
fn shortcuts_change_nothing_along_a_run() {
    // The first solver has the norm constraints as functions of the trajectory; the second, the
    // cone solver, has them linearised.
    let solvers = [(Nonlinearity::Exact, Method::Riccati), (Nonlinearity::Frozen, Method::Cone)];
    for constraints in [Constraints::Robust, Constraints::Paper] {
        for (nonlinearity, method) in solvers {
            let settings = settings(constraints);
            let solver = SolverSettings { nonlinearity, ..settings.solver };
            let mut with = Crmpc::new(Settings { solver, ..settings }).unwrap();
            let solver = SolverSettings { method, shortcuts: false, ..solver };
            let mut without = Crmpc::new(Settings { solver, ..settings }).unwrap();
            let limit = settings.limit_moment;
            let mut counts = [0, 0];
            for sample in recorded(constraints).iter().step_by(3) {
                let (memory, moment) = sample.update(&mut with);
                let (whole, moment_whole) = sample.update(&mut without);
                counts[usize::from(memory.report.status == SolverStatus::Constrained)] += 1;
                let (cost, cost_whole) = (memory.report.cost, whole.report.cost);
                let tick = sample.tick;
                assert!(
                    (cost - cost_whole).abs() <= 1e-7 * cost_whole,
                    "tick {tick}: {cost} {cost_whole}"
                );
                let difference = (moment - moment_whole).norm() / limit;
                assert!(difference < 1e-4, "tick {tick}: {difference}");
            }
            assert!(counts.iter().all(|&count| count > 1), "{constraints:?}: {counts:?}");
        }
    }
}

#[test]
fn oracle_without_a_disturbance_bound_all_solvers_agree_however_the_plan_begins() {
    let measured =
        Measurement { angles: Scenario::crmpc2022().initial_angles, ..Measurement::default() };
    for constraints in [Constraints::Robust, Constraints::Paper] {
        for initial_state in [InitialState::Measured, InitialState::Nominal, InitialState::Tube] {
            let [cost, cost_cone] = [Method::Riccati, Method::Cone].map(|method| {
                let settings = Settings {
                    disturbance_bound: 0.0,
                    inertia_error: 0.0,
                    initial_state,
                    ..settings(constraints)
                };
                let solver = SolverSettings { method, shortcuts: false, ..settings.solver };
                let mut controller = Crmpc::new(Settings { solver, ..settings }).unwrap();
                let mut memory = Memory::default();
                controller.update(&mut memory, 0, 0.0, &measured, &reference());
                let expected = if method == Method::Riccati {
                    SolverStatus::Constrained
                } else {
                    SolverStatus::Cone
                };
                assert_eq!(memory.report.status, expected, "{constraints:?}, {initial_state:?}");
                memory.report.cost
            });
            let context = format!("{constraints:?}, {initial_state:?}: {cost} {cost_cone}");
            assert!((cost - cost_cone).abs() <= 1e-6 * cost_cone, "{context}");
        }
    }
}

#[test]
fn every_way_to_the_optimum_shows_that_it_is_one() {
    // The measure is the residual of the conditions of optimality, with the constraints as
    // functions of the trajectory. Where the bounds follow the trajectory, as in the robust set,
    // the solver stops when a norm constraint is exceeded by 1e-5 (docs/solver.md).
    for constraints in [Constraints::Robust, Constraints::Paper] {
        let mut controller = controller(constraints);
        let mut seen = Vec::new();
        for sample in recorded(constraints) {
            let SolverReport { status, residual, .. } = sample.update(&mut controller).0.report;
            let largest = match status {
                SolverStatus::Unconstrained | SolverStatus::TerminalConstraint => 1e-9,
                _ if constraints == Constraints::Robust => 1e-5,
                _ => 2e-6,
            };
            assert!(residual <= largest, "tick {}: {status:?} {residual}", sample.tick);
            if !seen.contains(&status) {
                seen.push(status);
            }
        }
        assert!(
            seen.contains(&SolverStatus::Unconstrained)
                && seen.contains(&SolverStatus::Constrained),
            "{seen:?}"
        );
        assert!(
            constraints == Constraints::Robust || seen.contains(&SolverStatus::TerminalConstraint),
            "{seen:?}"
        );
    }
}

/// Checks (31) independently: the plan is the one before without its first interval, followed by
/// one interval under the acceleration `last` of the state before.
fn assert_is_shifted(
    after: &Plan,
    before: &Plan,
    settings: &Settings,
    last: impl Fn(f64, f64, usize) -> f64,
) {
    let n = settings.horizon;
    assert_eq!(after.states[..n], before.states[1..]);
    assert_eq!(after.accelerations[..n - 1], before.accelerations[1..]);
    let h = settings.period_optimisation;
    let end = before.states[n];
    for i in 0..3 {
        let a = last(end[i], end[3 + i], i);
        assert!((after.accelerations[n - 1][i] - a).abs() < 1e-14);
        assert!((after.states[n][3 + i] - (end[3 + i] + h * a)).abs() < 1e-14);
        assert!((after.states[n][i] - (end[i] + h * end[3 + i] + 0.5 * h * h * a)).abs() < 1e-14);
    }
}

#[test]
fn published_fallback_is_the_shifted_plan_with_the_terminal_law() {
    let settings = settings(Constraints::Paper);
    let mut failing = Crmpc::new(Settings {
        solver: SolverSettings { max_iterations: 1, ..settings.solver },
        ..settings
    })
    .unwrap();
    let recorded = recorded(Constraints::Paper);
    let constrained = |sample: &&Recorded| {
        sample.tick > 0
            && sample.update(&mut controller(Constraints::Paper)).0.report.status
                == SolverStatus::Constrained
    };
    let samples: Vec<_> = recorded.iter().filter(constrained).take(3).collect();
    assert_eq!(samples.len(), 3);
    for sample in samples {
        let (after, moment) = sample.update(&mut failing);
        assert_eq!(after.report.status, SolverStatus::Fallback);
        assert_eq!(after.report.fallbacks, sample.before.report.fallbacks + 1);
        assert_eq!(after.report.solves, sample.before.report.solves + 1);
        let time = sample.tick as f64 * settings.period_feedback;
        let h = settings.period_optimisation;
        let at = |k: usize| reference()(time + k as f64 * h);
        let end = at(settings.horizon - 1);
        assert_is_shifted(&after.plan, &sample.before.plan, &settings, |angle, rate, i| {
            // Terminal law (14).
            settings.terminal.k1 * (angle - end.angles[i])
                + settings.terminal.k2 * (rate - end.rates[i])
                + end.accelerations[i]
        });

        // The residual shows that the plan is no optimum.
        assert!(after.report.residual > 1e-3, "{}", after.report.residual);

        // The cost is calculated independently.
        let mut cost = 0.0;
        for k in 0..=settings.horizon {
            let reference = at(k);
            for i in 0..3 {
                let state = &after.plan.states[k];
                let e =
                    Vector2::new(state[i] - reference.angles[i], state[3 + i] - reference.rates[i]);
                if k < settings.horizon {
                    let v = after.plan.accelerations[k][i] - reference.accelerations[i];
                    cost += h
                        * (settings.p[i] * e.x * e.x
                            + settings.p[3 + i] * e.y * e.y
                            + settings.q[i] * v * v);
                } else {
                    cost += (e.transpose() * failing.design().g[i] * e).x;
                }
            }
        }
        assert!((after.report.cost - cost).abs() < 1e-9 * cost, "{} {cost}", after.report.cost);

        // Feedback law (20) about the shifted plan: R I⁻¹ m = u = K O_e + ũ, ũ = a − f(x). The
        // limit is kept.
        let Measurement { angles, rates, .. } = sample.measured;
        let angle_rates = kinematics::r(&angles) * rates;
        assert!(moment.norm() <= settings.limit_moment * (1.0 + 1e-12));
        if moment.norm() > settings.limit_moment * (1.0 - 1e-12) {
            continue;
        }
        let u = kinematics::r(&angles) * (settings.body.inverse * moment);
        let nominal = &after.plan.states[0];
        let acceleration = u + settings.body.drift(&angles, &angle_rates);
        for i in 0..3 {
            let feedback = settings.feedback.k1 * (angles[i] - nominal[i])
                + settings.feedback.k2 * (angle_rates[i] - nominal[3 + i]);
            assert!((acceleration[i] - after.plan.accelerations[0][i] - feedback).abs() < 1e-12);
        }
    }
}

#[test]
fn the_robust_plan_is_kept_where_no_optimum_is_found() {
    // Beyond the horizon the trajectory brakes (docs/guarantee.md), so that the guarantee stays in
    // force. The plan moves towards the unconstrained optimum only as far as that is certified.
    let settings = settings(Constraints::Robust);
    let solver = SolverSettings { max_iterations: 1, ..settings.solver };
    let mut failing = Crmpc::new(Settings { solver, ..settings }).unwrap();
    let (mut shifted, mut moved) = (0, 0);
    for sample in recorded(Constraints::Robust).iter().skip(1) {
        let (after, _) = sample.update(&mut failing);
        if after.report.status != SolverStatus::Kept {
            continue;
        }
        let before = &sample.before.plan;
        if after.plan.accelerations[0] == before.accelerations[1] {
            shifted += 1;
            assert_is_shifted(&after.plan, before, &settings, |_, rate, i| {
                -rate * if i == 1 { before.braking } else { 0.01 }
            });
        } else {
            moved += 1;
            assert_eq!(after.plan.states[0], before.states[1]);
        }
        assert_eq!(after.guarantee, GuaranteeStatus::InForce, "tick {}", sample.tick);
        assert_eq!(after.age, sample.before.age + 5);
        assert!(after.margins.rate >= 0.0 && after.margins.moment >= 0.0, "{:?}", after.margins);
    }
    assert!(shifted > 20 && moved > 0, "{shifted} {moved}");
}

/// A controller whose solver fails during some ticks.
struct Interrupted {
    working: Crmpc,
    failing: Crmpc,
    during: Range<u64>,
}

impl Controller for Interrupted {
    type Memory = Memory;

    fn command(
        &mut self,
        memory: &mut Memory,
        tick: u64,
        time: f64,
        measured: &Measurement,
        reference: control::controller::ReferenceAt,
    ) -> Vector3<f64> {
        let controller =
            if self.during.contains(&tick) { &mut self.failing } else { &mut self.working };
        controller.command(memory, tick, time, measured, reference)
    }

    fn limit(&self, memory: &Memory) -> f64 {
        self.working.limit(memory)
    }

    fn limited(&mut self, memory: &mut Memory, applied: &Vector3<f64>) {
        self.working.limited(memory, applied);
    }
}

/// Runs the scenario with a solver that fails `during` some ticks. Returns the outcome, the
/// fallbacks inside and outside, and the last memory.
fn run_failing(during: Range<u64>) -> (harness::Outcome, [u32; 2], Memory) {
    let settings = settings(Constraints::Robust);
    let mut controller = Interrupted {
        working: Crmpc::new(settings).unwrap(),
        failing: Crmpc::new(Settings {
            solver: SolverSettings { max_iterations: 1, ..settings.solver },
            ..settings
        })
        .unwrap(),
        during: during.clone(),
    };
    let mut memory = Memory::default();
    // These are optimisations without an optimum, at which the plan was kept or given up.
    let mut fallbacks = [0, 0];
    let mut last = 0;
    let outcome = simulate(
        &mut controller,
        &mut memory,
        1.05,
        disturbance(DisturbanceKind::White),
        |memory, tick, _| {
            let without =
                matches!(memory.report.status, SolverStatus::Fallback | SolverStatus::Kept);
            fallbacks[usize::from(!during.contains(&tick))] +=
                u32::from(without && memory.report.solves > last);
            last = memory.report.solves;
        },
    );
    (outcome, fallbacks, memory)
}

#[test]
fn a_solver_that_fails_for_a_while_costs_no_limit() {
    // The failures are in the manoeuvre at the start, with the jump of the reference ahead, and
    // about the jump, from before tick 570, the last one at which a plan is at its limits.
    for during in [10..50, 200..300, 550..660] {
        let (outcome, [inside, outside], memory) = run_failing(during.clone());
        assert!(
            inside > 0 && outside == 0,
            "{during:?}: {inside} fallbacks inside, {outside} outside"
        );
        assert!(outcome.rate <= 1.0 && outcome.moment <= 1.0, "{during:?}: {outcome:?}");
        assert_eq!(memory.report.status, SolverStatus::Unconstrained, "{during:?}");
    }
}

#[test]
fn a_solver_that_fails_from_the_start_is_outlived() {
    // Without a plan only the terminal law is left. With a plan, the vehicle is led to the
    // reference without a solver.
    for during in [0..5, 0..u64::MAX] {
        let (outcome, [inside, outside], memory) = run_failing(during.clone());
        assert!(
            inside > 0 && outside < 25,
            "{during:?}: {inside} fallbacks inside, {outside} outside"
        );
        assert!(outcome.rate <= 1.0 && outcome.moment <= 1.0 + 1e-12, "{during:?}: {outcome:?}");
        assert!(outcome.ems_deg < 2.5, "{during:?}: {outcome:?}");
        assert_eq!(memory.report.status, SolverStatus::Unconstrained, "{during:?}");
    }
}

#[test]
fn another_evaluation_of_a_tick_leaves_no_trace() {
    let scenario = Scenario::crmpc2022();
    let preview = Preview::Profile(&scenario.reference);
    let garbage = harness::garbage();
    let mut truth = Vec::new();
    simulate(
        &mut controller(Constraints::Robust),
        &mut Memory::default(),
        1.05,
        disturbance(DisturbanceKind::White),
        |_, _, &measured| truth.push(measured),
    );
    let (mut disturbed_controller, mut calm_controller) =
        (controller(Constraints::Robust), controller(Constraints::Robust));
    let new = || Sampled::new(0.0, FEEDBACK, Memory::default());
    let (mut disturbed, mut calm) = (new(), new());
    for (tick, measured) in truth.iter().enumerate().take(300) {
        let wrong = &garbage[tick / 5 % garbage.len()];
        disturbed.evaluate(&mut disturbed_controller, wrong, &preview);
        disturbed.evaluate(&mut disturbed_controller, measured, &preview);
        calm.evaluate(&mut calm_controller, measured, &preview);
        let ((moment, memory), (calm_moment, calm_memory)) =
            (disturbed.in_force(), calm.in_force());
        assert_eq!(moment, calm_moment, "tick {tick} {:?} {:?}", memory.report, calm_memory.report);
        assert_eq!(timeless(memory), timeless(calm_memory), "tick {tick}");
        disturbed.commit();
        calm.commit();
    }
}

#[test]
fn a_saved_memory_continues_bit_for_bit_in_a_new_controller() {
    for constraints in [Constraints::Robust, Constraints::Paper] {
        let mut truth = Vec::new();
        simulate(
            &mut controller(constraints),
            &mut Memory::default(),
            0.95,
            disturbance(DisturbanceKind::White),
            |_, _, &measured| truth.push(measured),
        );
        let scenario = Scenario::crmpc2022();
        let preview = Preview::Profile(&scenario.reference);
        let mut used = controller(constraints);
        let mut sampled = Sampled::new(0.0, FEEDBACK, Memory::default());
        for (tick, measured) in truth.iter().enumerate().take(750) {
            // The saved state is taken within and at the beginning of an optimisation period, with
            // the tick evaluated or not.
            if tick % 7 == 3 {
                if tick % 2 == 0 {
                    sampled.evaluate(&mut used, measured, &preview);
                }
                let saved = postcard::to_stdvec(&sampled).unwrap();
                let mut restored: Sampled<Memory> = postcard::from_bytes(&saved).unwrap();
                let mut copy = sampled.clone();
                let mut fresh = controller(constraints);
                for later in &truth[tick..tick + 7] {
                    for (sampled, controller) in
                        [(&mut restored, &mut fresh), (&mut copy, &mut used)]
                    {
                        sampled.evaluate(controller, later, &preview);
                    }
                    let ((moment, memory), (moment_used, memory_used)) =
                        (restored.in_force(), copy.in_force());
                    assert_eq!(moment, moment_used, "saved at tick {tick}");
                    assert_eq!(timeless(memory), timeless(memory_used), "saved at tick {tick}");
                    restored.commit();
                    copy.commit();
                }
            }
            sampled.evaluate(&mut used, measured, &preview);
            sampled.commit();
        }
    }
}
