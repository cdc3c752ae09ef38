//! The check of the bounds behind the guarantee for settings of the command line.

use clap::Args;
use control::crmpc::Settings;
use guarantee_check::CheckReport;
use guarantee_check::given::Given;
use guarantee_check::lemmas::Finding;
use std::str::FromStr;
use toml::Value;

/// Options for the settings whose bounds are checked.
#[derive(Args)]
pub(crate) struct Bounds {
    /// Setting of CRMPC as its FMU names it, such as `delay=0.04` or `inertia.error=0.02`; a number
    /// is in SI units, and a text such as `guarantee.sideslip="20 deg"` says its unit.
    #[arg(long = "set", value_name = "NAME=VALUE")]
    set: Vec<String>,
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
        let mut given = Given::default();
        for set in &self.set {
            let (name, text) =
                set.split_once('=').ok_or_else(|| format!("{set}: no NAME=VALUE"))?;
            // The quotes of a text may be left out.
            let value = Value::from_str(text).unwrap_or_else(|_| text.into());
            given.set(name, &value)?;
        }
        given.settings()
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
    fn settings_have_the_names_and_units_of_the_fmu() {
        let settings = |set: &[&str]| {
            let set = set.iter().map(ToString::to_string).collect();
            Bounds { set, gap: 0.1 }.settings()
        };
        let with = ["delay=0.03", "measurement.age=0.01", "guarantee.sideslip=10 deg"];
        let given = settings(&with).unwrap();
        assert!((given.delay - 0.04).abs() < 1e-15);
        assert_eq!(given.sideslip_domain, 10.0_f64.to_radians());
        assert!(settings(&["delai=0.03"]).is_err() && settings(&["delay"]).is_err());
        assert!(settings(&["inertia.Ixx=0"]).is_err());
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
