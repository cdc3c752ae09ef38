//! `EntryNavigation`: motion, attitude and wind along an entry flight, from inertial sensors,
//! satellite navigation and star tracker, and from the forces of the air.

use control::navigation::{Contradiction, Health, Line, Memory, Navigation, Settings, Shown};
use controller_export::own_vehicle::OwnVehicle;
use controller_export::sampled::{SampledFmu, SampledInstance, Ticks};
use fmi_export::{Context, Description, Failure, SettingsFile, VariableTable};
use model_description::DefaultExperiment;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use settings::Declared;
use vehicle::axes::{LETTERS, QUATERNION};
use vehicle::fixes::{Fixes, GnssFix, StarFix};

/// The navigation as an FMU.
pub type EntryNavigation = SampledFmu<NavigationInstance>;

/// An instance of the navigation: its inputs, outputs and parameters.
#[derive(Serialize, Deserialize, Declared)]
pub struct NavigationInstance {
    #[setting(name = "", input)]
    pub(crate) input: Input,
    #[setting(name = "", output, discrete, depends_on = ["*"])]
    pub(crate) shown: Shown,
    #[setting(output, depends_on = ["*"])]
    health: Health,
    #[setting(output, depends_on = ["*"])]
    contradiction: Contradiction,
    #[setting(name = "")]
    pub(crate) settings: Settings,
    #[setting(name = "")]
    own: OwnVehicle,
    #[setting(name = "")]
    pub(crate) file: SettingsFile,
}

/// Inputs of the navigation, which are outputs of the plant.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize, Declared)]
pub(crate) struct Input {
    /// Angular rate measured about {}.
    #[setting(name = "measured.gyroscope", each = LETTERS, unit = "rad/s", nominal = 0.05)]
    rate: Vector3<f64>,
    /// Specific force measured along {}.
    #[setting(name = "measured.accelerometer", each = LETTERS, unit = "m/s2", nominal = 10.0)]
    force: Vector3<f64>,
    /// Time at which the latest sample or fix was taken.
    #[setting(name = "measured.time", unit = "s", nominal = 1.0)]
    time: f64,
    /// Number of the latest sample or fix, counted from 1; 0 before the first.
    #[setting(name = "measured.sample", min = 0)]
    sample: i32,
    /// Position by satellite navigation along planet-fixed {}.
    #[setting(name = "gnss.position", each = LETTERS, unit = "m", nominal = 1e6)]
    position: Vector3<f64>,
    /// Velocity by satellite navigation along planet-fixed {}.
    #[setting(name = "gnss.velocity", each = LETTERS, unit = "m/s", nominal = 1e3)]
    velocity: Vector3<f64>,
    /// Time at which the latest sample or fix was taken.
    #[setting(name = "gnss.time", unit = "s", nominal = 1.0)]
    gnss_time: f64,
    /// Number of the latest sample or fix, counted from 1; 0 before the first.
    #[setting(name = "gnss.fix", min = 0)]
    gnss_fix: i32,
    /// Part {} of the star tracker's quaternion from inertial to body axes.
    #[setting(name = "star.attitude", each = QUATERNION, nominal = 1.0)]
    attitude: [f64; 4],
    /// Time at which the latest sample or fix was taken.
    #[setting(name = "star.time", unit = "s", nominal = 1.0)]
    star_time: f64,
    /// Number of the latest sample or fix, counted from 1; 0 before the first.
    #[setting(name = "star.fix", min = 0)]
    star_fix: i32,
}

impl Input {
    fn line(&self) -> Line {
        let Self { rate, force, time, sample, position, velocity, attitude, .. } = *self;
        let gnss = GnssFix { position, velocity, time: self.gnss_time, number: self.gnss_fix };
        let star = StarFix { attitude, time: self.star_time, number: self.star_fix };
        Line { sample, time, rate, force, fixes: Fixes { gnss, star } }
    }
}

/// Longest flight that is expected, s.
const LONGEST: f64 = 3000.0;

impl SampledInstance for NavigationInstance {
    type Device = Navigation;
    type Memory = Memory;
    type Input = Line;
    type Output = ();

    fn description() -> Description<EntryNavigation> {
        Description {
            documentation: include_str!("navigation.html").into(),
            version: env!("CARGO_PKG_VERSION"),
            default_experiment: DefaultExperiment {
                stop: LONGEST,
                step: Settings::default().period,
                ..DefaultExperiment::default()
            },
            ..Description::new(
                "EntryNavigation",
                "Navigation of an entry flight by strapdown and Kalman filter, with the wind by the side force and the altitude by the drag",
                VariableTable::new(|m: &mut EntryNavigation| &mut **m),
            )
        }
    }

    fn new() -> Self {
        Self {
            settings: Settings::default(),
            own: OwnVehicle::default(),
            file: SettingsFile::default(),
            // The air at the start of the flight, so that the navigation moves without a plant.
            input: Input { force: Vector3::new(0.0, 0.0, -1e-3), ..Input::default() },
            shown: Shown::default(),
            health: Health::default(),
            contradiction: Contradiction::default(),
        }
    }

    fn load(&mut self, context: &Context) -> Result<(), Failure> {
        self.file.clone().read(self, context)?;
        self.own.load(context)
    }

    fn design(&self) -> Result<Navigation, Failure> {
        let aerodynamics = self.own.vehicle().aerodynamics.clone();
        Navigation::of(self.settings, aerodynamics)
            .map_err(|error| Failure::Error(error.to_string()))
    }

    fn problem(&self, before: &Self) -> Option<&'static str> {
        self.own.problem(&before.own)
    }

    fn is_designed(&self, navigation: &Navigation) -> bool {
        *navigation.settings() == self.settings
            && *navigation.aerodynamics() == self.own.vehicle().aerodynamics
    }

    fn period(navigation: &Navigation) -> f64 {
        navigation.settings().period
    }

    fn memory(navigation: &Navigation) -> Memory {
        navigation.memory()
    }

    fn evaluate(
        &self,
        navigation: &mut Navigation,
        ticks: &mut Ticks<Self>,
        _is_stale: bool,
    ) -> Result<(), Failure> {
        let line = self.input.line();
        let time = ticks.next_time();
        ticks.evaluate_with(line, |memory, _| navigation.update(memory, time, &line));
        Ok(())
    }

    fn show(&mut self, _time: f64, _navigation: &Navigation, ((), memory): ((), &Memory)) {
        (self.shown, self.health) = (memory.shown, memory.health);
        self.contradiction = memory.contradiction;
    }

    fn warning(before: &Memory, after: &Memory) -> Option<&'static str> {
        let becomes = |health: Health| after.health == health && before.health != health;
        if becomes(Health::Lost) {
            Some("no sample has arrived for half a second: the navigation is lost (see health)")
        } else if before.missed == 0 && after.missed > 0 {
            Some(
                "a sample never arrived: it was lost, or the plant's sensor.period is shorter than period, so that the noise of the samples is another one than the filter expects",
            )
        } else if becomes(Health::Degraded) {
            Some(
                "the attitude is known worse than health.deviation asks for: the inertial sensors cannot bridge the time without fixes (see health and deviation.*)",
            )
        } else if becomes(Health::Inconsistent) {
            Some(
                "the fixes contradict what the filter expects: sensor.set, the noise of fixes or the initial state is not that of the plant (see health, contradiction and innovation.*)",
            )
        } else if becomes(Health::Suspect) {
            Some(
                "a sensor contradicts itself, or an estimate what is known beforehand (see health and contradiction)",
            )
        } else {
            None
        }
    }
}
