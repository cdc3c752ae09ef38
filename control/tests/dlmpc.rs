//! Tests of DLMPC: the optimum of its outer layer, the sliding mode of its inner layer, and the
//! loop of both.

mod harness;

use control::controller::Preview;
use control::dlmpc::{Memory, Plan, Settings, SlidingMode, SolverReport, SolverStatus};
use control::mpc::{Method, Nonlinearity, SolverSettings};
use control::schedule::Sampled;
use control::{Controller, DesignError, Dlmpc, Measurement};
use harness::{FEEDBACK, disturbance, in_parallel, simulate, white};
use nalgebra::{DMatrix, DVector, Vector3};
use std::ops::Range;
use vehicle::disturbance::DisturbanceKind;
use vehicle::kinematics::r_inverse;
use vehicle::reference::Reference;
use vehicle::scenario::Scenario;

fn reference() -> impl Fn(f64) -> Reference {
    let scenario = Scenario::crmpc2022();
    move |time| scenario.reference.at(time)
}

fn dlmpc() -> Dlmpc {
    Dlmpc::new(Settings::published()).unwrap()
}

/// Returns the memory without values from a clock.
fn timeless(memory: &Memory) -> Memory {
    Memory {
        report: SolverReport { time: 0.0, ..memory.report },
        inner_time: 0.0,
        ..memory.clone()
    }
}

/// Input of one tick of a run.
struct Recorded {
    tick: u64,
    before: Memory,
    measured: Measurement,
}

impl Recorded {
    fn update(&self, controller: &mut Dlmpc) -> (Memory, Vector3<f64>) {
        let mut memory = self.before.clone();
        let time = self.tick as f64 * FEEDBACK;
        let moment = controller.update(&mut memory, self.tick, time, &self.measured, &reference());
        (memory, moment)
    }
}

/// Returns all ticks of the scenario with white noise.
fn recorded() -> Vec<Recorded> {
    let mut before = Memory::default();
    let mut samples = Vec::new();
    let noise = disturbance(DisturbanceKind::White);
    simulate(&mut dlmpc(), &mut Memory::default(), 1.05, noise, |after, tick, &measured| {
        samples.push(Recorded { tick, before: before.clone(), measured });
        before.clone_from(after);
    });
    samples
}

fn optimisations() -> Vec<Recorded> {
    let ratio = dlmpc().ratio();
    recorded().into_iter().filter(|sample| sample.tick % ratio == 0).collect()
}

