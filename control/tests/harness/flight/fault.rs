//! Faults that the assumptions of the guarantee exclude.

use super::Random;
use control::Measurement;
use nalgebra::{Matrix3, Vector3};
use vehicle::kinematics;

/// A fault, which begins at [`BEGIN`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Fault {
    /// No fault.
    #[default]
    None,
    /// Some of the measured quantities stay as they were, except for noise of this size, rad and
    /// rad/s.
    Stuck(Stuck, f64),
    /// The rates of the angles that the measured body rates amount to are wrong by this much in
    /// each component (rad/s), and by so much more in each second (rad/s²).
    Bias(f64, f64),
    /// Each measured angle drifts by this much in each second, rad/s.
    Drift(f64),
    /// The measured body rates are a product with this matrix.
    Rates(Matrix3<f64>),
    /// The measurement is this many ticks older.
    Late(usize),
    /// The measurement stays as it was for this time (s) of every two seconds.
    Dropout(f64),
    /// This share of the measurements is replaced by the one before.
    Lost(f64),
    /// The measured rates are wrong by this much (rad/s) at one tick of each second.
    Spikes(f64),
    /// The disturbance is larger by this factor.
    Disturbance(f64),
    /// The moment that acts is a product of the commanded one with this matrix.
    Moment(Matrix3<f64>),
    /// The moment that acts stays as it was.
    StuckMoment,
    /// The vehicle takes only every second command.
    HalfTheCommands,
}

/// Quantities that are stuck.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stuck {
    /// Angles and rates.
    All,
    /// The body rates alone.
    Rates,
    /// The angles alone.
    Angles,
}

/// Time at which a fault begins, s.
pub const BEGIN: f64 = 10.0;

/// A fault in progress.
pub(super) struct Faulty {
    fault: Fault,
    held: Option<Measurement>,
    past: Vec<Measurement>,
    moment: Vector3<f64>,
    random: Random,
}

impl Faulty {
    pub(super) fn new(fault: Fault, seed: u64) -> Self {
        let random = Random::new(seed.wrapping_add(1 << 34));
        Self { fault, held: None, past: Vec::new(), moment: Vector3::zeros(), random }
    }

    /// Returns the measurement that the controller is given instead of this one at `time` (s).
    pub(super) fn measured(&mut self, time: f64, measured: Measurement) -> Measurement {
        let into = |cycle: f64| (time - BEGIN).rem_euclid(cycle);
        let Measurement { angles, rates, .. } = measured;
        let wrong = |size: f64| Measurement {
            rates: rates + kinematics::r_inverse(&angles) * Vector3::new(size, -size, size),
            ..measured
        };
        self.past.push(measured);
        match self.fault {
            _ if time < BEGIN => measured,
            Fault::Stuck(what, noise) => {
                let held = *self.held.get_or_insert(measured);
                let mut noise = || self.random.vector() * noise;
                let (held_angles, held_rates) = (held.angles + noise(), held.rates + noise());
                Measurement {
                    angles: if what == Stuck::Rates { angles } else { held_angles },
                    rates: if what == Stuck::Angles { rates } else { held_rates },
                    ..measured
                }
            }
            Fault::Bias(size, ramp) => wrong(size + ramp * (time - BEGIN)),
            Fault::Drift(rate) => {
                let drift = Vector3::new(1.0, -1.0, 1.0) * (rate * (time - BEGIN));
                Measurement { angles: angles + drift, ..measured }
            }
            Fault::Rates(matrix) => Measurement { rates: matrix * rates, ..measured },
            Fault::Late(ticks) => self.past[self.past.len().saturating_sub(1 + ticks)],
            Fault::Dropout(length) if into(2.0) < length => *self.held.get_or_insert(measured),
            Fault::Lost(share) if self.random.between(0.0, 1.0) < share => {
                *self.held.get_or_insert(measured)
            }
            Fault::Lost(_) => *self.held.insert(measured),
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
            Fault::Moment(matrix) if time >= BEGIN => return matrix * command,
            Fault::StuckMoment if time >= BEGIN => {}
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
