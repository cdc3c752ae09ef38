//! Quantities that the plant holds from one event to the next: the disturbance, the motion of the
//! actuators, and a delayed moment.

use super::{Input, Plant};
use crate::actuators::{Actuators, Command, Drive};
use crate::disturbance::{DisturbanceKind, View};
use crate::effectors::Surfaces;
use crate::noise::Stream;
use crate::time::tolerance;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Quantities that are held for a while. The disturbance is held from one tick or change of its
/// waveform to the next, and the motion of the actuators until commands are taken or a deflection
/// comes to rest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Held {
    /// Number of the interval over which the disturbance is held.
    tick: i64,
    /// Time at which the disturbance was drawn, s.
    pub(super) since: f64,
    /// Value of Δ drawn at the beginning of the interval, rad/s².
    sample: Vector3<f64>,
    /// Whether the disturbance acts at present.
    pub(super) acts: bool,
    /// Present motion of the actuators.
    pub(super) drive: Drive,
    /// Moment that acts at present if the input moment is delayed, N m.
    pub(super) delayed: Option<Vector3<f64>>,
}

impl Held {
    /// Disturbance Δ that acts at present, rad/s².
    pub fn delta(&self) -> Vector3<f64> {
        if self.acts { self.sample } else { Vector3::zeros() }
    }
}

impl Plant {
    /// Next time (s) after `time` at which the disturbance jumps, a sample is taken or arrives, or a
    /// surface or a jet fails.
    pub fn next_event(&self, time: f64) -> Option<f64> {
        let jump = self.disturbance.next_change(self.start_time, time);
        let sample = self.sensors.as_ref().map(|sensors| sensors.next_event(time));
        jump.into_iter().chain(sample).chain(self.next_fault(time)).min_by(f64::total_cmp)
    }

    /// Time (s) until each deflection comes to rest, infinite for one that is at rest.
    pub fn time_left(&self, held: &Held) -> Surfaces {
        self.actuators.as_ref().map_or(Surfaces::repeat(f64::INFINITY), |actuators| {
            actuators.time_left(&held.drive, &self.deflections)
        })
    }

    /// Next time (s) after `time` at which the right side may not be smooth or a sample is taken.
    pub(super) fn next_change(&self, time: f64, held: &Held) -> Option<f64> {
        let jump = self.disturbance.next_change(self.start_time, time);
        let rest = self.actuators.is_some().then(|| time + self.time_left(held).min());
        let sample = self.sensors.as_ref().map(|sensors| sensors.next_sample(time));
        let arrival = self.transport.as_ref().and_then(|transport| transport.next_arrival(time));
        let fault = self.next_fault(time);
        jump.into_iter()
            .chain(rest)
            .chain(sample)
            .chain(arrival)
            .chain(fault)
            .min_by(f64::total_cmp)
    }

    fn next_fault(&self, time: f64) -> Option<f64> {
        self.actuators.as_ref().and_then(|actuators| actuators.next_fault(time))
    }

    /// Returns the quantities that hold from `time` (s) on if commands are taken then. If a tick
    /// has come, the disturbance is drawn from the present state and `input`, each time anew at the
    /// same tick; otherwise the one already held stays.
    pub fn in_force(&self, time: f64, input: &Input, command: &Command) -> Held {
        let commanded =
            |actuators: &Actuators| actuators.commanded(time, command, &self.deflections);
        self.drawn(time, input, self.actuators.as_ref().map_or_else(Drive::default, commanded))
    }

    pub(super) fn drawn(&self, time: f64, input: &Input, drive: Drive) -> Held {
        let tick = self.disturbance.tick(self.start_time, time);
        let acts = self.disturbance.acts(time);
        let delayed = self.transport.as_ref().map(|transport| transport.moment(time));
        match self.held {
            Some(held) if held.tick == tick && time > held.since + tolerance(time) => {
                Held { acts, drive, delayed, ..held }
            }
            _ => {
                let (angles, rates) = (self.angles(), self.rates());
                let conditions = self.conditions(time);
                let moment = self.control_moment(input, delayed, &drive, (0.0, conditions));
                let view = View {
                    body: &self.body,
                    kinematics: self.kinematics,
                    angles,
                    rates,
                    moment,
                    noise: self.noise.as_ref(),
                };
                Held {
                    tick,
                    since: time,
                    sample: self.disturbance.sample(tick, &view),
                    acts,
                    drive,
                    delayed,
                }
            }
        }
    }

    /// Adopts the result of [`Plant::in_force`]: commands hold until they are taken again, and the
    /// disturbance until the next tick. Deflections that have reached or just passed their target
    /// are set to it, and a sample that is due is taken.
    pub fn hold(&mut self, time: f64, input: &Input, command: &Command) -> Held {
        self.sense(time, input);
        if let Some(held) = self.held {
            self.settle(time, &held);
        }
        let held = self.in_force(time, input, command);
        self.settle(time, &held);
        self.adopt(&held)
    }

    /// Does the work of [`Plant::hold`] between two communication points, where no commands are
    /// taken.
    pub(super) fn hold_between(&mut self, time: f64, input: &Input, before: &Held) -> Held {
        self.sense(time, input);
        let directed =
            |actuators: &Actuators| actuators.directed(time, before.drive, &self.deflections);
        let drive = self.actuators.as_ref().map_or_else(Drive::default, directed);
        self.adopt(&self.drawn(time, input, drive))
    }

    pub(super) fn adopt(&mut self, held: &Held) -> Held {
        if self.disturbance.kind == DisturbanceKind::White {
            let seed = self.disturbance.seed;
            self.noise.get_or_insert_with(|| Stream::new(seed)).move_to(held.tick);
        }
        *self.held.insert(*held)
    }

    pub(super) fn settle(&mut self, time: f64, held: &Held) {
        if let Some(actuators) = &self.actuators {
            actuators.settle(time, &held.drive, &mut self.deflections);
        }
    }

    /// Quantities that are held at present, or `None` before the first call of [`Plant::hold`].
    pub fn held(&self) -> Option<Held> {
        self.held
    }
}
