//! Flights without an optimum: the fallback (31), and the plan that is kept.

use super::{controller, optimisations};
use crate::harness::Outcome;
use crate::prelude::*;
use control::crmpc::Plan;

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
    let recorded = optimisations(Constraints::Paper);
    let constrained = |sample: &&Recorded<Memory>| {
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
    // Beyond the horizon the trajectory brakes (docs/proof.md), so that the guarantee stays in
    // force. The plan moves towards the unconstrained optimum only as far as that is certified.
    let settings = settings(Constraints::Robust);
    let solver = SolverSettings { max_iterations: 1, ..settings.solver };
    let mut failing = Crmpc::new(Settings { solver, ..settings }).unwrap();
    let mut kept = 0;
    for sample in optimisations(Constraints::Robust).iter().skip(1) {
        let (after, _) = sample.update(&mut failing);
        if after.report.status != SolverStatus::Kept {
            continue;
        }
        kept += 1;
        let before = &sample.before.plan;
        assert_eq!(after.plan.states[0], before.states[1]);
        assert_ne!(after.plan.accelerations[0], before.accelerations[1], "it moves");
        assert_eq!(after.guarantee, GuaranteeStatus::InForce, "tick {}", sample.tick);
        assert_eq!(after.age, sample.before.age + 5);
        assert!(after.margins.rate >= 0.0 && after.margins.moment >= 0.0, "{:?}", after.margins);
    }
    assert!(kept > 100, "{kept}");
}

/// Runs the scenario with a solver that fails `during` some ticks. Returns the outcome, the
/// fallbacks inside and outside, and the last memory.
fn run_failing(during: Range<u64>) -> (Outcome, [u32; 2], Memory) {
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
    let noise = disturbance(DisturbanceKind::White);
    let outcome = simulate(&mut controller, &mut memory, 1.05, noise, |memory, tick, _| {
        let without = matches!(memory.report.status, SolverStatus::Fallback | SolverStatus::Kept);
        fallbacks[usize::from(!during.contains(&tick))] +=
            u32::from(without && memory.report.solves > last);
        last = memory.report.solves;
    });
    (outcome, fallbacks, memory)
}

#[test]
fn a_solver_that_fails_for_a_while_costs_no_limit() {
    // The failures are at the start, where only the terminal law is left, in the manoeuvre there
    // with the jump of the reference ahead, and about the jump, from before tick 570, the last one
    // at which a plan is at its limits. With a plan, the vehicle is led to the reference without a
    // solver.
    let cases = [(10..50, 0), (200..300, 0), (550..660, 0), (0..5, 24), (0..u64::MAX, 24)];
    for (during, most_outside) in cases {
        let (outcome, [inside, outside], memory) = run_failing(during.clone());
        assert!(inside > 0 && outside <= most_outside, "{during:?}: {inside}, {outside}");
        assert!(outcome.rate <= 1.0 && outcome.moment <= 1.0 + 1e-12, "{during:?}: {outcome:?}");
        assert!(outcome.ems_deg < 2.5, "{during:?}: {outcome:?}");
        assert_eq!(memory.report.status, SolverStatus::Unconstrained, "{during:?}");
    }
}
