//! Every shortcut leads to the optimum.

use super::{controller, optimisations};
use crate::prelude::*;
use control::mpc::Method;
use proptest::prelude::*;
use proptest::test_runner::{RngAlgorithm, TestRng, TestRunner};
use std::cell::RefCell;

/// Returns the controller with the cone program of the whole horizon at every sample.
fn cone(constraints: Constraints) -> Crmpc {
    let settings = settings(constraints);
    let solver = SolverSettings { method: Method::Cone, shortcuts: false, ..settings.solver };
    Crmpc::new(Settings { solver, ..settings }).unwrap()
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
    for sample in optimisations(Constraints::Paper) {
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
    for sample in optimisations(Constraints::Robust).iter().step_by(10) {
        let (mut memory, _) = sample.update(&mut controller);
        let tick = sample.tick + 1;
        let angles = sample.measured.angles + Vector3::new(0.001, -0.002, 0.003);
        let rates = sample.measured.rates + Vector3::new(-0.002, 0.001, 0.0005);
        let time = tick as f64 * FEEDBACK;
        let measured = Measurement { angles, rates, ..Measurement::default() };
        let moment = controller.update(&mut memory, tick, time, &measured, &reference());

        let angle_rates = kinematics::r(&angles) * rates;
        let nominal = memory.nominal;
        let (angle, rate) =
            (angles - nominal.fixed_rows::<3>(0), angle_rates - nominal.fixed_rows::<3>(3));
        let expected = memory.plan.accelerations[0] + angle * feedback.k1 + rate * feedback.k2;
        // This is the state to which that acceleration leads by the middle of the period
        // (docs/proof.md).
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
fn oracle_without_a_disturbance_bound_all_solvers_agree_however_the_plan_begins() {
    let measured =
        Measurement { angles: Scenario::crmpc2022().initial_angles, ..Measurement::default() };
    for constraints in [Constraints::Robust, Constraints::Paper] {
        for initial_state in [InitialState::Measured, InitialState::Nominal] {
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
        for sample in optimisations(constraints) {
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
