//! The outer layer: its optimum, its shortcuts and its fallback.

use super::dlmpc;
use crate::prelude::*;
use control::dlmpc::{Memory, Settings};
use nalgebra::{DMatrix, DVector};
use vehicle::kinematics::r_inverse;

fn optimisations() -> Vec<Recorded<Memory>> {
    recorded(&mut dlmpc(), 1.05, dlmpc().ratio())
}

/// The optimisation problem as a function of the commands v_0 … v_{N−1} alone.
struct ConicProgram {
    settings: Settings,
    time: f64,
    start: Vector3<f64>,
}

impl ConicProgram {
    fn angles(&self, v: &DVector<f64>) -> Vec<Vector3<f64>> {
        let mut angles = vec![self.start];
        for k in 0..self.settings.horizon {
            angles.push(angles[k] + v.fixed_rows::<3>(3 * k) * self.settings.period_optimisation);
        }
        angles
    }

    fn at(&self, k: usize) -> Reference {
        reference()(self.time + k as f64 * self.settings.period_optimisation)
    }

    fn cost(&self, v: &DVector<f64>) -> f64 {
        let Settings { p, q, horizon, .. } = self.settings;
        let mut cost = 0.0;
        for (k, angles) in self.angles(v).iter().enumerate() {
            let reference = self.at(k);
            for i in 0..3 {
                cost += p[i] * (angles[i] - reference.angles[i]).powi(2);
                if k < horizon {
                    cost += q[i] * (v[3 * k + i] - reference.rates[i]).powi(2);
                }
            }
        }
        cost
    }

    /// Returns (‖R⁻¹(Θ_k) v_k‖² − bound²)/2 of each interval.
    fn constraints(&self, v: &DVector<f64>) -> DVector<f64> {
        let angles = self.angles(v);
        DVector::from_fn(self.settings.horizon, |k, _| {
            let rates = r_inverse(&angles[k]) * v.fixed_rows::<3>(3 * k);
            (rates.norm_squared() - self.settings.limit_rate.powi(2)) / 2.0
        })
    }
}

#[test]
fn oracle_first_optimum_satisfies_the_karush_kuhn_tucker_conditions() {
    let settings = Settings::published();
    let step = 1e-4;
    // The first start is that of the scenario; the second is near the jump, where a window in the
    // middle replaces the whole horizon.
    let offset = Vector3::new(0.02, -0.01, 0.03);
    for (time, start) in
        [(0.0, Scenario::crmpc2022().initial_angles), (15.0, reference()(15.0).angles + offset)]
    {
        let measured =
            Measurement { angles: start, rates: Vector3::zeros(), ..Measurement::default() };
        let mut memory = Memory::default();
        dlmpc().update(&mut memory, 0, time, &measured, &reference());
        assert_eq!(memory.report.status, SolverStatus::Constrained);
        let program = ConicProgram { settings, time, start };
        let v = DVector::from_iterator(
            3 * settings.horizon,
            memory.plan.commands.iter().flat_map(|v| [v.x, v.y, v.z]),
        );
        assert!((memory.report.cost - program.cost(&v)).abs() < 1e-9 * program.cost(&v));

        let derivative = |function: &dyn Fn(&DVector<f64>) -> DVector<f64>, i: usize| {
            let (mut plus, mut minus) = (v.clone(), v.clone());
            plus[i] += step;
            minus[i] -= step;
            (function(&plus) - function(&minus)) / (2.0 * step)
        };
        let cost = |v: &DVector<f64>| DVector::repeat(1, program.cost(v));
        let gradient = DVector::from_fn(v.len(), |i, _| derivative(&cost, i)[0]);
        let constraints = program.constraints(&v);
        let scale = settings.limit_rate.powi(2);
        assert!(constraints.max() <= 1e-6 * scale, "{}", constraints.max() / scale);
        let active: Vec<usize> =
            (0..constraints.len()).filter(|&k| constraints[k] > -1e-5 * scale).collect();
        assert!(active.len() >= 2, "{active:?}");
        let columns: Vec<_> = (0..v.len())
            .map(|i| {
                let slope = derivative(&|v| program.constraints(v), i);
                DVector::from_iterator(active.len(), active.iter().map(|&k| slope[k]))
            })
            .collect();
        let jacobian = DMatrix::from_columns(&columns).transpose();
        // The optimum satisfies ∇J + Σ λ ∇c = 0 with λ ≥ 0.
        let normal = (jacobian.transpose() * &jacobian).cholesky().unwrap();
        let multipliers = normal.solve(&(-jacobian.transpose() * &gradient));
        let residual = (&gradient + jacobian * &multipliers).norm();
        assert!(gradient.norm() > 0.1, "{}", gradient.norm());
        assert!(residual < 1e-4 * gradient.norm(), "{residual} of {}", gradient.norm());
        assert!(multipliers.min() > -1e-4 * multipliers.max(), "{multipliers}");
    }
}

