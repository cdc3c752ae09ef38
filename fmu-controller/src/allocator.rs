//! `ControlAllocator` divides the commanded moment among surfaces and jets.

use control::allocation::{
    AllocationReport, AllocationStatus, Allocator, Command, Memory, Settings,
};
use controller_export::own_vehicle::OwnVehicle;
use controller_export::sampled::{SampledFmu, SampledInstance, Ticks};
use controller_export::table::{AXES, capital};
use fmi_export::table::{Common, discrete_output, input, parameter};
use fmi_export::{Context, Description, Failure, VariableTable};
use model_description::DefaultExperiment;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use settings::Choice;
use vehicle::Scenario;
use vehicle::effectors::{Effectors, JETS, Jets, SURFACES, Surfaces};

/// The allocator as an FMU.
pub type ControlAllocator = SampledFmu<AllocatorInstance>;

/// An instance of the allocator: its parameters, inputs and outputs.
#[derive(Serialize, Deserialize)]
pub struct AllocatorInstance {
    pub(crate) settings: Settings,
    pub(crate) own: OwnVehicle,
    pub(crate) command: Command,
    pub(crate) output: Output,
}

/// Outputs of the allocator.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Output {
    pub(crate) surfaces: Surfaces,
    jets: Jets,
    pub(crate) duty: Jets,
    achieved: Vector3<f64>,
    pub(crate) residual: Vector3<f64>,
    modulated: Vector3<f64>,
    pub(crate) by_surfaces: Vector3<f64>,
    report: AllocationReport,
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
            report: memory.report,
        }
    }
}

impl AllocatorInstance {
    /// Returns the settings with the surfaces and jets that are in force.
    fn in_force(&self) -> Settings {
        let effectors = self.own.read().and_then(|vehicle| vehicle.effectors.clone());
        let effectors = effectors.unwrap_or_else(|| self.settings.effectors.clone());
        Settings { effectors, ..self.settings.clone() }
    }
}

impl SampledInstance for AllocatorInstance {
    type Device = Allocator;
    type Memory = Memory;
    type Input = Command;
    type Output = ();

    fn description() -> Description<ControlAllocator> {
        Description {
            name: "ControlAllocator",
            description: "Control allocation to eight surfaces and ten jets of Wu et al. (2015), with the selector of Jia et al.",
            documentation: include_str!("allocator.html").into(),
            version: env!("CARGO_PKG_VERSION"),
            model_exchange: false,
            event_indicators: 0,
            default_experiment: DefaultExperiment {
                start: 0.0,
                stop: Scenario::crmpc2022().duration,
                tolerance: 1e-6,
                step: Settings::published().period,
            },
            table: effectors(
                outputs(inputs(VariableTable::new()))
                    .settings(|m: &mut ControlAllocator| &mut m.settings),
            )
            .settings(|m| &mut m.settings.pwpf)
            .settings(|m| &mut m.own),
        }
    }

    fn new() -> Self {
        let settings = Settings::published();
        let dynamic_pressure = settings.effectors.reference_pressure;
        Self {
            settings,
            own: OwnVehicle::default(),
            command: Command { dynamic_pressure, ..Command::default() },
            output: Output::from(&Memory::default()),
        }
    }

    /// Reads the vehicle, whose surfaces and jets take the place of the parameters. A parameter
    /// that is set as well would be in vain.
    fn load(&mut self, context: &Context) -> Result<(), Failure> {
        self.own.load(context)?;
        let Some(vehicle) = self.own.read() else { return Ok(()) };
        if vehicle.effectors.is_none() {
            let text = "vehicle.file gives neither surfaces nor jets, which the allocator needs";
            return Err(Failure::Error(text.into()));
        }
        let (start, set) = (Settings::published().effectors, &self.settings.effectors);
        let given = [
            ("limit.surfaceMin", start.min != set.min),
            ("limit.surfaceMax", start.max != set.max),
            ("limit.surfaceRate", start.rate != set.rate),
            ("surfaceAllowed", start.allowed != set.allowed),
            ("dynamicPressure.reference", start.reference_pressure != set.reference_pressure),
            ("surfaceMoment", start.effectiveness != set.effectiveness),
            ("jetMoment", start.jet_moments != set.jet_moments),
        ];
        let given = given.into_iter().find_map(|(name, is_set)| is_set.then_some(name));
        given.map_or(Ok(()), |name| {
            Err(Failure::Error(format!(
                "{name} is set, but vehicle.file gives surfaces and jets: leave {name} at its start value"
            )))
        })
    }

