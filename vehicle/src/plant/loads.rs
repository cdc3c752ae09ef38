//! Inputs of the plant, and the moments and derivatives that follow from them.

use super::equations::{self, Load};
use super::{Entering, Held, Plant};
use crate::actuators::{Conditions, Drive};
use crate::axes::AXES;
use crate::effectors::Surfaces;
use crate::entry::Prescribed;
use crate::state::State;
use crate::trajectory::Trajectory;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use settings::Declared;

/// Continuous inputs of the plant. Commands to the actuators are taken at instants and are
/// therefore not among them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Input {
    /// Control moment about the {}.
    ///
    /// It acts at once unless there are actuators or a transport delay.
    #[setting(each = AXES, unit = "N.m", nominal = 1e5, used_with = "actuation = moment")]
    pub moment: Vector3<f64>,
    /// External disturbance moment about the {}.
    #[setting(each = AXES, unit = "N.m", nominal = 1e4)]
    pub disturbance_moment: Vector3<f64>,
    /// Trajectory of the vehicle, which turns the axes from which the angles are counted. During
    /// an entry flight the plant computes it.
    #[setting(used_with = "translation = given")]
    pub trajectory: Trajectory,
    /// Attitude that a prescribed attitude follows.
    #[setting(used_with = "translation = entry and prescribed.active = true")]
    pub prescribed: Prescribed,
    /// Angle of attack at which the vehicle is trimmed.
    #[setting(name = "trim.alpha", unit = "rad", nominal = 0.1)]
    #[setting(used_with = "translation = entry and aerodynamics.trim = input")]
    pub trim: f64,
}

impl Input {
    /// Returns the name of the input that holds a value that is not finite.
    pub(super) fn fault(&self) -> Option<&'static str> {
        let broken = |values: &[f64]| values.iter().any(|value| !value.is_finite());
        if broken(self.moment.as_slice()) || broken(self.disturbance_moment.as_slice()) {
            return Some("moment");
        }
        let Prescribed { angles, rates } = &self.prescribed;
        if broken(angles.as_slice()) || broken(rates.as_slice()) || !self.trim.is_finite() {
            return Some("prescribed attitude or trim");
        }
        broken(&self.trajectory.values()).then_some("trajectory")
    }
}

impl From<Vector3<f64>> for Input {
    /// Returns an input with this control moment (N m) and nothing else.
    fn from(moment: Vector3<f64>) -> Self {
        Self { moment, ..Self::default() }
    }
}

impl Plant {
    /// Disturbing moment (N m) at `time` (s): the sum of the external moment and that of the
    /// disturbance.
    #[inline]
    pub fn disturbance_moment(&self, time: f64, input: &Input, held: &Held) -> Vector3<f64> {
        let disturbance_moment =
            if held.acts { self.disturbance.moment(time) } else { Vector3::zeros() };
        input.disturbance_moment + disturbance_moment
    }

    /// Disturbance of the angles' second time derivatives (rad/s²): Δ and the effect R I⁻¹ m of all
    /// moments m (N m) that are not the control moment.
    pub fn total_disturbance(&self, moment: &Vector3<f64>, held: &Held) -> Vector3<f64> {
        held.delta() + self.kinematics.r(&self.angles()) * (self.body.inverse * moment)
    }

    /// Control moment (N m) at the time `elapsed` (s) after the present one, provided that the
    /// drive does not change until then.
    #[inline]
    pub(super) fn control_moment(
        &self,
        input: &Input,
        delayed: Option<Vector3<f64>>,
        drive: &Drive,
        (elapsed, conditions): (f64, Conditions),
    ) -> Vector3<f64> {
        self.actuators.as_ref().map_or_else(
            || self.converted(&delayed.unwrap_or(input.moment)),
            |actuators| {
                let deflections = self.deflections + actuators.rates(drive) * elapsed;
                actuators.moment(drive, &deflections, &conditions)
            },
        )
    }

    /// Moment (N m) behind the converter.
    pub(super) fn converted(&self, moment: &Vector3<f64>) -> Vector3<f64> {
        match self.moment_resolution {
            0.0 => *moment,
            step => moment.map(|component| (component / step).round() * step),
        }
    }

    /// Control moment (N m) that acts at present, during an entry flight if there is one.
    pub fn applied_moment(
        &self,
        entering: Option<&Entering>,
        input: &Input,
        held: &Held,
    ) -> Vector3<f64> {
        let fixed = Conditions::Fixed(self.state[0]);
        let conditions = entering.map_or(fixed, |entering| entering.passage.conditions());
        self.control_moment(input, held.delayed, &held.drive, (0.0, conditions))
    }

    /// Rate of each deflection, rad/s: plus or minus the rate limit, or zero.
    pub fn deflection_rates(&self, held: &Held) -> Surfaces {
        self.actuators
            .as_ref()
            .map_or_else(Surfaces::zeros, |actuators| actuators.rates(&held.drive))
    }

    /// Trajectory: that of the entry flight, or the input. Also its turn rate (rad/s).
    pub(super) fn trajectory(
        &self,
        entering: Option<&Entering>,
        input: &Input,
    ) -> (Trajectory, Vector3<f64>) {
        if let Some(entering) = entering {
            return (entering.trajectory, entering.turn_rate);
        }
        (input.trajectory, input.trajectory.turn_rate(self.earth_rate))
    }

    /// Returns the loads without an entry flight at `time` (s), which is `elapsed` (s) after the
    /// time of the deflections, at an angle of attack (rad).
    pub(super) fn load(
        &self,
        (time, elapsed): (f64, f64),
        alpha: f64,
        input: &Input,
        held: &Held,
    ) -> Load {
        Load {
            moment: self.control_moment(
                input,
                held.delayed,
                &held.drive,
                (elapsed, Conditions::Fixed(alpha)),
            ) + self.disturbance_moment(time, input, held),
            delta: held.delta(),
            turn_rate: self.trajectory(None, input).1,
        }
    }

    /// Derivative of the attitude and the rates at `time` (s) for the present state, during an
    /// entry flight if there is one.
    pub fn derivative(
        &self,
        entering: Option<&Entering>,
        time: f64,
        input: &Input,
        held: &Held,
    ) -> State {
        if let (Some(entry), Some(entering)) = (&self.entry, entering) {
            return self.turned(entry, entering, (time, 0.0), &self.state, (input, held));
        }
        let load = self.load((time, 0.0), self.state[0], input, held);
        equations::derivative(&self.body, self.kinematics, &self.state, &load)
    }
}
