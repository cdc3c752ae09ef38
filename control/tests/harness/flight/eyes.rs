//! Measurements that the controller receives of the vehicle.

use super::super::{CHECK, platform};
use super::moving::Vehicle;
use super::slow::SlowErrors;
use super::waveform::Progress;
use super::{Flight, SLACK, Sight};
use control::Measurement;
use control::crmpc::{Memory, Settings};
use control::estimation::{self, Alignment, Estimator, mems_corrections};
use nalgebra::Vector3;
use vehicle::kinematics;
use vehicle::sensors::Sensors;

/// The source of the measurements.
pub(super) struct Eyes {
    errors: Option<Progress>,
    slow: Option<SlowErrors>,
    /// Bounds on the errors of angles (rad) and rates (rad/s).
    bounds: (f64, f64),
    estimation: Option<(Sensors, Estimator, estimation::Memory)>,
    pub(super) largest: (f64, f64),
    /// Angles and rates at the checks since the instant to which a present measurement refers;
    /// empty if that is the present.
    past: Vec<(Vector3<f64>, Vector3<f64>)>,
}

impl Eyes {
    pub(super) fn new(flight: &Flight) -> Self {
        let Settings { angle_error, rate_error, .. } = flight.settings;
        let errors = match &flight.sight {
            Sight::Errors(waveform) => {
                Some(Progress::new(waveform, flight.seed.wrapping_add(1 << 32)))
            }
            Sight::Exact | Sight::Estimator(_) => None,
        };
        let estimation = match flight.sight {
            Sight::Estimator(seed) => {
                let settings = estimation::Settings {
                    corrections: mems_corrections(),
                    alignment: Alignment::Given,
                    initial: flight.angles,
                    prediction: flight.age == 0.0,
                    ..estimation::Settings::ours()
                };
                let estimator = Estimator::new(settings).unwrap();
                let memory = estimator.memory();
                Some((Sensors::new(&platform::mems(seed), 0.0).unwrap(), estimator, memory))
            }
            Sight::Exact | Sight::Errors(_) => None,
        };
        let mut eyes = Self {
            errors,
            slow: flight.slow.as_ref().map(|slow| SlowErrors::new(slow, flight.seed)),
            bounds: (angle_error, rate_error),
            estimation,
            largest: (0.0, 0.0),
            past: Vec::new(),
        };
        let (vehicle, steps) = (Vehicle::new(flight), (flight.age / CHECK).round() as usize);
        if steps > 0 {
            eyes.past = vec![(vehicle.angles(), vehicle.rates()); steps + 1];
        }
        eyes.sample(0.0, &vehicle);
        eyes
    }

    /// Returns the angles and rates to which a present measurement refers.
    fn past(&self, vehicle: &Vehicle) -> (Vector3<f64>, Vector3<f64>) {
        self.past.first().copied().unwrap_or_else(|| (vehicle.angles(), vehicle.rates()))
    }

    /// Takes a sample of the sensors.
    pub(super) fn sample(&mut self, time: f64, vehicle: &Vehicle) {
        if !self.past.is_empty() {
            self.past.remove(0);
            self.past.push((vehicle.angles(), vehicle.rates()));
        }
        if let Some((sensors, estimator, memory)) = &mut self.estimation {
            let truth = platform::Truth { time, angles: vehicle.angles(), rates: vehicle.rates() };
            sensors.take(time, &platform::felt(&truth));
            let sample = sensors.arrived();
            let line = estimation::Line {
                sample: sample.number,
                time: sample.time,
                readings: sample.readings,
            };
            estimator.update(memory, time, &line);
        }
    }

    /// Returns the controller's measurement at a tick.
    pub(super) fn look(&mut self, time: f64, vehicle: &Vehicle) -> Measurement {
        let (mut angles, rates) = self.past(vehicle);
        if let Some(slow) = &mut self.slow {
            angles += slow.at(time, vehicle);
        }
        let angle_rates = kinematics::r(&angles) * rates;
        let (angle_bound, rate_bound) = self.bounds;
        let mut measured = Measurement { angles, rates, ..Measurement::default() };
        if let Some(errors) = &mut self.errors {
            let error = errors.at(time, vehicle);
            measured.angles = angles + error * angle_bound;
            measured.rates =
                kinematics::r_inverse(&measured.angles) * (angle_rates + error * rate_bound);
        }
        if let Some((_, _, memory)) = &self.estimation {
            measured.angles = memory.estimate.angles;
            measured.rates = memory.estimate.rates;
        }
        let of_rates = kinematics::r(&measured.angles) * measured.rates - angle_rates;
        let (angle, rate) = &mut self.largest;
        let of_angles = measured.angles - angles;
        *angle = angle.max(of_angles.amax());
        *rate = rate.max(of_rates.amax());
        measured
    }

    /// Returns whether the errors have stayed within the bounds of the settings.
    pub(super) fn within_bounds(&self) -> bool {
        let (angle, rate) = self.bounds;
        let within = |value: f64, bound: f64| value <= bound * (1.0 + SLACK) + 1e-12;
        within(self.largest.0, angle) && within(self.largest.1, rate)
    }
}
