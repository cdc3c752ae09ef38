//! Flights of CRMPC under the robust set that test its guarantee, with bounded disturbances of any
//! waveform, delayed moments, measurement errors or an estimator in the loop, any start and any
//! reference.

mod drawing;
mod eyes;
mod fault;
mod moving;
mod random;
mod settings;
mod slow;
mod waveform;

use super::{CHECK, in_parallel};
use control::controller::Scheduled;
use control::crmpc::{Crmpc, GuaranteeStatus, Memory, Settings};
use control::delay::{Delayed, Latency};
use control::{Controller, Measurement};
use eyes::Eyes;
use fault::Faulty;
use moving::Vehicle;
use nalgebra::{Matrix3, Vector3};
use vehicle::profile::Profile;
use vehicle::reference::Reference;
use vehicle::scenario::Scenario;
use waveform::Progress;

pub use fault::{BEGIN, Fault, Stuck};
pub use random::Random;
pub use settings::{Tried, optimised_every, random_settings, tried};
pub use slow::Slow;
pub use waveform::Waveform;

/// Attitude errors above this value count as a lost attitude, rad.
const LOST: f64 = 30.0 * std::f64::consts::PI / 180.0;

/// Relative tolerance for rounding when limits are checked.
const SLACK: f64 = 1e-9;

/// Measurements of ‖ω‖ and β between two checks: one every millisecond.
const FINE: u32 = 10;

/// The source of the controller's measurements.
#[derive(Clone, Debug)]
pub enum Sight {
    /// The controller receives the true state.
    Exact,
    /// The angles and x_ω have errors that follow this waveform within the bounds of the settings.
    Errors(Waveform),
    /// The estimator evaluates the typical MEMS sensors with noise of this seed.
    Estimator(u64),
}

/// Definition of a flight.
#[derive(Clone, Debug)]
pub struct Flight {
    /// Settings of the controller, with the delay, the errors and the disturbance bound that are in
    /// force.
    pub settings: Settings,
    /// Ratio of the vehicle's inertia to the one that the controller uses.
    pub inertia_scale: f64,
    /// Relative error E of the vehicle's tensor of inertia, which is I^½ (1 + E) I^½ times the
    /// ratio.
    pub tensor_error: Matrix3<f64>,
    /// Angles Θ at the start, rad.
    pub angles: Vector3<f64>,
    /// Body rates ω at the start, rad/s.
    pub rates: Vector3<f64>,
    /// Reference of the flight.
    pub reference: Profile,
    /// Time of the reference at the start, s.
    pub reference_start: f64,
    /// Waveform of Δ relative to its bound.
    pub disturbance: Waveform,
    /// Time over which Δ is held, s; a whole multiple of [`CHECK`].
    pub hold: f64,
    /// Source of the controller's measurements.
    pub sight: Sight,
    /// Slow part of the errors of the angles.
    pub slow: Option<Slow>,
    /// Age of the measurements, s, which is a part of the delay of the settings.
    pub age: f64,
    /// Amount by which commands act later than the settings say, s.
    pub late: f64,
    /// Limits that are scheduled over time (s).
    pub scheduled: fn(&Settings, f64) -> Scheduled,
    /// Fault that the assumptions exclude.
    pub fault: Fault,
    /// Seed of all random numbers of the flight.
    pub seed: u64,
    /// Duration of the flight, s.
    pub duration: f64,
}