    fn design(&self) -> Result<Allocator, Failure> {
        let allocator = Allocator::new(self.in_force());
        allocator.map_err(|error| Failure::Error(error.to_string()))
    }

    fn is_designed(&self, allocator: &Allocator) -> bool {
        *allocator.settings() == self.in_force()
    }

    fn period(allocator: &Allocator) -> f64 {
        allocator.period()
    }

    fn evaluate(&self, allocator: &mut Allocator, ticks: &mut Ticks<Self>) -> Result<(), Failure> {
        let command = self.command;
        if !(command.moment.iter().all(|value| value.is_finite())
            && command.dynamic_pressure.is_finite())
        {
            return Err(Failure::Error("moment or dynamicPressure is not a finite number".into()));
        }
        if !(command.alpha.is_finite() && command.mach.is_finite()) {
            return Err(Failure::Error("flow.alpha or flow.mach is not a finite number".into()));
        }
        let has_tables = !allocator.settings().effectors.tables.is_empty();
        // Importers read outputs before they have set the connected inputs.
        if has_tables && command.mach <= 0.0 && ticks.has_committed() {
            let text = "flow.mach is 0, but surfaces of vehicle.file have tables over the Mach number: connect flow.mach and flow.alpha";
            return Err(Failure::Error(text.into()));
        }
        ticks.evaluate_with(command, |memory, tick| allocator.update(memory, tick, &command));
        Ok(())
    }

    fn problem(&self, before: &Self) -> Option<&'static str> {
        self.own.problem(&before.own)
    }

    fn warning(before: &Memory, after: &Memory) -> Option<&'static str> {
        (after.report.fallbacks > before.report.fallbacks).then_some(
            "the optimisation failed: the previous allocation is kept (see solver.fallbacks)",
        )
    }

    fn show(&mut self, _time: f64, _allocator: &Allocator, ((), memory): ((), &Memory)) {
        self.output = Output::from(memory);
    }
}

type Variables = VariableTable<ControlAllocator>;

const INPUTS: [&str; 6] =
    ["moment.x", "moment.y", "moment.z", "dynamicPressure", "flow.alpha", "flow.mach"];

fn inputs(mut table: Variables) -> Variables {
    for (i, (axis, meaning)) in AXES.into_iter().enumerate() {
        let common = input(&format!("moment.{axis}"), &format!("Commanded {meaning} moment"));
        table =
            table.real(common.real().unit("N.m").nominal(1e5), move |m| &mut m.command.moment[i]);
    }
    let pressure = input(
        "dynamicPressure",
        "Dynamic pressure, to which the moments of the surfaces are proportional",
    );
    let flow = |name: &str, text: &str| {
        let text =
            format!("{text}, on which the moments of surfaces with tables in vehicle.file depend");
        input(name, &text).optional().real()
    };
    table
        .real(pressure.real().unit("Pa").min(0.0).nominal(1e3), |m| &mut m.command.dynamic_pressure)
        .real(flow("flow.alpha", "Angle of attack").unit("rad").nominal(0.1), |m| {
            &mut m.command.alpha
        })
        .real(flow("flow.mach", "Mach number").min(0.0).nominal(10.0), |m| &mut m.command.mach)
}

fn sampled(name: &str, text: &str) -> Common {
    discrete_output(name, text).depends_on(INPUTS)
}

fn outputs(mut table: Variables) -> Variables {
    for (i, name) in Effectors::published().names.iter().enumerate() {
        let common =
            sampled(&format!("surface[{}]", i + 1), &format!("Commanded deflection of the {name}"));
        table =
            table.real(common.real().unit("rad").nominal(0.1), move |m| &mut m.output.surfaces[i]);
    }
    for i in 0..JETS {
        let text = format!(
            "Command to jet {}: 1 for on and 0 for off, or the duty cycle with jets = duty",
            i + 1
        );
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
        "moment achieved by the last allocation, with the jets' duty cycles before modulation",
        |m| &mut m.output.achieved,
    );
    let table = moment(
        table,
        "residual",
        "moment missing in the last allocation: commanded minus achieved, before modulation",
        |m| &mut m.output.residual,
    );
    let table = moment(
        table,
        "modulatedMoment",
        "moment of the present commands to surfaces and jets, after modulation",
        |m| &mut m.output.modulated,
    );
    let table =
        moment(table, "momentBySurfaces", "moment of the surfaces in the last allocation", |m| {
            &mut m.output.by_surfaces
        });
    let status = sampled("solver.status", AllocationStatus::TEXT);
    let iterations = sampled("solver.iterations", "Number of iterations in the last allocation");
    let fallbacks = sampled("solver.fallbacks", "Number of allocations so far that failed");
    let time = sampled("solver.time", "Wall-clock time of the last allocation; not reproducible");
    table
        .choice(status, |m| &mut m.output.report.status)
        .integer(iterations, (None, None), |m| &mut m.output.report.iterations)
        .integer(fallbacks, (None, None), |m| &mut m.output.report.fallbacks)
        .real(time.real().unit("s").nominal(1e-4), |m| &mut m.output.report.time)
}

