//! The numbers printed in Chai 2022, section 5.1.

use super::{assert_digits, gain, published, settings};
use crate::prelude::*;
use control::crmpc::{PaperConstants, step_response_peak};

fn constants(settings: &Settings) -> PaperConstants {
    Design::new(settings).unwrap().paper.unwrap()
}

#[test]
fn published_terminal_weight_satisfies_15_with_equality() {
    let settings = settings();
    let [g11, g12, g22] = published().g;
    assert_eq!([g11, g12, g22], [80.0, 30.0, 36.0]);
    let g = Matrix2::new(g11, g12, g12, g22);
    let Gain { k1, k2 } = settings.terminal;
    let a = Matrix2::new(0.0, 1.0, k1, k2);
    for i in 0..3 {
        // Every number in the equation is an integer, so the residual is exactly zero.
        let row = settings.terminal.row();
        let p = Vector2::new(settings.p[i], settings.p[3 + i]);
        let residual = a.transpose() * g
            + g * a
            + row.transpose() * row * settings.q[i]
            + Matrix2::from_diagonal(&p);
        assert_eq!(residual, Matrix2::zeros());
        assert_eq!(terminal_weight(settings.terminal, p, settings.q[i]), g);
    }
    let paper = Settings { constraints: Constraints::Paper, ..settings };
    assert_eq!(Design::new(&paper).unwrap().g, [g; 3]);
}

#[test]
fn oracle_terminal_law_never_leaves_a_ball_in_the_norm_of_g_but_a_euclidean_one() {
    // (12) and (14): d/dt ‖E‖²_G = Eᵀ (AᵀG + GA) E is never positive; d/dt ‖E‖² = Eᵀ (Aᵀ + A) E can
    // be.
    let settings = Settings { constraints: Constraints::Paper, ..settings() };
    let a = Matrix2::new(0.0, 1.0, settings.terminal.k1, settings.terminal.k2);
    for g in Design::new(&settings).unwrap().g {
        assert!((a.transpose() * g + g * a).symmetric_eigenvalues().max() < 0.0);
    }
    assert!((a.transpose() + a).symmetric_eigenvalues().max() > 0.0);
}

#[test]
fn published_bounds_of_lemma_1() {
    let (ours, printed) = (constants(&settings()), published());
    assert_eq!(
        [printed.r0, printed.r1, printed.omega, printed.condition],
        [1.0846, 0.0873, 0.1511, 2.6094]
    );
    assert_digits(ours.r0, printed.r0, 4);
    assert_digits(ours.r1, printed.r1, 4);
    assert_digits(ours.omega, printed.omega, 4);
    assert_digits(ours.condition, printed.condition, 4);
}

#[test]
fn published_r0_is_not_the_norm_of_the_matrix() {
    // Lemma 1 proves sec β = √(1 + tan² β); the printed number lacks the square, on the safe side.
    let ours = constants(&settings()).r0;
    assert_digits(1.0 / settings().sideslip_bound.cos(), 1.0154, 4);
    assert!(ours > 1.0154);
}

#[test]
fn published_tube_and_terminal_radii() {
    let (ours, printed) = (constants(&settings()), published());
    assert_eq!([printed.c, printed.epsilon1, printed.epsilon2], [0.0835, 0.2096, 0.0770]);
    assert_digits(ours.c, printed.c, 4);
    assert_digits(ours.epsilon1, printed.epsilon1, 4);
    assert_digits(ours.epsilon2, printed.epsilon2, 4);
}

#[test]
fn published_peak_of_the_step_response_belongs_to_another_gain() {
    let printed = published().c;
    assert_digits(step_response_peak(gain(-10.0)).unwrap(), printed, 4);
    // The gain that the text names gives another number.
    assert_digits(step_response_peak(gain(-5.0)).unwrap(), 0.1525, 4);
}

#[test]
fn oracle_sets_between_the_printed_constants() {
    // The values are calculated by hand from (6) and (21) with the readings of docs/errata.md; the
    // paper prints only their consequences.
    let ours = constants(&settings());
    assert_digits(ours.x, 0.09465, 5);
    assert_digits(ours.u, 0.25005, 5);
    assert_digits(ours.x_tube, 0.0896, 4);
    assert_digits(ours.u_tube, 0.1717, 4);
}

#[test]
fn oracle_second_terminal_radius_with_the_triangle_inequality() {
    // (13) has − r̄₁ x̄_tube where the triangle inequality gives + r̄₁ x̄_tube.
    let settings = settings();
    let ours = constants(&settings);
    let printed = published();
    let [g11, g12, g22] = printed.g;
    let eigenvalues = Matrix2::new(g11, g12, g12, g22).symmetric_eigenvalues();
    let terminal_gain = settings.terminal.k1.hypot(settings.terminal.k2);
    let radius = |sign: f64| {
        let factor = ours.r0 * ours.condition * ours.omega + sign * ours.r1;
        eigenvalues.min().sqrt()
            * (ours.u_tube - factor * ours.x_tube - settings.reference_acceleration)
            / terminal_gain
    };
    assert_digits(radius(-1.0), printed.epsilon2, 4);
    assert_digits(radius(1.0), 0.0669, 4);
    assert!((radius(-1.0) - ours.epsilon2).abs() < 1e-12);
}

#[test]
fn published_tubes_of_the_angles() {
    // The two cases of Fig. 6 are 0.2° and 0.1°. They need Δ̄ = 1°/s², half of the value in section
    // 5.1.
    for (k, printed_deg) in [(-5.0, 0.2), (-10.0, 0.1)] {
        let with = |bound_deg: f64| {
            let settings = Settings {
                feedback: gain(k),
                disturbance_bound: bound_deg.to_radians(),
                ..settings()
            };
            constants(&settings).angle_tube.to_degrees()
        };
        assert!((with(1.0) - printed_deg).abs() < 1e-12);
        assert!((with(2.0) - 2.0 * printed_deg).abs() < 1e-12);
    }
}
