//! The two-loop sliding-mode controller on the scenario of Jia et al.

use crate::prelude::*;
use control::sliding::FiniteTimeLayer;
use control::two_loop::{Form, Loop, OuterKinematics, TwoLoopMemory};

/// Figures of merit of one run.
#[derive(Debug, Default)]
struct Outcome {
    /// Largest error of any angle after 12 s, deg.
    rest: f64,
    /// Time from which all errors stay within 0.5 deg, s.
    settling: f64,
    /// Largest ‖M‖ of the run, N m.
    moment: f64,
    /// Largest |M| of each axis, N m.
    moments: Vector3<f64>,
    /// Largest component of the outer and of the inner integral.
    integrals: (f64, f64),
    /// Largest |s_n|/ε of any axis.
    inner_sliding: f64,
    /// Time at which an angle error exceeds 30 deg, s.
    lost: Option<f64>,
}

fn run(
    settings: &TwoLoopSettings,
    limit: f64,
    fed: bool,
    mut actuate: impl FnMut(Vector3<f64>) -> Vector3<f64>,
) -> Outcome {
    let scenario = Scenario::two_loop();
    let TwoLoopSettings { body, period, .. } = *settings;
    let law = TwoLoopSmc::new(*settings).unwrap();
    let mut controller = Delayed::new(law, body, period, Latency::default(), limit).unwrap();
    let mut memory = controller.memory();
    let mut plant = Plant::new(&scenario.config(period), 0.0).unwrap();
    let reference = |time: f64| scenario.reference.at(time);
    let mut outcome = Outcome::default();
    let mut achieved_moment = None;
    for tick in 0..(scenario.duration / period).round() as u64 {
        let time = tick as f64 * period;
        let measured = Measurement {
            angles: plant.angles(),
            rates: plant.rates(),
            achieved_moment,
            ..Measurement::default()
        };
        let error = (measured.angles - reference(time).angles).amax().to_degrees();
        if error > 0.5 {
            outcome.settling = time + period;
        }
        if outcome.lost.is_none() && error > 30.0 {
            outcome.lost = Some(time);
        }
        if time > 12.0 {
            outcome.rest = outcome.rest.max(error);
        }
        let command = controller.update(&mut memory, tick, time, &measured, &reference);
        let moment = actuate(command);
        achieved_moment = fed.then_some(moment);
        outcome.moment = outcome.moment.max(moment.norm());
        outcome.moments = outcome.moments.sup(&moment.abs());
        let (outer, inner) = &mut outcome.integrals;
        *outer = outer.max(memory.inner.outer_integral.amax());
        *inner = inner.max(memory.inner.inner_integral.amax());
        let epsilon = Vector3::from(settings.inner.layer.epsilon);
        let inner_sliding = memory.inner.inner_sliding.component_div(&epsilon).amax();
        outcome.inner_sliding = outcome.inner_sliding.max(inner_sliding);
        if plant.advance(time, (tick + 1) as f64 * period, moment).is_err() {
            // The attitude is singular.
            outcome.rest = f64::INFINITY;
            break;
        }
    }
    outcome
}

fn direct(settings: &TwoLoopSettings) -> Outcome {
    run(settings, f64::INFINITY, false, |moment| moment)
}

#[test]
fn regress_steps_settle_with_a_moment_within_the_actuators_reach_about_each_axis() {
    let outcome = direct(&TwoLoopSettings::ours());
    // The reach is that of surfaces and jets about one axis with the others balanced
    // (scripts/oracles/reach.py). The disturbance alone takes 1e5 N m of it.
    let reach = Vector3::new(179.57e3, 302.24e3, 104.54e3);
    assert!((reach - outcome.moments).min() > 0.0, "{outcome:?}");
    assert!(
        (outcome.settling - 4.39).abs() < 0.05 && (outcome.rest - 0.087).abs() < 0.005,
        "{outcome:?}"
    );
    assert!(outcome.integrals.0 < 2e-3 && outcome.integrals.1 < 3e-3, "{outcome:?}");
}

