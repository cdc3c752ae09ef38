//! Tests that the check succeeds for published and other settings, and that it can fail.

use control::crmpc::{Constraints, Design, Guarantee, Lemmas, Settings};
use control::error_dynamics::Gain;
use guarantee_check::lemmas::{self, Finding};
use guarantee_check::{CheckReport, assessment, dynamics};
use vehicle::dynamics::Inertia;

const GAP: f64 = 3e-3;

fn with(k1: f64, k2: f64, delay: f64) -> Settings {
    Settings { feedback: Gain { k1, k2 }, delay, ..Settings::new(Constraints::Robust) }
}

fn assert_all(findings: &[Finding]) {
    for finding in findings {
        assert!(finding.holds(), "{finding:?}");
    }
}

/// It takes more than 20 s, as every bound of the proof is compared with the largest value of what
/// it bounds, for five designs of different gains and delays.
#[test]
fn every_bound_holds_for_the_published_settings_and_with_a_delay() {
    let delayed = [with(-3.0, -4.0, 0.04), with(-2.0, -4.0, 0.04), with(-2.0, -4.0, 0.116)];
    for settings in
        [Settings::new(Constraints::Robust), with(-5.0, -5.0, 0.0)].into_iter().chain(delayed)
    {
        let report = CheckReport::new(&settings, GAP).unwrap();
        for (_, findings) in report.sections() {
            assert!(!findings.is_empty());
            assert_all(findings);
        }
        assert!(report.holds());
    }
}

#[test]
fn every_bound_holds_with_errors_of_the_measurement() {
    let error = 0.015_f64.to_radians();
    let settings = Settings { angle_error: error, rate_error: error, ..with(-2.0, -4.0, 0.04) };
    let report = CheckReport::new(&settings, GAP).unwrap();
    assert!(report.holds(), "{report:?}");
}

#[test]
fn bounds_of_the_geometry_hold_in_the_widest_domain_and_for_another_vehicle() {
    let inertia = Inertia { Ixx: 400e3, Iyy: 900e3, Izz: 600e3, Ixz: -150e3, ..Inertia::default() };
    let settings = Settings {
        sideslip_domain: 0.799,
        body: inertia.body(1.0).unwrap(),
        guarantee: Guarantee::BestEffort,
        ..Settings::new(Constraints::Robust).resolved().unwrap()
    };
    let bounds = Lemmas::new(&settings);
    let (findings, suprema) = lemmas::check(&settings, &bounds, GAP);
    assert_all(&findings);
    assert_all(&dynamics::check(&settings, &bounds, &suprema, 0.05));
}

#[test]
fn bounds_that_are_too_small_are_found_false() {
    let settings = Settings::new(Constraints::Robust).resolved().unwrap();
    let mut bounds = Lemmas::new(&settings);
    // The first two bounds are attained; the others have margins of 2.4 % and 1.3 %.
    bounds.dynamics.geometry.drift_by_rates *= 0.99;
    bounds.gyroscopic.1 *= 0.99;
    bounds.dynamics.geometry.drift *= 0.97;
    bounds.induced_norm *= 0.98;
    // At rest the moment alone accelerates the vehicle by more than 90 % of the bound.
    bounds.dynamics.acceleration *= 0.9;
    let (mut findings, suprema) = lemmas::check(&settings, &bounds, GAP);
    findings.extend(dynamics::check(&settings, &bounds, &suprema, 0.05));
    let wrong: Vec<&str> = findings
        .iter()
        .filter(|finding| finding.fails())
        .map(|finding| finding.statement.as_str())
        .collect();
    let expected = [
        "‖Ẇ x‖ ≤ b ‖x‖²",
        "‖∂(Ẇ x)/∂x‖ ≤ b ‖x‖ (Frobenius)",
        "‖∂(I⁻¹ (ω × I ω))/∂ω‖ ≤ b ‖ω‖ (Frobenius)",
        "‖I W s‖ ≤ b over the corners s of the unit box",
        "‖F‖ ≤ b",
    ];
    assert_eq!(wrong, expected);
}

#[test]
fn a_terminal_rate_that_is_too_large_is_found_false() {
    let settings = Settings::new(Constraints::Robust).resolved().unwrap();
    let design = Design::new(&settings).unwrap();
    let rate = design.assessment.terminal_rate;
    let at = |rate: f64| {
        assessment::check(&settings, &Lemmas::new(&settings), &design.tightening, rate).unwrap()
    };
    let false_ones = |rate: f64| at(rate).iter().filter(|finding| finding.fails()).count();
    assert_eq!(false_ones(rate), 0);
    assert_eq!(false_ones(1.01 * rate), 1);
}

#[test]
fn published_terminal_weight_does_not_decrease_with_the_sampled_law() {
    let report = CheckReport::new(&Settings::new(Constraints::Robust), 0.1).unwrap();
    assert_all(&report.terminal);
    for printed in report.printed_terminal {
        assert!(printed.low > 50.0 && printed.high < 50.1, "{printed:?}");
    }
}