fn moment(
    mut table: Variables,
    name: &str,
    text: &str,
    field: impl Fn(&mut ControlAllocator) -> &mut Vector3<f64> + Copy + Send + Sync + 'static,
) -> Variables {
    for (i, (axis, meaning)) in AXES.into_iter().enumerate() {
        let common = sampled(&format!("{name}.{axis}"), &format!("{} {text}", capital(meaning)));
        table = table.real(common.real().unit("N.m").nominal(1e5), move |m| &mut field(m)[i]);
    }
    table
}

/// Returns the condition under which a surface is used.
fn allowed(surface: usize) -> String {
    format!("surfaceAllowed[{}] = true", surface + 1)
}

/// Returns the condition under which a surface has an effect if it is used.
fn gives_moment(surface: usize) -> String {
    let axes = [1, 2, 3].map(|axis| format!("surfaceMoment[{axis},{}] != 0", surface + 1));
    format!("({})", axes.join(" or "))
}

fn effectors(mut table: Variables) -> Variables {
    let names = Effectors::published().names;
    let limit = |name: &str, i: usize, text: &str| {
        let mut condition = allowed(i);
        if name == "surfaceRate" {
            condition = format!("{condition} and {}", gives_moment(i));
        }
        parameter(&format!("limit.{name}[{}]", i + 1), &format!("{text} of the {}", names[i]))
            .used_with(&condition)
            .real()
    };
    for i in 0..SURFACES {
        let declaration = limit("surfaceMin", i, "Lower limit on the deflection")
            .unit("rad")
            .max(0.0)
            .nominal(0.1);
        table = table.real(declaration, move |m| &mut m.settings.effectors.min[i]);
    }
    for i in 0..SURFACES {
        let declaration = limit("surfaceMax", i, "Upper limit on the deflection")
            .unit("rad")
            .min(0.0)
            .nominal(0.1);
        table = table.real(declaration, move |m| &mut m.settings.effectors.max[i]);
    }
    for i in 0..SURFACES {
        let declaration =
            limit("surfaceRate", i, "Upper limit on the magnitude of the deflection rate");
        let declaration = declaration.unit("rad/s").min(0.0).nominal(0.1);
        table = table.real(declaration, move |m| &mut m.settings.effectors.rate[i]);
    }
    for (i, name) in names.iter().enumerate() {
        let text = format!("Whether the {name} may be used; otherwise it is kept at zero");
        let common = parameter(&format!("surfaceAllowed[{}]", i + 1), &text);
        let common = common.used_with(&gives_moment(i));
        table = table.boolean(common, move |m| &mut m.settings.effectors.allowed[i]);
    }
    let pressure =
        parameter("dynamicPressure.reference", "Dynamic pressure for which surfaceMoment is given");
    table = table.real(pressure.real().unit("Pa").min(0.0).nominal(1e3), |m| {
        &mut m.settings.effectors.reference_pressure
    });
    for (i, (_, meaning)) in AXES.into_iter().enumerate() {
        for (j, name) in names.iter().enumerate() {
            let text =
                format!("{} moment per deflection of the {name} (matrix D_A)", capital(meaning));
            let common = parameter(&format!("surfaceMoment[{},{}]", i + 1, j + 1), &text);
            let common = common.used_with(&allowed(j));
            table = table.real(common.real().unit("N.m/rad").nominal(1e5), move |m| {
                &mut m.settings.effectors.effectiveness[(i, j)]
            });
        }
    }
    for (i, (_, meaning)) in AXES.into_iter().enumerate() {
        for j in 0..JETS {
            let text = format!(
                "{} moment of jet {} at full thrust (matrix D_RCS)",
                capital(meaning),
                j + 1
            );
            let common = parameter(&format!("jetMoment[{},{}]", i + 1, j + 1), &text);
            table = table.real(common.real().unit("N.m").nominal(1e4), move |m| {
                &mut m.settings.effectors.jet_moments[(i, j)]
            });
        }
    }
    table
}
