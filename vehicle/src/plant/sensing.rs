//! Measurements of the plant: the readings of ideal sensors and the samples that the sensors
//! output.

use super::equations::angle_rates;
use super::{Entering, Input, Plant};
use crate::fixes::Fixes;
use crate::frames::Place;
use crate::kinematics::sines;
use crate::platform::{Pose, Readings};
use crate::sensors::{Felt, Sample, Sensors};

impl Plant {
    /// Takes the sample that is due at `time` (s), if there is one.
    pub(super) fn sense(&mut self, time: f64, input: &Input) {
        let Some(mut sensors) = self.sensors.take() else { return };
        let entering = self.entering(time);
        let vehicle = self.pose(entering.as_ref(), input);
        sensors.take(time, self.felt_by(&sensors, entering.as_ref(), (time, input), &vehicle));
        if let (Some(turntable), Some(at)) = (&mut self.turntable, sensors.due(time)) {
            turntable.follow(at, &vehicle);
        }
        self.sensors = Some(sensors);
    }

    fn pose(&self, entering: Option<&Entering>, input: &Input) -> Pose {
        let (trajectory, turn_rate) = self.trajectory(entering, input);
        let sines = entering.map_or_else(|| sines(&self.angles()), |entering| entering.sines);
        let (matrix, _) = self.kinematics.r_and_inverse(&sines);
        let angle_rates =
            angle_rates(self.kinematics, &matrix, (&sines, &self.rates()), &turn_rate);
        Pose {
            kinematics: self.kinematics,
            angles: self.angles(),
            rates: self.rates(),
            alpha_rate: angle_rates.x,
            trajectory,
            specific_force: entering.map(|entering| entering.passage.specific_force),
        }
    }

    /// Readings of ideal sensors at `time` (s).
    pub fn felt(&self, time: f64, input: &Input) -> Readings {
        self.pose(self.entering(time).as_ref(), input).felt(&self.surroundings)
    }

    /// Readings without errors that the sampled sensors take at `time` (s): in the pose of the
    /// turntable, if there is one and a sample is due.
    fn felt_by(
        &self,
        sensors: &Sensors,
        entering: Option<&Entering>,
        (time, input): (f64, &Input),
        vehicle: &Pose,
    ) -> Felt {
        let pose = match (&self.turntable, sensors.due(time)) {
            (Some(turntable), Some(at)) => {
                turntable.pose(at, vehicle, &self.trajectory(entering, input).1)
            }
            _ => *vehicle,
        };
        let place = self.entry.as_ref().filter(|_| sensors.due(time).is_some()).map(|entry| {
            let place = Place::of(&entry.planet, &self.motion, &vehicle.angles, time);
            (place, self.motion[0])
        });
        Felt { readings: pose.felt(&self.surroundings), place }
    }

    /// Newest sample that the sensors output at `time` (s), including one that is due then but not
    /// yet taken. Without sampled sensors it holds the readings of ideal ones and the number 0.
    pub fn measured(&self, entering: Option<&Entering>, time: f64, input: &Input) -> Sample {
        let vehicle = self.pose(entering, input);
        let Some(sensors) = &self.sensors else {
            let readings = vehicle.felt(&self.surroundings);
            return Sample { number: 0, time, readings, fixes: Fixes::default() };
        };
        sensors.shown(time, self.felt_by(sensors, entering, (time, input), &vehicle))
    }

    /// Sample that the sensors output at `time` (s) after the last call of [`Plant::hold`].
    pub fn measured_since_held(
        &self,
        entering: Option<&Entering>,
        time: f64,
        input: &Input,
    ) -> Sample {
        let ideal = || self.measured(entering, time, input);
        self.sensors.as_ref().map_or_else(ideal, Sensors::arrived)
    }
}
