//! The gain K of the robust set by rule, and how far the guarantee reaches with it.

use super::gain;
use crate::prelude::*;

const DOCUMENT: &str = include_str!("../../../docs/guarantee.md");

fn robust() -> Settings {
    Settings::new(Constraints::Robust)
}

fn with_bound(bound_deg: f64) -> Settings {
    Settings { disturbance_bound: bound_deg.to_radians(), ..robust() }
}

#[test]
fn a_larger_bound_takes_a_later_gain_only_where_the_earlier_ones_leave_too_little() {
    let mut gains = Vec::new();
    for step in 0..14 {
        let settings = with_bound(2.0 + 0.05 * f64::from(step));
        let design = Design::new(&settings).unwrap();
        if gains.last() != Some(&design.feedback) {
            if let Some(&feedback) = gains.last() {
                let earlier = Design::new(&Settings { feedback, ..settings });
                assert!(earlier.map_or(0.0, |earlier| earlier.assessment.moment_left) < 0.06);
            }
            gains.push(design.feedback);
        }
    }
    assert_eq!(gains[0], Gain { k1: -1.5, k2: -4.0 }, "the gain that was tuned");
    assert!(gains.len() >= 4 && gains.windows(2).all(|pair| pair[1].k2 <= pair[0].k2), "{gains:?}");
}

#[test]
fn a_gain_that_is_set_stays_and_half_a_gain_is_refused_by_both_names() {
    let set = Settings { feedback: gain(-5.0), ..robust() };
    assert_eq!(set.resolved().unwrap(), set);
    for feedback in [Gain { k1: -1.0, k2: 0.0 }, Gain { k1: 0.0, k2: -4.0 }] {
        for constraints in [Constraints::Robust, Constraints::Paper] {
            let settings = Settings { feedback, ..Settings::new(constraints) };
            let text = Design::new(&settings).unwrap_err().to_string();
            assert!(text.contains("feedback.k1 =") && text.contains("feedback.k2 ="), "{text}");
        }
    }
}

#[test]
fn published_the_papers_sets_take_the_printed_gain() {
    let settings = Settings { constraints: Constraints::Paper, ..robust() };
    assert_eq!(settings.resolved().unwrap().feedback, gain(-5.0));
    assert_eq!(Design::new(&settings).unwrap().feedback, gain(-5.0));
}

#[test]
fn a_refusal_names_the_gain_that_comes_closest_and_a_bound_that_the_rule_accepts() {
    let settings = with_bound(3.0);
    let error = Design::new(&settings).unwrap_err();
    let DesignError::NoGuarantee(refusal) = &error else { panic!("{error}") };
    let (feedback, largest) = (refusal.feedback, refusal.disturbance.unwrap());
    let text = format!("feedback.k1 = {} and feedback.k2 = {}", feedback.k1, feedback.k2);
    assert!(error.to_string().contains(&text), "{error}");
    let with = |disturbance_bound| Settings { disturbance_bound, ..settings };
    assert_eq!(Design::new(&with(largest)).unwrap().feedback, feedback);
    let earlier = Gain { k1: -1.5, k2: -4.0 };
    Design::new(&Settings { feedback: earlier, ..with(largest) }).unwrap_err();
    // No bound that is larger by much is accepted, and the share for best effort says the same.
    assert!(
        refusal.moment_left < 0.0 && error.to_string().contains("disturbance.bound"),
        "{error}"
    );
    Design::new(&with(1.01 * largest)).unwrap_err();
    let best_effort = Settings { guarantee: Guarantee::BestEffort, ..settings };
    let share = Design::new(&best_effort).unwrap().accepted_share;
    assert!((share * settings.disturbance_bound / largest - 1.0).abs() < 1e-6, "{share}");
}

/// Returns the rows of the document's table with this heading, cell by cell.
fn table(heading: &str) -> Vec<Vec<&'static str>> {
    let (_, below) = DOCUMENT.split_once(heading).expect("the heading of a table");
    let rows = below.lines().skip(1).take_while(|line| line.starts_with('|'));
    rows.map(|row| row.trim_matches('|').split('|').map(str::trim).collect()).collect()
}

/// Returns the numbers of a cell such as `2.079°/s² [−1.5, −4]`.
fn numbers(cell: &str) -> Vec<f64> {
    let cell = cell.replace('−', "-").replace("°/s²", "").replace("°/s", "").replace('°', "");
    cell.split(['[', ']', ',', ' ']).filter_map(|word| word.parse().ok()).collect()
}

/// Checks a printed bound, and the gain with which the rule accepts it.
fn assert_printed(cell: &str, settings: &Settings) {
    let numbers = numbers(cell);
    let [bound, k1, k2] = numbers[..] else { return assert_eq!(cell, "–") };
    let settings = Settings { guarantee: Guarantee::BestEffort, ..*settings };
    let at = |bound: f64| {
        let disturbance_bound = bound.to_radians();
        Design::new(&Settings { disturbance_bound, ..settings }).unwrap()
    };
    let accepted = at(bound);
    assert!(accepted.accepted_share >= 1.0, "{cell}: {settings:?}");
    assert_eq!(accepted.feedback, Gain { k1, k2 }, "{cell}: {settings:?}");
    assert!(at(1.01 * bound).accepted_share < 1.0, "{cell}: {settings:?}");
}

#[test]
fn regress_the_printed_bounds_by_delay_and_errors_are_those_of_the_design() {
    let rows = table("| delay | no errors | 0.05 | 0.1 | 0.25 |\n");
    assert_eq!(rows.len(), 5);
    for row in rows {
        let delay = numbers(row[0])[0];
        for (cell, error_deg) in row[1..].iter().zip([0.0_f64, 0.05, 0.1, 0.25]) {
            let error = error_deg.to_radians();
            let settings = Settings { delay, angle_error: error, rate_error: error, ..robust() };
            assert_printed(cell, &settings);
        }
    }
}

#[test]
fn regress_the_printed_bounds_with_other_errors_and_gains_are_those_of_the_design() {
    let rows = table("| delay | 0 s | 0.04 s | 0.08 s | 0.117 s | 0.2 s |\n");
    assert_eq!(rows.len(), 7);
    for row in rows {
        let value = numbers(row[0]);
        let settings = match row[0].chars().next() {
            Some('K') => Settings { feedback: Gain { k1: value[0], k2: value[1] }, ..robust() },
            Some('s') => Settings {
                angle_error: f64::to_radians(0.005),
                rate_error: f64::to_radians(0.005),
                slow_angle_error: value[0].to_radians(),
                slow_angle_rate: value[1].to_radians(),
                ..robust()
            },
            _ => Settings { inertia_error: 0.0, tensor_error: value[0], ..robust() },
        };
        for (cell, delay) in row[1..].iter().zip([0.0, 0.04, 0.08, 0.117, 0.2]) {
            assert_printed(cell, &Settings { delay, ..settings });
        }
    }
}
