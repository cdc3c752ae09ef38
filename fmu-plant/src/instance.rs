//! The calls of FMI to an instance.

use crate::parameters::Parameters;
use crate::plant::{MOTION, Output, ReentryPlant};
use crate::roles::{Known, Unknown};
use crate::table;
use fmi2_export::{
    Context, Description, EventInfo, Failure, Inputs, LastEvent, Model, Restoration,
};
use nalgebra::{SMatrix, Vector3};
use vehicle::actuators::Command;
use vehicle::plant::{Input, Plant, State, check};

/// Event indicator (s) of a deflection that is at rest.
const AT_REST: f64 = 1.0;

impl ReentryPlant {
    /// Refuses a state at which the equations do not hold. In model exchange the refusal is only a
    /// discard, as the state may be an integrator's trial that the importer can take back.
    fn check(&self, state: &State, time: f64) -> Result<(), Failure> {
        let failure = if self.event_driven { Failure::Discard } else { Failure::Error };
        check(state, time).map_err(|error| failure(error.to_string()))
    }
}
impl Model for ReentryPlant {
    fn description() -> Description<Self> {
        table::description()
    }

    fn new() -> Self {
        Self {
            parameters: Parameters::default(),
            input: Input::default(),
            command: Command::default(),
            output: Output::default(),
            plant: None,
            dynamic_pressure: 0.0,
            standard_pressure: 0.0,
            event_driven: false,
        }
    }

    fn initialize(&mut self, context: &Context) -> Result<(), Failure> {
        let failed = |error: vehicle::Error| Failure::Error(error.to_string());
        self.dynamic_pressure = self.parameters.dynamic_pressure().map_err(failed)?;
        self.standard_pressure = self.parameters.flight.dynamic_pressure().map_err(failed)?;
        let config = self.parameters.config().map_err(failed)?;
        self.plant = Some(Box::new(Plant::new(&config, context.start_time).map_err(failed)?));
        self.event_driven = false;
        Ok(())
    }

    /// After a step, the disturbance and the moment that acted over it are shown.
    fn calculate(&mut self, time: f64, last: LastEvent) -> Result<(), Failure> {
        let plant = self.ready()?;
        self.check(&plant.state, time)?;
        let held = match plant.held() {
            Some(held) if last == LastEvent::Step => held,
            _ => self.held(plant, time),
        };
        let derivative = plant.derivative(time, &self.input, &held);
        if !derivative.iter().all(|value| value.is_finite()) {
            return Err(Failure::Error(format!(
                "an input moment, command or trajectory is not a finite number at t = {time} s"
            )));
        }
        self.output = Output {
            angles: plant.angles(),
            rates: plant.rates(),
            angle_rates: derivative.fixed_rows::<3>(0).into(),
            angular_acceleration: derivative.fixed_rows::<3>(3).into(),
            applied_moment: plant.applied_moment(&self.input, &held),
            delta: held.delta(),
            disturbance_moment: plant.disturbance_moment(time, &self.input, &held),
            deflections: plant.deflections,
            deflection_rates: plant.deflection_rates(&held),
            indicators: plant
                .time_left(&held)
                .map(|left| if left.is_finite() { left } else { AT_REST }),
            dynamic_pressure: self.dynamic_pressure,
            standard_pressure: self.standard_pressure,
            measured: if self.event_driven {
                plant.measured_since_held(time, &self.input)
            } else {
                plant.measured(time, &self.input)
            },
        };
        Ok(())
    }

    fn step(
        &mut self,
        from: f64,
        to: f64,
        inputs: &dyn Inputs<Self>,
        _log: &mut dyn FnMut(&str),
    ) -> Result<(), Failure> {
        self.ready()?;
        let Some(mut plant) = self.plant.take() else { return Ok(()) };
        let command = self.command;
        let result = plant.advance_with(from, to, &command, |time| {
            inputs.advance(self, time);
            self.input
        });
        self.plant = Some(plant);
        result.map_err(|error| Failure::Error(error.to_string()))
    }

    /// Checks the restored plant instead of trusting it. Everything that follows from the
    /// parameters is compared with the plant that was there before, if that has the same
    /// parameters, and otherwise with a new one.
    fn restored(&mut self, from: Restoration<'_, Self>) -> Result<(), Failure> {
        let Some(plant) = self.plant.as_ref().filter(|_| from.initialized) else { return Ok(()) };
        let failed = |error: vehicle::Error| Failure::Error(error.to_string());
        let before = from.before.plant.as_ref().filter(|before| {
            before.start_time() == from.start_time && from.before.parameters == self.parameters
        });
        let fits = if let Some(before) = before {
            plant.fits(before, from.time, from.failed)
        } else {
            let config = self.parameters.config().map_err(failed)?;
            plant.fits(
                &Plant::new(&config, from.start_time).map_err(failed)?,
                from.time,
                from.failed,
            )
        };
        if fits {
            return Ok(());
        }
        let text =
            "the saved state does not fit: its plant does not match its parameters and its time";
        Err(Failure::Error(text.into()))
    }

