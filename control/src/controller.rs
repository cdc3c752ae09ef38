//! The interface of every controller: a function of memory, tick and measurement.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use settings::Declared;
use vehicle::kinematics::{Kinematics, r_inverse};
use vehicle::profile::Profile;
use vehicle::reference::Reference;

/// The measured state of the vehicle that a controller receives at a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Measurement {
    /// Angles of attack, sideslip and bank, Θ = [α, β, σ], rad.
    pub angles: Vector3<f64>,
    /// Body rates, ω = [p, q, r], rad/s; relative to the axes that turn with the trajectory, if
    /// [`Measurement::relative_to`] was given their turn rate.
    pub rates: Vector3<f64>,
    /// Part of `rates` that the turn of these axes adds, w = R⁻¹ Δ_f, rad/s.
    pub turn: Vector3<f64>,
    /// The moment that acted since the last tick, N m, if it is measured. Without it a controller
    /// assumes that its command acted.
    pub achieved_moment: Option<Vector3<f64>>,
    /// Moment that acts besides that of the actuators and is known, such as the air's static
    /// moment, N m. A law commands the sum of both, and the actuators are asked for the rest.
    pub known_moment: Vector3<f64>,
    /// Limits that hold at present.
    pub scheduled: Scheduled,
    /// Whether the measurement was made at an earlier instant than the tick, because the
    /// communication step is longer than the period or not a multiple of it.
    pub stale: bool,
    /// Fault that the measurements up to this one show without knowledge of the law.
    pub doubt: Option<Doubt>,
}

/// Limits that change during a flight, for example with dynamic pressure, as far as they are
/// smaller than those of the settings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Declared)]
pub struct Scheduled {
    /// Limit on the norm of the control moment that holds at present; the command is scaled down to
    /// it.
    #[setting(unit = "N.m", min = 0.0, nominal = 1e5)]
    pub limit_moment: f64,
    /// Bound on each component of the disturbance of the angles' second derivatives that holds at
    /// present, if it is smaller than disturbance.bound.
    #[setting(unit = "rad/s2", min = 0.0, nominal = 0.03)]
    pub disturbance_bound: f64,
    /// Bound on the error of each measured angle that holds at present, such as protection.attitude
    /// of a navigation. While it is larger than estimation.angleError and estimation.slowAngleError
    /// together, nothing is guaranteed.
    #[setting(unit = "rad", min = 0.0, nominal = 0.01)]
    pub angle_error: f64,
}

impl Default for Scheduled {
    /// Returns limits that are larger than any of a vehicle, and no error.
    fn default() -> Self {
        Self { limit_moment: 1e9, disturbance_bound: 1e3, angle_error: 0.0 }
    }
}

/// Fault that measurements show without knowledge of the law.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Doubt {
    /// The angles have not moved as the measured rates say.
    Motion,
    /// The delay of the loop differs from the declared one.
    OtherDelay,
    /// The acceleration over the last period is larger than [`Controller::explained`].
    Unexplained,
}

impl Measurement {
    /// Returns whether all numbers that a law computes with are finite.
    pub fn is_finite(&self) -> bool {
        let Self { angles, rates, turn, achieved_moment, known_moment, scheduled, .. } = self;
        let vectors = [angles, rates, turn, known_moment];
        vectors.into_iter().chain(achieved_moment).flatten().all(|value| value.is_finite())
            && !scheduled.limit_moment.is_nan()
            && !scheduled.disturbance_bound.is_nan()
            && !scheduled.angle_error.is_nan()
    }

    /// Returns the measurement with the rates relative to axes that turn with the trajectory, for a
    /// law that assumes Θ̇ = R ω. While the trajectory turns, Θ̇ = R ω + Δ_f by Chai 2022 (2), with
    /// Δ_f by Wu 2015 (1); relative to it, Θ̇ = R (ω + R⁻¹ Δ_f). `turn_rate` (rad/s) comes from
    /// [`vehicle::trajectory::Trajectory::turn_rate`].
    ///
    /// The remaining disturbance of the law is of second order: the change of R⁻¹ Δ_f, and the part
    /// that the gyroscopic moment of the relative rates lacks.
    #[must_use]
    pub fn relative_to(self, turn_rate: &Vector3<f64>) -> Self {
        if *turn_rate == Vector3::zeros() {
            return self;
        }
        let known = Kinematics::Printed.turn(&self.angles) * turn_rate;
        let turn = r_inverse(&self.angles) * known;
        Self { rates: self.rates + turn, turn, ..self }
    }
}

/// What the assumptions of a law explain: the angular acceleration beyond that of the moment that
/// acts after the declared delay, and differences of measurements from each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Explained {
    /// Largest part in each component of ẋ_ω, whatever the moment, rad/s².
    pub disturbance: f64,
    /// Largest part relative to the acceleration by the moment.
    pub share: f64,
    /// Largest difference of each angle's change from the sum of its measured rates over any time,
    /// rad.
    pub angle: f64,
    /// What is added to it in each period, rad: at rest, and relative to ‖x_ω‖ (s).
    pub motion: [f64; 2],
    /// Largest measured ‖ω‖ for which they hold, rad/s.
    pub rate: f64,
}

/// The reference as a function of time (s), so that a controller with preview can also ask for the
/// future.
pub type ReferenceAt<'a> = &'a dyn Fn(f64) -> Reference;

/// Knowledge of the reference at a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Preview<'a> {
    /// The whole reference is known in advance and does not change during an experiment.
    Profile(&'a Profile),
    /// The reference is given from outside, and its future is unknown.
    External(Forecast),
}

