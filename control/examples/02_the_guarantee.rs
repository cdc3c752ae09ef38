//! Asks the design of CRMPC whether its limits are guaranteed, for two settings, and flies the one
//! for which they are.
//!
//! ```text
//! cargo run --release -p reentry-control --example 02_the_guarantee
//! ```

use control::closed_loop::fly;
use control::crmpc::{Constraints, GuaranteeStatus, Settings};
use control::{Controller, Crmpc};
use vehicle::Scenario;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scenario = Scenario::crmpc2022();
    let settings = Settings::new(Constraints::Robust);

    // To compensate for errors of the measured rates takes moment that the disturbance needs as
    // well.
    let with_errors = Settings {
        angle_error: 0.25_f64.to_radians(),
        rate_error: 0.25_f64.to_radians(),
        ..settings
    };
    if let Err(refusal) = Crmpc::new(with_errors) {
        println!("with errors of 0.25° and 0.25°/s: {refusal}\n");
    }

    let mut law = Crmpc::new(settings)?;
    let mut memory = law.memory();
    let (mut in_force, mut least) = (0, f64::INFINITY);
    fly(&mut law, &mut memory, settings.period_feedback, &scenario, |sample| {
        in_force += u32::from(sample.memory.guarantee == GuaranteeStatus::InForce);
        least = least.min(sample.memory.margins.moment);
    })?;
    println!(
        "without errors: in force at {in_force} ticks of 1250, at least {:.1} % of the moment left",
        100.0 * least
    );
    Ok(())
}
