//! The check of the bounds behind the guarantee for settings of the command line.

use clap::Args;
use control::crmpc::{Constraints, Settings};
use control::error_dynamics::Gain;
use guarantee_check::CheckReport;
use guarantee_check::lemmas::Finding;
use vehicle::dynamics::Inertia;

/// Options for the settings whose bounds are checked.
#[derive(Args)]
pub(crate) struct Bounds {
    /// Gain of the feedback law on the angle, 1/s².
    #[arg(long)]
    k1: Option<f64>,
    /// Gain of the feedback law on the rate, 1/s.
    #[arg(long)]
    k2: Option<f64>,
    /// Time from a measurement until its moment acts, s.
    #[arg(long)]
    delay: Option<f64>,
    /// Bound on the disturbance of each axis, deg/s².
    #[arg(long)]
    disturbance_deg: Option<f64>,
    /// Relative error of the inertia, as a common factor of all entries of the tensor.
    #[arg(long)]
    inertia_error: Option<f64>,
    /// Relative error of the inertia tensor, in any of its six entries.
    #[arg(long)]
    tensor_error: Option<f64>,
    /// Bound on the error of each measured angle, deg.
    #[arg(long)]
    angle_error_deg: Option<f64>,
    /// Bound on the error of each measured rate, deg/s.
    #[arg(long)]
    rate_error_deg: Option<f64>,
    /// Bound on the slow part of the errors of angle of attack and sideslip, deg.
    #[arg(long)]
    slow_angle_error_deg: Option<f64>,
    /// Bound on the rate of change of the slow part of each angle's error, deg/s.
    #[arg(long)]
    slow_angle_rate_deg: Option<f64>,
    /// Largest sideslip angle of the domain, deg.
    #[arg(long)]
    sideslip_deg: Option<f64>,
    /// Inertia of the vehicle: Ixx, Iyy, Izz and Ixz, kg m².
    #[arg(long, num_args = 4)]
    inertia: Option<Vec<f64>>,
    /// Relative width of the enclosures at which the search stops.
    #[arg(long, default_value_t = 1e-3)]
    gap: f64,
}

impl Bounds {
    /// Checks the bounds and prints them. The result is whether all of them hold.
    ///
    /// # Errors
    /// Says why the settings are refused.
    pub(crate) fn run(&self) -> Result<bool, String> {
        let report =
            CheckReport::new(&self.settings()?, self.gap).map_err(|error| error.to_string())?;
        for (title, findings) in report.sections() {
            print!("{}", section(title, findings));
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
        println!("{}", verdict(report.holds()));
        Ok(report.holds())
    }

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
        s.slow_angle_error = degrees(self.slow_angle_error_deg, s.slow_angle_error);
        s.slow_angle_rate = degrees(self.slow_angle_rate_deg, s.slow_angle_rate);
        s.sideslip_domain = degrees(self.sideslip_deg, s.sideslip_domain);
        if let Some(&[ixx, iyy, izz, ixz]) = self.inertia.as_deref() {
            let inertia = Inertia { Ixx: ixx, Iyy: iyy, Izz: izz, Ixz: ixz };
            s.body = inertia.body(1.0).map_err(|error| error.to_string())?;
        }
        Ok(s)
    }
}

/// Returns the verdict of the checks of all bounds.
fn verdict(holds: bool) -> &'static str {
    if holds { "Every bound holds." } else { "NOT every bound is shown to hold." }
}

/// Returns the findings of one section as lines.
fn section(title: &str, findings: &[Finding]) -> String {
    let mut lines = format!(
        "\n{title}\n{:52} {:>15} {:>33} {:>10}\n",
        "", "bound b", "smallest true bound within", "margin"
    );
    for finding in findings {
        let verdict = match (finding.holds(), finding.fails()) {
            (true, _) => "",
            (_, true) => "  FALSE",
            _ => "  NOT SHOWN",
        };
        let (low, high) = (finding.truth.low, finding.truth.high);
        lines.extend([format!(
            "{:52} {:15.8e} [{low:15.8e}, {high:15.8e}] {:8.3} %{verdict}\n",
            finding.statement,
            finding.bound,
            100.0 * finding.margin()
        )]);
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use guarantee_check::interval::Interval;

    #[test]
    fn a_bound_that_is_false_or_not_shown_is_named_as_that() {
        let finding = |bound: f64, low: f64, high: f64| {
            let truth = Interval { low, high };
            let text = section("", &[Finding { statement: "a ≤ b".into(), bound, truth }]);
            text.lines().last().unwrap().rsplit_once('%').unwrap().1.trim().to_string()
        };
        assert_eq!(finding(1.0, 0.8, 0.9), "");
        assert_eq!(finding(1.0, 0.9, 1.1), "NOT SHOWN");
        assert_eq!(finding(1.0, 1.1, 1.2), "FALSE");
        assert_eq!(finding(1.0, f64::NAN, f64::NAN), "NOT SHOWN");
        assert_eq!(verdict(true), "Every bound holds.");
        assert_eq!(verdict(false), "NOT every bound is shown to hold.");
    }

    #[test]
    fn findings_that_are_missing_or_not_shown_are_no_proof() {
        let truth = |high: f64| Interval { low: 0.0, high };
        let finding =
            |high: f64| vec![Finding { statement: String::new(), bound: 1.0, truth: truth(high) }];
        let report = |assessment: Option<Vec<Finding>>, terminal: f64| CheckReport {
            lemmas: finding(1.0),
            dynamics: finding(1.0),
            assessment,
            terminal: finding(terminal),
            printed_terminal: [truth(0.0); 3],
            terminal_rate: 0.0,
        };
        assert!(report(Some(finding(1.0)), 1.0).holds());
        assert!(!report(None, 1.0).holds());
        assert!(!report(Some(finding(1.1)), 1.0).holds());
        assert!(!report(Some(finding(1.0)), 1.1).holds());
    }
}
