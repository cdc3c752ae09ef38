//! Entry flight of the plant: the motion of the centre of mass and the attitude move together.

use super::equations::{self, Load};
use super::{Held, Input, Plant};
use crate::actuators::Conditions;
use crate::air::{self, AlongTheWay};
use crate::entry::{self, Motion, Passage, great_circle};
use crate::error::Error;
use crate::integrator::rk4;
use crate::kinematics::{Sines, sines};
use crate::math::sin;
use crate::state::{State, angles, rates, state};
use crate::trajectory::Trajectory;
use nalgebra::{SVector, Vector3};

/// Motion of the centre of mass and attitude with its rates, as one state.
type Joint = SVector<f64, 12>;

/// Times of an integration step: the instant of the deflections, the beginning of the step, and its
/// length, s.
pub(super) type Step = (f64, f64, f64);

/// The entry flight at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Entering {
    /// Effect of the air on the vehicle.
    pub passage: Passage,
    /// Time derivative of the motion.
    pub derivative: Motion,
    /// The trajectory's angles and rates.
    pub trajectory: Trajectory,
    /// Turn rate of the trajectory's axes, rad/s.
    pub turn_rate: Vector3<f64>,
    /// Sines and cosines of the attitude angles.
    pub(super) sines: Sines,
}

impl Entering {
    fn new(
        entry: &entry::Config,
        motion: &Motion,
        angles: &Vector3<f64>,
        air: &air::Conditions,
    ) -> Self {
        let sines = sines(angles);
        let passage = entry.passage_through(air, motion, (angles, &sines));
        let (derivative, trajectory, turn_rate) = entry.derivative(motion, &passage);
        Self { passage, derivative, trajectory, turn_rate, sines }
    }
}

fn joint(motion: &Motion, state: &State) -> Joint {
    let mut joint = Joint::zeros();
    joint.fixed_rows_mut::<6>(0).copy_from(motion);
    joint.fixed_rows_mut::<6>(6).copy_from(state);
    joint
}

fn parts(joint: &Joint) -> (Motion, State) {
    (joint.fixed_rows::<6>(0).into(), joint.fixed_rows::<6>(6).into())
}

impl Plant {
    /// Returns the entry flight at `time` (s), or `None` if there is none.
    pub fn entering(&self, time: f64) -> Option<Entering> {
        let entry = self.entry.as_ref()?;
        let air = entry.air.at(time, self.motion[0]);
        Some(Entering::new(entry, &self.motion, &self.angles(), &air))
    }

    /// Moment of the air about the body axes (N m), without that of the surfaces.
    pub fn air_moment(&self, entering: &Entering, input: &Input) -> Vector3<f64> {
        let moment =
            |entry: &entry::Config| entry.moment(&entering.passage, &self.rates(), input.trim);
        self.entry.as_deref().map_or_else(Vector3::zeros, moment)
    }

    /// Heat flux into the leading edge, W/m².
    pub fn heat_flux(&self, entering: &Entering) -> f64 {
        self.entry.as_ref().map_or(0.0, |entry| entry.heat_flux(&entering.passage))
    }

    /// Distance over ground from the start, m.
    pub fn range(&self) -> f64 {
        let here = [self.motion[1], self.motion[2]];
        self.entry.as_ref().map_or(0.0, |entry| great_circle(&entry.planet, self.origin, here).0)
    }

    /// Flow past the surfaces, if there are any.
    pub(super) fn conditions(&self, time: f64) -> Conditions {
        match (&self.entry, &self.actuators) {
            (Some(entry), Some(_)) => {
                entry.passage(time, &self.motion, &self.angles()).conditions()
            }
            _ => Conditions::Fixed(self.state[0]),
        }
    }

