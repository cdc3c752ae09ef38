//! The offline design of CRMPC compared with the numbers printed in Chai 2022, section 5.1, and the
//! exact sampled bounds compared with simulation. Tolerances are half a unit of the last digit that
//! is printed.

mod gain;
mod printed;
mod sampled;

use crate::prelude::*;
use control::crmpc::held_terminal_weight;
use serde::Deserialize;

/// The constants that Chai 2022, section 5.1 prints for its own design.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Published {
    /// Terminal weight G per axis: G11, G12, G22.
    g: [f64; 3],
    /// Bound r̄₀ as printed.
    r0: f64,
    /// Bound r̄₁ as printed.
    r1: f64,
    /// Bound Ω̄ as printed.
    omega: f64,
    /// Condition number Ī·Ī′ as printed.
    condition: f64,
    /// Peak c̄ of the step response as printed.
    c: f64,
    /// Terminal radius ε₁ as printed.
    epsilon1: f64,
    /// Terminal radius ε₂ as printed.
    epsilon2: f64,
}

/// Returns the printed constants.
fn published() -> Published {
    toml::from_str(include_str!("../data/chai_2022_printed.toml")).unwrap()
}

fn settings() -> Settings {
    Settings::new(Constraints::Paper).resolved().unwrap()
}

fn gain(k: f64) -> Gain {
    Gain { k1: k, k2: k }
}

#[track_caller]
fn assert_digits(value: f64, printed: f64, decimals: i32) {
    let tolerance = 0.5 * 10f64.powi(-decimals) * (1.0 + 1e-9);
    assert!((value - printed).abs() <= tolerance, "{value} {printed} ({decimals} decimals)");
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
