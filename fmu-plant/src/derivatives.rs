//! Partial derivatives of the calculated variables.

use crate::plant::{ATTITUDE, MOTION, Output, ReentryPlant};
use crate::roles::{Known, Unknown, role};
use fmi_export::Failure;
use nalgebra::{SMatrix, Vector3};
use settings::{Field, Settings};
use std::sync::LazyLock;

impl ReentryPlant {
    /// Returns the partial derivative at a fixed flight condition, in closed form.
    pub(crate) fn given_derivative(
        &self,
        time: f64,
        unknown: Unknown,
        known: Known,
    ) -> Result<f64, Failure> {
        let plant = self.ready()?;
        let held = self.held(plant, time);
        let (partials, turn_rate_by_trajectory) =
            plant.partial_derivatives(time, &self.input, &held);
        let (applied_by_moment, applied_by_deflections) =
            plant.applied_moment_by_moment_and_deflections();
        // In model exchange, commands are taken at events only.
        let applied_by_jets = if self.event_driven {
            SMatrix::zeros()
        } else {
            plant.applied_moment_by_jets(&self.command)
        };
        let by_applied = |column: Vector3<f64>, i: usize| (partials.by_moment * column)[i];
        Ok(match (unknown, known) {
            (Unknown::Derivative(i @ 0..ATTITUDE), Known::State(j @ 0..ATTITUDE)) => {
                partials.by_state[(i, j)]
            }
            (Unknown::Derivative(i @ 0..ATTITUDE), Known::State(j @ ATTITUDE..MOTION)) => {
                by_applied(applied_by_deflections.column(j - ATTITUDE).into(), i)
            }
            (Unknown::Derivative(i @ 0..ATTITUDE), Known::DisturbanceMoment(j)) => {
                partials.by_moment[(i, j)]
            }
            (Unknown::Derivative(i @ 0..ATTITUDE), Known::Moment(j)) => {
                by_applied(applied_by_moment.column(j).into(), i)
            }
            (Unknown::Derivative(i @ 0..ATTITUDE), Known::Jet(j)) => {
                by_applied(applied_by_jets.column(j).into(), i)
            }
            (Unknown::Derivative(i @ 0..ATTITUDE), Known::Trajectory(j)) => {
                (partials.by_turn_rate * turn_rate_by_trajectory.column(j))[i]
            }
            (Unknown::AppliedMoment(i), Known::Moment(j)) => applied_by_moment[(i, j)],
            (Unknown::AppliedMoment(i), Known::Jet(j)) => applied_by_jets[(i, j)],
            (Unknown::AppliedMoment(i), Known::State(j @ ATTITUDE..MOTION)) => {
                applied_by_deflections[(i, j - ATTITUDE)]
            }
            (Unknown::Measured(i), Known::State(j @ 0..ATTITUDE)) => {
                plant.measured_by_state_and_trajectory(time, &self.input, &held).0[(i, j)]
            }
            (Unknown::Measured(i), Known::Trajectory(j)) => {
                plant.measured_by_state_and_trajectory(time, &self.input, &held).1[(i, j)]
            }
            (Unknown::State(i), Known::State(j))
            | (Unknown::DisturbanceMoment(i), Known::DisturbanceMoment(j))
                if i == j =>
            {
                1.0
            }
            _ => 0.0,
        })
    }

    /// Returns the partial derivative during an entry flight: a difference of fourth order.
    pub(crate) fn difference(
        &mut self,
        time: f64,
        unknown: &str,
        known: Known,
    ) -> Result<f64, Failure> {
        if role(unknown).as_unknown == Some(Unknown::Held) {
            return Ok(0.0);
        }
        if let Known::Jet(j) = known {
            return self.difference_by_jet(time, unknown, j);
        }
        let held = self.held(self.ready()?, time);
        let h = width(known);
        let mut values = [0.0; 4];
        for (value, steps) in values.iter_mut().zip([-2.0, -1.0, 1.0, 2.0]) {
            let before = self.nudge(known, steps * h);
            let shown = self.output_at(self.ready()?, time, &held).value(unknown);
            *value = shown.unwrap_or_default();
            if let Some(place) = self.place(known) {
                *place = before;
            }
        }
        let [far_below, below, above, far_above] = values;
        Ok((8.0 * (above - below) - (far_above - far_below)) / (12.0 * h))
    }

    /// Adds a number to a state or an input. Returns the value before.
    pub(crate) fn nudge(&mut self, known: Known, by: f64) -> f64 {
        let Some(place) = self.place(known) else { return 0.0 };
        let before = *place;
        *place += by;
        before
    }

    /// Returns the partial derivative with respect to the command to a jet. Its thrust has an edge
    /// at no and at full thrust, so that its moment is taken in closed form, as without an entry
    /// flight.
    fn difference_by_jet(&mut self, time: f64, unknown: &str, jet: usize) -> Result<f64, Failure> {
        // In model exchange, commands are taken at events only.
        if self.event_driven {
            return Ok(0.0);
        }
        let by_jets = self.ready()?.applied_moment_by_jets(&self.command);
        match role(unknown).as_unknown {
            Some(Unknown::AppliedMoment(i)) => Ok(by_jets[(i, jet)]),
            Some(Unknown::Derivative(_)) => (0..3).try_fold(0.0, |sum, axis| {
                let by_moment = self.difference(time, unknown, Known::DisturbanceMoment(axis))?;
                Ok(sum + by_moment * by_jets[(axis, jet)])
            }),
            _ => Ok(0.0),
        }
    }

    fn place(&mut self, known: Known) -> Option<&mut f64> {
        let Self { input, command, plant, .. } = self;
        Some(match known {
            Known::State(i @ 0..ATTITUDE) => &mut plant.as_mut()?.state[i],
            Known::State(i @ ATTITUDE..MOTION) => &mut plant.as_mut()?.deflections[i - ATTITUDE],
            Known::State(i) => &mut plant.as_mut()?.motion[i - MOTION],
            Known::Moment(i) => &mut input.moment[i],
            Known::DisturbanceMoment(i) => &mut input.disturbance_moment[i],
            Known::Surface(i) => &mut command.surfaces[i],
            Known::Jet(j) => &mut command.jets[j],
            // The trajectory of an entry flight is no input.
            Known::Trajectory(_) => return None,
            Known::Prescribed(i @ 0..3) => &mut input.prescribed.angles[i],
            Known::Prescribed(i) => &mut input.prescribed.rates[i - 3],
            Known::Trim => &mut input.trim,
        })
    }
}

/// Width of the difference with respect to a state or an input.
fn width(known: Known) -> f64 {
    const ALTITUDE: usize = MOTION;
    const SPEED: usize = MOTION + 3;
    match known {
        Known::State(ALTITUDE) => 10.0,
        Known::State(SPEED) => 1.0,
        Known::Moment(_) | Known::DisturbanceMoment(_) => 1e3,
        _ => 1e-3,
    }
}

impl Output {
    /// Returns the number that an output variable has.
    pub(crate) fn value(&mut self, name: &str) -> Option<f64> {
        static OUTPUTS: LazyLock<Settings<Output>> = LazyLock::new(settings::settings);
        let index = OUTPUTS.iter().position(|output| output.place.name == name)?;
        match OUTPUTS.field(self, index) {
            Field::Real(value) => Some(*value),
            _ => None,
        }
    }
}
