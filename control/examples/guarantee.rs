//! Disturbance bounds that the robust set can guarantee for the published vehicle and limits, by
//! gains, delay, its uncertainty, and measurement errors:
//!
//! ```text
//! cargo run --release -p reentry-control --example guarantee
//! ```
//!
//! The example prints the largest disturbance bound that is accepted, and the share of the moment
//! that is left at the published one.

use control::crmpc::{Constraints, Design, Guarantee, Settings};
use control::error_dynamics::Gain;

fn main() {
    println!(
        "    K        delay, s         errors, deg and deg/s   largest bound, deg/s2   left of the moment at 2 deg/s2"
    );
    for (k1, k2) in [
        (-5.0, -5.0),
        (-4.0, -4.5),
        (-3.0, -4.0),
        (-2.0, -4.0),
        (-1.5, -4.0),
        (-2.0, -3.0),
        (-1.0, -2.0),
    ] {
        for delay in [0.0, 0.04, 0.117] {
            for error_deg in [0.0, 0.05, 0.1, 0.2] {
                let error = f64::to_radians(error_deg);
                let settings = Settings {
                    feedback: Gain { k1, k2 },
                    delay,
                    rate_error: error,
                    angle_error: error,
                    guarantee: Guarantee::BestEffort,
                    ..Settings::new(Constraints::Robust)
                };
                print(&settings, error_deg);
            }
            for delay_error in [0.005, 0.01, 0.02] {
                let settings = Settings {
                    feedback: Gain { k1, k2 },
                    delay,
                    delay_error,
                    guarantee: Guarantee::BestEffort,
                    ..Settings::new(Constraints::Robust)
                };
                if delay > 0.0 {
                    print(&settings, 0.0);
                }
            }
        }
    }
}

fn print(settings: &Settings, error_deg: f64) {
    let design = |disturbance_bound: f64| Design::new(&Settings { disturbance_bound, ..*settings });
    let left =
        design(settings.disturbance_bound).map_or(f64::NAN, |design| design.assessment.moment_left);
    let holds = |bound: f64| design(bound).is_ok_and(|design| design.accepted_share >= 1.0);
    let (mut low, mut high) = (0.0, 0.1);
    for _ in 0..30 {
        let middle = 0.5 * (low + high);
        if holds(middle) { low = middle } else { high = middle }
    }
    let Settings { feedback: Gain { k1, k2 }, delay, delay_error, .. } = settings;
    println!(
        "[{k1:4}, {k2:4}] {delay:6.3} ± {delay_error:5.3} {error_deg:16.2} {:26.3} {:30.1} %",
        low.to_degrees(),
        100.0 * left
    );
}
