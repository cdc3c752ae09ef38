//! `EntryGuidance`: the reference of the attitude along an entry flight.

use control::guidance::{Command, Guidance, Loads, Memory, Navigation, PERIOD, Settings};
use controller_export::own_vehicle::OwnVehicle;
use controller_export::sampled::{SampledFmu, SampledInstance, Ticks};
use controller_export::table::{ANGLES, vector};
use fmi_export::table::{Common, Real, discrete_output, input};
use fmi_export::{Context, Description, Failure, VariableTable};
use model_description::DefaultExperiment;
use serde::{Deserialize, Serialize};
use vehicle::entry::{QUANTITIES, Quantity, Start};

/// The guidance as an FMU.
pub type EntryGuidance = SampledFmu<GuidanceInstance>;

/// An instance of the guidance: its parameters, inputs and outputs.
#[derive(Serialize, Deserialize)]
pub struct GuidanceInstance {
    pub(crate) settings: Settings,
    pub(crate) own: OwnVehicle,
    pub(crate) navigation: Navigation,
    pub(crate) output: Output,
}

/// Outputs of the guidance.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Output {
    pub(crate) command: Command,
    reversals: u64,
    /// Shares of the limits that are left.
    margins: Loads,
}

/// Longest flight that is expected, s.
const LONGEST: f64 = 3000.0;

impl SampledInstance for GuidanceInstance {
    type Device = Guidance;
    type Memory = Memory;
    type Input = Navigation;
    type Output = ();

    fn description() -> Description<EntryGuidance> {
        Description {
            name: "EntryGuidance",
            description: "Guidance of an entry flight to the terminal area by a predictor-corrector, Lu (2014)",
            documentation: include_str!("guidance.html").into(),
            version: env!("CARGO_PKG_VERSION"),
            model_exchange: false,
            event_indicators: 0,
            default_experiment: DefaultExperiment {
                start: 0.0,
                stop: LONGEST,
                tolerance: 1e-6,
                step: PERIOD,
            },
            table: outputs(inputs(VariableTable::new()))
                .settings(|m: &mut EntryGuidance| &mut m.settings)
                .settings(|m| &mut m.own),
        }
    }

    fn new() -> Self {
        Self {
            settings: Settings::default(),
            own: OwnVehicle::default(),
            navigation: Navigation { motion: Start::default().motion(), ..Navigation::default() },
            output: Output::default(),
        }
    }

    fn load(&mut self, context: &Context) -> Result<(), Failure> {
        self.own.load(context)
    }

    fn design(&self) -> Result<Guidance, Failure> {
        let aerodynamics = self.own.vehicle().aerodynamics.clone();
        Guidance::of(self.settings, aerodynamics).map_err(|error| Failure::Error(error.to_string()))
    }

    fn is_designed(&self, guidance: &Guidance) -> bool {
        *guidance.settings() == self.settings
            && *guidance.aerodynamics() == self.own.vehicle().aerodynamics
    }

    fn period(_guidance: &Guidance) -> f64 {
        PERIOD
    }

    fn evaluate(&self, guidance: &mut Guidance, ticks: &mut Ticks<Self>) -> Result<(), Failure> {
        let navigation = self.navigation;
        let Navigation { motion, lift, drag } = navigation;
        if !motion.iter().chain(&[lift, drag]).all(|value| value.is_finite()) {
            return Err(Failure::Error("an input motion.* or load.* is not finite".into()));
        }
        if motion[3] <= 0.0 {
            let problem = format!("motion.speed = {} m/s must be positive", motion[3]);
            return Err(Failure::Error(problem));
        }
        ticks.evaluate_with(navigation, |memory, tick| {
            guidance.update(memory, tick, &navigation);
        });
        Ok(())
    }

    fn show(&mut self, _time: f64, _guidance: &Guidance, ((), memory): ((), &Memory)) {
        let (command, reversals) = (memory.command, memory.reversals);
        let margins = command.loads.margins(&self.settings.limit);
        self.output = Output { command, reversals, margins };
    }

    fn warning(before: &Memory, after: &Memory) -> Option<&'static str> {
        let (first, now) = (!before.has_begun(), &after.command);
        if (before.command.in_reach || first) && !now.in_reach {
            return Some(
                "the target is out of reach: the predicted flight ends farther from it than target.tolerance, and no bank angle changes that (see miss)",
            );
        }
        ((before.command.keeps_limits || first) && !now.keeps_limits).then_some(
            "the predicted flight exceeds a limit: heat flux, load or dynamic pressure becomes larger than limit.heatFlux, limit.load or limit.pressure (see limits.feasible)",
        )
    }

    fn fits(guidance: &Guidance, memory: &Memory) -> bool {
        guidance.fits(memory)
    }

    fn problem(&self, before: &Self) -> Option<&'static str> {
        self.own.problem(&before.own)
    }
}