/// Results of a flight, relative to the limits of the settings.
#[derive(Clone, Copy, Debug, Default)]
pub struct Shown {
    /// Largest ‖ω‖ relative to its limit in the periods that began under guarantee, measured every
    /// millisecond.
    pub rate: f64,
    /// Time of this largest ‖ω‖, s.
    pub rate_time: f64,
    /// Largest |β| relative to the bound up to which the guarantee is given, and to which the slow
    /// errors add, in the same periods and as often.
    pub sideslip: f64,
    /// Largest ‖m‖ relative to its limit that was commanded under guarantee.
    pub moment: f64,
    /// Number of ticks under guarantee in whose period ‖ω‖ exceeded its limit.
    pub ticks_over: u32,
    /// Whether ‖ω‖, |β| or ‖m‖ exceeded its limit under guarantee.
    pub broken: bool,
    /// Time at which the guarantee ended, s.
    pub withdrawn: Option<f64>,
    /// Whether the errors of angles and rates stayed within their bounds, as the guarantee assumes.
    pub assumed: bool,
    /// Whether the attitude was lost.
    pub lost: bool,
    /// Number of optimisations without an optimum.
    pub fallbacks: u32,
    /// Share of the ticks under guarantee.
    pub in_force: f64,
    /// Root mean square over the ticks of ‖Θ − Θ_r‖, deg.
    pub ems_deg: f64,
    /// Largest error of an angle (rad) and of a component of x_ω (rad/s) in the controller's
    /// measurements, besides the slow part.
    pub errors: (f64, f64),
}

impl Shown {
    /// Returns whether the guarantee failed: a limit was exceeded under guarantee, or the guarantee
    /// was withdrawn while its assumptions were true. A command over the limit ends the guarantee
    /// in the same tick, so that only the withdrawal shows it.
    pub fn defective(&self) -> bool {
        self.assumed && (self.broken || self.withdrawn.is_some()) || self.lost
    }
}

impl Flight {
    /// Returns the flight from the start of Chai 2022 along its reference, without disturbance or
    /// errors.
    pub fn new(settings: &Settings) -> Self {
        let scenario = Scenario::crmpc2022();
        Self {
            settings: *settings,
            inertia_scale: 1.0,
            tensor_error: Matrix3::zeros(),
            angles: scenario.initial_angles,
            rates: scenario.initial_rates,
            reference: scenario.reference,
            reference_start: 0.0,
            disturbance: Waveform::Constant(Vector3::zeros()),
            hold: 0.04,
            sight: Sight::Exact,
            slow: None,
            age: 0.0,
            late: 0.0,
            scheduled: |_, _| Scheduled::default(),
            fault: Fault::None,
            seed: 0,
            duration: scenario.duration,
        }
    }
}

/// Asserts that the guarantee is in force in these flights from the instant at which the first
/// command acts, and that it holds. Returns their results.
pub fn assert_kept(name: &str, flights: &[Flight]) -> Vec<Shown> {
    let shown = in_parallel(flights, Flight::fly);
    for (flight, shown) in flights.iter().zip(&shown) {
        let Flight { disturbance, sight, slow, settings, duration, .. } = flight;
        let before = (settings.delay / settings.period_feedback).ceil() * settings.period_feedback;
        let is_whole = (shown.in_force - (1.0 - before / duration)).abs() < 1e-12;
        assert!(
            shown.assumed && !shown.defective() && is_whole,
            "{name}, {disturbance:?}, {sight:?}, {slow:?}: {shown:?}"
        );
    }
    shown
}

impl Flight {
    /// Returns the vehicle's inertia if this is the one of the controller, kg m².
    fn inertia(&self, inertia: &Matrix3<f64>) -> Matrix3<f64> {
        if self.tensor_error == Matrix3::zeros() {
            return inertia * self.inertia_scale;
        }
        let mut root = inertia.symmetric_eigen();
        root.eigenvalues.apply(|value| *value = value.sqrt());
        let root = root.recompose();
        let inertia = root * (Matrix3::identity() + self.tensor_error) * root * self.inertia_scale;
        0.5 * (inertia + inertia.transpose())
    }

    /// Runs the flight and returns its results.
    pub fn fly(&self) -> Shown {
        self.fly_seen(|_, _, _, _| {})
    }

