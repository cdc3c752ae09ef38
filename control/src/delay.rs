//! Compensation of a known delay between a measurement and the resulting moment, by prediction.
//!
//! A measurement may also be old when it arrives, because of a filter's delay. The state is then
//! predicted over both delays, and the law is evaluated for the time at which its moment acts.
//!
//! The command of the tick at time t acts over [t + delay, t + delay + period). The moments that
//! act on the vehicle before, over [t, t + delay), were commanded earlier and are known. The state
//! at t + delay can therefore be computed from the measured one by the nominal equations of motion,
//! and the law is evaluated for that state and that time. Without disturbances and with the right
//! inertia the loop then behaves as it would without delay, only later by the delay.
//!
//! This is the prediction of the Smith predictor for a model in state-space form, as in Z.
//! Artstein, "Linear systems with delayed controls: a reduction", IEEE Transactions on Automatic
//! Control 27 (1982), with the nonlinear equations of motion in place of the linear ones.

use crate::clone_in_place::clone_in_place;
use crate::consistency::Consistency;
use crate::controller::{Controller, Doubt, Measurement, ReferenceAt};
use crate::delay_estimate::{LoopDelay, LoopDelaySettings};
use crate::error::{DesignError, invalid};
use crate::turns::{Turns, turned_reference};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use settings::Declared;
use vehicle::dynamics::RigidBody;
use vehicle::integrator::{equal_steps, rk4};
use vehicle::kinematics::Kinematics;
use vehicle::plant::{self, Load};
use vehicle::time::TOLERANCE;

/// Longest delay that is accepted, s.
pub const LONGEST: f64 = 1.0;
/// Largest number of commands that can be under way at a time. Each is one step of the prediction
/// (0.1 µs) at every tick, which takes half of the shortest period.
pub const UNDER_WAY: usize = 500;
/// Longest integration step of the prediction, s.
const STEP: f64 = 0.01;

/// The parts of the time from the instant of a measurement to the moment that results from it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Latency {
    /// Time from a tick until the resulting moment acts on the vehicle; the law uses the state
    /// predicted over this time.
    #[setting(name = "delay", unit = "s", min = 0.0, max = LONGEST, nominal = 0.1)]
    pub action: f64,
    /// Age of a measurement when it arrives, for example because of an estimator's filter; the law
    /// uses the state predicted over this time.
    #[setting(name = "measurement.age", unit = "s", min = 0.0, max = LONGEST, nominal = 0.1)]
    pub measurement: f64,
}

impl Latency {
    /// Returns the sum of both parts, s.
    pub fn total(&self) -> f64 {
        self.measurement + self.action
    }
}

/// Returns the number of ticks that begin within a delay (s).
pub fn ticks(delay: f64, period: f64) -> usize {
    // A whole multiple of the period may be inexact by rounding.
    (delay / period * (1.0 - TOLERANCE)).ceil() as usize
}

/// Computes the state after the delay from the measured state and the moments that act until then.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Predictor {
    body: RigidBody,
    delay: f64,
    period: f64,
    count: usize,
}

impl Predictor {
    /// Sets up the prediction with `body` as model of the vehicle, for commands every `period` (s)
    /// that act after `delay` (s, any number).
    ///
    /// # Errors
    /// Returns an error for a delay that is negative, or longer than [`LONGEST`] or than
    /// [`UNDER_WAY`] periods.
    pub fn new(body: RigidBody, delay: f64, period: f64) -> Result<Self, DesignError> {
        let longest = LONGEST.min(UNDER_WAY as f64 * period);
        if !(0.0..=longest).contains(&delay) {
            return Err(DesignError::Delay { value: delay, longest });
        }
        Ok(Self { body, delay, period, count: ticks(delay, period) })
    }

    /// Returns the state after the delay. `under_way` ends with the moments that were commanded
    /// before this tick and act within the delay, oldest first, N m. Before the first of them only
    /// the known moment acts. The achieved moment is passed on unchanged.
    pub fn predict(&self, under_way: &[Vector3<f64>], measured: &Measurement) -> Measurement {
        let mut state = plant::state(&measured.angles, &measured.rates);
        for age in (1..=self.count).rev() {
            let index = under_way.len().checked_sub(age);
            let moment = index.map_or(measured.known_moment, |i| under_way[i]);
            let load = Load { moment, ..Load::default() };
            // The newest command, of age 1, acts for the last period of the delay.
            let begin = (self.delay - age as f64 * self.period).max(0.0);
            let end = self.delay - (age - 1) as f64 * self.period;
            let mut f = |_: f64, state: &plant::State| {
                plant::derivative(&self.body, Kinematics::Printed, state, &load)
            };
            let steps = equal_steps(end - begin, STEP);
            let h = (end - begin) / steps as f64;
            for k in 0..steps {
                state = rk4(&mut f, k as f64 * h, &state, h);
            }
        }
        Measurement { angles: plant::angles(&state), rates: plant::rates(&state), ..*measured }
    }
}

/// The state that a controller with prediction carries from tick to tick.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Memory<M> {
    /// Memory of the law behind the prediction.
    pub inner: M,
    /// Moments whose action has not ended yet, oldest first, N m: those that were commanded, and
    /// the known moment until enough ticks have passed. Empty before the first tick.
    pub under_way: Vec<Vector3<f64>>,
    /// Estimate of the actual delay of the loop.
    pub loop_delay: LoopDelay,
    /// Turns of the measured angles and of the reference.
    pub turns: Turns,
    /// Consistency of the measurements with each other.
    pub consistency: Consistency,
}

