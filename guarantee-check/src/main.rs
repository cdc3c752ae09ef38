//! Checks the bounds of CRMPC's guarantee for given settings.
//!
//! ```text
//! cargo run --release -p reentry-guarantee-check -- --k1 -3 --k2 -4 --delay 0.04
//! ```

use clap::Parser;
use control::crmpc::{Constraints, Settings};
use control::error_dynamics::Gain;
use guarantee_check::Report;
use std::process::ExitCode;
use vehicle::dynamics::Inertia;

/// Checks every bound that the guarantee of CRMPC's robust set rests on, in interval arithmetic.
/// Settings that are not given are the published ones. The exit code is 0 if all bounds are true, 1
/// if one is not certain to be, 2 if the settings are refused.
#[derive(Parser)]
#[command(version, allow_negative_numbers = true)]
struct Arguments {
    /// K of the feedback law on the angle, 1/s².
    #[arg(long)]
    k1: Option<f64>,
    /// K of the feedback law on the rate, 1/s.
    #[arg(long)]
    k2: Option<f64>,
    /// Time from a measurement to its moment, s.
    #[arg(long)]
    delay: Option<f64>,
    /// Bound on the disturbance of each axis, deg/s².
    #[arg(long)]
    disturbance_deg: Option<f64>,
    /// Relative error of the inertia that is a common factor of the tensor.
    #[arg(long)]
    inertia_error: Option<f64>,
    /// Relative error of the tensor of inertia in all six entries.
    #[arg(long)]
    tensor_error: Option<f64>,
    /// Bound on the error of each measured angle, deg.
    #[arg(long)]
    angle_error_deg: Option<f64>,
    /// Bound on the error of each measured rate, deg/s.
    #[arg(long)]
    rate_error_deg: Option<f64>,
    /// Sideslip angle of the domain, deg.
    #[arg(long)]
    sideslip_deg: Option<f64>,
    /// Ixx, Iyy, Izz, Ixz in kg m².
    #[arg(long, num_args = 4)]
    inertia: Option<Vec<f64>>,
    /// Relative width of the enclosures that is aimed for.
    #[arg(long, default_value_t = 1e-3)]
    gap: f64,
}

impl Arguments {
    fn settings(&self) -> Result<Settings, String> {
        let mut s = Settings::new(Constraints::Robust);
        let degrees = |value: Option<f64>, otherwise: f64| value.map_or(otherwise, f64::to_radians);
        s.feedback =
            Gain { k1: self.k1.unwrap_or(s.feedback.k1), k2: self.k2.unwrap_or(s.feedback.k2) };
        s.delay = self.delay.unwrap_or(s.delay);
        s.disturbance_bound = degrees(self.disturbance_deg, s.disturbance_bound);
        s.inertia_error = self.inertia_error.unwrap_or(s.inertia_error);
        s.tensor_error = self.tensor_error.unwrap_or(s.tensor_error);
        s.angle_error = degrees(self.angle_error_deg, s.angle_error);
        s.rate_error = degrees(self.rate_error_deg, s.rate_error);
        s.sideslip_domain = degrees(self.sideslip_deg, s.sideslip_domain);
        if let Some(&[ixx, iyy, izz, ixz]) = self.inertia.as_deref() {
            let inertia = Inertia { Ixx: ixx, Iyy: iyy, Izz: izz, Ixz: ixz };
            s.body = inertia.body(1.0).map_err(|error| error.to_string())?;
        }
        Ok(s)
    }
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let report = arguments.settings().and_then(|settings| {
        Report::new(&settings, arguments.gap).map_err(|error| error.to_string())
    });
    let report = match report {
        Ok(report) => report,
        Err(error) => {
            eprintln!("error: {error}");
            return ExitCode::from(2);
        }
    };
    for (title, findings) in report.sections() {
        println!(
            "\n{title}\n{:52} {:>15} {:>33} {:>10}",
            "", "bound b", "smallest true bound within", "margin"
        );
        for finding in findings {
            let verdict = match (finding.holds(), finding.fails()) {
                (true, _) => "",
                (_, true) => "  FALSE",
                _ => "  NOT SHOWN",
            };
            let (low, high) = (finding.truth.low, finding.truth.high);
            println!(
                "{:52} {:15.8e} [{low:15.8e}, {high:15.8e}] {:8.3} %{verdict}",
                finding.statement,
                finding.bound,
                100.0 * finding.margin()
            );
        }
    }
    for (axis, printed) in report.printed_terminal.iter().enumerate() {
        println!(
            "The same with the printed G, axis {}: [{:.6}, {:.6}]",
            axis + 1,
            printed.low,
            printed.high
        );
    }
    println!("\nThe horizon may end with ‖x‖ ≤ {:.6} rad/s.", report.terminal_rate);
    if report.holds() {
        println!("Every bound holds.");
        ExitCode::SUCCESS
    } else {
        println!("NOT every bound is shown to hold.");
        ExitCode::FAILURE
    }
}
