//! Machine check of the bounds on which the guarantee of CRMPC's robust set rests.
//!
//! The proof uses bounds of the kinematics and dynamics over a domain, sums over all sampling
//! instants, and one inequality that decides whether the guarantee can be given. This crate checks
//! all of them for given settings in interval arithmetic that is rounded outwards. A bound that it
//! calls true is true for the exact numbers, apart from errors in this program or the compiler. The
//! formulas are written anew; only the bounds come from the controller.
//!
//! These checks do not cover the steps of the proof that lead from one inequality to the next, or
//! the optimisation. [`plan`] covers the certificate as a whole: it bounds what can happen under a
//! recorded plan without any of the controller's bounds (docs/proof.md).

pub mod assessment;
mod body;
pub mod draws;
mod driven;
pub mod dual;
pub mod dynamics;
pub mod flights;
pub mod given;
mod identity;
pub mod interval;
pub mod kinematics;
pub mod lemmas;
pub mod plan;
mod random;
pub mod search;
#[cfg(feature = "shipped")]
pub mod shipped;
pub mod sums;
pub mod tally;

use control::DesignError;
use control::crmpc::{Design, Lemmas, Settings};
use interval::Interval;
use lemmas::Finding;

/// Findings of all checks for one set of settings.
#[derive(Clone, Debug, PartialEq)]
pub struct CheckReport {
    /// Findings about the geometry and the inertia.
    pub lemmas: Vec<Finding>,
    /// Findings about the dynamics.
    pub dynamics: Vec<Finding>,
    /// Findings about the sums and the final inequality, or `None` if they are not checked.
    pub assessment: Option<Vec<Finding>>,
    /// Findings about the terminal weight of the robust set.
    pub terminal: Vec<Finding>,
    /// Largest eigenvalue of (11c) for each axis with the printed weight, which belongs to the
    /// continuous law.
    pub printed_terminal: [Interval; 3],
    /// Norm ‖x‖ with which the horizon may end, rad/s.
    pub terminal_rate: f64,
}

impl CheckReport {
    /// Checks `settings` with enclosures of the relative width `gap`.
    ///
    /// # Errors
    /// Reports settings for which no controller can be designed.
    pub fn new(settings: &Settings, gap: f64) -> Result<Self, DesignError> {
        let settings = &settings.resolved()?;
        let design = Design::new(settings)?;
        let bounds = Lemmas::new(settings);
        let (mut lemmas, suprema) = lemmas::check(settings, &bounds, gap);
        let terminal_rate = design.assessment.terminal_rate;
        let mut dynamics = dynamics::check(settings, &bounds, &suprema, terminal_rate);
        if settings.delay > 0.0 {
            // The domain is larger before the nominal trajectory began.
            let before = Lemmas::before(settings);
            let (more, suprema) = lemmas::check(settings, &before, gap);
            lemmas.extend(more);
            dynamics.extend(dynamics::check(settings, &before, &suprema, terminal_rate));
        }
        Ok(Self {
            lemmas,
            dynamics,
            assessment: assessment::check(settings, &bounds, &design.tightening, terminal_rate),
            terminal: assessment::check_terminal_weight(settings),
            printed_terminal: sums::terminal_decrease(settings).map(|[_, printed]| printed),
            terminal_rate,
        })
    }

    /// Returns the findings of all checks by section, each with its title.
    pub fn sections(&self) -> [(&'static str, &[Finding]); 4] {
        [
            ("Geometry and inertia", &self.lemmas),
            ("Dynamics", &self.dynamics),
            ("Sums and the final inequality", self.assessment.as_deref().unwrap_or_default()),
            ("Terminal weight, (11c) with the sampled law", &self.terminal),
        ]
    }

    /// Whether everything was checked and is true.
    pub fn holds(&self) -> bool {
        self.assessment.is_some()
            && self.sections().iter().all(|(_, findings)| findings.iter().all(Finding::holds))
    }
}
