//! What the design of the robust set leaves of the limits, for the published settings with other gains and delays.
//!
//! ```text
//! cargo run --release -p control --example guarantee
//! ```

use control::crmpc::{Design, Guarantee, Settings};
use control::sampled::Gain;

fn main() {
    for (k1, k2) in [(-5.0, -5.0), (-4.0, -4.5), (-3.0, -4.0), (-2.0, -4.0), (-2.0, -3.0), (-1.0, -2.0)] {
        for delay in [0.0, 0.04, 0.117] {
            for rate_error_deg in [0.0, 0.1, 0.2] {
                let settings = Settings {
                    feedback: Gain { k1, k2 },
                    delay,
                    rate_error: f64::to_radians(rate_error_deg),
                    angle_error: f64::to_radians(rate_error_deg),
                    ..Settings::published()
                };
                let text = match Design::new(&Settings { guarantee: Guarantee::Required, ..settings }) {
                    Ok(design) => format!("{:?}", design.assessment),
                    Err(error) => error.to_string(),
                };
                println!("{k1} {k2} {delay} {rate_error_deg}: {text}");
            }
        }
    }
}
