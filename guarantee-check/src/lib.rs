//! Machine check of the bounds that the guarantee of CRMPC's robust set rests on.
//!
//! The proof uses bounds of the kinematics and dynamics over a domain, sums over all sampling instants, and one inequality that decides whether the guarantee can
//! be given. This crate checks all of them for given settings in interval arithmetic that is rounded outwards: what it calls true is true for
//! the exact numbers, but for the errors that this program or the compiler may have. The formulas are written anew; only the bounds come from
//! the controller.
//!
//! Not checked: the steps of the proof that lead from one inequality to the next, the invariant set of the initial state `tube`, and the optimisation.

pub mod assessment;
pub mod dual;
pub mod dynamics;
mod identity;
pub mod interval;
pub mod kinematics;
pub mod lemmas;
pub mod search;
pub mod sums;

use control::DesignError;
use control::crmpc::{Design, Lemmas, Settings};
use interval::Interval;
use lemmas::Finding;

/// Everything that has been checked for some settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// Of the geometry and the inertia.
    pub lemmas: Vec<Finding>,
    /// Of the dynamics.
    pub dynamics: Vec<Finding>,
    /// Of the sums and the final inequality; `None` where they are not checked.
    pub assessment: Option<Vec<Finding>>,
    /// Of the terminal weight of the robust set.
    pub terminal: Vec<Finding>,
    /// Largest eigenvalue of (11c) per axis with the printed weight, which belongs to the continuous law.
    pub printed_terminal: [Interval; 3],
    /// ‖x‖ with which the horizon may end, rad/s.
    pub terminal_rate: f64,
}

impl Report {
    /// Checks `settings`, with enclosures of this relative width.
    ///
    /// # Errors
    /// The settings cannot be designed for.
    pub fn new(settings: &Settings, gap: f64) -> Result<Self, DesignError> {
        let design = Design::new(settings)?;
        let bounds = Lemmas::new(settings);
        let (lemmas, suprema) = lemmas::check(settings, &bounds, gap);
        let terminal_rate = design.assessment.terminal_rate;
        Ok(Self {
            lemmas,
            dynamics: dynamics::check(settings, &bounds, &suprema, terminal_rate),
            assessment: assessment::check(settings, &bounds, &design.tightening, terminal_rate),
            terminal: assessment::check_terminal_weight(settings),
            printed_terminal: sums::terminal_decrease(settings).map(|[_, printed]| printed),
            terminal_rate,
        })
    }

    /// All that has been checked, by section.
    pub fn sections(&self) -> [(&'static str, &[Finding]); 4] {
        [
            ("Geometry and inertia", &self.lemmas),
            ("Dynamics", &self.dynamics),
            ("Sums and the final inequality", self.assessment.as_deref().unwrap_or_default()),
            ("Terminal weight, (11c) with the sampled law", &self.terminal),
        ]
    }

    /// Whether all has been checked and is true.
    pub fn holds(&self) -> bool {
        self.assessment.is_some()
            && self.sections().iter().all(|(_, findings)| findings.iter().all(Finding::holds))
    }
}
