//! A closed loop in one process: a controller flies a scenario, and the tracking errors result.
//!
//! ```
//! use control::closed_loop::fly;
//! use control::crmpc::{Constraints, Settings};
//! use control::{Controller, Crmpc};
//! use vehicle::Scenario;
//!
//! let scenario = Scenario { duration: 2.0, ..Scenario::crmpc2022() };
//! let settings = Settings::new(Constraints::Robust);
//! let mut law = Crmpc::new(settings)?;
//! let mut memory = law.memory();
//! let summary = fly(&mut law, &mut memory, settings.period_feedback, &scenario, |sample| {
//!     println!("{:.2} s: {:.0} N m", sample.time, sample.moment.norm());
//! })?;
//! assert!(summary.largest_rate <= scenario.limit_rate);
//! assert!(summary.largest_moment <= scenario.limit_moment);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use crate::controller::{Controller, Measurement};
use nalgebra::Vector3;
use vehicle::Scenario;
use vehicle::error::Error;
use vehicle::plant::Plant;
use vehicle::reference::Reference;

/// Longest time between two checks of the rates within a tick, and longest integration step, s.
pub const CHECK: f64 = 0.01;

/// One tick of a flight.
#[derive(Clone, Copy, Debug)]
pub struct Sample<'a, Memory> {
    /// Number of the tick, from 0.
    pub tick: u64,
    /// Time of the tick, s.
    pub time: f64,
    /// Measurement that the controller receives.
    pub measured: Measurement,
    /// Reference at the time of the tick.
    pub reference: Reference,
    /// Moment that is held until the next tick, N m.
    pub moment: Vector3<f64>,
    /// Memory that the controller carries into the next tick.
    pub memory: &'a Memory,
}

/// Figures of merit of a whole flight.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Summary {
    /// Root mean square of ‖Θ − Θ_r‖ over the ticks, rad: the EMS of Chai 2022.
    pub error_rms: f64,
    /// Root mean square of ‖m‖ over the ticks, N m; as a share of the limit it is the CMS of Chai
    /// 2022.
    pub moment_rms: f64,
    /// Largest ‖ω‖, checked every [`CHECK`], rad/s.
    pub largest_rate: f64,
    /// Largest ‖m‖ of all commands, N m.
    pub largest_moment: f64,
}

/// Flies `scenario` with ideal measurement and a tick every `period` (s). Inertia, initial state,
/// disturbance and reference are those of the scenario. `observe` is called at each tick after the
/// controller's update.
///
/// # Errors
/// Returns an error that names the value of the scenario at fault, or says when the attitude was
/// lost, which means beyond the singularity of its angles.
pub fn fly<C: Controller>(
    controller: &mut C,
    memory: &mut C::Memory,
    period: f64,
    scenario: &Scenario,
    mut observe: impl FnMut(&Sample<C::Memory>),
) -> Result<Summary, Error> {
    let mut plant = Plant::new(&scenario.config(CHECK), 0.0)?;
    let reference = |time: f64| scenario.reference.at(time);
    let ticks = (scenario.duration / period).round() as u64;
    let looks = (period / CHECK - 1e-9).ceil().max(1.0);
    let mut summary = Summary::default();
    for tick in 0..ticks {
        let time = tick as f64 * period;
        let measured =
            Measurement { angles: plant.angles(), rates: plant.rates(), ..Measurement::default() };
        let moment = controller.update(memory, tick, time, &measured, &reference);
        let now = reference(time);
        observe(&Sample { tick, time, measured, reference: now, moment, memory });
        summary.error_rms += (measured.angles - now.angles).norm_squared();
        summary.moment_rms += moment.norm_squared();
        summary.largest_moment = summary.largest_moment.max(moment.norm());
        for look in 0..looks as u32 {
            let at = |look: u32| time + f64::from(look) * (period / looks);
            plant.advance(at(look), at(look + 1), moment)?;
            summary.largest_rate = summary.largest_rate.max(plant.rates().norm());
        }
    }
    let mean = |sum: f64| (sum / ticks.max(1) as f64).sqrt();
    (summary.error_rms, summary.moment_rms) = (mean(summary.error_rms), mean(summary.moment_rms));
    Ok(summary)
}
