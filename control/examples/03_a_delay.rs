//! Flies CRMPC with its command acting 0.117 s late, the computing time that Chai et al. (2022)
//! print: once without compensation, and once with the state predicted over the delay.
//!
//! ```text
//! cargo run --release -p reentry-control --example 03_a_delay
//! ```

use control::crmpc::{Constraints, Settings};
use control::delay::{Delayed, Latency};
use control::{Controller, Crmpc, Measurement};
use vehicle::Scenario;
use vehicle::plant::Plant;

/// s.
const DELAY: f64 = 0.117;

/// Largest rate and moment as shares of their limits; the law compensates `expected_delay` (s).
fn flown(expected_delay: f64) -> Result<(f64, f64), Box<dyn std::error::Error>> {
    let scenario = Scenario::crmpc2022();
    let settings = Settings { delay: expected_delay, ..Settings::new(Constraints::Robust) };
    let latency = Latency { measurement: 0.0, action: expected_delay };
    let Settings { body, period_feedback, .. } = settings;
    let law = Crmpc::new(settings)?;
    let mut law = Delayed::new(law, body, period_feedback, latency, f64::INFINITY)?;
    let mut memory = law.memory();
    let mut config = scenario.config(0.01);
    config.moment_delay = DELAY;
    let mut plant = Plant::new(&config, 0.0)?;
    let (mut rate, mut moment) = (0.0_f64, 0.0_f64);
    for tick in 0..1250_u32 {
        let [from, to] = [tick, tick + 1].map(|k| 0.04 * f64::from(k));
        let measured =
            Measurement { angles: plant.angles(), rates: plant.rates(), ..Measurement::default() };
        let command = law
            .update(&mut memory, tick.into(), from, &measured, &|time| scenario.reference.at(time));
        plant.advance(from, to, command)?;
        (rate, moment) = (rate.max(plant.rates().norm()), moment.max(command.norm()));
    }
    Ok((rate / scenario.limit_rate, moment / scenario.limit_moment))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    for (text, expected_delay) in [("not compensated", 0.0), ("compensated", DELAY)] {
        let (rate, moment) = flown(expected_delay)?;
        println!("delay of {DELAY} s, {text}: ‖ω‖ {rate:.3}, ‖m‖ {moment:.3} of their limits");
    }
    Ok(())
}