// Tests of the outer layer.

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
    let frozen = SolverSettings { nonlinearity: Nonlinearity::Frozen, ..settings.solver };
    let cone = SolverSettings { method: Method::Cone, shortcuts: false, ..frozen };
    let [mut with, mut without] =
        [frozen, cone].map(|solver| Dlmpc::new(Settings { solver, ..settings }).unwrap());
    let limit = Settings::published().limit_rate;
    let mut counts = [0, 0];
    for sample in optimisations().iter().step_by(3) {
        let (memory, _) = sample.update(&mut with);
        let (whole, _) = sample.update(&mut without);
        counts[usize::from(memory.report.status == SolverStatus::Constrained)] += 1;
        assert_eq!(whole.report.status, SolverStatus::Cone);
        let (cost, cost_whole) = (memory.report.cost, whole.report.cost);
        assert!(
            (cost - cost_whole).abs() <= 1e-7 * cost_whole,
            "tick {}: {cost} {cost_whole}",
            sample.tick
        );
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

/// A controller whose solver fails during some ticks.
struct Interrupted {
    working: Dlmpc,
    failing: Dlmpc,
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

// Tests of the inner layer.

/// Returns the rates under the inner law alone, one sample after another. The attitude rests at a
/// constant reference, so that the commanded rates are zero and ω⁺ = ω + T ω̇.
fn inner_law(
    sliding_mode: SlidingMode,
    rates: Vector3<f64>,
    ticks: u64,
) -> Vec<(Vector3<f64>, Memory)> {
    let settings = Settings { sliding_mode, ..Settings::published() };
    let mut controller = Dlmpc::new(settings).unwrap();
    let still = Reference { angles: Vector3::new(0.2, 0.1, -0.5), ..Reference::default() };
    let mut memory = controller.memory();
    let mut measured = Measurement { angles: still.angles, rates, ..Measurement::default() };
    (0..ticks)
        .map(|tick| {
            let moment = controller.update(&mut memory, tick, 0.0, &measured, &|_| still);
            assert_eq!(memory.rate_command, Vector3::zeros());
            let seen = (moment, memory.clone());
            measured.rates += settings.body.angular_acceleration(&measured.rates, &moment)
                * settings.period_feedback;
            seen
        })
        .collect()
}

#[test]
fn oracle_sampled_sliding_mode_chatters_with_the_closed_form_amplitude() {
    // The amplitude solves −s = (1 − q T) s − p T |s|^ρ sgn s.
    let period = Settings::published().period_feedback;
    for (q, p, rho) in [(5.0, 5.0, 0.7), (0.0, 5.0, 0.7), (2.0, 3.0, 0.6)] {
        let amplitude = (p * period / (2.0 - q * period)).powf(1.0 / (1.0 - rho));
        let seen =
            inner_law(SlidingMode { q, p, gamma: 0.0, rho }, Vector3::new(5e-3, -3e-3, 1e-3), 400);
        for pair in seen[300..].windows(2) {
            let (now, next) = (pair[0].1.sliding, pair[1].1.sliding);
            for i in 0..3 {
                assert!(
                    (now[i].abs() - amplitude).abs() < 1e-6 * amplitude,
                    "{} {amplitude}",
                    now[i]
                );
                assert!(now[i] * next[i] < 0.0);
            }
        }
        // The gain of the manifold changes it little.
        let seen = inner_law(
            SlidingMode { q, p, gamma: 0.15, rho },
            Vector3::new(5e-3, -3e-3, 1e-3),
            2000,
        );
        for (_, memory) in &seen[1900..] {
            assert!(
                (memory.sliding.amax() - amplitude).abs() < 0.05 * amplitude,
                "{}",
                memory.sliding
            );
        }
    }
}

#[test]
fn the_integral_rests_while_the_moment_is_scaled_into_its_limit() {
    let settings = Settings::published();
    let SlidingMode { gamma, rho, .. } = settings.sliding_mode;
    let seen = inner_law(settings.sliding_mode, Vector3::new(0.08, -0.05, 0.03), 200);
    let mut counts = [0, 0];
    for pair in seen.windows(2) {
        let (moment, memory) = &pair[1];
        let before = pair[0].1.integral;
        let saturated = moment.norm() > settings.limit_moment * (1.0 - 1e-12);
        counts[usize::from(saturated)] += 1;
        // The error e follows from s = e + Γ z.
        let e = memory.sliding - before * gamma;
        let growth = e.map(|e| e.abs().powf(rho).copysign(e)) * settings.period_feedback;
        let expected = if saturated { before } else { before + growth };
        assert!((memory.integral - expected).amax() <= 1e-12 * growth.amax());
    }
    assert!(counts.iter().all(|&count| count > 5), "{counts:?}");
}

#[test]
fn oracle_inner_law_is_the_reaching_law() {
    // The reaching law is ṡ = −q s − p sig^ρ(s), with ṡ = ω̇ + Γ sig^ρ(e) for a held command.
    let settings = Settings::published();
    let SlidingMode { q, p, gamma, rho } = settings.sliding_mode;
    let power = |x: Vector3<f64>| x.map(|x| x.abs().powf(rho).copysign(x));
    let mut controller = dlmpc();
    for sample in recorded().iter().step_by(13) {
        let (memory, moment) = sample.update(&mut controller);
        if moment.norm() > settings.limit_moment * (1.0 - 1e-9) {
            continue;
        }
        let e = sample.measured.rates - memory.rate_command;
        let s = e + sample.before.integral * gamma;
        let growth =
            settings.body.angular_acceleration(&sample.measured.rates, &moment) + power(e) * gamma;
        assert!(
            (growth + s * q + power(s) * p).norm() < 1e-12 * (1.0 + growth.norm()),
            "tick {}",
            sample.tick
        );
    }
}

// Tests of both layers together.

#[test]
fn the_loop_tracks_and_never_exceeds_the_moment() {
    for settings in [Settings::published(), Settings::tuned()] {
        let cases = white(1..=4, 0.04);
        let outcomes = in_parallel(&cases, |case| {
            let mut memory = Memory::default();
            let mut largest_command = 0.0f64;
            let outcome = simulate(
                &mut Dlmpc::new(settings).unwrap(),
                &mut memory,
                case.inertia_scale,
                case.disturbance.clone(),
                |memory, _, _| largest_command = largest_command.max(memory.rate_command.norm()),
            );
            (outcome, memory.report.fallbacks, largest_command / settings.limit_rate)
        });
        for (case, (outcome, fallbacks, command)) in cases.iter().zip(outcomes) {
            let name = &case.name;
            assert!(outcome.ems_deg < 1.9, "{name}: {outcome:?}");
            assert!(outcome.moment <= 1.0, "{name}: {outcome:?}");
            // DLMPC reserves nothing for disturbances: the command keeps its limit, and the rate
            // exceeds its limit slightly.
            assert!(command <= 1.0 + 1e-6 && command > 0.999, "{name}: {command}");
            assert!(outcome.rate <= 1.05, "{name}: {outcome:?}");
            assert_eq!(fallbacks, 0, "{name}");
        }
    }
}

#[test]
fn tuned_gains_spend_less_moment_at_no_larger_error() {
    let mean = |settings: Settings| {
        let cases: Vec<_> =
            white(21..=26, 0.04).into_iter().filter(|case| case.inertia_scale > 1.0).collect();
        let outcomes = in_parallel(&cases, |case| {
            let (scale, noise) = (case.inertia_scale, case.disturbance.clone());
            simulate(
                &mut Dlmpc::new(settings).unwrap(),
                &mut Memory::default(),
                scale,
                noise,
                |_, _, _| {},
            )
        });
        let n = outcomes.len() as f64;
        let ems_deg = outcomes.iter().map(|outcome| outcome.ems_deg).sum::<f64>() / n;
        (ems_deg, outcomes.iter().map(|outcome| outcome.cms).sum::<f64>() / n)
    };
    let (published, tuned) = (mean(Settings::published()), mean(Settings::tuned()));
    // These seeds were not used in the search; the results are equal up to noise.
    assert!(tuned.0 <= published.0 * 1.002, "{tuned:?} {published:?}");
    assert!(tuned.1 < 0.6 * published.1, "{tuned:?} {published:?}");
}

#[test]
fn another_evaluation_of_a_tick_leaves_no_trace() {
    let scenario = Scenario::crmpc2022();
    let preview = Preview::Profile(&scenario.reference);
    let garbage = harness::garbage();
    let (mut disturbed_controller, mut calm_controller) = (dlmpc(), dlmpc());
    let new = || Sampled::new(0.0, FEEDBACK, Memory::default());
    let (mut disturbed, mut calm) = (new(), new());
    for Recorded { tick, measured, .. } in recorded().iter().take(300) {
        let wrong = &garbage[*tick as usize / 5 % garbage.len()];
        disturbed.evaluate(&mut disturbed_controller, wrong, &preview);
        disturbed.evaluate(&mut disturbed_controller, measured, &preview);
        calm.evaluate(&mut calm_controller, measured, &preview);
        let ((moment, memory), (calm_moment, calm_memory)) =
            (disturbed.in_force(), calm.in_force());
        assert_eq!(moment, calm_moment, "tick {tick}");
        assert_eq!(timeless(memory), timeless(calm_memory), "tick {tick}");
        disturbed.commit();
        calm.commit();
    }
}

#[test]
fn a_saved_memory_continues_bit_for_bit_in_a_new_controller() {
    let recorded = recorded();
    let scenario = Scenario::crmpc2022();
    let preview = Preview::Profile(&scenario.reference);
    let mut used = dlmpc();
    let mut sampled = Sampled::new(0.0, FEEDBACK, Memory::default());
    for (tick, Recorded { measured, .. }) in recorded.iter().enumerate().take(750) {
        // The saved state is taken within and at the beginning of an optimisation period, with the
        // tick evaluated or not.
        if tick % 7 == 3 {
            if tick % 2 == 0 {
                sampled.evaluate(&mut used, measured, &preview);
            }
            let saved = postcard::to_stdvec(&sampled).unwrap();
            let mut restored: Sampled<Memory> = postcard::from_bytes(&saved).unwrap();
            let mut copy = sampled.clone();
            let mut fresh = dlmpc();
            for later in &recorded[tick..tick + 7] {
                for (sampled, controller) in [(&mut restored, &mut fresh), (&mut copy, &mut used)] {
                    sampled.evaluate(controller, &later.measured, &preview);
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

#[test]
fn a_memory_starts_with_room_for_its_plan() {
    let settings = Settings::published();
    assert_eq!(dlmpc().memory().plan, Plan::new(settings.horizon));
}

#[test]
fn settings_that_cannot_work_are_refused_by_name() {
    let published = Settings::published();
    let sliding = |change: fn(&mut SlidingMode)| {
        let mut settings = published;
        change(&mut settings.sliding_mode);
        settings
    };
    let cases = [
        (Settings { horizon: 0, ..published }, "horizon"),
        (Settings { limit_rate: f64::NAN, ..published }, "limit_rate"),
        (Settings { limit_moment: 0.0, ..published }, "limit_moment"),
        (Settings { period_feedback: 0.03, ..published }, "period_feedback"),
        (Settings { q: [1.0, 0.0, 1.0], ..published }, "`q`[2]"),
        (Settings { p: [1.0, 1.0, -1.0], ..published }, "`p`[3]"),
        (sliding(|gains| gains.q = 50.0), "sliding_mode.q"),
        (sliding(|gains| gains.p = -1.0), "sliding_mode.p"),
        (sliding(|gains| gains.gamma = f64::NAN), "sliding_mode.gamma"),
        (sliding(|gains| gains.rho = 0.0), "sliding_mode.rho"),
        (sliding(|gains| gains.rho = 1.0), "sliding_mode.rho"),
    ];
    for (settings, name) in cases {
        let refused: Option<DesignError> = Dlmpc::new(settings).err();
        let text = refused.map_or_else(String::new, |error| error.to_string());
        assert!(text.contains(name), "{name}: {text:?}");
    }
}
