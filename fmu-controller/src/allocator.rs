//! `ControlAllocator`: the commanded moment divided among surfaces and jets.

use crate::table::{enumeration, item, number};
use crate::ticks::{self, Ticked};
use control::allocation::{Allocator, Command, JetCommand, Memory, Method, Settings, Status};
use control::schedule::Sampled;
use fmi2_export::table::{Common, discrete_output, input, parameter};
use fmi2_export::{Context, Description, Failure, Inputs, Model, Restoration, Table};
use model_description::DefaultExperiment;
use model_description::unit;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use vehicle::Scenario;
use vehicle::effectors::{Effectors, JETS, Jets, SURFACES, Surfaces};

const AXES: [(&str, &str); 3] = [("x", "roll"), ("y", "pitch"), ("z", "yaw")];

const METHODS: [(Method, &str, &str); 2] = [
    (Method::Optimal, "optimal", "least moment error and use of the jets, over all effectors together"),
    (
        Method::Blending,
        "blending",
        "surfaces first, from a dynamic pressure on and up to their limits; the remainder to the jets",
    ),
];
const JET_COMMANDS: [(JetCommand, &str, &str); 2] = [
    (JetCommand::Pwpf, "pwpf", "on (1) and off (0), by pulse-width pulse-frequency modulation"),
    (JetCommand::Duty, "duty", "duty cycles from 0 to 1"),
];
const STATUSES: [(Status, &str, &str); 3] = [
    (Status::None, "none", "no allocation yet"),
    (Status::Optimal, "optimal", "the optimum"),
    (Status::Fallback, "fallback", "the previous allocation, within the limits"),
];

/// The allocator as a unit.
#[derive(Serialize, Deserialize)]
pub struct ControlAllocator {
    parameters: Parameters,
    command: Command,
    output: Output,
    /// From initialization on.
    sampled: Option<Sampled<Memory, Command, ()>>,
    #[serde(skip)]
    allocator: Option<Allocator>,
}

/// The settings, and those of them that FMI sees in another form.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Parameters {
    settings: Settings,
    /// Number of the item of [`METHODS`], from 1.
    method: i32,
    /// Number of the item of [`JET_COMMANDS`], from 1.
    jets: i32,
    max_iterations: i32,
}

impl Default for Parameters {
    fn default() -> Self {
        let settings = Settings::published();
        Self {
            method: number(&METHODS, &settings.method),
            jets: number(&JET_COMMANDS, &settings.jets),
            max_iterations: settings.max_iterations.cast_signed(),
            settings,
        }
    }
}

/// What the unit shows.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct Output {
    surfaces: Surfaces,
    jets: Jets,
    duty: Jets,
    achieved: Vector3<f64>,
    residual: Vector3<f64>,
    modulated: Vector3<f64>,
    by_surfaces: Vector3<f64>,
    status: i32,
    iterations: i32,
    fallbacks: i32,
    time: f64,
}

impl From<&Memory> for Output {
    fn from(memory: &Memory) -> Self {
        Self {
            surfaces: memory.surfaces,
            jets: memory.jets,
            duty: memory.duty,
            achieved: memory.achieved,
            residual: memory.residual,
            modulated: memory.modulated,
            by_surfaces: memory.by_surfaces,
            status: number(&STATUSES, &memory.report.status),
            iterations: memory.report.iterations.cast_signed(),
            fallbacks: memory.report.fallbacks.cast_signed(),
            time: memory.report.time,
        }
    }
}

impl ControlAllocator {
    fn settings(&self) -> Settings {
        Settings {
            method: item(&METHODS, self.parameters.method),
            jets: item(&JET_COMMANDS, self.parameters.jets),
            max_iterations: self.parameters.max_iterations.max(0).cast_unsigned(),
            ..self.parameters.settings.clone()
        }
    }

    fn design(&self) -> Result<Allocator, Failure> {
        Allocator::new(self.settings()).map_err(|error| Failure::Error(error.to_string()))
    }

    /// The allocator of `before`, if it was built from the same settings; else a new one.
    fn design_again(&self, before: &mut Self) -> Result<Allocator, Failure> {
        let settings = self.settings();
        let same = |allocator: &mut Allocator| *allocator.settings() == settings;
        before.allocator.take_if(same).map_or_else(|| self.design(), Ok)
    }

