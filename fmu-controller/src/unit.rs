//! The unit that all controllers share: inputs, reference, limits, the schedule on integer ticks.

use crate::law::{Law, Vehicle};
use crate::reference::{self, Source};
use crate::table;
use crate::ticks::{self, Ticked};
use control::controller::{Controller, Measurement};
use control::delay::{Delayed, Latency};
use control::schedule::Sampled;
use fmi2_export::{Context, Description, Failure, Inputs, Model, Restoration};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use vehicle::Scenario;
use vehicle::dynamics::Inertia;
use vehicle::reference::Reference;

type Memory<L> = <Delayed<<L as Law>::Controller> as Controller>::Memory;

/// A controller as a unit.
#[derive(Serialize, Deserialize)]
#[serde(bound = "")]
pub struct Unit<L: Law> {
    pub(crate) parameters: Parameters,
    pub(crate) input: Input,
    pub(crate) output: Output,
    /// The law's own parameters and outputs.
    pub(crate) law: L,
    source: Source,
    /// From initialization on.
    sampled: Option<Sampled<Memory<L>>>,
    #[serde(skip)]
    designed: Option<Designed<L>>,
}

/// A controller and what it was designed for.
struct Designed<L: Law> {
    settings: L::Settings,
    vehicle: Vehicle,
    controller: Delayed<L::Controller>,
}

/// Parameters of every controller.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Parameters {
    pub(crate) reference: reference::Parameters,
    pub(crate) inertia: Inertia,
    pub(crate) limit_rate: f64,
    pub(crate) limit_moment: f64,
    pub(crate) saturation: bool,
    pub(crate) latency: Latency,
    /// Whether the input `achieved_moment` is fed; declared by laws that use it.
    pub(crate) achieved_moment_used: bool,
}

/// Inputs of every controller.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Input {
    pub(crate) measured: Measurement,
    pub(crate) achieved_moment: Vector3<f64>,
    pub(crate) reference: Reference,
}

/// Outputs of every controller.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Output {
    pub(crate) moment: Vector3<f64>,
    pub(crate) reference: Reference,
}

/// What works together at a tick.
struct Parts<'a, L: Law> {
    controller: &'a mut Delayed<L::Controller>,
    sampled: &'a mut Sampled<Memory<L>>,
    input: &'a Input,
    source: &'a Source,
}

impl<L: Law> Unit<L> {
    /// The controller and its schedule; there from initialization on.
    fn parts(&mut self) -> Result<Parts<'_, L>, Failure> {
        match (&mut self.designed, &mut self.sampled) {
            (Some(Designed { controller, .. }), Some(sampled)) => {
                Ok(Parts { controller, sampled, input: &self.input, source: &self.source })
            }
            _ => Err(Failure::Error("the unit is not initialized".into())),
        }
    }

    fn vehicle(&self) -> Result<Vehicle, Failure> {
        let Parameters { inertia, limit_rate, limit_moment, saturation, latency, .. } = self.parameters;
        let body = inertia.body(1.0).map_err(|error| Failure::Error(error.to_string()))?;
        Ok(Vehicle { body, limit_rate, limit_moment, saturation, latency })
    }

    fn design(&self) -> Result<Designed<L>, Failure> {
        let vehicle = self.vehicle()?;
        let settings = self.law.settings(&vehicle);
        let controller = L::design(settings.clone())
            .and_then(|law| Delayed::new(law, vehicle.body, vehicle.latency, vehicle.saturates_at()))
            .map_err(|error| Failure::Error(error.to_string()))?;
        Ok(Designed { settings, vehicle, controller })
    }

    /// The controller of `before`, if it was designed for the same; else a new one. What a controller keeps beside its memory
    /// is scratch.
    fn design_again(&self, before: &mut Self) -> Result<Designed<L>, Failure> {
        let vehicle = self.vehicle()?;
        let settings = self.law.settings(&vehicle);
        let same = |designed: &mut Designed<L>| designed.vehicle == vehicle && designed.settings == settings;
        before.designed.take_if(same).map_or_else(|| self.design(), Ok)
    }
}

impl<L: Law> Ticked for Unit<L> {
    fn tick_before(&mut self, to: f64) -> Result<Option<f64>, Failure> {
        let Parts { controller, sampled, .. } = self.parts()?;
        Ok(sampled.next_before(to, controller.period()))
    }

