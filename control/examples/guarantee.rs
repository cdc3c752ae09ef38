//! How far the guarantee of the robust set reaches for the published vehicle and limits:
//!
//! ```text
//! cargo run --release -p reentry-control --example guarantee [-- search]
//! ```
//!
//! The example prints the tables of `docs/guarantee.md`: the largest disturbance bound that is
//! accepted, rounded down, with the gain K by rule and with gains that are set. `search` prints the
//! bound for a grid of gains instead, from which the candidates of the rule are taken.

use control::crmpc::{Constraints, Design, Settings};
use control::error::DesignError;
use control::error_dynamics::Gain;

/// A disturbance bound that is refused with any gain, rad/s².
const TOO_LARGE: f64 = 0.06;
const DELAYS: [f64; 5] = [0.0, 0.04, 0.08, 0.117, 0.2];
const ERRORS: [f64; 4] = [0.0, 0.05, 0.1, 0.25];

fn main() {
    if std::env::args().any(|argument| argument == "search") {
        return search();
    }
    println!("By rule, over delay and errors of {ERRORS:?} deg and deg/s:");
    for delay in DELAYS {
        row(&format!("{delay} s"), ERRORS.map(|error| with(delay, error)));
    }
    println!("Over delays of {DELAYS:?} s:");
    let by_delay = |row: Settings| DELAYS.map(|delay| Settings { delay, ..row });
    for tensor_error in [0.03, 0.05] {
        let tensor = Settings { inertia_error: 0.0, tensor_error, ..with(0.0, 0.0) };
        row(&format!("tensor error {tensor_error}"), by_delay(tensor));
    }
    for (angle, rate) in [(0.3, 0.046), (0.6, 0.046), (0.3, 0.35)] {
        let slow = Settings {
            slow_angle_error: f64::to_radians(angle),
            slow_angle_rate: f64::to_radians(rate),
            ..with(0.0, 0.005)
        };
        row(&format!("slow errors {angle}°, {rate}°/s"), by_delay(slow));
    }
    for (k1, k2) in [(-5.0, -5.0), (-1.5, -4.0)] {
        row(
            &format!("K = [{k1}, {k2}]").replace('-', "−"),
            by_delay(Settings { feedback: Gain { k1, k2 }, ..with(0.0, 0.0) }),
        );
    }
}

/// Returns the settings with a delay (s), and with errors of the angles and their rates (deg and
/// deg/s).
fn with(delay: f64, error_deg: f64) -> Settings {
    let error = error_deg.to_radians();
    let published = Settings::new(Constraints::Robust);
    Settings { delay, angle_error: error, rate_error: error, ..published }
}

fn row(name: &str, settings: impl IntoIterator<Item = Settings>) {
    print!("| {name} |");
    for settings in settings {
        match largest(&settings) {
            None => print!(" – |"),
            Some(bound) => {
                let disturbance_bound = down(bound).to_radians();
                let accepted = Settings { disturbance_bound, ..settings };
                let Gain { k1, k2 } = Design::new(&accepted).unwrap().feedback;
                let text = format!(" {:.3}°/s² [{k1}, {k2}] |", down(bound));
                print!("{}", text.replace('-', "−"));
            }
        }
    }
    println!();
}

/// Returns the largest disturbance bound that is accepted, rad/s²; `None` if the design accepts
/// none, or not the gain.
fn largest(settings: &Settings) -> Option<f64> {
    match Design::new(&Settings { disturbance_bound: TOO_LARGE, ..*settings }) {
        Err(DesignError::NoGuarantee(refusal)) => refusal.disturbance,
        _ => None,
    }
}

/// Returns a bound in deg/s², rounded down so that it is accepted as it is printed.
fn down(bound: f64) -> f64 {
    (bound.to_degrees() * 1e3).floor() * 1e-3
}

fn search() {
    let tensor = Settings { inertia_error: 0.0, tensor_error: 0.05, ..with(0.0, 0.0) };
    let errors = ERRORS.map(|error| (format!("errors {error}, delay 0.04 s"), with(0.04, error)));
    let others = [("delay 0.117 s".into(), with(0.117, 0.0)), ("tensor error".into(), tensor)];
    let k2s = [-1.5, -2.0, -3.0, -4.0, -5.0, -6.0, -10.0];
    for (name, settings) in errors.into_iter().chain(others) {
        println!("{name}: largest bound in deg/s2 for k2 = {k2s:?}");
        for k1 in [-0.2, -0.35, -0.5, -0.75, -1.0, -1.5, -3.0, -5.0] {
            let bound = |k2: f64| largest(&Settings { feedback: Gain { k1, k2 }, ..settings });
            let text =
                |k2: f64| bound(k2).map_or("-".into(), |bound| format!("{:.3}", down(bound)));
            println!("    k1 = {k1:5}: {:>6}", k2s.map(text).join("  "));
        }
    }
}
