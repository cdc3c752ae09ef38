//! `EntryGuidance`: the reference of the attitude along an entry flight.

use control::guidance::{Command, Guidance, Memory, Navigation, PERIOD, Settings};
use controller_export::own_vehicle::OwnVehicle;
use controller_export::sampled::{SampledFmu, SampledInstance, Ticks};
use fmi_export::{Context, Description, Failure, SettingsFile, VariableTable};
use model_description::DefaultExperiment;
use serde::{Deserialize, Serialize};
use settings::Declared;
use vehicle::entry::Start;

/// The guidance as an FMU.
pub type EntryGuidance = SampledFmu<GuidanceInstance>;

/// An instance of the guidance: its inputs, outputs and parameters.
#[derive(Serialize, Deserialize, Declared)]
pub struct GuidanceInstance {
    #[setting(name = "", input)]
    pub(crate) navigation: Navigation,
    #[setting(name = "", output, discrete, depends_on = ["*"])]
    pub(crate) output: Output,
    #[setting(name = "")]
    pub(crate) settings: Settings,
    #[setting(name = "")]
    pub(crate) own: OwnVehicle,
    #[setting(name = "")]
    pub(crate) file: SettingsFile,
}

/// Outputs of the guidance.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize, Declared)]
pub(crate) struct Output {
    #[setting(name = "")]
    pub(crate) command: Command,
    /// Share of limit.{} that is left.
    #[setting(each = LIMITS)]
    margins: [f64; 3],
    /// Number of bank reversals so far.
    #[setting(min = 0)]
    reversals: u64,
}

const LIMITS: [(&str, &str); 3] =
    [(".heatFlux", "heatFlux"), (".load", "load"), (".pressure", "pressure")];

/// Longest flight that is expected, s.
const LONGEST: f64 = 3000.0;

impl SampledInstance for GuidanceInstance {
    type Device = Guidance;
    type Memory = Memory;
    type Input = Navigation;
    type Output = ();

    fn description() -> Description<EntryGuidance> {
        let table = VariableTable::new(|m: &mut EntryGuidance| &mut **m);
        Description {
            documentation: include_str!("guidance.html").into(),
            version: env!("CARGO_PKG_VERSION"),
            default_experiment: DefaultExperiment {
                stop: LONGEST,
                step: PERIOD,
                ..DefaultExperiment::default()
            },
            ..Description::new(
                "EntryGuidance",
                "Guidance of an entry flight to the terminal area by a predictor-corrector, Lu (2014)",
                table,
            )
        }
    }

    fn new() -> Self {
        Self {
            settings: Settings::default(),
            own: OwnVehicle::default(),
            file: SettingsFile::default(),
            navigation: Navigation { motion: Start::default().motion(), ..Navigation::default() },
            output: Output::default(),
        }
    }

    fn load(&mut self, context: &Context) -> Result<(), Failure> {
        self.file.clone().read(self, context)?;
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

    fn evaluate(
        &self,
        guidance: &mut Guidance,
        ticks: &mut Ticks<Self>,
        _is_stale: bool,
    ) -> Result<(), Failure> {
        let navigation = self.navigation;
        ticks.evaluate_with(navigation, |memory, tick| {
            guidance.update(memory, tick, &navigation);
        });
        Ok(())
    }

    fn show(&mut self, _time: f64, _guidance: &Guidance, ((), memory): ((), &Memory)) {
        let (command, reversals) = (memory.command, memory.reversals);
        let margins = command.loads.margins(&self.settings.limit);
        let margins = [margins.heat_flux, margins.load, margins.pressure];
        self.output = Output { command, margins, reversals };
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
