//! Faults that the assumptions of the guarantee exclude.

use control::Measurement;
use nalgebra::Vector3;

/// A fault, which begins at [`BEGIN`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Fault {
    /// No fault.
    #[default]
    None,
    /// The measurement stays as it was.
    Frozen,
    /// The measured rates are wrong by this much in each component, rad/s.
    Bias(f64),
    /// The measurement stays as it was for this time (s) of every two seconds.
    Dropout(f64),
    /// The measured rates are wrong by this much (rad/s) at one tick of each second.
    Spikes(f64),
    /// The disturbance is larger by this factor.
    Disturbance(f64),
    /// The moment that acts is this share of the commanded one.
    Moment(f64),
    /// The vehicle takes only every second command.
    HalfTheCommands,
}

/// Time at which a fault begins, s.
pub const BEGIN: f64 = 10.0;

/// A fault in progress.
pub(super) struct Faulty {
    fault: Fault,
    held: Option<Measurement>,
    moment: Vector3<f64>,
}

impl Faulty {
    pub(super) fn new(fault: Fault) -> Self {
        Self { fault, held: None, moment: Vector3::zeros() }
    }

    /// Returns the measurement that the controller is given instead of this one at `time` (s).
    pub(super) fn measured(&mut self, time: f64, measured: Measurement) -> Measurement {
        let into = |cycle: f64| (time - BEGIN).rem_euclid(cycle);
        let wrong = |size: f64| Measurement {
            rates: measured.rates + Vector3::new(size, -size, size),
            ..measured
        };
        match self.fault {
            _ if time < BEGIN => measured,
            Fault::Frozen => *self.held.get_or_insert(measured),
            Fault::Dropout(length) if into(2.0) < length => *self.held.get_or_insert(measured),
            Fault::Bias(size) => wrong(size),
            Fault::Spikes(size) if into(1.0) < 0.03 => wrong(size),
            _ => {
                self.held = None;
                measured
            }
        }
    }

    /// Returns the moment that the vehicle is given instead of a commanded one.
    pub(super) fn moment(&mut self, tick: u64, time: f64, command: Vector3<f64>) -> Vector3<f64> {
        match self.fault {
            Fault::Moment(share) if time >= BEGIN => return command * share,
            Fault::HalfTheCommands if time >= BEGIN && tick % 2 == 1 => {}
            _ => self.moment = command,
        }
        self.moment
    }

    /// Returns whether the fault has begun at `time` (s), but no measurement can show it yet,
    /// because the commands since then act after `delay` (s) only.
    pub(super) fn is_unseen(&self, time: f64, delay: f64) -> bool {
        self.fault != Fault::None && time > BEGIN - 0.01 && time < BEGIN + 0.01 + delay
    }

    /// Returns the factor of the disturbance.
    pub(super) fn of_disturbance(&self, time: f64) -> f64 {
        match self.fault {
            Fault::Disturbance(factor) if time >= BEGIN => factor,
            _ => 1.0,
        }
    }
}