#[test]
fn regress_steps_without_filter_ask_for_millions_of_newton_metres() {
    let ours = TwoLoopSettings::ours();
    let layer =
        |rho, epsilon| FiniteTimeLayer { rho: [rho; 3], epsilon: [epsilon; 3], b: [0.5; 3] };
    let outer = Loop { k: [1.0; 3], layer: layer(0.06, 0.01) };
    let inner = Loop { k: [4.0; 3], layer: layer(0.5, 0.01) };
    let outcome = direct(&TwoLoopSettings { filter: 0.0, outer, inner, ..ours });
    assert!(outcome.settling < 3.0 && outcome.rest < 0.1, "{outcome:?}");
    assert!((outcome.moment - 3.93e6).abs() < 0.05e6, "{outcome:?}");
}

#[test]
fn regress_integrals_that_rest_in_saturation_do_not_wind_up() {
    let settings =
        |anti_windup| TwoLoopSettings { filter: 0.0, anti_windup, ..TwoLoopSettings::ours() };
    let limited = |anti_windup| run(&settings(anti_windup), 1.9e5, false, |moment| moment);
    let (with, without) = (limited(true), limited(false));
    assert!((with.settling - 9.22).abs() < 0.05 && with.rest < 0.1, "{with:?}");
    assert!(with.integrals.0 < 0.02 && with.integrals.1 < 0.003, "{with:?}");
    assert!(without.rest > 90.0, "the attitude is lost: {without:?}");
    // The same limit acts in actuators whose moment is measured.
    let measured = run(&settings(true), f64::INFINITY, true, |moment| {
        moment / (moment.norm() / 1.9e5).max(1.0)
    });
    assert!(
        (measured.settling - with.settling).abs() < 0.011 && measured.rest < 0.3,
        "{measured:?}"
    );
}

/// Returns the matrix P of φ = P Θ.
fn papers_order() -> Matrix3<f64> {
    Matrix3::new(0.0, 0.0, -1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0)
}

#[test]
fn oracle_papers_matrix_in_consistent_order_and_axes() {
    // The rows are [bank, sideslip, angle of attack] by [p, q, r] at β = 0. Printed is [[0, 0, 1],
    // [sin α, cos α, 0], [cos α, −sin α, 0]].
    let alpha = 0.3_f64;
    let ours = papers_order() * kinematics::r(&Vector3::new(alpha, 0.0, 1.0));
    let (sa, ca) = alpha.sin_cos();
    assert!((ours - Matrix3::new(ca, 0.0, sa, sa, 0.0, -ca, 0.0, 1.0, 0.0)).amax() < 1e-15);
}

#[test]
fn oracle_rate_command_is_the_same_in_the_papers_order() {
    // Law (7) with φ = P Θ at the first tick, without filter; gains differ per axis.
    let mut settings = TwoLoopSettings { filter: 0.0, ..TwoLoopSettings::ours() };
    settings.outer.k = [0.5, 0.6, 0.7];
    settings.outer.layer.rho = [0.02, 0.03, 0.04];
    let angles = Vector3::new(0.3, 0.05, -0.4);
    let measured =
        Measurement { angles, rates: Vector3::new(0.01, -0.02, 0.03), ..Measurement::default() };
    let reference = Reference {
        angles: Vector3::new(0.31, 0.0, -0.3),
        rates: Vector3::new(0.01, 0.02, -0.03),
        ..Reference::default()
    };
    let mut memory = TwoLoopMemory::default();
    TwoLoopSmc::new(settings).unwrap().update(&mut memory, 0, 0.0, &measured, &|_| reference);

    let p = papers_order();
    let e = p * (reference.angles - angles);
    let (k, rho) = (Vector3::new(0.7, 0.6, 0.5), [0.04, 0.03, 0.02]);
    let smooth = Vector3::from_fn(|i, _| {
        let x = e[i] / settings.outer.layer.epsilon[0];
        rho[i] * 2f64.powf(-0.75) * x.abs().sqrt() * x.clamp(-1.0, 1.0)
    });
    let r = p * kinematics::r(&angles);
    let expected = r.try_inverse().unwrap() * (p * reference.rates + k.component_mul(&e) + smooth);
    assert!((memory.rate_command - expected).norm() < 1e-14);
}