/// Forecast of a reference that is given from outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forecast {
    /// The given reference.
    pub given: Reference,
    /// Instant for which it is given, s.
    pub from: f64,
    /// Instant at which the moment of this tick acts, s. Until then the reference moves on as its
    /// derivatives say.
    pub until: f64,
    /// Deceleration with which each angle brakes afterwards, rad/s². Without it the given reference
    /// counts until then, and the angles stay constant afterwards.
    pub braking: Option<Vector3<f64>>,
}

impl Forecast {
    /// Returns the reference at `time` (s).
    fn at(&self, time: f64) -> Reference {
        let Self { given, from, until, braking } = *self;
        let Some(braking) = braking else {
            let held = Reference { angles: given.angles, ..Reference::default() };
            return if time <= until { given } else { held };
        };
        let moving = (time.min(until) - from).max(0.0);
        let Reference { angles, rates, accelerations } = given;
        let moved = Reference {
            angles: angles + (rates + accelerations * (0.5 * moving)) * moving,
            rates: rates + accelerations * moving,
            accelerations,
        };
        let since = time - until;
        if since <= 0.0 {
            return moved;
        }
        let mut reference = Reference::default();
        for i in 0..3 {
            let (rate, braking) = (moved.rates[i], braking[i]);
            let stops = rate.abs() / braking;
            let left = if since < stops { rate - (braking * since).copysign(rate) } else { 0.0 };
            reference.angles[i] = moved.angles[i] + 0.5 * (rate + left) * since.min(stops);
            reference.rates[i] = left;
            if since < stops {
                reference.accelerations[i] = -braking.copysign(rate);
            }
        }
        reference
    }
}

impl Preview<'_> {
    /// Returns the reference at `time` (s).
    pub fn at(&self, time: f64) -> Reference {
        match self {
            Self::Profile(profile) => profile.at(time),
            Self::External(forecast) => forecast.at(time),
        }
    }

    /// Returns the part of the preview that may change during an experiment.
    pub(crate) fn external(&self) -> Option<Reference> {
        match self {
            Self::Profile(_) => None,
            Self::External(forecast) => Some(forecast.given),
        }
    }
}

/// Scales a moment (N m) into ‖m‖ ≤ `limit` (N m, infinite for none); its direction is kept.
pub fn saturated(moment: Vector3<f64>, limit: f64) -> Vector3<f64> {
    let scaled = |moment: Vector3<f64>| {
        let excess = moment.norm() / limit;
        if excess > 1.0 { moment / excess } else { moment }
    };
    // The squares of a moment of 1e200 N m have no finite sum.
    let is_beyond = moment.norm().is_infinite() && limit.is_finite();
    let moment = if is_beyond { moment / moment.amax() * limit } else { moment };
    // The second scaling removes the excess that rounding leaves above the limit.
    scaled(scaled(moment))
}

/// A sampled attitude controller: a law that commands a moment, and that is informed if a limit
/// reduces it. Of the data on which later calls depend, `update` changes `memory` alone. A tick can
/// therefore be evaluated again with other inputs from the same memory, and a saved memory
/// continues bit for bit.
pub trait Controller {
    /// The state of the controller that is carried from tick to tick.
    type Memory: Clone + Default + Serialize + DeserializeOwned + Send;

    /// Returns the memory for the first tick, with room for everything that later ticks store in
    /// it.
    fn memory(&self) -> Self::Memory {
        Self::Memory::default()
    }

    /// Returns whether the shape of `memory` fits this controller. A restored memory may be forged.
    fn fits(&self, _memory: &Self::Memory) -> bool {
        true
    }

    /// Evaluates the law at the tick with number `tick` and `time` (s). Returns the moment that it
    /// commands before any limit, N m.
    fn command(
        &mut self,
        memory: &mut Self::Memory,
        tick: u64,
        time: f64,
        measured: &Measurement,
        reference: ReferenceAt,
    ) -> Vector3<f64>;

    /// Returns the limit on ‖m‖ that belongs to the command just given, N m; infinite for none.
    fn limit(&self, _memory: &Self::Memory) -> f64 {
        f64::INFINITY
    }

    /// Returns what the law's assumptions explain, if it has any. A delay other than the declared
    /// one is then reported only if they do not explain the measurements.
    fn explained(&self) -> Option<Explained> {
        None
    }

    /// Tells the law that its last command exceeded the limit, and which moment (N m) is applied in
    /// its place.
    fn limited(&mut self, _memory: &mut Self::Memory, _applied: &Vector3<f64>) {}

    /// Evaluates a tick, and returns the moment to hold until the next one, N m: the command less
    /// the moment that is known to act already. It is limited here alone, except that the inner law
    /// of [`Dlmpc`](crate::Dlmpc) also limits its moment. A limit that is scheduled always holds.
    ///
    /// A measurement that is not finite is refused: the moment is NaN, the memory stays as it was,
    /// and the tick is still due. The last measurement, marked as stale, may replace one that is
    /// lost.
    fn update(
        &mut self,
        memory: &mut Self::Memory,
        tick: u64,
        time: f64,
        measured: &Measurement,
        reference: ReferenceAt,
    ) -> Vector3<f64> {
        if !measured.is_finite() {
            return Vector3::repeat(f64::NAN);
        }
        let commanded = self.command(memory, tick, time, measured, reference);
        let known = measured.known_moment;
        let limit = self.limit(memory).min(measured.scheduled.limit_moment).max(0.0);
        if known == Vector3::zeros() {
            let applied = saturated(commanded, limit);
            if applied != commanded {
                self.limited(memory, &applied);
            }
            return applied;
        }
        let asked = commanded - known;
        let given = saturated(asked, limit);
        if given != asked {
            self.limited(memory, &(given + known));
        }
        given
    }
}