    fn continuous_states(&self, states: &mut [f64]) {
        if let Some(plant) = &self.plant {
            let (motion, deflections) = states.split_at_mut(MOTION);
            motion.copy_from_slice(plant.state.as_slice());
            deflections.copy_from_slice(plant.deflections.as_slice());
        }
    }

    fn set_continuous_states(&mut self, states: &[f64]) {
        if let Some(plant) = &mut self.plant {
            let (motion, deflections) = states.split_at(MOTION);
            plant.state.copy_from_slice(motion);
            plant.deflections.copy_from_slice(deflections);
        }
    }

    /// Copies the indicators, one for each deflection: the time until it comes to rest, or one
    /// second while it is at rest. They are positive between events and fall through zero with
    /// slope −1.
    fn event_indicators(&self, indicators: &mut [f64]) {
        indicators.copy_from_slice(self.output.indicators.as_slice());
    }

    fn new_discrete_states(&mut self, time: f64) -> Result<EventInfo, Failure> {
        self.ready()?;
        let parameters = &self.parameters;
        for (name, value, unit) in [
            ("delay", parameters.converter.delay, "s"),
            ("resolution", parameters.converter.resolution, "N m"),
        ] {
            if value > 0.0 {
                return Err(Failure::Error(format!(
                    "actuation.{name} = {value} {unit} works in co-simulation only: set it to 0 for model exchange"
                )));
            }
        }
        self.event_driven = true;
        let Some(plant) = &mut self.plant else { return Ok(EventInfo::default()) };
        let before = plant.deflections;
        plant.hold(time, &self.input, &self.command);
        Ok(EventInfo {
            next_event_time: plant.next_event(time),
            states_changed: plant.deflections != before,
        })
    }

    fn partial_derivative(
        &mut self,
        time: f64,
        unknown_variable: usize,
        known_variable: usize,
    ) -> Result<f64, Failure> {
        let plant = self.ready()?;
        self.check(&plant.state, time)?;
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
        Ok(match (table::role(unknown_variable).as_unknown, table::role(known_variable).as_known) {
            (Some(Unknown::Derivative(i @ 0..MOTION)), Some(Known::State(j @ 0..MOTION))) => {
                partials.by_state[(i, j)]
            }
            (Some(Unknown::Derivative(i @ 0..MOTION)), Some(Known::State(j))) => {
                by_applied(applied_by_deflections.column(j - MOTION).into(), i)
            }
            (Some(Unknown::Derivative(i @ 0..MOTION)), Some(Known::DisturbanceMoment(j))) => {
                partials.by_moment[(i, j)]
            }
            (Some(Unknown::Derivative(i @ 0..MOTION)), Some(Known::Moment(j))) => {
                by_applied(applied_by_moment.column(j).into(), i)
            }
            (Some(Unknown::Derivative(i @ 0..MOTION)), Some(Known::Jet(j))) => {
                by_applied(applied_by_jets.column(j).into(), i)
            }
            (Some(Unknown::Derivative(i @ 0..MOTION)), Some(Known::Trajectory(j))) => {
                (partials.by_turn_rate * turn_rate_by_trajectory.column(j))[i]
            }
            (Some(Unknown::AppliedMoment(i)), Some(Known::Moment(j))) => applied_by_moment[(i, j)],
            (Some(Unknown::AppliedMoment(i)), Some(Known::Jet(j))) => applied_by_jets[(i, j)],
            (Some(Unknown::AppliedMoment(i)), Some(Known::State(j @ MOTION..))) => {
                applied_by_deflections[(i, j - MOTION)]
            }
            (Some(Unknown::Measured(i)), Some(Known::State(j @ 0..MOTION))) => {
                plant.measured_by_state_and_trajectory(time, &self.input, &held).0[(i, j)]
            }
            (Some(Unknown::Measured(i)), Some(Known::Trajectory(j))) => {
                plant.measured_by_state_and_trajectory(time, &self.input, &held).1[(i, j)]
            }
            (Some(Unknown::State(i)), Some(Known::State(j)))
            | (Some(Unknown::DisturbanceMoment(i)), Some(Known::DisturbanceMoment(j)))
                if i == j =>
            {
                1.0
            }
            (Some(_), Some(_)) => 0.0,
            _ => {
                let text = "derivatives exist only of outputs with respect to states and inputs";
                return Err(Failure::Error(format!(
                    "variable {unknown_variable} by variable {known_variable}: {text}"
                )));
            }
        })
    }
}