/// Returns s_w and s_n, and their rates under the commanded moment without disturbance.
fn sliding_and_its_rate(settings: &TwoLoopSettings) -> [(Vector3<f64>, Vector3<f64>); 2] {
    let reference = Reference { angles: Vector3::new(0.02, 0.013, -0.007), ..Reference::default() };
    let measured = Measurement { rates: Vector3::new(0.01, -0.02, 0.03), ..Measurement::default() };
    let mut memory = TwoLoopMemory::default();
    let moment =
        TwoLoopSmc::new(*settings).unwrap().update(&mut memory, 0, 0.0, &measured, &|_| reference);
    let before = memory;
    let step = 1e-4;
    // The step is short enough for a finite difference: the plant moves under that moment, then the
    // errors of both loops follow from its state.
    let state = plant::state(&measured.angles, &measured.rates);
    let load = Load { moment, ..Load::default() };
    let state =
        state + plant::derivative(&settings.body, Kinematics::Printed, &state, &load) * step;
    let later =
        Measurement { angles: plant::angles(&state), rates: plant::rates(&state), ..measured };
    let mut short = TwoLoopSmc::new(TwoLoopSettings { period: step, ..*settings }).unwrap();
    short.update(&mut memory, 1, step, &later, &|_| reference);
    [
        (before.outer_sliding, (memory.outer_sliding - before.outer_sliding) / step),
        (before.inner_sliding, (memory.inner_sliding - before.inner_sliding) / step),
    ]
}

#[test]
fn oracle_reaching_law_of_the_inner_loop() {
    // With M as commanded and no disturbance, ds_n/dt = −ρ f SAT(s_n/ε): the sign of the last term
    // of (10) is +.
    let settings = TwoLoopSettings { filter: 0.0, ..TwoLoopSettings::ours() };
    let [_, (s, rate)] = sliding_and_its_rate(&settings);
    let expected = -settings.inner.layer.value(&s);
    assert!((rate - expected).norm() < 1e-4 * expected.norm());
}

#[test]
fn oracle_with_the_sign_of_10_the_inner_sliding_variable_grows() {
    // The printed sign gives ds_n/dt = +ρ f SAT(s_n/ε).
    let settings =
        TwoLoopSettings { filter: 0.0, form: Form::PrintedSign, ..TwoLoopSettings::ours() };
    let [_, (s, rate)] = sliding_and_its_rate(&settings);
    let expected = settings.inner.layer.value(&s);
    assert!((rate - expected).norm() < 1e-4 * expected.norm());
    assert!(s.component_mul(&rate).min() > 0.0, "|s_n| grows about every axis");
}

#[test]
fn oracle_with_the_minus_sign_of_f_the_outer_sliding_variable_grows() {
    // If ω follows ω_c, ds_w/dt = R (ω_c − ω) + ρ |f| SAT(s_w/ε). In (11) two minus signs make
    // ds_n/dt = −ρ |f| SAT(s_n/ε).
    let settings =
        TwoLoopSettings { filter: 0.0, form: Form::PrintedFactor, ..TwoLoopSettings::ours() };
    let [(s_w, rate_w), (s_n, rate_n)] = sliding_and_its_rate(&settings);
    // There is no integral yet, so s_n = ω_c − ω.
    let expected = kinematics::r(&Vector3::zeros()) * s_n + settings.outer.layer.value(&s_w);
    assert!((rate_w - expected).norm() < 1e-4 * expected.norm());
    let expected = -settings.inner.layer.value(&s_n);
    assert!((rate_n - expected).norm() < 1e-4 * expected.norm());
}