type Variables = VariableTable<EntryGuidance>;

/// Names of the inputs, which are those of outputs of the plant.
const INPUTS: [&str; 8] = [
    "motion.altitude",
    "motion.longitude",
    "motion.latitude",
    "motion.speed",
    "motion.flightPathAngle",
    "motion.heading",
    "load.lift",
    "load.drag",
];

fn inputs(mut table: Variables) -> Variables {
    for (i, (name, quantity)) in INPUTS.into_iter().zip(QUANTITIES).enumerate() {
        let Quantity { meaning, units: [unit, _], nominal, .. } = quantity;
        let real = input(name, meaning).real().unit(unit).nominal(nominal);
        table = table.real(real, move |m| &mut m.navigation.motion[i]);
    }
    let load = |name: &str, text: &str| input(name, text).real().unit("m/s2").nominal(10.0);
    table
        .real(load("load.lift", "Measured lift per mass"), |m| &mut m.navigation.lift)
        .real(load("load.drag", "Measured drag per mass"), |m| &mut m.navigation.drag)
}

fn sampled(name: &str, text: &str) -> Common {
    discrete_output(name, text).depends_on(INPUTS)
}

fn outputs(table: Variables) -> Variables {
    let reference = |name: &'static str, quantity: &'static str, unit: &'static str| {
        move |axis: &str, meaning: &str| -> Real {
            let common = sampled(&format!("{name}.{axis}"), &format!("{quantity} {meaning}"));
            common.real().unit(unit).nominal(0.1)
        }
    };
    let angles = reference("reference", "Reference of the", "rad");
    let rates = reference("referenceRate", "First derivative of the reference of the", "rad/s");
    let accelerations =
        reference("referenceAcceleration", "Second derivative of the reference of the", "rad/s2");
    let table = vector(table, ANGLES, angles, |m| &mut m.output.command.reference.angles);
    let table = vector(table, ANGLES, rates, |m| &mut m.output.command.reference.rates);
    let table =
        vector(table, ANGLES, accelerations, |m| &mut m.output.command.reference.accelerations);
    let real = |name: &str, text: &str, unit: &str, nominal: f64| {
        sampled(name, text).real().unit(unit).nominal(nominal)
    };
    let margin = |name: &str| {
        let text = format!("Share of limit.{name} that is left");
        sampled(&format!("margins.{name}"), &text).real()
    };
    table
        .real(real("command.alpha", "Angle of attack of the schedule", "rad", 0.1), |m| {
            &mut m.output.command.alpha
        })
        .real(real("command.bank", "Bank angle before it is shaped", "rad", 1.0), |m| {
            &mut m.output.command.bank
        })
        .real(real("range", "Distance over ground to the runway point", "m", 1e6), |m| {
            &mut m.output.command.range
        })
        .real(
            real(
                "headingError",
                "Direction to the runway point less the heading, positive to the right",
                "rad",
                0.1,
            ),
            |m| &mut m.output.command.heading_error,
        )
        .real(
            real("miss", "By how much the predicted flight ends too far from the target", "m", 1e3),
            |m| &mut m.output.command.miss,
        )
        .boolean(
            sampled(
                "inReach",
                "Whether a bank angle brings the predicted flight within target.tolerance of the target",
            ),
            |m| &mut m.output.command.in_reach,
        )
        .real(real("loads.heatFlux", "Heat flux into the leading edge", "W/m2", 1e5), |m| {
            &mut m.output.command.loads.heat_flux
        })
        .real(sampled("loads.load", "Load, in 9.80665 m/s2").real(), |m| {
            &mut m.output.command.loads.load
        })
        .real(real("loads.pressure", "Dynamic pressure", "Pa", 1e4), |m| {
            &mut m.output.command.loads.pressure
        })
        .real(real("loads.heatLoad", "Heat load of the leading edge so far", "J/m2", 1e8), |m| {
            &mut m.output.command.heat_load
        })
        .real(margin("heatFlux"), |m| &mut m.output.margins.heat_flux)
        .real(margin("load"), |m| &mut m.output.margins.load)
        .real(margin("pressure"), |m| &mut m.output.margins.pressure)
        .boolean(sampled("limits.active", "Whether a limit makes the bank angle smaller"), |m| {
            &mut m.output.command.is_limited
        })
        .boolean(sampled("limits.feasible", "Whether the predicted flight keeps all limits"), |m| {
            &mut m.output.command.keeps_limits
        })
        .integer(sampled("reversals", "Number of bank reversals so far"), (Some(0), None), |m| {
            &mut m.output.reversals
        })
}
