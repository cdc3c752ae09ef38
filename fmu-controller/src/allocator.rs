//! `ControlAllocator` divides the commanded moment among surfaces and jets.

use control::allocation::{Allocator, Command, Memory, Settings};
use controller_export::own_vehicle::OwnVehicle;
use controller_export::sampled::{SampledFmu, SampledInstance, Ticks};
use fmi_export::{Context, Description, Failure, VariableTable};
use model_description::DefaultExperiment;
use serde::{Deserialize, Serialize};
use settings::Declared;
use vehicle::Scenario;

/// The allocator as an FMU.
pub type ControlAllocator = SampledFmu<AllocatorInstance>;

/// An instance of the allocator: its inputs, outputs and parameters.
#[derive(Serialize, Deserialize, Declared)]
pub struct AllocatorInstance {
    #[setting(name = "", input)]
    pub(crate) command: Command,
    #[setting(name = "", output, discrete, depends_on = ["*"])]
    pub(crate) output: Memory,
    #[setting(name = "")]
    pub(crate) settings: Settings,
    #[setting(name = "")]
    pub(crate) own: OwnVehicle,
}

impl AllocatorInstance {
    /// Returns the settings with the surfaces and jets that are in force.
    fn in_force(&self) -> Settings {
        let effectors = self.own.vehicle().effectors.clone().unwrap_or_default();
        Settings { effectors, ..self.settings.clone() }
    }
}

impl SampledInstance for AllocatorInstance {
    type Device = Allocator;
    type Memory = Memory;
    type Input = Command;
    type Output = ();

    fn description() -> Description<ControlAllocator> {
        let table = VariableTable::new(|m: &mut ControlAllocator| &mut **m);
        let table = table.and(|m| &mut m.settings.pwpf);
        Description {
            documentation: include_str!("allocator.html").into(),
            version: env!("CARGO_PKG_VERSION"),
            default_experiment: DefaultExperiment {
                stop: Scenario::crmpc2022().duration,
                step: Settings::published().period,
                ..DefaultExperiment::default()
            },
            ..Description::new(
                "ControlAllocator",
                "Control allocation to eight surfaces and ten jets of Wu et al. (2015), with the selector of Jia et al.",
                table,
            )
        }
    }

    fn new() -> Self {
        let settings = Settings::published();
        let dynamic_pressure = settings.effectors.reference_pressure;
        Self {
            settings,
            own: OwnVehicle::default(),
            command: Command { dynamic_pressure, ..Command::default() },
            output: Memory::default(),
        }
    }

    fn load(&mut self, context: &Context) -> Result<(), Failure> {
        self.own.load(context)?;
        if self.own.vehicle().effectors.is_some() {
            return Ok(());
        }
        let text = "vehicle.file gives neither surfaces nor jets, which the allocator needs";
        Err(Failure::Error(text.into()))
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

    fn evaluate(
        &self,
        allocator: &mut Allocator,
        ticks: &mut Ticks<Self>,
        _is_stale: bool,
    ) -> Result<(), Failure> {
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
        let time = ticks.next_time();
        ticks.evaluate_with(command, |memory, tick| {
            allocator.update(memory, tick, time, &command);
        });
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
        self.output = *memory;
    }
}
