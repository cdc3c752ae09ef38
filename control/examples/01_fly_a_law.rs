//! Flies the linear-quadratic regulator through the scenario of Chai et al. (2022) and prints a
//! line per second.
//!
//! ```text
//! cargo run --release -p reentry-control --example 01_fly_a_law
//! ```

use control::closed_loop::fly;
use control::crmpc::{Constraints, Settings};
use control::lqr::{Lqr, LqrSettings};
use vehicle::Scenario;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scenario = Scenario::crmpc2022();
    let Settings { body, p, q, period_feedback: period, .. } = Settings::new(Constraints::Robust);
    let mut law = Lqr::new(LqrSettings { body, period, p, q })?;

    println!("   time    error   ‖ω‖      ‖m‖");
    let summary = fly(&mut law, &mut (), period, &scenario, |sample| {
        if sample.tick % 25 == 0 {
            let error = (sample.measured.angles - sample.reference.angles).norm().to_degrees();
            let rate = sample.measured.rates.norm().to_degrees();
            println!(
                "{:5.1} s {error:7.3}° {rate:6.3}°/s {:8.0} N m",
                sample.time,
                sample.moment.norm()
            );
        }
    })?;

    println!("EMS {:.3}°", summary.error_rms.to_degrees());
    println!(
        "largest rate {:.0} % of its limit",
        100.0 * summary.largest_rate / scenario.limit_rate
    );
    println!(
        "largest moment {:.0} % of its limit",
        100.0 * summary.largest_moment / scenario.limit_moment
    );
    Ok(())
}