#[test]
fn shortcuts_change_nothing_along_a_run() {
    let settings = Settings::published();
    let [mut with, mut without] = [true, false].map(|shortcuts| {
        let solver = SolverSettings { shortcuts, ..settings.solver };
        Dlmpc::new(Settings { solver, ..settings }).unwrap()
    });
    let limit = Settings::published().limit_rate;
    let mut counts = [0, 0];
    for sample in optimisations().iter().step_by(3) {
        let (memory, _) = sample.update(&mut with);
        let (whole, _) = sample.update(&mut without);
        counts[usize::from(memory.report.status == SolverStatus::Constrained)] += 1;
        assert_eq!(whole.report.status, SolverStatus::Constrained);
        let (cost, cost_whole) = (memory.report.cost, whole.report.cost);
        assert!((cost - cost_whole).abs() <= 1e-7 * cost_whole, "{cost} {cost_whole}");
        let difference = (memory.rate_command - whole.rate_command).norm() / limit;
        assert!(difference < 1e-4, "tick {}: {difference}", sample.tick);
    }
    assert!(counts.iter().all(|&count| count > 20), "{counts:?}");
}

#[test]
fn without_a_solution_the_shifted_plan_is_tracked_within_the_limit() {
    let settings = Settings::published();
    let mut failing = Dlmpc::new(Settings {
        solver: SolverSettings { max_iterations: 1, ..settings.solver },
        ..settings
    })
    .unwrap();
    let limit = settings.limit_rate * (1.0 + 1e-12);
    let mut fallbacks = 0;
    for sample in optimisations() {
        let (after, moment) = sample.update(&mut failing);
        if after.report.status != SolverStatus::Fallback || sample.tick == 0 {
            continue;
        }
        fallbacks += 1;
        assert_eq!(after.report.fallbacks, sample.before.report.fallbacks + 1);
        assert!(moment.norm() <= settings.limit_moment);
        let (plan, before) = (&after.plan, &sample.before.plan);
        assert_eq!(plan.angles[0], sample.measured.angles);
        for (k, command) in plan.commands.iter().enumerate() {
            assert!((r_inverse(&plan.angles[k]) * command).norm() <= limit, "interval {k}");
            let next = plan.angles[k] + command * settings.period_optimisation;
            assert!((next - plan.angles[k + 1]).amax() < 1e-14, "interval {k}");
        }
        // The feedback closes the gap between the two plans.
        let gap = |k: usize| (plan.angles[k] - before.angles[k + 1]).norm();
        assert!(gap(30) <= 1e-3 * gap(0).max(1e-6), "{} of {}", gap(30), gap(0));
    }
    assert!(fallbacks > 50, "{fallbacks}");
}

#[test]
fn a_solver_that_fails_is_outlived() {
    let settings = Settings::published();
    for during in [0..5, 10..50, 200..300, 575..660, 0..u64::MAX] {
        let mut controller = Interrupted {
            working: dlmpc(),
            failing: Dlmpc::new(Settings {
                solver: SolverSettings { max_iterations: 1, ..settings.solver },
                ..settings
            })
            .unwrap(),
            during: during.clone(),
        };
        let mut memory = Memory::default();
        let noise = disturbance(DisturbanceKind::White);
        let outcome = simulate(&mut controller, &mut memory, 1.05, noise, |_, _, _| {});
        assert!(memory.report.fallbacks > 0, "{during:?}");
        assert!(outcome.moment <= 1.0 && outcome.rate <= 1.05, "{during:?}: {outcome:?}");
        assert!(outcome.ems_deg < 2.0, "{during:?}: {outcome:?}");
        assert_eq!(memory.report.status, SolverStatus::Unconstrained, "{during:?}");
    }
}
