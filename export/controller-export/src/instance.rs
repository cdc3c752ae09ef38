//! Operation of a controller's instance at its ticks.

use crate::law::{ControllerFmu, ControllerInstance, Input, Law, Output, Parameters, Vehicle};
use crate::own_vehicle::OwnVehicle;
use crate::reference::{self, Source};
use crate::sampled::{SampledInstance, Ticks};
use crate::table;
use control::controller::{Controller, Measurement};
use control::delay::{Delayed, Latency};
use control::schedule::ControllerInput;
use fmi_export::{Context, Description, Failure, SettingsFile};
use nalgebra::Vector3;
use vehicle::Scenario;
use vehicle::error::rounded_time;
use vehicle::reference::Reference;

/// A controller with the settings and the vehicle for which it was designed.
pub struct Designed<L: Law> {
    settings: L::Settings,
    vehicle: Vehicle,
    controller: Delayed<L::Controller>,
}

impl<L: Law> ControllerInstance<L> {
    /// Returns the failure for refused settings.
    fn refusal(error: &impl ToString) -> Failure {
        Failure::Error(error.to_string())
    }

    fn vehicle(&self) -> Result<Vehicle, Failure> {
        let Parameters { limit_rate, limit_moment, saturation, latency, .. } = self.parameters;
        let inertia = self.own.vehicle().inertia;
        let body = inertia.body(1.0).map_err(|error| Self::refusal(&error))?;
        Ok(Vehicle { body, limit_rate, limit_moment, saturation, latency })
    }
}

impl<L: Law> SampledInstance for ControllerInstance<L> {
    type Device = Designed<L>;
    type Memory = <Delayed<L::Controller> as Controller>::Memory;
    type Input = ControllerInput;
    type Output = Vector3<f64>;

    fn description() -> Description<ControllerFmu<L>> {
        table::description()
    }

    fn new() -> Self {
        // Reading it needs much of a small stack, of which initialization has used some already.
        vehicle::Vehicle::papers();
        let scenario = Scenario::crmpc2022();
        Self {
            parameters: Parameters {
                reference: reference::Parameters::default(),
                limit_rate: scenario.limit_rate,
                limit_moment: scenario.limit_moment,
                saturation: false,
                latency: Latency::default(),
                earth_rate: 0.0,
            },
            settings: L::settings(),
            file: SettingsFile::default(),
            own: OwnVehicle::default(),
            input: Input {
                angles: scenario.initial_angles,
                rates: scenario.initial_rates,
                reference: Reference {
                    angles: scenario.reference.at(0.0).angles,
                    ..Reference::default()
                },
                ..Input::default()
            },
            output: Output::default(),
            law: L::default(),
            source: Source::Profile(scenario.reference),
        }
    }

    fn load(&mut self, context: &Context) -> Result<(), Failure> {
        self.file.clone().read(self, context)?;
        self.own.load(context)?;
        self.source = Source::new(&self.parameters.reference, context)?;
        Ok(())
    }

    fn design(&self) -> Result<Designed<L>, Failure> {
        let vehicle = self.vehicle()?;
        let settings = self.settings.clone();
        let controller = L::design(settings.clone(), &vehicle)
            .and_then(|law| {
                let (period, limit) = (L::period(&settings), vehicle.saturates_at());
                Delayed::new(law, vehicle.body, period, vehicle.latency, limit)
            })
            .map_err(|error| Self::refusal(&error))?;
        Ok(Designed { settings, vehicle, controller })
    }

    fn is_designed(&self, device: &Designed<L>) -> bool {
        device.settings == self.settings
            && self.vehicle().is_ok_and(|vehicle| device.vehicle == vehicle)
    }

    fn period(device: &Designed<L>) -> f64 {
        L::period(&device.settings)
    }

    fn memory(device: &Designed<L>) -> Self::Memory {
        device.controller.memory()
    }

    fn evaluate(
        &self,
        device: &mut Designed<L>,
        ticks: &mut Ticks<Self>,
        is_stale: bool,
    ) -> Result<(), Failure> {
        let Self { settings, input, source, .. } = self;
        let controller = &mut device.controller;
        let Input { angles, rates, achieved_moment, known_moment, scheduled, .. } = *input;
        let turn_rate = input.trajectory.turn_rate(self.parameters.earth_rate);
        let measured = Measurement {
            angles,
            rates,
            achieved_moment: L::uses_achieved_moment(settings)
                .then_some(achieved_moment + known_moment),
            known_moment,
            scheduled,
            stale: is_stale,
            ..Measurement::default()
        };
        let measured = measured.relative_to(&turn_rate);
        let now = ticks.next_time();
        let times = [now, now + controller.acts_after()];
        let preview = source.preview(&self.parameters.reference, times, &input.reference);
        ticks.evaluate(controller, &measured, &preview);
        if ticks.in_force().0.iter().all(|value| value.is_finite()) {
            return Ok(());
        }
        Err(Failure::Error(format!(
            "the control moment at t = {} s is not finite; the attitude may be singular (sideslip angle near 90 deg)",
            rounded_time(now)
        )))
    }

    /// With a delay no command acts at the start. The law takes the moment as zero until its first
    /// command acts.
    fn output_before_the_first(device: &Designed<L>) -> Option<Vector3<f64>> {
        (device.controller.acts_after() > 0.0).then(Vector3::zeros)
    }

    fn warning(before: &Self::Memory, after: &Self::Memory) -> Option<&'static str> {
        if after.loop_delay.is_other && !before.loop_delay.is_other {
            return Some(
                "the response of the vehicle shows another loop delay than delay + measurement.age; see loopDelay.estimate",
            );
        }
        if after.turns.contradicts && !before.turns.contradicts {
            return Some(
                "the rates of the reference have not been the derivatives of its angles for a second; set reference.externalRate.* to the derivatives of reference.external.*, or to 0 where these are constant",
            );
        }
        L::warning(&before.inner, &after.inner)
    }

    fn show(
        &mut self,
        time: f64,
        device: &Designed<L>,
        (moment, memory): (Vector3<f64>, &Self::Memory),
    ) {
        self.law.show(&self.settings, &memory.inner);
        self.output = Output {
            moment,
            reference: self
                .source
                .preview(&self.parameters.reference, [time; 2], &self.input.reference)
                .at(time),
            loop_delay: device.controller.estimated_delay(memory),
            has_other_delay: memory.loop_delay.is_other,
        };
    }

    fn fits(device: &Designed<L>, memory: &Self::Memory) -> bool {
        device.controller.fits(memory)
    }

    fn problem(&self, before: &Self) -> Option<&'static str> {
        let fits = self.source == before.source || self.source.fits(&self.parameters.reference);
        let reference = (!fits).then_some("its reference does not match its parameters");
        reference.or_else(|| self.own.problem(&before.own))
    }
}