    /// The allocator and its schedule; there from initialization on.
    fn parts(&mut self) -> Result<(&mut Allocator, &mut Sampled<Memory, Command, ()>), Failure> {
        match (&mut self.allocator, &mut self.sampled) {
            (Some(allocator), Some(sampled)) => Ok((allocator, sampled)),
            _ => Err(Failure::Error("the unit is not initialized".into())),
        }
    }
}

impl Ticked for ControlAllocator {
    fn tick_before(&mut self, to: f64) -> Result<Option<f64>, Failure> {
        let (allocator, sampled) = self.parts()?;
        Ok(sampled.next_before(to, allocator.period()))
    }

    fn evaluate(&mut self) -> Result<(), Failure> {
        let command = self.command;
        if !(command.moment.iter().all(|value| value.is_finite()) && command.dynamic_pressure.is_finite()) {
            return Err(Failure::Error("moment or dynamicPressure is not a finite number".into()));
        }
        let (allocator, sampled) = self.parts()?;
        sampled.evaluate_with(command, |memory, tick| allocator.update(memory, tick, &command));
        Ok(())
    }

    fn commit(&mut self) -> Result<Option<&'static str>, Failure> {
        let (_, sampled) = self.parts()?;
        sampled.commit();
        let fell_back = sampled.last_change(|before, after| after.report.fallbacks > before.report.fallbacks);
        Ok(fell_back.then_some(
            "the optimisation did not succeed: the previous allocation is kept (solver.fallbacks)",
        ))
    }
}

impl Model for ControlAllocator {
    fn description() -> Description<Self> {
        Description {
            name: "ControlAllocator",
            description: "Control allocation to eight surfaces and ten jets of Wu et al. (2015), with the selector of Jia et al.",
            documentation: include_str!("allocator.html"),
            version: env!("CARGO_PKG_VERSION"),
            model_exchange: false,
            event_indicators: 0,
            default_experiment: DefaultExperiment {
                start: 0.0,
                stop: Scenario::crmpc2022().duration,
                tolerance: 1e-6,
                step: Settings::published().period,
            },
            table: pwpf(effectors(schedule(outputs(inputs(Table::new()))))),
        }
    }

    fn new() -> Self {
        let parameters = Parameters::default();
        let dynamic_pressure = parameters.settings.effectors.reference_pressure;
        Self {
            parameters,
            command: Command { moment: Vector3::zeros(), dynamic_pressure },
            output: Output::from(&Memory::default()),
            sampled: None,
            allocator: None,
        }
    }

    fn initialize(&mut self, context: &Context) -> Result<(), Failure> {
        let allocator = self.design()?;
        ticks::check_resolution(context.start_time, allocator.period())?;
        self.allocator = Some(allocator);
        self.sampled = Some(Sampled::new(context.start_time, Memory::default()));
        Ok(())
    }

    fn calculate(&mut self, time: f64) -> Result<(), Failure> {
        let (allocator, sampled) = self.parts()?;
        if sampled.is_due(time, allocator.period()) {
            self.evaluate()?;
        }
        self.output = Output::from(self.parts()?.1.in_force().1);
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
        let period = match self.settings() {
            Settings { jets: JetCommand::Pwpf, pwpf, .. } => pwpf.period,
            Settings { period, .. } => period,
        };
        if !sampled.fits((from.start_time, from.time), period, from.failed, |_| true) {
            return ticks::misfit("its ticks are not those of its time");
        }
        self.allocator = Some(self.design_again(from.before)?);
        Ok(())
    }
}

type Variables = Table<ControlAllocator>;

const INPUTS: [&str; 4] = ["moment.x", "moment.y", "moment.z", "dynamicPressure"];

fn inputs(mut table: Variables) -> Variables {
    for (i, (axis, meaning)) in AXES.into_iter().enumerate() {
        let common = input(&format!("moment.{axis}"), &format!("Commanded {meaning} moment"));
        table =
            table.real(common.real().unit(unit::moment()).nominal(1e5), move |m| &mut m.command.moment[i]);
    }
    let pressure =
        input("dynamicPressure", "Dynamic pressure, which the surfaces' moments are proportional to");
    table.real(pressure.real().unit(unit::pressure()).min(0.0).nominal(1e3), |m| {
        &mut m.command.dynamic_pressure
    })
}

fn sampled(name: &str, text: &str) -> Common {
    discrete_output(name, text).depends_on(INPUTS)
}