    fn evaluate(&mut self) -> Result<(), Failure> {
        let used = self.parameters.achieved_moment_used;
        let Parts { controller, sampled, input, source } = self.parts()?;
        let measured =
            Measurement { achieved_moment: used.then_some(input.achieved_moment), ..input.measured };
        let now = sampled.next_time(controller.period());
        // Of an external reference the law takes the present value for that of the time at which its moment acts.
        let known = now + controller.acts_after();
        let external = match source {
            Source::External => input.reference,
            Source::Profile(_) => Reference::default(),
        };
        let mut mark = [0.0; 9];
        for (i, part) in [external.angles, external.rates, external.accelerations].iter().enumerate() {
            mark[3 * i..3 * i + 3].copy_from_slice(part.as_slice());
        }
        sampled.evaluate(controller, &measured, mark, &|time| source.at(time, known, &external));
        if sampled.in_force().0.iter().all(|value| value.is_finite()) {
            return Ok(());
        }
        Err(Failure::Error(format!(
            "the control moment at t = {now} s is not finite; the attitude may be singular (sideslip angle near 90 deg)"
        )))
    }

    fn commit(&mut self) -> Result<Option<&'static str>, Failure> {
        let Parts { sampled, .. } = self.parts()?;
        sampled.commit();
        Ok(sampled.last_change(|before, after| L::warning(&before.inner, &after.inner)))
    }
}

impl<L: Law> Model for Unit<L> {
    fn description() -> Description<Self> {
        table::description()
    }

    fn new() -> Self {
        let scenario = Scenario::crmpc2022();
        Self {
            parameters: Parameters {
                reference: reference::Parameters::default(),
                inertia: scenario.inertia,
                limit_rate: scenario.limit_rate,
                limit_moment: scenario.limit_moment,
                saturation: false,
                latency: Latency::default(),
                achieved_moment_used: false,
            },
            input: Input {
                measured: Measurement {
                    angles: scenario.initial_angles,
                    rates: scenario.initial_rates,
                    ..Measurement::default()
                },
                reference: scenario.reference.at(0.0),
                ..Input::default()
            },
            output: Output::default(),
            law: L::default(),
            source: Source::Profile(scenario.reference),
            sampled: None,
            designed: None,
        }
    }

    fn initialize(&mut self, context: &Context) -> Result<(), Failure> {
        self.source = Source::new(&self.parameters.reference, context)?;
        let designed = self.design()?;
        ticks::check_resolution(context.start_time, designed.controller.period())?;
        self.sampled = Some(Sampled::new(context.start_time, designed.controller.memory()));
        self.designed = Some(designed);
        Ok(())
    }

    fn calculate(&mut self, time: f64) -> Result<(), Failure> {
        let Parts { controller, sampled, .. } = self.parts()?;
        if sampled.is_due(time, controller.period()) {
            self.evaluate()?;
        }
        let (Some(Designed { controller, .. }), Some(sampled)) = (&self.designed, &self.sampled) else {
            return Ok(());
        };
        let (moment, memory) = sampled.in_force();
        self.law.show(&memory.inner);
        self.output = Output {
            moment: controller.saturated(moment),
            reference: self.source.at(time, time, &self.input.reference),
        };
        Ok(())
    }

    fn step(
        &mut self,
        from: f64,
        to: f64,
        inputs: &dyn Inputs<Self>,
        log: &mut dyn FnMut(&str),
    ) -> Result<(), Failure> {
        ticks::step(self, from, to, inputs, log)
    }

    fn restored(&mut self, from: Restoration<'_, Self>) -> Result<(), Failure> {
        let Some(sampled) = self.sampled.as_ref().filter(|_| from.initialized) else { return Ok(()) };
        if self.source != from.before.source && !self.source.fits(&self.parameters.reference) {
            return ticks::misfit("its reference is not that of its parameters");
        }
        let designed = self.design_again(from.before)?;
        let period = designed.controller.period();
        let times = (from.start_time, from.time);
        if sampled.fits(times, period, from.failed, |memory| designed.controller.fits(memory)) {
            self.designed = Some(designed);
            return Ok(());
        }
        // The other unit goes on with what was taken from it.
        from.before.designed.get_or_insert(designed);
        ticks::misfit("its ticks are not those of its time, or its memory has another shape")
    }
}