#[test]
fn published_matrix_in_our_order() {
    // Printed is (3), φ̇ = R ω, with φ = P Θ.
    let alpha = 0.3_f64;
    let (sa, ca) = alpha.sin_cos();
    let printed = Matrix3::new(0.0, 0.0, 1.0, sa, ca, 0.0, ca, -sa, 0.0);
    let ours = OuterKinematics::Printed.r(&Vector3::new(alpha, 0.2, 1.0));
    assert!((papers_order() * ours - printed).amax() < 1e-15);
}

#[test]
fn regress_printed_forms_lose_the_attitude() {
    let ours = TwoLoopSettings::ours();
    let lost = |settings: &TwoLoopSettings| direct(settings).lost;
    assert_eq!(lost(&ours), None);
    let sign = lost(&TwoLoopSettings { form: Form::PrintedSign, ..ours }).unwrap();
    let factor = lost(&TwoLoopSettings { form: Form::PrintedFactor, ..ours }).unwrap();
    let matrix = lost(&TwoLoopSettings { kinematics: OuterKinematics::Printed, ..ours }).unwrap();
    assert!((sign - 1.40).abs() < 0.05 && (matrix - 1.96).abs() < 0.05, "{sign} {matrix}");
    assert!((factor - 10.0).abs() < 0.2, "{factor}");
}

#[test]
fn published_disturbance_needs_this_much_reaching() {
    let needed = TwoLoopSettings::ours().disturbance_acceleration();
    assert!((needed - Vector3::new(0.183, 0.088, 0.076)).amax() < 6e-4, "{needed}");
}

/// Returns our settings with ρ_n at `share` of the least gain that is accepted.
fn reaching_at(share: f64) -> TwoLoopSettings {
    let mut settings = TwoLoopSettings::ours();
    settings.inner.layer.rho = (settings.needed_reaching() * share).into();
    settings
}

#[test]
fn oracle_least_reaching_gain_balances_the_disturbance_at_the_edge_of_the_layer() {
    let settings = reaching_at(1.0);
    let layer = settings.inner.layer;
    let edge = layer.value(&Vector3::from(layer.epsilon));
    assert!((edge - settings.disturbance_acceleration()).amax() < 1e-15, "{edge}");
    assert!(TwoLoopSmc::new(reaching_at(1.0 - 1e-12)).is_err());
    assert!(TwoLoopSmc::new(reaching_at(1.0 + 1e-12)).is_ok());
}

#[test]
fn the_inner_sliding_variable_stays_in_its_layer_from_the_least_accepted_gain_on() {
    let above = direct(&reaching_at(1.001));
    assert!(above.inner_sliding <= 1.0, "{above:?}");
    assert!(above.inner_sliding > 0.99, "the gain is the least that suffices: {above:?}");
    // A gain of 0.25 rad/s² exceeds the acceleration of the disturbance, 0.183 rad/s², but not its
    // 1.68-fold. It is accepted if only 81 % of the disturbance is declared.
    let mut weak = TwoLoopSettings::ours();
    weak.inner.layer.rho = [0.25; 3];
    assert!(TwoLoopSmc::new(weak).is_err());
    weak.disturbance = weak.disturbance.map(|moment| 0.81 * moment);
    let below = direct(&weak);
    assert!((below.inner_sliding - 1.43).abs() < 0.01, "{below:?}");
}

#[test]
fn the_filter_follows_a_smooth_reference_without_lag() {
    let settings = TwoLoopSettings::ours();
    let mut controller = TwoLoopSmc::new(settings).unwrap();
    let mut memory = TwoLoopMemory::default();
    let profile = Profile::sine(Vector3::zeros(), Vector3::repeat(0.1), 0.5, 0.0);
    let reference = |time: f64| profile.at(time);
    for tick in 0..1000_u32 {
        let time = f64::from(tick) * 0.01;
        let now = reference(time);
        // The vehicle is exactly on the reference.
        let rates = kinematics::r_inverse(&now.angles) * now.rates;
        let measured = Measurement { angles: now.angles, rates, ..Measurement::default() };
        controller.update(&mut memory, tick.into(), time, &measured, &reference);
        assert!(memory.angle_error.amax() < 1e-6, "{time}: {}", memory.angle_error);
    }
}