fn outputs(mut table: Variables) -> Variables {
    for (i, name) in Effectors::published().names.iter().enumerate() {
        let common = sampled(&format!("surface[{}]", i + 1), &format!("Deflection of the {name}"));
        table =
            table.real(common.real().unit(unit::angle()).nominal(0.1), move |m| &mut m.output.surfaces[i]);
    }
    for i in 0..JETS {
        let text = format!("Command to jet {}: on (1) or off (0), or the duty cycle", i + 1);
        let common = sampled(&format!("jet[{}]", i + 1), &text);
        table = table.real(common.real(), move |m| &mut m.output.jets[i]);
    }
    for i in 0..JETS {
        let text = format!("Duty cycle of jet {} before modulation", i + 1);
        let common = sampled(&format!("jetDuty[{}]", i + 1), &text);
        table = table.real(common.real(), move |m| &mut m.output.duty[i]);
    }
    let table = moment(
        table,
        "achievedMoment",
        "moment of the last allocation, with the duty cycles of the jets before modulation",
        |m| &mut m.output.achieved,
    );
    let table = moment(
        table,
        "residual",
        "moment that the last allocation leaves: commanded minus achieved, before modulation",
        |m| &mut m.output.residual,
    );
    let table = moment(table, "modulatedMoment", "moment of surface and jet commands as they are now", |m| {
        &mut m.output.modulated
    });
    let table = moment(table, "momentBySurfaces", "moment of the surfaces of the last allocation", |m| {
        &mut m.output.by_surfaces
    });
    let status = sampled("solver.status", "How the allocation in force came about");
    let iterations = sampled("solver.iterations", "Iterations of the last allocation");
    let fallbacks = sampled("solver.fallbacks", "Allocations so far that did not succeed");
    let time = sampled("solver.time", "Wall-clock time of the last allocation; differs from run to run");
    let statuses = enumeration("AllocationStatus", "How an allocation came about", &STATUSES);
    table
        .enumeration(status, statuses, |m| &mut m.output.status)
        .integer(iterations, (None, None), |m| &mut m.output.iterations)
        .integer(fallbacks, (None, None), |m| &mut m.output.fallbacks)
        .real(time.real().unit(unit::time()).nominal(1e-4), |m| &mut m.output.time)
}

fn moment(
    mut table: Variables,
    name: &str,
    text: &str,
    field: impl Fn(&mut ControlAllocator) -> &mut Vector3<f64> + Copy + Send + Sync + 'static,
) -> Variables {
    for (i, (axis, meaning)) in AXES.into_iter().enumerate() {
        let mut meaning = meaning.to_string();
        meaning[..1].make_ascii_uppercase();
        let common = sampled(&format!("{name}.{axis}"), &format!("{meaning} {text}"));
        table = table.real(common.real().unit(unit::moment()).nominal(1e5), move |m| &mut field(m)[i]);
    }
    table
}

fn schedule(table: Variables) -> Variables {
    let method = parameter("method", "How the moment is divided among the effectors");
    let jets = parameter("jets", "What goes to the jets");
    let period = parameter("period", "Time between allocations; with 'pwpf' a whole multiple of pwpf.period");
    let threshold =
        parameter("threshold.dynamicPressure", "Dynamic pressure from which 'blending' uses the surfaces");
    let iterations = parameter("solver.maxIterations", "Iteration limit of the cone solver");
    let mut table = table
        .enumeration(method, enumeration("AllocationMethod", "How the moment is divided", &METHODS), |m| {
            &mut m.parameters.method
        })
        .enumeration(jets, enumeration("JetCommand", "What goes to the jets", &JET_COMMANDS), |m| {
            &mut m.parameters.jets
        })
        .real(period.real().unit(unit::time()).min(1e-4).max(10.0).nominal(0.01), |m| {
            &mut m.parameters.settings.period
        })
        .real(threshold.real().unit(unit::pressure()).min(0.0).nominal(1e3), |m| {
            &mut m.parameters.settings.threshold
        })
        .integer(iterations, (Some(1), Some(1000)), |m| &mut m.parameters.max_iterations);
    for (i, (_, meaning)) in AXES.into_iter().enumerate() {
        let text = format!("W1: weight on the {meaning} moment that is left, 1/(N m)");
        let weight = parameter(&format!("weight.moment[{}]", i + 1), &text).real().min(0.0);
        table = table.real(weight, move |m| &mut m.parameters.settings.weight_moment[i]);
    }
    let jet = parameter("weight.jet", "W2: weight on the duty cycle of each jet");
    let surface = parameter(
        "weight.surface",
        "Weight on the halved square of each deflection by its range; 0 is the cost function as printed, whose optimum is not unique",
    );
    table
        .real(jet.real().min(0.0), |m| &mut m.parameters.settings.weight_jet)
        .real(surface.real().min(0.0), |m| &mut m.parameters.settings.weight_surface)
}