    /// Derivative of the attitude and the rates at the first time (s), which is the second one (s)
    /// after the instant of the deflections.
    #[inline]
    pub(super) fn turned(
        &self,
        entry: &entry::Config,
        entering: &Entering,
        (time, elapsed): (f64, f64),
        attitude: &State,
        (input, held): (&Input, &Held),
    ) -> State {
        let Entering { passage, turn_rate, sines, .. } = entering;
        let rates = rates(attitude);
        if entry.following.active {
            let (matrix, _) = self.kinematics.r_and_inverse(sines);
            let acceleration = entry.prescribed_acceleration(
                self.kinematics,
                &input.prescribed,
                (&angles(attitude), &rates),
                turn_rate,
            );
            let angle_rates =
                equations::angle_rates(self.kinematics, &matrix, (sines, &rates), turn_rate);
            return state(&angle_rates, &acceleration);
        }
        let conditions = (elapsed, passage.conditions());
        let load = Load {
            moment: self.control_moment(input, held.delayed, &held.drive, conditions)
                + self.disturbance_moment(time, input, held)
                + entry.moment(passage, &rates, input.trim),
            delta: held.delta(),
            turn_rate: *turn_rate,
        };
        equations::derivative_at(&self.body, self.kinematics, sines, &rates, &load)
    }

    /// Returns motion and attitude after an integration step.
    pub(super) fn moved(
        &self,
        entry: &entry::Config,
        (since, begin, h): Step,
        air: &AlongTheWay,
        held: &Held,
        input: &mut impl FnMut(f64) -> Input,
    ) -> (Motion, State) {
        let mut f = |t: f64, both: &Joint| {
            let (motion, attitude) = parts(both);
            let conditions = entry.air.deviating(t, motion[0], &air.at(motion[0]));
            let entering = Entering::new(entry, &motion, &angles(&attitude), &conditions);
            let turned =
                self.turned(entry, &entering, (t, t - since), &attitude, (&input(t), held));
            joint(&entering.derivative, &turned)
        };
        parts(&rk4(&mut f, begin, &joint(&self.motion, &self.state), h))
    }

    /// Standard atmosphere along the path of an entry flight over `length` (s).
    pub(super) fn air_ahead(&self, length: f64) -> AlongTheWay {
        AlongTheWay::new(self.motion[0], self.motion[3] * sin(self.motion[4]) * length)
    }

    /// Checks that the equations of an entry flight hold at a motion.
    ///
    /// # Errors
    /// Reports a motion without a course.
    pub fn check_motion(&self, motion: &Motion, time: f64) -> Result<(), Error> {
        self.entry.as_ref().map_or(Ok(()), |_| entry::check(motion, time))
    }

    /// Whether an entry flight with this motion has ended.
    pub(super) fn has_ended_at(&self, motion: &Motion) -> bool {
        self.entry
            .as_ref()
            .is_some_and(|entry| entry.margins(motion).iter().any(|margin| *margin <= 0.0))
    }

    /// Time at which the entry flight ended, s.
    pub fn ended(&self) -> Option<f64> {
        self.ended
    }

    /// How far an entry flight is from its end: altitude (m) and speed (m/s).
    pub fn margins(&self) -> Option<[f64; 2]> {
        Some(self.entry.as_ref()?.margins(&self.motion))
    }

    /// Moves the plant to the end of its flight, which lies within an integration step.
    pub(super) fn end(
        &mut self,
        (since, begin, h): Step,
        air: &AlongTheWay,
        held: &Held,
        input: &mut impl FnMut(f64) -> Input,
    ) {
        let Some(entry) = &self.entry else { return };
        // The end lies between these lengths of the step.
        let (mut before, mut after) = (0.0, h);
        while after - before > 1e-9 * h {
            let middle = 0.5 * (before + after);
            let (motion, _) = self.moved(entry, (since, begin, middle), air, held, input);
            let is_over = entry.margins(&motion).iter().any(|margin| *margin <= 0.0);
            if is_over { after = middle } else { before = middle }
        }
        (self.motion, self.state) = self.moved(entry, (since, begin, after), air, held, input);
        let end = begin + after;
        self.deflections += self.deflection_rates(held) * (end - since);
        self.settle(end, held);
        self.ended = Some(end);
    }
}
