//! The offline design of CRMPC compared with the numbers printed in Chai 2022, section 5.1, and the
//! exact sampled bounds compared with simulation. Tolerances are half a unit of the last digit that
//! is printed.

mod gain;
mod printed;
mod sampled;

use control::DesignError;
use control::crmpc::{
    Constraints, Design, Guarantee, Settings, held_terminal_weight, terminal_weight,
};
use control::error_dynamics::{Gain, SampledError};
use nalgebra::{Matrix2, Vector2};

fn settings() -> Settings {
    Settings::new(Constraints::Paper).resolved().unwrap()
}

fn gain(k: f64) -> Gain {
    Gain { k1: k, k2: k }
}

#[track_caller]
fn assert_digits(value: f64, printed: f64, decimals: i32) {
    let tolerance = 0.5 * 10f64.powi(-decimals) * (1.0 + 1e-9);
    assert!(
        (value - printed).abs() <= tolerance,
        "{value} is not {printed} to {decimals} decimals"
    );
}

#[test]
fn oracle_terminal_weight_satisfies_15_with_equality_for_unequal_gains() {
    // With the published K̃ both gains are the same, so that they could be exchanged.
    for (k1, k2) in [(-5.0, -2.0), (-1.5, -4.0), (-0.3, -1.1)] {
        let (gain, p, q) = (Gain { k1, k2 }, Vector2::new(50.0, 30.0), 10.0);
        let g = terminal_weight(gain, p, q);
        let a = Matrix2::new(0.0, 1.0, k1, k2);
        let load = Matrix2::from_diagonal(&p) + gain.row().transpose() * gain.row() * q;
        let residual = a.transpose() * g + g * a + load;
        assert!(residual.norm() < 1e-12 * load.norm(), "K {k1}, {k2}: {residual}");
    }
}

#[test]
fn oracle_errors_of_the_rate_ask_for_moment_at_once() {
    // In the first interval K ô contains k₂ e of the newest error, and (k₂ + τ k₁) e of the first
    // one, a tick after the plan began.
    let rate_error = 1e-3;
    let exact = settings();
    let noisy =
        Settings { rate_error, guarantee: Guarantee::BestEffort, disturbance_bound: 0.0, ..exact };
    let exact = Settings { disturbance_bound: 0.0, ..exact };
    let [exact, noisy] = [exact, noisy].map(|settings| Design::new(&settings).unwrap());
    assert_eq!(noisy.accepted_share, 1.0);
    let more = noisy.tightening.at(1).feedback - exact.tightening.at(1).feedback;
    let expected = rate_error * (5.0 + 5.2);
    assert!((more - expected).abs() < 1e-9 * expected, "{more} {expected}");
}

#[test]
fn oracle_sampled_terminal_weight_decreases_where_the_continuous_one_does_not() {
    // (11c) with the cost and the law held for h: ΦᵀGΦ − G + h (P + K̃ᵀQK̃). The printed G leaves
    // eigenvalues of +1.6 and +50.
    let settings = Settings::new(Constraints::Robust);
    let Settings { terminal, period_optimisation: h, p, q, .. } = settings;
    let held = SampledError::new(terminal, h);
    let p = Vector2::new(p[0], p[3]);
    let load =
        (Matrix2::from_diagonal(&p) + terminal.row().transpose() * terminal.row() * q[0]) * h;
    let rest = |g: &Matrix2<f64>| held.transition().transpose() * g * held.transition() - g + load;
    let printed = rest(&terminal_weight(terminal, p, q[0])).symmetric_eigenvalues();
    assert!((printed.min() - 1.6).abs() < 0.05 && (printed.max() - 50.0).abs() < 0.5, "{printed}");
    let g = held_terminal_weight(&held, terminal, p, q[0]);
    assert!(rest(&g).amax() < 1e-10, "{}", rest(&g));
    let expected = Matrix2::new(116.7, 55.0, 55.0, 61.2);
    assert!((g - expected).amax() < 0.05, "{g}");
    assert_eq!(Design::new(&settings).unwrap().g, [g; 3]);
}

#[test]
fn a_terminal_gain_that_is_not_stable_when_held_is_refused_by_name() {
    let settings = Settings { terminal: gain(-30.0), ..settings() };
    let text = Design::new(&settings).unwrap_err().to_string();
    assert!(text.contains("terminal gain") && text.contains("held for 0.2 s"), "{text}");
}

#[test]
fn a_disturbance_that_cannot_be_borne_is_refused_with_the_largest_that_can() {
    let settings =
        Settings { disturbance_bound: 3f64.to_radians(), ..Settings::new(Constraints::Robust) };
    let error = Design::new(&settings).unwrap_err();
    let DesignError::NoGuarantee(refusal) = &error else { panic!("{error}") };
    let (moment_left, largest) = (refusal.moment_left, refusal.disturbance.unwrap());
    assert!(moment_left < 0.0 && error.to_string().contains("disturbance.bound"), "{error}");
    Design::new(&Settings { disturbance_bound: largest, ..settings }).unwrap();
    Design::new(&Settings { disturbance_bound: 1.01 * largest, ..settings }).unwrap_err();
    let accepted_share = Design::new(&Settings { guarantee: Guarantee::BestEffort, ..settings })
        .unwrap()
        .accepted_share;
    assert!(
        (accepted_share * settings.disturbance_bound / largest - 1.0).abs() < 1e-6,
        "{accepted_share}"
    );
}

#[test]
fn errors_of_measurement_out_of_range_are_refused_by_name() {
    let base = settings();
    for (name, settings) in [
        ("estimation.angleError", Settings { angle_error: -1e-3, ..base }),
        ("estimation.rateError", Settings { rate_error: f64::NAN, ..base }),
    ] {
        let text = Design::new(&settings).unwrap_err().to_string();
        assert!(text.contains(name), "{text}");
    }
}