fn effectors(mut table: Variables) -> Variables {
    let names = Effectors::published().names;
    let limit = |name: &str, i: usize, text: &str| {
        parameter(&format!("limit.{name}[{}]", i + 1), &format!("{text} of the {}", names[i])).real()
    };
    for i in 0..SURFACES {
        let declaration =
            limit("surfaceMin", i, "Least deflection").unit(unit::angle()).max(0.0).nominal(0.1);
        table = table.real(declaration, move |m| &mut m.parameters.settings.effectors.min[i]);
    }
    for i in 0..SURFACES {
        let declaration =
            limit("surfaceMax", i, "Greatest deflection").unit(unit::angle()).min(0.0).nominal(0.1);
        table = table.real(declaration, move |m| &mut m.parameters.settings.effectors.max[i]);
    }
    for i in 0..SURFACES {
        let declaration = limit("surfaceRate", i, "Greatest deflection rate, both ways");
        let declaration = declaration.unit(unit::angular_rate()).min(0.0).nominal(0.1);
        table = table.real(declaration, move |m| &mut m.parameters.settings.effectors.rate[i]);
    }
    for (i, name) in names.iter().enumerate() {
        let text = format!("Whether the {name} may be used; else it is kept at zero");
        let common = parameter(&format!("surfaceAllowed[{}]", i + 1), &text);
        table = table.boolean(common, move |m| &mut m.parameters.settings.effectors.allowed[i]);
    }
    let pressure = parameter("dynamicPressure.reference", "Dynamic pressure that surfaceMoment belongs to");
    table = table.real(pressure.real().unit(unit::pressure()).min(0.0).nominal(1e3), |m| {
        &mut m.parameters.settings.effectors.reference_pressure
    });
    for (i, (_, meaning)) in AXES.into_iter().enumerate() {
        for (j, name) in names.iter().enumerate() {
            let text = format!("D_A: {meaning} moment by deflection of the {name}");
            let common = parameter(&format!("surfaceMoment[{},{}]", i + 1, j + 1), &text);
            table = table.real(common.real().unit(unit::moment_by_angle()).nominal(1e5), move |m| {
                &mut m.parameters.settings.effectors.effectiveness[(i, j)]
            });
        }
    }
    for (i, (_, meaning)) in AXES.into_iter().enumerate() {
        for j in 0..JETS {
            let text = format!("D_RCS: {meaning} moment of jet {}", j + 1);
            let common = parameter(&format!("jetMoment[{},{}]", i + 1, j + 1), &text);
            table = table.real(common.real().unit(unit::moment()).nominal(1e4), move |m| {
                &mut m.parameters.settings.effectors.jet_moments[(i, j)]
            });
        }
    }
    table
}

fn pwpf(table: Variables) -> Variables {
    let gain = parameter("pwpf.gain", "K_m: gain of the modulator's filter");
    let time = parameter("pwpf.timeConstant", "T_m: time constant of the modulator's filter");
    let on = parameter("pwpf.on", "u_on: filter output at which a jet switches on");
    let off = parameter("pwpf.off", "u_off: filter output at which a jet switches off");
    let period = parameter("pwpf.period", "Time between two looks of the modulator");
    let seconds = |common: Common| common.real().unit(unit::time()).min(1e-5).max(10.0);
    table
        .real(gain.real().min(0.0), |m| &mut m.parameters.settings.pwpf.gain)
        .real(seconds(time).nominal(0.1), |m| &mut m.parameters.settings.pwpf.time_constant)
        .real(on.real().min(0.0), |m| &mut m.parameters.settings.pwpf.on)
        .real(off.real().min(0.0), |m| &mut m.parameters.settings.pwpf.off)
        .real(seconds(period).nominal(1e-3), |m| &mut m.parameters.settings.pwpf.period)
}
