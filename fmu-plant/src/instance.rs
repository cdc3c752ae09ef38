//! The calls of FMI to an instance.

use crate::parameters::Parameters;
use crate::plant::{ATTITUDE, Output, ReentryPlant};
use crate::table;
use fmi_export::{Context, Description, EventInfo, Failure, Inputs, LastEvent, Model, Restoration};
use vehicle::Vehicle;
use vehicle::actuators::Command;
use vehicle::effectors::SURFACES;
use vehicle::entry::{End, Passage};
use vehicle::error::rounded_time;
use vehicle::plant::{Input, Plant, State, check};

impl ReentryPlant {
    /// Refuses a state at which the equations do not hold. In model exchange the refusal is only a
    /// discard, as the state may be an integrator's trial that the importer can take back.
    pub(crate) fn check(&self, state: &State, time: f64) -> Result<(), Failure> {
        let failure = if self.event_driven { Failure::Discard } else { Failure::Error };
        let motion = |plant: &Plant| plant.check_motion(&plant.motion, time);
        check(state, time)
            .and_then(|()| self.plant.as_deref().map_or(Ok(()), motion))
            .map_err(|error| failure(error.to_string()))
    }

    /// Says why an entry flight ended.
    fn reason_of_the_end(&self) -> String {
        let End { altitude, speed } = self.parameters.entry.end;
        let margins = self.plant.as_ref().and_then(|plant| plant.margins());
        match margins {
            Some([above, _]) if above <= 0.0 => {
                format!("the entry flight ended at end.altitude = {altitude} m")
            }
            _ => format!("the entry flight ended at end.speed = {speed} m/s"),
        }
    }
}
impl Model for ReentryPlant {
    fn description() -> Description<Self> {
        table::description()
    }

    fn new() -> Self {
        // Reading it needs much of a small stack, of which initialization has used some already.
        Vehicle::papers();
        Self {
            parameters: Parameters::default(),
            input: Input::default(),
            command: Command::default(),
            output: Output::default(),
            vehicle: None,
            plant: None,
            fixed: Passage::default(),
            inertia_errors: [0.0; 2],
            event_driven: false,
        }
    }

    fn initialize(&mut self, context: &Context) -> Result<(), Failure> {
        let failed = |error: vehicle::Error| Failure::Error(error.to_string());
        self.parameters.settings.clone().read(&mut self.parameters, context)?;
        self.fixed = self.parameters.fixed().map_err(failed)?.0;
        self.vehicle = self.parameters.load_vehicle(context)?;
        let config = self.parameters.config(self.vehicle.as_deref()).map_err(failed)?;
        self.plant = Some(Box::new(Plant::new(&config, context.start_time).map_err(failed)?));
        let nominal = self.vehicle.as_deref().unwrap_or_else(|| Vehicle::papers()).inertia;
        let errors = self.ready()?.body().error_from(&nominal.matrix());
        let refused = || Failure::Error("the vehicle's inertia is not positive definite".into());
        self.inertia_errors = errors.ok_or_else(refused)?;
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
        let output = self.output_at(plant, time, &held);
        let moved = output.angle_rates.iter().chain(output.angular_acceleration.iter());
        if !moved.chain(output.motion_rate.iter()).all(|value| value.is_finite()) {
            return Err(Failure::Error(format!(
                "an input moment, command, trajectory or prescribed attitude is not a finite number at t = {} s",
                rounded_time(time)
            )));
        }
        self.output = output;
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
        let ended = plant.ended();
        self.plant = Some(plant);
        result.map_err(|error| Failure::Error(error.to_string()))?;
        match ended {
            None => Ok(()),
            Some(time) => Err(Failure::Ended { time, reason: self.reason_of_the_end() }),
        }
    }

    /// Checks the restored plant instead of trusting it. Everything that follows from the
    /// parameters is compared with the plant that was there before, if that has the same
    /// parameters, and otherwise with a new one.
    fn restored(&mut self, from: Restoration<'_, Self>) -> Result<(), Failure> {
        let Some(plant) = self.plant.as_ref().filter(|_| from.initialized) else { return Ok(()) };
        self.check_vehicle(from.before)?;
        let failed = |error: vehicle::Error| Failure::Error(error.to_string());
        let before = from.before.plant.as_ref().filter(|before| {
            before.start_time() == from.start_time
                && from.before.parameters == self.parameters
                && from.before.vehicle == self.vehicle
        });
        let fits = if let Some(before) = before {
            plant.fits(before, from.time, from.failed)
        } else {
            let config = self.parameters.config(self.vehicle.as_deref()).map_err(failed)?;
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
            let (attitude, rest) = states.split_at_mut(ATTITUDE);
            let (deflections, motion) = rest.split_at_mut(SURFACES);
            attitude.copy_from_slice(plant.state.as_slice());
            deflections.copy_from_slice(plant.deflections.as_slice());
            motion.copy_from_slice(plant.motion.as_slice());
        }
    }

    fn set_continuous_states(&mut self, states: &[f64]) {
        if let Some(plant) = &mut self.plant {
            let (attitude, rest) = states.split_at(ATTITUDE);
            let (deflections, motion) = rest.split_at(SURFACES);
            plant.state.copy_from_slice(attitude);
            plant.deflections.copy_from_slice(deflections);
            plant.motion.copy_from_slice(motion);
        }
    }

    /// Copies the indicators, one for each deflection: the time until it comes to rest, or one
    /// second while it is at rest. They are positive between events and fall through zero with
    /// slope −1. Two more are the distances of an entry flight from its end.
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
            terminates: plant.margins().is_some_and(|margins| margins.iter().any(|m| *m <= 0.0)),
        })
    }
}