    /// Runs the flight; `observe` receives memory, tick, measurement and reference after each
    /// update.
    pub fn fly_seen(
        &self,
        mut observe: impl FnMut(&Memory, u64, &Measurement, &Reference),
    ) -> Shown {
        let s = &self.settings;
        let law = Crmpc::new(*s).unwrap();
        let latency = Latency { measurement: self.age, action: s.delay - self.age };
        let Settings { body, period_feedback: period, limit_moment, .. } = *s;
        let mut controller = Delayed::new(law, body, period, latency, limit_moment).unwrap();
        let mut memory = controller.memory();
        let mut vehicle = Vehicle::new(self);
        let mut disturbance = Progress::new(&self.disturbance, self.seed);
        let mut eyes = Eyes::new(self);
        let mut faulty = Faulty::new(self.fault, self.seed);
        let reference = |time: f64| self.reference.at(self.reference_start + time);
        let (ticks, checks) =
            ((self.duration / period).round() as u64, (period / CHECK).round() as u64);
        let holds = (self.hold / CHECK).round() as u64;
        let (mut shown, mut error, mut in_force, mut before) = (Shown::default(), 0.0, 0, false);
        let mut delta = Vector3::zeros();
        for tick in 0..ticks {
            let time = tick as f64 * period;
            let scheduled = (self.scheduled)(s, time);
            let measured = faulty.measured(time, eyes.look(time, &vehicle));
            let measured = Measurement { scheduled, ..measured };
            let off = vehicle.angles() - reference(time).angles;
            error += off.norm_squared();
            shown.lost |= off.norm() > LOST;
            let moment = controller.update(&mut memory, tick, time, &measured, &reference);
            vehicle.command(time, faulty.moment(tick, time, moment));
            observe(&memory.inner, tick, &measured, &reference(time));
            let now = memory.inner.supervision.status == GuaranteeStatus::InForce;
            if before && !now && shown.withdrawn.is_none() {
                shown.withdrawn = Some(time);
            }
            before = now;
            in_force += u64::from(now);
            if now {
                let limit = s.limit_moment.min(scheduled.limit_moment);
                shown.moment = shown.moment.max(moment.norm() / limit);
            }
            let mut is_over = false;
            for i in 0..checks {
                let at = |i: u64| time + i as f64 * CHECK;
                let check = tick * checks + i;
                if check % holds == 0 {
                    let bound = (self.scheduled)(s, at(i)).disturbance_bound;
                    let size = s.disturbance_bound.min(bound) * faulty.of_disturbance(at(i));
                    delta = disturbance.at(at(i), &vehicle) * size;
                }
                let fine = |j: u32| at(i) + f64::from(j) * (CHECK / f64::from(FINE));
                for j in 0..FINE {
                    vehicle.advance(fine(j), fine(j + 1), &delta);
                    let rate = vehicle.rates().norm() / s.limit_rate;
                    let seen = now && !faulty.is_unseen(time, self.age);
                    is_over |= seen && rate > 1.0 + SLACK;
                    if seen && rate > shown.rate {
                        (shown.rate, shown.rate_time) = (rate, fine(j + 1));
                    }
                    if now {
                        let sideslip =
                            vehicle.angles().y.abs() / (s.sideslip_domain + s.slow_angle_error);
                        shown.sideslip = shown.sideslip.max(sideslip);
                    }
                }
                eyes.sample(at(i + 1), &vehicle);
            }
            shown.ticks_over += u32::from(is_over);
        }
        let largest = shown.rate.max(shown.moment).max(shown.sideslip);
        shown.broken = largest > 1.0 + SLACK;
        Shown {
            fallbacks: memory.inner.report.fallbacks,
            in_force: in_force as f64 / ticks as f64,
            ems_deg: (error / ticks as f64).sqrt().to_degrees(),
            errors: eyes.largest,
            assumed: eyes.within_bounds()
                && self.slow.as_ref().is_none_or(|slow| slow.is_assumed(s)),
            ..shown
        }
    }
}