clone_in_place!([M: Clone + Default] Memory<M> { inner, under_way, loop_delay });

/// A controller whose moments act later than its measurements by a known delay. It evaluates the
/// law behind it for the predicted state and for the time at which the moment acts. Without delay
/// it equals that law bit for bit.
#[derive(Clone, Debug, PartialEq)]
pub struct Delayed<C> {
    inner: C,
    predictor: Predictor,
    latency: Latency,
    loop_delay: LoopDelaySettings,
    moment_limit: f64,
}

impl<C: Controller> Delayed<C> {
    /// Puts a delay and a limit around `inner`, which is evaluated every `period` (s). `body` is
    /// the model of the vehicle. `moment_limit` (N m, infinite for none) is the limit into which
    /// commands are scaled; law and prediction know the scaled commands.
    ///
    /// # Errors
    /// Returns the errors of [`Predictor::new`], and errors for a negative part of the latency and
    /// for a limit that is not positive.
    pub fn new(
        inner: C,
        body: RigidBody,
        period: f64,
        latency: Latency,
        moment_limit: f64,
    ) -> Result<Self, DesignError> {
        if moment_limit.is_nan() || moment_limit <= 0.0 {
            return Err(invalid("limit.moment", moment_limit, "must be positive"));
        }
        let Latency { measurement, action } = latency;
        if !(0.0..=LONGEST).contains(&measurement) {
            let problem = format!("must be at least 0 and at most {LONGEST}");
            return Err(invalid("measurement.age", measurement, problem));
        }
        if !(0.0..=LONGEST).contains(&action) {
            return Err(DesignError::Delay { value: action, longest: LONGEST });
        }
        let predictor = Predictor::new(body, latency.total(), period)?;
        let loop_delay = LoopDelaySettings {
            body,
            period,
            declared: latency.total(),
            explained: inner.explained(),
            is_filtered: measurement > 0.0,
        };
        Ok(Self { inner, predictor, latency, loop_delay, moment_limit })
    }

    /// Returns the time from a tick until its command acts, s.
    pub fn acts_after(&self) -> f64 {
        self.latency.action
    }

    /// Returns the estimated delay of the loop, s; the declared one as long as the measurements do
    /// not show it.
    pub fn estimated_delay(&self, memory: &Memory<C::Memory>) -> f64 {
        memory.loop_delay.estimate.unwrap_or(self.loop_delay.declared)
    }

    /// Returns the law behind the prediction.
    pub fn inner(&self) -> &C {
        &self.inner
    }

    /// Returns the predictor of the state on which the law acts.
    pub fn predictor(&self) -> &Predictor {
        &self.predictor
    }
}

impl<C: Controller> Controller for Delayed<C> {
    type Memory = Memory<C::Memory>;

    fn memory(&self) -> Self::Memory {
        Memory {
            inner: self.inner.memory(),
            under_way: Vec::with_capacity(self.predictor.count),
            loop_delay: self.loop_delay.memory(),
            turns: Turns::default(),
            consistency: Consistency::default(),
        }
    }

    fn fits(&self, memory: &Self::Memory) -> bool {
        [0, self.predictor.count].contains(&memory.under_way.len())
            && self.loop_delay.fits(&memory.loop_delay)
            && memory.turns.fits()
            && self.inner.fits(&memory.inner)
    }

    fn command(
        &mut self,
        memory: &mut Self::Memory,
        tick: u64,
        time: f64,
        measured: &Measurement,
        reference: ReferenceAt,
    ) -> Vector3<f64> {
        let Memory { inner, under_way, loop_delay, turns, consistency } = memory;
        let measured = turns.continued(measured);
        self.loop_delay.observe(loop_delay, &measured);
        let LoopDelaySettings { explained, period, .. } = &self.loop_delay;
        let is_consistent = explained
            .as_ref()
            .is_none_or(|explained| consistency.observe(explained, *period, &measured));
        let doubt = match loop_delay {
            _ if !is_consistent => Some(Doubt::Motion),
            LoopDelay { is_other: true, .. } => Some(Doubt::OtherDelay),
            LoopDelay { is_unexplained: true, .. } => Some(Doubt::Unexplained),
            _ => None,
        };
        let measured = Measurement { doubt, ..measured };
        let measured = self.predictor.predict(under_way, &measured);
        under_way.resize(self.predictor.count, measured.known_moment);
        let time = time + self.latency.action;
        let added = turns.follow(time, &measured.angles, &reference(time));
        let nearest = |time: f64| turned_reference(reference(time), &added);
        let moment = self.inner.command(inner, tick, time, &measured, &nearest);
        self.loop_delay.remember(loop_delay, &moment);
        under_way.rotate_left(self.predictor.count.min(1));
        if let Some(newest) = under_way.last_mut() {
            *newest = moment;
        }
        moment
    }

    fn limit(&self, memory: &Self::Memory) -> f64 {
        self.moment_limit.min(self.inner.limit(&memory.inner))
    }

    fn limited(&mut self, memory: &mut Self::Memory, applied: &Vector3<f64>) {
        if let Some(newest) = memory.under_way.last_mut() {
            *newest = *applied;
        }
        self.loop_delay.limit(&mut memory.loop_delay, applied);
        self.inner.limited(&mut memory.inner, applied);
    }
}
